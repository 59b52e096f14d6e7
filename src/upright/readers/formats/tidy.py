"""Record of a long table: a row for each value, with its time and the name of its signal, as databases export it.

InfluxDB's CSV, with or without its lines of annotation, is such a table; so is what a spreadsheet calls unpivoted. The
signal that has most rows gives the times; another one whose times differ is held from its last value.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

import numpy as np

from upright.errors import BadInput
from upright.readers.formats.delimited import begins_with_number, of_columns
from upright.readers.reader import Reader
from upright.readers.source import Source, cell
from upright.readers.stamps import in_seconds
from upright.records import Array, Record
from upright.records.columns import time_scale

_HEAD = 1 << 14  # characters by which such a table is known
_FIELDS = re.compile(r"_?(field|name|signal|variable|channel|sensor|topic|metric|key|tag|parameter|measurement)", re.I)
_VALUES = re.compile(r"_?(value|reading|val|wert|data)", re.I)
_TIMES = re.compile(r"_?(time|timestamp|date|datetime|ts)", re.I)
_LOOKED = 400
"""Rows that show what each column is."""
_MOST = 64
"""Signals."""


def read(source: Source) -> Record:
    """Record of all signals."""
    header, rows, first_line = _rows(source, source.text)
    at = _columns(header, rows[:_LOOKED])
    if at is None:
        raise source.bad("expected columns of times, names of signals and values", line=max(first_line - 1, 1))
    when, which, what = at
    times, lines = dict[str, list[str]](), dict[str, list[int]]()
    values: dict[str, list[float]] = {}
    for line, row in enumerate(rows, start=first_line):
        if not row:
            continue
        if len(row) != len(header):
            raise source.bad(f"expected {len(header)} cells, got {len(row)}; mend or delete the row", line=line)
        name = row[which].strip()
        times.setdefault(name, []).append(row[when].strip())
        lines.setdefault(name, []).append(line)
        values.setdefault(name, []).append(cell(source, row[what], line=line, column=what + 1, name=name))
        if len(times) > _MOST:
            raise source.bad(f"expected at most {_MOST} signals, got more in '{header[which]}'", line=line)
    base = max(times, key=lambda name: len(times[name]))
    others = [name for name in times if times[name] != times[base]]
    columns = {name: np.array(y, dtype=np.float64) for name, y in values.items()}
    clocks = _clocks(source, times, header[when])
    for name in (base, *others):
        source.must_increase(clocks[name], lambda row, of=name: {"line": lines[of][row]}, what=f"the time of '{name}'")
    for name in others:
        last = np.searchsorted(clocks[name], clocks[base], side="right") - 1
        columns[name] = columns[name][np.maximum(last, 0)]
    clock = "time" if _TIMES.fullmatch(header[when]) else header[when]
    cells = {name: [*map(repr, y.tolist())] for name, y in columns.items()}
    record = of_columns(source, {clock: times[base], **cells})
    held = [f"Held from value to value, the first before it: {', '.join(others)}."] if others else []
    return record.replace(provenance=source.provenance("tidy", *record.provenance.notes, *held))


def _rows(source: Source, text: str) -> tuple[list[str], list[list[str]], int]:
    """The line of names, the rows below it, and the line in which they begin."""
    lines = text.rstrip().split("\n")
    head = next((i for i, line in enumerate(lines) if line.strip() and not line.startswith("#")), 0)
    delimiter = max(",;\t", key=lines[head].count)
    try:
        header, *rows = csv.reader(lines[head:], delimiter=delimiter, strict=True)
    except (csv.Error, ValueError) as error:
        raise source.bad(f"expected cells parted by '{delimiter}', got a broken row ({error})", line=head + 1) from None
    return [name.strip() for name in header], rows, head + 2


def _columns(header: Sequence[str], rows: Sequence[Sequence[str]]) -> tuple[int, int, int] | None:
    """Which columns are the time, the name of the signal and its value; None where this is no long table."""
    whole = [row for row in rows if len(row) == len(header)]
    if len(header) < 3 or len(whole) < 4:
        return None
    numbers = [j for j in range(len(header)) if sum(begins_with_number(row[j]) for row in whole) > len(whole) / 2]
    texts = [j for j in range(len(header)) if not any(begins_with_number(row[j]) or _is_stamp(row[j]) for row in whole)]
    called = [j for j in texts if _FIELDS.fullmatch(header[j])]
    which = next((j for j in called if "measurement" not in header[j].lower()), called[0] if called else None)
    when = next((j for j, name in enumerate(header) if _TIMES.fullmatch(name) or time_scale(name)), None)
    what = next((j for j in numbers if j != when and _VALUES.fullmatch(header[j])), None)
    if which is None or when is None or what is None:
        return None
    beside = {header[j] for j in numbers} - {header[when], header[what], "table"}  # of InfluxDB, numbers each signal
    return None if beside else (when, which, what)


def _is_stamp(text: str) -> bool:
    return bool(in_seconds(text)[1])


def _clocks(source: Source, times: dict[str, list[str]], name: str) -> dict[str, Array]:
    """Times of each signal in one unit, whatever they are counted from."""
    text, _ = in_seconds("\n".join(t for each in times.values() for t in each))
    try:
        every = np.array([float(number) for number in text.split("\n")])
    except ValueError:
        raise source.bad(f"expected times of one form in '{name}', got different ones") from None
    ends = np.cumsum([len(each) for each in times.values()])[:-1]
    return dict(zip(times, np.split(every, ends), strict=True))


def _recognises(source: Source) -> bool:
    if b"\0" in source.data[:_HEAD]:
        return False
    head = source.text[:_HEAD].rpartition("\n")[0]
    try:
        header, rows, _ = _rows(source, head)
    except BadInput:
        return False
    return _columns(header, rows) is not None


READER = Reader(
    name="tidy", files="long tables of time, name and value (InfluxDB)", recognises=_recognises, read=read, order=70
)
