"""A rig at hand: signals are put out, laws run, and a person is asked for what no drive can do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from upright.basis import REPLAYED
from upright.control.trial import Trial
from upright.errors import BadInput, RigStopped
from upright.files import read_text, write_json
from upright.laws import Law, Rule, as_values
from upright.logs.layout import library
from upright.realtime.session import RunState
from upright.records import Array
from upright.rig import Rig
from upright.rig.makes import MAKES, Make, make_of_vendor
from upright.rigs.protocol import Fault
from upright.rigs.rigfile import RigFile, read_rig_file
from upright.running.rig import described
from upright.running.run import RigRun, RunRequest, run_rig
from upright.study.stored_rig import read_stored_rig

Watch = Callable[[RunState], str]


def nobody_watches() -> AbstractContextManager[Watch]:
    """No view."""
    return nullcontext(lambda _: "")


def nobody(_sentence: str) -> bool:
    """Hands of a twin: what a person would be asked for is done already."""
    return True


@dataclass(frozen=True, kw_only=True, eq=False)
class RigAtHand:
    """A rig that experiments are made on.

    Attributes
    ----------
    file : RigFile
    model, truth : Rig
        As its owner describes it, and what a twin truly is; the same of hardware.
    ask : callable
        Asks a person for something, in a sentence; answers whether it was done.
    watching : callable
        Opens a view for a run: a callable that is shown how it goes, and answers with a sentence to end it.
    """

    file: RigFile
    model: Rig
    truth: Rig
    ask: Callable[[str], bool] = nobody
    watching: Callable[[], AbstractContextManager[Watch]] = nobody_watches

    @cached_property
    def make(self) -> Make | None:
        """The make that RIG.toml or the description says it is of; a rig of one's own is of none."""
        if self.file.known is None:
            return MAKES[self.file.make]
        known = read_stored_rig(self.file.known)
        return make_of_vendor(self.file.vendor or known.hardware.vendor, known.plant)

    @property
    def names(self) -> list[str]:
        """Coordinates, in the plant's order."""
        return [c.name for c in self.model.plant.coordinates]

    @property
    def resting(self) -> str:
        """Equilibrium at which the encoders are zeroed."""
        kinds = self.model.plant.equilibria
        return self.file.zero if self.file.zero in kinds else next(iter(kinds))

    @property
    def true_values(self) -> dict[str, float]:
        """Numbers of a twin by name, `actuator.*` included; empty of hardware, whose nobody knows."""
        return {} if self.file.hardware else {**self.truth.plant.parameters(), **self.truth.drive}

    @property
    def text(self) -> str:
        """What is said of it: RIG.toml, and what describes the rig."""
        known = self.file.known
        return read_text(self.file.path) + ("" if known is None else read_text(known))

    @property
    def source(self) -> str:
        """Where its data come from, as a sentence."""
        if self.file.hardware:
            return f"Measured on {self.model.name}: {self.file.kind} {self.file.port}".rstrip() + "."
        return "A digital twin behind the protocol of rigs, run as hardware is; none was touched."

    def requested(self, sentence: str) -> None:
        """Ask a person for something.

        Raises
        ------
        RigStopped
            When it was not done.
        """
        if not self.ask(sentence):
            raise RigStopped(f"This was asked for and not done: {sentence}")

    def put_out(
        self, samples: Sequence[float], folder: Path, stem: str, *, lifted: float = 0.0, bolted: float = 0.0
    ) -> Path:  # fmt: skip
        """Log of a signal put out blindly, a sample each period, from rest.

        Parameters
        ----------
        samples : sequence of float
            [command unit].
        folder, stem
            Where the log goes.
        lifted : float
            How far a hand lifts the last coordinate before it lets go; done for a twin here, by a person else.
        bolted : float
            Inertia that a hand adds to the first body [kg or kg m^2]; likewise.

        Raises
        ------
        RigStopped
            When it did not run to its end.
        KeyboardInterrupt
            When somebody stopped it.
        """
        wish = RunRequest(
            rig=self.file.path, samples=tuple(samples), seconds=len(samples) * self.model.period, tilt=lifted,
            bolted=bolted, check=False, watch=False, stem=stem,
        )  # fmt: skip
        done = self._run(wish, folder)
        if done.end.stopped:
            raise RigStopped(done.end.stopped)
        return done.log_path

    def hold(
        self, law: Law | Rule, folder: Path, stem: str, seconds: float, *, tilt: float = 0.0, from_rest: bool = False
    ) -> RigRun:  # fmt: skip
        """A run of a law, with the pulse before it and the filters beside it; a twin's hand lets go at the `tilt`.

        What begins `from_rest` has no filters beside it, and may lean as it will.

        Raises
        ------
        RigStopped
            When no loop began.
        KeyboardInterrupt
            When somebody stopped it.
        """
        folder.mkdir(parents=True, exist_ok=True)
        path = write_json(folder / f"law_{stem}.json", as_values(law))
        wish = RunRequest(
            rig=self.file.path, law=path, seconds=seconds, stem=stem, tilt=tilt, from_rest=from_rest,
        )  # fmt: skip
        done = self._run(wish, folder)
        if done.log is None or len(done.log) < 3:
            raise RigStopped(done.end.stopped)
        return done

    def _run(self, wish: RunRequest, folder: Path) -> RigRun:
        with self.watching() as watch:
            done = run_rig(wish, folder, watch=watch)
        if done.end.faults & Fault.STOP:
            raise KeyboardInterrupt
        return done

    def described_by(self, fit: Path, path: Path) -> RigAtHand:
        """The same rig described by a fit; its RIG.toml is written to `path`."""
        self.file.with_fit(fit, path)
        return rig_at_hand(path, self.ask, self.watching)


