"""The command ``flexor``, which the wheel carries: python -m flexor live --demo"""

import os
import pathlib
import shutil
import signal
import subprocess
import sys


def main() -> None:
    folder = pathlib.Path(__file__).with_name("bin")
    program = os.environ.get("FLEXOR_PROGRAM") or shutil.which("flexor", path=folder)
    if program is None:
        sys.exit(f"flexor: {folder} has no program: install the wheel again")
    if os.name != "nt":
        os.execv(program, ["flexor", *sys.argv[1:]])
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the program's: no process becomes another there
    sys.exit(subprocess.call([program, *sys.argv[1:]]))


if __name__ == "__main__":
    main()
