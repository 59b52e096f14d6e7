"""One run of a law on a rig, from opening it to letting go; the same in virtual time and in a process of its own."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from upright.errors import RigStopped, UprightError
from upright.laws import Law, Rule, as_values
from upright.logs import LogHeader, LogWriter
from upright.realtime.interrupts import ENDING, ignoring
from upright.realtime.pace import Pace, Virtual
from upright.rigs.board import SENTENCES, fault_text
from upright.rigs.protocol import NO_FAULT, Capabilities, Fault, Limits, Mode, Tick
from upright.rigs.supervisor import BRAKING, Supervisor

PATIENCE = 120.0
"""How long a person may take to bring the rig where it is to be held [s]."""
QUIET = 0.3
"""How long it must be there before the loop starts [s]."""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """A rig with its supervisor, and the hands that bring it where a run starts and let it go.

    `bring`, `let_go` and `tap`, which adds to the speeds of the coordinates, act on a twin; with a rig of its own a
    person does it, and they do nothing.
    """

    supervisor: Supervisor
    bring: Callable[[], None]
    let_go: Callable[[], None]
    units: tuple[str, ...]
    advice: str = ""
    tap: Callable[[Sequence[float]], None] = lambda _: None


@dataclass(frozen=True, kw_only=True)
class RunOrder:
    """What is to be run; it can be sent to another process.

    Attributes
    ----------
    make : callable
        Makes the stage, where the run will be.
    law : dict of str to any
        As `upright.laws.as_values` gives it.
    check : bool
        Whether a pulse is given first.
    zero : bool
        Whether the rig is awaited to rest and zeroed first, instead of going on from where it was zeroed before.
    rig_text : str
        Of the rig's file, for the log.
    references : tuple of (str, str)
        Name and unit of each reference that the law follows, for the log; none where there is nothing to log.
    fifo : bool
        Whether a process of its own asks for FIFO priority.
    accepted : str
        Why somebody runs a law whose model is not trusted, for the log.
    wall : bool
        Whether a twin's ticks wait for the clock on the wall too, for somebody who looks on.
    """

    make: Callable[[], Stage]
    law: dict[str, Any]
    seconds: float
    log: Path
    mode: Mode = Mode.HOST
    check: bool = True
    zero: bool = True
    rig_text: str = ""
    references: tuple[tuple[str, str], ...] = ()
    fifo: bool = True
    accepted: str = ""
    wall: bool = False


@dataclass(frozen=True, kw_only=True)
class RunScene:
    """What stays the same while a run goes on: name and unit of each reading, the command's unit and limit, length [s].

    A limit or length that is not known is infinite.
    """

    readings: tuple[tuple[str, str], ...] = ()
    command_unit: str = ""
    limit: float = math.inf
    seconds: float = math.inf


@dataclass(frozen=True, kw_only=True)
class RunState:
    """How a run goes; time and ticks since its loop began, ``readings`` as deviations from what is held.

    ``counts`` are those of the encoders, as if each counted upwards; none before the loop begins.
    """

    phase: str
    time: float = 0.0
    tick: int = 0
    late: int = 0
    mode: Mode = Mode.IDLE
    faults: Fault = NO_FAULT
    command: float = 0.0
    applied: float = 0.0
    readings: tuple[float, ...] = ()
    counts: tuple[int, ...] = ()
    scene: RunScene = RunScene()


@dataclass(frozen=True, kw_only=True)
class RunEnd:
    """How a run ended.

    Attributes
    ----------
    ticks : int
        Of the loop.
    late, passed : int
        Ticks that were late, and those of them that were passed over, which the loop never had.
    stopped : str
        Why it ended early, as a sentence; empty when it ran to its end.
    about : Capabilities or None
        Capabilities that the rig reports; None when it did not answer.
    held : Limits or None
        As read back.
    target : tuple of float
        What was held, as the encoders show it.
    rows, dropped : int
        Of the log.
    log_message : str
        What is wrong with the log, as a sentence.
    warning : str
        About the priority that the loop got.
    seconds : float
        Clock time of the loop.
    """

    ticks: int = 0
    late: int = 0
    passed: int = 0
    stopped: str = ""
    faults: Fault = NO_FAULT
    about: Capabilities | None = None
    held: Limits | None = None
    target: tuple[float, ...] = ()
    rows: int = 0
    dropped: int = 0
    log_message: str = ""
    events: tuple[tuple[float, str, str], ...] = ()
    warning: str = ""
    seconds: float = 0.0

    @property
    def due(self) -> int:
        """Ticks that were due, of which some were late."""
        return self.ticks + self.passed


@dataclass(eq=False)
class _Events:
    """Events of a run, to the log as soon as there is one."""

    events: list[tuple[float, str, str]] = field(default_factory=list[tuple[float, str, str]])
    log: LogWriter | None = None

    def __call__(self, t: float, kind: str, text: str) -> None:
        self.events.append((t, kind, text))
        if self.log is not None:
            self.log.event(t, kind, text)


def carry_out(
    order: RunOrder,
    *,
    law: Law | Rule,
    show: Callable[[RunState], None] = lambda _: None,
    stopped: Callable[[], str] = lambda: "",
    pace: Callable[[Capabilities], tuple[Pace, str]] = lambda _: (Virtual(), ""),
    heed: Callable[[Stage], float | None] = lambda _: None,
) -> RunEnd:
    """Run a law on a rig, whatever happens with zero at the end.

    Parameters
    ----------
    show : callable
        Called with the state at every tick; has to be quick.
    stopped : callable
        Called at every tick: why to end: a sentence, or an empty one.
    pace : callable
        Gives the clock of the loop for a rig, and a warning about it; called when all is ready.
    heed : callable
        Called before each answer, to change what runs; gives the law's reference, or None for its own.
    """
    hear = _Events()
    stage = order.make()
    beside = stage.supervisor
    beside.event, beside.stopped = hear, stopped
    end: dict[str, Any] = {"ticks": 0, "late": 0}
    finished = False
    if order.accepted:
        hear(0.0, "accepted", f"The law's model is not trusted, and it runs all the same: {order.accepted}")
    try:
        about = beside.prepare(zero=order.zero)
        end |= {"about": about, "held": beside.held}
        if order.check and not about.replayed:
            show(RunState(phase="testing: a small pulse"))
            beside.check()
        _bring(stage, law, show, stopped)
        fitted = beside.aim(law)
        end["target"] = beside.target
        # in virtual time the loop may be ahead of the log by all of the run
        waiting = min(round(order.seconds / about.period) + 100, 1 << 20) if about.virtual and not order.wall else 0
        hear.log = LogWriter(
            order.log,
            header=log_header(order, beside.about, stage.units, fitted, clock.time()),
            rows=max(8192, waiting),
        )
        for event in hear.events:
            hear.log.event(*event)
        ticking, warning = pace(about)
        end["warning"] = warning
        if about.paced and not about.virtual:
            beside.clock = clock.monotonic
        beside.braked = partial(_braked, hear.log, beside, order)
        beside.start(order.mode)
        stage.let_go()
        _loop(order, beside, ticking, hear.log, show, partial(heed, stage), end)
        beside.finish()
        finished = True
    except RigStopped as stop:
        end["stopped"] = str(stop)
    except KeyboardInterrupt:
        with ignoring(ENDING):
            end["stopped"] = "Stopped by Ctrl-C or a signal."
            with suppress(RigStopped):
                beside.give_up(Fault.STOP, end["stopped"])
    finally:
        with ignoring(ENDING):
            if not finished:
                beside.rig.estop()
            beside.rig.close()
            if hear.log is not None:
                status = hear.log.close()
                end |= {"rows": status.rows, "dropped": status.dropped, "log_message": status.message}
    return RunEnd(faults=beside.faults, events=tuple(hear.events), **end)


def _loop(
    order: RunOrder, beside: Supervisor, pace: Pace, log: LogWriter, show: Callable[[RunState], None],
    heed: Callable[[], float | None], end: dict[str, Any],
) -> None:  # fmt: skip
    """The only loop: answer a sample, wait for the deadline, hand over the answer and take the next sample."""
    about, began = beside.about, clock.monotonic()
    first = tick = _exchanged(beside, 0.0)
    try:
        for _ in range(max(1, math.ceil(order.seconds / about.period - 1e-9))):
            command = beside.step(tick, heed())
            pace.wait()
            following = _exchanged(beside, command)
            if not beside.stale:
                _row(log, beside, tick, following, command, beside.references if order.references else ())
            if about.paced:
                lost = max(0, following.tick - tick.tick - 1)
                pace.late, pace.passed = pace.late + lost, pace.passed + lost
            end |= {"ticks": end["ticks"] + 1, "late": pace.late, "passed": pace.passed}
            show(_state(beside, following, command, first, end))
            tick = following
        beside.step(tick)  # a fault of the last sample is one too
    finally:
        end["seconds"] = clock.monotonic() - began


def _exchanged(beside: Supervisor, command: float) -> Tick:
    """The next sample; a rig that does not answer any more is a fault of its link."""
    try:
        return beside.rig.exchange(command)
    except RigStopped as silent:
        beside.faults |= Fault.LINK  # whether or not it hears that it is to stop
        beside.give_up(Fault.LINK, str(silent))
        raise


def _row(
    log: LogWriter, beside: Supervisor, tick: Tick, following: Tick, command: float, references: tuple[float, ...],
    mode: int | None = None,
) -> None:  # fmt: skip
    """Sample, what was followed, the answer, and what of that the converter put out."""
    log.row(
        (tick.time, tick.tick, *tick.counts, *beside.readings(tick), *references, command, following.applied,
         int(tick.mode) if mode is None else mode, int(tick.faults))
    )  # fmt: skip


def _braked(log: LogWriter, beside: Supervisor, order: RunOrder, tick: Tick, following: Tick, command: float) -> None:
    """The same while the run is braked."""
    _row(log, beside, tick, following, command, beside.references if order.references else (), BRAKING)


def _state(beside: Supervisor, tick: Tick, command: float, first: Tick, end: Mapping[str, Any]) -> RunState:
    away = tuple(q - t for q, t in zip(beside.readings(tick), beside.target, strict=True))
    return RunState(
        phase="running", time=tick.time - first.time, tick=end["ticks"], late=end["late"], mode=tick.mode,
        faults=tick.faults,
        command=command, applied=tick.applied, readings=away,
        counts=tuple(n if per > 0 else -n for n, per in zip(tick.counts, beside.about.counts, strict=True)),
    )  # fmt: skip


def _bring(
    stage: Stage, law: Law | Rule, show: Callable[[RunState], None], stopped: Callable[[], str]
) -> None:  # fmt: skip
    """Wait until the rig is where it is to be held, for as long as a person may take."""
    stage.bring()
    beside = stage.supervisor
    if beside.about.replayed or math.isinf(beside.duty.near):
        return
    beside.law = law
    first = there = beside.rig.exchange(0.0).time
    while True:
        now = beside.rig.exchange(0.0)
        if reason := stopped():
            beside.give_up(Fault.STOP, reason)
        if now.faults:
            beside.give_up(now.faults, f"{beside.about.name} stopped itself: {fault_text(now.faults)}.")
        if not beside.near():
            there = now.time
        if now.time - there >= QUIET:
            return
        if now.time - first > PATIENCE:
            beside.give_up(Fault.START, f"it was not brought where it is to be stabilised within {PATIENCE:g} s.")
        show(RunState(phase=stage.advice or "waiting", time=now.time, tick=now.tick, mode=now.mode))


def log_header(
    order: RunOrder, about: Capabilities, units: Sequence[str], law: Law | Rule, start: float
) -> LogHeader:  # fmt: skip
    """What the log of a run says before its first row; `start` is the time of that since 1970 [s]."""
    return LogHeader(
        rig=order.rig_text, law=as_values(law), coordinates=tuple(zip(about.coordinates, units, strict=True)),
        command_unit=about.command_unit, period=about.period, references=order.references,
        modes={int(m): m.name for m in Mode} | {BRAKING: "BRAKING"},
        faults={int(f): text for f, text in SENTENCES.items()},
        driven=(int(Mode.HOST),), start=start,
    )  # fmt: skip


def refused(error: UprightError) -> RunEnd:
    """The end of a run that did not come to its start."""
    return RunEnd(stopped=str(error))
