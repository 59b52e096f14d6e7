"""Do two fits say the same of a parameter? A two-sided test on the difference, with the covariances of both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.fit import Estimate
from upright.quantities import two_figures

Array = NDArray[np.float64]

LEVEL = 0.05
"""How often at least one of all parameters may be called different where none is (Holm 1979)."""
TWO_SIDED = 1.959963984540054
"""Standard errors from an estimate to the end of its 95 % interval."""


@dataclass(frozen=True, kw_only=True)
class ParameterAgreement:
    """How a parameter of another fit compares with that of the first.

    `word` is "agree", "differ", "not comparable" (one of them is not known to any width), or of two given numbers
    "given alike" and "given differently". `difference` is other less first, `stderr` its standard error, which faces
    the other estimate where an interval is lopsided, and `p` the probability of a difference as large where there is
    none.
    """

    word: str
    difference: float
    relative: float
    stderr: float
    p: float

    @property
    def amount(self) -> str:
        """The difference relative to the first estimate, and in its standard errors."""
        sign = "" if self.relative < 0 else "+"
        by = (
            f"{sign}{two_figures(100 * self.relative)} %".replace("-", "\u2212") if math.isfinite(self.relative) else ""
        )
        errors = abs(self.difference) / self.stderr if self.stderr else math.inf
        many = "" if math.isinf(errors) else "over 100" if errors > 100 else f"{errors:.1f}"
        return ", ".join(filter(None, (by, f"{many} standard errors" if many else "")))

    def sentence(self) -> str:
        """The word with its numbers."""
        if self.word in ("given alike", "not comparable"):
            return self.word
        return f"{self.word} ({self.amount})" if self.amount else self.word


def agreements(first: Mapping[str, Estimate], other: Mapping[str, Estimate]) -> dict[str, ParameterAgreement]:
    """How each parameter that both fits have compares; the fits must rest on different data to be independent.

    Holm's step-down procedure keeps the probability of any false "differ" among all of them at `LEVEL`.
    """
    compared: dict[str, tuple[str, float, float, float, float]] = {}
    for name in (n for n in first if n in other):
        a, b = first[name], other[name]
        difference = b.value - a.value
        relative = difference / abs(a.value) if a.value else math.nan if difference else 0.0
        stderr = math.hypot(_facing(a, difference), _facing(b, -difference))
        if stderr == 0:
            same = math.isclose(a.value, b.value, rel_tol=1e-9)
            word, p = "given alike" if same else "given differently", float(same)
        elif not math.isfinite(stderr):
            word, p = "not comparable", math.nan
        else:
            word, p = "agree", math.erfc(abs(difference) / stderr / math.sqrt(2))
        compared[name] = word, difference, relative, stderr, p
    tested = sorted((p, name) for name, (word, *_, p) in compared.items() if word == "agree")
    for place, (p, name) in enumerate(tested):
        if p > LEVEL / (len(tested) - place):
            break
        compared[name] = "differ", *compared[name][1:]
    return {
        name: ParameterAgreement(word=word, difference=difference, relative=relative, stderr=stderr, p=p)
        for name, (word, difference, relative, stderr, p) in compared.items()
    }


def together(difference: Array, first: Array, other: Array) -> tuple[float, int, float] | None:
    """Wald's test of all differences at once: chi-square, degrees of freedom, and the probability of one as large.

    Parameters
    ----------
    difference : array, shape (n,)
    first, other : array, shape (n, n)
        Covariances of the two estimates; their sum counts. What neither knows is left out.

    Returns
    -------
    (float, int, float) or None
        None where nothing is known.
    """
    from scipy.stats import chi2

    C = first + other
    size = np.sqrt(np.diag(C))
    known = np.flatnonzero((size > 0) & np.isfinite(size))
    if not known.size:
        return None
    scaled = C[np.ix_(known, known)] / np.outer(size[known], size[known])
    values, axes = np.linalg.eigh(scaled)
    kept = values > 1e-8 * values[-1]
    along = axes.T @ (difference[known] / size[known])
    statistic = float(np.sum(along[kept] ** 2 / values[kept]))
    freedom = int(np.count_nonzero(kept))
    return statistic, freedom, float(chi2.sf(statistic, freedom))


def _facing(e: Estimate, towards: float) -> float:
    """Standard error on the side of the other estimate; as wide as the interval says where that is wider."""
    if e.status == "unseen" or (e.status == "at bound" and e.zero_wide):
        return math.inf
    low, high = e.interval
    half = (high - e.value if towards > 0 else e.value - low) / TWO_SIDED
    return max(half, e.stderr)
