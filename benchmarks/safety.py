"""What stops a rig when something breaks, how soon, and how far did it go by then? Every hazard, broken on purpose.

A Furuta pendulum (make furuta, numbers of another rig than the law's) stands in a loop at 1131 Hz and is stirred by a
tap; then something breaks. *Zero after* is the time from that until the converter's output is zero for good; *arm* is
how far the arm was from where it was held, at the farthest, until a second after that; *lean* how far the pendulum
leaned when the output went to zero, after which it falls freely. Both are true motions, not what encoders show. Zero
output does not brake: what turns fast when its limit is reached coasts on, so travel needs a limit on speed beside it.

Every rig that speaks the protocol can be put in a column: the twin is the first. This is supervision in software, not a
rated safety function, and a twin cannot show what a bench does: a rig needs a stop in hardware besides.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from benchmarks.measure import Line, Target, page
from upright.errors import RigStopped, UprightError
from upright.experiments.makes import make_rig
from upright.gains import feedback, filtered, hold, place
from upright.laws import Law, Rule, state_feedback
from upright.logs import LogHeader, LogWriter
from upright.rigs import Board, Fault, Limits, LiveRig, Mode, Tick, TwinPort
from upright.rigs.supervisor import Duty, Supervisor

KNOWN, TRUTH = make_rig("furuta"), make_rig("furuta", 3)
MODEL = KNOWN.linear("inverted")
SAMPLED = hold(MODEL, KNOWN.period, KNOWN.delay / KNOWN.period)
POLES = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
LAW = feedback(filtered(SAMPLED, 0.5), place(MODEL.A, MODEL.B, POLES).K)
T = KNOWN.period
LIMITS = Limits(travel=(2.0, math.inf), speed=(15.0, 30.0), start=(2.0, math.inf), command=5.0, watchdog=0.02)
DUTY = Duty(limits=LIMITS, model=KNOWN, at="inverted", zero="hanging", lean=math.radians(30), near=math.radians(10))
STIRRED = 0.3
"""When something breaks after the pendulum was let go, leaning [s]."""
STILL = 4.0
"""The same for a rig that stands still [s]."""
COAST = 1.0
TICKS = 2
"""What a limit on time may be overrun by: the tick that sees it and the one that acts [periods]."""


class HazardRig(Protocol):
    """What a column of the table has to bring: a rig, ways to break it, and what truly happens to it."""

    rig: LiveRig
    encoders: Any

    def lift(self, tilt: float) -> None: ...
    def let_go(self) -> None: ...
    def tap(self, speed: float) -> None: ...
    def silence(self, seconds: float) -> None: ...
    def history(self) -> np.ndarray: ...


class TracedPort(TwinPort):
    """A twin's board that notes what it truly puts out and does."""

    def __init__(self, rig: Any, at: str = "") -> None:
        super().__init__(rig, at)
        self.trace: list[tuple[float, ...]] = []

    def advance(self) -> float:
        t = super().advance()
        self.trace.append((t, float(self._commands[-1, 0]), *self.x[0::2].tolist()))
        return t


class TwinHazards:
    """The twin's column."""

    name = "twin"

    def __init__(self, truth: Any = TRUTH) -> None:
        self.port = TracedPort(truth)
        self.rig = Board(self.port)
        self.encoders = self.port.encoders

    def lift(self, tilt: float) -> None:
        self.port.hold("inverted", [0.0, 0.0, tilt, 0.0])

    def let_go(self) -> None:
        self.port.let_go()

    def tap(self, speed: float) -> None:
        self.port.push([0.0, speed])

    def silence(self, seconds: float) -> None:
        self.rig.alone(seconds)

    def history(self) -> np.ndarray:
        """Time, true output and true coordinates, tick by tick."""
        return np.array(self.port.trace)


class BadLink:
    """A link that loses what is sent: the command does not arrive, and the last sample comes again.

    With `lost` of 1 and a rig that goes on by itself it is a cut cable, and `exchange` gives up after `patience`.
    """

    def __init__(self, rig: LiveRig, silence: Callable[[float], None]) -> None:
        self._rig, self._silence = rig, silence
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
            self._silence(T)
            return self._last
        self._last = self._rig.exchange(command)
        return self._last

    def estop(self) -> None:
        if not self.cut:
            self._rig.estop()


@dataclass(frozen=True, kw_only=True)
class Happened:
    """What became of one hazard; angles in rad, `zero_after` in s, None where nothing had to be stopped."""

    stopped_by: str
    zero_after: float | None
    arm: float
    lean: float
    told: str


