"""Record of JSON: the largest table in it, whichever way a program writes one.

A list of objects, an object of lists, pandas' layouts (``orient`` of ``to_json``), and any of these within an object
that says more. JSON of one object a line is read with the other texts whose rows name their numbers.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from upright.readers.formats.delimited import begins_with_number, of_columns
from upright.readers.reader import Reader
from upright.readers.source import Source
from upright.records import Record
from upright.records.columns import time_scale

_LEAST = 4
"""Rows of what counts as a table."""
_DEEPEST = 6
_HEAD = 1 << 10


@dataclass(frozen=True)
class _Table:
    """Columns of one length, and where in the file they stand."""

    at: str
    columns: Mapping[str, Sequence[Any]]

    @property
    def numbers(self) -> int:
        return sum(len(values) for values in self.columns.values())


def read(source: Source) -> Record:
    """Record of the largest table."""
    tables = list(_tables(_content(source), "", 0))
    if not tables:
        raise source.bad("none of its objects is a table of numbers; write one list of numbers for each column")
    table = max(tables, key=lambda table: table.numbers)
    names = [name for name, values in table.columns.items() if not any(isinstance(v, dict | list) for v in values)]
    record = of_columns(
        source, {name: [_cell(source, name, i, v) for i, v in enumerate(table.columns[name], 1)] for name in names}
    )
    others = [f"'{other.at or 'outermost'}'" for other in tables if other is not table]
    note = [f"The largest of its tables, '{table.at}', beside {', '.join(others)}."] if others else []
    return replace(record, provenance=source.provenance("json", *note, *record.provenance.notes))


def _content(source: Source) -> Any:
    try:
        return json.loads(source.text)
    except (ValueError, RecursionError) as error:
        raise source.bad(f"the file is no whole JSON ({error}); export the log again") from None


def _tables(node: Any, at: str, depth: int) -> Iterator[_Table]:
    """Every table in a part of the file."""
    if depth > _DEEPEST:
        return
    columns = _columns(node)
    if columns:
        yield _Table(at, columns)
    elif isinstance(node, dict):
        for name, inner in node.items():
            yield from _tables(inner, f"{at}.{name}" if at else name, depth + 1)
    elif isinstance(node, list) and len(node) < _LEAST * 16:
        for i, inner in enumerate(node):
            yield from _tables(inner, f"{at}[{i}]", depth + 1)


def _columns(node: Any) -> Mapping[str, Sequence[Any]] | None:
    """Columns of a part of the file that is a table; None where it is none."""
    if isinstance(node, list) and len(node) >= _LEAST and all(isinstance(row, dict) for row in node):
        rows = [dict(_flat(row, "")) for row in node]
        return _numeric({name: [row.get(name) for row in rows] for name in rows[0]})
    if isinstance(node, list) and len(node) >= _LEAST and all(isinstance(row, list) for row in node):
        width = len(node[0])
        return _numeric({f"c{j}": [row[j] for row in node] for j in range(width)}) if _even(node, width) else None
    if not isinstance(node, dict):
        return None
    if isinstance(node.get("columns"), list) and isinstance(node.get("data"), list):  # pandas' split
        names, rows = node["columns"], node["data"]
        if not _even(rows, len(names)):
            return None
        columns = {str(n): [row[j] for row in rows] for j, n in enumerate(names)}
        return _numeric(_with_index(node.get("index"), columns))
    if len(node) > 1 and all(isinstance(inner, dict) for inner in node.values()):  # pandas' columns, or its index
        first = next(iter(node.values()))
        if any(inner.keys() != first.keys() for inner in node.values()):
            return None
        if len(node) < _LEAST or len(first) > len(node):
            return _numeric(_with_index(list(first), {name: list(column.values()) for name, column in node.items()}))
        return _numeric(_with_index(list(node), {name: [row[name] for row in node.values()] for name in first}))
    lists = {name: column for name, column in node.items() if isinstance(column, list)}
    longest = max(map(len, lists.values()), default=0)
    for name, inner in node.items():  # beside a time that stands one level up
        if isinstance(inner, dict) and any(time_scale(own) and len(lists[own]) == longest for own in lists):
            lists |= {f"{name}.{n}": column for n, column in inner.items() if isinstance(column, list)}
    return _numeric({name: column for name, column in lists.items() if len(column) == longest})


def _with_index(index: Any, columns: Mapping[str, Sequence[Any]]) -> Mapping[str, Sequence[Any]]:
    """Columns behind the index of a frame, where it does more than count the rows and no column is a time."""
    if not isinstance(index, list) or any(map(time_scale, columns)) or "index" in columns:
        return columns
    keys = [float(key) if isinstance(key, str) and begins_with_number(key) else key for key in index]
    return columns if keys == list(range(len(keys))) else {"index": keys, **columns}


def _even(rows: Sequence[Any], width: int) -> bool:
    return all(isinstance(row, list) and len(row) == width for row in rows)


def _numeric(columns: Mapping[str, Sequence[Any]]) -> Mapping[str, Sequence[Any]] | None:
    """Columns that are a table: some rows, and two of them numbers, or one beside a time as text."""
    if len(columns) < 2 or len(next(iter(columns.values()))) < _LEAST:
        return None
    numbers = sum(isinstance(values[0], float | int) for values in columns.values())
    return columns if numbers and numbers + any(isinstance(v[0], str) for v in columns.values()) > 1 else None


def _flat(row: Mapping[str, Any], at: str) -> Iterator[tuple[str, Any]]:
    """Names and values of a row, those of its inner objects with a point between."""
    for name, value in row.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{at}{name}.")
        else:
            yield f"{at}{name}", value


def _cell(source: Source, name: str, row: int, value: Any) -> str:
    if value is None:
        raise source.bad(f"expected a value of '{name}' in every row, got none; fill or drop the row", sample=row)
    if isinstance(value, bool):
        return repr(float(value))
    return repr(value) if isinstance(value, float | int) else str(value).replace(",", " ").replace("\n", " ").strip()


def _recognises(source: Source) -> bool:
    """Whether it begins as JSON does, and is not one object a line."""
    if not source.data[:64].removeprefix(b"\xef\xbb\xbf").lstrip().startswith((b"{", b"[")):
        return False
    first, _, more = source.text.lstrip().partition("\n")
    if first.startswith("["):
        return re.match(r"\[\s*[\[{]", source.text.lstrip()[:_HEAD]) is not None
    return not (first.rstrip(", ").endswith("}") and more.strip())


READER = Reader(name="json", files="tables in JSON", recognises=_recognises, read=read, order=28)
