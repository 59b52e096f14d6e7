"""One section of the page of peers anew: `python -m benchmarks.peers carts --markdown benchmarks/peers.md`."""

from __future__ import annotations

import argparse
import os
import sys
from datetime import UTC, datetime
from pathlib import Path

from benchmarks.peers import SECTIONS, renewed, section


def main() -> int:
    """Run what is named, print it, and put it in the place of the old one."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=__doc__)
    parser.add_argument("name", choices=SECTIONS, help="which section")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="page whose section is renewed")
    asked = parser.parse_args()
    if not (data := os.environ.get("UPRIGHT_REAL_DATA")):
        parser.error("the logs of real rigs are needed: set UPRIGHT_REAL_DATA to their folder.")
    written = section(asked.name, Path(data), [], lambda what: print(what, file=sys.stderr))
    today = datetime.now(UTC)
    written += ["", f"This section was run by itself on {today.day} {today:%B %Y}."]
    print("\n".join(written))
    if asked.markdown:
        text = asked.markdown.read_text(encoding="utf-8")
        asked.markdown.write_text(renewed(text, asked.name, written), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
