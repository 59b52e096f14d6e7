"""Did people rate themselves higher afterwards, by their answers or by no more than printed means?

Paired t and Wilcoxon's signed ranks, effect sizes and intervals, where single answers are known.

A mean of n whole ratings is a whole number over n, and so is a share; few n fit every number that was printed. That is
the GRIM check (Brown and Heathers 2017), in whole numbers.

Of means alone, ``t = gain sqrt(n) / s`` needs the spread s of the single gains, which they leave open. Whole ratings
leave it open between two ends only. Least: all gains alike, up to the one step by which a whole total must be shared
out. Most: people sit at the ends of the scale and as many as can move against one another; of a pair of inner ratings
one can be moved up and the other down without changing a total, and since the square of a gain is convex that never
lowers the sum of squares, so that at most one rating before and one after lie inside the scale.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

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


def compare_ratings(pre: ArrayLike, post: ArrayLike, *, top: float = 4.0) -> Paired:
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
    d = np.round(y - x, 9)  # of 3.3 and 3.1 as of 2.3 and 2.1, which are tied
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


@dataclass(frozen=True, kw_only=True)
class Fits:
    """How many printed numbers can come from `answers` answers."""

    answers: int
    possible: int
    printed: int


def counts(printed: str, answers: int, *, of: int = 1) -> range:
    """Whole totals S for which ``of * S / answers`` rounds to the printed number, halves up or down.

    Parameters
    ----------
    printed : str
        As printed, since its decimals say how it was rounded: ``"3.10"`` is not ``"3.1"``.
    of : int
        1 for a mean, 100 for a percentage.
    """
    try:
        value = Fraction(printed)
    except (ValueError, ZeroDivisionError):
        raise BadInput(f"Expected a printed number such as '3.27', got '{printed}'.") from None
    if answers < 1:
        raise BadInput(f"A number needs at least one answer, got {answers}.")
    half = Fraction(1, 2 * 10 ** (len(printed.partition(".")[2])))
    low = math.ceil((value - half) * answers / of)
    high = math.floor((value + half) * answers / of)
    return range(low, high + 1)


def can_be_printed(printed: str, answers: int, *, of: int = 1) -> bool:
    """Whether a number can come from that many answers."""
    return len(counts(printed, answers, of=of)) > 0


def whole_row(shares: Sequence[str], answers: int) -> bool:
    """Whether the percentages of one question can come from whole counts that add up to all answers."""
    possible = [counts(share, answers, of=100) for share in shares]
    return all(possible) and sum(c[0] for c in possible) <= answers <= sum(c[-1] for c in possible)


def fitting(means: Sequence[str], shares: Sequence[str], most: int) -> tuple[Fits, ...]:
    """How many of all printed numbers each number of answers up to `most` makes possible."""
    printed = len(means) + len(shares)
    return tuple(
        Fits(
            answers=n,
            possible=sum(can_be_printed(m, n) for m in means) + sum(can_be_printed(s, n, of=100) for s in shares),
            printed=printed,
        )
        for n in range(1, most + 1)
    )


@dataclass(frozen=True, kw_only=True)
class Bound:
    """What two printed means and a number of answers allow.

    Attributes
    ----------
    gain : tuple of float
        Smallest and largest mean gain that rounds as printed.
    t : tuple of float
        Smallest and largest paired t; infinite when all gains may be alike.
    critical : float
        Two-sided 5 % value of t.
    exact : bool
        Whether both means can come from that many answers; if not, the nearest totals were taken.
    verdict : {"significant", "open", "not significant"}
        Whatever the answers were, or not decided by the means.
    """

    answers: int
    gain: tuple[float, float]
    t: tuple[float, float]
    critical: float
    exact: bool
    verdict: str


def bound(pre: str, post: str, answers: int, *, scale: tuple[int, int] = (1, 4)) -> Bound:
    """Bounds on the paired t statistic of whole ratings from their printed means.

    Raises
    ------
    BadInput
        When fewer than two people answered or a mean lies off the scale.
    """
    from scipy.stats import t as student

    if answers < 2:
        raise BadInput(f"A paired test needs at least 2 answers, got {answers}.")
    low, high = scale
    for text in (pre, post):
        if not low <= float(text) <= high:
            raise BadInput(f"A mean of ratings from {low} to {high} lies between them, got {text}; check the scale.")
    exact = True
    totals: list[list[int]] = []
    for text in (pre, post):
        whole = list(counts(text, answers))
        if not whole:
            exact = False
            whole = [math.floor(float(text) * answers), math.ceil(float(text) * answers)]
        totals.append([s for s in whole if low * answers <= s <= high * answers])
    statistics: list[float] = []
    gains: list[float] = []
    for before, after in product(*totals):
        gains.append((after - before) / answers)
        statistics += [
            _t(after - before, squares, answers) for squares in squares_of_gains(before, after, answers, scale)
        ]
    critical = float(student.ppf(0.975, answers - 1))
    span = (min(statistics), max(statistics))
    if span[0] > critical or span[1] < -critical:
        verdict = "significant"
    else:
        verdict = "not significant" if -critical < span[0] and span[1] < critical else "open"
    return Bound(answers=answers, gain=(min(gains), max(gains)), t=span, critical=critical, exact=exact,
                 verdict=verdict)  # fmt: skip


def _t(total: int, squares: int, n: int) -> float:
    spread = (squares - total * total / n) / (n - 1)
    if spread <= 1e-12:
        return 0.0 if total == 0 else math.copysign(math.inf, total)
    return total / n * math.sqrt(n / spread)


def squares_of_gains(before: int, after: int, n: int, scale: tuple[int, int]) -> tuple[int, int]:
    """Smallest and largest sum of squared gains of n people with these totals of ratings."""
    low, high = scale
    share, rest = divmod(after - before, n)
    least = (n - rest) * share**2 + rest * (share + 1) ** 2  # always on the scale: a rating leaves room for its gain
    width = high - low
    a, b = before - low * n, after - low * n  # ratings above the lowest
    best = -1
    for inside in _inside(width, n):
        people = n - len(inside)
        up_before, left_before = divmod(a - sum(i for i, _ in inside), width)
        up_after, left_after = divmod(b - sum(j for _, j in inside), width)
        if left_before or left_after or not (0 <= up_before <= people and 0 <= up_after <= people):
            continue
        down = min(up_before, people - up_after)
        moved = down + up_after - (up_before - down)
        best = max(best, moved * width**2 + sum((j - i) ** 2 for i, j in inside))
    return least, best


def _inside(width: int, n: int) -> Iterator[tuple[tuple[int, int], ...]]:
    """Who may not sit at both ends: nobody, one person, or one with a rating before and one with a rating after."""
    yield ()
    inner, ends = range(width + 1), (0, width)
    yield from (((i, j),) for i in inner for j in inner)
    if n > 1:
        yield from (((i, p), (q, j)) for i in inner for j in inner for p in ends for q in ends)
