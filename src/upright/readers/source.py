"""Content of a log as bytes, as text and as rows of numbers, and sentences that say where in it a mistake is."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput
from upright.files import read_bytes
from upright.records import LARGEST, Array, PathLike, Provenance

_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b\x0e-\x1f\x7f]")
_PRINTABLE = bytes(code for code in range(256) if not _UNPRINTABLE.match(chr(code)))
_MOST = 512  # MB that a file may unpack to; a log of an hour at 1 kHz has 30 per column
_ANYWAY, _RATIO = 32, 100  # MB that any file may; times its own size: logs pack 2 to 20 times, a bomb 1000 times
_BLOCK = 1 << 22  # characters of a table that are read at a time; NumPy needs four bytes for each


@dataclass(frozen=True, kw_only=True)
class Source:
    """Content of one log and the name to call it by; where its rows are `counted`, one without a time is no mistake."""

    file: str
    data: bytes
    counted: bool = False

    @cached_property
    def text(self) -> str:
        r"""Content as text with ``\n`` line ends; refuses binary content with its place."""
        encoding = "utf-16" if self.data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        try:
            text = self.data.decode(encoding)
        except UnicodeDecodeError:
            text = self.data.decode("latin-1")  # degree signs of older Windows programs
        text = text.replace("\r\n", "\n").replace("\r", "\n")
        clean = encoding != "utf-16" and not self.data.translate(None, _PRINTABLE)
        strange = None if clean else _UNPRINTABLE.search(text)
        if strange is not None:
            line = text.count("\n", 0, strange.start()) + 1
            column = strange.start() - text.rfind("\n", 0, strange.start())
            raise self.bad(
                f"expected text or a MATLAB file, got the byte {ord(strange[0]):#04x} of some binary format;"
                " export the log as CSV or MAT version 5",
                line=line,
                column=column,
            )
        return text

    @property
    def most_unpacked(self) -> int:
        """Megabytes that packed content may hold, and is refused beyond."""
        return min(_MOST, _ANYWAY + _RATIO * len(self.data) // (1 << 20))

    def provenance(self, reader: str, *notes: str) -> Provenance:
        """Origin of a record that `reader` made of this file."""
        return Provenance(file=self.file, sha256=hashlib.sha256(self.data).hexdigest(), reader=reader, notes=notes)

    def bad(self, sentence: str, *, line: int = 0, column: int = 0, sample: int = 0, name: str = "") -> BadInput:
        """Error that names the file and the place in it, all counted from 1."""
        counted = (("line", line), ("column", column), ("sample", sample))
        place = [f"'{self.file}'", *(f"{what} {number}" for what, number in counted if number)]
        return BadInput(f"{', '.join(place)}{f' ({name})' if name and column else ''}: {sentence}.")

    def must_increase(
        self,
        t: Array,
        place: Callable[[int], dict[str, Any]],
        *,
        what: str = "time",
        unit: str = " s",
        each: str = "row",
        advice: str = "mend or delete the row",
        strictly: bool = True,
    ) -> None:
        """Refuse times (N,) that do not increase, or fall where not `strictly`; `place` finds a row counted from 0."""
        step = np.diff(t)
        bad = np.flatnonzero(~(step > 0) if strictly else step < 0)
        if bad.size:
            row = int(bad[0]) + 1
            raise self.bad(
                f"{what} must increase from {each} to {each}, got {t[row]:.9g}{unit} after {t[row - 1]:.9g}{unit};"
                f" {advice}",
                **place(row),
            )


def load(path: PathLike) -> Source:
    """Whole content of a file.

    Raises
    ------
    BadInput
        When there is no such file, it is a folder, empty, or cannot be read.
    """
    name = str(path)
    if not name.isprintable() and any("\ud800" <= c <= "\udfff" for c in name):
        raise BadInput(f"The name {name!r} is no text, so that no study could name it; rename the file.")
    try:
        data = read_bytes(path)
    except BadInput:
        raise
    except FileNotFoundError:
        raise BadInput(f"There is no file '{name}';{neighbour(Path(path))}") from None
    except (OSError, ValueError) as error:
        raise BadInput(f"'{name}' cannot be read: {error}; check its name and permissions.") from None
    source = Source(file=name, data=data)
    if not data or data.isspace():
        raise source.bad("the file is empty; export the log again")
    return source


def neighbour(path: Path) -> str:
    """What to try where a file is missing: the one called almost so, or what is wrong with the folder."""
    from difflib import get_close_matches

    try:
        beside = [p.name for p in path.parent.iterdir() if p.is_file()]
    except OSError:
        return f" there is no folder '{path.parent}' either, check the path."
    close = get_close_matches(path.name, beside, n=1, cutoff=0.5)
    return f" did you mean '{close[0]}'?" if close else " check the path."


_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?", re.ASCII)


@dataclass(frozen=True, kw_only=True)
class TextTable:
    """Rows of numbers in a text, one name per column.

    Parameters
    ----------
    source : Source
        The log, for error sentences.
    text : str
        Rows separated by line feeds, blank lines skipped, from the character `start` on; that is the `body`.
    names : tuple of str
        One per column.
    delimiter : str or None
        None stands for runs of blanks.
    first_line : int
        Line number of the first row in the file, counted from 1.
    named : bool
        Whether the log itself names its columns.
    began : str
        Date and time of the first row, where the first column holds such instead of seconds.
    arrival : float, optional
        Of a monitor that stamped the rows as they arrived: seconds per unit of their first column, as the stamps say; 0
        where there is no other clock.
    """

    source: Source
    text: str
    names: tuple[str, ...]
    delimiter: str | None
    first_line: int
    start: int = 0
    decimal_comma: bool = False
    named: bool = True
    began: str = ""
    arrival: float | None = None

    @property
    def body(self) -> str:
        """The rows; a copy of the text."""
        return self.text[self.start :]

    def numbers(self) -> Array:
        """All numbers (N, columns), finite and below 1e30.

        Raises
        ------
        BadInput
            With line and column, when a row has too few or too many cells, or a cell is no usable number.
        """
        blocks: list[Array] = []
        if not self.text[self.start : self.start + _BLOCK].strip() and not self.body.strip():
            raise self.source.bad("the file holds no rows of numbers; export the log again", line=self.first_line)
        try:
            for body in self._blocks():
                table = np.loadtxt(io.StringIO(body), delimiter=self.delimiter, comments=None, ndmin=2)
                if table.shape[1] != len(self.names) or not (np.abs(table) <= LARGEST).all():
                    raise ValueError
                blocks.append(table)
        except (ValueError, OverflowError, IndexError):
            body = self.body.replace(",", ".") if self.decimal_comma else self.body
            return self._row_by_row(body.split("\n"))
        return _joined(blocks)

    def _blocks(self) -> Iterator[str]:
        """Rows of the body, some megabytes at a time, each block whole rows."""
        begin, text = self.start, self.text
        while begin < len(text):
            end = text.find("\n", begin + _BLOCK)
            block = text[begin : end if end >= 0 else None]
            begin = end + 1 if end >= 0 else len(text)
            if block.strip():
                yield block.replace(",", ".") if self.decimal_comma else block

    def _row_by_row(self, lines: list[str]) -> Array:
        rows: list[list[float]] = []
        texts = [line.split(self.delimiter) for line in lines if line.strip()]
        for j, name in enumerate(self.names):
            if all(len(row) > j and not row[j].strip() for row in texts):
                raise self.source.bad(
                    "this column is empty in every row; delete it", line=self.first_line, column=j + 1, name=name
                )
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


def _joined(blocks: list[Array]) -> Array:
    """Tables one below the other, each column in one piece and read-only; the blocks are given up on the way."""
    rows = sum(len(block) for block in blocks)
    out = np.empty((rows, blocks[0].shape[1]), order="F")
    blocks.reverse()
    at = 0
    while blocks:
        block = blocks.pop()
        out[at : at + len(block)] = block
        at += len(block)
    out.flags.writeable = False
    return out


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
