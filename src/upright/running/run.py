"""A run of a law, or of a signal, on the rig of a RIG.toml, and what it came to."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from upright.basis import DESCRIBED, MEASURED, NOT_TRUSTED, Basis
from upright.control.effort import FELT, Effort, RestEffort, effort, rest_effort, rest_samples, shown
from upright.control.preflight import BUSY, SATURATED, STABILISED
from upright.errors import BadInput
from upright.files import read_text
from upright.laws import Law, Rule, as_values
from upright.logs import RunLog, read_log
from upright.logs.layout import library
from upright.realtime.jitter import TOLERATED
from upright.realtime.process import run_in_process
from upright.realtime.session import RunEnd, RunOrder, RunScene, RunState, carry_out
from upright.records import Array
from upright.rig import Rig
from upright.rigs.protocol import Mode
from upright.rigs.rigfile import RigFile, read_rig_file
from upright.running.rig import (
    about_what_is_held,
    excitation_law,
    model_and_truth,
    read_law,
    signal,
    stage_of,
    usual_limits,
)
from upright.units import is_acceleration

LEAST = 100
"""Fewest rows of which a last third tells anything."""
ARRIVED = math.radians(10)
"""How far from upright a run that began hanging may be over its last third, for the rest of it to be one [rad]."""
MODES = {"host": Mode.HOST, "mcu": Mode.MCU}


@dataclass(frozen=True, kw_only=True)
class RunRequest:
    """Request for a run.

    `law` is a file, None for a signal that is put out blindly, `excite`; `reference` is a signal that the law follows.
    `from_rest` begins where the rig rests, however far that is from what is held, as a swing-up does.
    `samples` are what is put out, sample by sample instead of in words, or an `exploration` in its place, a rule that
    rests on no model; logs are called after the `stem`.
    `bolted` is the inertia that a twin's hands add to its first body before it [kg or kg m^2].
    `accept` says why a law from a model that is not trusted runs on hardware all the same.
    `settled` says that the rig hangs as it was zeroed and known, so that it is neither zeroed nor awaited again.
    `steered` says that somebody gives the law references while it runs, so that each of them is logged.
    `what` is what a list calls it, where its beginning does not say that.
    `own_process` puts a twin or a replay into a process of its own as well, where a rig always is.
    """

    rig: Path
    law: Path | None = None
    excite: str | None = None
    reference: str | None = None
    samples: tuple[float, ...] | None = None
    exploration: Rule | None = None
    stem: str = "run"
    seconds: float = 30.0
    mode: str = "host"
    tilt: float = 0.0
    bolted: float = 0.0
    check: bool = True
    watch: bool = True
    from_rest: bool = False
    accept: str | None = None
    settled: bool = False
    steered: bool = False
    what: str = ""
    own_process: bool = False

    def __post_init__(self) -> None:
        if (self.law is None) == (not self.excite and not self.samples and self.exploration is None):
            raise BadInput('A run needs either a law (--law design.json) or a signal (--excite "sine 0.5 2").')
        if not 0 < self.seconds <= 86_400:
            raise BadInput(f"a run takes more than 0 and at most 86400 s, got {self.seconds:g} s.")
        if self.mode not in MODES:
            raise BadInput(f"--mode is host or mcu, got '{self.mode}'.")
        if self.reference and self.law is None:
            raise BadInput("a reference needs a law to follow it; to send a signal without a law, use --excite.")


@dataclass(frozen=True, kw_only=True, eq=False)
class RigRun:
    """What a run came to.

    Attributes
    ----------
    model : Rig
        As it is known.
    log : RunLog or None
        None where no loop began.
    basis : Basis
        Of the law, and of the model that the supervisor compared the rig with.
    """

    request: RunRequest
    file: RigFile
    model: Rig
    end: RunEnd
    log: RunLog | None
    log_path: Path
    basis: Basis = DESCRIBED

    @property
    def t(self) -> Array:
        """Time since the loop began [s]."""
        t: Array = np.zeros(0) if self.log is None else self.log.columns["t"]
        return t - t[0] if t.size else t

    @property
    def away(self) -> Array:
        """Deviations from what was held, shape (N, coordinates)."""
        if self.log is None:
            return np.zeros((0, len(self.model.per_unit)))
        away = np.column_stack([self.log.columns[c.name] for c in self.model.plant.coordinates]) - self.end.target
        if self.request.from_rest and len(away):  # it may stand on either side of where it hung
            away[:, -1] -= math.tau * round(away[-1, -1] / math.tau)
        return away

    @property
    def stands(self) -> int:
        """Row from which on it is upright to the end; behind the last one where it is not."""
        off = np.flatnonzero(np.abs(self.away[:, -1:]).max(axis=1, initial=0.0) > ARRIVED)
        return int(off[-1]) + 1 if off.size and self.request.from_rest else 0

    @property
    def unrest(self) -> tuple[float, ...]:
        """Root mean square of the deviations over the second half [rad or m]; from their mean with a reference."""
        half = self.away[max(len(self.away) // 2, min(self.stands, len(self.away) - 1)) :]
        half = half - half.mean(axis=0) if self.request.reference and half.size else half
        return tuple(np.sqrt(np.mean(half**2, axis=0)).tolist()) if half.size else ()

    @property
    def count(self) -> tuple[float, ...]:
        """One count of each encoder [rad or m]; a deviation below that is not a number that anybody read."""
        return tuple(1.0 / abs(n) for n in self.model.per_unit)

    @property
    def limit(self) -> float:
        """Command limit: of the drive, or as the supervisor limits it."""
        return min(self.model.saturation, math.inf if self.end.held is None else self.end.held.command)

    @property
    def way_back(self) -> Effort | None:
        """What the drive had to give in all; None where no law ran."""
        if self.request.law is None or self.log is None or not len(self.log):
            return None
        return effort(self._applied, self.limit, self.model.converter)

    @property
    def saturates(self) -> bool:
        """Whether the command was at its limit for longer than the drive's own lag hides."""
        back = self.way_back
        return back is not None and back.saturated * self.end.ticks * self.model.period > FELT

    @property
    def _applied(self) -> Array:
        """Commands that the converter put out."""
        assert self.log is not None
        return self.log.columns[f"{self.log.header.command}_applied"]

    @property
    def effort(self) -> RestEffort | None:
        """What holding took over the last third; None where no law held it to the end, or it followed what moved."""
        log = self.log
        if self.request.law is None or self.end.stopped or log is None or len(log) < LEAST:
            return None
        columns = log.columns
        if any(np.ptp(rest_samples(columns[name])) > 0 for name, _ in log.header.references):
            return None
        if self.request.from_rest and float(np.abs(rest_samples(self.away)[:, -1]).max()) > ARRIVED:
            return None
        body = [c.name for c in self.model.plant.coordinates].index(self.model.plant.inputs[0].on)
        return rest_effort(self.t, self._applied, self.limit, body=self.away[:, body], count=self.count[body])

    @property
    def quiet(self) -> bool:
        """Whether the command at rest left the drive to what it is there for, as far as there was a rest."""
        return self.effort is None or self.effort.quiet

    @property
    def complete(self) -> bool:
        """Whether every row of the loop is in the log."""
        return self.log is not None and not self.log.complaint and not self.end.dropped

    @property
    def sound(self) -> bool:
        """Whether it ran to its end, in time, with a whole log."""
        stood = not self.stands or self.stands < len(self.t)
        return not self.end.stopped and self.complete and stood and self.end.late <= TOLERATED * self.end.due

    @property
    def verdict(self) -> str:
        """What it came to, in a sentence or two."""
        return self.basis.qualified(self._outcome())

    def _outcome(self) -> str:
        end = self.end
        if end.stopped:
            ran = f" after {self.t[-1]:.3g} s" if self.t.size else " before its loop began"
            return f"Stopped{ran}: {end.stopped}"
        how = f"{self.request.seconds:g} s, {end.ticks} ticks{f' of {end.due} due' * (end.passed > 0)}"
        late = f", {end.late} of them late" if end.late else ", none late"
        log = "" if self.complete else f" The log is incomplete: {end.log_message or 'rows are missing'}."
        if self.request.law is None:
            return f"The signal was put out for {how}{late}.{log}"
        if self.stands and self.stands == len(self.t):
            return f"Not swung up in {how}{late}; it is {math.degrees(abs(self.away[-1, -1])):.0f} degrees off.{log}"
        up = f" It stands since {self.t[self.stands]:.3g} s." if self.stands else ""
        last = self.model.plant.coordinates[-1]
        size = max(self.unrest[-1], self.count[-1])
        size = f"{math.degrees(size):.2g} degrees" if last.unit == "rad" else f"{1e3 * size:.2g} mm"
        size = f"one encoder count, {size}" if self.unrest[-1] < self.count[-1] else size
        what = "varied by" if self.request.reference else "stayed within"
        kind = STABILISED if self.quiet and not self.saturates else SATURATED if self.quiet else BUSY
        return (
            f"{kind.capitalize()} for {how}{late}; {last.name} {what} {size} (rms, second half){self._rest()}.{up}{log}"
        )

    def _rest(self) -> str:
        if self.effort is None:
            return ""
        body = self.effort.body
        text = f"; the command at rest {shown(self.effort, self.limit, self.model.unit)}"
        if body is None:
            return text
        name, unit = self.model.plant.inputs[0].on, self.model.plant.coordinates[0].unit
        size = f"{math.degrees(body.size):.2g} degrees" if unit == "rad" else f"{1e3 * body.size:.2g} mm"
        return f"{text}; {name} cycles by {size} every {body.period:.2g} s"


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedRun:
    """A run that can begin; attributes as of `RunOrder` and `RigRun`."""

    request: RunRequest
    file: RigFile
    model: Rig
    law: Law | Rule
    basis: Basis
    order: RunOrder
    scene: RunScene

    def ended(self, end: RunEnd) -> RigRun:
        """What it came to, by its log."""
        path = self.order.log
        log = read_log(path) if path.exists() else None
        return RigRun(
            request=self.request, file=self.file, model=self.model, end=end, log=log, log_path=path, basis=self.basis
        )


