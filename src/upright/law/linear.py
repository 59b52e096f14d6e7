"""Which sampled linear law closes the loop: a PID with its filter, an observer with its gain, whatever a log shows?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Law:
    """Sampled linear controller with a state of its own, evaluated at every sample, its output held until the next.

    ``z[k+1] = A z[k] + B w[k]`` and ``u[k] = u_ff[k] + C z[k] + D w[k]`` with ``w = [y_0, ..., r_0, ...]``: the
    coordinates as the encoders round them, then the references. The command is rounded to the converter's steps, then
    limited to the actuator's limit. Each matrix may have an axis of lanes as its last.

    Attributes
    ----------
    A : array, shape (z, z) or (z, z, lanes)
        What the controller's state becomes of itself; ``np.zeros((0, 0))`` for a law without state.
    B : array, shape (z, coordinates + references[, lanes])
        What it takes from coordinates and references.
    C, D : array, shape (inputs, z[, lanes]) and (inputs, coordinates + references[, lanes])
        Command from the state and from what is measured at the same sample.
    references : array, shape (T,) or (T, references), optional
        Reference signals at the samples; the last values are held.
    quantum : float or array, shape (coordinates,)
        Resolution of each encoder [rad or m], ``y = floor(q/quantum + 1/2) quantum``; 0 for none.
    delay : float
        Computational delay in samples, whole or not; the output is zero before the first one arrives.
    command_quantum : float or array, shape (inputs,)
        Step of the converter that puts the command out, in the command's unit; 0 for none.
    initial : array, shape (z,) or (z, lanes), optional
        State at a lane's first sample, zero when omitted.
    windup : {"free", "hold"}
        Whether sums, states that A hands on as they are, run on while the command is beyond its limit, or stay as they
        are for that sample. What differences and filters remember goes on.
    """

    A: ArrayLike
    B: ArrayLike
    C: ArrayLike
    D: ArrayLike
    references: ArrayLike | None = None
    quantum: ArrayLike = 0.0
    delay: float = 0.0
    command_quantum: ArrayLike = 0.0
    initial: ArrayLike | None = None
    windup: Literal["free", "hold"] = "free"

    def __post_init__(self) -> None:
        for name in "ABCD":
            if np.ndim(getattr(self, name)) not in (2, 3):
                raise BadInput(
                    f"{name} of a law needs two axes, or a third for the lanes, got shape "
                    f"{np.shape(getattr(self, name))}; a law without state has A = np.zeros((0, 0))."
                )
        shape = {name: np.shape(getattr(self, name))[:2] for name in "ABCD"}
        z, nu = shape["A"][0], shape["D"][0]
        wanted = {"A": (z, z), "B": (z, shape["D"][1]), "C": (nu, z)}
        for name, size in wanted.items():
            if shape[name] != size:
                raise BadInput(
                    f"{name} of a law with {z} states, {nu} inputs and {shape['D'][1]} signals in needs shape {size}, "
                    f"got {shape[name]}."
                )
        first = (z,) if self.initial is None else np.shape(self.initial)
        if len(first) not in (1, 2) or first[0] != z:
            raise BadInput(f"the initial state of the law needs shape ({z},), got {first}.")
        if not 0.0 <= self.delay < 1e4:
            raise BadInput(f"the law's delay must be at least 0 samples, got {self.delay:g}; give it in samples.")
        if np.any(np.asarray(self.quantum) < 0.0) or np.any(np.asarray(self.command_quantum) < 0.0):
            raise BadInput("a quantum must be at least 0, which means no rounding.")
        if self.windup not in ("free", "hold"):
            raise BadInput(f'windup is "free" or "hold", got {self.windup!r}.')
        r = self.signal()
        if r.ndim != 2 or (r.shape[1] > 0 and r.shape[0] == 0) or not np.isfinite(r).all():
            raise BadInput(f"references need finite values in shape (T, references), got {r.shape}.")

    @property
    def sizes(self) -> tuple[int, int]:
        """Number of states and of references, which are compiled in."""
        return np.shape(self.A)[0], self.signal().shape[1]

    def widths(self) -> dict[str, int]:
        """Lanes that each array is given for."""
        out = {name: np.shape(getattr(self, name))[2] if np.ndim(getattr(self, name)) == 3 else 1 for name in "ABCD"}
        initial = () if self.initial is None else np.shape(self.initial)
        return out | {"initial": initial[1] if len(initial) == 2 else 1}

    def signal(self) -> Array:
        """References, shape (T, references)."""
        if self.references is None:
            return np.zeros((1, 0))
        r: Array = np.asarray(self.references, dtype=np.float64)
        return np.ascontiguousarray(r[:, None] if r.ndim == 1 else r)

    def scalars(self, n: int, nu: int) -> Array:
        """What all lanes share, as the kernel reads it: see `Loop.scalars`."""
        return shared(self.quantum, self.command_quantum, n, nu, (0.0, float(self.windup == "hold"), self.delay))

    def rows(self, n: int, nu: int, lanes: int) -> Array:
        """Matrices, row by row, and the initial state as the kernel reads them, shape (numbers, lanes)."""
        z, m = self.sizes
        if np.shape(self.D)[:2] != (nu, n + m):
            raise BadInput(
                f"D of a law for {n} coordinates, {m} references and {nu} inputs needs shape ({nu}, {n + m}), "
                f"got {np.shape(self.D)[:2]}."
            )
        initial = np.zeros(z) if self.initial is None else self.initial
        parts: list[Array] = []
        for name, value in (*((c, getattr(self, c)) for c in "ABCD"), ("initial", initial)):
            a: Array = np.asarray(value, dtype=np.float64)
            own = a.ndim == (2 if name == "initial" else 3)
            if own and a.shape[-1] not in (1, lanes):
                raise BadInput(f"{name} of the law is given for {a.shape[-1]} lanes, where there are {lanes}.")
            size = int(np.prod(a.shape[:-1] if own else a.shape))
            parts.append(np.broadcast_to(a.reshape(size, -1) if size else np.zeros((0, lanes)), (size, lanes)))
        return np.concatenate(parts)


def shared(quantum: ArrayLike, steps: ArrayLike, n: int, nu: int, rest: tuple[float, float, float]) -> Array:
    """Encoder quanta, three numbers of the controller, room for one of the ensemble, steps of the commands."""
    out = np.zeros(n + 4 + nu)
    out[n : n + 3] = rest
    for name, value, place, size in (("quantum", quantum, 0, n), ("command_quantum", steps, n + 4, nu)):
        try:
            out[place : place + size] = value
        except ValueError:
            raise BadInput(f"{name} needs one value or {size}, got {np.shape(value)}.") from None
    return out
