"""Run every notebook of this folder and store what it shows: `python -m docs [NAMES] [--check]`.

With --check nothing is written: it says which cells no longer run, or say something else than what is stored.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from docs.notebook import CellFailed, differences, executed, read, write

HERE = Path(__file__).parent


def main() -> int:
    """Run what was asked; 1 when something no longer holds."""
    ask = argparse.ArgumentParser(prog="python -m docs", description=__doc__.splitlines()[0])
    ask.add_argument(
        "names", nargs="*", metavar="NAME", help="such as experiment_4; all when left out"
    )
    ask.add_argument(
        "--check", action="store_true", help="compare with what is stored and write nothing"
    )
    asked = ask.parse_args()
    names = asked.names or sorted(path.stem for path in HERE.glob("*.ipynb"))
    failed = False
    for name in names:
        path = HERE / f"{name}.ipynb"
        if not path.is_file():
            ask.error(f"there is no notebook {path.name} in {HERE.name}/")
        stored = read(path)
        try:
            fresh = executed(stored)
        except CellFailed as error:
            print(f"{path.name}, {error}", file=sys.stderr)
            failed = True
            continue
        if not asked.check:
            write(path, fresh)
            print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
            continue
        for sentence in differences(stored, fresh):
            print(f"{path.name}, {sentence}", file=sys.stderr)
            failed = True
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
