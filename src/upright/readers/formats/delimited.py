"""Record of a table of numbers, with or without a line of names; and of a record that this package wrote as text.

Commas, semicolons, tabs or blanks part the cells; names stand in the line above the numbers, perhaps after
a ``#`` or ``%``, a line of units under them. Without names the columns are c0, c1, ... and c0 is the time when it
increases. The first column may hold dates and times of day, and numbers may have names and units beside them.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence

import numpy as np

from upright.readers.labelled import Label, bare_rows, without_arrival
from upright.readers.reader import READERS, Reader
from upright.readers.resolution import epoch_digits, exact_seconds, is_epoch, is_index, rebuild
from upright.readers.responses import is_frequency, response_columns
from upright.readers.source import Source, TextTable
from upright.readers.stamps import in_seconds
from upright.readers.wrapped import counting_on
from upright.records import Array, Record
from upright.records.columns import stated_time_unit, stated_unit, time_scale
from upright.records.record import CSV_MARK
from upright.units import converted

EVENLY = 'as in --time-unit "20 ms" (in a study, time_unit)'
"""What to try where a log holds no time."""
_FIRST = 200  # lines that names and remarks may take
_QUOTED = re.compile(r'"[ \t]*([+-]?)(\d*)([.,]?)(\d*)((?:[eE][+-]?\d+)?)[ \t]*"')
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?|[+-]?(?:nan|inf|infinity)"


def layout(source: Source, text: str | None = None) -> TextTable:
    """Names, delimiter and rows of a table, of its `text` without what ends its rows where that is given.

    Raises
    ------
    BadInput
        When no line begins with a number, or a name stands above two columns.
    """
    given = _unquoted(source.text if text is None else text)
    sent, arrival = without_arrival(given)
    stamped, began = in_seconds(sent)
    text, labels = bare_rows(stamped)
    lines = _first_lines(text)
    first = next((i for i, line in enumerate(lines) if begins_with_number(line)), -1)
    if first < 0:
        raise source.bad(
            "there are no rows of numbers, with at most one line of names above them;"
            f" formats that can be read: {', '.join(reader.files for reader in READERS.sound().values())}",
            line=1,
        )
    above = [i for i in range(first) if lines[i].strip()]
    candidates = [lines[i].strip(" ") for i in above]
    delimiter = _delimiter(lines[first], candidates[-1] if candidates else "")
    if delimiter and _trails(lines[first], candidates[-1] if candidates else "", delimiter):
        return layout(source, re.sub(rf"{re.escape(delimiter)}[ \t]*$", "", given, flags=re.MULTILINE))
    width = len(lines[first].split(delimiter))
    names = _names(candidates, lines[first], delimiter, labels)
    if names and len(names) != width and not candidates[-1].startswith(("#", "%")):
        raise source.bad(
            f"expected a name for each of the {width} columns below, got {len(names)};"
            " mend the line of names or the first row",
            line=above[-1] + 1,
        )
    named = bool(names) and len(names) == width
    names = [name or f"c{j}" for j, name in enumerate(names)] if named else [f"c{j}" for j in range(width)]
    for j, name in enumerate(names):
        if name in names[:j]:
            raise source.bad(
                "expected a different name for each column, got this one twice",
                line=above[-1] + 1,
                column=j + 1,
                name=name,
            )
    start = sum(len(line) + 1 for line in lines[:first])
    # of all rows: a rig that rests is logged as 0;0;0
    comma = delimiter in (";", "\t", None) and text.find(",", start) >= 0 and text.find(".", start) < 0
    return TextTable(
        source=source,
        text=text,
        start=start,
        names=tuple(names),
        delimiter=delimiter,
        first_line=first + 1,
        decimal_comma=comma,
        named=named,
        began=began,
        arrival=arrival,
    )


def _unquoted(text: str) -> str:
    """The text with its numbers out of quotation marks; a comma in one of them is read where it parts no thousands."""
    if '"' not in text:
        return text
    fractions = any(len(m[4]) != 3 or m[2] in ("", "0") for m in _QUOTED.finditer(text) if m[3] == ",")

    def bare(cell: re.Match[str]) -> str:
        sign, whole, mark, fraction, power = cell.groups()
        if not whole + fraction or (mark == "," and not fractions):
            return cell[0]
        return f"{sign}{whole}{mark and '.'}{fraction}{power}"

    return _QUOTED.sub(bare, text)


def _names(above: Sequence[str], row: str, delimiter: str | None, labels: Sequence[Label]) -> list[str]:
    """Names of columns, with the units that stand in a line of their own or beside each number."""
    rows = [_split(re.sub(r"^[#%]+\s*", "", line), _delimiter(row, line)) for line in above[-2:]]
    names = rows[-1] if rows else []
    units = [unit for _, unit in labels]
    if any(name for name, _ in labels):
        names = [name for name, _ in labels]
    elif len(rows) > 1 and len(rows[0]) == len(names) and _are_units(names):
        names, units = rows[0], [unit.strip("()[] ") for unit in names]
    if len(names) != len(units) or any(map(stated_unit, names)):
        return names
    return [f"{name} ({unit})" if name and unit else name for name, unit in zip(names, units, strict=True)]


def _are_units(cells: Sequence[str]) -> bool:
    """Whether a line says in which unit each column is: a time the first, and the others where they have one."""
    units = [cell.strip("()[] ") for cell in cells]
    named = any(re.search(r"[()\[\]]", unit) for unit in units)  # a unit in brackets has its name before it
    return not named and bool(stated_time_unit(f"({units[0]})")) and all(stated_unit(f"({u})") for u in units if u)


def _first_lines(text: str) -> list[str]:
    """The lines among which the first row of numbers must be; ten million lines would take 700 MB."""
    lines, at = list[str](), 0
    while at <= len(text) and len(lines) < _FIRST:
        end = text.find("\n", at)
        lines.append(text[at : end if end >= 0 else None])
        at = end + 1 if end >= 0 else len(text) + 1
    return lines


def read(source: Source) -> Record:
    """Record of a table; time is the column named like it, else the first when it increases."""
    return tabulated(source)


def tabulated(source: Source, given: str | None = None) -> Record:
    """The record that `read` makes; of a `given` text where the table stands otherwise in the file."""
    text = layout(source, given)
    table = text.numbers()
    at, seconds = _time_column(text, table)
    notes: list[str] = []
    if text.began:
        notes.append(f"Time is counted from the first sample, {text.began}.")
        if text.arrival == 0:
            notes.append(
                "Its times are those at which lines arrived, which a buffer shifts; log the board's own clock."
            )
    elif text.arrival:
        notes.append(f"The first column is a clock that counts {text.arrival:g} s, as the times of arrival say.")
    elif not text.named:
        notes.append("The log names no columns; they are called c0, c1, ... and c0 increases, so it is the time.")
    elif at is None:
        notes.append("The log holds no time; its rows are counted.")
    elif not (time_scale(text.names[at]) or stated_time_unit(text.names[at])):
        notes.append(f"No column is named like a time; '{text.names[at]}' is the first and increases.")
    ticks, bits, again = counting_on(np.arange(table.shape[0]) if at is None else table[:, at])
    if again:
        often = "once" if again == 1 else f"{again} times"
        notes.append(f"Its clock of {bits} bits began again {often}; the time goes on.")
    t = converted(ticks, seconds)
    if at is not None and is_epoch(t) and seconds == 1:
        rows = [line for line in text.body.split("\n") if line.strip()]
        cells = [row.split(text.delimiter)[at] for row in rows]
        lines = range(text.first_line, text.first_line + len(cells))
        t, first = exact_seconds(source, cells, lines, name=text.names[at], column=at + 1, digits=epoch_digits(t))
        notes.append(f"Time is counted from the first sample, epoch {first * 1e-9:.6f} s.")
    source.must_increase(
        t,
        lambda row: {"line": text.line(row), **({} if at is None else {"column": at + 1, "name": text.names[at]})},
        advice="mend or delete the row, or read each run on its own",
    )
    index = next((table[:, j] for j, name in enumerate(text.names) if is_index(name, table[:, j])), None)
    t, note = rebuild(t, index)
    if given is None and not source.text.endswith("\n") and text.body.rstrip(" "):
        notes.append(_torn(text, table.shape[0]))
    stamps = range(at or 0) if text.began else ()  # a date in a cell of its own, before the time
    signals = {name: table[:, j] for j, name in enumerate(text.names) if j != at and j not in stamps}
    return Record(
        t=t,
        signals=signals,
        units={name: stated_unit(name) for name in signals},
        provenance=source.provenance("table", *filter(None, [note, *notes])),
    )


def of_columns(source: Source, columns: Mapping[str, Sequence[str]]) -> Record:
    """The record that `read` makes of columns whose cells are given as text; a column of stamps may be anywhere."""
    stamped = next((name for name, cells in columns.items() if cells and in_seconds(cells[0])[1]), None)
    names = sorted(columns, key=lambda name: name != stamped)
    written = [
        f"c{name}" if begins_with_number(name) else re.sub(r"\s+", " ", name).replace('"', "'") for name in names
    ]
    head = ",".join(f'"{name}"' if "," in name else name for name in written)
    rows = map(",".join, zip(*(columns[name] for name in names), strict=True))
    return tabulated(source, "\n".join([head, *rows]) + "\n")


def read_written(source: Source) -> Record:
    """Record written by `Record.to_csv`, with the line and column of any damage."""
    lines = source.text.split("\n")
    if len(lines) < 4 or not lines[0].startswith(CSV_MARK) or not lines[1].startswith("# "):
        raise source.bad(f"expected '{CSV_MARK}', a line of units and provenance, names and numbers", line=1)
    try:
        names = next(csv.reader([lines[2]], strict=True), [])
    except csv.Error as error:
        raise source.bad(f"expected a line of names, got a broken quotation ({error})", line=3) from None
    if not names or names[0] != "t" or len(set(names)) < len(names):
        raise source.bad("expected names that differ, the first of them 't'", line=3)
    rows = TextTable(source=source, text="\n".join(lines[3:]), names=tuple(names), delimiter=",", first_line=4)
    t, *signals = rows.numbers().T
    return Record.rebuild(t, dict(zip(names[1:], signals, strict=True)), lines[1][2:])


def begins_with_number(line: str) -> bool:
    """Whether the first cell of a line is a number."""
    return re.match(rf"\s*(?:{_NUMBER})\s*(?:[,;\s]|$)", line, re.IGNORECASE) is not None


def _delimiter(row: str, header: str) -> str | None:
    for delimiter in ("\t", ";"):
        if delimiter in row:
            return delimiter
    decimal = re.fullmatch(r"\s*[+-]?\d+,\d+(\s+[+-]?\d+,\d+)*\s*", row) and "," not in header and row.count(",") > 1
    return "," if "," in row and not decimal else None


def _trails(row: str, header: str, delimiter: str) -> bool:
    """Whether rows end with a delimiter that no further column follows; a last column left empty has a name."""
    if not row.rstrip(" ").endswith(delimiter) or delimiter == "\t":
        return False
    names = header.rstrip(" ").split(delimiter)
    return not names[-1].strip() or len(names) < len(row.split(delimiter))


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        wide = re.split(r"\s{2,}", line.strip())  # names may hold single blanks
        return [name.strip('"') for name in (wide if len(wide) > 1 else line.split())]
    try:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        cells = line.split(delimiter)
    return [name.strip() for name in cells]


def _time_column(text: TextTable, table: Array) -> tuple[int | None, float]:
    """Which column is the time, None where its rows are counted, and the seconds per unit of it."""
    if text.began:
        return int((text.delimiter or " ") in text.began), 1.0  # behind a date in a cell of its own
    if text.arrival:
        return 0, text.arrival
    for j, name in enumerate(text.names if text.named else ()):
        if seconds := time_scale(name):
            return j, seconds
    first = table[:, 0]
    rising = first.size > 1 and bool((np.diff(first) > 0).all())
    if text.source.counted and not rising:
        return None, 1.0
    if text.named and (is_frequency(text.names[0]) or response_columns(text.names)):
        raise text.source.bad(
            f"expected a time column named 't' or 'time', got the frequencies '{text.names[0]}': this is a frequency"
            f" response and no log; `upright frequency` reads it",
            line=text.first_line - 1,
        )
    if text.named and is_index(text.names[0], first) and not text.source.counted:
        raise text.source.bad(
            f"expected a time column named 't' or 'time', got only the sample index '{text.names[0]}';"
            f" add the time of each sample in s, or say what lies between two, {EVENLY}",
            line=text.first_line - 1,
        )
    if text.named and first.size > 1 and not rising:
        raise text.source.bad(
            f"expected a time column named 't' or 'time', got: {', '.join(text.names)[:120]};"
            f" name the time column, put it first, or say what lies between two rows, {EVENLY}",
            line=max(text.first_line - 1, 1),
        )
    return 0, (stated_time_unit(text.names[0]) if text.named else 0.0) or 1.0


def _torn(text: TextTable, rows: int) -> str:
    """Judge a last row without line end: torn when its last number is shorter than the fixed format above it."""
    lines = [line for line in text.body.rsplit("\n", 8)[-8:] if line.strip()]
    ends = [line.split(text.delimiter)[-1].strip() for line in lines]
    decimals = {len(end.partition(".")[2]) for end in ends[:-1]}
    if len(ends) > 3 and len(decimals) == 1 and len(ends[-1].partition(".")[2]) not in decimals:
        raise text.source.bad(
            f"expected {decimals.pop()} decimals and a line end, got {ends[-1]!r}; the last row is torn,"
            " export the log again or delete it",
            line=text.line(rows - 1),
            column=len(text.names),
            name=text.names[-1],
        )
    return "The last row has no line end; if the log was cut short, its last number may be cut as well."


TABLE = Reader(name="table", files="CSV and tab-separated text", recognises=lambda source: True, read=read, order=100)
WRITTEN = Reader(
    name="upright", files="records as text", recognises=lambda source: source.text.startswith(CSV_MARK),
    read=read_written, order=30,
)  # fmt: skip