def run_rig(
    request: RunRequest, folder: Path, *, watch: Callable[[RunState], str] = lambda _: ""
) -> RigRun:  # fmt: skip
    """Run what is requested, log it, and report the result.

    Parameters
    ----------
    folder : Path
        Takes the log.
    watch : callable
        Shown how it goes; answers with a sentence when it wants the run to end.

    Raises
    ------
    BadInput
        As `prepared`.
    """
    run = prepared(request, folder)

    def shown(state: RunState) -> str:
        return watch(replace(state, scene=run.scene))

    if run.file.hardware or request.own_process:
        return run.ended(run_in_process(run.order, watch=shown, paced=run.file.hardware))
    return run.ended(_inline(run.order, run.law, shown))


def prepared(request: RunRequest, folder: Path) -> PreparedRun:
    """What is requested, from its files; nothing is opened yet.

    Parameters
    ----------
    folder : Path
        Takes the log.

    Raises
    ------
    BadInput
        When files contradict each other, or a law from a model that is not trusted is to drive hardware and nobody
        said why.
    """
    library()  # what a log needs is missed before anything moves
    file = read_rig_file(request.rig)
    read = None if request.law is None else read_law(request.law)  # before what the rig lacks
    model, _ = model_and_truth(file)
    if file.hardware and request.check and is_acceleration(model.unit):
        raise BadInput(
            f"the drive of {request.rig} is commanded by its acceleration, so that the small pulse before a run would "
            "leave it moving; run it without one: --no-check."
        )
    balance, basis = request.law is not None, MEASURED if file.hardware and request.law is None else model.basis
    zero = file.zero if file.zero in model.plant.equilibria else next(iter(model.plant.equilibria))
    at = file.at if file.at in model.plant.equilibria else zero
    values: dict[str, Any] | None = None
    if read is not None:
        law, designed = about_what_is_held(read[0], model, at, zero), read[1]
        basis &= designed
        if file.hardware:
            _check_accepted(request, basis)
        if request.reference:
            if not isinstance(law, Law) or not law.reference_names or not np.any(law.D[:, law.readings :]):
                raise BadInput(
                    f"the law of {request.law} follows no reference; design one that does: upright design FIT --track "
                    "COORDINATE."
                )
            unit = model.plant.coordinates[0].unit
            law = replace(law, references=np.array(signal(request.reference, unit, model.period, request.seconds)))
    elif request.exploration is not None:
        law = request.exploration
    elif request.samples:
        with _FIRST:  # sixty who begin at once would all make it
            law, values = _put_out(request.samples, len(model.per_unit), model.period)
    else:
        samples = signal(request.excite or "", model.unit, model.period, request.seconds)
        law = excitation_law(samples, len(model.per_unit), model.period)
    references = _references(law, model, request.steered) if request.law is not None else ()
    folder.mkdir(parents=True, exist_ok=True)
    path = fresh(folder, request.stem, ".mcap")
    order = RunOrder(
        make=partial(stage_of, request.rig, balance=balance, tilt=request.tilt, watch=request.watch,
                     from_rest=request.from_rest, bolted=request.bolted), law=values or as_values(law),
        seconds=request.seconds, log=path, mode=MODES[request.mode], check=request.check,
        zero=not request.settled,
        rig_text=read_text(request.rig),
        references=references, accepted=(request.accept or "").strip() if basis.level == NOT_TRUSTED else "",
    )  # fmt: skip
    units = {c.name: c.unit for c in model.plant.coordinates}
    limits = file.limits(units, model.unit, usual_limits(model))
    scene = RunScene(
        readings=tuple(units.items()), command_unit=model.unit, seconds=request.seconds,
        limit=model.saturation if limits is None else min(model.saturation, limits.command),
    )  # fmt: skip
    return PreparedRun(request=request, file=file, model=model, law=law, basis=basis, order=order, scene=scene)


