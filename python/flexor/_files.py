"""Tables of `flexor`, files written whole, errors in one line."""
import argparse
import importlib.metadata
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pandas as pd


def version() -> str:
    """The installed package's; without one it runs from a source tree."""
    try:
        return importlib.metadata.version("flexor")
    except importlib.metadata.PackageNotFoundError:
        return "from source"


def read_table(path) -> pd.DataFrame:
    """A CSV as `flexor` writes it, its index `t_s` in seconds. Raises ValueError without such a column or without rows."""
    try:
        frame = pd.read_csv(path, skipinitialspace=True)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is no CSV: {error}") from error
    if "t_s" not in frame or frame.empty:
        raise ValueError(f"{path}: rows with a column t_s, in seconds, are needed")
    return frame.set_index("t_s")


@contextmanager
def replacing(path) -> Iterator[Path]:
    """A file to write beside `path`, which then takes its place; after an error `path` is as it was."""
    path = Path(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}")  # opened as any file is: who may read it is the user's umask
    try:
        yield beside
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def write_json(path, document, **style) -> None:
    with replacing(path) as file:
        file.write_text(json.dumps(document, **(style or {"indent": 2})) + "\n", "utf-8")


def run_command(parser: argparse.ArgumentParser, job: Callable[[argparse.Namespace], None]) -> None:
    """Ends with 2 and one line for what the user can mend."""
    options = parser.parse_args()
    try:
        job(options)
    except (ValueError, OSError, RuntimeError) as error:  # RuntimeError: flexor.JobError
        print(f"{parser.prog}: {error}", file=sys.stderr)
        raise SystemExit(2) from error
