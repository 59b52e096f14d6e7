"""How does a spreadsheet write a table? Delimiters, encodings, decimal commas and blank rows."""

from __future__ import annotations

import csv
import re
from pathlib import Path

from upright.errors import BadInput


def cells_of(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header and rows with their line numbers, blank rows left out."""
    data = path.read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252", errors="replace")
    lines = text.splitlines()
    skip = 0
    delimiter = ""
    if lines and (declared := re.fullmatch(r'"?sep=(.)"?', lines[0].strip())):
        delimiter, skip = declared[1], 1
    if len(lines) < skip + 2:
        raise BadInput(f"'{path.name}' needs a line of headings and at least one row, and has {len(lines)} lines.")
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
                f"'{path.name}', line {number}: {len(cells)} cells under {len(header)} headings; a comma inside a text"
                " needs quotes."
            )
        cells = (cells + [""] * len(header))[: len(header)]
        rows.append((number, [c.replace(",", ".") if delimiter == ";" and is_number(c) else c for c in cells]))
    if not rows:
        raise BadInput(f"'{path.name}' has headings and no answers.")
    return header, rows


def is_number(text: str) -> bool:
    """Whether a cell holds a number, with a decimal point or comma, perhaps in percent."""
    return re.fullmatch(r"[+-]?\d+(?:[.,]\d+)?\s*%?", text) is not None
