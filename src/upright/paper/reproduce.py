"""Can the paper's tables be had again from a handful of numbers, and what follows from its misprints?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.gains import place
from upright.gains.factorization import Locus, effort_ratios, recover_locus
from upright.gains.requests import matched, poles_of
from upright.paper import tables
from upright.paper.errata import Erratum, errata, impossible_means, printed_inverted
from upright.physics import Furuta

Array = NDArray[np.float64]
Roots = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Regenerated:
    """One table of pole sets, and the same sets from one plant and one N/R.

    Attributes
    ----------
    name : str
    locus : Locus
    ratios : array, shape (2,)
        By which factors R falls, as the differences of the sets tell without any fit.
    printed, again : tuples of arrays, shape (n,)
        Poles [1/s] as printed, and those of the locus beside them.
    errors : tuple of complex arrays, shape (n,)
        Their difference in units of the print's rounding (half of the last digit), parts apart; 1 is what rounding
        explains.
    """

    name: str
    locus: Locus
    ratios: Array
    printed: tuple[Roots, ...]
    again: tuple[Roots, ...]
    errors: tuple[Roots, ...]

    @property
    def worst(self) -> float:
        """Largest error in units of the print's rounding."""
        return max(float(np.maximum(np.abs(e.real), np.abs(e.imag)).max()) for e in self.errors)


@dataclass(frozen=True, kw_only=True)
class Reproduced:
    """Both tables, the errata, and where gains from eq. (2) as printed put the poles of the right model.

    `weights` are the diagonals of Q that make Table 1's N, by the hanging rod's frequency [rad/s].
    """

    tables: tuple[Regenerated, Regenerated]
    errata: tuple[Erratum, ...]
    impossible: dict[int, int]
    asked: Roots
    missed: Roots
    unstable: tuple[float, float]
    weights: dict[float, Array]

    @property
    def verdict(self) -> str:
        """What came of it."""
        worst = max(t.worst for t in self.tables)
        count = sum(p.size for t in self.tables for p in t.printed)
        shown = sum(e.shown for e in self.errata) + (self.impossible[tables.STUDENTS] > 0)
        how = "none farther off than the print's rounding" if worst <= 1 else f"the worst {worst:.2f} roundings off"
        return f"All {count} poles of Tables 1 and 2 come again, {how}; {shown} of 6 errata are shown."


def reproduce(furuta: Furuta, seed: int = 0) -> Reproduced:
    """Tables 1 and 2 again, and the errata: `furuta` gets gains by eq. (2) as printed, `seed` draws rigs to try on."""
    first = _again("Table 1: Furuta pendulum, inverted", tables.TABLE_1, free=(2,))
    second = _again("Table 2: two carts, ECP 210", tables.TABLE_2, free=(3, 2, 1))
    model, asked = furuta.linear("inverted"), first.printed[0]
    A, b = printed_inverted(furuta)
    closed = poles_of(model.A - model.B @ place(A, b, asked).K)
    return Reproduced(
        tables=(first, second),
        errata=tuple(errata(seed)),
        impossible={n: impossible_means(n) for n in range(44, 61)},
        asked=asked,
        missed=matched(asked, closed),
        unstable=(float(poles_of(A).real.max()), float(model.poles()[0].real)),
        weights=furuta_weights(first.locus),
    )


def _again(name: str, sets: tuple[str, ...], *, free: tuple[int, ...]) -> Regenerated:
    read = [tables.poles(text) for text in sets]
    printed, half = tuple(p for p, _ in read), [h for _, h in read]
    locus = recover_locus(printed, half, free=free)
    again = tuple(matched(p, q) for p, q in zip(printed, locus.sets(len(printed)), strict=True))
    errors = tuple(
        (q - p).real / h.real + 1j * (q - p).imag / h.imag for p, q, h in zip(printed, again, half, strict=True)
    )
    return Regenerated(
        name=name, locus=locus, ratios=effort_ratios(printed), printed=printed, again=again, errors=errors
    )  # fmt: skip


def furuta_weights(locus: Locus, steps: int = 400) -> dict[float, Array]:
    """Diagonals of Q/R, times the squared gain from torque, that make N of an undamped Furuta pendulum, upright.

    With ``psi/T = g (s^2 - w_h^2)/a`` and ``theta/T = h s^2/a``, w_h the hanging rod's ``sqrt(m_p g l_cg/J_A)``,
    ``N(w) = g^2 (q_1 - q_2 w)(w - w_h^2)^2 + h^2 (q_3 - q_4 w) w^2``. Four coefficients give ``g^2 q_1``, ``g^2 q_2``,
    ``h^2 q_3`` and ``h^2 q_4`` once w_h is chosen; only frequencies for which none is negative are returned.
    """
    n3, n2, n1, n0 = locus.N
    highest = float(
        np.sqrt(np.abs(np.roots(locus.a)).max() ** 2)
    )  # stronger coupling only raises the coupled frequency
    out: dict[float, Array] = {}
    for w_h in np.linspace(0.5, 1.0, steps) * highest:
        square = w_h**2
        q1 = n0 / square**2
        q2 = -(n1 + 2 * square * q1) / square**2
        q3 = n2 - q1 - 2 * square * q2
        q4 = -(n3 + q2)
        if min(q1, q2, q3, q4) >= 0:
            out[float(w_h)] = np.array([q1, q2, q3, q4])
    return out
