"""Record of what the ECP Executive program exported.

"Export Raw Data" of Models 205 and 210: a line of column names apart by two or more blanks, an empty line,
then a MATLAB matrix between brackets, one sample per line, each but the last closed by a semicolon. Which
columns appear depends on what was ticked under Setup Data Acquisition, so they go by name.
"""

from __future__ import annotations

import re

from upright.readers.reader import Reader
from upright.readers.resolution import rebuild
from upright.readers.source import Source, TextTable
from upright.records import Record


def _recognises(source: Source) -> bool:
    """Whether text begins like an ECP export: names, then a bracket within the first lines."""
    head = source.text[:4000].split("\n")
    names = next((line for line in head if line.strip()), "")
    bracket = any(line.lstrip().startswith("[") for line in head[:12])
    return bracket or bool(re.match(r" *Sample {2,}Time( |$)", names))


def read(source: Source) -> Record:
    """Record of an ECP export: counts for positions, V for the control effort."""
    lines = source.text.split("\n")
    header = next((i for i, line in enumerate(lines) if line.strip()), 0)
    names = re.split(r"\s{2,}|\t", lines[header].strip())
    if names[0].startswith("["):
        raise source.bad("expected a line of column names before the '['; export the log again", line=header + 1)
    for name in ("Sample", "Time"):
        if name not in names:
            raise source.bad(
                f"expected the column names of an ECP export with '{name}', got {lines[header].strip()[:60]!r};"
                " names stand apart by two or more blanks",
                line=header + 1,
            )
    if len(set(names)) < len(names):
        raise source.bad("expected a different name for each column, got one twice", line=header + 1)
    first = next((i for i in range(header + 1, len(lines)) if lines[i].strip()), len(lines))
    last = next((i for i in range(len(lines) - 1, first, -1) if lines[i].strip()), first)
    body = _unwrapped(source, lines, first, last)
    rows = TextTable(source=source, text=body, names=tuple(names), delimiter=None, first_line=first + 1)
    columns = dict(zip(names, rows.numbers().T, strict=True))
    for name, unit in (("Sample", ""), ("Time", " s")):
        source.must_increase(columns[name], lambda row: {"line": rows.line(row)}, what=name, unit=unit)
    index, t = columns["Sample"], columns.pop("Time")
    t, note = rebuild(t, index)
    units = {name: "V" if "Effort" in name else "1" if name == "Sample" else "counts" for name in columns}
    return Record(t=t, signals=columns, units=units, provenance=source.provenance("ecp", *filter(None, [note])))


def _unwrapped(source: Source, lines: list[str], first: int, last: int) -> str:
    """Rows without brackets and semicolons, one per line."""
    if first >= len(lines) or not lines[first].lstrip().startswith("["):
        raise source.bad(
            "expected the matrix to begin with '['; export the log again", line=min(first, len(lines) - 1) + 1
        )
    rows: list[str] = []
    for i in range(first, last + 1):
        row = lines[i].strip()
        end = "]" if i == last else ";"
        if row and not row.endswith(end):
            if i == last:
                sentence = "expected ']' at the end of the last row; the file is cut short, export the log again"
            else:
                sentence = "expected ';' at the end of the row; the row is torn, mend or delete it"
            raise source.bad(sentence, line=i + 1, column=len(lines[i]) or 1)
        rows.append(row[(i == first) : -1] if row else "")
    return "\n".join(rows)


READER = Reader(name="ecp", files="ECP exports", recognises=_recognises, read=read, order=40)
