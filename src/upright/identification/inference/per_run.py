"""What came out for single runs and for groups of them, and how far can that be trusted?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Spread
from upright.identification.model.model import Estimate, Rig
from upright.identification.model.unknowns import SHARED, Unknown
from upright.identification.problem.problem import Problem

Array = NDArray[np.float64]

ALREADY = 0.9
"""A number is unseen when the data narrow what was known beforehand to no less than this share of it."""


def quantile(samples: float, unknowns: int) -> float:
    """Student's 97.5 % point for as many independent scores as the residuals' memory leaves."""
    from scipy.special import stdtrit

    return float(stdtrit(max(samples - unknowns, 2.0), 0.975))


def own_estimates(
    problem: Problem, x: Array, spread: Spread
) -> tuple[dict[str, dict[str, Estimate]], dict[str, dict[str, Estimate]]]:
    """Estimates by run and name, and by group and name."""
    value, q = problem.value(x), quantile(spread.samples, x.size)
    runs: dict[str, dict[str, Estimate]] = {t.run.label: {} for t in problem.tracks}
    groups: dict[str, dict[str, Estimate]] = {}
    for i, u in enumerate(problem.unknowns):
        if u.runs == SHARED:
            continue
        sigma = math.sqrt(max(float(spread.covariance[i, i]), 0.0))
        e = estimate(problem, u, float(value[i]), sigma, q)
        e = replace(e, status=_status(u, e, sigma, bool(spread.pinned[i]), seen=float(spread.matrix[i, i]) > 0))
        home = groups.setdefault(u.group, {}) if u.group else runs[problem.tracks[u.runs[0]].run.label]
        home[u.name] = e
    return runs, groups


def _status(u: Unknown, e: Estimate, sigma: float, pinned: bool, *, seen: bool) -> str:
    if pinned:
        return "at bound"
    if not seen or (u.log and u.prior is not None and sigma > ALREADY * u.prior[1]):
        return "unseen"
    size = abs(e.value) if u.log else u.scale
    return "weak" if e.interval[1] - e.interval[0] > size else "firm"


def estimate(problem: Problem, u: Unknown, value: float, sigma: float, q: float) -> Estimate:
    """Value with its standard error and the interval of `q` of them, in the coordinate in which it is sought."""
    if u.log:
        interval = value * math.exp(-min(q * sigma, 700.0)), value * math.exp(min(q * sigma, 700.0))
        stderr = value * sigma
    else:
        interval, stderr = (value - q * sigma, value + q * sigma), sigma
    return Estimate(value=value, stderr=stderr, interval=interval, unit=_unit(problem.rig, u.name), status="firm")


def _unit(rig: Rig, name: str) -> str:
    if name in rig.parameters:
        return rig.parameters[name].unit
    kind, _, which = name.partition(".")
    units = {c.name: c.unit for c in rig.plant.coordinates}
    if kind in ("initial", "offset"):
        return units.get(which) or f"{units.get(which.removesuffix('_dot'), '1')}/s"
    if kind == "input_offset" and "actuator.offset" in rig.parameters:
        return rig.parameters["actuator.offset"].unit
    return "s" if kind in ("input_start", "input_end") else "1"
