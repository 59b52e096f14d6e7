"""Do effort and motion obey the rig's equations? Signs, scales, silent trips, an effort that is none.

The force that each equation of motion needs, ``M(q) a - f(q, v)``, is computed from the measured motion; what friction
and the effort leave of it must be little. Then it is tested whether one sensor or the effort, times some factor, would
leave far less. No simulation, and no friction has to be known: it is regressed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from upright.diagnosis.case import Case
from upright.diagnosis.findings import Curve, Finding, Panel
from upright.diagnosis.motion import MATTERS, SmoothedMotion, Term
from upright.physics import Plant
from upright.physics.equations import mass_and_force
from upright.records import Array
from upright.rig.drive import GAIN
from upright.study.sensors import Sensor

FLOOR = 0.004
"""Unexplained share that is as good as nothing: parameters are known to some percent."""
COARSE = 10.0 ** np.arange(-2.1, 2.11, 0.15)
"""Factors that are tried on a sensor, of either sign."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation:
    """What one convention leaves: `unexplained` share of each row's inertial force, the effort's factor in it.

    `who` is a coordinate's name, ``"effort"``, or empty for the convention as declared; `factor` multiplies it.
    """

    who: str
    factor: float
    unexplained: Array
    gain: float

    @property
    def cost(self) -> float:
        """Mean logarithm of what is left."""
        return float(np.mean(np.log(self.unexplained + FLOOR)))


class ForceBalance:
    """Equations of motion of one record; `force` (N,) is the effort as force, None when its gain is not known.

    Parameters
    ----------
    values : mapping of str to float
        Parameters of the plant [SI], friction zero.
    gain : float
        Force per unit of effort; nan when it is not known, any positive one is then as good.
    """

    def __init__(self, motion: SmoothedMotion, values: Mapping[str, float], gain: float) -> None:
        self.motion, self.values, self.gain = motion, values, gain
        self.names = [c.name for c in motion.plant.coordinates]
        self.driven = self.names.index(motion.plant.inputs[0].on) if motion.plant.inputs else -1
        self.used = bool(np.ptp(motion.u) > 0) and self.driven in motion.rows
        self.friction = [self._friction(i) for i in motion.rows]

    def _friction(self, i: int) -> Array:
        """Orthonormal span (N, 3) of a constant, the speed's and its sign's forces."""
        m = self.motion
        columns = [np.ones(m.t.size), m.v[i], np.tanh(m.v[i] / m.fades[i])]
        columns = [c for c in columns if np.any(c)]
        return np.linalg.qr(np.column_stack([c / np.linalg.norm(c) for c in columns]))[0]

    def needed(self, factors: Array) -> tuple[Array, Array]:
        """Forces (H, rows, N) that the motion times `factors` (H, coordinates) needs, and the inertial ones alone."""
        m = self.motion
        h, n = factors.shape
        size = m.t.size
        q, v, a = ((factors.T[:, :, None] * x[:, None, :]).reshape(n, h * size) for x in (m.q, m.v, m.a))
        states = {n: x for i, c in enumerate(self.names) for n, x in ((c, q[i]), (f"{c}_dot", v[i]))}
        M, f = mass_and_force(m.plant.derived_for(self.values), {**self.values, **states})
        tau = (np.einsum("tij,jt->ti", M, a) - f).reshape(h, size, n)
        inertial = (np.einsum("tii->ti", M) * a.T).reshape(h, size, n)
        rows = list(m.rows)
        return np.moveaxis(tau[:, :, rows], 1, 2), np.moveaxis(inertial[:, :, rows], 1, 2)

    def explain(self, factors: Array, efforts: Array | None = None) -> tuple[Array, Array]:
        """Unexplained share (H, rows) and the effort's force per unit (H,), under `factors` (H, coordinates).

        `efforts` (H,) multiply the declared gain; nan, or no declared gain, leaves it to the regression, when it must
        not be negative.
        """
        tau, inertial = self.needed(factors)
        h = factors.shape[0]
        left = np.empty(tau.shape[:2])
        gains = np.zeros(h)
        for k, i in enumerate(self.motion.rows):
            Q = self.friction[k]
            need = tau[:, k]
            size = np.var(inertial[:, k], axis=1) + 1e-300
            u = self.motion.u if i == self.driven and self.used else None
            best, g = np.full(h, np.inf), np.zeros(h)
            for columns in (Q[:, :1], Q):
                rest = need - (need @ columns) @ columns.T
                if u is not None:
                    own = u - columns @ (columns.T @ u)
                    power = float(own @ own)
                    free = rest @ own / power if power > 1e-12 * float(u @ u) else np.zeros(h)
                    g = np.maximum(free, 0.0)
                    if efforts is not None and math.isfinite(self.gain):
                        g = np.where(np.isfinite(efforts), self.gain * efforts, free)
                    rest = rest - g[:, None] * own
                share = np.mean(rest**2, axis=1) / size
                better = share < best
                if columns.shape[1] > 1:  # friction must brake
                    power_in = np.einsum("ht,t->h", need - rest - (g[:, None] * u if u is not None else 0.0),
                                         self.motion.v[i]) * factors[:, i]  # fmt: skip
                    better &= power_in < 0
                best = np.where(better, share, best)
                if u is not None:
                    gains = np.where(better, g, gains)
            left[:, k] = best
        return left, gains

    def declared(self) -> Explanation:
        """The convention as it is."""
        one = np.ones((1, len(self.names)))
        efforts = np.ones(1) if math.isfinite(self.gain) else None
        left, gains = self.explain(one, efforts)
        return Explanation(who="", factor=1.0, unexplained=left[0], gain=float(gains[0]))

    def others(self) -> list[Explanation]:
        """The best factor on every sensor and on the effort, best first."""
        explanations: list[Explanation] = []
        n = len(self.names)
        both = np.concatenate([COARSE, -COARSE])
        for i in self.motion.rows:
            best = self._best(i, both, n)
            for k in range(8):  # disks that turn together tell a factor to a part in thousands
                step = 10 ** (0.15 / 4 ** (k + 1))
                finer = min(best, self._best(i, best.factor * step ** np.arange(-3.0, 4.0), n), key=lambda e: e.cost)
                settled = k > 0 and best.cost - finer.cost < 0.02
                best = finer
                if settled:
                    break
            explanations.append(best)
        if self.used:
            one = np.ones((1, n))
            left, gains = self.explain(one, np.array([np.nan]) if math.isfinite(self.gain) else None)
            if math.isfinite(self.gain):
                factor = float(gains[0]) / self.gain
                explanations.append(Explanation(who="effort", factor=factor, unexplained=left[0], gain=float(gains[0])))
        return sorted(explanations, key=lambda e: e.cost)

    def _best(self, i: int, tried: Array, n: int) -> Explanation:
        factors = np.ones((tried.size, n))
        factors[:, i] = tried
        efforts = np.ones(tried.size) if math.isfinite(self.gain) else None
        left, gains = self.explain(factors, efforts)
        k = int(np.argmin(np.mean(np.log(left + FLOOR), axis=1)))
        return Explanation(who=self.names[i], factor=float(tried[k]), unexplained=left[k], gain=float(gains[k]))


