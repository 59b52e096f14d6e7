"""Did people rate themselves higher afterwards? Paired t and Wilcoxon's signed ranks, effect sizes, intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]

EXACT = 200
"""Pairs up to which Wilcoxon's distribution is summed exactly, ties and all."""


@dataclass(frozen=True, kw_only=True)
class Paired:
    """Ratings of the same people before and after.

    Attributes
    ----------
    n, missing : int
        Pairs, and people without one of the two answers.
    pre, post, gain, spread : float
        Means, their difference, and the standard deviation of single gains.
    interval : (float, float)
        95 % interval of the mean gain, Student's.
    t, p : float
        Paired t and its two-sided probability; NaN when all gains are alike.
    signed_rank, p_ranks : float
        Wilcoxon's smaller rank sum, zeros dropped and ties given middle ranks, and its two-sided probability.
    effect : float
        Cohen's d of single gains, ``gain/spread``.
    effect_interval : (float, float)
        Its 95 % interval, from the noncentral t.
    ranks_effect : float
        Share of rank sums upwards minus share downwards, -1 to 1.
    normalized : float
        Gain over what the scale left to gain (Hake); NaN when nothing was left.
    """

    n: int
    missing: int
    pre: float
    post: float
    gain: float
    spread: float
    interval: tuple[float, float]
    t: float
    p: float
    signed_rank: float
    p_ranks: float
    effect: float
    effect_interval: tuple[float, float]
    ranks_effect: float
    normalized: float


def compare(pre: ArrayLike, post: ArrayLike, *, top: float = 4.0) -> Paired:
    """Ratings before (n,) and after (n,) of the same people, NaN where an answer is missing.

    Raises
    ------
    BadInput
        When fewer than two people answered both times.
    """
    from scipy.special import nctdtrinc
    from scipy.stats import t as student

    before, after = np.asarray(pre, dtype=np.float64), np.asarray(post, dtype=np.float64)
    both = np.isfinite(before) & np.isfinite(after)
    x, y = before[both], after[both]
    n = x.size
    if n < 2:
        raise BadInput(f"A comparison needs at least 2 people who answered before and after, got {n}.")
    d = y - x
    gain, spread = float(d.mean()), float(d.std(ddof=1))
    half = float(student.ppf(0.975, n - 1)) * spread / math.sqrt(n)
    t = p = effect = math.nan
    around = (math.nan, math.nan)
    if spread > 0:
        t = gain / spread * math.sqrt(n)
        p = float(2 * student.sf(abs(t), n - 1))
        effect = gain / spread
        ends = [float(nctdtrinc(n - 1, q, t)) / math.sqrt(n) for q in (0.975, 0.025)]
        around = (ends[0], ends[1])
    up, down, p_ranks = signed_ranks(d)
    left = top - float(x.mean())
    return Paired(
        n=n, missing=int(np.count_nonzero(~both)), pre=float(x.mean()), post=float(y.mean()), gain=gain, spread=spread,
        interval=(gain - half, gain + half), t=t, p=p, signed_rank=min(up, down), p_ranks=p_ranks,
        effect=effect, effect_interval=around, ranks_effect=(up - down) / (up + down) if up + down else 0.0,
        normalized=gain / left if left > 0 else math.nan,
    )  # fmt: skip


def signed_ranks(d: Array) -> tuple[float, float, float]:
    """Wilcoxon's rank sums upwards and downwards and the two-sided probability.

    Zeros are dropped, equal sizes share the middle of their ranks, and every sign is equally likely: the sum over all
    signs is exact up to `EXACT` gains, normal beyond.
    """
    d = d[d != 0]
    if d.size == 0:
        return 0.0, 0.0, 1.0
    from scipy.stats import norm, rankdata

    ranks = rankdata(np.abs(d))
    up, down = float(ranks[d > 0].sum()), float(ranks[d < 0].sum())
    if d.size > EXACT:
        z = (up - down) / math.sqrt(float(ranks @ ranks))
        return up, down, float(2 * norm.sf(abs(z)))
    doubled = np.round(2 * ranks).astype(np.int64)  # middle ranks are halves
    chance = np.zeros(int(doubled.sum()) + 1)
    chance[0] = 1.0
    reach = 0
    for r in doubled.tolist():
        chance[r : reach + r + 1] = chance[r : reach + r + 1] + chance[: reach + 1].copy()
        reach += r
        chance /= 2
    tail = float(chance[: round(2 * min(up, down)) + 1].sum())
    return up, down, min(1.0, 2 * tail)


def holm(p: Sequence[float]) -> tuple[float, ...]:
    """Probabilities adjusted for asking several questions at once (Holm 1979); NaN stays."""
    order = sorted((v, i) for i, v in enumerate(p) if not math.isnan(v))
    out = [math.nan] * len(p)
    worst = 0.0
    for place, (v, i) in enumerate(order):
        worst = max(worst, min(1.0, (len(order) - place) * v))
        out[i] = worst
    return tuple(out)
