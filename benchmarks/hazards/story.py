"""A rig in a loop, what is done to it, and what became of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from upright.errors import RigStopped, UprightError
from upright.gains import feedback, filtered, place
from upright.laws import Law, Rule, state_feedback
from upright.rig import Rig
from upright.rigs import Fault, Limits, LiveRig, Mode, Tick
from upright.rigs.supervisor import Duty, Supervisor

POLES = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
LIMITS = Limits(travel=(2.0, math.inf), speed=(15.0, 30.0), start=(2.0, math.inf), command=5.0, watchdog=0.02)
STIRRED = 0.3
"""When something breaks after the pendulum was let go, leaning [s]."""
STILL = 4.0
"""The same for a rig that stands still [s]."""
COAST = 1.0
SAFE = "nothing: the loop stands"


class HazardRig(Protocol):
    """What a column of the table has to bring: a rig, ways to break it, and what truly happens to it."""

    rig: LiveRig
    encoders: Any

    def lift(self, tilt: float, arm: float = 0.0) -> None:
        """A hand holds it upright, leaning [rad]."""
        ...

    def hold_fast(self) -> None:
        """A hand holds it where it hangs."""
        ...

    def let_go(self) -> None:
        """The hand is taken away."""
        ...

    def tap(self, speed: float) -> None:
        """Add to the pendulum's speed [rad/s]."""
        ...

    def silence(self, seconds: float) -> None:
        """Time passes while the host says nothing."""
        ...

    def faults(self) -> Fault:
        """What the rig has seen by itself."""
        ...

    def history(self) -> np.ndarray:
        """Time, output in the period before it and true coordinates, tick by tick."""
        ...

    def close(self) -> None:
        """The end."""
        ...


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """One of the rigs that are broken.

    `make` starts it, `known` is the rig that law and supervisor believe in, `loop` who moves it, and `unable` says why
    it cannot run here; empty when it can.
    """

    name: str
    known: Rig
    make: Callable[..., HazardRig]
    loop: Mode = Mode.HOST
    unable: Callable[[], str] = lambda: ""

    @property
    def period(self) -> float:
        """Of the tick [s]."""
        return self.known.period

    @cached_property
    def law(self) -> Law:
        """Holds it upright."""
        model = self.known.linear("inverted")
        sampled = model.to_sampled(self.period, self.known.delay / self.period)
        law = feedback(filtered(sampled, 0.5), place(model.A, model.B, POLES).K)
        return replace(law, period=self.period)

    @property
    def duty(self) -> Duty:
        """What the supervisor looks after."""
        return Duty(limits=LIMITS, model=self.known, at="inverted", zero="hanging", lean=math.radians(30),
                    near=math.radians(10))  # fmt: skip


class BadLink:
    """A link that loses what is sent: the command does not arrive, and the last sample comes again.

    With `lost` of 1 and a rig that goes on by itself it is a cut cable, and `exchange` gives up after `patience`.
    """

    def __init__(self, rig: LiveRig, silence: Callable[[float], None], period: float) -> None:
        self._rig, self._silence, self._period = rig, silence, period
        self.lost, self.cut = 0.0, False
        self._rng = np.random.default_rng(5)
        self._last: Tick | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)

    def exchange(self, command: float) -> Tick:
        if self.cut:
            self._silence(0.05)
            raise RigStopped("The link to the rig does not answer.")
        if self._last is not None and self._rng.random() < self.lost:
            self._silence(self._period)
            return self._last
        self._last = self._rig.exchange(command)
        return self._last

    def estop(self) -> None:
        if not self.cut:
            self._rig.estop()


@dataclass(frozen=True, kw_only=True)
class Happened:
    """What became of one hazard; angles in rad, `zero_after` in s, None where nothing had to be stopped.

    `overran` says that the arm was truly beyond its travel, before the output was zero or while it coasted.
    """

    stopped_by: str
    zero_after: float | None
    arm: float
    lean: float
    told: str
    overran: bool = False

    @property
    def stood(self) -> Happened:
        """The same of a loop that went on."""
        return replace(self, stopped_by="none needed", zero_after=None)


Telling = Callable[[Column], Happened]
Aiming = Callable[[Column], Law | Rule]


class Story:
    """A rig in a loop, and what is done to it."""

    def __init__(self, column: Column, duty: Duty | None = None, *, link: bool = False, **more: Any) -> None:
        self.column = column
        self.on: Any = column.make(**more)
        self.link = BadLink(self.on.rig, self.on.silence, column.period) if link else None
        rig: Any = self.link or self.on.rig
        self.beside = Supervisor(rig, duty or column.duty)
        self.broke, self.told = math.inf, ""
        self.tick: Any = None

    def begin(self, law: Law | Rule | None = None, tilt: float = 0.08, arm: float = 0.0, check: bool = False) -> None:
        """Up to the first tick of the loop."""
        self.beside.prepare()
        if check:
            self.beside.check()
        self.on.lift(tilt, arm)
        self.beside.aim(law or self.column.law)
        self.beside.start(self.column.loop)
        self.on.let_go()
        self.tick = self.beside.rig.exchange(0.0)

    def go(self, seconds: float) -> None:
        """The loop for some time."""
        for _ in range(round(seconds / self.column.period)):
            self.tick = self.beside.rig.exchange(self.beside.step(self.tick))
        self.beside.step(self.tick)

    def breaks(self) -> None:
        """Now."""
        self.broke = float(self.on.history()[-1, 0])

    def end(self) -> Happened:
        """What it came to, after the rig has coasted."""
        self.on.silence(COAST)
        seen = self.beside.faults | self.on.faults()
        out = reckoned(self, seen & ~Fault.STOP & ~(Fault.RESET if self.tick is None else Fault(0)))
        self.on.close()
        return out.stood if out.told.startswith(SAFE) else out


