"""The class as the server has it: a station for each student, whose runs are those of a lane."""

from __future__ import annotations

import json
import math
import os
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from upright.browser.classroom.judge import Judge
from upright.browser.classroom.log import NO_REPORT, LaneLog, row_of, rows_of, write_lane_logs
from upright.browser.classroom.memory import (
    BY_HAND,
    CLOSE,
    ENDED,
    HEAD,
    LATE,
    LEANT,
    LOOKS,
    NUMBERS,
    PASSED,
    PRIORITY,
    ROWS,
    RUNNING,
    TRAVELLED,
    SharedLanes,
)
from upright.browser.classroom.process import LanesOrder, run_lanes
from upright.browser.classroom.roster import Student
from upright.browser.identify.recording import RecordingPlan, recording_plan
from upright.browser.messages import ONE_STEP, SWEEP
from upright.browser.rig import HARDWARE, NO_LAW, BenchRig
from upright.browser.runs import in_own_process, write_report
from upright.browser.station import Station
from upright.errors import BadInput, UprightError
from upright.laws import Law
from upright.logs.replay import other_gains
from upright.realtime import desk as usual
from upright.realtime.interrupts import ignoring
from upright.realtime.process import BY_HAND as STOPPED_BY_HAND
from upright.realtime.process import DEAF
from upright.realtime.reference import SHAPES, Reference
from upright.realtime.session import RunEnd, RunOrder, RunState
from upright.rigs.law import for_rig
from upright.rigs.protocol import NO_FAULT, Fault, Mode
from upright.running.rig import model_and_truth
from upright.running.run import PreparedRun, RunRequest

POLL = 0.05
"""Between two looks at the lanes [s]."""
GONE = "The process of the class has ended; start the bench again. The log holds what came before."
NOT_HERE = "A class has no swing-up and no first motions; a twin of upright bench by itself has both."


