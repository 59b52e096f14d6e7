"""The process of the lanes: all twins of a class by the clock on the wall, several ticks at each waking.

A slice is late when its twins are not through with it, or woken, by the time of the next one; all its ticks are late
then. They are counted and passed over, as in any loop here.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.browser.classroom.lanes import Lanes, LaneTicks
from upright.browser.classroom.memory import (
    BY_HAND,
    CLOSE,
    ENDED,
    HEAD,
    LATE,
    LEANT,
    LOOKS,
    PASSED,
    PRIORITY,
    ROWS,
    RUNNING,
    TRAVELLED,
    UNHEARD,
    SharedLanes,
)
from upright.laws import Law
from upright.realtime.interrupts import ENDING
from upright.realtime.pace import WallClock
from upright.realtime.priority import step_forward
from upright.realtime.process import dead_parent, deaf_parent, end_with_parent
from upright.realtime.reference import SHAPES, Reference
from upright.records import Array
from upright.rig import Rig

TICKS = 16
"""Of a slice: some 14 ms of the Furuta pendulum, 16 ms at 1 kHz."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LanesOrder:
    """What the lanes are.

    Attributes
    ----------
    rigs : sequence of Rig
        As they truly are.
    law : Law
        As each run begins with it.
    travel : tuple of float
        How far each coordinate may go, as the encoders show it [rad or m].
    lean : float
        How far the last one may be from the law's target.
    fifo : bool
        Whether to ask for FIFO priority.
    signals : sequence of array
        What a rig can be ordered to put out from rest, by a number from 1 on.
    """

    rigs: Sequence[Rig]
    at: str
    zero: str
    law: Law
    travel: tuple[float, ...]
    lean: float
    fifo: bool
    signals: Sequence[Array] = ()


