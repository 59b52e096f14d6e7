"""Sampled linear law: a PID with its filter, an observer with its gain, state feedback, whatever a log shows."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.renamed import Now, former, renamed

Array = NDArray[np.float64]
Windup = Literal["free", "hold"]
Pattern = tuple[tuple[float | None, ...], ...]
"""Entries of a matrix that are 0 or 1 in every lane; None for numbers that are known at run time only."""


FORMER: Mapping[str, Now] = {
    "quantum": ("resolution", lambda value: value),
    "command_quantum": ("command_resolution", lambda value: value),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Controller(ABC):
    """What a `Law` and a `Rule` share: encoders before it, a converter behind it, references, limit and delay.

    The command is rounded to the converter's steps, then limited. Arrays may have an axis of lanes as their last.

    Attributes
    ----------
    references : array, shape (T,) or (T, references), optional
        Reference signals at the samples; the last values are held.
    resolution : float or array, shape (coordinates,)
        Resolution of each encoder [rad or m], ``y = floor(q/resolution + 1/2) resolution``; 0 for none.
    command_resolution : float or array, shape (inputs,)
        Step of the converter that puts the command out, in the command's unit; 0 for none.
    limit : float
        Largest command that leaves the controller, either way; the actuator's own limit acts besides.
    delay : float
        Computational delay in samples, whole or not; the output is zero before the first one arrives.
    period : float, optional
        Time between two samples that it is made for [s], where it is known.
    """

    references: ArrayLike | None = None
    resolution: ArrayLike = 0.0
    command_resolution: ArrayLike = 0.0
    limit: float = math.inf
    delay: float = 0.0
    period: float | None = None
    quantum = former("resolution")
    command_quantum = former("command_resolution")

    def __post_init__(self) -> None:
        if not 0.0 <= self.delay < 1e4:
            raise BadInput(f"the delay must be at least 0 samples, got {self.delay:g}; give it in samples.")
        if not self.limit > 0.0:
            raise BadInput(f"a law needs a limit above zero, got {self.limit:g}.")
        if self.period is not None and not 0.0 < self.period < math.inf:
            raise BadInput(f"a law needs its sample period in s, above zero, got {self.period}.")
        if np.any(np.asarray(self.resolution) < 0.0) or np.any(np.asarray(self.command_resolution) < 0.0):
            raise BadInput("a resolution must be at least 0, which means no rounding.")
        r = self.signal()
        if r.ndim != 2 or (r.shape[1] > 0 and r.shape[0] == 0) or not np.isfinite(r).all():
            raise BadInput(f"references need finite values in shape (T, references), got {r.shape}.")

    @property
    def needed_period(self) -> float:
        """The `period`, where it cannot do without."""
        if self.period is None:
            raise BadInput("this law needs its sample period; give it: dataclasses.replace(law, period=1e-3).")
        return self.period

    @abstractmethod
    def arrays(self) -> dict[str, tuple[Array, int]]:
        """Arrays that may differ between lanes, by name, with their number of axes in one lane."""

    def widths(self) -> dict[str, int]:
        """Lanes that each array is given for."""
        return {name: a.shape[axes] if a.ndim > axes else 1 for name, (a, axes) in self.arrays().items()}

    def of_lanes(self, which: slice) -> Self:
        """The same controller for some of its lanes, compiled as for all of them."""
        wide = {n: a[..., which] for n, (a, axes) in self.arrays().items() if a.ndim > axes and a.shape[axes] > 1}
        return replace(self, **wide) if wide else self

    def by_lane(self, lanes: int) -> dict[str, Array]:
        """The same arrays, row by row, each of shape (numbers, lanes)."""
        out: dict[str, Array] = {}
        for name, (a, axes) in self.arrays().items():
            wide = a if a.ndim > axes else a[..., None]
            if wide.shape[-1] not in (1, lanes):
                raise BadInput(f"{name} of the law is given for {wide.shape[-1]} lanes, where there are {lanes}.")
            rows = math.prod(wide.shape[:-1])
            out[name] = np.broadcast_to(wide.reshape(rows, wide.shape[-1]), (rows, lanes))
        return out

    def signal(self) -> Array:
        """References, shape (T, references)."""
        if self.references is None:
            return np.zeros((1, 0))
        r: Array = np.asarray(self.references, dtype=np.float64)
        return np.ascontiguousarray(r[:, None] if r.ndim == 1 else r)

    def scalars(self, n: int, nu: int) -> Array:
        """What all lanes share, as the kernel reads it: encoder quanta, delay, room for one more, command quanta."""
        out = np.zeros(n + 2 + nu)
        out[n] = self.delay
        for name, place, size in (("resolution", 0, n), ("command_resolution", n + 2, nu)):
            try:
                out[place : place + size] = getattr(self, name)
            except ValueError:
                raise BadInput(f"{name} needs one value or {size}, got {np.shape(getattr(self, name))}.") from None
        return out


@dataclass(frozen=True)
class Structure:
    """What of a `Law` is compiled in: known entries of A and B, references, whether sums stand still at the limit."""

    A: Pattern
    B: Pattern
    references: int
    hold: bool


@renamed(FORMER)
@dataclass(frozen=True, eq=False)
class Law(Controller):
    """Sampled linear controller with a state of its own, evaluated at every sample, its output held until the next.

    ``z[k+1] = A z[k] + B w[k]`` and ``u[k] = u_ff[k] + C z[k] + D w[k]`` with ``w = [y - target, r]``: readings of the
    encoders less their targets, then the references. Gains, filters and memories of any law that a laboratory's
    program is likely to hold are entries of A, B, C and D, each of which may have an axis of lanes as its last.

    Attributes
    ----------
    A : array, shape (z, z)
        What the controller's state becomes of itself; ``np.zeros((0, 0))`` for a law without state.
    B : array, shape (z, readings + references)
        What it takes from readings and references.
    C, D : array, shape (inputs, z) and (inputs, readings + references)
        Command from the state and from what is measured at the same sample.
    target : float or array, shape (readings,)
        Set point of each reading [rad or m].
    initial : array, shape (z,), optional
        State at a lane's first sample, zero when omitted.
    begin : array, shape (z, readings), optional
        What the first reading less its target adds to that, so that no jump is taken for a speed.
    windup : {"free", "hold"}
        Whether sums, states that A hands on as they are, run on while the command is beyond its limit, or stay as they
        are for that sample. What differences and filters remember goes on.
    measured, reference_names : tuple of str
        Names of readings and references, where a log or a study gives them.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    _: KW_ONLY
    target: ArrayLike = 0.0
    initial: ArrayLike | None = None
    begin: Array | None = None
    windup: Windup = "free"
    measured: tuple[str, ...] = ()
    reference_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in "ABCD":
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
            if getattr(self, name).ndim not in (2, 3):
                raise BadInput(
                    f"{name} of a law needs two axes, or a third for the lanes, got shape "
                    f"{getattr(self, name).shape}; a law without state has A = np.zeros((0, 0))."
                )
        (nu, z), references = self.C.shape[:2], self.signal().shape[-1]
        signals = len(self.measured) + references if self.measured else self.D.shape[1]
        for name, size in {"A": (z, z), "B": (z, signals), "D": (nu, signals)}.items():
            if getattr(self, name).shape[:2] != size:
                raise BadInput(
                    f"{name} of a law with {z} memories, {nu} inputs and {signals} signals in needs shape {size}, "
                    f"got {getattr(self, name).shape[:2]}."
                )
        first = (z,) if self.initial is None else np.shape(self.initial)
        if len(first) not in (1, 2) or first[0] != z:
            raise BadInput(f"the initial state of the law needs shape ({z},), got {first}.")
        for name in ("A", "B", "C", "D", "initial"):
            if getattr(self, name) is not None and not np.isfinite(getattr(self, name)).all():
                raise BadInput(f"{name} of a law needs finite numbers, got {np.ravel(getattr(self, name)).tolist()}.")
        if self.windup not in ("free", "hold"):
            raise BadInput(f'windup is "free" or "hold", got {self.windup!r}.')
        super().__post_init__()

    @property
    def readings(self) -> int:
        """How many readings it takes."""
        return self.D.shape[1] - self.signal().shape[1]

    @cached_property
    def compiled_in(self) -> Structure:
        """What the kernel is written for; everything else is data."""
        A, B = (_pattern(m) for m in (self.A, self.B))
        return Structure(A=A, B=B, references=self.signal().shape[1], hold=self.windup == "hold")

    def signal(self) -> Array:
        """References, shape (T, references), zero when none are given."""
        return np.zeros((1, len(self.reference_names))) if self.references is None else super().signal()

    def of_lanes(self, which: slice) -> Self:
        """The same law for some of its lanes; what is 0 or 1 in them alone is not compiled in."""
        made = super().of_lanes(which)
        vars(made)["compiled_in"] = self.compiled_in
        return made

    def arrays(self) -> dict[str, tuple[Array, int]]:
        """Matrices, first state and targets."""
        initial = np.zeros(self.A.shape[0]) if self.initial is None else np.asarray(self.initial, dtype=np.float64)
        target = np.asarray(self.target, dtype=np.float64)
        target = target if target.ndim else np.broadcast_to(target, (self.readings,))
        return {name: (getattr(self, name), 2) for name in "ABCD"} | {"initial": (initial, 1), "target": (target, 1)}

    def rows(self, nu: int, lanes: int, q: Array) -> Array:
        """Numbers as the kernel reads them, shape (numbers, lanes), for lanes that begin at coordinates `q`."""
        n, m = len(q), self.signal().shape[1]
        if self.D.shape[:2] != (nu, n + m):
            raise BadInput(
                f"D of a law for {n} coordinates, {m} references and {nu} inputs needs shape ({nu}, {n + m}), "
                f"got {self.D.shape[:2]}."
            )
        parts = self.by_lane(lanes)
        if self.begin is not None:
            resolution = np.broadcast_to(np.asarray(self.resolution, dtype=np.float64), (n,))
            w = rounded(q, resolution[:, None]) - parts["target"]
            for column, value in zip(self.begin.T, w, strict=True):  # in this order, as `@` has none that is its own
                parts["initial"] = parts["initial"] + column[:, None] * value
        for name, pattern in (("A", self.compiled_in.A), ("B", self.compiled_in.B)):
            parts[name] = parts[name][[value is None for row in pattern for value in row]]
        return np.concatenate(list(parts.values()))

    def follow(self, readings: ArrayLike, feedforward: ArrayLike = 0.0) -> tuple[Array, Array]:
        """Commands and memory that the law has for given readings, called sample by sample as on a rig.

        Parameters
        ----------
        readings : array, shape (N, readings), or (N,) of one
            As the encoders show them.
        feedforward : array, shape (N,), or float
            Added to the commands before they are rounded and limited.

        Returns
        -------
        commands, shape (N, inputs), as they arrive: `delay` samples late, where that is not whole the mean over each
        sample; memory at each sample, shape (N, z)
        """
        y = np.asarray(readings, dtype=np.float64)
        y, r = y.reshape(-1, 1) if y.ndim == 1 else y, self.signal()
        if y.shape[1:] != (self.readings,) or self.D.ndim != 2:
            raise BadInput(f"a law of one lane that reads {self.readings} signals was given an array of {y.shape}.")
        w = np.hstack([y - np.asarray(self.target), r[np.minimum(np.arange(len(y)), len(r) - 1)]])
        fed: Array = w @ self.D.T + np.reshape(np.asarray(feedforward, dtype=np.float64), (-1, 1))
        driven, z = w @ self.B.T, np.zeros((len(y) + 1, len(self.A)))
        if self.initial is not None:
            z[0] = self.initial
        if self.begin is not None:
            z[0] += self.begin @ w[0, : self.readings]
        sums = (np.eye(len(self.A)) == self.A).all(axis=1) & (self.windup == "hold")
        for k in range(len(y)):
            z[k + 1] = self.A @ z[k] + driven[k]
            if sums.any() and (np.abs(rounded(fed[k] + self.C @ z[k], self.command_resolution)) > self.limit).any():
                z[k + 1, sums] = z[k, sums]
        u = np.clip(rounded(fed + z[:-1] @ self.C.T, self.command_resolution), -self.limit, self.limit)
        if self.delay:
            k = np.arange(len(u), dtype=np.float64)
            u = np.column_stack([np.interp(k - self.delay, k, column, left=0.0) for column in u.T])
        return u, z[:-1]

    def over(self, names: Sequence[str], inputs: int) -> Law:
        """The same law on readings by all these names, in their order, feeding the first of some inputs."""
        n, m = len(names), self.signal().shape[1]
        at = [names.index(name) for name in self.measured]
        B, C, D = np.zeros((len(self.A), n + m)), np.zeros((inputs, len(self.A))), np.zeros((inputs, n + m))
        B[:, [*at, *range(n, n + m)]], C[0], D[0, [*at, *range(n, n + m)]] = self.B, self.C[0], self.D[0]
        target, begin = np.zeros(n), None if self.begin is None else np.zeros((len(self.A), n))
        target[at] = self.target
        if begin is not None:
            begin[:, at] = self.begin
        return replace(self, B=B, C=C, D=D, target=target, begin=begin, measured=tuple(names))

    def in_units(self, scale: ArrayLike, offset: ArrayLike, command: float) -> Law:
        """The same law between other units.

        Parameters
        ----------
        scale, offset : array, shape (readings,)
            What the law reads, by what is given: ``y_law = scale y + offset``.
        command : float
            Commands given out per command of the law.
        """
        s = np.asarray(scale, dtype=np.float64)
        by = np.append(s, np.ones(self.D.shape[1] - s.size))
        B, D = (M * (by[:, None] if M.ndim == 3 else by) for M in (self.B, self.D))
        # with C scaled and the memory as it was, nothing about windup or the initial memory changes
        return replace(
            self, B=B, C=command * self.C, D=command * D, target=(np.asarray(self.target) - offset) / s,
            begin=None if self.begin is None else self.begin * s, limit=abs(command) * self.limit,
            command_resolution=abs(command) * np.asarray(self.command_resolution),
        )  # fmt: skip


