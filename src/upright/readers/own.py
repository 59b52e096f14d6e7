"""Which record did this package write as text?"""

from __future__ import annotations

import csv

from upright.readers.source import Source
from upright.readers.table import numbers
from upright.records import Record
from upright.records.exchange import CSV_MARK as MARK

__all__ = ["MARK", "read"]


def read(source: Source) -> Record:
    """Record written by `Record.to_csv`, with the line and column of any damage."""
    lines = source.text.split("\n")
    if len(lines) < 4 or not lines[0].startswith(MARK) or not lines[1].startswith("# "):
        raise source.bad(f"expected '{MARK}', a line of units and provenance, names and numbers", line=1)
    try:
        names = next(csv.reader([lines[2]], strict=True), [])
    except csv.Error as error:
        raise source.bad(f"expected a line of names, got a broken quotation ({error})", line=3) from None
    if not names or names[0] != "t" or len(set(names)) < len(names):
        raise source.bad("expected names that differ, the first of them 't'", line=3)
    table = numbers(source, "\n".join(lines[3:]), names=names, delimiter=",", first_line=4)
    return Record.rebuild(table[:, 0], dict(zip(names[1:], table.T[1:], strict=True)), lines[1][2:])
