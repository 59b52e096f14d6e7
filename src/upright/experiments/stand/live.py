"""A test stand behind the protocol of rigs: supervised runs of a RIG.toml, and a person for what no drive can do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.basis import REPLAYED
from upright.control.trial import Trial
from upright.errors import BadInput, RigStopped
from upright.experiments.stand.stand import APPLIED, StandRun, TestStand
from upright.files import read_text, write_json
from upright.laws import Law, Rule, as_values
from upright.logs.layout import library
from upright.readers import read
from upright.realtime.session import RunState
from upright.records import Array, Record
from upright.rig.makes import Make, make_named, make_of_vendor
from upright.rigs.protocol import Fault
from upright.rigs.rigfile import RigFile, read_rig_file
from upright.running.rig import model_and_truth, usual_limits
from upright.running.run import RigRun, RunRequest, run_rig
from upright.study.stored_rig import read_stored_rig

Watch = Callable[[RunState], str]


def nobody_watches() -> AbstractContextManager[Watch]:
    """No view."""
    return nullcontext(lambda _: "")


def nobody(_sentence: str) -> bool:
    """Hands of a twin: what a person would do is done already."""
    return True


@dataclass(frozen=True, kw_only=True, eq=False)
class LiveStand(TestStand):
    """A rig behind its protocol as a test stand.

    Attributes
    ----------
    person : callable
        Called with a request, in a sentence; answers whether it was done.
    watching : callable
        Opens a view for a run: a callable that is shown how it goes, and answers with a sentence to end it.
    accept : str
        Why laws from a fit that is not trusted drive hardware all the same; without it they are not armed.
    """

    attended = True
    starts_anywhere = False
    may_fall = False
    file: RigFile
    person: Callable[[str], bool] = nobody
    watching: Callable[[], AbstractContextManager[Watch]] = nobody_watches
    accept: str | None = None

    @property
    def text(self) -> str:
        """Its description: RIG.toml, and what describes the rig."""
        known = self.file.known
        return read_text(self.file.path) + ("" if known is None else read_text(known))

    @property
    def source(self) -> str:
        """Where its data come from, as a sentence."""
        if self.file.hardware:
            return f"Measured on {self.rig.name}: {self.file.kind} {self.file.port}".rstrip() + "."
        return "A digital twin behind the protocol of rigs, run as hardware is; none was touched."

    def ask(self, sentence: str) -> None:
        """Ask the person beside it; see `TestStand.ask`."""
        if not self.person(sentence):
            raise RigStopped(f"This was requested and not done: {sentence}")

    def run(
        self, samples: Sequence[float], folder: Path, stem: str, *, lifted: float = 0.0, bolted: float = 0.0
    ) -> Record:  # fmt: skip
        """Log of a signal, from rest; see `TestStand.run`."""
        request = RunRequest(
            rig=self.file.path, samples=tuple(samples), seconds=len(samples) * self.rig.period, tilt=lifted,
            bolted=bolted, check=False, watch=False, stem=stem,
        )  # fmt: skip
        return self._logged(request, folder)

    def explore(self, rule: Rule, seconds: float, folder: Path, stem: str) -> Record:
        """Log of a rule that finds out how the rig answers, from rest and with nothing compared with a model.

        Raises
        ------
        RigStopped
            When it did not run to its end.
        KeyboardInterrupt
            When somebody stopped it.
        """
        request = RunRequest(
            rig=self.file.path, exploration=rule, seconds=seconds, check=False, watch=False, stem=stem
        )  # fmt: skip
        return self._logged(request, folder)

    def hold(
        self, law: Law | Rule, at: str, folder: Path, stem: str, seconds: float, *, start: Array | None = None,
        reference: Array | None = None, pushes: Array | None = None, settled: bool = False,
    ) -> StandRun:  # fmt: skip
        """A run of a law, with the pulse before it; the filters run beside it where it is brought to what is held.

        What is `settled` was zeroed and found to be wired well, and goes on from there without rest or pulse.

        What begins at rest elsewhere has no filters beside it, and may lean as it will; see `TestStand.hold`.
        """
        if reference is not None or pushes is not None:
            law = pushed(law, reference, pushes)
        folder.mkdir(parents=True, exist_ok=True)
        path = write_json(folder / f"law_{stem}.json", as_values(law))
        from_rest = start is None and at != self.resting
        request = RunRequest(
            rig=self.file.path, law=path, seconds=seconds + self.rig.period, stem=stem,
            tilt=0.0 if start is None else float(start[-2]), from_rest=from_rest,
            accept=self.accept, check=not settled, settled=settled,
        )  # fmt: skip
        result = self._run(request, folder)
        if result.log is None or len(result.log) < 3:
            raise RigStopped(result.end.stopped)
        origin = None
        if from_rest:  # its law counts from where the encoders were zeroed, wherever the pulse has left the rig
            held, zero = (self.rig.plant.equilibrium(n) for n in (at, self.resting))
            origin = [held[n] - zero[n] for n in held]
        return run_of(result, at, origin)

    def _logged(self, request: RunRequest, folder: Path) -> Record:
        result = self._run(request, folder)
        if result.end.stopped:
            raise RigStopped(result.end.stopped)
        return read(result.log_path)

    def _run(self, request: RunRequest, folder: Path) -> RigRun:
        with self.watching() as watch:
            result = run_rig(request, folder, watch=watch)
        if result.end.faults & Fault.STOP:
            raise KeyboardInterrupt
        return result

    def described_by(self, fit: Path, folder: Path) -> LiveStand:
        """The same rig described by a fit; its RIG.toml is written to the folder as ``rig.toml``."""
        path = folder / "rig.toml"
        self.file.with_fit(fit, path)
        return live_stand(path, self.person, self.watching, self.accept)


def pushed(law: Law | Rule, reference: Array | None, pushes: Array | None) -> Law:
    """A law with its reference, and with what is added to its command before the limit as a second one.

    Raises
    ------
    BadInput
        When it is no linear law that follows a reference.
    """
    if not isinstance(law, Law) or reference is None or pushes is None:
        raise BadInput("what a live rig follows needs a linear law, a reference and pushes; give zeros for none.")
    B = np.column_stack([law.B, np.zeros(len(law.B))])
    D = np.column_stack([law.D, np.ones(len(law.D))])
    names = (*law.reference_names, "push")
    return replace(law, B=B, D=D, references=np.column_stack([reference, pushes]), reference_names=names)


def run_of(result: RigRun, at: str, origin: Sequence[float] | None = None) -> StandRun:
    """A logged run about an equilibrium, its time from where the loop began: states are the readings and their
    differences, counted from what was held, or from the readings of an origin.

    Raises
    ------
    BadInput
        When it was stopped before there is any difference.
    """
    assert result.log is not None
    t, away = result.t, result.away
    if t.size < 2:
        raise BadInput(f"The run ended before its second sample. {result.end.stopped}")
    if origin is not None:
        away = away + np.subtract(result.end.target, origin)
    x = np.empty((t.size, 2 * away.shape[1]))
    point = np.array(list(result.model.plant.equilibrium(at).values()))
    x[:, 0::2], x[:, 1::2] = away + point, np.gradient(away, t, axis=0)
    signals = {c.name: x[:, 2 * i] for i, c in enumerate(result.model.plant.coordinates)}
    record = result.log.record()
    shown = record.replace(t=t, signals={n: signals.get(n, v) for n, v in record.signals.items()})
    trial = Trial(rig=result.model, at=at, t=t, x=x, u=result.log.columns[APPLIED], rest=point, record=shown)
    left = bool(result.end.faults & Fault.OVERTRAVEL)
    return StandRun(trial=trial, ended=result.end.stopped or None, overtravel=left)


def live_stand(
    path: Path, person: Callable[[str], bool] = nobody,
    watching: Callable[[], AbstractContextManager[Watch]] = nobody_watches, accept: str | None = None,
) -> LiveStand:  # fmt: skip
    """The rig of a RIG.toml.

    Raises
    ------
    BadInput
        When it is one on which nothing can be tried, or what keeps a log is not installed.
    """
    library()
    file = read_rig_file(path)
    if file.performed == REPLAYED:
        raise BadInput(f'{path}: a replay does not answer commands; experiments need a rig or kind = "twin".')
    rig, truth = model_and_truth(file)
    units = {c.name: c.unit for c in rig.plant.coordinates}
    limits = file.limits(units, rig.unit, usual_limits(rig))
    if limits is None:
        raise BadInput(
            f"{path}: hardware is not driven without limits; write [limits] with command, and "
            f"[limits.{next(iter(units))}] with travel, speed and start."
        )
    fit = file.known if file.known and file.known.suffix != ".toml" else None
    return LiveStand(
        file=file, rig=rig, true_rig=replace(truth, name=rig.name), make=_make(file), vendor=file.vendor,
        performed=file.performed, zero=file.zero, room=limits.travel[list(units).index(rig.plant.inputs[0].on)],
        speeds=limits.speed, fit=fit, study=None if fit else file.known, added=file.added, tolerance=file.tolerance,
        person=person if file.hardware else nobody, watching=watching, accept=accept,
    )  # fmt: skip


def _make(file: RigFile) -> Make | None:
    """The make that RIG.toml or the description says it is of."""
    if file.known is None:
        return make_named(file.make)
    known = read_stored_rig(file.known)
    return make_of_vendor(file.vendor or known.hardware.vendor, known.plant)
