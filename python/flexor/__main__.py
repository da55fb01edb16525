"""The command ``flexor``, which the wheel carries: python -m flexor live --demo"""

import os
import pathlib
import sys


def main() -> None:
    program = pathlib.Path(os.environ.get("FLEXOR_PROGRAM") or pathlib.Path(__file__).with_name("bin") / "flexor")
    if not program.exists():
        sys.exit(f"flexor: {program} is missing: install the wheel again")
    os.execv(program, ["flexor", *sys.argv[1:]])


if __name__ == "__main__":
    main()