DOUBT, CLEAR, BETTER = 0.02, 0.15, 3.5
"""A convention is doubted from this unexplained share on; another one must leave less than `CLEAR`, or next to nothing
of what the declared one leaves, and together over all rows `BETTER` times less."""
LOST = 0.25
"""Unexplained share of the driven body's force from which its effort is believed no more."""
CAUSES = {
    180 / math.pi: "degrees taken for radians",
    math.pi / 180: "radians taken for degrees",
    2 * math.pi: "turns taken for radians",
    4.0: "encoder lines taken for counts",
    0.25: "counts taken for encoder lines",
    1000.0: "thousandths taken for units",
    0.001: "units taken for thousandths",
}


def values_of(case: Case, friction: frozenset[str]) -> tuple[dict[str, float], float] | str:
    """Parameters for the balance and the gain, or the reason why there is none."""
    rig = case.rig
    if rig is None:
        return "only the plant's name is known; a study with its numbers tells"
    guessed = [n for n in rig.plant.names() if n in rig.guessed and n not in friction]
    if guessed:
        return f"{', '.join(guessed)} {'is a guess' if len(guessed) == 1 else 'are guesses'}; give the fit.json"
    values = {n: 0.0 if n in rig.guessed else v for n, v in rig.plant.parameters().items()}
    return values, math.nan if GAIN in rig.guessed else rig.gain


def friction_of(plant: type[Plant]) -> frozenset[str]:
    """Names of the parameters that only dissipate."""
    viscous = re.findall(r"\w+", plant.derived().power_lost)
    dry = [n for j in plant.joints for n in vars(j).values() if isinstance(n, str)]
    return frozenset(plant.names()) & frozenset([*viscous, *dry])


