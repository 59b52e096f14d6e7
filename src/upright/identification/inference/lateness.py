"""Does a drive act later than its command says? What a dead time outside the model would explain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from upright.identification.inference.considered import considered
from upright.identification.inference.covariance import Optimum, assess
from upright.identification.inference.scoring import score_run
from upright.identification.model.grey_box import Parameter
from upright.identification.search.descent import descend

LATEST = 0.2
"""Longest dead time [s] that is looked for."""

PROMISED = 0.3
"""Share of the cost that a dead time must take away to first order before it is fitted: fits then took away as much."""

MENDED = 0.8
"""Share of what was missed that may be missed with it."""

FITTED, NEAR = 40, 0.02
"""Evaluations for that fit, and the longest dead time [s] it begins with: a far one throws a swing out of phase."""

DELAY, LAG = "actuator.delay", "actuator.lag"


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
    rig = problem.rig
    stated = any(p.estimate or p.value for n, p in rig.parameters.items() if n in (DELAY, LAG))
    if stated or not any(np.any(track.u) or track.run.loop is not None for track in problem.tracks):
        return None
    late = considered(best, Parameter(name=DELAY, value=0.0, unit="s", estimate=True, lower=0.0, upper=LATEST))
    if late is None or not late.share > PROMISED:
        return None
    wider, z = late.problem, np.append(late.x[:-1], min(late.x[-1], NEAR))
    end = descend(wider.normal, z, wider.lower, wider.upper, tolerance=1e-6, limit=FITTED)
    if end.normal.cost > MENDED**2 * late.cost:
        return None
    assessed = assess(wider, end.x)
    if assessed.lost:
        return None
    delay, error = end.x[-1], assessed.quantile * assessed.sigma[-1]
    if not 0 < error < delay:
        return None
    before, after = (
        {
            (track.run.label, s): p
            for i, track in enumerate(of.tracks)
            for s, p in score_run(of, i, at).fit_percent.items()
        }
        for of, at in ((problem, x), (wider, end.x))
    )
    run, signal = worst = min(before, key=lambda key: before[key])
    half = best.quantile * best.sigma
    bent = tuple(
        u.name
        for i, u in enumerate(problem.unknowns)
        if u.shared and u.estimated and abs(end.x[i] - x[i]) > half[i] > 0
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
