"""Runs that a test performs by hand, in the place of a loop's process."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

from upright.browser.hanging import first_motions
from upright.browser.rig import known_rig
from upright.browser.runs import write_report
from upright.browser.serve import TWIN
from upright.browser.station import Station
from upright.realtime.process import run_in_process
from upright.realtime.session import RunEnd, RunState
from upright.rigs import Mode
from upright.running.run import prepared

RUNNING = RunState(phase="running", time=1.0, tick=1000, mode=Mode.HOST, counts=(3, -4))
SOON = 60.0
"""Time after which what does not happen is a fault of the test [s]."""


class ByHand:
    """Stands for `run_in_process`: goes on when it is let, and ends as it is asked to, or as it is stopped."""

    def __init__(self):
        self.orders, self.watched = [], ""
        self._begun, self._over, self._end = threading.Event(), threading.Event(), RunEnd()
        self.watch = self.desk = None

    def __call__(self, order, *, watch, desk):
        self.orders.append(order)
        self.watch, self.desk = watch, desk
        self._begun.set()
        assert self._over.wait(SOON)
        self._over.clear()
        self._begun.clear()
        return self._end

    def go(self, state=RUNNING):
        """The loop shows a state; the sentence with which its watcher wants it to end."""
        assert self._begun.wait(SOON)
        self.desk.put(state)
        return self.watch(state)

    def end(self, stopped=""):
        """The loop ends."""
        assert self._begun.wait(SOON)
        self._end = RunEnd(ticks=1000, late=7, stopped=stopped)
        self._over.set()


class Clock:
    """Time that passes when it is told to."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def twin(folder):
    """The Furuta twin with the law of the paper's first pole set."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "furuta.toml"
    path.write_text(TWIN, encoding="utf-8")
    return known_rig(path, None, folder)


def record_first_motions(rig, folder, started):
    """First motions of a twin in virtual time, kept as the bench keeps its runs; what they came to."""
    run = prepared(first_motions(rig), folder)
    end = run_in_process(run.order, paced=False)
    write_report(run, end, started)
    return run.ended(end)


def hardware(rig, basis=None):
    """The same, as if it could really move."""
    return replace(rig, file=replace(rig.file, performed=""), basis=basis or rig.basis)


def swung_up(rig, path):
    """Stands for the design of a swing-up: the law that holds, in its place."""
    path.write_bytes(rig.law_path.read_bytes())
    return json.dumps(rig.loop.K[0].tolist())


@contextmanager
def station(rig, folder, report=lambda run, end, started: "the verdict") -> Iterator[tuple[Station, ByHand, Clock]]:
    """A rig whose runs are performed by hand, with an operator."""
    carry, clock = ByHand(), Clock()
    made = Station(rig, folder, carry=carry, report=report, swing_up=swung_up, clock=clock)
    made.lease.take("operator")
    yield made, carry, clock
    if not made.over:
        carry.end()
    made.close()


def felt(desk, law):
    """What the loop takes at its next tick: taps, other gains, and the reference."""
    taps, changes = [], []
    beside = SimpleNamespace(
        law=law,
        change=lambda other: changes.append(other) or "",
        target=(0.0, math.pi),
        about=SimpleNamespace(period=1e-3),
    )
    reference = desk.heed(SimpleNamespace(tap=taps.append, units=("rad", "rad"), supervisor=beside))
    return taps, changes, reference


def settled(made, wanted):
    """Whether a condition of a station comes true; its run has a thread of its own."""
    pause = threading.Event()
    for _ in range(round(SOON / 0.005)):
        if wanted(made):
            return True
        pause.wait(0.005)
    return False
