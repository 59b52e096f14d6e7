"""Which numbers stand in these rows, and if one does not, in which line and column?

NumPy's parser reads the whole block at once. Only when it stumbles are the rows read one by one, to say where.
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence

import numpy as np

from upright.readers.source import Source
from upright.records import LARGEST, Array

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


def numbers(
    source: Source,
    body: str,
    *,
    names: Sequence[str],
    delimiter: str | None,
    first_line: int,
    decimal_comma: bool = False,
) -> Array:
    """Table (N, len(names)) of the lines of `body`, finite and below 1e30.

    Parameters
    ----------
    source : Source
        For error sentences.
    body : str
        Rows separated by line feeds; blank lines are skipped.
    names : sequence of str
        One per column.
    delimiter : str or None
        None stands for runs of blanks.
    first_line : int
        Line number of the first row in the file, counted from 1.

    Raises
    ------
    BadInput
        With line and column, when a row has too few or too many cells, or a cell is no usable number.
    """
    if decimal_comma:
        body = body.replace(",", ".")
    if not body.strip():
        raise source.bad("the file holds no rows of numbers; export the log again", line=first_line)
    try:
        table = np.loadtxt(io.StringIO(body), delimiter=delimiter, comments=None, ndmin=2)
    except (ValueError, OverflowError, IndexError):
        table = np.empty((0, 0))
    if table.shape[1] != len(names) or not (np.abs(table) <= LARGEST).all():
        table = _row_by_row(source, body, names=names, delimiter=delimiter, first_line=first_line)
    return table


def _row_by_row(source: Source, body: str, *, names: Sequence[str], delimiter: str | None, first_line: int) -> Array:
    rows: list[list[float]] = []
    lines = body.split("\n")
    for number, line in enumerate(lines, start=first_line):
        if not line.strip():
            continue
        cells = line.split(delimiter)
        if len(cells) != len(names):
            torn = not any(rest.strip() for rest in lines[number - first_line + 1 :])
            raise source.bad(
                f"expected {len(names)} numbers, got {len(cells)}"
                + ("; the last row is torn, export the log again or delete it" if torn else "; mend or delete the row"),
                line=number,
            )
        rows.append([cell(source, text, line=number, column=j + 1, name=names[j]) for j, text in enumerate(cells)])
    return np.array(rows, dtype=np.float64)


def cell(source: Source, text: str, *, line: int, column: int, name: str) -> float:
    """One finite number, or an error with its place."""
    plain = text.strip()
    if not plain:
        raise source.bad(
            "expected a number, got an empty cell; fill it in or delete the row", line=line, column=column, name=name
        )
    value = float(re.sub("[dD]", "e", plain)) if _NUMBER.fullmatch(plain) else float("nan")
    if not abs(value) <= LARGEST:
        size = "a number too large for any instrument" if value == value else "something else"
        raise source.bad(
            f"expected a finite number, got {size}: {plain[:40]!r}; mend or delete the row",
            line=line,
            column=column,
            name=name,
        )
    return value


def line_of_row(body: str, row: int, first_line: int) -> int:
    """Line number in the file of a row of the table, both blank lines and header counted."""
    filled = [number for number, line in enumerate(body.split("\n"), start=first_line) if line.strip()]
    return filled[row] if row < len(filled) else first_line
