"""Logs whose every row is a function of its number, so that a wrong row cannot hide."""

from __future__ import annotations

import io
import math

import numpy as np

from upright.logs import LogHeader, RunLog
from upright.logs.layout import RunFile

HEADER = LogHeader(
    rig='[rig]\nname = "twin"\n', law={}, coordinates=(("psi", "rad"), ("theta", "rad")), command_unit="V", period=1e-3,
    modes={0: "IDLE", 2: "HOST", 4: "FAULT"}, faults={2: "OVERTRAVEL", 4: "OVERSPEED"},
    versions={"upright": "0.1.0"},
)  # fmt: skip


def row(k: int) -> tuple[float, ...]:
    """Row number k of every run here."""
    psi, theta = round(5000 * math.sin(0.01 * k)), round(900 * math.cos(0.003 * k))
    u = 3.0 * math.sin(0.02 * k)
    return (k * 1e-3, k, psi, theta, psi * 2 * math.pi / 16000, theta * 2 * math.pi / 4096, u, round(u, 2), 2, 0)


def wrong(log: RunLog) -> list[int]:
    """Numbers of rows that are not as they were written."""
    there = np.array([row(int(k)) for k in log.columns["tick"]]).reshape(-1, len(log.columns))
    read = np.column_stack([np.asarray(x, dtype=np.float64) for x in log.columns.values()])
    return np.flatnonzero((there != read).any(axis=1)).tolist()


def written(rows: int, *, header: LogHeader = HEADER, every: int = 100, finish: bool = True) -> bytes:
    """Bytes of a log of so many rows, a chunk `every` so many; not finished, as a torn one is."""
    stream = io.BytesIO()
    file = RunFile(stream, header)
    for k in range(rows):
        file.row(row(k))
        if (k + 1) % every == 0:
            file.flush()
    file.event(rows * 1e-3, "stop", "asked")
    file.flush()
    if finish:
        file.finish()
    return stream.getvalue()
