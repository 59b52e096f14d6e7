"""Laws as programs write them, PID with its kinds of derivative and sums of such laws, and the law of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.laws import Law

Array = NDArray[np.float64]
On = Literal["error", "measurement"]


@dataclass(frozen=True, kw_only=True)
class Filter:
    """Difference quotient of a sampled signal, smoothed.

    ``d[k] = pole d[k-1] + (1 - pole) ((1 - second) s[k] + second s[k-1])`` of the quotients
    ``s[k] = (x[k] - x[k-1])/T``.
    """

    pole: float = 0.0
    second: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.pole < 1:
            raise BadInput(f"the pole of a difference's filter must lie in [0, 1), got {self.pole:g}.")

    @classmethod
    def of(cls, derivative: Literal["difference"] | float, period: float) -> Filter:
        """Plain differences, or those through a low pass of the time constant `derivative` [s].

        The low pass is Euler's backward one, ``d[k] = d[k-1] + T/(T + tau) (s[k] - d[k-1])``.
        """
        if derivative == "difference":
            return cls()
        tau = float(derivative)
        if not 0 <= tau < math.inf:
            raise BadInput(f"the time constant of a derivative must be at least 0 s, got {tau:g}.")
        return cls(pole=tau / (tau + period))


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One measured signal and what the law makes of it.

    ``kp e + ki sum(e) T + kd D(e)``, ``e = reference - measured``; with `on` "measurement" the difference is of
    ``-measured`` alone. Without a reference it is taken as zero.
    """

    measured: str
    reference: str | None = None
    kp: float = 0.0
    ki: float = 0.0
    kd: float = 0.0
    on: On = "error"
    filter: Filter = Filter()


def pid(
    kp: float = 0.0,
    ki: float = 0.0,
    kd: float = 0.0,
    *,
    period: float,
    derivative: Literal["difference"] | float | Filter = "difference",
    on: On = "error",
    measured: str = "y",
    reference: str = "r",
    **fields: Any,
) -> Law:
    """A PID law; `derivative` is "difference", the time constant [s] of its low pass, or a `Filter`.

    The sum of the I part includes the present sample; the difference takes the signals before the first sample as
    zero, the reference too. `fields` are further ones of the `Law`, such as its limit.
    """
    smooth = derivative if isinstance(derivative, Filter) else Filter.of(derivative, period)
    channel = Channel(measured=measured, reference=reference, kp=kp, ki=ki, kd=kd, on=on, filter=smooth)
    return joined([channel], period=period, **fields)


def joined(channels: Sequence[Channel], *, period: float, bias: float = 0.0, **fields: Any) -> Law:
    """Sum of several PID laws, one per channel, and a constant; `fields` as those of `pid`."""
    if not 0 < period < math.inf:
        raise BadInput(f"a law needs its sample period in s, above zero, got {period}.")
    measured = tuple(dict.fromkeys(c.measured for c in channels))
    references = tuple(dict.fromkeys(c.reference for c in channels if c.reference is not None))
    inputs = (*measured, *references)
    rows: list[tuple[dict[int, float], Array, float, float]] = []  # memory row, its drive, output gain, initial
    D = np.zeros(len(inputs))
    for c in channels:
        e = np.zeros(len(inputs))
        e[inputs.index(c.measured)] = -1.0
        s = e.copy()
        if c.reference is not None:
            e[inputs.index(c.reference)] += 1.0
        s = e if c.on == "error" else s
        D += c.kp * e
        if c.ki:
            rows.append(({len(rows): 1.0}, period * e, c.ki, 0.0))
            D += c.ki * period * e
        if c.kd:
            a, b = c.filter.pole, c.filter.second
            gain = (1 - a) * (1 - b) / period
            second = (1 - a) * b / period
            at = len(rows)
            # x[k-1], then what the quotients of the past still give to d[k]
            rows.append(({}, s, -c.kd * gain, 0.0))
            rows.append(({at: -(a * gain + second), at + 1: a}, (a * gain + second) * s, c.kd, 0.0))
            D += c.kd * gain * s
    if bias:
        rows.append(({len(rows): 1.0}, np.zeros(len(inputs)), 1.0, bias))
    n = len(rows)
    A = np.zeros((n, n))
    for i, (row, _, _, _) in enumerate(rows):
        for j, value in row.items():
            A[i, j] = value
    B, C = np.array([r[1] for r in rows]).reshape(n, len(inputs)), np.array([r[2] for r in rows]).reshape(1, n)
    return Law(
        A, B, C, D[None], initial=np.array([r[3] for r in rows]), measured=measured, reference_names=references,
        period=period, **fields,
    )  # fmt: skip


def memory_before(
    channels: Sequence[Channel],
    first: Mapping[str, float],
    *,
    constant: float = 0.0,
    smoothed: Mapping[str, float] | None = None,
) -> Array:
    """Memory of `joined` before a first sample: differences see no jump there.

    Parameters
    ----------
    first : mapping of str to float
        Signals at the first sample, by name.
    constant : float
        What the sums (the first of them) have put out before, or the bias of a law without sums.
    smoothed : mapping of str to float
        What the low pass of a measured signal's difference still gives out, times its gain, 0 if left out.
    """
    out: list[float] = []
    sums = [c for c in channels if c.ki]
    for c in channels:
        if c.ki:
            out.append(constant / c.ki if c is sums[0] else 0.0)
        if c.kd:
            out.append(
                -first[c.measured] + (first[c.reference] if c.reference is not None and c.on == "error" else 0.0)
            )
            out.append((smoothed or {}).get(c.measured, 0.0) / c.kd)
    return np.array([*out, constant] if constant and not sums else out)


@dataclass(frozen=True, kw_only=True, eq=False)
class ClosedLoop:
    """The law that closed the loop during a run; its output is added to the run's command.

    Attributes
    ----------
    law : Law
        Reads coordinates by name [SI], puts out commands in the actuator's unit; its references are at its samples.
    every : int
        Samples of the law per row of the run.
    quantized : bool
        Whether the simulated law reads encoders in counts and rounds its command. A fit by differences of simulations
        stumbles over the steps; a prediction does not.
    note : str
        What the report says about it.
    """

    law: Law
    every: int = 1
    quantized: bool = False
    note: str = ""

    def follow(self, motion: Array, names: Sequence[str]) -> tuple[Array, Array]:
        """Commands (N,) and memory (N, n) at the rows of a measured motion (N, len(names)); what is missing is zero.

        A law faster than the rows sees a cubic spline through them.
        """
        y = np.zeros(((len(motion) - 1) * self.every + 1, self.law.readings))
        for j, name in enumerate(self.law.measured):
            if name in names:
                y[:, j] = finer(np.ascontiguousarray(motion[:, list(names).index(name)]), self.every)
        u, z = self.law.follow(y)
        return u[:: self.every, 0], z[:: self.every]


def finer(values: Array, every: int) -> Array:
    """Samples of a signal (N,) at `every` times its rate, a cubic spline through them."""
    if every == 1:
        return values
    from scipy.interpolate import CubicSpline

    rows = np.arange(values.size)
    return np.asarray(CubicSpline(rows, values)(np.arange((values.size - 1) * every + 1) / every))
