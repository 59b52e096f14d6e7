"""A `Law` as the firmware's own loop holds it: one matrix in float32, between counts, converter steps and ticks."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.laws import Law
from upright.rigs import wire
from upright.rigs.protocol import Capabilities

Float32 = NDArray[np.float32]

MEMORIES, READINGS, REFERENCES = 4, 2, 1
"""What the firmware has room for."""
_LONGEST = 255  # ticks from one sample to the next
_END = struct.Struct("<hBB")


@dataclass(frozen=True, kw_only=True, eq=False)
class OnboardLaw:
    """The numbers that a board multiplies, with zeros where a law needs less room.

    Attributes
    ----------
    matrix : array, shape (5, 7)
        ``[[A, B], [C, D]]``: from memories, readings less their targets [counts] and reference [rad or m] to memories
        and command [steps].
    target, initial, begin : array, shape (2,), (4,), (4, 2)
        As of `Law`; targets in counts.
    limit : int
        Largest command [steps].
    held_sums : int
        Bit i is set where memory i stands still beyond the limit.
    every : int
        Ticks from one sample to the next.
    """

    matrix: Float32
    target: Float32
    initial: Float32
    begin: Float32
    limit: int
    held_sums: int
    every: int

    def body(self) -> bytes:
        """As the firmware reads it, and gives it back."""
        numbers = (self.matrix, self.target, self.initial, self.begin)
        return b"".join(n.astype("<f4").tobytes() for n in numbers) + _END.pack(self.limit, self.held_sums, self.every)


def onboard(law: Law, about: Capabilities, tick: float) -> OnboardLaw:
    """The same law in the units of a board with that tick [s]; its references come with every exchange.

    Raises
    ------
    BadInput
        When it has more memories, readings, references or commands than the firmware, is of several lanes, or is made
        for a period that is no multiple of the board's.
    """
    if any(width > 1 for width in law.widths().values()):
        raise BadInput("a rig runs one law, and this one is of several lanes; take one of them (of_lanes).")
    if law.measured and law.measured != about.coordinates:
        if unknown := [name for name in law.measured if name not in about.coordinates]:
            raise BadInput(f"the law reads {', '.join(unknown)}, and the rig has {', '.join(about.coordinates)}.")
        law = law.over(about.coordinates, len(law.D))
    references = law.signal().shape[1]
    if law.readings != len(about.coordinates):
        raise BadInput(
            f"the law reads {law.readings} coordinates, and the rig has {len(about.coordinates)}: "
            f"{', '.join(about.coordinates)}; name what it reads (measured)."
        )
    for what, has, room in (
        ("memories", len(law.A), MEMORIES), ("readings", law.readings, READINGS),
        ("references", references, REFERENCES), ("commands", len(law.D), 1),
    ):  # fmt: skip
        if has > room:
            raise BadInput(f"the firmware has room for {room} {what}, and this law has {has}; run it on the host.")
    every = ticks(law.period, tick) if law.period else 1
    wired = law.in_units(1.0 / np.array(about.counts), 0.0, 1.0 / about.step)
    z, n = len(law.A), law.readings
    matrix = np.zeros((MEMORIES + 1, MEMORIES + READINGS + REFERENCES))
    columns = [*range(z), *range(MEMORIES, MEMORIES + n), *range(MEMORIES + READINGS, len(matrix[0]))]
    columns = columns[: z + n + references]
    matrix[:z, columns] = np.hstack([wired.A, wired.B])
    matrix[MEMORIES, columns] = np.hstack([wired.C, wired.D])[0]
    sums = (np.eye(z) == wired.A).all(axis=1) & (wired.windup == "hold")
    limit = math.floor(min(wired.limit + 1e-6, about.steps, wire.MOST))
    if limit < 1:
        raise BadInput(
            f"the law's limit of {law.limit:g} {about.command_unit} is less than the converter's step of "
            f"{about.step:g} {about.command_unit}."
        )
    return OnboardLaw(
        matrix=_float32(matrix), target=_padded(np.broadcast_to(wired.target, n), READINGS),
        initial=_padded(np.zeros(z) if wired.initial is None else wired.initial, MEMORIES),
        begin=_padded(np.zeros((z, n)) if wired.begin is None else wired.begin, MEMORIES, READINGS),
        limit=limit, held_sums=sum(1 << i for i in range(z) if sums[i]), every=every,
    )  # fmt: skip


def ticks(period: float, tick: float) -> int:
    """A period in ticks of the board."""
    whole = round(period / tick)
    if not 1 <= whole <= _LONGEST or not math.isclose(whole * tick, period, rel_tol=1e-3):
        raise BadInput(
            f"a period of {1e3 * period:.6g} ms is requested, and the rig ticks every {1e3 * tick:.6g} ms; design for "
            f'that or up to {_LONGEST} times as much: upright design FIT --period "{1e3 * tick:.6g} ms".'
        )
    return whole


def _padded(values: ArrayLike, *shape: int) -> Float32:
    entries = np.asarray(values, dtype=np.float64)
    out = np.zeros(shape)
    out[tuple(slice(0, size) for size in entries.shape)] = entries
    return _float32(out)


def _float32(values: NDArray[np.float64]) -> Float32:
    with np.errstate(over="ignore"):  # the firmware refuses what is no number or absurd, and stops
        return values.astype(np.float32)
