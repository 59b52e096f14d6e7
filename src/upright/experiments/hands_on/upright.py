"""Experiment 2 at a rig: the pole sets that are expected to hold are run on it, one after the other.

A person brings the pendulum up and lets go; from there supervisor, log and verdict are those of every run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from upright.control import score
from upright.control.preflight import Preflight
from upright.experiments.hands_on.rig import RigAtHand, trial_of
from upright.experiments.regulation_2.run import SETS, Came, Regulation, RegulationRequest, run_regulation
from upright.gains.requests import Roots, read_poles
from upright.laws import Law
from upright.progress import Progress
from upright.report.symbols import typed
from upright.rig import Rig
from upright.rig.completion import completed
from upright.rig.makes import MAKES
from upright.rigs.protocol import Fault
from upright.running.run import RigRun
from upright.study.stored_rig import read_stored_rig

TILT = math.radians(4)
"""How far from upright a person lets go, and a twin's hand does."""
SECONDS = 10.0
AT_LEAST = 0.5
"""Chance of being held below which a set is not run: what falls hits something."""


@dataclass(frozen=True, kw_only=True, eq=False)
class _Trier:
    """Runs laws on the rig."""

    rig: RigAtHand
    folder: Path

    def __call__(self, name: str, law: Law, before: Preflight) -> Came | None:
        if before.chance < AT_LEAST:
            return None
        self.rig.requested(
            f"Next is {name}, predicted probability of stabilisation {100 * before.chance:.0f} %. Let "
            f"{self.rig.names[-1]} hang at rest; after a small pulse bring it up with {self.rig.names[0]} in the "
            "middle of its travel, hold both there until the loop takes them, and let go."
        )
        done = self.rig.hold(law, self.folder, f"regulation_{name.replace(' ', '_')}", SECONDS, tilt=TILT)
        return came(done)


def came(done: RigRun) -> Came:
    """A run on a rig as a trial with its figures."""
    went = trial_of(done, "inverted")
    found = score(went)
    if done.end.stopped:  # by the supervisor, before it could hit anything
        end = float(went.t[-1])
        lost = {"ran_out": end} if done.end.faults & Fault.OVERTRAVEL else {"fell": end}
        found = replace(found, settled=math.inf, **lost)
    return Came(trial=went, score=found, ended=done.end.stopped)


def sets(rig: RigAtHand, known: Rig) -> Mapping[str, Roots]:
    """Pole sets of Table 1 for a maker's rig; for one of one's own all of them as much faster as it falls faster."""
    printed = {name: read_poles(text) for name, text in SETS.items()}
    if rig.make is not None:
        return printed
    falls = [float(p.linear("inverted").poles().real.max()) for p in (known.plant, MAKES["furuta"].plant)]
    return {f"{name} x{falls[0] / falls[1]:.2g}": falls[0] / falls[1] * p for name, p in printed.items()}


def run_upright(
    rig: RigAtHand, fit: Path, seed: int, folder: Path, progress: Progress, stopped: Callable[[], bool]
) -> Regulation:  # fmt: skip
    """Design with a fit and run on the rig; leaves `rig.toml`, laws and logs.

    Raises
    ------
    RigStopped
        When a run did not begin.
    """
    held = rig.described_by(fit, folder / "rig.toml")
    known = completed(read_stored_rig(fit, seed=seed), vendor=rig.file.vendor, who="a run on a rig", form="")
    wish = RegulationRequest(poles=sets(rig, known), tilt=TILT, push=0.0, seconds=SECONDS)
    return run_regulation(
        known, None, seed, folder, progress, stopped, wish, typed(fit), tried=_Trier(rig=held, folder=folder)
    )  # fmt: skip