class Story:
    """A rig in a loop, and what is done to it."""

    def __init__(self, column: Callable[..., Any], duty: Duty = DUTY, *, link: bool = False, **more: Any) -> None:
        self.on: Any = column(**more)
        self.link = BadLink(self.on.rig, self.on.silence) if link else None
        rig: Any = self.link or self.on.rig
        self.beside = Supervisor(rig, duty)
        self.broke, self.start, self.told = math.inf, 0.0, ""
        self.tick: Any = None

    def begin(self, law: Law | Rule = LAW, tilt: float = 0.08, mode: Mode = Mode.HOST, check: bool = False) -> None:
        """Up to the first tick of the loop."""
        self.beside.prepare()
        if check:
            self.beside.check()
        self.on.lift(tilt)
        self.beside.aim(law)
        self.beside.start(mode)
        self.on.let_go()
        self.tick = self.beside.rig.exchange(0.0)

    def go(self, seconds: float, add: Callable[[float], float] = lambda u: u) -> None:
        """The loop for some time."""
        for _ in range(round(seconds / T)):
            self.tick = self.beside.rig.exchange(add(self.beside.step(self.tick)))
        self.beside.step(self.tick)

    def breaks(self) -> None:
        """Now."""
        self.broke = float(self.on.history()[-1, 0])

    def end(self) -> Happened:
        """What it came to, after the rig has coasted."""
        self.on.silence(COAST)
        h = self.on.history()
        t, u = h[:, 0], np.abs(h[:, 1])
        live = np.flatnonzero(u > 0)
        last = t[live[-1]] if live.size else -math.inf
        off = last + T if last > self.broke else self.broke
        seen = (t >= self.broke) & (t <= off + COAST)
        target = self.beside.target or (0.0, math.pi)
        arm = float(np.abs(h[seen, 2] - target[0]).max()) if seen.any() else 0.0
        k = int(np.searchsorted(t, off))
        lean = float(h[min(k, len(h) - 1), 3] - math.pi)
        lean = abs(lean - math.tau * round(lean / math.tau)) if self.beside.target else 0.0
        # what the host saw, and what the rig saw by itself
        faults = (self.beside.faults | self.on.rig.sample.faults) & ~Fault.STOP & ~Fault.RESET
        names = " | ".join(str(f.name) for f in Fault if f in faults) or "refused"
        return Happened(stopped_by=names, zero_after=max(0.0, off - self.broke) if math.isfinite(self.broke) else None,
                        arm=arm, lean=lean, told=self.told)  # fmt: skip


Telling = Callable[[Callable[..., Any]], Happened]


def in_loop(
    what: Callable[[Story], None], *, after: float = STIRRED, then: float = 4.0, tilt: float = 0.08,
    taps: float = 0.0, mode: Mode = Mode.HOST, link: bool = False,
) -> Telling:  # fmt: skip
    """Something breaks in a running loop; a tap follows where nothing would show otherwise."""

    def tell(column: Callable[..., Any]) -> Happened:
        story = Story(column, link=link)
        story.begin(tilt=tilt, mode=mode)
        story.go(after)
        story.breaks()
        what(story)
        try:
            if taps:
                story.go(0.2)
                story.on.tap(taps)
            story.go(then)
            story.told = "nothing: the loop stands"
        except RigStopped as stop:
            story.told = str(stop)
        done = story.end()
        return replace(done, stopped_by="none needed", zero_after=None) if "stands" in done.told else done

    return tell


def at_start(
    what: Callable[[Story], None] = lambda _: None, *, law: Law | Rule = LAW, check: bool = True, tilt: float = 0.03,
    duty: Duty = DUTY,
) -> Telling:  # fmt: skip
    """Something is wrong before anything runs."""

    def tell(column: Callable[..., Any]) -> Happened:
        story = Story(column, duty)
        what(story)
        try:
            story.begin(law, tilt, check=check)
            story.breaks()
            story.go(4.0)
            story.told = "nothing: the loop stands"
        except UprightError as stop:
            story.told = str(stop)
        done = story.end()
        return replace(done, arm=0.0, lean=0.0) if math.isinf(story.broke) else done

    return tell


def _wraps(story: Story) -> None:
    """The pendulum, half a turn from where it was zeroed, is pushed over the end of its counter."""
    story.on.encoders.wrapped(1, 14)
    story.on.tap(5.0)


