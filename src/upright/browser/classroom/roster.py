"""Who is in the class? A list of names, a line each, with the seed of each one's twin where somebody chose it."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from upright.errors import BadInput, nearest
from upright.files import read_bytes
from upright.readers.source import Source

MOST = 120
"""Students of a class."""
LONGEST = 60
"""Letters of a name."""
_RESERVED = {"class"}
_WITHOUT_ACCENT = {"ß": "ss", "ø": "o", "æ": "ae", "œ": "oe", "ł": "l", "đ": "d", "ı": "i"}


@dataclass(frozen=True, kw_only=True)
class Student:
    """Somebody of the class.

    Attributes
    ----------
    name : str
        As it is written.
    address : str
        The same in small letters, digits and hyphens, unlike everybody else's.
    seed : int
        Of their twin.
    """

    name: str
    address: str
    seed: int


def read_roster(path: Path) -> tuple[Student, ...]:
    """Students of a file with a column ``name`` and, if any, ``seed``; without a seed the n-th has seed n.

    Commas, semicolons and tabs separate; a first line without ``name`` is a student. Empty lines are passed over.

    Raises
    ------
    BadInput
        When it holds no names, one of them twice, or what is no seed.
    """
    source = Source(file=str(path), data=read_bytes(path))
    lines = [(k, line) for k, line in enumerate(source.text.split("\n"), 1) if line.strip(" \t,;\ufeff")]
    if not lines:
        raise BadInput(f"{path} names no student; write a line 'name' and then a name a line.")
    separator = max(";\t,", key=lambda mark: sum(mark in line for _, line in lines))
    rows = [(k, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]) for k, line in lines]
    header = [cell.casefold() for cell in rows[0][1]]
    if "name" in header:
        if strange := [cell for cell in header if cell not in ("name", "seed", "")]:
            raise BadInput(
                f"{path}: a class has columns 'name' and 'seed', got '{strange[0]}'; "
                f"{nearest(strange[0], ['name', 'seed'])}"
            )
        rows = rows[1:]
    else:
        header = ["name", "seed"]
    if not rows:
        raise BadInput(f"{path} names no student below its header; write a name a line.")
    if len(rows) > MOST:
        raise BadInput(f"{path} names {len(rows)} students, and a class has at most {MOST}; split it.")
    return _students(path, header, rows)


def _students(path: Path, header: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> tuple[Student, ...]:
    out: list[Student] = []
    lines: dict[str, int] = {}
    for number, cells in rows:
        if len([cell for cell in cells[len(header) :] if cell]):
            raise BadInput(f"{path}, line {number}: got {len(cells)} entries, and there are {len(header)} columns.")
        fields = dict(zip(header, cells, strict=False))
        name = unicodedata.normalize("NFC", " ".join(fields.get("name", "").split()))
        if not name or len(name) > LONGEST:
            raise BadInput(f"{path}, line {number}: a name has 1 to {LONGEST} letters, got {len(name)}.")
        if (first := lines.setdefault(name.casefold(), number)) != number:
            raise BadInput(
                f"{path}, line {number}: '{name}' stands in line {first} already; write how the two differ, as in "
                f"'{name} B'."
            )
        out.append(Student(name=name, address=_address(name, out), seed=_seed(path, number, fields, len(out) + 1)))
    return tuple(out)


def _seed(path: Path, line: int, fields: dict[str, str], usual: int) -> int:
    text = fields.get("seed", "")
    if not text:
        return usual
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise BadInput(f"{path}, line {line}: a seed is a whole number from 0 to 999999999, got '{text[:40]}'.")
    return int(text)


def _address(name: str, others: Sequence[Student]) -> str:
    plain = "".join(_WITHOUT_ACCENT.get(c, c) for c in name.casefold())
    plain = unicodedata.normalize("NFKD", plain).encode("ascii", "ignore").decode()
    word = re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:40] or "student"
    known, n, address = {student.address for student in others} | _RESERVED, 1, word
    while address in known:
        n += 1
        address = f"{word}-{n}"
    return address
