"""The decision whether a richer model has earned its place: held-out errors compared run by run or stretch by stretch.

The measure is the logarithm of the error (what is missed over how much the signal moves, as in the fit percent), so
that halving an error counts the same wherever it happens. A richer model is kept when the mean of the paired
improvements exceeds one standard error of that mean, with Student's factor for so few of them: the one-standard-error
rule of cross-validation (Breiman and others 1984), paired. The pairs are the runs left out; with fewer than three runs
they are stretches of what was held out, each longer than the residuals are autocorrelated. Stretches share one fit and
so its luck: the fit itself, too, has to be closer than chance makes it (`by_chance`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.fit import RunScore
from upright.signals.memory import memory

Array = NDArray[np.float64]

ONE_SIGMA = 0.8413447460685429
"""Probability below one standard deviation of a normal distribution."""

CHANCE = 0.05
"""A fit is closer than chance if terms that do nothing come as close less often than this."""

STRETCHES = (4, 12)
"""Fewest and most stretches that a run is cut into."""

LOST = 11.0
"""Error of a simulation that ran away: the least fit percent there is, -1000."""


@dataclass(frozen=True, kw_only=True)
class RungComparison:
    """Held-out improvement of one model over another.

    `gain` is the mean decrease of the logarithm of the error, positive when the richer model predicts better, `scatter`
    what it has to exceed: its standard error times Student's factor. `pairs` differences `between` runs or stretches
    stand behind both.
    """

    gain: float
    scatter: float
    pairs: int
    between: str

    @property
    def better(self) -> bool:
        """Whether the richer model has earned its place."""
        return self.gain > self.scatter

    def sentence(self) -> str:
        """How much the held-out error changes, and by how much that scatters."""
        change, best, worst = (100 * math.expm1(-g) for g in (self.gain, self.gain + self.scatter,
                                                              self.gain - min(self.scatter, 9.0)))  # fmt: skip
        if max(abs(best), abs(worst)) < 0.05:
            return "the held-out error stays as it is"
        middle, low, high = (f"{v:+.1f}".replace("-", "−") for v in (change, best, worst))
        return (
            f"the held-out error changes by {middle} % ({low} to {high} % within one standard error over "
            f"{self.pairs} {self.between})"
        )


def compare_rungs(poorer: Sequence[RunScore], richer: Sequence[RunScore], quanta: Sequence[Array]) -> RungComparison:
    """Compare two models on what neither has seen.

    Parameters
    ----------
    poorer, richer : sequence of RunScore
        Predictions of the same runs.
    quanta : sequence of (outputs,) arrays
        Resolution of the signals of each run; no error counts as less than what rounding leaves.
    """
    if len(poorer) >= 3:
        gains = np.array([_run_gain(a, b, q) for a, b, q in zip(poorer, richer, quanta, strict=True)])
        between = "runs"
    else:
        gains = np.concatenate([_stretch_gains(a, b, q) for a, b, q in zip(poorer, richer, quanta, strict=True)])
        between = "stretches"
    return RungComparison(gain=float(gains.mean()), scatter=gain_scatter(gains), pairs=gains.size, between=between)


def by_chance(terms: int, noise: float) -> float:
    """By how much `terms` more numbers that mean nothing lower the cost of a fit, but for one time in twenty.

    Chi squared, as many degrees as terms, in units of the squared `noise_level` of one independent residual.
    """
    from scipy.special import chdtri

    return float(chdtri(terms, CHANCE)) * noise**2 if terms > 0 else 0.0


def gain_scatter(gains: Array) -> float:
    """One standard error of the mean of independent gains (n,), as Student's distribution gives it for so few."""
    from scipy.special import stdtrit

    if gains.size < 2:
        return math.inf
    return float(stdtrit(gains.size - 1, ONE_SIGMA) * gains.std(ddof=1) / math.sqrt(gains.size))


def _free(score: RunScore) -> list[int]:
    return [k for k, n in enumerate(score.measured) if n in score.fit_percent]


def _scored(score: RunScore) -> slice:
    """Samples that count."""
    return slice(int(np.searchsorted(score.t, score.t[0] + score.score_from - 1e-9)), score.t.size)


def _error(y: Array, simulated: Array, size: float, resolution: float) -> float:
    """Root mean square of what is missed over the signal's spread, rounding included."""
    with np.errstate(over="ignore", invalid="ignore"):
        missed = float(np.mean((y - simulated) ** 2))
    least = resolution**2 / 12 + (1e-9 * size) ** 2
    return min(math.sqrt(missed + least) / size, LOST) if math.isfinite(missed) else LOST


def _run_gain(poorer: RunScore, richer: RunScore, quanta: Array) -> float:
    """Mean over the signals of one run."""
    here = _scored(poorer)
    gains = [_signal_gain(poorer, richer, k, here, quanta[k]) for k in _free(poorer)]
    return float(np.mean(gains)) if gains else 0.0


def _signal_gain(poorer: RunScore, richer: RunScore, k: int, here: slice, resolution: float) -> float:
    size = float(np.std(poorer.y[_scored(poorer), k]))
    if size == 0:
        return 0.0
    a, b = (_error(s.y[here, k], s.simulated[here, k], size, resolution) for s in (poorer, richer))
    return math.log(a / b)


def _stretch_gains(poorer: RunScore, richer: RunScore, quanta: Array) -> Array:
    """Mean over the signals in each of the stretches that a run is cut into."""
    here = _scored(poorer)
    n, free = here.stop - here.start, _free(poorer)
    rest = np.nan_to_num((poorer.y - poorer.simulated)[here][:, free])
    dt = float(np.mean(np.diff(poorer.t)))
    # four memories long: what one stretch says is then news to a share of 3/4 or more
    pieces = int(np.clip(n * dt / max(4 * memory(rest, dt), dt), *STRETCHES))
    edges = here.start + np.linspace(0, n, pieces + 1).astype(int)
    cuts = [slice(int(a), int(b)) for a, b in pairwise(edges) if b > a]
    return np.array([[_signal_gain(poorer, richer, k, cut, quanta[k]) for k in free] for cut in cuts]).mean(axis=1)


def reason(comparison: RungComparison | None, cost: float, before: float, *, lucky: bool = False) -> str:
    """Why a rung is kept or refused, in a sentence; `cost` and `before` are of its fit and the poorer one's.

    A `lucky` fit is no closer than numbers that mean nothing would make it.
    """
    if comparison is None:
        return "The first rung: where the ladder starts."
    words = comparison.sentence()
    if lucky:
        return f"Refused: the fit is no closer than chance makes it; {words}."
    if comparison.better:
        return f"Kept: {words}."
    closer = 1 - math.sqrt(cost / before) if before > 0 else 0.0
    if comparison.gain <= 0 and closer > 0.03:
        return (
            f"Refused: {words}, although the fit is {100 * closer:.3g} % closer: it explains what does not come back."
        )
    return f"Refused: {words}."


def stalled(name: str, cost: float, before: float) -> str:
    """The warning that a richer model was fitted worse than the poorer one that it contains."""
    return (
        f"With {name} the runs were fitted worse (cost {cost:.6g} against {before:.6g}); a richer model that contains "
        "the poorer one never should be, so the search stalled; try better guesses."
    )