def silent(seconds: float) -> Telling:
    """The host says nothing for some time."""

    def tell(column: Callable[..., Any]) -> Happened:
        story = Story(column)
        story.begin()
        story.go(STIRRED)
        story.breaks()
        story.on.silence(seconds)
        try:
            story.tick = story.beside.rig.exchange(0.0) if seconds > LIMITS.watchdog else story.tick
            story.go(3.0)
            story.told = "nothing: the loop stands"
        except RigStopped as stop:
            story.told = str(stop)
        done = story.end()
        return replace(done, stopped_by="none needed", zero_after=None) if "stands" in done.told else done

    return tell


def pushed(law: Law | Rule, held: bool = False, limits: Limits = LIMITS, truth: Any = None) -> Telling:
    """A law drives the hanging rig, or one that somebody holds, into a limit.

    The time counts from the first true sample beyond it; for the command's limit, from the first sample there.
    """

    def tell(column: Callable[..., Any]) -> Happened:
        known = truth or KNOWN
        duty = Duty(limits=limits, model=None, zero="")
        story = Story(column, duty, truth=truth or TRUTH)
        story.beside.prepare()
        story.beside.aim(law)
        story.beside.start()
        if held:
            story.on.port.hold(next(iter(known.plant.equilibria)))
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
        return replace(done, lean=float(np.abs(h[:, 2] - h[:, 3]).max()) if truth else 0.0)

    return tell


def turning_to(value: float) -> Rule:
    """A rule that gives nothing for 50 ms, then one value, which may be none."""

    def turning(t: Any, y: Any, r: Any, z: Any, p: Any) -> Any:
        return (0.0 if t < p[1] else p[0],), ()

    return Rule(function=turning, initial=[], parameters=[value, 0.05])


def _full_disk(column: Callable[..., Any]) -> Happened:
    """The log's process meets a full disk; the loop goes on, and the end of the run says what is missing."""
    from resource import RLIMIT_FSIZE, prlimit

    story = Story(column)
    story.begin()
    header = LogHeader(rig="", law={}, coordinates=(("psi", "rad"), ("theta", "rad")), command_unit="V", period=T)
    with tempfile.TemporaryDirectory() as name:
        log = LogWriter(Path(name) / "run.mcap", header=header)
        prlimit(log.pid, RLIMIT_FSIZE, (40_000, 40_000))
        for _ in range(round(3.0 / T)):
            command, tick = story.beside.step(story.tick), story.tick
            story.tick = story.beside.rig.exchange(command)
            readings = story.beside.readings(tick)
            log.row((tick.time, tick.tick, *tick.counts, *readings, command, story.tick.applied, int(tick.mode), 0))
        status = log.close()
    if not status.dropped:
        raise RuntimeError("the disk was not full")
    return Happened(
        stopped_by="none needed", zero_after=None, arm=0.0, lean=0.0,
        told=f"the loop stands; {status.message} ({status.dropped} rows dropped)",
    )  # fmt: skip


