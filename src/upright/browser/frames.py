"""Every sample of a rig in six to eight bytes: counts as differences from the first, the command in steps.

A frame, little-endian: ``u32 tick`` of its first sample, ``u16 n`` samples one tick after the other, ``u8`` encoders,
``u8`` ticks that were late meanwhile (255 and more are 255); for each encoder ``i32`` counts at the first sample and
``i16[n]`` counts less those; ``f32`` size of a step and ``i16[n]`` the command that was put out, in such steps.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

_FARTHEST = 32767  # of 16 bits with a sign
_MOST = 4096  # samples of a frame


def step_of(limit: float, converter: float) -> float:
    """Size of a step of the command: the converter's, unless the limit has too many of those."""
    return converter if converter * _FARTHEST >= limit > 0.0 and converter > 0.0 else max(limit, 1e-30) / _FARTHEST


def frames(rows: NDArray[np.void], encoders: int, step: float, late: int) -> Iterator[bytes]:
    """Frames of rows of a desk, in order.

    Parameters
    ----------
    step : float
        From `step_of`.
    late : int
        Late ticks before the first row.
    """
    counts, ticks = rows["counts"][:, :encoders].astype(np.int64), rows["tick"]
    scale = float(np.float32(step))
    steps = np.clip(np.rint(np.nan_to_num(rows["applied"]) / scale), -_FARTHEST, _FARTHEST).astype("<i2")
    begin = 0
    while begin < len(rows):
        away = counts[begin : begin + _MOST] - counts[begin]
        together = (np.abs(away) <= _FARTHEST).all(axis=1) & (
            ticks[begin : begin + _MOST] - ticks[begin] == np.arange(len(away))
        )
        n = len(away) if together.all() else int(np.argmin(together))
        end = begin + n
        now = int(rows["late"][end - 1])
        parts = [struct.pack("<IHBB", ticks[begin] & 0xFFFFFFFF, n, encoders, min(now - late, 255))]
        for first, column in zip(counts[begin].tolist(), away[:n].T, strict=True):
            parts += [struct.pack("<i", (first + 2**31) % 2**32 - 2**31), column.astype("<i2").tobytes()]
        yield b"".join([*parts, struct.pack("<f", step), steps[begin:end].tobytes()])
        begin, late = end, now
