"""The compiled module, how its jobs show their progress, files written whole, and errors in one line."""

import argparse
import contextlib
import functools
import importlib
import json
import re
import sys
from typing import Any, Callable, Iterator, Optional, Union

try:
    import flexor._flexor as core
except ModuleNotFoundError:  # as it is built, beside the sources
    import _flexor as core  # type: ignore[no-redef]

InputError = core.InputError
JobError = core.JobError
FINGERS = ("thumb", "index", "middle", "ring", "pinky")
_ARGUMENTS = {"rate": "rate_hz", "lead": "lead_s", "clock-offset": "clock_offset_s", "log-rate": "log_rate_hz", "time-limit": "time_limit_s",
              "estimate-offset": "Recording.shifted"}


def _in_python(error: Exception) -> str:
    """Rooms name the command's options, which are arguments here. A message that shows a command keeps them."""
    text = str(error.args[0]) if error.args else ""
    if re.search(r"flexor [a-z]+ ", text):
        return text
    return re.sub(r"(?<![^\s\"'(;:,])--([a-z]+(?:-[a-z]+)*)", lambda m: _ARGUMENTS.get(m[1], m[1].replace("-", "_")), text)


InputError.__str__ = JobError.__str__ = _in_python
__version__: str = core.version

Show = Union[None, bool, Callable[[int, int, str], object]]


def needed(module: str) -> Any:
    """What not all of the package needs."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise ImportError(f"this needs {module}: pip install {module.partition('.')[0].replace('sklearn', 'scikit-learn')}") from None


pandas = functools.partial(needed, "pandas")  # of results as frames


def filled(request: Any, **fields: Any) -> Any:
    """A room's request with these fields."""
    for name, value in fields.items():
        try:
            setattr(request, name, value)
        except TypeError:
            raise InputError(f"{name}: {value!r:.60} is of a kind that it does not take") from None
    return request


def run(job: Callable[..., Any], *given: Any, progress: Show) -> Any:
    """A job of the rooms, which shows how far it is."""
    with shown(progress) as show:
        try:
            return job(*given, show)
        except TypeError as error:  # nanobind's, whose text is C++
            if "incompatible function arguments" not in str(error):
                raise
            raise InputError(f"{job.__name__}: does not take these: " + ", ".join(f"{one!r:.40}" for one in given)) from None


@contextlib.contextmanager
def shown(progress: Show) -> Iterator[Optional[Callable[[int, int, str], object]]]:
    """What a job calls with (done, of, what): the caller's own function; none for False; else a bar of tqdm, where that is
    installed and somebody looks, from the second second on."""
    if callable(progress) or progress is False:
        yield progress or None
        return
    try:
        from tqdm.auto import tqdm
    except ImportError:
        yield None
        return
    with tqdm(delay=2, leave=False, disable=None if progress is None else False) as bar:

        def show(done: int, of: int, what: str) -> None:
            bar.total = of or None
            bar.n = done
            bar.set_description(what, refresh=False)
            bar.update(0)

        yield show


def write_text(path, text: str) -> None:
    """After an error `path` is as it was."""
    core.write_file(path, text.encode())


def write_json(path, document, **style) -> None:
    write_text(path, json.dumps(document, **(style or {"indent": 2})) + "\n")


@contextlib.contextmanager
def options_of(parser: argparse.ArgumentParser) -> Iterator[argparse.Namespace]:
    """For a command's job: ends with 2 and one line for what the user can mend."""
    options = parser.parse_args()
    try:
        yield options
    except (ValueError, OSError, ImportError, RuntimeError) as error:  # RuntimeError: flexor.JobError
        print(f"{parser.prog}: {error}", file=sys.stderr)
        raise SystemExit(2) from error
