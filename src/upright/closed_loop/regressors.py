"""What could a law have made of these signals? Columns of a linear regression on the recorded command."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.structures import On

Array = NDArray[np.float64]
Smoothing = Literal["difference", "two taps", "filter"]


@dataclass(frozen=True)
class Family:
    """Everything about a law but its gains: what is differenced and how, how late it comes, what limits do to it."""

    on: On = "error"
    smoothing: Smoothing = "difference"
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
    """Regressors (N, p) at the rows of the log; `terms` say what each one is, ("kp", channel) and so on.

    `slope` (N, p) is their derivative with respect to the filter's pole.
    """

    terms: tuple[tuple[str, int], ...]
    X: Array
    slope: Array


def columns(signals: Signals, family: Family, terms: Sequence[str] = ("kp", "ki", "kd"), pole: float = 0.0) -> Columns:
    """Regressors of one family.

    Terms are "kp", "ki", "kd" and "kd2" (the second tap) per channel, "start" (what the filter remembers from before
    the log), "ff" per feedforward signal and "1".
    """
    kinds: list[tuple[str, int]] = []
    X: list[Array] = []
    slope: list[Array] = []

    def add(kind: str, channel: int, values: Array, change: Array | None = None) -> None:
        kinds.append((kind, channel))
        X.append(_late(values, family.delay)[:: signals.every])
        flat = np.zeros_like(X[-1])
        slope.append(flat if change is None else _late(change, family.delay)[:: signals.every])

    n = signals.pairs[0][0].size
    for i, (y, r) in enumerate(signals.pairs):
        e = -y if r is None else r - y
        if "kp" in terms:
            add("kp", i, e)
        if "ki" in terms:
            add("ki", i, signals.period * np.cumsum(e * signals.moving if family.hold else e))
        if "kd" not in terms:
            continue
        s = e if family.on == "error" else -y
        quotient = np.asarray(np.diff(s, prepend=s[0]) / signals.period, dtype=np.float64)
        if family.smoothing == "filter":
            smooth, change = _low_pass(quotient, pole)
            add("kd", i, smooth, change)
            k = np.arange(n)
            past: Array = np.power(pole, k.astype(np.float64))
            add("start", i, past, np.asarray(k * np.power(pole, np.maximum(k - 1.0, 0.0)), dtype=np.float64))
        elif family.smoothing == "two taps":
            add("kd", i, quotient)
            add("kd2", i, _late(quotient, 1))
        else:
            add("kd", i, quotient)
    for j, (_, values) in enumerate(signals.feedforward):
        kinds.append(("ff", j))
        X.append(values)
        slope.append(np.zeros_like(values))
    kinds.append(("1", 0))
    X.append(np.ones_like(X[0]))
    slope.append(np.zeros_like(X[0]))
    return Columns(terms=tuple(kinds), X=np.column_stack(X), slope=np.column_stack(slope))


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
