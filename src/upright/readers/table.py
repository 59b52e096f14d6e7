"""Numbers that stand in the rows of a text, with the line and the column of the first that does not.

NumPy's parser reads the whole block at once. Only when it stumbles are the rows read one by one, to say where.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass

import numpy as np

from upright.readers.source import Source
from upright.records import LARGEST, Array

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows of numbers in a text, one name per column.

    Parameters
    ----------
    source : Source
        The log, for error sentences.
    body : str
        Rows separated by line feeds; blank lines are skipped.
    names : tuple of str
        One per column.
    delimiter : str or None
        None stands for runs of blanks.
    first_line : int
        Line number of the first row in the file, counted from 1.
    named : bool
        Whether the log itself names its columns.
    """

    source: Source
    body: str
    names: tuple[str, ...]
    delimiter: str | None
    first_line: int
    decimal_comma: bool = False
    named: bool = True

    def numbers(self) -> Array:
        """All numbers (N, columns), finite and below 1e30.

        Raises
        ------
        BadInput
            With line and column, when a row has too few or too many cells, or a cell is no usable number.
        """
        body = self.body.replace(",", ".") if self.decimal_comma else self.body
        if not body.strip():
            raise self.source.bad("the file holds no rows of numbers; export the log again", line=self.first_line)
        try:
            table = np.loadtxt(io.StringIO(body), delimiter=self.delimiter, comments=None, ndmin=2)
        except (ValueError, OverflowError, IndexError):
            table = np.empty((0, 0))
        if table.shape[1] != len(self.names) or not (np.abs(table) <= LARGEST).all():
            table = self._row_by_row(body.split("\n"))
        return table

    def _row_by_row(self, lines: list[str]) -> Array:
        rows: list[list[float]] = []
        last = max(i for i, line in enumerate(lines) if line.strip())
        for i, line in enumerate(lines):
            if not line.strip():
                continue
            cells = line.split(self.delimiter)
            if len(cells) != len(self.names):
                advice = (
                    "the last row is torn, export the log again or delete it" if i == last else "mend or delete the row"
                )
                raise self.source.bad(
                    f"expected {len(self.names)} numbers, got {len(cells)}; {advice}", line=self.first_line + i
                )
            rows.append(
                [
                    cell(self.source, text, line=self.first_line + i, column=j, name=name)
                    for j, (text, name) in enumerate(zip(cells, self.names, strict=True), start=1)
                ]
            )
        return np.array(rows, dtype=np.float64)

    def line(self, row: int) -> int:
        """Line number in the file of a row of the table, both blank lines and header counted."""
        filled = [number for number, line in enumerate(self.body.split("\n"), start=self.first_line) if line.strip()]
        return filled[row] if row < len(filled) else self.first_line


def cell(source: Source, text: str, *, line: int, column: int, name: str) -> float:
    """One finite number, or an error with its place."""
    plain = text.strip()
    value = float(re.sub("[dD]", "e", plain)) if _NUMBER.fullmatch(plain) else float("nan")
    if abs(value) <= LARGEST:
        return value
    size = "a number too large for any instrument" if value == value else "something else"
    sentence = f"expected a finite number, got {size}: {plain[:40]!r}; mend or delete the row"
    if not plain:
        sentence = "expected a number, got an empty cell; fill it in or delete the row"
    raise source.bad(sentence, line=line, column=column, name=name)
