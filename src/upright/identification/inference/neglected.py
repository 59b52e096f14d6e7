"""Forces that the model leaves out, one constant or dry friction: how large they are, and what they would change.

A frame that is not level, an amplifier's offset, a cable that pulls: none of it is in most models, and the others then
take its part, friction first, as well in this run as it can be done, and differently in the next. So do viscous terms
with dry friction that nobody asked for, until a run has other speeds. So each is considered: where the runs show it
beyond two standard errors every interval holds the estimate with it, and bands what it does to a prediction.

On carts with flaws that their models lack a constant force was there in 6 of 6, 2 to 6 standard errors large, and moved
dry friction by up to 1.5 half intervals. Of flawed rigs whose models had no dry friction the cost fell to a third or
less with it, of those that had it to four fifths at least.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.considered import considered
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.intervals import Intervals, beside_bound, estimate
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Estimate
from upright.identification.model.grey_box import NOISE, Parameter, neutral
from upright.identification.search.descent import descend

Array = NDArray[np.float64]

OFFSET = "actuator.offset"

FELT = 0.05
"""Share of the cost that a force must take away to first order before it is fitted."""

SHOWN = 2.0
"""Standard errors from which on it counts as there: one right model in twenty then has intervals that are too wide."""

HALVED = 0.5
"""Share of the cost that may be left with dry friction, which a right model never lowers so far: its levels are sought
from zero, where whatever else is missing may look a little like it."""

FITTED = 12
"""Evaluations for that fit, which begins where it is nearly done."""


@dataclass(frozen=True, kw_only=True)
class Neglected:
    """A force `name` of a certain `size`, what it `means`, and the `intervals` of the shared numbers beside it.

    `names` are the numbers whose values it moves by `moves` (n,), natural units, when it is what it is. Without it the
    model lacks what its runs show where the force is `essential`.
    """

    name: str
    size: Estimate
    means: str
    essential: bool
    intervals: Intervals
    names: tuple[str, ...]
    moves: Array

    def sentence(self) -> str:
        """How large it is, what holds it, and how to ask for it."""
        e = self.size
        low, high = e.interval
        unit = "" if e.unit in ("", "1") else f" {e.unit}"
        table, _, key = self.name.rpartition(".")
        return (
            f"The runs show {self.means}{e.value:.2g}{unit} ({low:.2g} to {high:.2g}). Intervals and bands hold what "
            f'it would change. Ask for it: [{table or "parameters"}] {key} = {{ guess = "{e.value:.2g}{unit}" }}.'
        )


def neglected(best: Optimum) -> tuple[Neglected, ...]:
    """The forces that the runs show; none that is asked for, or known, or not to be seen, or not there."""
    forces = (_constant_force(best), *(_dry_friction(best, j.coulomb) for j in best.problem.rig.plant.derived().joints))
    return tuple(force for force in forces if force is not None)


def _constant_force(best: Optimum) -> Neglected | None:
    problem = best.problem
    driven = any(np.any(track.u) or track.run.loop is not None for track in problem.tracks)
    own = any(t.ahead or "input_offset" in (*t.run.unknown, *t.run.shared) for t in problem.tracks)
    if not driven or own:
        return None
    limit = problem.rig.parameters.get("actuator.limit")
    parameter = Parameter(name=OFFSET, value=0.0, unit="1" if limit is None else limit.unit, estimate=True)
    means = "a constant force that the model leaves out, as of a tilted frame or an offset of the command, "
    return _shown(best, parameter, means, left=1.0)


def _dry_friction(best: Optimum, name: str) -> Neglected | None:
    if not name or any(track.ahead for track in best.problem.tracks):
        return None
    quantity = best.problem.rig.plant.quantity(name)
    parameter = Parameter(name=name, value=0.0, unit=quantity.unit, estimate=True, lower=0.0)
    return _shown(best, parameter, f"dry friction that the model leaves out, {name} ({quantity.meaning}) = ", HALVED)


def _shown(best: Optimum, parameter: Parameter, means: str, left: float) -> Neglected | None:
    """A force that the model has at nothing, where the runs show it and at most the share `left` of the cost stays."""
    problem, x, name = best.problem, best.x, parameter.name
    stated = problem.rig.parameters.get(name)
    idle = neutral(problem.rig.plant, name)
    if stated is not None and (stated.estimate or stated.assumed or stated.uncertainty or stated.value != idle):
        return None
    force = considered(best, parameter)
    if force is None or not force.share > FELT:
        return None
    wider = force.problem
    end = descend(wider.normal, force.x, wider.lower, wider.upper, tolerance=1e-4, limit=FITTED)
    if end.interrupted:
        raise KeyboardInterrupt
    if not end.normal.cost <= left * force.cost:
        return None
    there = assess(wider, end.x)
    size = estimate(there, x.size)
    if there.lost or not abs(size.value) > SHOWN * size.stderr:
        return None
    shared = [i for i in best.shared if not problem.unknowns[i].name.startswith(NOISE)]
    return Neglected(
        name=name, size=size, means=means, essential=left < 1,
        intervals={problem.unknowns[i].name: beside_bound(there, i).interval for i in shared},
        names=tuple(problem.unknowns[i].name for i in shared),
        moves=(there.values[:-1] - best.values)[shared],
    )  # fmt: skip


def with_force(bands: Bands, force: Neglected) -> Bands:
    """Bands that hold what the force does to a prediction, by itself and through the numbers that it moves."""
    together: Mapping[str, float] = dict(zip(force.names, force.moves, strict=True))
    step = np.append([together.get(n, 0.0) for n in bands.names], force.size.value)
    C = np.zeros((step.size, step.size))
    C[:-1, :-1] = bands.covariance
    C[-1, -1] = force.size.stderr**2
    return replace(bands, names=(*bands.names, force.name), covariance=C + np.outer(step, step))
