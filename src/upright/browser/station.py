"""One rig of the bench: what it does, who may change that, and its stop, which stays until somebody arms it again."""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from upright.basis import NOT_TRUSTED
from upright.browser.hanging import first_motions, swing_up_apart
from upright.browser.identify.last_use import LastUse
from upright.browser.identify.recording import Recording, RecordingPlan, recording_plan
from upright.browser.lease import Lease
from upright.browser.messages import HANGING, HELD, MOTIONS, ONE_STEP, SWEEP, ClientRequest
from upright.browser.rig import HARDWARE, TWIN, BenchRig
from upright.browser.runs import report_apart
from upright.errors import BadInput, UprightError, nearest
from upright.laws import Law
from upright.live.twin import Loop
from upright.realtime.desk import Desk
from upright.realtime.process import BY_HAND, DEAF, run_in_process
from upright.realtime.reference import STEP, Reference
from upright.realtime.session import RunEnd, RunState
from upright.records import Array
from upright.rigs.board import SENTENCES
from upright.running.rig import NEAR
from upright.running.run import PreparedRun, RunRequest, prepared

IDLE, STARTING, RUNNING, STOPPED, ENDED = "idle", "starting", "running", "stopped", "ended"
LONGEST, USUAL = 3600.0, 600.0
"""Of a run [s]."""
TILT, ASIDE = math.radians(3.0), 0.003
"""How far a twin's hand lets go from what is held, where nobody says [rad, m]."""
NOT_DESIGNED = "Its swing-up is being designed, which takes some seconds."
OTHERS = {
    HANGING: "a swing-up runs, which is", MOTIONS: "its first motions run, which are",
    SWEEP: "a sweep runs, which is", ONE_STEP: "a step runs, which is",
}  # fmt: skip
"""What else runs than a law that holds, by where it began."""
PERIODS = (0.2, 60.0)
"""Of a wave that is followed [s]."""
FASTEST = 20.0
"""Tap that a twin's hand gives at most [rad/s or m/s]."""


class RunDesk(Protocol):
    """What a station needs of `Desk`."""

    def stop(self) -> None: ...  # noqa: D102
    def tap(self, coordinate: int, speed: float) -> None: ...  # noqa: D102
    def follow(self, reference: Reference) -> None: ...  # noqa: D102
    def change(self, law: Law) -> bool: ...  # noqa: D102
    def since(self, number: int) -> tuple[int, NDArray[np.void]]: ...  # noqa: D102
    @property
    def answered(self) -> tuple[int, int, str]: ...  # noqa: D102
    @property
    def followed(self) -> tuple[int, Reference, int, tuple[float, ...]] | None: ...  # noqa: D102
    @property
    def taken(self) -> int: ...  # noqa: D102


