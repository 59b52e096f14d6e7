"""Build what is computed in this folder: `python -m docs [NAMES] [--check]`; the site: `python -m docs build` or `serve`.

Notebooks are run and store what they show, the nomenclature is written from the plants, drawings from pin tables. With --check nothing is
written: it says which cells no longer run, or say something else than what is stored.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import nbformat

from docs import nomenclature
from docs.drawings import IMAGES, drawings
from docs.notebook import CellFailed, differences, executed

HERE = Path(__file__).parent
NOMENCLATURE = HERE / "reference" / "nomenclature.md"
NOTEBOOKS = HERE / "tutorials"


def main() -> int:
    """Run what was asked; 1 when something no longer holds."""
    ask = argparse.ArgumentParser(prog="python -m docs", description=__doc__.splitlines()[0])
    ask.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        help="build or serve for the site, or notebooks such as experiment_4; all of them when left out",
    )
    ask.add_argument(
        "--check", action="store_true", help="compare with what is stored and write nothing"
    )
    ask.add_argument(
        "--quick", action="store_true", help="build without identifying the public rigs"
    )
    ask.add_argument("--port", type=int, default=8000, help="of serve; 0 takes a free one")
    asked = ask.parse_args()
    if asked.names in (["build"], ["serve"]):
        from docs import site

        return (
            site.build(quick=asked.quick)
            if asked.names == ["build"]
            else site.serve(asked.port, quick=asked.quick)
        )
    names = asked.names or sorted(path.stem for path in NOTEBOOKS.glob("*.ipynb"))
    failed = not asked.names and (_nomenclature(asked.check) | _drawings(asked.check))
    for name in names:
        path = NOTEBOOKS / f"{name}.ipynb"
        if not path.is_file():
            ask.error(f"there is no notebook {path.name} in docs/tutorials/")
        stored = nbformat.read(path, as_version=4)
        try:
            fresh = executed(stored)
        except CellFailed as error:
            print(f"{path.name}, {error}", file=sys.stderr)
            failed = True
            continue
        if not asked.check:
            nbformat.write(fresh, path)
            print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
            continue
        for sentence in differences(stored, fresh):
            print(f"{path.name}, {sentence}", file=sys.stderr)
            failed = True
    return int(failed)


def _nomenclature(check: bool) -> bool:
    """Write the table of symbols; when only checked, whether it is out of date."""
    if not check:
        NOMENCLATURE.write_text(nomenclature.page(), encoding="utf-8")
        return False
    stale = NOMENCLATURE.read_text(encoding="utf-8") != nomenclature.page()
    if stale:
        print("nomenclature.md is out of date; run python -m docs.", file=sys.stderr)
    return stale


def _drawings(check: bool) -> bool:
    """Draw wires and rigs; when only checked, whether a drawing is out of date."""
    stale = [
        n
        for n, svg in drawings().items()
        if not (IMAGES / n).is_file() or (IMAGES / n).read_text("utf-8") != svg
    ]
    for name in [] if check else stale:
        (IMAGES / name).write_text(drawings()[name], encoding="utf-8")
    if check and stale:
        print(f"{', '.join(stale)}: out of date; run python -m docs.", file=sys.stderr)
    return check and bool(stale)


if __name__ == "__main__":
    sys.exit(main())
