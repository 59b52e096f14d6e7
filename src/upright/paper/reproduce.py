"""Can the paper's tables be had again from a handful of numbers, and what follows from its misprints?

Tables 1, 2 and 4 stand here as text, so that the digits printed tell the rounding.
Each misprint in numbers: what is printed and what is right, beside what the energies give (in symbols:
docs/explanation/errata.md). Rigs are drawn at random; a formula that holds misses by rounding on every one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.gains import place
from upright.gains.factorization import Locus, effort_ratios, recover_locus
from upright.gains.requests import matched, poles_of
from upright.physics import Furuta
from upright.questionnaire.statistics import can_be_printed
from upright.records import Array

Roots = NDArray[np.complex128]

TABLE_1 = (
    "-4.1484+-1.6341j, -16.8545, -3.2220",
    "-4.4305+-2.0497j, -21.915, -2.9234",
    "-4.5628+-2.2419j, -29.5357, -2.8285",
    "-4.6314+-2.3357j, -40.7029, -2.7882",
)
"""Furuta pendulum, inverted; four sets, the effort cheaper from set to set."""
TABLE_2 = (
    "-7.533+-27.28j, -18.53+-10.35j",
    "-8.7164+-26.7j, -23.59+-9.53j",
    "-9.3632+-26.0j, -35.1, -26.96",
    "-9.6046+-25.516j, -60.124, -22.841",
)
"""ECP 210, two carts."""
TABLE_3_FIRST = ("46", "54")
"""Percentages that answered the first question, strongly agree and agree."""
TABLE_4 = (
    ("3.27", "2.98", "3.88", "3.58"),
    ("2.98", "2.50", "3.58", "3.25"),
    ("3.15", "2.79", "3.75", "3.42"),
    ("2.54", "2.23", "3.83", "3.46"),
    ("1.60", "1.50", "3.02", "2.69"),
    ("2.26", "2.04", "3.44", "2.96"),
)
"""Mean ratings before (knowledge, confidence) and after."""
STUDENTS = 53


def printed_poles(text: str) -> tuple[Roots, Roots]:
    """Poles of one set [1/s], and half a unit of their last digits, real and imaginary part apart."""
    values: list[complex] = []
    halves: list[complex] = []
    for part in text.split(", "):
        real, _, imaginary = part.removesuffix("j").partition("+-")
        for sign in (1, -1) if imaginary else (1,):
            values.append(complex(float(real), sign * float(imaginary or 0)))
            halves.append(complex(_half(real), _half(imaginary) if imaginary else 1.0))
    return np.array(values), np.array(halves)


def _half(number: str) -> float:
    return 0.5 * 10.0 ** -len(number.partition(".")[2])


@dataclass(frozen=True, kw_only=True)
class Erratum:
    """One misprint; `printed_misses` and `right_misses` are the least and the largest relative error over the rigs."""

    number: int
    where: str
    printed: str
    right: str
    against: str
    printed_misses: tuple[float, float]
    right_misses: tuple[float, float]

    @property
    def shown(self) -> bool:
        """The printed form fails on every rig, the right one on none."""
        return self.printed_misses[0] > 1e-3 and self.right_misses[1] < 1e-9


@dataclass(frozen=True)
class _Sizes:
    """Shorthands of the paper on one rig."""

    p: Furuta

    @property
    def J_A(self) -> float:
        return self.p.J_p + self.p.m_p * self.p.l_cg**2

    @property
    def coupling(self) -> float:
        return self.p.m_p * self.p.l_cg * self.p.r

    @property
    def J(self) -> float:
        return self.p.J_d + self.p.m_p * self.p.r**2

    def D_2(self, sign: float) -> float:
        return self.J_A * self.J + sign * self.coupling**2


def _leading(s: _Sizes) -> float:
    """Coefficient of s^3 that Delta_2 must have for its s^2 to be as printed: from the poles of the derived model."""
    D_2 = s.D_2(-1)
    printed_s2 = D_2 * s.p.b_2 * s.p.m_p * s.p.r**2 + D_2 * (s.J_A * s.p.b_1 + s.p.J_d * s.p.b_2)
    return printed_s2 / float(np.poly(s.p.linear("hanging").A)[1])


def _appendix_D(s: _Sizes) -> float:
    """D as the appendix defines it, with the disk's inertia as a cart's mass at the radius r."""
    return s.J_A * (s.p.J_d / s.p.r**2 + s.p.m_p) - (s.p.m_p * s.p.l_cg) ** 2


def _theta_over_T(s: _Sizes) -> float:
    return float(s.p.linear("hanging").response(1.0)[0, 1, 0].real)


def _right_theta_over_T(s: _Sizes) -> float:
    """Real part of ``m_p l_cg r s/Delta`` at s = j."""
    p, z = s.p, 1j
    mgl = p.m_p * p.g * p.l_cg
    Delta = (
        s.D_2(-1) * z**3 + (s.J * p.b_2 + s.J_A * p.b_1) * z**2 + (s.J * mgl + p.b_1 * p.b_2) * z + p.b_1 * mgl
    )  # fmt: skip
    return (s.coupling * z / Delta).real


Value = Callable[[_Sizes], float]
_FORMULAS: tuple[tuple[int, str, str, str, str, Value, Value, Value], ...] = (
    (
        1, "eqs. (1), (2)", "D_2 = J_A (J_d + m_p r²) + m_p² l_cg² r²", "… − m_p² l_cg² r²",
        "determinant of the mass matrix",
        lambda s: s.D_2(1), lambda s: s.D_2(-1), lambda s: float(np.linalg.det(s.p.mass_matrix("hanging"))),
    ),
    (
        2, "eqs. (1), (2), A[4,2]", "m_p l_cg b_1 / D_2", "m_p l_cg r b_1 / D_2", "A of the model derived, inverted",
        lambda s: s.p.m_p * s.p.l_cg * s.p.b_1 / s.D_2(-1), lambda s: s.coupling * s.p.b_1 / s.D_2(-1),
        lambda s: float(s.p.linear("inverted").A[3, 1]),
    ),
    (
        3, "text under eq. (3)", "J_xx = J_p, transverse", "J_xx = J_a, axial", "mass matrix of the hanging rod",
        lambda s: s.J + s.p.J_p, lambda s: s.J + s.p.J_a, lambda s: float(s.p.mass_matrix("hanging")[0, 0]),
    ),
    (
        4, "Δ_2", "leading D² s³ (D of the appendix)", "D_2² s³", "poles of the model derived",
        lambda s: _appendix_D(s) ** 2, lambda s: s.D_2(-1) ** 2, _leading,
    ),
    (
        5, "θ/T", "leading minus", "plus", "frequency response at 1 rad/s",
        lambda s: -_right_theta_over_T(s), _right_theta_over_T, _theta_over_T,
    ),
)  # fmt: skip


def errata(seed: int = 0, rigs: int = 20) -> list[Erratum]:
    """Errata 1 to 5 on rigs drawn at random."""
    rng = np.random.default_rng(seed)
    out: list[Erratum] = []
    for number, where, printed, right, against, wrong, good, truth in _FORMULAS:
        misses = np.array([_misses(_Sizes(_rig(rng, axial=number == 3)), wrong, good, truth) for _ in range(rigs)])
        low, high = misses.min(axis=0), misses.max(axis=0)
        out.append(
            Erratum(
                number=number, where=where, printed=printed, right=right, against=against,
                printed_misses=(float(low[0]), float(high[0])), right_misses=(float(low[1]), float(high[1])),
            )
        )  # fmt: skip
    return out


def _misses(s: _Sizes, wrong: Value, good: Value, truth: Value) -> tuple[float, float]:
    derived = truth(s)
    return abs(wrong(s) / derived - 1), abs(good(s) / derived - 1)


def _rig(rng: np.random.Generator, *, axial: bool) -> Furuta:
    """A rig of laboratory size; the paper's linear models know no axial inertia, so only erratum 3 has one."""
    low = {"m_p": 0.05, "l_cg": 0.1, "r": 0.1, "J_d": 2e-3, "J_p": 2e-4, "b_1": 1e-3, "b_2": 1e-4}
    values = {name: least * 4 ** float(rng.uniform()) for name, least in low.items()}
    return Furuta(**values, J_a=0.05 * values["J_p"] if axial else 0.0)


