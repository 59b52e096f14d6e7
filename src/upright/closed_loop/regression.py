"""Gains of a family of laws that come nearest the recorded command, and the law that they make.

What a law could have made of its signals are columns of a linear regression on the command. A filter's pole, on which
they depend, is searched. How near a family comes is judged on rows left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.structures import Channel, Filter, On, joined, memory_before
from upright.laws import Law
from upright.signals.regression import LeastSquares

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]
Term = tuple[str, int]
"""Kind and channel: "kp", "ki", "kd" and "kd2" (the second tap) per channel, "start" (what the filter remembers from
before the log), "ff" per feedforward signal and "1"."""

TERMS = ("kp", "ki", "kd")

BLOCKS = 40
"""Stretches of a log that are fitted and held out by turns."""

POLES = (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 0.85, 0.9, 0.94, 0.97, 0.985, 0.993, 0.997)
"""Poles from which the search for a filter starts: the best one and its neighbours bracket the minimum."""


@dataclass(frozen=True)
class Family:
    """Everything about a law but its gains: what is differenced and how, how late it comes, what limits do to it."""

    on: On = "error"
    smoothing: Literal["difference", "two taps", "filter"] = "difference"
    delay: int = 0
    hold: bool = False

    @property
    def extras(self) -> int:
        """Numbers to find besides the gains: what makes one family simpler than another."""
        return int(self.smoothing != "difference") + int(self.hold) + self.delay


@dataclass(frozen=True, kw_only=True)
class Signals:
    """What a law reads, as arrays over the samples of the law.

    `pairs` holds measured signal and reference (None: zero) of each channel, `every` how many samples of the law
    make a row of the log, `moving` (N,) where a memory that stops at the limit runs on.
    """

    names: tuple[str, ...]
    pairs: tuple[tuple[Array, Array | None], ...]
    feedforward: tuple[tuple[str, Array], ...]
    period: float
    every: int
    moving: Array


@dataclass(frozen=True, kw_only=True)
class Columns:
    """Regressors X (N, p) at the rows of the log, and their derivative `slope` with respect to the filter's pole."""

    terms: tuple[Term, ...]
    X: Array
    slope: Array


@dataclass(frozen=True, kw_only=True)
class Regression:
    """One family fitted to all rows used, `missed` the root mean square of what rows held out missed."""

    family: Family
    pole: float
    columns: Columns
    gains: Array
    missed: float

    @property
    def predicted(self) -> Array:
        """Command (N,) by the regression, without limit."""
        return self.columns.X @ self.gains

    @property
    def parameters(self) -> int:
        """How many numbers the family has to find."""
        return self.gains.size + self.family.extras

    @property
    def by_term(self) -> dict[Term, float]:
        """Gains by term."""
        return dict(zip(self.columns.terms, self.gains.tolist(), strict=True))

    @property
    def averages(self) -> bool:
        """Whether taps average: shares between zero and one. Others guess at what happened between two rows."""
        gains = self.by_term
        return all(gains[("kd", i)] * second >= 0 for (kind, i), second in gains.items() if kind == "kd2")


