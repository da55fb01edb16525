"""Files written whole, errors in one line."""
import argparse
import json
import sys
from collections.abc import Callable

from flexor._core import core


def write_text(path, text: str) -> None:
    """After an error `path` is as it was."""
    core.write_file(path, text.encode())


def write_json(path, document, **style) -> None:
    write_text(path, json.dumps(document, **(style or {"indent": 2})) + "\n")


def run_command(parser: argparse.ArgumentParser, job: Callable[[argparse.Namespace], None]) -> None:
    """Ends with 2 and one line for what the user can mend."""
    options = parser.parse_args()
    try:
        job(options)
    except (ValueError, OSError, RuntimeError) as error:  # RuntimeError: flexor.JobError
        print(f"{parser.prog}: {error}", file=sys.stderr)
        raise SystemExit(2) from error