class LaneDesk:
    """What stands between a lane and those who look on, as `upright.realtime.desk.Desk` for a run by itself."""

    def __init__(
        self, shared: SharedLanes, lane: int, tilt: float, target: tuple[float, ...],
        judge: Callable[[Law], tuple[str, Law]], signal: int = 0, law: Law | None = None,
    ) -> None:  # fmt: skip
        self._orders, self._answers, self._marks = shared.orders(), shared.answers(), shared.marks()
        self._ring, self._late, self._applied = shared.counts(), shared.late(), shared.numbers("command")
        self.lane, self.run, self.tilt = lane, int(self._orders["run"][lane]) + 1, tilt
        self._judge, self._refused, self._changes, self.target, self._signal = judge, "", 0, target, signal
        self._first, self._requested = int(self._orders["given"][lane]) + 1, dict[int, Reference]()
        self.stopping, self._begins = False, [] if law is None else _gains(law)
        self.events: list[tuple[int, Law]] = []

    @property
    def begun(self) -> bool:
        """Whether the lane has this run, or had it."""
        return bool(self._answers["run"][self.lane] >= self.run)

    def begin(self, ticks: int) -> None:
        """Ask for the run, under gains of its own where it has them."""
        order, n = self._orders[self.lane], len(self._begins)
        order["numbers"][:n], order["begins"] = self._begins, n
        order["away"], order["ticks"], order["signal"] = self.tilt, ticks, self._signal
        order["run"] = self.run

    def stop(self) -> None:
        """End the run, or keep it from its start; nothing takes this back."""
        self.stopping = True
        self._orders["stop"][self.lane] = max(self.run, int(self._orders["stop"][self.lane]))

    def tap(self, coordinate: int, speed: float) -> None:
        """A tap of the hand [rad/s or m/s]."""
        self._orders["taps"][self.lane, coordinate] += speed

    def follow(self, reference: Reference) -> None:
        """What the law's first reference is from the next slice on."""
        order = self._orders[self.lane]
        self._requested[number := self._first + len(self._requested)] = reference
        order["given"] = 0  # nobody takes it while it is written
        order["shape"], order["size"], order["period"] = (
            SHAPES.index(reference.shape), reference.size, reference.period
        )  # fmt: skip
        order["given"] = number

    @property
    def followed(self) -> tuple[int, Reference, int, tuple[float, ...]] | None:
        """Number of the reference that the lane follows, itself, the tick where it began, and what was held there."""
        answer = self._answers[self.lane]
        number = int(answer["followed"]) if answer["run"] == self.run else 0
        return (
            (number, self._requested[number], int(answer["since"]), self.target) if number in self._requested else None
        )

    def change(self, law: Law) -> bool:
        """Ask for C and D of a law that has all else alike; False while the last change is not answered."""
        order, answer = self._orders[self.lane], self._answers[self.lane]
        if order["change"] != answer["changed"]:
            return False
        why, fitted = self._judge(law)
        numbers = _gains(fitted)
        self._refused = why or ("the law has too many gains." if len(numbers) > NUMBERS else "")
        self._changes += 1
        if not self._refused:
            order["numbers"][: len(numbers)], order["gains"] = numbers, len(numbers)
            self.events.append((int(order["change"]) + 1, fitted))
            order["change"] += 1
        return True

    @property
    def answered(self) -> tuple[int, int, str]:
        """Which change of gains was answered last, at which tick, and why it was refused, or an empty text."""
        order, answer = self._orders[self.lane], self._answers[self.lane]
        waits = order["change"] != answer["changed"]
        return self._changes - int(waits), int(answer["at"]) + 1, self._refused

    @property
    def taken(self) -> int:
        """When the last tap or change was taken, by the monotonic clock [ns]."""
        return int(self._answers["taken"][self.lane])

    @property
    def span(self) -> tuple[int, int]:
        """First tick of the run, and the one behind its last so far, by the count of all lanes."""
        head, answer = int(self._marks[HEAD]), self._answers[self.lane]
        if answer["run"] != self.run:
            return 0, 0
        return int(answer["first"]), head if answer["why"] == RUNNING else int(answer["last"])

    def since(self, number: int) -> tuple[int, NDArray[np.void]]:
        """The number after the newest row, and the rows from one number on, without those that are lost."""
        first, end = self.span
        numbers = np.arange(max(number, end - first - ROWS // 2, 0), end - first)
        rows, places = np.zeros(len(numbers), dtype=usual.ROW), (first + numbers) % ROWS
        rows["number"] = rows["again"] = numbers
        rows["tick"], rows["mode"] = numbers + 1, int(Mode.HOST)
        rows["counts"][:, : self._ring.shape[2]] = self._ring[places, self.lane]
        rows["command"] = rows["applied"] = self._applied[places, self.lane]
        rows["late"] = self._late[places] - self._answers["late"][self.lane]
        return end - first, rows


def _gains(law: Law) -> list[float]:
    """C and D, row by row."""
    return [*law.C.ravel().tolist(), *law.D.ravel().tolist()]


@dataclass(eq=False)
class LaneRun:
    """A run that goes on: who watches it, and where its rows go until there is a log."""

    desk: LaneDesk
    watch: Callable[[RunState], str]
    rows: IO[bytes]
    over: threading.Event = field(default_factory=threading.Event)
    written: int = 0
    dropped: int = 0
    changes: list[tuple[float, str, str]] = field(default_factory=list[tuple[float, str, str]])

    def take(self) -> tuple[int, NDArray[np.void]]:
        """How many ticks there have been, and the rows that are new; the lanes move on meanwhile."""
        ticks, rows = self.desk.since(self.written + self.dropped)
        self.written += len(rows)
        self.dropped = ticks - self.written
        return ticks, rows


class Classroom:
    """Students, each with a twin of their own; all know the same nominal rig, and nobody sees the seed.

    Parameters
    ----------
    rig : BenchRig
        A twin that is held by state feedback.
    students : sequence of Student
    folder : Path
        Takes a folder for each.

    Attributes
    ----------
    stations : tuple of Station
        In the order of the students.
    pid : int
        Number of the process of the lanes; 0 until there is one.

    Raises
    ------
    BadInput
        When the rig can really move, or is held by another law.
    """

    def __init__(
        self, rig: BenchRig, students: Sequence[Student], folder: Path, *, fifo: bool = True,
        report: Callable[[PreparedRun, RunEnd, float], str] | None = None,
    ) -> None:  # fmt: skip
        if rig.kind == HARDWARE or rig.file.board:
            raise BadInput("a class has twins without faults of their wiring; a rig that can really move has one page.")
        if rig.loop is None or not isinstance(rig.law, Law):
            raise BadInput(
                f"the twins of a class are held by feedback of states, and the law of {rig.name} is another."
            )
        self.rig, self.students = rig, tuple(students)
        self._judge = Judge(rig)
        self._others: dict[int, dict[Path, Judge]] = {}
        self._about, self._held, self._units = self._judge.about, self._judge.held, self._judge.units
        self.law = law = self._judge.law
        self._plans = _plans(rig) if law.signal().shape[1] else {}  # a signal goes the way of a reference
        self._held_at = np.full(len(students), self._judge.target[-1])
        self._shared = SharedLanes(len(students), len(self._units))
        self._order = LanesOrder(
            rigs=[model_and_truth(replace(rig.file, seed=student.seed))[1] for student in students], at=rig.at,
            zero=rig.zero, law=law, travel=self._held.travel, lean=self._judge.lean, fifo=fifo,
            signals=[plan.signal.samples for plan in self._plans.values()],
        )  # fmt: skip
        self._runs: dict[int, LaneRun] = {}
        self.pid = 0
        self._logging, self._writing = threading.Lock(), threading.Lock()
        self._unwritten, self._written = deque[LaneLog](), dict[int, str]()
        self._closing, self._gone = threading.Event(), threading.Event()
        self._write = report or self._report
        self.stations = tuple(self._station(lane, student, folder) for lane, student in enumerate(students))
        # the system ends the lanes' process with the thread that started it
        self._keeper = threading.Thread(target=self._keep, name="class", daemon=True)
        self._keeper.start()

    @property
    def late(self) -> int:
        """Late ticks so far, of all lanes alike."""
        return int(self._shared.marks()[LATE])

    @property
    def ticks(self) -> int:
        """Ticks so far, of all lanes alike."""
        return int(self._shared.marks()[HEAD])

    @property
    def priority(self) -> str:
        """Of the lanes' process; empty until it moves."""
        return ("", "ordinary", "FIFO")[int(self._shared.marks()[PRIORITY])]

    @property
    def away(self) -> NDArray[np.float64]:
        """How far the last coordinate of each is from what is held, in its last run [rad or m]."""
        answers, head = self._shared.answers(), int(self._shared.marks()[HEAD])
        ends = np.where(answers["why"] == RUNNING, head, answers["last"])
        there = (answers["run"] > 0) & (ends > answers["first"]) & (ends > head - ROWS // 2)
        counts = self._shared.counts()[(ends - 1) % ROWS, np.arange(len(ends)), -1]
        away = counts / self._about.counts[-1] - self._held_at
        return np.where(there, away, 0.0)

    def stop_all(self, why: str) -> None:
        """Stop whoever runs, until each arms their own again."""
        for station in self.stations:
            if not station.over:
                station.stop(why)

    def close(self) -> None:
        """End every run and the process; logs are written, and no more reports."""
        self._closing.set()
        self._keeper.join(10.0)

    def _station(self, lane: int, student: Student, folder: Path) -> Station:
        model, file = self.rig.model.replace(name=student.name), replace(self.rig.file, seed=student.seed)
        known = replace(self.rig, name=student.address, model=model, file=file)
        return Station(
            known, folder / student.address, carry=self._carry, report=self._write, swing_up=_no_swing_up,
            desk=partial(self._desk, lane), plan=self._plan, known=partial(self._known, lane),
        )  # fmt: skip

    def _plan(self, rig: BenchRig, kind: str) -> RecordingPlan:
        """One for all, by the rig that all know."""
        return self._plans[kind] if kind in self._plans else recording_plan(rig, kind)

    def _desk(self, lane: int, request: RunRequest) -> LaneDesk:
        plans = [plan.request for plan in self._plans.values()]
        self._held_at[lane] = 0.0 if request in plans else self._judge.target[-1]
        if request in plans:
            hanging = (0.0,) * len(self._units)
            return LaneDesk(self._shared, lane, 0.0, hanging, self._judge.of, 1 + plans.index(request))
        if request.samples is not None:
            raise BadInput("the law of this class has no reference, through which its twins put a signal out.")
        if request.law is None or request.from_rest:
            raise BadInput(NOT_HERE)
        own = None if request.law == self.rig.law_path else self._others[lane][request.law]
        judge = own or self._judge
        law = None if own is None else own.law
        return LaneDesk(self._shared, lane, request.tilt, judge.target, judge.of, law=law)

    def _known(self, lane: int, rig: BenchRig) -> BenchRig:
        """The rig of a student by another description, once a run may begin under its law; it takes a while.

        Raises
        ------
        BadInput
            When its law differs from the others' by more than its gains.
        RigStopped
            When no run would begin under it.
        """
        if rig.law_path != self.rig.law_path:
            judge = Judge(rig)
            self._judge.check_alike(judge.law)
            kept, used = self._others.get(lane, {}), self.stations[lane].rig.law_path
            self._others[lane] = {path: each for path, each in kept.items() if path == used} | {rig.law_path: judge}
        return replace(rig, model=rig.model.replace(name=self.students[lane].name))

    def _carry(self, order: RunOrder, *, watch: Callable[[RunState], str], desk: LaneDesk) -> RunEnd:
        """A run on the lane of a desk, as `run_in_process` has one in a process of its own."""
        if self._gone.is_set():
            raise BadInput(GONE)
        if desk.stopping:
            return RunEnd(stopped=STOPPED_BY_HAND, held=self._held, target=desk.target)
        order.log.touch()  # the next run is called otherwise, also while this one's log is not written
        with open(rows_of(order.log), "wb") as rows:
            run = LaneRun(desk=desk, watch=watch, rows=rows)
            self._runs[desk.lane] = run
            desk.begin(max(1, math.ceil(order.seconds / self._about.period - 1e-9)))
            run.over.wait()
        return self._end(run)

    def _end(self, run: LaneRun) -> RunEnd:
        desk, answer = run.desk, self._shared.answers()[run.desk.lane]
        first, end = desk.span
        stopped, faults = self._why(answer) if desk.begun and answer["why"] != RUNNING else (GONE, Fault.WATCHDOG)
        late = int(self._shared.late()[(end - 1) % ROWS] - answer["late"]) if end > first else 0
        return RunEnd(
            ticks=end - first, late=late, passed=min(late, int(self._shared.marks()[PASSED])), stopped=stopped,
            faults=faults, about=self._about, held=self._held, target=desk.target, rows=run.written,
            dropped=run.dropped, events=tuple(run.changes), warning="" if self.priority == "FIFO" else "No FIFO.",
            seconds=(end - first) * self._about.period,
        )  # fmt: skip

    def _why(self, answer: NDArray[np.void]) -> tuple[str, Fault]:
        """Why a lane stopped, as its supervisor would say it."""
        where, value = int(answer["where"]), float(answer["value"])
        name = self._about.coordinates[where]
        match int(answer["why"]):
            case why if why == BY_HAND:
                return STOPPED_BY_HAND, Fault.STOP
            case why if why == ENDED:
                return "", NO_FAULT
            case why if why == LEANT:
                away, lean = (abs(x) for x in (value - self._judge.target[-1], self._judge.lean))
                shown = [f"{math.degrees(x):.3g} degrees" if self._units[-1] == "rad" else f"{1e3 * x:.3g} mm"
                         for x in (away, lean)]  # fmt: skip
                return (
                    f"{name} is {shown[0]} from where it is to be stabilised, more than {shown[1]}: it fell.",
                    Fault.OVERTRAVEL,
                )
            case why if why == TRAVELLED:
                most = self._held.travel[where]
                return f"{name} is at {value:.4g}, beyond its travel of {most:.4g}.", Fault.OVERTRAVEL
            case _:
                return f"The bench's server has not looked at it for {DEAF:g} s.", Fault.STOP

    def _report(self, run: PreparedRun, end: RunEnd, started: float) -> str:
        """One after the other: processors are few, and whoever moves comes first; logs wait for no report."""
        assert end.held is not None  # every run of a lane has its limits
        law = for_rig(run.law, self._about, end.held, end.target)
        assert isinstance(law, Law)  # as every desk has seen to
        kept = replace(run, law=NO_LAW, order=replace(run.order, law={}))  # neither log nor report looks there
        log = LaneLog(run=kept, end=end, started=started, units=self._units, law=law)
        self._unwritten.append(log)
        with self._logging:
            if id(log) not in self._written:  # else it was written with another's
                self._write_logs()
        if why := self._written.pop(id(log)):
            raise UprightError(why)
        with self._writing:
            if self._closing.is_set():
                raise UprightError(NO_REPORT)
            return in_own_process(write_report, kept, end, started)

    def _write_logs(self) -> None:
        """All that wait: a process takes a second to begin, and STOP ALL ends sixty runs at once."""
        logs = [self._unwritten.popleft() for _ in range(len(self._unwritten))]
        try:
            # when all is closed no process is begun any more
            text = write_lane_logs(logs) if self._closing.is_set() else in_own_process(write_lane_logs, logs)
            outcome: list[str] = json.loads(text)
        except UprightError as error:
            outcome = [str(error)] * len(logs)
        self._written.update(zip(map(id, logs), outcome, strict=True))

    def _keep(self) -> None:
        process = get_context("spawn").Process(
            target=run_lanes, args=(os.getpid(), self._order, self._shared), daemon=True, name="upright class"
        )
        marks = self._shared.marks()
        with ignoring():
            process.start()
        self.pid = process.pid or 0
        while not self._closing.is_set():
            if wait([process.sentinel], POLL):
                break
            marks[LOOKS] += 1
            for lane, run in list(self._runs.items()):
                self._look(lane, run)
        for _ in range(20):  # whoever runs has been stopped, and comes to rest at the next slice
            for lane, run in list(self._runs.items()):
                self._look(lane, run)
            if not self._runs or wait([process.sentinel], POLL):
                break
        self._gone.set()
        marks[CLOSE] = 1
        process.join(5.0)
        if process.is_alive():
            process.kill()
            process.join()
        for lane, run in list(self._runs.items()):
            self._look(lane, run)
            self._runs.pop(lane, None)
            run.over.set()

    def _look(self, lane: int, run: LaneRun) -> None:
        """Keep the rows that are new, and show the newest to whoever watches."""
        desk = run.desk
        if not desk.begun:
            if run.watch(RunState(phase="starting")):
                desk.stop()
            return
        over = bool(self._shared.answers()["why"][lane] != RUNNING)  # before the rows, which are all there then
        first, _ = desk.span
        ticks, rows = run.take()
        self._keep_rows(run, rows, first)
        self._note_changes(run)
        if len(rows):
            counts = rows["counts"][-1][: len(self._units)].tolist()
            if run.watch(
                RunState(
                    phase="running", time=ticks * self._about.period, tick=ticks,
                    late=int(rows["late"][-1]), mode=Mode.HOST, command=float(rows["command"][-1]),
                    applied=float(rows["applied"][-1]), counts=tuple(counts),
                    readings=tuple(n / per - t for n, per, t in
                                   zip(counts, self._about.counts, desk.target, strict=True)),
                )
            ):  # fmt: skip
                desk.stop()
        if over:
            self._runs.pop(lane, None)
            run.over.set()

    def _keep_rows(self, run: LaneRun, rows: NDArray[np.void], first: int) -> None:
        n = len(self._units)
        kept = np.zeros(len(rows), dtype=row_of(n))
        kept["tick"], kept["counts"], kept["command"] = rows["number"], rows["counts"][:, :n], rows["command"]
        kept["reference"] = self._shared.numbers("reference")[(first + rows["number"]) % ROWS, run.desk.lane]
        with suppress(OSError):  # a full disk ends no run; its log is found to be short
            run.rows.write(kept.tobytes())

    def _note_changes(self, run: LaneRun) -> None:
        """Gains that have begun to act, as an event just before the first tick with them."""
        answer = self._shared.answers()[run.desk.lane]
        while run.desk.events and answer["changed"] >= run.desk.events[0][0]:
            _, law = run.desk.events.pop(0)
            run.changes.append(((int(answer["at"]) - 1) * self._about.period, *other_gains(law)))


def _plans(rig: BenchRig) -> dict[str, RecordingPlan]:
    """Sweep and step, where the rig has one."""
    plans = dict[str, RecordingPlan]()
    for kind in (SWEEP, ONE_STEP):
        with suppress(BadInput):
            plans[kind] = recording_plan(rig, kind)
    return plans


def _no_swing_up(_rig: BenchRig, _path: Path) -> str:
    raise BadInput(NOT_HERE)
