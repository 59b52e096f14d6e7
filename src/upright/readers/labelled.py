"""Rows in which numbers have their name or unit beside them, as bare numbers: what serial monitors and plotters show.

``theta:0.31,psi:-2``, ``time = 0.01 s; angle = 3,1 deg``, ``{"t": 0.01, "theta": 0.31}``, ``(0.01, 0.31)``, and
MATLAB's ``0.01 sec,0.31``. Arduino's monitor may have put the time of arrival before them, ``15:03:12.345 -> ``.
"""

from __future__ import annotations

import re
from collections import Counter
from itertools import pairwise

from upright.records.columns import time_scale

_LOOKED = 40  # lines that show how rows are written
_NUMBER = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)(?![a-z])"
_CELL = re.compile(
    rf'\s*(?:"?(?P<name>[^\W\d][^:=,;\t"]*?)"?\s*[:=]\s*)?(?P<number>{_NUMBER})'
    r"\s*(?P<unit>[^\W\d_][\w/*^²³·.-]*|[°%][\w/]*)?\s*",
    re.IGNORECASE,
)
_BESIDE = re.compile(r"\s+(?=[^\W\d][^\s:=]*\s*[:=])")
_ARRIVED = re.compile(r"^(\d\d:\d\d:\d\d[.,]\d{3}) -> ?", re.MULTILINE)
_BRACKETS = {"(": ")", "[": "]", "{": "}"}

Label = tuple[str, str]
"""Name and unit of a cell, as its row states them; empty where it does not."""


def bare_rows(text: str) -> tuple[str, tuple[Label, ...]]:
    """The text with rows of bare numbers, line for line, and what they stated of each; nothing where they are bare."""
    rows = [_Row(line) for line in text[: _LOOKED * 400].split("\n", _LOOKED)[:_LOOKED]]
    stated = Counter(row.labels for row in rows if row.cells)
    if not any(row.bracketed or any(map(any, row.labels)) for row in rows if row.cells):
        return text, ()
    labels, _ = stated.most_common(1)[0]

    def bare(line: str) -> str:
        row = _Row(line)
        return row.numbers if row.labels == labels else line

    return "\n".join(map(bare, text.split("\n"))), labels


class _Row:
    """Cells of a line; none where one of them is no number with its name and unit."""

    def __init__(self, line: str) -> None:
        inside = line.strip().removesuffix(",")
        self.bracketed = inside[:1] in _BRACKETS and inside[-1:] == _BRACKETS[inside[:1]]
        inside = inside[1:-1] if self.bracketed else inside
        self.apart = next((mark for mark in ";\t," if mark in inside), "")
        matches = [
            _CELL.fullmatch(cell) for cell in (inside.split(self.apart) if self.apart else _BESIDE.split(inside))
        ]
        self.cells = [cell for cell in matches if cell] if all(matches) else []

    @property
    def labels(self) -> tuple[Label, ...]:
        return tuple((cell["name"] or "", cell["unit"] or "") for cell in self.cells)

    @property
    def numbers(self) -> str:
        return (self.apart or " ").join(cell["number"] for cell in self.cells)


def without_arrival(text: str) -> tuple[str, bool]:
    """The text without the times at which a monitor got its lines, and whether these are its only clock, and stay."""
    if _ARRIVED.search(text, 0, 4096) is None:
        return text, False
    sent = _ARRIVED.sub("", text)
    if _has_clock(sent):
        return sent, False
    apart = next((mark for mark in ";\t," if mark in sent[:4096]), ";")
    return _ARRIVED.sub(rf"\1{apart}", text), True


def _has_clock(text: str) -> bool:
    """Whether a column of the first rows is called like a time, or the first of several increases."""
    rows, labels = bare_rows("\n".join(text.split("\n", 200)[:200]))
    names = [name for name, _ in labels]
    first: list[float] = []
    for row in rows.split("\n"):
        cells = [cell.strip() for cell in re.split(r"[,;\t]|\s+", row.strip())]
        if re.fullmatch(_NUMBER, cells[0], re.IGNORECASE):
            first += [float(cells[0].replace(",", "."))] * (len(cells) > 1)
        elif not labels:
            names = cells
    increases = len(first) > 1 and all(a < b for a, b in pairwise(first))
    return increases or any(map(time_scale, names))
