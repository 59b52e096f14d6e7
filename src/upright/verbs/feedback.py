"""Gains for a linear model, by poles or by least cost: `place` and `lqr`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.physics import Linear, Plant
from upright.shown import Shown

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Gains(Shown):
    """State feedback ``u = -K x`` for one linear model; where an array is expected, it is K.

    Attributes
    ----------
    K : array, shape (inputs, states)
    poles : array, shape (states,)
        Of the loop [1/s, or z of a sampled model].
    S : array or None
        Solution of the Riccati equation, of gains by least cost; then ``K, S, E = gains`` unpacks as python-control's.
    states, inputs : tuple of str
    point : mapping or None
        Equilibrium that the model was linearized about, by coordinate; None for a model that names none.
    period : float
        Of a sampled model [s]; 0 for a continuous one.
    sentence : str
        How well conditioned the gains are.
    """

    K: Array
    poles: NDArray[np.complex128]
    S: Array | None
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    point: Mapping[str, float] | None
    period: float
    sentence: str

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.K, dtype=dtype or np.float64)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.K if self.S is None else (self.K, self.S, self.poles))

    def __len__(self) -> int:
        return len(self.K) if self.S is None else 3

    def __getitem__(self, key: Any) -> Any:
        return self.K[key]

    def __matmul__(self, other: Any) -> Any:
        return self.K @ np.asarray(other)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of K."""
        return self.K.shape

    def to_pandas(self) -> Any:
        """K as a table, an input per row and a state per column."""
        import pandas as pd

        return pd.DataFrame(self.K, index=list(self.inputs), columns=list(self.states))


def place(*system: Any, poles: Any = None) -> Gains:
    """Gains that put the poles of a linear model where they are asked, by Ackermann's formula.

    Parameters
    ----------
    *system
        ``plant.linear("inverted")``, a `control.StateSpace`, ``(A, B)`` or ``A, B``; then the poles.
    poles : text or sequence of complex, shape (states,)
        In conjugate pairs [1/s; z for a sampled model], or as text: ``"-4+-2j, -17, -3"``.

    Returns
    -------
    Gains

    Raises
    ------
    BadInput
        When the model cannot be read, the poles do not fit it, or no gain places them.

    Examples
    --------
    >>> import upright as up
    >>> up.place([[0, 1], [4, 0]], [0, 1], [-2, -3]).K
    array([[10.,  5.]])
    """
    from upright.gains import place as placed
    from upright.gains.requests import read_poles

    model, rest = _model(system, "place", ("poles",), (poles,))
    (asked,) = rest
    wanted = read_poles(asked) if isinstance(asked, str) else _complex(asked)
    found = placed(model.A, model.B, wanted)
    return model.gains(found.K, found.attained, None, found.sentence)


def lqr(*system: Any, Q: Any = None, R: Any = None) -> Gains:
    """Gains of least cost, the integral of ``x' Q x + u' R u``; ``K, S, E = lqr(...)`` as python-control gives it.

    Parameters
    ----------
    *system
        ``plant.linear("inverted")``, a `control.StateSpace`, ``(A, B)`` or ``A, B``; then Q and R.
    Q : array, shape (states, states) or (states,), or text
        Weights of the states; one number for each is the diagonal: ``[1, 0, 1, 0]`` or ``"1, 0, 1, 0"``.
    R : array, shape (inputs, inputs) or (inputs,), or float
        Weights of the inputs.

    Returns
    -------
    Gains
        With the solution `S` of the Riccati equation; of a sampled `control.StateSpace` the discrete one.

    Raises
    ------
    BadInput
        When the model or a weight cannot be read or has another size, or no such gains exist.
    """
    from upright.gains.lqr import least_cost

    model, (weights, effort) = _model(system, "lqr", ("Q", "R"), (Q, R))
    n, m = model.B.shape
    q, r = _weights(weights, n, "Q", "states"), _weights(effort, m, "R", "inputs")
    K, S, E = least_cost(model.A, model.B, q, r, sampled=model.period > 0, states=model.states)
    return model.gains(K, E, S, "")


