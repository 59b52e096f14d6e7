"""What does this table of answers hold? One row per person, one row per answer, or what somebody printed about it."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.files import read_bytes

Array = NDArray[np.float64]

LIKERT = ("strongly agree", "agree", "neutral", "disagree", "strongly disagree", "i don't know")
_BEFORE, _AFTER = {"pre", "before", "prior"}, {"post", "after"}
_PERSON = {"id", "student", "person", "respondent", "participant", "code", "name"}
_ITEM = {"item", "question", "concept", "topic", "statement"}
_WHEN = {"time", "phase", "when", "occasion", "wave"}
_ANSWER = {"answer", "score", "rating", "value", "response"}
_MISSING = {"", "-", "na", "n/a", "nan", "none", "."}


@dataclass(frozen=True, kw_only=True, eq=False)
class Item:
    """One question: ratings (people,) before and after, NaN where missing."""

    name: str
    pre: Array
    post: Array


@dataclass(frozen=True, kw_only=True)
class Likert:
    """One statement: how many gave each answer, in the order of agreement."""

    name: str
    options: tuple[str, ...]
    counts: tuple[int, ...]
    missing: int = 0


@dataclass(frozen=True, kw_only=True)
class Ratings:
    """Answers of single people."""

    items: tuple[Item, ...]
    likert: tuple[Likert, ...]
    people: int
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Means:
    """Printed means by name and measure: (name, measure, before, after), numbers as printed."""

    rows: tuple[tuple[str, str, str, str], ...]


@dataclass(frozen=True, kw_only=True)
class Shares:
    """Printed percentages: options, and (statement, percentages as printed)."""

    options: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]


def read_sheet(path: Path, *, scale: tuple[int, int] = (1, 4)) -> Ratings | Means | Shares:
    """Table of a CSV file, as spreadsheets write it: any of ``, ; tab``, any of UTF-8, UTF-16 or Windows' own.

    Raises
    ------
    BadInput
        When the table is none of these, a rating is off the scale, or a person answers twice.
    """
    return read_table(decoded(path), path.name, scale=scale)


def read_table(text: str, name: str, *, scale: tuple[int, int] = (1, 4)) -> Ratings | Means | Shares:
    """The same of text that separates its cells so; `name` is what errors call it."""
    header, rows = cells_of(text, name)
    words = [set(_words(h)) for h in header]
    if sum(h.strip().lower().replace("’", "'") in LIKERT for h in header) >= 3:
        return _shares(header, rows)
    when = _find(words, _WHEN)
    item = _find(words, _ITEM)
    answer = _find(words, _ANSWER)
    if when is not None and item is not None and answer is not None:
        person = _find(words, _PERSON)
        if person is None:
            raise BadInput(f"'{name}': one row per answer needs a column that names the person, such as 'id'.")
        return _long(rows, person, item, when, answer, scale)
    if not any(w & (_BEFORE | _AFTER) for w in words) and not _agreement(rows):
        raise BadInput(
            f"'{name}' needs columns such as 'feedback pre' and 'feedback post', a column 'time' with pre and post"
            f" beside 'item' and 'rating', or agreement in words; it has {', '.join(header)[:120]}."
        )
    if item is not None and _find(words, _PERSON) is None:
        return _means(header, words, item, rows)
    return _wide(header, words, rows, scale)


def _words(heading: str) -> list[str]:
    return re.findall(r"[a-z0-9']+", heading.lower())


def _find(words: Sequence[set[str]], among: set[str]) -> int | None:
    return next((i for i, w in enumerate(words) if w & among and not w & (_BEFORE | _AFTER)), None)


def _without(heading: str, drop: set[str]) -> str:
    words = [w for w in re.findall(r"[^\s_\-:]+", heading) if re.sub(r"\W", "", w.lower()) not in drop]
    return " ".join(words)


def _agreement(rows: Sequence[tuple[int, list[str]]]) -> bool:
    return any(cell.lower().replace("’", "'") in LIKERT for _, cells in rows for cell in cells)


def _rating(cell: str, scale: tuple[int, int], where: str) -> float:
    if cell.lower() in _MISSING:
        return np.nan
    low, high = scale
    try:
        value = float(cell)
    except ValueError:
        raise BadInput(f"{where}: a rating from {low} to {high} was needed, got '{cell[:40]}'.") from None
    if not low <= value <= high:
        raise BadInput(
            f"{where}: a rating from {low} to {high} was needed, got {cell}; correct it, leave it empty, or give"
            " --scale."
        )
    return value


def _pairs(header: Sequence[str], words: Sequence[set[str]]) -> dict[str, tuple[int, int]]:
    """Columns before and after by name of the question."""
    pairs: dict[str, dict[str, int]] = {}
    for i, (heading, w) in enumerate(zip(header, words, strict=True)):
        if not w & (_BEFORE | _AFTER):
            continue
        name = _without(heading, _BEFORE | _AFTER | {"course", "mean", "test"})
        side = "post" if w & _AFTER else "pre"
        if side in pairs.setdefault(name, {}):
            raise BadInput(f"The heading '{name}' has two columns '{side}'; name each question once.")
        pairs[name][side] = i
    for name, sides in pairs.items():
        if len(sides) < 2:
            raise BadInput(f"'{name or header[0]}' has a column {next(iter(sides))} but none for the other time.")
    return {name: (sides["pre"], sides["post"]) for name, sides in pairs.items()}


def _wide(
    header: list[str], words: Sequence[set[str]], rows: Sequence[tuple[int, list[str]]], scale: tuple[int, int]
) -> Ratings:
    person = _find(words, _PERSON)
    if person is not None:
        lines: dict[str, int] = {}
        for number, cells in rows:
            if cells[person] and cells[person] in lines:
                raise BadInput(
                    f"'{cells[person]}' answers in line {lines[cells[person]]} and again in line {number};"
                    " keep one of them."
                )
            lines[cells[person]] = number
    items: list[Item] = []
    notes: list[str] = []
    pairs = _pairs(header, words)
    for name, columns in pairs.items():
        both = [
            np.array([_rating(cells[c], scale, f"line {number}, '{header[c]}'") for number, cells in rows])
            for c in columns
        ]
        items.append(Item(name=name or "rating", pre=both[0], post=both[1]))
    used = {c for pair in pairs.values() for c in pair} | {person}
    likert: list[Likert] = []
    for i, heading in enumerate(header):
        if i in used:
            continue
        answers = [cells[i].lower().replace("’", "'") for _, cells in rows]
        answered = [a for a in answers if a not in _MISSING]
        if answered and set(answered) <= set(LIKERT):
            options = tuple(o for o in LIKERT if o in answered or o not in ("neutral", "i don't know"))
            counts = tuple(answered.count(o) for o in options)
            likert.append(Likert(name=heading, options=options, counts=counts, missing=len(answers) - len(answered)))
        else:
            notes.append(f"The column '{heading}' is neither a rating before or after nor agreement, and is left out.")
    return Ratings(items=tuple(items), likert=tuple(likert), people=len(rows), notes=tuple(notes))


def _long(
    rows: Sequence[tuple[int, list[str]]], person: int, item: int, when: int, answer: int, scale: tuple[int, int]
) -> Ratings:
    people = {cells[person]: i for i, cells in enumerate({c[person]: c for _, c in rows}.values())}
    names = list(dict.fromkeys(cells[item] for _, cells in rows))
    table = {(name, side): np.full(len(people), np.nan) for name in names for side in ("pre", "post")}
    lines: dict[tuple[str, str, str], int] = {}
    for number, cells in rows:
        words = set(_words(cells[when]))
        if not words & (_BEFORE | _AFTER):
            raise BadInput(f"line {number}: pre or post was needed for the time, got '{cells[when][:40]}'.")
        side = "post" if words & _AFTER else "pre"
        key = (cells[person], cells[item], side)
        if key in lines:
            raise BadInput(
                f"'{key[0]}' rates '{key[1]}' ({side}) in line {lines[key]} and again in line {number}; keep one."
            )
        lines[key] = number
        table[cells[item], side][people[cells[person]]] = _rating(cells[answer], scale, f"line {number}")
    items = tuple(Item(name=n, pre=table[n, "pre"], post=table[n, "post"]) for n in names)
    return Ratings(items=items, likert=(), people=len(people), notes=())


def _means(header: list[str], words: Sequence[set[str]], item: int, rows: Sequence[tuple[int, list[str]]]) -> Means:
    means: list[tuple[str, str, str, str]] = []
    for measure, (pre, post) in _pairs(header, words).items():
        for number, cells in rows:
            for c in (pre, post):
                if not is_number(cells[c]):
                    raise BadInput(f"line {number}, '{header[c]}': a printed mean was needed, got '{cells[c][:40]}'.")
            means.append((cells[item], measure, cells[pre], cells[post]))
    return Means(rows=tuple(means))


def _shares(header: list[str], rows: Sequence[tuple[int, list[str]]]) -> Shares:
    columns = [i for i, h in enumerate(header) if h.strip().lower().replace("’", "'") in LIKERT]
    name = next((i for i in range(len(header)) if i not in columns), None)
    shares: list[tuple[str, tuple[str, ...]]] = []
    for number, cells in rows:
        texts = tuple(cells[c].rstrip("% ").strip() for c in columns)
        for text in texts:
            if not is_number(text):
                raise BadInput(f"line {number}: a percentage was needed, got '{text[:40]}'; write 0 for none.")
        shares.append((cells[name] if name is not None else f"row {number}", texts))
    return Shares(options=tuple(header[c] for c in columns), rows=tuple(shares))


def decoded(path: Path) -> str:
    """Text of a file in UTF-8, UTF-16 or Windows' own encoding."""
    data = read_bytes(path, most=64)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def cells_of(text: str, name: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header and rows with their line numbers, blank rows left out."""
    lines = text.splitlines()
    skip = 0
    delimiter = ""
    if lines and (declared := re.fullmatch(r'"?sep=(.)"?', lines[0].strip())):
        delimiter, skip = declared[1], 1
    if len(lines) < skip + 2:
        raise BadInput(f"'{name}' needs a line of headings and at least one row, and has {len(lines)} lines.")
    bare = re.sub(r'"[^"]*"', "", lines[skip])
    delimiter = delimiter or max(";,\t", key=bare.count)
    table = list(csv.reader(lines[skip:], delimiter=delimiter))
    header = [cell.strip() for cell in table[0]]
    rows: list[tuple[int, list[str]]] = []
    for number, row in enumerate(table[1:], start=skip + 2):
        cells = [c.strip() for c in row]
        if not any(cells):
            continue
        if len(cells) > len(header) and any(cells[len(header) :]):
            raise BadInput(
                f"'{name}', line {number}: {len(cells)} cells under {len(header)} headings; a comma inside a text"
                " needs quotes."
            )
        cells = (cells + [""] * len(header))[: len(header)]
        rows.append((number, [c.replace(",", ".") if delimiter == ";" and is_number(c) else c for c in cells]))
    if not rows:
        raise BadInput(f"'{name}' has headings and no answers.")
    return header, rows


def is_number(text: str) -> bool:
    """Whether a cell holds a number, with a decimal point or comma, perhaps in percent."""
    return re.fullmatch(r"[+-]?\d+(?:[.,]\d+)?\s*%?", text) is not None
