"""Which command follows from these measurements? A sampled linear law as a state space, run over a record.

``z[k+1] = A z[k] + B w[k]``, ``u[k] = u_ff[k] + C z[k] + D w[k]`` with ``w = [measured, references]``, then limited.
Gains, filters and memories of any law a laboratory's program is likely to hold are entries of A, B, C and D.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]
Windup = Literal["free", "hold"]


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledLaw:
    """A sampled linear law between columns of a log, or between coordinates in SI.

    Attributes
    ----------
    A : (n, n) array
    B : (n, m) array
    C : (n,) array
    D : (m,) array
        The law; inputs are the measured signals in order, then the references.
    measured, references : tuple of str
        Names of the inputs.
    period : float
        Time between two samples of the law [s].
    limit : float
        Largest command that leaves the law, either way.
    delay : float
        Samples by which the command comes late.
    windup : {"free", "hold"}
        Whether memories that sum (rows of A that are rows of the unit matrix) run on while the command is limited, or
        stand still.
    quantum : float
        Step to which the command is rounded, 0 for none.
    initial : (n,) array
        Memory before the first sample.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    measured: tuple[str, ...]
    references: tuple[str, ...] = ()
    period: float
    limit: float = math.inf
    delay: float = 0.0
    windup: Windup = "free"
    quantum: float = 0.0
    initial: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        C, D = np.atleast_1d(np.asarray(self.C, np.float64)), np.atleast_1d(np.asarray(self.D, np.float64))
        n, m = C.size, len(self.measured) + len(self.references)
        A = np.asarray(self.A, np.float64).reshape(n, n) if np.size(self.A) == n * n else np.asarray(self.A)
        B = np.asarray(self.B, np.float64).reshape(n, m) if np.size(self.B) == n * m else np.asarray(self.B)
        if A.shape != (n, n) or B.shape != (n, m) or D.shape != (m,):
            raise BadInput(
                f"a law with {n} memories and {m} signals needs A ({n}, {n}), B ({n}, {m}), C ({n},) and D ({m},),"
                f" got A {np.shape(self.A)}, B {np.shape(self.B)}, C {np.shape(self.C)}, D {np.shape(self.D)}."
            )
        initial = np.asarray(self.initial, np.float64)
        initial = np.zeros(n) if initial.size == 0 else initial
        if initial.shape != (n,):
            raise BadInput(f"the law's memory starts with {n} values, got {initial.size}.")
        if not self.period > 0 or not math.isfinite(self.period):
            raise BadInput(f"a law needs its sample period in s, above zero, got {self.period}.")
        if not self.limit > 0 or self.quantum < 0 or not 0 <= self.delay < 1e4:
            raise BadInput(
                f"a law needs a limit above zero, a step of at least 0 and a delay in samples of at least 0,"
                f" got {self.limit:g}, {self.quantum:g} and {self.delay:g}."
            )
        for name, value in (("A", A), ("B", B), ("C", C), ("D", D), ("initial", initial)):
            if not np.isfinite(value).all():
                raise BadInput(f"{name} of a law needs finite numbers, got {value.ravel().tolist()}.")
            object.__setattr__(self, name, value)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the measured signals, then of the references."""
        return (*self.measured, *self.references)

    @property
    def sums(self) -> NDArray[np.bool_]:
        """Which memories (n,) add up what they are fed."""
        return np.asarray((np.eye(self.C.size) == self.A).all(axis=1))

    def commands(
        self, measured: ArrayLike, references: ArrayLike | None = None, feedforward: Array | float = 0.0
    ) -> Array:
        """Commands (N,) that the law would have put out on recorded signals.

        Parameters
        ----------
        measured : (N, len(self.measured)) array
        references : (N, len(self.references)) array
        feedforward : (N,) array or float
            Added before the limit.
        """
        return self.follow(measured, references, feedforward)[0]

    def follow(
        self, measured: ArrayLike, references: ArrayLike | None = None, feedforward: Array | float = 0.0
    ) -> tuple[Array, Array]:
        """Commands (N,), and the memory (N + 1, n) before each sample and after the last."""
        y = np.asarray(measured, np.float64)
        y = y.reshape(-1, 1) if y.ndim == 1 else y
        r = np.zeros((len(y), 0)) if references is None else np.asarray(references, np.float64)
        r = r.reshape(-1, 1) if r.ndim == 1 else r
        if y.shape[1] != len(self.measured) or r.shape != (len(y), len(self.references)):
            raise BadInput(
                f"the law reads {len(self.measured)} measured signals and {len(self.references)} references,"
                f" got arrays of shape {y.shape} and {r.shape}."
            )
        w = np.concatenate([y, r], axis=1)
        fed, driven = w @ self.D + feedforward, w @ self.B.T
        z = np.empty((len(y) + 1, self.C.size))
        z[0] = self.initial
        sums = self.sums if self.windup == "hold" else np.zeros(self.C.size, dtype=bool)
        hold = bool(sums.any())
        for k in range(len(y)):
            z[k + 1] = self.A @ z[k] + driven[k]
            if hold and abs(fed[k] + self.C @ z[k]) > self.limit:
                z[k + 1, sums] = z[k, sums]
        u = _late(fed + z[:-1] @ self.C, self.delay)
        if self.quantum:
            u = np.floor(u / self.quantum + 0.5) * self.quantum
        return np.clip(u, -self.limit, self.limit), z

    def on(self, scale: ArrayLike, offset: ArrayLike, command: float, names: tuple[str, ...]) -> SampledLaw:
        """The same law between other units.

        Parameters
        ----------
        scale, offset : (len(measured),) arrays
            What the law measures, by what is given: ``y_law = scale y + offset``.
        command : float
            Commands given out per command of the law.
        names : tuple of str
            New names of the measured signals.

        Notes
        -----
        An offset is fed in as one more reference, "1", that is always one; so a law that has one gets it.
        """
        n = len(self.measured)
        s, o = np.asarray(scale, np.float64), np.asarray(offset, np.float64)
        B, D = self.B.copy(), self.D.copy()
        constant_B, constant_D = B[:, :n] @ o, D[:n] @ o
        B[:, :n] *= s
        D[:n] *= s
        references = self.references
        if np.any(constant_B) or constant_D:
            B, D, references = np.column_stack([B, constant_B]), np.append(D, constant_D), (*references, "1")
        # With C scaled and the memory as it was, nothing about windup or the initial memory changes.
        return replace(
            self, B=B, C=command * self.C, D=command * D, measured=names, references=references,
            limit=abs(command) * self.limit, quantum=abs(command) * self.quantum,
        )  # fmt: skip


def _late(u: Array, delay: float) -> Array:
    """Commands `delay` samples later, straight lines between samples, zero before the first."""
    if not delay:
        return u
    k = np.arange(u.size, dtype=np.float64)
    whole = int(delay)
    if whole == delay:
        return np.concatenate([np.zeros(min(whole, u.size)), u[: max(u.size - whole, 0)]])
    return np.interp(k - delay, k, u, left=0.0)
