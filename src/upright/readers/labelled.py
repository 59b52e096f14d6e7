"""Rows in which numbers have their name or unit beside them, as bare numbers: what serial monitors and plotters show.

``theta:0.31,psi:-2``, ``time = 0.01 s; angle = 3,1 deg``, ``{"t": 0.01, "theta": 0.31}``, ``(0.01, 0.31)``,
``T10 C512 U-3``, and MATLAB's ``0.01 sec,0.31``. Arduino's monitor may have put the time of arrival before them,
``15:03:12.345 -> ``.
"""

from __future__ import annotations

import re
from collections import Counter

from upright.records.columns import time_scale

_LOOKED = 40  # lines that show how rows are written
_NUMBER = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)(?![a-z])"
_CELL = re.compile(
    rf'\s*(?:"?(?P<name>[^\W\d][^:=,;\t"]*?)"?\s*[:=]\s*)?(?P<number>{_NUMBER})'
    r"\s*(?P<unit>[^\W\d_][\w/*^²³·.-]*|[°%][\w/]*)?\s*",
    re.IGNORECASE,
)
_LETTERED = re.compile(rf"\s*(?P<name>[^\W\d_]+)(?P<number>{_NUMBER})(?P<unit>)\s*")
_BESIDE = re.compile(r"\s+(?=[^\W\d][^\s:=]*\s*[:=])")
_ARRIVED = re.compile(r"^(\d\d:\d\d:\d\d[.,]\d{3}) -> ?", re.MULTILINE)
_ROWS = 1000  # lines that show whether the first column is a clock
_CLOCKS = (1.0, 1e-3, 1e-6)  # seconds per count
_LONG, _SAME = 0.05, 0.2  # s and share: lines arrive some 10 ms late, and no two clocks are so alike
_APART = r"[,;\t]|\s+"
_BRACKETS = {"(": ")", "[": "]", "{": "}"}

Label = tuple[str, str]
"""Name and unit of a cell, as its row states them; empty where it does not."""


def bare_rows(text: str) -> tuple[str, tuple[Label, ...]]:
    """The text with rows of bare numbers, line for line, and what they stated of each; nothing where they are bare."""
    lines = text[: _LOOKED * 400].split("\n", _LOOKED)[:_LOOKED]
    lettered = sum(bool(_Row(line, lettered=True).cells) for line in lines) > len(lines) / 2  # theta1 is a name too
    rows = [_Row(line, lettered=lettered) for line in lines]
    stated = Counter(row.labels for row in rows if row.cells)
    if not any(row.bracketed or any(map(any, row.labels)) for row in rows if row.cells):
        return text, ()
    labels, _ = stated.most_common(1)[0]

    def bare(line: str) -> str:
        row = _Row(line, lettered=lettered)
        return row.numbers if row.labels == labels else line

    return "\n".join(map(bare, text.split("\n"))), labels


class _Row:
    """Cells of a line; none where one of them is no number with its name and unit."""

    def __init__(self, line: str, *, lettered: bool) -> None:
        inside = line.strip().removesuffix(",")
        self.bracketed = inside[:1] in _BRACKETS and inside[-1:] == _BRACKETS[inside[:1]]
        inside = inside[1:-1] if self.bracketed else inside
        self.apart = _mark(inside)
        parts = inside.split(self.apart) if self.apart else inside.split() if lettered else _BESIDE.split(inside)
        matches = [(_LETTERED if lettered else _CELL).fullmatch(part) for part in parts]
        self.cells = [cell for cell in matches if cell] if all(matches) else []

    @property
    def labels(self) -> tuple[Label, ...]:
        return tuple((cell["name"] or "", cell["unit"] or "") for cell in self.cells)

    @property
    def numbers(self) -> str:
        return (self.apart or " ").join(cell["number"] for cell in self.cells)


def without_arrival(text: str) -> tuple[str, float | None]:
    """The text without the times at which a monitor got its lines, where the board sends a clock of its own.

    And the seconds per unit of the first column, where these times say that it is this clock; 0 where they are the only
    one, and stay; nothing where there are none, or a column is called a time.
    """
    if _ARRIVED.search(text, 0, 4096) is None:
        return text, None
    lines = text.split("\n", _ROWS)[:_ROWS]
    rows, labels = bare_rows(_ARRIVED.sub("", "\n".join(lines)))
    names, timed = [name for name, _ in labels], list[tuple[float, list[float]]]()
    for line, row in zip(lines, rows.split("\n"), strict=True):
        numbers, arrived = _numbers(row), _ARRIVED.match(line)
        if numbers and arrived:
            timed.append((_of_day(arrived[1]), numbers))
        elif not labels:
            names += re.split(_APART, row.strip())
    sent = _ARRIVED.sub("", text)
    if any(map(time_scale, names)):
        return sent, None
    if timed and len(timed[0][1]) > 1:
        elapsed, counted = timed[-1][0] - timed[0][0], timed[-1][1][0] - timed[0][1][0]
        for unit in _CLOCKS if elapsed > _LONG else ():
            if abs(counted * unit / elapsed - 1) < _SAME:
                return sent, unit
    return _ARRIVED.sub(rf"\1{_mark(sent[:4096]) or ';'}", text), 0.0


def _mark(text: str) -> str:
    """What parts cells; nothing where blanks do."""
    return next((mark for mark in ";\t," if mark in text), "")


def _numbers(row: str) -> list[float]:
    cells = [cell.strip().replace(",", ".") for cell in re.split(_APART, row.strip())]
    return [float(cell) for cell in cells] if all(re.fullmatch(_NUMBER, cell, re.IGNORECASE) for cell in cells) else []


def _of_day(clock: str) -> float:
    hours, minutes, seconds = clock.replace(",", ".").split(":")
    return 3600 * int(hours) + 60 * int(minutes) + float(seconds)
