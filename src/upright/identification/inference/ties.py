"""Which pairs of numbers cannot be separated: one takes what the other gives up, and only their sum is known.

Two whose estimates are correlated at -0.99 explain the runs alike wherever one grows as the other shrinks: viscous and
dry friction of a swing that always swings as far, a mass and the gain that drives it. Of all sums ``a + k b`` the one
with ``k = -sign(rho) sigma_a/sigma_b`` has the least standard error relative to its parts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum
from upright.identification.model.fit import Estimate
from upright.identification.model.grey_box import NOISE
from upright.identification.problem.normal_equations import correlation, pseudo_inverse
from upright.quantities import figures

Array = NDArray[np.float64]

TIED = 0.95
"""Correlation from which on two numbers are one: alone each is known three times worse than with the other given."""

NARROW = 0.1
"""Half an interval, relative to its number, within which a tie does not matter: it holds either way to share."""


@dataclass(frozen=True, kw_only=True)
class Tie:
    """Two numbers with their `correlation`, and the sum ``first + factor second``, which is known."""

    first: str
    second: str
    correlation: float
    factor: float
    together: Estimate

    @property
    def sentence(self) -> str:
        """That they cannot be separated, and what is known."""
        e = self.together
        digits = figures(e.value, e.stderr)
        value, low, high = (f"{v:.{digits}g}" for v in (e.value, *e.interval))
        sign, unit = "+" if self.factor > 0 else "-", "" if e.unit in ("", "1") else f" {e.unit}"
        return (
            f"{self.first} and {self.second} cannot be separated (correlation {self.correlation:.4g}); known is "
            f"{self.first} {sign} {abs(self.factor):.3g} {self.second} = {value} ({low} to {high}){unit}, in SI units."
        )


def ties(best: Optimum, estimates: Mapping[str, Estimate]) -> tuple[Tie, ...]:
    """Every number that is tied, with the one that it is tied to most; each pair once, the tightest first.

    One that ended at its bound may have left its share to another: they are correlated as they would be off the bound.
    """
    unknowns, values = best.problem.unknowns, best.values
    places = [
        i
        for i in best.shared
        if unknowns[i].estimated and not unknowns[i].name.startswith(NOISE)
        and math.isfinite(estimates[unknowns[i].name].stderr) and best.matrix[i, i] > 0
    ]  # fmt: skip
    if best.lost or len(places) < 2:
        return ()
    slope = np.array([values[i] if unknowns[i].log else 1.0 for i in places])
    pinned = best.pinned[places]
    moving = np.outer(~pinned, ~pinned)
    C = best.covariance[np.ix_(places, places)] * np.outer(slope, slope)
    others = [int(i) for i in np.flatnonzero(~best.pinned) if i not in places]
    every = [*places, *others]
    off = pseudo_inverse(best.matrix[np.ix_(every, every)])[: len(places), : len(places)] * np.outer(slope, slope)
    R = np.where(moving, correlation(C), np.where(np.outer(pinned, pinned), 0.0, correlation(off)))
    np.fill_diagonal(R, 0.0)
    pairs: dict[tuple[int, int], float] = {}
    for a in range(len(places)):
        b = int(np.argmax(np.abs(R[a])))
        if abs(R[a, b]) >= TIED:
            pairs[min(a, b), max(a, b)] = float(R[a, b])
    out: list[Tie] = []
    for (a, b), rho in sorted(pairs.items(), key=lambda item: -abs(item[1])):
        S = C if moving[a, b] else off
        factor = -math.copysign(math.sqrt(S[a, a] / S[b, b]), rho)
        value = float(values[places[a]] + factor * values[places[b]])
        # of one at its bound nothing scatters, so the other one's error is that of the sum
        error = math.sqrt(2 * max(1 - abs(rho), 0.0) * C[a, a] if moving[a, b] else C[a, a] + factor**2 * C[b, b])
        first, second = (unknowns[places[k]].name for k in (a, b))
        together = Estimate.within(value, error, best.quantile * error, estimates[first].unit)
        out.append(Tie(first=first, second=second, correlation=rho, factor=factor, together=together))
    return tuple(out)


def with_ties(estimates: Mapping[str, Estimate], tied: Sequence[Tie]) -> dict[str, Estimate]:
    """The estimates; one that is tied to another and not narrow is determined only together with it."""
    out = dict(estimates)
    for tie in reversed(tied):
        for name, other in ((tie.first, tie.second), (tie.second, tie.first)):
            if leaves_open(estimates[name]):
                out[name] = replace(estimates[name], status=f"tied to {other}")
    return out


def leaves_open(e: Estimate) -> bool:
    """Whether a tie leaves a number that is well determined open."""
    return e.status == "well determined" and not e.half <= NARROW
