"""Rungs: models nested in the requested one, poorest first.

A rung adds terms to what the rungs below estimate; below it a term is held where it does nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from upright.errors import BadInput, nearest
from upright.identification.model.grey_box import GreyBox, neutral
from upright.identification.model.runs import Run
from upright.identification.problem.unknowns import friction_names

DRIVE = (
    ("offset of the drive", ("actuator.offset",)),
    ("dead zone of the drive", ("actuator.dead_zone",)),
    ("lag of the drive", ("actuator.lag", "actuator.delay")),
    ("damping by the drive", ("actuator.slope", "actuator.damping", "actuator.standby", "actuator.relaxation")),
    ("damping that follows the command", ("actuator.damping_rise",)),
    ("gain that falls with the command", ("actuator.droop",)),
    ("limit of the force", ("actuator.force_limit",)),
    ("torque that falls with speed", ("actuator.knee", "actuator.fade")),
    ("end of the drive", ("actuator.start", "actuator.end")),
)
"""Terms of the drive in the order in which they are tried."""


@dataclass(frozen=True, kw_only=True)
class Rung:
    """One step of a ladder, by its name in tables and pictures.

    From this rung on the parameters that it `adds` are estimated, below it they are held where they do nothing; it does
    without those that it `drops`, and what is `unknown` is estimated run by run, as in `Run.unknown`.
    """

    name: str
    adds: tuple[str, ...] = ()
    drops: tuple[str, ...] = ()
    unknown: tuple[str, ...] = ()

    def seeds(self, rig: GreyBox) -> dict[str, float]:
        """Values of what it adds: a tenth of the way from where each term does nothing to its guess."""
        starts = {n: (neutral(rig.plant, n), rig.parameters[n].value) for n in self.adds}
        return {n: low + 0.1 * (guess - low) if math.isfinite(low) else guess for n, (low, guess) in starts.items()}


def rig_at(rig: GreyBox, rungs: Sequence[Rung], accepted: Sequence[Rung]) -> GreyBox:
    """The rig of a place on the ladder: of all that `rungs` add only what the `accepted` ones do."""
    added = {n for rung in rungs for n in (*rung.adds, *rung.drops)}
    estimated = {n for n in added if not any(n in rung.adds for rung in rungs)}  # asked from the beginning
    for rung in accepted:
        estimated |= set(rung.adds)
        estimated -= set(rung.drops)
    return rig.without(added - estimated)


def runs_at(runs: Sequence[Run], accepted: Sequence[Rung]) -> list[Run]:
    """The runs with what the kept rungs estimate run by run."""
    more = tuple(n for rung in accepted for n in rung.unknown)
    return [replace(run, unknown=tuple(dict.fromkeys((*run.unknown, *more)))) for run in runs]


def friction_rungs(rig: GreyBox) -> list[Rung]:
    """Nested friction models within the terms that the rig asks to estimate, poorest first.

    A term that must not be zero, since its lower bound is above, is part of them all.
    """
    estimated = [n for n in rig.estimated if rig.parameters[n].lower <= 0]
    joints = rig.plant.derived().joints
    kinds = [
        ("Coulomb friction", {j.coulomb for j in joints}),
        ("quadratic drag", {j.quadratic for j in joints}),
        ("stiction", {n for j in joints for n in (j.stiction, j.stribeck_speed)}),
        ("presliding", {j.presliding for j in joints}),
    ]
    steps = [(name, tuple(n for n in estimated if n in terms)) for name, terms in kinds]
    return [Rung(name="viscous friction"), *(Rung(name=name, adds=adds) for name, adds in steps if adds)]


def default_rungs(rig: GreyBox, runs: Sequence[Run]) -> list[Rung]:
    """Every ladder that the rig's questions allow: friction first, then the drive, then friction that differs per run.

    The last one needs two runs and some friction.
    """
    friction = friction_rungs(rig)
    rungs = friction if len(friction) > 1 else [Rung(name="as asked")]
    for name, terms in DRIVE:
        adds = tuple(n for n in rig.estimated if n in terms)
        if adds:
            rungs.append(Rung(name=name, adds=adds))
    fitted = [run for run in runs if run.role == "fit"]
    varies = any("friction" in (*run.unknown, *run.shared) for run in fitted)
    if len(fitted) > 1 and not varies and any(_present(rig, n) for n in friction_names(rig)):
        rungs.append(Rung(name="friction of each run", unknown=("friction",)))
    return rungs


def _present(rig: GreyBox, name: str) -> bool:
    p = rig.parameters.get(name)
    return p is not None and (p.estimate or (p.value != 0 and math.isfinite(p.value)))


def check_rungs(rig: GreyBox, rungs: Sequence[Rung]) -> None:
    """Refuse rungs that add what was not requested, or the same term twice."""
    added: set[str] = set()
    for rung in rungs:
        for n in (*rung.adds, *rung.drops):
            if n not in rig.estimated:
                raise BadInput(
                    f"rung '{rung.name}' names {n}, which nothing asks for; give it a guess, or name another: "
                    f"{nearest(n, rig.estimated)}"
                )
        twice = [n for n in rung.adds if n in added]
        if twice:
            raise BadInput(f"rung '{rung.name}' adds {twice[0]} a second time; name it in one rung only")
        added |= set(rung.adds)