@dataclass(frozen=True, kw_only=True)
class _Model:
    A: Array
    B: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    point: Mapping[str, float] | None = None
    period: float = 0.0

    def gains(self, K: Array, poles: NDArray[np.complex128], S: Array | None, sentence: str) -> Gains:
        return Gains(
            K=K, poles=poles, S=S, states=self.states, inputs=self.inputs, point=self.point, period=self.period,
            sentence=sentence,
        )  # fmt: skip


def _model(given: tuple[Any, ...], verb: str, names: tuple[str, ...], by_name: tuple[Any, ...]) -> tuple[_Model, Any]:
    """The model that the first arguments name, and the values that follow it."""
    wanted = f'{verb} takes a model and {" and ".join(names)}: {verb}(plant.linear("inverted"), {", ".join(names)}), '
    wanted += f"{verb}(A, B, {', '.join(names)}), or a control.StateSpace in the model's place"
    if not given:
        raise BadInput(f"{wanted}; no model came.")
    first, rest = given[0], list(given[1:])
    if isinstance(first, Plant) or isinstance(getattr(first, "plant", None), Plant):
        plant = first if isinstance(first, Plant) else first.plant
        raise BadInput(
            f"{verb} takes a linear model, and {type(plant).__name__} is none; say about which equilibrium: "
            + " or ".join(f'.linear("{at}")' for at in plant.equilibria)
            + "."
        )
    if isinstance(first, Linear):
        model = _Model(A=first.A, B=first.B, states=first.states, inputs=first.inputs, point=first.point)
    elif hasattr(first, "A") and hasattr(first, "B"):
        dt = getattr(first, "dt", None)
        model = _named(first.A, first.B, verb)
        model = _Model(
            A=model.A, B=model.B, states=tuple(getattr(first, "state_labels", model.states)),
            inputs=tuple(getattr(first, "input_labels", model.inputs)), period=float(dt) if dt else 0.0,
        )  # fmt: skip
    elif isinstance(first, tuple) and len(first) >= 2:
        model = _named(first[0], first[1], verb)
    elif isinstance(first, list | np.ndarray) and rest:
        model = _named(first, rest.pop(0), verb)
    else:
        raise BadInput(f"{wanted}; got {type(first).__name__}.")
    values = [*rest, *(v for v in by_name if v is not None)]
    if len(values) != len(names):
        raise BadInput(f"{wanted}; {len(values)} of {len(names)} came after the model.")
    return model, values


def _named(A: Any, B: Any, verb: str) -> _Model:
    try:
        a = np.atleast_2d(np.asarray(A, dtype=np.float64))
        b = np.asarray(B, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(f"{verb} needs A and B as arrays of real numbers.") from None
    b = b[:, None] if b.ndim == 1 else b
    if a.ndim != 2 or a.shape[0] != a.shape[1] or b.ndim != 2 or b.shape[0] != a.shape[0]:
        raise BadInput(f"{verb} needs A of shape (n, n) and B of shape (n, m), got {a.shape} and {b.shape}.")
    states, inputs = (tuple(f"{letter}[{i}]" for i in range(size)) for letter, size in zip("xu", b.shape, strict=True))
    return _Model(A=a, B=b, states=states, inputs=inputs)


def _complex(poles: Any) -> NDArray[np.complex128]:
    try:
        return np.atleast_1d(np.asarray(poles, dtype=np.complex128))
    except (TypeError, ValueError):
        raise BadInput(f'poles are complex numbers, or a text such as "-4+-2j, -17, -3"; got {poles!r:.60}.') from None


def _weights(given: Any, size: int, name: str, of: str) -> Array:
    try:
        w = np.asarray([float(x) for x in given.split(",")] if isinstance(given, str) else given, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(
            f"{name} takes numbers, one for each of the {size} {of}, or a matrix; got {given!r:.60}."
        ) from None
    w = np.diag(np.atleast_1d(w)) if w.ndim < 2 else w
    if w.shape != (size, size):
        raise BadInput(f"{name} needs shape {(size, size)}, or {size} numbers for its diagonal, got {w.shape}.")
    return w
