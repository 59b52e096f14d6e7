"""What a model leaves out and the runs show: a constant force, friction, a drive that acts late.

A frame that is not level, an amplifier's offset, a cable that pulls: none of it is in most models, and the others then
take its part, friction first, as well in this run as it can be done, and differently in the next. So do viscous terms
with dry friction that nobody asked for, until a run has other speeds. So each is a considered parameter (Schmidt 1966;
Tapley, Schutz and Born, Statistical Orbit Determination, 2004, section 6.5), whose effect the covariance of the
estimates has to hold: where the runs show it beyond two standard errors, every interval holds the estimate with it, and
bands what it does to a prediction.

On carts with flaws that their models lack a constant force was there in 6 of 6, 2 to 6 standard errors large, and moved
dry friction by up to 1.5 half intervals. Of flawed rigs whose models had no dry friction the cost fell to a third or
less with it, of those that had it to four fifths at least.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.intervals import Intervals, beside_bound, estimate, within_bounds
from upright.identification.inference.scoring import score_run
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Estimate
from upright.identification.model.grey_box import NOISE, Parameter, neutral
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import formulate
from upright.identification.search.descent import descend
from upright.identification.search.starts import viscous_terms

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Considered:
    """The optimum with the number, its last, and what share of the cost it leaves."""

    optimum: Optimum
    leaves: float


def is_driven(best: Optimum) -> bool:
    """Whether anything drives one of the fitted runs."""
    return any(np.any(track.u) or track.run.loop is not None for track in best.problem.tracks)


def consider(
    best: Optimum, parameter: Parameter, *, share: float, tolerance: float, limit: int, farthest: float = math.inf
) -> Considered | None:
    """The optimum beside a number that is zero in the model.

    None where it would take away less than a `share` of the cost to first order, or only beyond its bounds.
    `farthest` is the largest value with which the fit begins.
    """
    problem = best.problem
    wider = problem.beside(parameter)
    number = wider.unknowns[-1]
    z = np.append(best.x, 0.0)
    here = wider.settle_steps(z)
    free = np.append(~best.pinned, False)
    aside = here.matrix[-1, free] @ pseudo_inverse(here.matrix[np.ix_(free, free)])
    slope = float(here.gradient[-1] - aside @ here.gradient[free])
    curvature = float(here.matrix[-1, -1] - aside @ here.matrix[free, -1])
    if not curvature > 0 or not slope**2 > share * here.cost * curvature:
        return None
    z[-1] = np.clip(-slope / curvature, max(number.lower, -farthest), min(number.upper, farthest))
    if z[-1] == 0:
        return None
    end = descend(wider.normal, z, wider.lower, wider.upper, tolerance=tolerance, limit=limit)
    if end.interrupted:
        raise KeyboardInterrupt
    return Considered(optimum=assess(wider, end.x), leaves=end.normal.cost / here.cost)


OFFSET = "actuator.offset"

FELT = 0.05
"""Share of the cost that a force must take away to first order before it is fitted."""

SHOWN = 2.0
"""Standard errors from which on it counts as there: one right model in twenty then has intervals that are too wide."""

HALVED = 0.5
"""Share of the cost that may be left with friction, which a right model never lowers so far: its levels are sought
from zero, where whatever else is missing may look a little like it."""


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
    derived = best.problem.rig.plant.derived()
    forces = (
        _constant_force(best),
        *(_friction(best, j.coulomb, "dry") for j in derived.joints),
        *(_friction(best, name, "viscous") for name in viscous_terms(derived)),
    )
    return tuple(force for force in forces if force is not None)


def _constant_force(best: Optimum) -> Neglected | None:
    problem = best.problem
    own = any(t.ahead or "input_offset" in (*t.run.unknown, *t.run.shared) for t in problem.tracks)
    if not is_driven(best) or own:
        return None
    limit = problem.rig.parameters.get("actuator.limit")
    parameter = Parameter(name=OFFSET, value=0.0, unit="1" if limit is None else limit.unit, estimate=True)
    means = "a constant force that the model leaves out, as of a tilted frame or an offset of the command, "
    return _shown(best, parameter, means, left=1.0)


def _friction(best: Optimum, name: str, kind: str) -> Neglected | None:
    plant = best.problem.rig.plant
    if not name or neutral(plant, name) != 0 or any(track.ahead for track in best.problem.tracks):
        return None
    quantity = plant.quantity(name)
    parameter = Parameter(name=name, value=0.0, unit=quantity.unit, estimate=True, lower=0.0)
    means = f"{kind} friction that the model leaves out, {name} ({quantity.meaning}) = "
    return _shown(best, parameter, means, HALVED)


def _shown(best: Optimum, parameter: Parameter, means: str, left: float) -> Neglected | None:
    """A force that the model has at nothing, where the runs show it and at most the share `left` of the cost stays."""
    problem, name = best.problem, parameter.name
    stated = problem.rig.parameters.get(name)
    idle = neutral(problem.rig.plant, name)
    if stated is not None and (stated.estimate or stated.assumed or stated.uncertainty or stated.value != idle):
        return None
    force = consider(best, parameter, share=FELT, tolerance=1e-4, limit=12)
    if force is None or force.leaves > left:
        return None
    there = force.optimum
    size = estimate(there, best.x.size)
    if there.lost or not abs(size.value) > SHOWN * size.stderr:
        return None
    shared = [i for i in best.shared if not problem.unknowns[i].name.startswith(NOISE)]
    return Neglected(
        name=name, size=size, means=means, essential=left < 1,
        intervals={
            problem.unknowns[i].name: within_bounds(problem.unknowns[i], beside_bound(there, i).interval)
            for i in shared
        },
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


LATEST = 0.2
"""Longest dead time [s] that is looked for."""

PROMISED = 0.3
"""Share of the cost that a dead time must take away to first order before it is fitted: fits then took away as much."""

MENDED = 0.8
"""Share of what was missed that may be missed with it."""

NEAR = 0.02
"""Longest dead time [s] that its fit begins with: a far one throws a swing out of phase."""

DELAY, LAG = "actuator.delay", "actuator.lag"


def together_late(best: Optimum) -> tuple[str, Estimate] | None:
    """Which of dead time and lag of the drive is estimated alone, and the sum of both in a model that has both.

    Slow commands see their sum alone, and the one takes the other's part. None where both are stated, or where the runs
    show that there is no other one.
    """
    problem, names = best.problem, [u.name for u in best.problem.unknowns]
    (name, other) = (DELAY, LAG) if DELAY in names else (LAG, DELAY)
    stated = problem.rig.parameters.get(other)
    if name not in names or any(t.ahead for t in problem.tracks) or (stated and (stated.estimate or stated.value)):
        return None
    half = float(best.values[names.index(name)]) / 2
    second = Parameter(name=other, value=half, unit="s", estimate=True, lower=0.0, upper=LATEST)
    rig = replace(problem.rig, parameters={**problem.rig.parameters, other: second})
    both = formulate(rig, [t.run for t in problem.tracks])
    both.weigh_like(problem)
    x = both.place(problem.values_at(best.x) | {name: half, other: half})
    both.settle_steps(x)
    end = descend(both.normal, x, both.lower, both.upper, tolerance=1e-6, limit=20)
    if end.interrupted:
        raise KeyboardInterrupt
    there = assess(both, end.x)
    places = [[u.name for u in both.unknowns].index(n) for n in (name, other)]
    if there.lost or there.pinned[places[1]]:
        return None
    slope = np.array([there.values[i] if both.unknowns[i].log else 1.0 for i in places])
    total = float(there.values[places].sum())
    error = math.sqrt(slope @ there.covariance[np.ix_(places, places)] @ slope)
    half = best.quantile * error
    return name, Estimate(value=total, stderr=error, interval=(max(0.0, total - half), total + half), unit="s")


@dataclass(frozen=True, kw_only=True)
class Lateness:
    """A dead time of the drive that would explain what a fit misses: a `sentence` on it and on what it would cost.

    With it the numbers that are `bent` lie outside the intervals that the fit without it tells.
    """

    sentence: str
    bent: tuple[str, ...]


def lateness(best: Optimum) -> Lateness | None:
    """A dead time outside the model.

    None where the drive's dead time or lag is estimated or known already, or nothing is driven.
    """
    problem, x = best.problem, best.x
    stated = any(p.estimate or p.value for n, p in problem.rig.parameters.items() if n in (DELAY, LAG))
    if stated or not is_driven(best):
        return None
    dead_time = Parameter(name=DELAY, value=0.0, unit="s", estimate=True, lower=0.0, upper=LATEST)
    considered = consider(best, dead_time, share=PROMISED, tolerance=1e-6, limit=40, farthest=NEAR)
    if considered is None or considered.leaves > MENDED**2:
        return None
    late = considered.optimum
    if late.lost:
        return None
    delay, error = late.x[-1], late.quantile * late.sigma[-1]
    if not 0 < error < delay:
        return None
    before, after = (
        {
            (track.run.label, s): p
            for i, track in enumerate(of.tracks)
            for s, p in score_run(of, i, at).fit_percent.items()
        }
        for of, at in ((problem, x), (late.problem, late.x))
    )
    run, signal = worst = min(before, key=lambda key: before[key])
    half = best.quantile * best.sigma
    bent = tuple(
        u.name
        for i, u in enumerate(problem.unknowns)
        if u.shared and u.estimated and abs(late.x[i] - x[i]) > half[i] > 0
    )
    cost = f", and moves {', '.join(bent)} out of what the intervals say" if bent else ""
    ms = [f"{1e3 * value:.3g}" for value in (delay, delay - error, delay + error)]
    return Lateness(
        sentence=f"The drive seems to act {ms[0]} ms late ({ms[1]} to {ms[2]}): with that dead time {signal} of run "
        f"'{run}' would be explained to {after[worst]:.1f} % instead of {before[worst]:.1f} %. Ask for it, or for a "
        f'lag, which does much the same: [actuator] delay = {{ guess = "{1e3 * delay:.2g} ms", max = "'
        f'{1e3 * LATEST:.0f} ms" }}.'
        f" It is one number more{cost}.",
        bent=bent,
    )