def impossible_means(answers: int) -> int:
    """How many of Table 4's means (24) and Table 3's first percentages (2) cannot come from so many answers (GRIM)."""
    means = [mean for row in TABLE_4 for mean in row]
    wrong = sum(not can_be_printed(mean, answers) for mean in means)
    return wrong + sum(not can_be_printed(share, answers, of=100) for share in TABLE_3_FIRST)


def printed_inverted(p: Furuta) -> tuple[Array, Array]:
    """A and b of eq. (2) as printed, errata 1 and 2 in place."""
    s = _Sizes(p)
    D_2, mgl = s.D_2(1), p.m_p * p.g * p.l_cg
    A = np.zeros((4, 4))
    A[0, 1] = A[2, 3] = 1.0
    A[1, 1:] = -s.J_A * p.b_1 / D_2, -s.coupling * mgl / D_2, s.coupling * p.b_2 / D_2
    A[3, 1:] = p.m_p * p.l_cg * p.b_1 / D_2, s.J * mgl / D_2, -s.J * p.b_2 / D_2
    return A, np.array([0.0, s.J_A, 0.0, -s.coupling]) / D_2


@dataclass(frozen=True, kw_only=True)
class Regenerated:
    """One table of pole sets, and the same sets from one plant and one N/R.

    Attributes
    ----------
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
    printed_poles: Roots
    missed: Roots
    unstable: tuple[float, float]
    weights: dict[float, Array]

    @property
    def verdict(self) -> str:
        """What came of it."""
        worst = max(t.worst for t in self.tables)
        count = sum(p.size for t in self.tables for p in t.printed)
        shown = sum(e.shown for e in self.errata) + (self.impossible[STUDENTS] > 0)
        how = "none farther off than the print's rounding" if worst <= 1 else f"the worst {worst:.2f} roundings off"
        return f"All {count} poles of Tables 1 and 2 come again, {how}; {shown} of 6 errata are shown."


def reproduce_tables(furuta: Furuta, seed: int = 0) -> Reproduced:
    """Tables 1 and 2 again, and the errata: `furuta` gets gains by eq. (2) as printed, `seed` draws rigs to try on."""
    first = _again("Table 1: Furuta pendulum, inverted", TABLE_1, free=(2,))
    second = _again("Table 2: two carts, ECP 210", TABLE_2, free=(3, 2, 1))
    model, printed = furuta.linear("inverted"), first.printed[0]
    A, b = printed_inverted(furuta)
    closed = poles_of(model.A - model.B @ place(A, b, printed).K)
    return Reproduced(
        tables=(first, second),
        errata=tuple(errata(seed)),
        impossible={n: impossible_means(n) for n in range(44, 61)},
        printed_poles=printed,
        missed=matched(printed, closed),
        unstable=(float(poles_of(A).real.max()), float(model.poles()[0].real)),
        weights=furuta_weights(first.locus),
    )


def _again(name: str, sets: tuple[str, ...], *, free: tuple[int, ...]) -> Regenerated:
    read = [printed_poles(text) for text in sets]
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