def columns(signals: Signals, family: Family, pole: float, drop: frozenset[Term] = frozenset()) -> Columns:
    """Regressors of one family without the terms in `drop`, nor what belongs to a difference that is among them."""
    terms: list[Term] = []
    X: list[Array] = []
    slope: list[Array] = []

    def add(kind: str, channel: int, values: Array, change: Array | None = None, *, late: bool = True) -> None:
        if (kind, channel) in drop or (kind in ("kd2", "start") and ("kd", channel) in drop):
            return
        terms.append((kind, channel))
        for made, v in ((X, values), (slope, np.zeros_like(values) if change is None else change)):
            made.append(_late(v, family.delay)[:: signals.every] if late else v)

    n = signals.pairs[0][0].size
    for i, (y, r) in enumerate(signals.pairs):
        e = -y if r is None else r - y
        add("kp", i, e)
        add("ki", i, signals.period * np.cumsum(e * signals.moving if family.hold else e))
        s = e if family.on == "error" else -y
        quotient = np.asarray(np.diff(s, prepend=s[0]) / signals.period, dtype=np.float64)
        if family.smoothing == "filter":
            add("kd", i, *_low_pass(quotient, pole))
            k = np.arange(n, dtype=np.float64)
            add("start", i, np.power(pole, k), k * np.power(pole, np.maximum(k - 1.0, 0.0)))
        else:
            add("kd", i, quotient)
        if family.smoothing == "two taps":
            add("kd2", i, _late(quotient, 1))
    for j, (_, values) in enumerate(signals.feedforward):
        add("ff", j, values, late=False)
    add("1", 0, np.ones(-(-n // signals.every)), late=False)
    return Columns(terms=tuple(terms), X=np.column_stack(X), slope=np.column_stack(slope))


def _low_pass(s: Array, pole: float) -> tuple[Array, Array]:
    """``d[k] = pole d[k-1] + (1 - pole) s[k]`` and its derivative with respect to the pole."""
    from scipy.signal import lfilter

    raw: Array = np.asarray(lfilter([1.0], [1.0, -pole], s))
    twice: Array = np.asarray(lfilter([0.0, 1.0], [1.0, -pole], raw))
    return (1 - pole) * raw, (1 - pole) * twice - raw


def _late(values: Array, samples: int) -> Array:
    """A signal some samples later, its first value before."""
    if not samples:
        return values
    return np.concatenate([np.full(samples, values[0]), values[:-samples]])


def held_out(n: int) -> Rows:
    """Rows that a comparison leaves out: every second stretch."""
    return (np.arange(n) * BLOCKS // n) % 2 == 1


def gains_of(X: Array, u: Array) -> Array:
    """Gains (p,) of columns of any size that come nearest a command; one that is zero everywhere gets none."""
    return LeastSquares.of(X, u, rcond=1e-13).slopes


def fit(signals: Signals, family: Family, u: Array, used: Rows, drop: frozenset[Term] = frozenset()) -> Regression:
    """Gains of one family, without the terms in `drop`; the filter's pole, if any, by search."""
    out = held_out(u.size)
    inner, outer = used & ~out, used & out

    def at(pole: float) -> Columns:
        return columns(signals, family, pole, drop)

    def pole_of(rows: Rows, start: float | None) -> float:
        if family.smoothing != "filter":
            return 0.0
        return refine(at, u, rows, bracket(at, u, rows) if start is None else start)

    pole = pole_of(used, None)
    inside = at(pole_of(inner, pole))
    gains = gains_of(inside.X[inner], u[inner])
    missed = float(np.sqrt(np.mean((u[outer] - inside.X[outer] @ gains) ** 2))) if outer.any() else math.inf
    made = at(pole)
    return Regression(
        family=family, pole=pole, columns=made, gains=gains_of(made.X[used], u[used]), missed=missed
    )  # fmt: skip


def bracket(at: Callable[[float], Columns], u: Array, rows: Rows) -> float:
    """Best pole to about a thousandth: a coarse row of poles, then Brent's search around the best."""
    from scipy.optimize import minimize_scalar

    def loss(pole: float) -> float:
        X = at(pole).X[rows]
        size = np.sqrt(np.sum(X * X, axis=0))
        X = X / np.where(size > 0, size, 1.0)
        # normal equations are quick and near enough to find a bracket
        G, b = X.T @ X, X.T @ u[rows]
        gains = np.linalg.lstsq(G, b, rcond=1e-12)[0]
        return float(np.sum((u[rows] - X @ gains) ** 2))

    best = int(np.argmin([loss(p) for p in POLES]))
    around = POLES[max(best - 1, 0)], POLES[best + 1] if best + 1 < len(POLES) else 0.9995
    best_pole = minimize_scalar(loss, bounds=around, method="bounded", options={"xatol": 1e-3 * (1.001 - around[1])})
    return float(best_pole.x)


def refine(at: Callable[[float], Columns], u: Array, rows: Rows, pole: float) -> float:
    """Pole to the last digit: Gauss-Newton steps with the gains free, while they improve."""
    best, loss = pole, math.inf
    for _ in range(12):
        made = at(pole)
        gains = gains_of(made.X[rows], u[rows])
        missed = u[rows] - made.X[rows] @ gains
        now = float(missed @ missed)
        if now >= loss * (1 - 1e-9):
            break
        best, loss = pole, now
        both = np.column_stack([made.X[rows], made.slope[rows] @ gains])
        step = float(gains_of(both, u[rows])[-1])
        pole = min(max(pole + step, 0.0), 0.9999)
    return best


def channels_of(best: Regression, measured: Sequence[str], references: Sequence[str]) -> tuple[Channel, ...]:
    """The law as a program writes it."""
    gains = best.by_term
    out: list[Channel] = []
    for i, name in enumerate(measured):
        second = gains.get(("kd2", i), 0.0)
        kd = gains.get(("kd", i), 0.0) + second
        channel = Channel(
            measured=name,
            reference=references[i] if i < len(references) else None,
            kp=gains.get(("kp", i), 0.0),
            ki=gains.get(("ki", i), 0.0),
            kd=kd,
            on=best.family.on,
            filter=Filter(pole=best.pole, second=second / kd if kd else 0.0),
        )
        if channel.kp or channel.ki or channel.kd:
            out.append(channel)
    return tuple(out)


def law_of(best: Regression, channels: Sequence[Channel], signals: Signals, limit: float) -> Law:
    """State space of the channels, its memory as the regression found it before the first row."""
    gains = best.by_term
    constant = gains.get(("1", 0), 0.0)
    law = joined(
        channels, period=signals.period, bias=0.0 if any(c.ki for c in channels) else constant, limit=limit,
        delay=float(best.family.delay), windup="hold" if best.family.hold else "free",
    )  # fmt: skip
    first: dict[str, float] = {}
    for channel in channels:
        y, r = signals.pairs[signals.names.index(channel.measured)]
        first |= {channel.measured: float(y[0])} | (
            {channel.reference: float(r[0])} if r is not None and channel.reference is not None else {}
        )
    smoothed = {name: gains.get(("start", i), 0.0) for i, name in enumerate(signals.names)}
    return replace(law, initial=memory_before(channels, first, constant=constant, smoothed=smoothed))


def structure(made: Regression, measured: Sequence[str]) -> str:
    """Structure in words, such as "PD of theta and alpha; filtered difference of the error"."""
    letters = {"kp": "P", "ki": "I", "kd": "D"}
    kinds = ["".join(letters[k] for k in letters if (k, i) in made.columns.terms) for i in range(len(measured))]
    if len(kinds) == 1:
        words = [kinds[0]]
    elif len(set(kinds)) == 1:
        words = [f"{kinds[0]} of {' and '.join(measured)}"]
    else:
        words = [", ".join(f"{kind} of {name}" for kind, name in zip(kinds, measured, strict=True) if kind)]
    if any("D" in kind for kind in kinds):
        how = {"difference": "plain", "two taps": "two-tap", "filter": "filtered"}[made.family.smoothing]
        words.append(f"{how} difference of the {made.family.on}")
    if made.family.delay:
        words.append("one sample late")
    if made.family.hold:
        words.append("sum held at the limit")
    return "; ".join(words)
