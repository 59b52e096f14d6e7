"""What stands between a loop and those who look on: every tick goes out, taps, gains and references come in.

It is memory of two processes, each number of it written by one side, and nobody waits for the other. Rows that are not
read in time are written over; their numbers tell. What comes in is looked at once per tick, and has an effect only
where the loop's own supervisor accepts it.
"""

from __future__ import annotations

import multiprocessing
import struct
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.errors import UprightError
from upright.laws import Law
from upright.realtime.reference import SHAPES, Reference
from upright.realtime.session import RunState, Stage

ROWS = 4096
"""Ticks that the ring holds."""
ENCODERS = 8
"""Most coordinates of a rig."""
NUMBERS = 64
"""Most gains of a law."""
ROW = np.dtype(
    [("number", "<i8"), ("tick", "<i8"), ("late", "<i8"), ("mode", "<i8"), ("faults", "<i8"),
     ("counts", "<i8", (ENCODERS,)), ("command", "<f8"), ("applied", "<f8"), ("again", "<i8")]
)  # fmt: skip
"""A tick; its number stands at both ends, so that a row that is being written is known by it."""

_HEAD, _STOP, _GIVEN, _FOLLOWED, _SINCE, _CHANGED, _ANSWERED, _AT, _TAKEN, _MARKS = range(10)
_SLOTS, _OF_SLOT = 16, 3  # references that are not written over while one of them is read, and numbers of each
_PACKED = struct.Struct(f"<5q{ENCODERS}q2dq")
_SENTENCE = 400


class Desk:
    """Memory that a run in a process of its own shares with the process that started it; of one run alone."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._marks = context.RawArray("q", _MARKS)
        self._ring = context.RawArray("c", ROWS * ROW.itemsize)
        self._taps = context.RawArray("d", ENCODERS)  # sums of all so far, so that none is lost
        self._references = context.RawArray("d", _SLOTS * _OF_SLOT)
        self._target = context.RawArray("d", ENCODERS)
        self._law = context.RawArray("d", 1 + NUMBERS)
        self._sentence = context.RawArray("c", _SENTENCE + 1)
        self._felt = [0.0] * ENCODERS
        self._follows: Reference | None = None

    # in the process that started the run

    def stop(self) -> None:
        """End the run, or keep it from its start; nothing takes this back."""
        self._marks[_STOP] = 1

    def tap(self, coordinate: int, speed: float) -> None:
        """A tap of a twin's hand [rad/s or m/s]; a rig that is no twin feels none."""
        self._taps[coordinate] += speed

    def follow(self, reference: Reference) -> None:
        """What the law's first reference is from the next tick on."""
        number = self._marks[_GIVEN] + 1
        begin = number % _SLOTS * _OF_SLOT
        self._references[begin : begin + _OF_SLOT] = [
            float(SHAPES.index(reference.shape)), reference.size, reference.period
        ]  # fmt: skip
        self._marks[_GIVEN] = number

    @property
    def followed(self) -> tuple[int, Reference, int, tuple[float, ...]] | None:
        """Number of the reference that the loop follows, itself, the tick where it began, and what was held there."""
        number = self._marks[_FOLLOWED]
        return (number, self._reference(number), self._marks[_SINCE], tuple(self._target)) if number else None

    def change(self, law: Law) -> bool:
        """Ask for C and D of a law that has all else alike; False while the last change is not answered."""
        numbers = _numbers(law)
        if self._marks[_CHANGED] != self._marks[_ANSWERED] or len(numbers) > NUMBERS:
            return False
        self._law[0 : 1 + len(numbers)] = [float(len(numbers)), *numbers]
        self._marks[_CHANGED] += 1
        return True

    @property
    def answered(self) -> tuple[int, int, str]:
        """Which change of gains was answered last, at which tick, and why it was refused, or an empty text."""
        return self._marks[_ANSWERED], self._marks[_AT], self._sentence.value.decode(errors="ignore")

    @property
    def taken(self) -> int:
        """When the last tap or change was taken, by the monotonic clock [ns]."""
        return self._marks[_TAKEN]

    def since(self, number: int) -> tuple[int, NDArray[np.void]]:
        """The number after the newest row, and the rows from one number on, without those that are lost."""
        head = self._marks[_HEAD]
        numbers = np.arange(max(number, head - ROWS // 2, 0), head)
        rows = np.frombuffer(self._ring, dtype=ROW)[numbers % ROWS]
        return head, rows[(rows["number"] == numbers) & (rows["again"] == numbers)]

    # in the loop's process

    @property
    def stopping(self) -> bool:
        """Whether the run is to end."""
        return self._marks[_STOP] != 0

    def put(self, state: RunState) -> None:
        """Show a tick."""
        if not state.counts:
            return  # the loop has not begun
        number, counts = self._marks[_HEAD], state.counts[:ENCODERS]
        _PACKED.pack_into(
            self._ring, number % ROWS * _PACKED.size, number, state.tick, state.late, int(state.mode),
            int(state.faults), *counts, *(0,) * (ENCODERS - len(counts)), state.command, state.applied, number,
        )  # fmt: skip
        self._marks[_HEAD] = number + 1

    def heed(self, stage: Stage) -> float | None:
        """Take what came in since the last tick; the reference, where there is one."""
        marks = self._marks
        if marks[_CHANGED] != marks[_ANSWERED]:
            self._answer(stage)
        if (taps := self._taps[:]) != self._felt:
            speeds = [now - before for now, before in zip(taps, self._felt, strict=True)]
            self._felt = taps
            stage.tap(speeds[: len(stage.units)])
            marks[_TAKEN] = time.monotonic_ns()
        if (number := marks[_GIVEN]) != marks[_FOLLOWED]:
            self._follows = self._reference(number)
            target = stage.supervisor.target[:ENCODERS]
            self._target[: len(target)] = target
            marks[_SINCE] = marks[_HEAD]
            marks[_FOLLOWED] = number  # last, since whoever reads looks here first
        if self._follows is None:
            return None
        return self._follows.at(marks[_HEAD] - marks[_SINCE], stage.supervisor.about.period)

    def _reference(self, number: int) -> Reference:
        begin = number % _SLOTS * _OF_SLOT
        shape, size, period = self._references[begin : begin + _OF_SLOT]
        return Reference(shape=SHAPES[int(shape)], size=size, period=period)

    def _answer(self, stage: Stage) -> None:
        law, values = stage.supervisor.law, np.array(self._law[1 : 1 + int(self._law[0])])
        why = "the law that runs has other numbers."
        if isinstance(law, Law) and len(values) == len(_numbers(law)):
            C, D = (x.reshape(m.shape) for x, m in zip(np.split(values, [law.C.size]), (law.C, law.D), strict=True))
            try:
                why = stage.supervisor.change(replace(law, C=C, D=D))
            except UprightError as error:
                why = str(error)
        self._sentence.value = why.encode()[:_SENTENCE]
        self._marks[_AT] = self._marks[_HEAD] + 1
        self._marks[_TAKEN] = time.monotonic_ns()
        self._marks[_ANSWERED] = self._marks[_CHANGED]


def _numbers(law: Law) -> list[float]:
    return [*law.C.ravel().tolist(), *law.D.ravel().tolist()]
