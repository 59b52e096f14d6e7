"""Record of a workbook of Excel (.xlsx): its first sheet with rows of numbers, read as the same table in a text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from datetime import date, datetime, time
from io import BytesIO
from typing import Any
from zipfile import BadZipFile, ZipFile

from upright.errors import BadInput
from upright.readers.formats import delimited
from upright.readers.reader import Reader
from upright.readers.source import Source
from upright.records import Record

_BOOK = "xl/workbook.xml"
_OLD = b"\xd0\xcf\x11\xe0"


def read(source: Source) -> Record:
    """Record of the first sheet with rows of numbers."""
    name, text, note = first_sheet(source)
    try:
        record = delimited.read(text)
    except BadInput as error:
        raise BadInput(f"Sheet '{name}' of {error}") from None
    return replace(record, provenance=source.provenance("excel", note, *record.provenance.notes))


def first_sheet(source: Source) -> tuple[str, Source, str]:
    """Name of the first sheet with rows of numbers, what it would be as a text, and which others there are."""
    if source.data.startswith(_OLD):
        raise source.bad("this is Excel's old format; save it as .xlsx or CSV")
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise source.bad(
            "sheets of Excel need openpyxl; pip install 'upright[excel]', or save the sheet as CSV"
        ) from None
    with ZipFile(BytesIO(source.data)) as file:
        if sum(member.file_size for member in file.infolist()) > source.most_unpacked << 20:
            raise source.bad("it would unpack to more than any log holds; save the sheet as CSV")
    try:
        book = load_workbook(BytesIO(source.data), read_only=True, data_only=True)
        sheets = {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in book.worksheets}
    except Exception as error:  # openpyxl has none of its own
        raise source.bad(f"the file is damaged or no workbook ({error}); save it again") from None
    with_numbers = [n for n, rows in sheets.items() if any(isinstance(v, float | int) for row in rows for v in row)]
    if not with_numbers:
        raise source.bad(f"none of its sheets has rows of numbers: {', '.join(sheets)}; name the columns above them")
    name = with_numbers[0]
    others = f", of {', '.join(with_numbers)}" if with_numbers[1:] else ""
    return name, replace(source, data=_text(sheets[name]).encode()), f"Sheet '{name}'{others}."


def _text(rows: Iterable[tuple[Any, ...]]) -> str:
    """Rows as text; the empty columns at the right, which formatting leaves there, fall away."""
    cells = [[_cell(value) for value in row] for row in rows]
    width = max((i + 1 for row in cells for i, cell in enumerate(row) if cell), default=0)
    left = min((i for row in cells for i, cell in enumerate(row) if cell), default=0)
    return "".join("\t".join(row[left:width]) + "\n" for row in cells if any(row))


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, datetime | date | time):
        return value.isoformat(sep=" ") if isinstance(value, datetime) else value.isoformat()
    return repr(value) if isinstance(value, float | int) else str(value).replace("\t", " ").replace("\n", " ").strip()


def _recognises(source: Source) -> bool:
    if source.data.startswith(_OLD):
        return True
    try:
        return source.data.startswith(b"PK") and _BOOK in ZipFile(BytesIO(source.data)).namelist()
    except (BadZipFile, OSError, ValueError):
        return False


READER = Reader(name="excel", files="sheets of Excel (.xlsx)", recognises=_recognises, read=read, order=16)
