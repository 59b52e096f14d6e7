"""A constant force that the model leaves out: how large the runs say it is, and what it would change.

A frame that is not level, an amplifier's offset, a cable that pulls: none of it is in most models, and the others then
take its part, friction first, as well in this run as it can be done, and differently in the next. So it is a
considered parameter, whose effect the covariance of the estimates has to hold: where the runs show it beyond two
standard errors, every interval holds the estimate with it, and bands what it does to a prediction. On carts with flaws
that their models lack it was there in 6 of 6, 2 to 6 standard errors large, and moved dry friction by up to 1.5 half
intervals.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.considered import consider, is_driven
from upright.identification.inference.covariance import Optimum
from upright.identification.inference.intervals import Intervals, beside_bound, estimate
from upright.identification.model.bands import Bands
from upright.identification.model.fit import Estimate
from upright.identification.model.grey_box import NOISE, Parameter

Array = NDArray[np.float64]

OFFSET = "actuator.offset"

FELT = 0.05
"""Share of the cost that it must take away to first order before it is fitted."""

SHOWN = 2.0
"""Standard errors from which on it counts as there: one right model in twenty then has intervals that are too wide."""

FITTED = 8
"""Evaluations for that fit, which begins where it is nearly done."""


@dataclass(frozen=True, kw_only=True)
class Neglected:
    """The `force`, as an offset of the command, and the `intervals` of the shared numbers beside it.

    `names` are the numbers whose values it moves by `moves` (n,), natural units, when it is what it is.
    """

    force: Estimate
    intervals: Intervals
    names: tuple[str, ...]
    moves: Array

    def sentence(self) -> str:
        """How large it is, what holds it, and how to ask for it."""
        e = self.force
        low, high = e.interval
        unit = "" if e.unit in ("", "1") else f" {e.unit}"
        return (
            f"The runs show a constant force that the model leaves out, as of a command of {e.value:.2g}{unit} "
            f"({low:.2g} to {high:.2g}): a frame that is not level, an amplifier's offset, a cable. Intervals and "
            f'bands hold what it would change. Ask for it: [actuator] offset = {{ guess = "{e.value:.2g}{unit}" }}.'
        )


def neglected(best: Optimum) -> Neglected | None:
    """The constant force that the runs show; None where it is asked for, or known, or not to be seen, or not there."""
    problem = best.problem
    stated = problem.rig.parameters.get(OFFSET)
    own = any(t.ahead or "input_offset" in (*t.run.unknown, *t.run.shared) for t in problem.tracks)
    if not is_driven(best) or own or (stated is not None and (stated.estimate or stated.assumed or stated.value != 0)):
        return None
    limit = problem.rig.parameters.get("actuator.limit")
    offset = Parameter(name=OFFSET, value=0.0, unit="1" if limit is None else limit.unit, estimate=True)
    considered = consider(best, offset, share=FELT, tolerance=1e-4, limit=FITTED)
    if considered is None:
        return None
    there = considered.optimum
    size = estimate(there, best.x.size)
    if there.lost or not abs(size.value) > SHOWN * size.stderr:
        return None
    shared = [i for i in best.shared if not problem.unknowns[i].name.startswith(NOISE)]
    intervals = {problem.unknowns[i].name: beside_bound(there, i).interval for i in shared}
    return Neglected(
        force=size, intervals=intervals, names=tuple(problem.unknowns[i].name for i in shared),
        moves=(there.values[:-1] - best.values)[shared],
    )  # fmt: skip


def with_force(bands: Bands, force: Neglected) -> Bands:
    """Bands that hold what the force does to a prediction, by itself and through the numbers that it moves."""
    together: Mapping[str, float] = dict(zip(force.names, force.moves, strict=True))
    step = np.append([together.get(n, 0.0) for n in bands.names], force.force.value)
    C = np.zeros((step.size, step.size))
    C[:-1, :-1] = bands.covariance
    C[-1, -1] = force.force.stderr**2
    return replace(bands, names=(*bands.names, OFFSET), covariance=C + np.outer(step, step))