def against_numbers(case: Case, balance: ForceBalance) -> list[Finding]:
    """Signs and scales, held to known inertias, stiffnesses and gain."""
    now = balance.declared()
    if float(now.unexplained.max()) < DOUBT:
        return []
    others = balance.others()
    best = others[0] if others else now
    left = float(best.unexplained.max())
    rows = now.unexplained.size
    near = (0.8, 1.25) if float(now.unexplained.max()) > 4 * DOUBT else (0.65, 1.55)
    better = rows * (now.cost - best.cost) > math.log(BETTER)
    clear = CLEAR if best.who == "effort" else max(CLEAR, 0.01 * float(now.unexplained.max()))
    if not better or left > clear or near[0] < best.factor < near[1]:
        return []
    alike = [e for e in others if e.cost < best.cost + 0.25 and not 0.8 < e.factor < 1.25]
    return [_mistaken(case, balance, now, alike)]


def against_gain(case: Case, balance: ForceBalance) -> Iterator[Finding]:
    """An effort whose known gain leaves the driven body unexplained, whatever factor is put on it or on a sensor."""
    now = balance.declared()
    k = balance.motion.rows.index(balance.driven) if balance.used else -1
    others = np.delete(now.unexplained, k)
    if k < 0 or not math.isfinite(balance.gain) or now.unexplained[k] < LOST or (others > 2 * CLEAR).any():
        return
    left = 100 * float(now.unexplained[k])
    driven = case.places[balance.names[balance.driven]]
    u = case.u - case.u.mean()
    y = driven.y - driven.y.mean()
    alike = float(u @ y) / (float(np.linalg.norm(u)) * float(np.linalg.norm(y)) + 1e-300)
    follows = (
        f" '{driven.column}' follows it ({100 * alike:.0f} % correlation), as it would a reference."
        if alike > 0.6
        else ""
    )
    yield Finding(
        kind="effort",
        columns=(case.drive,),
        severity="fault",
        sentence=f"'{case.drive}' acts like no effort: with the rig's known numbers it leaves {left:.0f} % of the"
        f" force on '{driven.column}' unexplained, and no factor mends that.{follows}",
        evidence={"unexplained [%]": left, "correlation with the motion [%]": 100 * alike},
        advice="Look for the column the controller put out; a reference or a set value is no effort.",
        key='[drive]\ncolumn = "..."',
        panels=(*case.over_time(driven.column, case.drive), _force_panel(balance, now, "as declared")),
    )


def _mistaken(case: Case, balance: ForceBalance, now: Explanation, alike: list[Explanation]) -> Finding:
    best = min(alike, key=lambda e: abs(math.log(abs(e.factor))) + (0.0 if e.factor > 0 else 0.1))
    reversed_, size = best.factor < 0, abs(best.factor)
    kind = "sign" if reversed_ and 0.75 < size < 1.33 else "scale"
    shown = f"{size:.3g}"
    cause = next((text for f, text in CAUSES.items() if abs(size / f - 1) < 0.06), "")

    def name(e: Explanation) -> str:
        return f"the effort '{case.drive}'" if e.who == "effort" else f"'{case.places[e.who].column}'"

    whom = " or ".join(dict.fromkeys(name(e) for e in [best, *(e for e in alike if e is not best)]))
    left, then = 100 * float(now.unexplained.max()), 100 * float(best.unexplained.max())
    rest = f"the rig's known numbers leave {left:.0f} % of the inertial force unexplained, and {then:.1f} % with it"
    if kind == "sign":
        sentence = f"The sign of {whom} looks reversed: {rest}."
    else:
        sentence = (
            f"{whom[0].upper() + whom[1:]} is off by a factor: times {'-' if reversed_ else ''}{shown}"
            f"{f' ({cause})' if cause else ''} it fits; {rest}."
        )
    columns = tuple(case.drive if e.who == "effort" else case.places[e.who].column for e in alike)
    return Finding(
        kind=kind,
        columns=tuple(dict.fromkeys(columns)),
        severity="fault",
        sentence=sentence,
        left=then,
        evidence={"factor [1]": best.factor, "unexplained now [%]": left, "unexplained then [%]": then},
        advice="Set it in the study, or mend the log; then look again.",
        key=case.corrected(best.who, -1.0 if kind == "sign" else best.factor),
        panels=(_force_panel(balance, now, "as declared"), _force_panel(balance, best, "with the factor", like=now)),
    )


def _force_panel(balance: ForceBalance, e: Explanation, title: str, *, like: Explanation | None = None) -> Panel:
    """Force that the worst row needs (of `like`, when given), and what is left of it."""
    factors = np.ones((1, len(balance.names)))
    if e.who in balance.names:
        factors[0, balance.names.index(e.who)] = e.factor
    tau, inertial = balance.needed(factors)
    k = int(np.argmax((like or e).unexplained))
    need = tau[0, k]
    if balance.motion.rows[k] == balance.driven and balance.used:
        need = need - e.gain * balance.motion.u
    Q = balance.friction[k]
    t = balance.motion.t
    unit = "N" if balance.motion.plant.coordinates[balance.motion.rows[k]].unit == "m" else "N m"
    name = balance.names[balance.motion.rows[k]]
    return Panel(
        label=f"force on {name} [{unit}],\n{title}",
        curves=(
            Curve(name="inertial", t=t, y=inertial[0, k]),
            Curve(name="unexplained", t=t, y=need - Q @ (Q.T @ need)),
        ),
    )