def reckoned(story: Story, faults: Fault) -> Happened:
    """From the true motion, when something broke, and what the host and the rig saw."""
    h, broke = story.on.history(), story.broke
    t, u = h[:, 0], np.abs(h[:, 1])
    live = np.flatnonzero(u > 0)
    last = t[live[-1]] if live.size else -math.inf
    off = max(last, broke)
    seen = (t >= broke) & (t <= off + COAST)
    target = story.beside.target
    arm = float(np.abs(h[seen, 2] - (target[0] if target else 0.0)).max()) if seen.any() else 0.0
    k = int(np.searchsorted(t, off))
    lean = float(h[min(k, len(h) - 1), 3] - math.pi)
    lean = abs(lean - math.tau * round(lean / math.tau)) if target else 0.0
    overran = bool((np.abs(h[seen, 2]) > LIMITS.travel[0]).any())
    return Happened(
        overran=overran, stopped_by=" | ".join(str(f.name) for f in Fault if f in faults) or "refused",
        zero_after=float(max(0.0, off - broke)) if math.isfinite(broke) else None, arm=arm, lean=lean, told=story.told,
    )  # fmt: skip


def in_loop(
    what: Callable[[Any], Any], *, after: float = STIRRED, then: float = 4.0, tilt: float = 0.08, taps: float = 0.0,
    link: bool = False, first: Callable[[Any], Any] = lambda _: None, note: Callable[[Any], str] = lambda _: "",
) -> Telling:  # fmt: skip
    """Something breaks in a running loop; a tap follows where nothing would show otherwise."""

    def tell(column: Column) -> Happened:
        story = Story(column, link=link)
        first(story)
        story.begin(tilt=tilt)
        story.go(after)
        story.breaks()
        try:
            what(story)
            if taps:
                story.go(0.2)
                story.on.tap(taps)
            story.go(then)
            story.told = SAFE + note(story)
        except RigStopped as stop:
            story.told = str(stop)
        return story.end()

    return tell


def at_start(
    what: Callable[[Any], Any] = lambda _: None, *, law: Aiming | None = None, check: bool = True,
    tilt: float = 0.03, arm: float = 0.0,
) -> Telling:  # fmt: skip
    """Something is wrong before anything runs."""

    def tell(column: Column) -> Happened:
        story = Story(column)
        what(story)
        try:
            story.begin(law(column) if law else None, tilt, arm, check)
            story.breaks()
            story.go(4.0)
            story.told = SAFE
        except UprightError as stop:
            story.told = str(stop)
        done = story.end()
        return replace(done, arm=0.0, lean=0.0) if math.isinf(story.broke) else done

    return tell


def silent(seconds: float) -> Telling:
    """The host says nothing for some time."""

    def quiet(story: Story) -> None:
        story.on.silence(seconds)
        if seconds > LIMITS.watchdog:
            story.tick = story.beside.rig.exchange(0.0)

    return in_loop(quiet, then=3.0)


def pushed(aim: Aiming, *, held: bool = False, limits: Limits = LIMITS, apart: bool = False, **more: Any) -> Telling:
    """A law drives the hanging rig, or one that somebody holds, into a limit; nobody has a model to ask.

    The time counts from the first true sample beyond it; for the command's limit, from the first sample there. With
    `apart` the farthest that the two coordinates were from one another takes the place of the lean.
    """

    def tell(column: Column) -> Happened:
        story = Story(column, Duty(limits=limits, model=None, zero=""), **more)
        story.beside.prepare()
        story.beside.aim(aim(column))
        story.beside.start(column.loop)
        if held:
            story.on.hold_fast()
        story.tick = story.beside.rig.exchange(0.0)
        try:
            story.go(6.0)
            story.told = "nothing"
        except RigStopped as stop:
            story.told = str(stop)
        h = story.on.history()
        speed = np.abs(np.gradient(h[:, 2], h[:, 0]))
        beyond = (np.abs(h[:, 2]) > limits.travel[0]) | (speed > limits.speed[0])
        beyond |= np.abs(h[:, 2] - h[:, 3]) > limits.twist
        if held:
            beyond = np.abs(h[:, 1]) >= limits.command
        story.broke = float(h[np.argmax(beyond), 0])
        done = story.end()
        return replace(done, overran=False, lean=float(np.abs(h[:, 2] - h[:, 3]).max()) if apart else 0.0)

    return tell


def turning_to(value: float) -> Aiming:
    """A rule that gives nothing for 50 ms, then one value, which may be none."""

    def turning(t: Any, y: Any, r: Any, z: Any, p: Any) -> Any:
        return (0.0 if t < p[1] else p[0],), ()

    return lambda _: Rule(function=turning, initial=[], parameters=[value, 0.05])


def rising_to(value: float, within: float = 0.01) -> Aiming:
    """A law that any loop can hold and that asks its encoders nothing: an exponential rise to a value."""

    def rising(column: Column) -> Law:
        a = math.exp(-column.period / within)
        return Law(np.array([[a, 1 - a], [0.0, 1.0]]), np.zeros((2, 2)), np.array([[1.0, 0.0]]), np.zeros((1, 2)),
                   initial=[0.0, value], period=column.period)  # fmt: skip

    return rising


def runaway(column: Column) -> Law:
    """A law that drives the arm away from where it is."""
    return state_feedback([-8.0, -0.5, 0.0, 0.0], column.period, target=[0.05, 0.0])