def trial_of(done: RigRun, at: str, origin: Sequence[float] | None = None) -> Trial:
    """A logged run as a trial, its time from where the loop began: states are the readings and their differences,
    counted from what was held, or from the readings of an origin.
    """
    assert done.log is not None
    t, away = done.t, done.away
    if origin is not None:
        away = away + np.subtract(done.end.target, origin)
    x = np.empty((t.size, 2 * away.shape[1]))
    point = np.array(list(done.model.plant.equilibrium(at).values()))
    x[:, 0::2], x[:, 1::2] = away + point, np.gradient(away, t, axis=0)
    u: Array = done.log.columns["u_applied"]
    signals = {c.name: x[:, 2 * i] for i, c in enumerate(done.model.plant.coordinates)}
    record = done.log.record()
    shown = record.replace(t=t, signals={n: signals.get(n, v) for n, v in record.signals.items()})
    return Trial(rig=done.model, at=at, t=t, x=x, u=u, rest=point, record=shown)


def rig_at_hand(
    path: Path, ask: Callable[[str], bool] = nobody,
    watching: Callable[[], AbstractContextManager[Watch]] = nobody_watches,
) -> RigAtHand:  # fmt: skip
    """The rig of a RIG.toml.

    Raises
    ------
    BadInput
        When it is one on which nothing can be tried, or what keeps a log is not installed.
    """
    library()
    file = read_rig_file(path)
    if file.performed == REPLAYED:
        raise BadInput(
            f'{path}: a replay answers nothing that is asked of it; experiments need a rig or kind = "twin".'
        )
    model, truth = described(file)
    units = {c.name: c.unit for c in model.plant.coordinates}
    if file.hardware and file.limits(units, model.unit) is None:
        raise BadInput(
            f"{path}: hardware is not driven without limits; write [limits] with command, and "
            f"[limits.{next(iter(units))}] with travel, speed and start."
        )
    return RigAtHand(
        file=file, model=model, truth=replace(truth, name=model.name), ask=ask if file.hardware else nobody,
        watching=watching,
    )  # fmt: skip