def against_form(case: Case, motion: SmoothedMotion, terms: list[Term]) -> list[Finding]:
    """Signs that the form of the equations fixes."""
    clear = [x for x in terms if x.share > MATTERS and x.total < 0.6]
    wrong = [x for x in clear if x.slope < 0]
    if not wrong:
        return []
    pushed = [x for x in wrong if x.who[0] == "effort"]
    joined = [x for x in wrong if x.who[0] not in ("effort", x.who[1])]
    hangs = [x for x in wrong if x.who[0] == x.who[1]]
    thrown = any(x.text == "throw" for x in wrong)
    if thrown and not case.zeroed:  # a zero that is upright turns both signs, and a loop hides gravity's
        hangs += [x for x in terms if x.text == "gravity" and x.slope < 0 and x.share > 0.003]
    if hangs:
        return [_upside_down(case, motion, hangs[0])]
    right_joined = [x for x in clear if x.who[0] not in ("effort", x.who[1]) and x not in wrong]
    if joined and not right_joined:
        x = max(joined, key=lambda x: x.share)
        first = motion.plant.coordinates[0].name
        who = first if pushed else next(c for c in x.who[::-1] if c != first)
        a, b = (case.places[c].column for c in x.who)
        return [
            _finding(
                case, motion, x, who,
                f"'{a}' and '{b}' count against each other: {_why(x)}, but the accelerations say the opposite.",
            )
        ]  # fmt: skip
    if pushed:
        x = pushed[0]
        column = case.places[x.who[1]].column
        return [
            _finding(
                case, motion, x, "effort" if case.drive else x.who[1],
                f"Positive effort, negative motion: '{case.drive}' pushes '{column}' backwards. Every sensor counts"
                " against the effort, or the effort is logged with the other sign.",
            )
        ]  # fmt: skip
    return []


def _why(x: Term) -> str:
    return {
        "spring": "a spring pulls one body towards the other",
        "throw": "a hinge that is accelerated throws its pendulum in a known sense",
    }.get(x.text, "a positive force accelerates forwards")


def _finding(case: Case, motion: SmoothedMotion, x: Term, who: str, sentence: str) -> Finding:
    name = case.drive if who == "effort" else case.places[who].column
    body = next(c for c in motion.plant.coordinates if c.name == x.who[1])
    curves = (
        Curve(name="acceleration, all else taken out", t=x.t, y=x.target),
        Curve(name=f"{x.text}, all else taken out (times its slope)", t=x.t, y=x.slope * x.alone),
    )
    slope = float(np.polyfit(x.alone, x.target, 1)[0])
    unit = case.places[x.who[1]].unit
    system = "SI" if unit == body.unit else unit
    stated = case.stated.get(who)
    turned = stated is not None and stated.sign < 0
    return Finding(
        kind="sign",
        columns=(name,),
        severity="fault",
        sentence=sentence,
        evidence={
            f"slope found [{system}]": slope,
            "explains [%]": 100 * x.share,
        },
        advice=f"Take the sign of '{name}' out again." if turned else f"Set the sign of '{name}'.",
        key=case.corrected(who, -1.0),
        panels=(
            *case.over_time(*dict.fromkeys([case.places[x.who[1]].column, case.drive])),
            Panel(label=f"acceleration\nof {body.name} [{unit}/s^2]", curves=curves),
        ),
    )


def _half_a_turn_on(case: Case, who: str) -> float:
    """Reading [deg] half a turn from where a sensor has its zero, in (-180, 180]."""
    stated = case.stated.get(who)
    if not isinstance(stated, Sensor):
        return 180.0
    factor, zero = stated.line(case.record)
    return 180.0 - (-math.degrees(abs(factor) * zero)) % 360.0


def _upside_down(case: Case, motion: SmoothedMotion, x: Term) -> Finding:
    who = x.who[1]
    column = case.places[who].column
    finding = _finding(
        case, motion, x, who,
        f"'{column}' is pulled away from its zero by gravity: its zero is upright, or the pendulum is held by a loop.",
    )  # fmt: skip
    return replace(
        finding,
        severity="warning",
        advice="If zero is upright, say so.",
        key=f'[sensors.{who}]\noffset = "{_half_a_turn_on(case, who):.5g} deg"',
        evidence={**finding.evidence, "largest angle [rad]": float(np.abs(case.places[who].y).max())},
    )