class Attendant:
    """Takes orders for lanes, moves them, and ends the runs that are over; knows no clock."""

    def __init__(self, order: LanesOrder, shared: SharedLanes) -> None:
        self.lanes = Lanes(order.rigs, order.at, order.zero, order.law, TICKS)
        self._per = np.array(order.rigs[0].per_unit)
        self._target = float(np.asarray(order.law.target)[-1])
        self._travel, self._lean = np.array(order.travel), order.lean
        self._orders, self._answers, self._marks = shared.orders(), shared.answers(), shared.marks()
        self._counts, self._late = shared.counts(), shared.late()
        self._command, self._reference = shared.numbers("command"), shared.numbers("reference")
        self._period = order.rigs[0].period
        self._following: dict[int, Reference] = {}
        self._signals, self._playing = order.signals, dict[int, Array]()
        self._given = np.zeros(shared.lanes, dtype=np.int64)
        self._felt = self._orders["taps"].copy()
        self._due = np.zeros(shared.lanes, dtype=np.int64)

    def slice(self, late: int = 0, *, unheard: bool = False) -> None:
        """Obey, move on by `TICKS`, show it; end every run that nobody could stop any more."""
        head, answers = int(self._marks[HEAD]), self._answers
        self._begin(head, late)
        running = self.lanes.busy
        if unheard:
            for lane in np.flatnonzero(running).tolist():
                self._end(lane, head, UNHEARD)
        for lane in np.flatnonzero(running & (self._orders["stop"] >= answers["run"])).tolist():
            self._end(lane, head, BY_HAND)
        for lane in np.flatnonzero(running).tolist():
            self._heed(lane, head)
        stretch = self.lanes.go()
        rows = np.arange(head, head + TICKS) % ROWS
        self._counts[rows], self._command[rows] = stretch.counts, stretch.command
        self._reference[rows], self._late[rows] = self.lanes.followed.T, late
        self._judge(stretch, head)
        self._marks[HEAD] = head + TICKS

    def _begin(self, head: int, late: int) -> None:
        orders, answers = self._orders, self._answers
        for lane in np.flatnonzero(orders["run"] != answers["run"]).tolist():
            run = orders["run"][lane]
            self._felt[lane], self._given[lane] = orders["taps"][lane], orders["given"][lane]
            self._following.pop(lane, None)
            self._playing.pop(lane, None)
            answers["followed"][lane] = 0
            self._due[lane] = head + orders["ticks"][lane]
            answers["first"][lane], answers["last"][lane], answers["why"][lane] = head, head, RUNNING
            answers["late"][lane], answers["changed"][lane] = late, orders["change"][lane]
            answers["run"][lane] = run
            if signal := int(orders["signal"][lane]):
                self._playing[lane] = self._signals[signal - 1]
                self.lanes.play(lane)
                continue
            away = np.zeros(2 * len(self._per))
            away[-2] = orders["away"][lane]
            self.lanes.begin(lane, away.tolist())
            if begins := int(orders["begins"][lane]):
                self.lanes.gains(lane, orders["numbers"][lane][:begins].tolist())

    def _heed(self, lane: int, head: int) -> None:
        order, answer = self._orders[lane], self._answers[lane]
        if order["change"] != answer["changed"]:
            self.lanes.gains(lane, order["numbers"][: order["gains"]].tolist())
            answer["at"], answer["taken"] = head - answer["first"], time.monotonic_ns()
            answer["changed"] = order["change"]
        taps = order["taps"].copy()
        if (taps != self._felt[lane]).any():
            self.lanes.tap(lane, (taps - self._felt[lane]).tolist())
            self._felt[lane], answer["taken"] = taps, time.monotonic_ns()
        if lane in self._playing:
            first = int(head - answer["first"])
            played = self._playing[lane][first : first + TICKS]
            self.lanes.follow(lane, np.pad(played, (0, TICKS - len(played))))
            return
        wanted = order.copy()
        if wanted["given"] not in (0, self._given[lane]) and order["given"] == wanted["given"]:  # 0 while it is written
            self._following[lane] = Reference(
                shape=SHAPES[int(wanted["shape"])], size=float(wanted["size"]), period=float(wanted["period"])
            )
            answer["since"] = head - answer["first"]
            answer["followed"] = self._given[lane] = wanted["given"]
        if lane in self._following:
            first = int(head - answer["first"] - answer["since"])
            self.lanes.follow(lane, [self._following[lane].at(k, self._period) for k in range(first, first + TICKS)])

    def _judge(self, stretch: LaneTicks, head: int) -> None:
        readings: Array = stretch.counts / self._per
        leant = ~(np.abs(readings[..., -1] - self._target) <= self._lean)
        leant[:, list(self._playing)] = False  # they hang, or stand by themselves
        leant |= ~np.isfinite(stretch.command)
        beyond = ~(np.abs(readings) <= self._travel)
        over = leant | beyond.any(axis=2)
        for lane in np.flatnonzero(self.lanes.busy).tolist():
            k = int(np.argmax(over[:, lane])) if over[:, lane].any() else TICKS
            if head + k >= self._due[lane]:
                self._end(lane, int(self._due[lane]), ENDED)
            elif k < TICKS:
                self._end(lane, head + k, LEANT, readings[k, lane], beyond[k, lane])

    def _end(
        self, lane: int, tick: int, why: int, readings: Array | None = None, beyond: NDArray[np.bool_] | None = None
    ) -> None:
        answer = self._answers[lane]
        if readings is not None and beyond is not None:
            where = int(np.argmax(beyond)) if beyond.any() else len(readings) - 1
            answer["where"], answer["value"] = where, readings[where]
            why = TRAVELLED if beyond.any() else why
        answer["last"] = tick
        answer["why"] = why
        self.lanes.rest(lane)


def run_lanes(parent: int, order: LanesOrder, shared: SharedLanes) -> None:
    """Move the lanes until their server asks for the end, or is gone."""
    for each in ENDING:  # Ctrl-C is the parent's affair; nothing here can really move
        signal.signal(each, signal.SIG_DFL if each == signal.SIGTERM else signal.SIG_IGN)
    end_with_parent()
    orphan = dead_parent(parent)
    if orphan():
        return
    marks = shared.marks()
    attendant, looks = Attendant(order, shared), Looks(marks)
    unheard = deaf_parent(looks)
    attendant.slice()  # what is loaded at first use is loaded before it counts
    standing = step_forward(fifo=order.fifo)
    marks[PRIORITY] = 1 + (standing.priority == "FIFO")
    pace = WallClock(TICKS * order.rigs[0].period)
    while not orphan() and not marks[CLOSE]:
        pace.wait()
        marks[LATE], marks[PASSED] = TICKS * pace.late, TICKS * pace.passed
        attendant.slice(TICKS * pace.late, unheard=unheard())


class Looks:
    """How often the server has looked, as `deaf_parent` asks for it."""

    def __init__(self, marks: NDArray[np.int64]) -> None:
        self._marks = marks

    @property
    def value(self) -> int:
        """So many times."""
        return int(self._marks[LOOKS])