def differences(coordinates: int, period: float, memory: float = 0.0) -> tuple[Array, Array, Array, Array]:
    """A, B, C, D from readings to states, each coordinate followed by its speed, which is a difference low-passed.

    ``v[k] = a v[k-1] + (1 - a) (y[k] - y[k-1])/T`` with `memory` a, from 0 (plain difference) to below 1. It remembers
    the last readings, then, unless a is 0, the last speeds.
    """
    if not 0 <= memory < 1:
        raise BadInput(f"the filter's memory must be at least 0 and below 1, got {memory:g}; 0 is no filter.")
    if not 0 < period < math.inf:
        raise BadInput(f"differences need a sample period in s, above zero, got {period:g}.")
    p, one, rate = coordinates, np.eye(coordinates), (1 - memory) / period
    A, B = np.zeros((2 * p, 2 * p)), np.vstack([one, rate * one])
    A[p:, :p], A[p:, p:] = -rate * one, memory * one
    C, D = np.zeros((2 * p, 2 * p)), np.zeros((2 * p, p))
    C[1::2], D[0::2], D[1::2] = A[p:], one, rate * one
    return (A, B, C, D) if memory else (A[:p, :p], B[:p], C[:, :p], D)


def state_feedback(
    K: ArrayLike, period: float, *, memory: float = 0.0, k_pf: ArrayLike | None = None, **fields: Any
) -> Law:
    """The law ``u = k_pf r - K [y - target, v, ...]`` with speeds from `differences`, the first of which is zero.

    Parameters
    ----------
    K : array, shape (states,) or (inputs, states[, lanes])
        Gains on each coordinate and its speed in turn.
    period : float
        Time between samples [s].
    memory : float
        Of the filter on differences.
    k_pf : float or array, shape (lanes,), optional
        Gain of a reference; without it there is none.
    **fields
        Further fields of the `Law`.
    """
    gains = np.asarray(K, dtype=np.float64)
    gains = gains[None] if gains.ndim == 1 else gains
    A, B, C, D = differences(gains.shape[1] // 2, period, memory)
    remembered: Array
    direct: Array
    remembered, direct = (-np.einsum("us...,sy->uy...", gains, M) for M in (C, D))
    common: dict[str, Any] = {"begin": np.eye(len(A), len(D.T)), "period": period}
    if k_pf is not None:
        pull = np.zeros((len(gains), 1, *np.broadcast_shapes(gains.shape[2:], np.shape(k_pf)))) + np.asarray(k_pf)
        direct = direct[..., None] if direct.ndim < pull.ndim else direct
        direct = np.concatenate([direct + 0.0 * pull, pull], axis=1)
        B = np.hstack([B, np.zeros((len(B), 1))])
        common["reference_names"] = ("reference",)
    return Law(A, B, remembered, direct, **common | fields)


def rounded(values: Array, step: ArrayLike) -> Array:
    """Values as an encoder or a converter rounds them; a step of 0 is none."""
    step = np.asarray(step, dtype=np.float64)
    return np.where(step > 0.0, np.floor(values / np.where(step > 0.0, step, 1.0) + 0.5) * step, values)


def _pattern(matrix: Array) -> Pattern:
    """Which entries are 0 or 1 in every lane."""
    lanes = matrix if matrix.ndim == 3 else matrix[..., None]
    zero, one = ((lanes == value).all(axis=2) for value in (0.0, 1.0))
    return tuple(
        tuple(0.0 if z else 1.0 if o else None for z, o in zip(*both, strict=True))
        for both in zip(zero.tolist(), one.tolist(), strict=True)
    )