def _power_loss(column: Callable[..., Any]) -> Happened:
    """The file of a log ends anywhere; what is read is compared with what was written, row by row."""
    from upright.experiments.running.run import RunRequest, run_rig
    from upright.logs import read_log

    rng, left = np.random.default_rng(11), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
        done = run_rig(RunRequest(rig=folder / "RIG.toml", excite="sine 0.3 1.2", seconds=2.0, check=False), folder)
        whole, data = done.log, done.log_path.read_bytes()
        assert whole is not None
        for _ in range(20):
            torn = folder / "torn.mcap"
            torn.write_bytes(data[: int(rng.integers(len(data) // 4, len(data)))])
            found = read_log(torn)
            for column_name, values in found.columns.items():
                if not np.array_equal(values, whole.columns[column_name][: len(found)]):
                    raise RuntimeError(f"a torn log gave a wrong row in {column_name}")
            left.append(len(found) / len(whole))
    return Happened(
        stopped_by="none needed", zero_after=None, arm=0.0, lean=0.0,
        told=f"20 of 20 torn files read, no wrong row; said to be torn, mended by `upright log recover` "
        f"({100 * min(left):.0f} to {100 * max(left):.0f} % of the rows)",
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Hazard:
    """One row: what breaks, which interlock is to stop it, and, where one is set, within which time [s]."""

    what: str
    by: Fault
    tell: Telling
    within: float = math.inf
    stands: bool = False


WIDE = replace(LIMITS, travel=(math.inf, math.inf), speed=(math.inf, math.inf), saturation=1.0)
SHAFT = make_rig("torsional", 2)
SHAFT_LIMITS = Limits(
    travel=(math.inf,) * 2, speed=(math.inf,) * 2, start=(math.inf,) * 2, command=10.0, twist=math.radians(20),
)  # fmt: skip
F = Fault
HAZARDS = (
    *(Hazard(what=f"nothing broken, a tap of {speed:g} rad/s", by=F(0), stands=True,
             tell=in_loop(lambda s: None, after=1.0, taps=speed)) for speed in (0.5, 1.0, 2.0)),
    Hazard(what="pendulum's encoder dead, moving", by=F.MODEL, tell=in_loop(lambda s: s.on.encoders.dead(1))),
    Hazard(what="pendulum's encoder dead, at rest, then a tap of 1 rad/s", by=F.MODEL | F.OVERTRAVEL,
           tell=in_loop(lambda s: s.on.encoders.dead(1), after=STILL, tilt=0.0, taps=1.0)),
    Hazard(what="arm's encoder dead, moving", by=F.ENCODER | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.dead(0))),
    Hazard(what="arm's encoder dead, at rest, then a tap of 1 rad/s", by=F.ENCODER | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.dead(0), after=STILL, tilt=0.0, taps=1.0)),
    Hazard(what="arm's encoder dead before the start", by=F.SELF_TEST,
           tell=at_start(lambda s: s.on.encoders.dead(0))),
    Hazard(what="pendulum's encoder dead before the start", by=F.SELF_TEST,
           tell=at_start(lambda s: s.on.encoders.dead(1))),
    Hazard(what="pendulum's sign flips, moving", by=F.MODEL | F.OVERTRAVEL,
           tell=in_loop(lambda s: s.on.encoders.scaled(1, -1.0))),
    Hazard(what="arm's sign flips, moving", by=F.MODEL | F.OVERTRAVEL,
           tell=in_loop(lambda s: s.on.encoders.scaled(0, -1.0))),
    Hazard(what="pendulum's sign wrong from the start", by=F.SELF_TEST,
           tell=at_start(lambda s: s.on.encoders.scaled(1, -1.0))),
    Hazard(what="pendulum's sign wrong, the pulse left out", by=F.MODEL | F.OVERTRAVEL,
           tell=at_start(lambda s: s.on.encoders.scaled(1, -1.0), check=False)),
    *(Hazard(what=f"{body}'s scale wrong by {factor:g}", by=F.SELF_TEST,
             tell=at_start(lambda s, i=i, factor=factor: s.on.encoders.scaled(i, factor)))
      for i, body in enumerate(("arm", "pendulum")) for factor in (2.0, 4.0)),
    *(Hazard(what=f"pendulum's scale wrong by {factor:g}, the pulse left out", by=F.START,
             tell=at_start(lambda s, factor=factor: s.on.encoders.scaled(1, factor), check=False))
      for factor in (2.0, 4.0)),
    *(Hazard(what=f"arm's scale wrong by {factor:g}, the pulse left out", by=F.MODEL | F.OVERTRAVEL | F.OVERSPEED,
             tell=at_start(lambda s, factor=factor: s.on.encoders.scaled(0, factor), check=False, tilt=0.1))
      for factor in (2.0, 4.0)),
    Hazard(what="pendulum's counter wraps at 2^13", by=F.OVERSPEED | F.OVERTRAVEL | F.MODEL,
           tell=in_loop(_wraps)),
    Hazard(what="pendulum loses 200 counts at once (4.5 degrees)", by=F.OVERSPEED | F.MODEL,
           tell=in_loop(lambda s: s.on.encoders.lost(1, 200))),
    Hazard(what="pendulum loses 20 counts at once", by=F.MODEL, stands=True,
           tell=in_loop(lambda s: s.on.encoders.lost(1, 20))),
    Hazard(what="stale: the same sample for ever", by=F.STALE, within=LIMITS.watchdog + TICKS * T,
           tell=in_loop(lambda s: setattr(s.link, "lost", 1.0), link=True)),
    Hazard(what="loop late by 15 ms, once", by=F(0), stands=True, tell=silent(0.015)),
    Hazard(what="loop late by 50 ms", by=F.WATCHDOG, within=LIMITS.watchdog + TICKS * T, tell=silent(0.05)),
    Hazard(what="host killed (-9)", by=F.WATCHDOG, within=LIMITS.watchdog + TICKS * T, tell=silent(1.0)),
    Hazard(what="link cut", by=F.WATCHDOG, within=LIMITS.watchdog + TICKS * T,
           tell=in_loop(lambda s: setattr(s.link, "cut", True), link=True)),
    Hazard(what="1 % of the frames corrupted", by=F(0), stands=True,
           tell=in_loop(lambda s: setattr(s.link, "lost", 0.01), link=True)),
    Hazard(what="30 % of the frames corrupted", by=F.MODEL | F.STALE | F.WATCHDOG, stands=True,
           tell=in_loop(lambda s: setattr(s.link, "lost", 0.3), link=True)),
    Hazard(what="command NaN", by=F.GAINS, within=TICKS * T,
           tell=at_start(law=turning_to(math.nan), check=False, tilt=0.0)),
    Hazard(what="command infinite", by=F.GAINS, within=TICKS * T,
           tell=at_start(law=turning_to(math.inf), check=False, tilt=0.0)),
    Hazard(what="absurd gains (a million times)", by=F.GAINS, tell=at_start(law=replace(LAW, D=1e6 * LAW.D))),
    Hazard(what="destabilizing gains (sign)", by=F.GAINS, tell=at_start(law=replace(LAW, C=-LAW.C, D=-LAW.D))),
    Hazard(what="destabilizing gains, no model to ask", by=F.OVERTRAVEL | F.OVERSPEED | F.SATURATION,
           tell=pushed(state_feedback([-8.0, -0.5, 0.0, 0.0], T, target=[0.05, 0.0]))),
    Hazard(what="command at its limit for longer than 1 s, the rig held fast", by=F.SATURATION, within=1.0 + TICKS * T,
           tell=pushed(turning_to(5.0), held=True, limits=WIDE)),
    Hazard(what="over-travel", by=F.OVERTRAVEL, within=TICKS * T,
           tell=pushed(turning_to(0.4), limits=replace(LIMITS, speed=(math.inf,) * 2))),
    Hazard(what="over-speed", by=F.OVERSPEED, within=3 * T,
           tell=pushed(turning_to(5.0), limits=replace(LIMITS, travel=(math.inf,) * 2, speed=(10.0, math.inf)))),
    Hazard(what="shaft twisted beyond 20 degrees", by=F.TWIST, within=TICKS * T,
           tell=pushed(turning_to(4.0), limits=SHAFT_LIMITS, truth=SHAFT)),
    Hazard(what="start 11.5 degrees off upright", by=F.START, tell=at_start(tilt=0.2)),
    Hazard(what="disk full while logging", by=F(0), stands=True, tell=_full_disk),
    Hazard(what="power lost in the middle of a log", by=F(0), stands=True, tell=_power_loss),
)  # fmt: skip
COLUMNS: tuple[Any, ...] = (TwinHazards,)
"""One class for each rig that is broken; emulated firmware joins here."""


def judged(hazard: Hazard, found: Happened) -> Line:
    """A row as a line of the benchmark: reached when a right interlock stopped it, in its time."""
    stopped = found.zero_after is not None or found.stopped_by != "none needed"
    right = hazard.stands and not stopped
    right = right or any(f.name in found.stopped_by.split(" | ") for f in Fault if f in hazard.by)
    after = 0.0 if found.zero_after is None else float(found.zero_after)  # numpy.False_ is not False
    within = hazard.within if right else -1.0
    return Line(
        contender=hazard.what,
        seconds=(after, after, after),
        target=Target(most=within, of="seconds"),
        note=f"{found.stopped_by}; arm {math.degrees(found.arm):.1f} deg; {found.told}",
    )


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """Break everything in turn, on every column."""
    lines: list[Line] = []
    rows: list[str] = []
    for column in COLUMNS:
        for hazard in HAZARDS:
            progress(f"{column.name}: {hazard.what}")
            found = hazard.tell(column)
            lines.append(judged(hazard, found))
            rows.append(written(hazard, found, lines[-1].reached is not False))
    if markdown:
        head = [
            "",
            "| hazard | stopped by | zero after | arm | lean | what the user is told |",
            "|---|---|--:|--:|--:|---|",
        ]
        missed = [line.contender for line in lines if line.reached is False]
        last = ["", f"Not as it should be: {', '.join(missed) if missed else 'nothing'}."]
        markdown.write_text(page("safety", "Safety", __doc__, [*head, *rows, *last]), encoding="utf-8")
    return lines


def written(hazard: Hazard, found: Happened, right: bool) -> str:
    """A row of the page."""
    after = "–" if found.zero_after is None else f"{1e3 * found.zero_after:.0f} ms"
    if "refused" in found.told or "START" in found.stopped_by or "SELF_TEST" in found.stopped_by:
        after = "never on" if not found.arm else after
    arm = f"{math.degrees(found.arm):.1f}°" if found.arm else "–"
    lean = f"{math.degrees(found.lean):.1f}°" if found.lean else "–"
    by = found.stopped_by.replace(" | ", ", ") + ("" if right else " **(not as it should be)**")
    return f"| {hazard.what} | {by} | {after} | {arm} | {lean} | {found.told} |"
