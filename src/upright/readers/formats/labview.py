"""Record of a LabVIEW measurement file (.lvm), as National Instruments specify it: tags, then rows of numbers.

The first header says how cells and decimals are parted, that of each segment units and steps of its channels. Segments
that go on in time are one run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from upright.readers.reader import Reader
from upright.readers.source import Source, TextTable
from upright.records import Array, Record
from upright.records.columns import stated_unit

_FIRST = "LabVIEW Measurement"
_END = "***End_of_Header***"
_AXIS = "X_Value"

Tags = dict[str, list[str]]


@dataclass(frozen=True, kw_only=True)
class _Segment:
    """Time [s], and channels with their units."""

    t: Array
    signals: dict[str, Array]
    units: dict[str, str]


def read(source: Source) -> Record:
    """Record of all segments, which must follow one another in time and have the same channels."""
    lines = source.text.split("\n")
    ends = [i for i, line in enumerate(lines) if line.strip() == _END]
    if len(ends) < 2:
        raise source.bad(f"expected a line '{_END}' of the file and one of a segment, got {len(ends)}; export it again")
    tags = _tags(lines[: ends[0]], "\t" if "\t" in lines[ends[0] - 1] else ",")
    segments: list[_Segment] = []
    for begin, end, beyond in zip(ends, ends[1:], [*ends[2:], len(lines)], strict=False):
        segments.append(_segment(source, tags, lines, begin + 1, end + 1, beyond))
    first = segments[0]
    if any(s.signals.keys() != first.signals.keys() for s in segments):
        raise source.bad(f"its {len(segments)} segments hold different channels; export each for itself")
    t = np.concatenate([s.t for s in segments])
    advice = "its segments are runs of their own, export each for itself"
    source.must_increase(t, lambda row: {"sample": row + 1}, advice=advice)
    began = " ".join(tags[tag][0] for tag in ("Date", "Time") if tags.get(tag))
    notes = [f"Begun {began}."] * bool(began) + [f"{len(segments)} segments."] * (len(segments) > 1)
    return Record(
        t=t, signals={n: np.concatenate([s.signals[n] for s in segments]) for n in first.signals}, units=first.units,
        provenance=source.provenance("labview", *notes),
    )  # fmt: skip


def _tags(lines: Sequence[str], part: str) -> Tags:
    """Values of each tag; a tag stands in the first column."""
    parts = [[cell.strip() for cell in line.split(part)] for line in lines if line.strip()]
    return {head: values for head, *values in parts}


def _segment(source: Source, tags: Tags, lines: Sequence[str], begin: int, start: int, beyond: int) -> _Segment:
    """The segment whose header begins at a line, its names at another, and which ends before the next one's header."""
    part = "," if tags.get("Separator", [""])[0] == "Comma" else "\t"
    own = _tags(lines[begin : start - 1], part)
    at = next((i for i in range(start, beyond) if lines[i].strip()), start)
    names = [name.strip() for name in lines[at].split(part)] if at < beyond else []
    names = names[: names.index("Comment")] if "Comment" in names else names
    stop = next((i for i in range(at + 1, beyond) if lines[i].split(part)[0].strip() == "Channels"), beyond)
    rows = [line.split(part) for line in lines[at + 1 : stop] if line.strip()]
    if rows and not any(row[0].strip() for row in rows):  # X_Columns No: the column is there, and empty
        names, rows = names[1:], [row[1:] for row in rows]
    whole = [part.join([*row, *[""] * (len(names) - len(row))][: len(names)]) for row in rows]  # comments are left out
    table = TextTable(
        source=source, text="\n".join(whole), names=tuple(names), delimiter=part, first_line=at + 2,
        decimal_comma=tags.get("Decimal_Separator", [""])[0] == ",",
    ).numbers()  # fmt: skip
    axes = [i for i, name in enumerate(names) if name == _AXIS]
    channels = [i for i in range(len(names)) if i not in axes]
    if axes and (table[:, axes] != table[:, axes[:1]]).any():
        raise source.bad("its channels have times of their own; export them with one X column", line=at + 2)
    return _Segment(
        t=table[:, axes[0]] if axes else _steps(source, own, table.shape[0], at + 2),
        signals={names[i]: table[:, i] for i in channels},
        units={
            names[i]: stated_unit(f"y ({label})")
            for i, label in zip(channels, own.get("Y_Unit_Label", ()), strict=False)
        },
    )  # fmt: skip


def _steps(source: Source, tags: Tags, samples: int, line: int) -> Array:
    """Times [s] where no column has them."""
    try:
        start, step = (float(tags[tag][0].replace(",", ".")) for tag in ("X0", "Delta_X"))
    except (KeyError, IndexError, ValueError):
        raise source.bad("no column and no Delta_X says when samples were taken; export X columns", line=line) from None
    return np.asarray(start + step * np.arange(samples), dtype=np.float64)


def _recognises(source: Source) -> bool:
    return source.data.removeprefix(b"\xef\xbb\xbf").startswith(_FIRST.encode())


READER = Reader(name="labview", files="LabVIEW measurements (.lvm)", recognises=_recognises, read=read, order=28)