def _check_accepted(request: RunRequest, basis: Basis) -> None:
    """Refuse to arm a law from a model that is not trusted, unless somebody says why it runs all the same."""
    if basis.level == NOT_TRUSTED and not (request.accept or "").strip():
        raise BadInput(
            f"the law of {request.law} is not armed on hardware, because its model is not trusted: {basis.sentence} "
            'Identify the rig again, or run it anyway with --accept "REASON", which the log keeps.'
        )


_FIRST = threading.Lock()


@lru_cache(maxsize=2)
def _put_out(samples: tuple[float, ...], coordinates: int, period: float) -> tuple[Law, dict[str, Any]]:
    """A law that puts samples out, and its values: of a class many put out the same at once, 15 MB for a sweep."""
    law = excitation_law(samples, coordinates, period)
    return law, as_values(law)


def _references(law: Law | Rule, model: Rig, steered: bool = False) -> tuple[tuple[str, str], ...]:
    """Names and units for the log of what the law follows; of signals that it came with, was or will be given."""
    if not isinstance(law, Law) or (law.references is None and not steered):
        return ()
    coordinates = {c.name for c in model.plant.coordinates}
    names = law.reference_names or tuple(f"reference_{i + 1}" for i in range(law.signal().shape[1]))
    unit = model.plant.coordinates[0].unit
    return tuple((f"{n}_reference" if n in coordinates else n, unit) for n in names)


def _inline(order: RunOrder, law: Law | Rule, watch: Callable[[RunState], str]) -> RunEnd:
    """The same in this process, in virtual time."""
    reason, states = "", 0

    def show(state: RunState) -> None:
        nonlocal reason, states
        states += 1
        if states % 100 == 0:  # often enough for an eye, in virtual time
            reason = reason or watch(state)

    return carry_out(order, law=law, show=show, stopped=lambda: reason)


def fresh(folder: Path, stem: str, ending: str) -> Path:
    """A name in a folder that no file has yet: run.mcap, run-2.mcap, ..."""
    path, n = folder / f"{stem}{ending}", 1
    while path.exists():
        n += 1
        path = folder / f"{stem}-{n}{ending}"
    return path
