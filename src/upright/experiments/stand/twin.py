"""A test stand that is simulated: a twin that starts anywhere and needs nobody beside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.control.trial import logged, steps_in_period, trial
from upright.experiments.stand.stand import APPLIED, StandRun, TestStand
from upright.laws import Law, Rule
from upright.records import Array, Record
from upright.rig import Rig
from upright.simulation import simulate


@dataclass(frozen=True, kw_only=True, eq=False)
class TwinStand(TestStand):
    """A twin as a test stand; its `rig` is as it truly is."""

    attended = False
    starts_anywhere = True
    may_fall = True

    @property
    def exact(self) -> Rig:
        """Itself."""
        return self.rig

    def ask(self, sentence: str) -> None:
        """What a person would do is done by the start of the simulation."""

    def run(
        self, samples: Sequence[float], folder: Path, stem: str, *, lifted: float = 0.0, bolted: float = 0.0
    ) -> Record:  # fmt: skip
        """Log of a signal, from rest; see `TestStand.run`."""
        rig, u = self.rig, np.array(samples, dtype=np.float64)
        if bolted:
            rig = rig.changed(a_1=rig.plant.parameters()["a_1"] + bolted)
        x0 = rig.plant.state(self.resting)
        x0[-2] += lifted
        before = math.ceil(rig.delay / rig.period) + 1 if u[0] and not lifted else 0  # samples at rest, as on a board
        put_out = np.concatenate([np.zeros(before), u[:-1]])
        x = simulate(
            rig.plant, rig.drive, x0, put_out, rig.period, samples=put_out.size + 1, substeps=steps_in_period(rig)
        )[before:, :, 0]  # fmt: skip
        log = logged(rig, np.arange(u.size, dtype=np.float64) * rig.period, x, u)
        record = log.replace(
            signals={n if n != "u" else APPLIED: v for n, v in log.signals.items()},
            units={n if n != "u" else APPLIED: unit for n, unit in log.units.items()}, inputs=(APPLIED,),
        )  # fmt: skip
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{stem}.csv"
        record.to_csv(path)
        return record.replace(provenance=replace(record.provenance, file=path.name))

    def hold(
        self, law: Law | Rule, at: str, folder: Path, stem: str, seconds: float, *, start: Array | None = None,
        reference: Array | None = None, pushes: Array | None = None,
    ) -> StandRun:  # fmt: skip
        """A run of a law to its end, whatever becomes of the twin; see `TestStand.hold`."""
        if start is None:
            start = self.rig.plant.state(self.resting) - self.rig.plant.state(at)
        went = trial(self.rig, law, at=at, start=start, seconds=seconds, reference=reference, pushes=pushes)
        return StandRun(trial=went)

    def described_by(self, fit: Path, folder: Path) -> TwinStand:
        """Itself: nobody watches its runs."""
        return self
