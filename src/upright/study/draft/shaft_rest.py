"""Who lies still, who is held, and where is zero? Bodies of a chain before and during a run."""

from __future__ import annotations

import numpy as np

from upright.readers.inspection import Column
from upright.records import Record

HELD = 0.2
"""Share of its neighbour's travel below which a body is held by hand."""

STILL = 0.005
"""Share of its travel by which a body that lies still may creep."""


def held_bodies(
    record: Record, columns: list[Column], names: list[str], windows: list[tuple[float, float]]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Coordinates held by hand, and locked ones."""
    inside = np.zeros(record.t.size, dtype=bool)
    for a, b in windows:
        inside |= (record.t >= a) & (record.t <= b)
    travel = [float(np.ptp(record[c.name][inside])) for c in columns]
    step = [max(c.quantum.step or 0.0, 1e-9 * max(travel)) for c in columns]
    still, locked = list[str](), list[str]()
    for name, far, least in zip(names, travel, step, strict=True):
        if far <= 2 * least:
            locked.append(name)
        elif far < HELD * max(travel):
            still.append(name)
    return tuple(still), tuple(locked)


def waiting(record: Record, columns: dict[str, Column], at: int) -> tuple[str, ...]:
    """Coordinates that lie still for 0.2 s before the first command; a log that begins with it began at rest."""
    before = slice(max(at - int(0.2 / record.period), 0), at + 1)
    return tuple(
        name
        for name, c in columns.items()
        if float(np.ptp(record[c.name][before])) <= max(3 * (c.quantum.step or 0.0), STILL * (c.high - c.low))
    )


def zero_at(record: Record, c: Column, window: tuple[float, float], at: int, *, driven: bool) -> float:
    """Reading at which a coordinate is zero: before the first command, else where the first stretch ends."""
    x, t = record[c.name], record.t
    if driven:
        return float(np.median(x[max(0, at - 50) : at])) if at >= 5 else float(x[0])
    late = (t <= window[1]) & (t >= window[1] - 0.3 * (window[1] - window[0]))
    return (float(x[late].max()) + float(x[late].min())) / 2
