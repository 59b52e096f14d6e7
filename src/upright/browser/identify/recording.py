"""A sweep or a step that a rig records: what is put out, and what it has shown so far, as the page draws it.

The run is one of the rig's loop like any other; its samples are read beside it, as everybody's who looks on are.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from upright.browser.answers import five_digits, thinned
from upright.browser.messages import SWEEP
from upright.browser.rig import HARDWARE, BenchRig
from upright.errors import BadInput, UprightError
from upright.experiments.frequency_1b.one_by_one import (
    Sine,
    SteppedSines,
    modelled,
    response_of_sines,
    sine,
    stepped_sines,
)
from upright.experiments.stand.live import live_stand
from upright.experiments.stand.step import StepSignal, modes, predicted_step, reading, step_signal
from upright.rig import Rig
from upright.running.run import RunRequest
from upright.signals.free_swing import Decay

OFTEN = 0.25
"""Time between two looks at the samples [s]; the loop keeps them for some two seconds."""
LINE, BUCKETS, NORMAL = 150, 200, 1.96
"""Frequencies of the model's line, points of a trace, and standard errors in an error bar."""

Facts = dict[str, Any]


class Samples(Protocol):
    """What a recording needs of a run's desk."""

    def since(self, number: int) -> tuple[int, NDArray[np.void]]: ...  # noqa: D102


class Sparing:
    """Lets what is costly be done now and then: by one at a time, and for a quarter of the time."""

    def __init__(self) -> None:
        self._lock, self._next = threading.Lock(), 0.0

    @contextmanager
    def turn(self, *, wait: bool) -> Generator[bool]:
        """Whether it may be done now; whoever waits may, sooner or later."""
        mine = self._lock.acquire(blocking=wait)
        began = time.monotonic()
        try:
            yield mine and (wait or began >= self._next)
        finally:
            if mine:
                now = time.monotonic()
                self._next = max(self._next, now + 3.0 * (now - began))
                self._lock.release()


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordingPlan:
    """What is put out to record a sweep or a step.

    Attributes
    ----------
    kind : str
        `SWEEP` or `ONE_STEP`.
    rig : Rig
        As it is known.
    at : str
        Equilibrium at which it rests.
    request : RunRequest
        The run that it is.
    sparing : Sparing
        Shared by all who record by this plan.
    """

    kind: str
    rig: Rig
    at: str
    signal: SteppedSines | StepSignal
    request: RunRequest
    sparing: Sparing = field(default_factory=Sparing)


def recording_plan(rig: BenchRig, kind: str) -> RecordingPlan:
    """What a rig is to put out.

    Raises
    ------
    BadInput
        When it can really move, or has no such response.
    """
    if rig.kind == HARDWARE:
        raise BadInput(
            "a rig that can really move is moved by somebody who stands beside it: upright lab --rig RIG.toml "
            "--experiment 1b, or upright run RIG.toml --excite."
        )
    stand = live_stand(rig.rig_path)
    signal = stepped_sines(stand) if kind == SWEEP else step_signal(stand)
    request = RunRequest(
        rig=rig.rig_path, samples=tuple(signal.samples.tolist()), seconds=signal.seconds, check=False, watch=False,
        what=kind,
    )  # fmt: skip
    return RecordingPlan(kind=kind, rig=stand.rig, at=stand.resting, signal=signal, request=request)


