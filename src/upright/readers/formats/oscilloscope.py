"""Record of what an oscilloscope's screen showed, as the makers export it: Keysight, Rigol, Siglent, Tektronix.

Each has its own way to say what a channel is called and in which unit it is; of newer ones, which write a line of
names above the rows as everybody does, the table's reader takes care. A channel is a voltage until a study says what a
volt stands for (`scale`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upright.readers.reader import Reader
from upright.readers.source import Source, TextTable
from upright.records import Array, Record
from upright.records.columns import stated_unit

_HEAD = 4096  # characters that hold what a maker writes above the rows
_BESIDE = re.compile(r"Record Length,[^,\n]*,,[^,\n]*,[^,\n]*,")
"""Tektronix TDS: two cells of header and an empty one beside each of the first rows, then time and value."""
_SEQUENCE = re.compile(r"X,.*,Start,Increment,?\s*\nSequence,")
"""Rigol: rows are counted, and the line of units ends with the first time and the step."""
_TWO_LINES = re.compile(r"(?:^|\n)(?:x-axis,|Source,)[^\n]*\n[Ss]econd,")
"""Keysight, Siglent: channels in one line, units in the next."""


@dataclass(frozen=True, kw_only=True)
class _Screen:
    """Names and units of the channels, and the rows, whose first column is the time where nothing else says it."""

    names: list[str]
    units: list[str]
    rows: list[str]
    first_line: int
    start: float = 0.0
    step: float = 0.0


def read(source: Source) -> Record:
    """Record of one screen; its time runs from before the trigger, which is at 0."""
    head, lines = source.text[:_HEAD], source.text.rstrip().split("\n")
    layout = _beside if _BESIDE.match(head) else _counted if _SEQUENCE.match(head) else _above
    screen = layout(source, lines)
    if len(screen.names) != len(screen.units):
        raise source.bad(
            f"expected a unit for each channel, got {len(screen.names)} and {len(screen.units)}; export it again",
            line=max(screen.first_line - 1, 1),
        )
    table = TextTable(
        source=source, text="\n".join(screen.rows), names=("time", *screen.names), delimiter=",",
        first_line=screen.first_line,
    ).numbers()  # fmt: skip
    t: Array = screen.start + screen.step * table[:, 0] if screen.step else table[:, 0]
    source.must_increase(t, lambda row: {"line": screen.first_line + row, "column": 1})
    return Record(
        t=t, signals={name: table[:, j] for j, name in enumerate(screen.names, start=1)},
        units={name: stated_unit(f"{name} ({unit})") for name, unit in zip(screen.names, screen.units, strict=True)},
        provenance=source.provenance("oscilloscope"),
    )  # fmt: skip


def _beside(_: Source, lines: Sequence[str]) -> _Screen:
    cells = [line.split(",") for line in lines]
    header = {row[0].strip(): row[1].strip() for row in cells if row[0].strip()}
    return _Screen(
        names=[header.get("Source", "CH1")], units=[header.get("Vertical Units", "")], first_line=1,
        rows=[",".join(_filled(row[3:])) for row in cells],
    )  # fmt: skip


def _counted(source: Source, lines: Sequence[str]) -> _Screen:
    names, units = (_filled(line.split(",")) for line in lines[:2])
    try:
        start, step = map(float, units[-2:])
    except ValueError:
        start = step = 0.0
    if not step > 0 or not np.isfinite(start + step):
        raise source.bad("expected the first time and the step behind the units, as Rigol writes them", line=2)
    return _Screen(
        names=names[1:-2], units=units[1:-2], rows=[",".join(_filled(line.split(","))) for line in lines[2:]],
        first_line=3, start=start, step=step,
    )  # fmt: skip


def _above(source: Source, lines: Sequence[str]) -> _Screen:
    at = next((i for i, line in enumerate(lines) if i and line.lower().startswith("second,")), 0)
    if not at:
        raise source.bad("expected the header of an oscilloscope's export, got none; leave out the reader")
    names, units = ([cell.strip() for cell in line.split(",")][1:] for line in lines[at - 1 : at + 1])
    named = [f"CH{name}" if name.isdecimal() else name for name in names]
    return _Screen(names=named, units=units, rows=list(lines[at + 1 :]), first_line=at + 2)


def _filled(cells: list[str]) -> list[str]:
    """Cells without the empty ones at their end."""
    while cells and not cells[-1].strip():
        cells = cells[:-1]
    return [cell.strip() for cell in cells]


def _recognises(source: Source) -> bool:
    if b"," not in source.data[:_HEAD] or b"\0" in source.data[:_HEAD]:
        return False
    head = source.text[:_HEAD]
    return bool(_BESIDE.match(head) or _SEQUENCE.match(head) or _TWO_LINES.search(head))


READER = Reader(
    name="oscilloscope", files="an oscilloscope's CSV (Keysight, Rigol, Siglent, Tektronix)", recognises=_recognises,
    read=read, order=50,
)  # fmt: skip