class Station:
    """A rig, its runs and its operator.

    Parameters
    ----------
    carry, report, swing_up : callable
        Run an order as `run_in_process` does; write what it came to, and give the verdict; store a swing-up.
    clock : callable
        Time that never goes back [s].
    desk : callable
        Gives the desk of a run that is requested.
    plan : callable
        Gives the plan of a sweep or a step.
    known : callable
        Gives a rig by another description as this one may take it up, or refuses it; it may take a while.

    Attributes
    ----------
    state, why : str
        One of `IDLE`, `STARTING`, ...; why it is stopped, as a sentence.
    verdict : str
        Of the last run, as soon as its report is written.
    writing : int
        Reports of runs that are being written.
    last : RunState
        How the run goes, some twenty times a second.
    over : bool
        Whether no process has the rig.
    hanging : str
        Why it cannot be swung up from where it hangs, as a sentence; empty where it can.
    origin : str
        Where the run, or the last one, began: `HELD`, `HANGING` for a swing-up, `MOTIONS` to be identified, and so on.
    recording : Recording or None
        The last sweep or step.
    last_use : LastUse or None
        How it was used when the bench last ran, until it is described otherwise.
    loop, requested : Loop or None
        The law that runs as state feedback, and the one that was asked for last; a swing-up is none.
    desk : RunDesk or None
        Of the run that goes on, or of the last one.
    """

    desk: RunDesk | None
    loop: Loop | None
    requested: Loop | None
    _thread: threading.Thread | None

    def __init__(
        self, rig: BenchRig, folder: Path, *, fifo: bool = True, carry: Callable[..., RunEnd] = run_in_process,
        report: Callable[[PreparedRun, RunEnd, float], str] = report_apart,
        swing_up: Callable[[BenchRig, Path], str] = swing_up_apart, clock: Callable[[], float] = time.monotonic,
        desk: Callable[[RunRequest], RunDesk] = lambda _: Desk(),
        plan: Callable[[BenchRig, str], RecordingPlan] = recording_plan,
        known: Callable[[BenchRig], BenchRig] = lambda rig: rig,
    ) -> None:  # fmt: skip
        self.rig, self.folder, self.lease = rig, folder, Lease(clock)
        self.state, self.why, self.verdict, self.seconds = IDLE, "", "", 0.0
        self.last, self.over, self.desk = RunState(phase=""), True, None
        self.loop, self.requested = rig.loop, None
        self.hanging, self.origin, self._swing_up = NOT_DESIGNED, HELD, swing_up
        self._held_by: Array | None = None
        self._designer: threading.Thread | None = None
        self._accepted, self._fifo, self._ending = "", fifo, False
        self._lock, self._thread = threading.Lock(), None
        self._carry, self._report, self._clock, self._beat = carry, report, clock, clock()
        self._new_desk, self._plan, self.known, self.writing = desk, plan, known, 0
        self.recording: Recording | None = None
        self.last_use: LastUse | None = None

    def beat(self) -> None:
        """Say that somebody can stop it; a run whose server does not answer any more ends by itself."""
        self._beat = self._clock()
        if self.lease.lapsed() and self.state in (STARTING, RUNNING):
            self.stop("The operator is gone.")

    def prepare(self) -> None:
        """Have its swing-up designed, once, beside everything else."""
        with self._lock:
            if self._designer is None:
                design = partial(self._design, self.rig)
                self._designer = threading.Thread(target=design, name=f"{self.rig.name} designer", daemon=True)
                self._designer.start()

    def at_rest(self) -> None:
        """Refuse while it runs.

        Raises
        ------
        BadInput
            When it runs, or is on its way to rest.
        """
        if not self.over or self.state in (STARTING, RUNNING):
            raise BadInput(f"{self.rig.name} runs; stop it first.")

    def describe(self, who: str, rig: BenchRig) -> None:
        """Let it be known by another description and its law, from the next start on.

        Raises
        ------
        BadInput
            When they do not operate it, or it runs.
        """
        self._operated(who)
        self.take_up(rig)

    def take_up(self, rig: BenchRig, last_use: LastUse | None = None) -> None:
        """The same as it was used before, by nobody's request."""
        with self._lock:
            self.at_rest()
            self.last_use = last_use
            if rig.model is not self.rig.model:  # its swing-up is another one
                self.hanging, self._held_by, self._designer = NOT_DESIGNED, None, None
            self.rig, self.loop, self.requested, self.origin = rig, rig.loop, None, HELD

    def start(
        self, who: str, *, seconds: float = USUAL, start: Sequence[float] = (), accept: str = "", origin: str = HELD
    ) -> None:
        """Begin a run, from one of the places that messages name.

        Raises
        ------
        BadInput
            When it may not be started now, or so.
        """
        rig = self.rig
        self._may_start(who, rig)
        if not 0 < seconds <= LONGEST:
            raise BadInput(f"a run takes more than 0 and at most {LONGEST:g} s, got {seconds:g} s.")
        if rig.kind == HARDWARE and rig.basis.level == NOT_TRUSTED and not accept.strip():
            raise BadInput(f"its model is not trusted: {rig.basis.sentence} Say why it runs all the same.")
        if origin != HELD and start:
            raise BadInput("nobody's hand brings it away from where it hangs.")
        if origin == HANGING and (why := self.hanging):
            self.prepare()
            raise BadInput(why)
        recording = Recording(self._plan(rig, origin)) if origin in (SWEEP, ONE_STEP) else None
        if recording is not None or origin == MOTIONS:
            request = first_motions(rig) if recording is None else recording.request
            seconds = request.seconds
        else:
            swings = origin == HANGING
            request = RunRequest(
                rig=rig.rig_path, law=self._swing_path if swings else rig.law_path, seconds=seconds,
                tilt=0.0 if swings else self._tilt(start), from_rest=swings, accept=accept,
                steered=rig.follows and not swings,
            )  # fmt: skip
        with self._lock:
            self._may_start(who, rig)  # what a recording needs takes a while, in which somebody may have stopped it
            desk = self._new_desk(request)
            self.why, self.verdict, self.seconds, self._accepted = "", "", seconds, accept.strip()
            self.origin, self.loop = origin, rig.loop if origin == HELD else None
            self.recording = recording or self.recording
            self.last, self.desk = RunState(phase="starting"), desk  # after what a scene shows: a new desk is a new one
            self.state, self.over, self._ending = STARTING, False, False
        # the system ends the loop's process with the thread that started it, which waits for it
        every = (request, desk, recording)
        self._thread = threading.Thread(target=self._run, args=every, name=self.rig.name, daemon=True)
        self._thread.start()

    def stop(self, why: str) -> None:
        """Stop it, whatever it does, until somebody arms it again."""
        with self._lock:
            if self.desk is not None:
                self.desk.stop()
            if self.state != STOPPED:
                self.state, self.why = STOPPED, why

    def end(self, who: str) -> None:
        """End a run as its seconds do, so that the next one can begin.

        Raises
        ------
        BadInput
            When they do not operate it, or nothing runs.
        """
        self._operated(who)
        desk, self._ending = self._running(), True
        desk.stop()

    def rearm(self, who: str) -> None:
        """Let it be started again.

        Raises
        ------
        BadInput
            When they do not operate it, or it has not come to its end.
        """
        self._operated(who)
        if not self.over:
            raise BadInput(f"{self.rig.name} is on its way to rest; arm it again when it is there.")
        with self._lock:
            if self.state == STOPPED:
                self.state, self.why = IDLE, ""

    def tap(self, who: str, coordinate: str, speed: float) -> None:
        """Tap a twin."""
        self._operated(who)
        names = [c.name for c in self.rig.model.plant.coordinates]
        if self.rig.kind != TWIN:
            raise BadInput("a tap is for a twin; tap the rig by hand.")
        if coordinate not in names:
            raise BadInput(f"it has no coordinate '{coordinate[:40]}'; {nearest(coordinate[:40], names)}")
        if abs(speed) > FASTEST:
            raise BadInput(f"a tap adds at most {FASTEST:g} to a speed.")
        self._running().tap(names.index(coordinate), speed)

    def poles(self, who: str, poles: Sequence[complex], *, confirm: bool = False, soon: bool = False) -> None:
        """Ask for other gains, which the loop's supervisor accepts or refuses; see `BenchRig.with_poles`."""
        self._operated(who)
        if self.rig.kind == HARDWARE and not confirm:
            raise BadInput("this changes what drives a rig that can really move; confirm it.")
        if self.rig.basis.level == NOT_TRUSTED and not self._accepted:
            raise BadInput(f"its model is not trusted: {self.rig.basis.sentence}")
        desk = self._running()
        if self.origin != HELD:
            raise BadInput(f"{OTHERS[self.origin]} no feedback of states alone; its poles stay as they are.")
        loop = self.rig.with_poles(poles, soon=soon)
        if not desk.change(loop.law):
            raise BadInput("the last change is not answered yet.")
        self.requested = loop

    def follow(self, who: str, value: float, *, shape: str = STEP, period: float = 0.0) -> None:
        """Give the law another reference: a step, or a wave of a period [s]."""
        self._operated(who)
        if not self.rig.follows or (self.origin != HELD and not self.over):
            raise BadInput("its law follows no reference.")
        most = self.rig.model.travel
        if abs(value) > min(most, 1e3):
            raise BadInput(f"a reference lies within its travel of {most:.4g}.")
        if shape == STEP and period:
            raise BadInput("a step has no period.")
        if shape != STEP and not PERIODS[0] <= period <= PERIODS[1]:
            raise BadInput(f"a {shape} has a period from {PERIODS[0]:g} to {PERIODS[1]:g} s, got {period:g} s.")
        self._running().follow(Reference(size=value, shape=shape, period=period))

    def close(self) -> None:
        """Stop it, and wait until it is at rest and its log is whole."""
        self.stop("The bench was closed.")
        if self._thread is not None:
            self._thread.join(30.0)

    @property
    def gains(self) -> Array | None:
        """Of the feedback that holds it in this run, or in the last one; None where the law is no feedback."""
        return self._held_by if self.origin == HANGING else None if self.loop is None else self.loop.K

    @property
    def _swing_path(self) -> Path:
        return self._swing_path_of(self.rig)

    def _swing_path_of(self, rig: BenchRig) -> Path:
        return (rig.law_path.parent if rig.fit else self.folder) / "swing_up.json"

    def _design(self, rig: BenchRig) -> None:
        gains, why = None, ""
        try:
            gains = np.array([json.loads(self._swing_up(rig, self._swing_path_of(rig)))])
        except UprightError as error:
            why = str(error)
        except RuntimeError as error:  # its process was killed, as with the bench that closes meanwhile
            why = f"Its swing-up was not designed: {error}."
        with self._lock:
            if rig.model is self.rig.model:  # a design takes seconds, in which another description may have come
                self._held_by, self.hanging = gains, why

    def _may_start(self, who: str, rig: BenchRig) -> None:
        self._operated(who)
        if self.state == STOPPED:
            raise BadInput(f"{rig.name} is stopped: {self.why} Arm it again first.")
        if self.state not in (IDLE, ENDED):
            raise BadInput(f"{rig.name} runs already.")
        if self.rig is not rig:
            raise BadInput(f"{rig.name} has another model since this start was requested; start it again.")

    def _operated(self, who: str) -> None:
        if self.lease.holder != who:
            raise BadInput("somebody else operates it." if self.lease.holder else "take it first.")

    def _running(self) -> RunDesk:
        if self.state != RUNNING or self.desk is None:
            raise BadInput(f"{self.rig.name} does not run.")
        return self.desk

    def _tilt(self, start: Sequence[float]) -> float:
        if self.rig.kind != TWIN:
            return 0.0
        coordinates = self.rig.model.plant.coordinates
        angle = coordinates[-1].unit == "rad"
        if not start:
            return TILT if angle else ASIDE
        if len(start) != 2 * len(coordinates) or any(x for i, x in enumerate(start) if i != len(start) - 2):
            raise BadInput(f"a twin's hand lets go of {coordinates[-1].name} at rest, with all other states at zero.")
        if angle and abs(start[-2]) > NEAR:
            raise BadInput(f"a run starts within {math.degrees(NEAR):.3g} degrees of what is held.")
        return start[-2]

    def _run(self, request: RunRequest, desk: RunDesk, recording: Recording | None) -> None:
        started, log = time.time(), None
        try:
            run = prepared(request, self.folder)
            log = run.order.log
            if recording is not None:
                recording.begin(desk)
            order = replace(run.order, wall=True, fifo=self._fifo)
            end = self._carry(order, watch=self._watch, desk=desk)
        except UprightError as error:
            self._ended(str(error))
            return
        except BaseException:
            self._ended("The run failed by a bug; see what the server printed.")
            raise
        finally:
            if recording is not None:
                recording.end(log)
        why = self._ended(end.stopped, end)
        if end.stopped == BY_HAND:  # the loop does not know by whose
            end = replace(end, stopped=why or "Ended by its operator.")
        verdict = ""
        try:
            verdict = self._report(run, end, started)
        except UprightError as error:
            verdict = f"There is no report: {error}"
        finally:
            with self._lock:
                self.writing -= 1
                if self.desk is desk:  # a report takes seconds, in which the next run may have begun
                    self.verdict = verdict

    def _ended(self, why: str, end: RunEnd | None = None) -> str:
        with self._lock:
            self.over = True
            if end is not None:
                self.writing += 1
                self.last = replace(self.last, late=end.late, tick=end.ticks, faults=end.faults)
            if self.state != STOPPED:
                by_operator = self._ending and why == BY_HAND
                self.state, self.why = (STOPPED, why) if why and not by_operator else (ENDED, "")
            return self.why

    def _watch(self, state: RunState) -> str:
        self.last = state
        with self._lock:
            if self.state == STARTING and state.phase == "running":
                self.state = RUNNING
        gone = self._clock() - self._beat
        return f"The bench's server has not answered for {DEAF:g} s." if gone > DEAF else ""

    def described(self, who: str) -> dict[str, Any]:
        """How it goes, for one client, as JSON holds it."""
        holder, last = self.lease.holder, self.last
        return {
            "type": "state", "state": self.state, "why": self.why, "phase": last.phase,
            "operator": "nobody" if not holder else "you" if holder == who else "another",
            "time": last.time, "tick": last.tick, "late": last.late, "mode": last.mode.name,
            "faults": [text for fault, text in SENTENCES.items() if fault in last.faults],
            "seconds": self.seconds, "verdict": self.verdict, "hanging": self.hanging,
            "from": self.origin, "writing": self.writing > 0,
        }  # fmt: skip


def obey(station: Station, who: str, message: ClientRequest) -> None:
    """Do what a client asks for, where it may.

    Raises
    ------
    BadInput
        Why not.
    """
    fields = dict(message.fields)
    match message.do:
        case "operate":
            if not station.lease.take(who):
                raise BadInput("somebody else operates it.")
        case "release":
            station.lease.give(who)
        case "stop":
            station.stop(
                "Stopped by its operator." if station.lease.holder == who else "Stopped by somebody who watches."
            )
        case "end":
            station.end(who)
        case "rearm":
            station.rearm(who)
        case "start":
            station.start(who, origin=fields.pop("from", HELD), **fields)
        case "tap":
            station.tap(who, **fields)
        case "poles":
            station.poles(who, **fields)
        case _:
            station.follow(who, **fields)