class Recording:
    """A sweep or a step of a twin.

    Attributes
    ----------
    kind : str
        `SWEEP` or `ONE_STEP`.
    request : RunRequest
        The run that it is.
    """

    def __init__(self, plan: RecordingPlan) -> None:
        self.kind, self._rig, self._at, self._plan = plan.kind, plan.rig, plan.at, plan.signal
        self.request, self._sparing = plan.request, plan.sparing
        size = self._plan.samples.size
        self._y, self._u = np.full((size, len(plan.rig.per_unit)), np.nan), np.full(size, np.nan)
        self._line: Facts = {}
        self._next, self._came, self._tried, self._lost, self._why = 0, 0, 0, 0, ""
        self._sines: list[Sine] = []
        self._reading: Decay | None = None
        self._lock, self._over = threading.Lock(), threading.Event()
        self._run, self._thread = "", None

    def begin(self, desk: Samples) -> None:
        """Read what a run shows, until it is over."""
        self._thread = threading.Thread(target=self._follow, args=(desk,), name="recording", daemon=True)
        self._thread.start()

    def end(self, log: Path | None = None) -> None:
        """The run is over; the response is stored beside its log, and where it cannot be, the page says why."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()
        with self._lock:
            self._run = "" if log is None else log.stem
            if self.kind == SWEEP:  # its sines are read; of a class sixty would be kept
                self._y, self._u = self._y[:0], self._u[:0]
            if log is not None and self._sines:
                try:  # the run has to end, whatever becomes of the file
                    response_of_sines(self._sines, self._rig).to_csv(log.with_suffix(".frequency.csv"))
                except (OSError, UprightError) as error:
                    self._why = f"The frequency response was not stored: {error}"

    def described(self) -> Facts:
        """What there is so far, as JSON holds it."""
        with self._lock:
            sines, came, decayed, run = list(self._sines), self._came, self._reading, self._run
            lost, why = self._lost, self._why
        rig, plan = self._rig, self._plan
        facts = {
            "kind": self.kind, "over": self._over.is_set(), "run": run, "command": rig.unit,
            "seconds": plan.seconds, "time": came * plan.period, "lost": lost, "why": why,
            "outputs": [{"name": c.name, "unit": c.unit, "meaning": c.meaning} for c in rig.plant.coordinates],
            **self._line,
        }  # fmt: skip
        if not self._line:
            return facts
        if isinstance(plan, SteppedSines):
            gaps = [five_digits(np.array(gap)) for gap in plan.gaps]
            return {**facts, "planned": plan.omega.tolist(), "gaps": gaps, "points": self._points(sines)}
        t = np.arange(came, dtype=np.float64) * plan.period
        read = None if decayed is None else {
            "omega": decayed.omega_n, "omega_error": NORMAL * decayed.omega_error, "zeta": decayed.zeta,
            "zeta_error": NORMAL * decayed.sigma_error / decayed.omega_n,
        }  # fmt: skip
        return {**facts, "measured": [thinned(t, y, BUCKETS) for y in self._y[:came].T], "reading": read}

    def _model(self) -> Facts:
        """What the rig as it is known would show."""
        rig, at, plan = self._rig, self._at, self._plan
        if isinstance(plan, SteppedSines):
            omega = np.geomspace(plan.omega[0] / 1.2, plan.omega[-1] * 1.2, LINE)
            response = modelled(rig, at, omega)
            angle = np.degrees(np.unwrap(np.angle(response), axis=0))
            angle -= 360 * np.round((np.median(angle, axis=0) + 90) / 360)
            gain = 20 * np.log10(np.abs(response))
            return {"line": {"omega": five_digits(omega), "dB": [five_digits(v) for v in gain.T],
                             "deg": [five_digits(v) for v in angle.T]}}  # fmt: skip
        t = np.arange(plan.samples.size, dtype=np.float64) * plan.period
        return {"predicted": [thinned(t, y, BUCKETS) for y in predicted_step(plan, rig, at).T],
                "modes": {name: list(values) for name, values in modes(rig, at).items()}}  # fmt: skip

    def _points(self, sines: Sequence[Sine]) -> list[Facts]:
        """Gain [dB] and phase [deg] of each sine that was measured, with the half widths of their 95 % intervals."""
        if not sines:
            return []
        data, line = response_of_sines(list(sines), self._rig), self._line["line"]
        with np.errstate(divide="ignore", invalid="ignore"):  # a coordinate that does not move has a gain of 0
            gain, error = data.magnitude_dB, NORMAL * data.error
        model = np.array([np.interp(np.log(data.omega), np.log(line["omega"]), deg) for deg in line["deg"]]).T
        angle = np.degrees(np.angle(data.response))
        angle += 360 * np.round((model - angle) / 360)
        return [
            {"omega": float(data.omega[k]), "dB": five_digits(gain[k]), "deg": five_digits(angle[k]),
             "dB_error": five_digits(20 / math.log(10) * error[k]),
             "deg_error": five_digits(np.degrees(error[k])), "settled": s.settled}
            for k, s in enumerate(sines)
        ]  # fmt: skip

    def _follow(self, desk: Samples) -> None:
        self._line = self._model()  # which compiles, and the loop is not there yet
        over = False
        while not over:
            over = self._over.wait(OFTEN)
            self._take(desk)
            self._evaluate(last=over)

    def _take(self, desk: Samples) -> None:
        self._next, rows = desk.since(self._next)
        rows = rows[rows["number"] < self._u.size - 1]
        if not len(rows):
            return
        at, n = rows["number"], self._y.shape[1]
        # a tick's command stands with the readings after it; the log has it beside those that it answers
        self._y[at + 1] = rows["counts"][:, :n] / np.abs(np.array(self._rig.per_unit))
        self._u[at] = rows["applied"]
        if at[0] == 0:
            self._y[0] = self._y[1]  # at rest
        came = int(at[-1]) + 1
        with self._lock:
            self._came, self._lost = came, int(np.isnan(self._u[:came]).sum())

    def _evaluate(self, *, last: bool) -> None:
        came = self._came
        with self._sparing.turn(wait=last) as mine:  # of a class, sixty would keep its server from looking at twins
            if not mine or not came:
                return
            if isinstance(self._plan, SteppedSines):
                self._measure(self._plan, came)
                return
            whole = np.isfinite(self._y[:came]).all()
            decayed = reading(self._plan, self._rig, self._y[:came]) if whole else None
            with self._lock:
                self._reading = decayed

    def _measure(self, plan: SteppedSines, came: int) -> None:
        while self._tried < len(plan.windows) and plan.windows[self._tried][1] <= came:
            part = slice(*plan.windows[self._tried])
            # else this machine was too slow to read them in time
            if np.isfinite(self._u[part]).all() and np.isfinite(self._y[part]).all():
                measured = sine(plan, self._tried, self._rig, self._y[part], self._u[part])
                with self._lock:
                    self._sines.append(measured)
            self._tried += 1
