"""A loop around a linear model: gains by poles or by least cost, its model at the samples, prefilter and margins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.laws import Law
from upright.physics import Linear, Plant
from upright.shown import Shown

if TYPE_CHECKING:
    from upright.gains import Margins, Sampled

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

    model, rest = read_model(system, "place", ("poles",), (poles,))
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

    model, (weights, effort) = read_model(system, "lqr", ("Q", "R"), (Q, R))
    n, m = model.B.shape
    q, r = _weights(weights, n, "Q", "states"), _weights(effort, m, "R", "inputs")
    K, S, E = least_cost(model.A, model.B, q, r, sampled=model.period > 0, states=model.states)
    return model.gains(K, E, S, "")


def dlqr(*system: Any, Q: Any = None, R: Any = None) -> Gains:
    """Gains of least cost of a sampled model, the sum of ``x' Q x + u' R u``; ``K, S, E = dlqr(...)``.

    Parameters
    ----------
    *system
        What `hold` gives, a `control.StateSpace` with its period, ``(A, B)`` or ``A, B``; then Q and R as for `lqr`.
    Q, R
        Weights of the states and of the inputs.

    Returns
    -------
    Gains
        Poles are those in z.

    Raises
    ------
    BadInput
        When the model is continuous, it or a weight cannot be read, or no such gains exist.
    """
    from upright.gains.lqr import least_cost

    model, (weights, effort) = read_model(system, "dlqr", ("Q", "R"), (Q, R))
    if not model.period:
        if not model.bare:
            raise BadInput("dlqr takes a sampled model, and this one is continuous; sample it with hold, or use lqr.")
        model = replace(model, period=1.0)
    n, m = model.B.shape
    q, r = _weights(weights, n, "Q", "states"), _weights(effort, m, "R", "inputs")
    K, S, E = least_cost(model.A, model.B, q, r, sampled=True, states=model.states)
    return model.gains(K, E, S, "")


def hold(*system: Any, period: Any = None, delay: float = 0.0, lag: float = 0.0, method: str = "zoh") -> Sampled:
    """A continuous linear model at its samples, exactly.

    Parameters
    ----------
    *system
        ``plant.linear("inverted")``, a `control.StateSpace`, ``(A, B[, C[, D]])`` or ``A, B``; then the period.
    period : float or text
        Time between samples, in s or as ``"2 ms"``.
    delay : float
        How late a command acts [samples].
    lag : float
        Time constant with which the drive follows its command [s].
    method : {"zoh", "foh"}
        A command stays until the next one, or runs straight to it, as a logged force does.

    Returns
    -------
    Sampled
        A, B, C, D and `period`; `place`, `dlqr`, `prefilter` and `margins` take it.

    Raises
    ------
    BadInput
        When the model cannot be read or is sampled already, or a time is impossible.
    """
    from upright.gains import hold as held
    from upright.verbs.values import si

    model, (step,) = read_model(system, "hold", ("period",), (period,))
    if model.period:
        raise BadInput(f"hold samples a continuous model, and this one has a period of {model.period:g} s already.")
    linear = Linear(
        A=model.A, B=model.B, C=model.C, mass=np.zeros((0, 0)), point=dict(model.point or {}), states=model.states,
        inputs=model.inputs, outputs=model.outputs,
    )  # fmt: skip
    return held(linear, si(step, "s"), delay, lag, D=model.D, method=method)


def margins(*system: Any, K: Any = None, period: float = 0.0) -> Margins:
    """How much a loop stands: gain, phase and delay margin, and its least distance to -1, from every crossing.

    Parameters
    ----------
    *system
        A loop gain of one input and one output (negative feedback around it) as `control.StateSpace` or
        ``(A, B, C, D)``; or a model and the gains K of ``u = -K x``; or, as a computer runs it, a continuous model,
        what `hold` made of it, and a `Law`.
    K : array, shape (1, states), optional
        Gains, where they are not the second argument.
    period : float
        Of matrices that belong to a sampled loop [s]; 0 for a continuous one.

    Returns
    -------
    Margins
        `least_gain` and `most_gain` as factors, `phase` [rad], `delay` [s], `modulus`.

    Raises
    ------
    BadInput
        When the loop cannot be read, has several inputs or outputs, or is not stable.
    """
    from upright.gains import margins as as_it_runs
    from upright.gains.margins import loop_margins

    if len(system) == 3 and isinstance(system[0], Linear) and isinstance(system[2], Law):
        return as_it_runs(*system)
    given, names = list(system), ("K",) if K is not None or len(system) == 2 else ()
    model, rest = read_model(tuple(given), "margins", names, (K,))
    period = model.period or period
    if names:
        gains = np.atleast_2d(np.asarray(rest[0], dtype=np.float64))
        if model.B.shape[1] != 1 or gains.shape != (1, model.A.shape[0]):
            raise BadInput(
                f"margins are for one input, with K of shape (1, {model.A.shape[0]}), got {model.B.shape[1]} inputs "
                f"and K of shape {gains.shape}."
            )
        return loop_margins(model.A, model.B, gains, 0.0, period)
    if model.D.shape != (1, 1):
        raise BadInput(
            f"margins are those of a loop gain with one input and one output, got {model.D.shape[1]} and "
            f"{model.D.shape[0]}; give the gains K of the state feedback too, or close all loops but one."
        )
    return loop_margins(model.A, model.B, model.C, float(model.D[0, 0]), period)


def prefilter(*system: Any, K: Any = None, output: int | str = 0) -> float:
    """Gain k_pf of ``u = k_pf r - K x`` with which an output comes to rest at the reference r.

    Parameters
    ----------
    *system
        A model with one input, as for `place`, or what `hold` gives; then its gains.
    K : array, shape (1, states)
    output : int or str
        Which output follows, by number or by name.

    Returns
    -------
    float

    Raises
    ------
    BadInput
        When the model cannot be read, has no such output, or a constant command leaves that output at zero.
    """
    from upright.gains import prefilter as static

    model, (gains,) = read_model(system, "prefilter", ("K",), (K,))
    names = model.outputs
    if isinstance(output, str) and output not in names:
        raise BadInput(f"this model has no output '{output}'; {nearest(output, names)}")
    i = names.index(output) if isinstance(output, str) else output
    if not 0 <= i < len(names):
        raise BadInput(f"output is a number from 0 to {len(names) - 1} or one of {', '.join(names)}, got {output}.")
    k = np.atleast_2d(np.asarray(gains, dtype=np.float64))
    if k.shape != (1, model.A.shape[0]) or model.B.shape[1] != 1:
        raise BadInput(
            f"a prefilter is for one input and K of shape (1, {model.A.shape[0]}), got {model.B.shape[1]} inputs and "
            f"K of shape {k.shape}."
        )
    return static(model.A, model.B, model.C[i], k, D=float(model.D[i, 0]), sampled=model.period > 0)


@dataclass(frozen=True, kw_only=True)
class NamedModel:
    """A linear model as it was handed over; `bare` where it came as arrays, which say no period."""

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    point: Mapping[str, float] | None = None
    period: float = 0.0
    bare: bool = False

    def gains(self, K: Array, poles: NDArray[np.complex128], S: Array | None, sentence: str) -> Gains:
        """Gains found for it."""
        return Gains(
            K=K, poles=poles, S=S, states=self.states, inputs=self.inputs, point=self.point, period=self.period,
            sentence=sentence,
        )  # fmt: skip


def read_model(
    given: tuple[Any, ...], verb: str, names: tuple[str, ...], by_name: tuple[Any, ...]
) -> tuple[NamedModel, Any]:
    """The model that the first arguments name, and the values that follow it."""
    wanted = f'{verb} takes a model and {" and ".join(names)}: {verb}(plant.linear("inverted"), {", ".join(names)}), '
    wanted += f"{verb}(A, B, {', '.join(names)}), or a control.StateSpace in the model's place"
    if not names:
        wanted = f"{verb} takes a loop gain: {verb}(control.StateSpace), {verb}((A, B, C, D)), or {verb}(model, K)"
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
    if hasattr(first, "A") and hasattr(first, "B"):
        model = named_model(verb, first.A, first.B, getattr(first, "C", None), getattr(first, "D", None))
        step = getattr(first, "dt", None) or getattr(first, "period", None)
        model = replace(
            model, states=_labels(first, "state", model.states), inputs=_labels(first, "input", model.inputs),
            outputs=_labels(first, "output", model.outputs), point=getattr(first, "point", None),
            period=float(step) if step else 0.0, bare=False,
        )  # fmt: skip
    elif isinstance(first, tuple) and 2 <= len(first) <= 4:
        model = named_model(verb, *first)
    elif isinstance(first, list | np.ndarray) and rest:
        model = named_model(verb, first, rest.pop(0))
    else:
        raise BadInput(f"{wanted}; got {type(first).__name__}.")
    values = [*rest, *(v for v in by_name if v is not None)]
    if len(values) != len(names):
        raise BadInput(f"{wanted}; {len(values)} of {len(names)} came after the model.")
    return model, values


def _labels(system: Any, kind: str, default: tuple[str, ...]) -> tuple[str, ...]:
    """Names as python-control or `Linear` has them."""
    found = getattr(system, f"{kind}_labels", None)
    found = getattr(system, f"{kind}s", None) if found is None else found
    return tuple(found) if isinstance(found, list | tuple) and len(found) == len(default) else default


def named_model(verb: str, A: Any, B: Any, C: Any = None, D: Any = None) -> NamedModel:
    """Model of plain arrays; every state is measured where C is left out, and nothing comes through where D is."""
    try:
        a = np.atleast_2d(np.asarray(A, dtype=np.float64))
        b = np.asarray(B, dtype=np.float64)
        c = np.eye(len(a)) if C is None else np.atleast_2d(np.asarray(C, dtype=np.float64))
        d = None if D is None else np.asarray(D, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(f"{verb} needs A and B, C and D where they are given, as arrays of real numbers.") from None
    b = b[:, None] if b.ndim == 1 else b
    if a.ndim != 2 or a.shape[0] != a.shape[1] or b.ndim != 2 or b.shape[0] != a.shape[0]:
        raise BadInput(f"{verb} needs A of shape (n, n) and B of shape (n, m), got {a.shape} and {b.shape}.")
    if c.ndim != 2 or c.shape[1] != a.shape[0]:
        raise BadInput(f"{verb} needs C of shape (p, {a.shape[0]}), got {c.shape}.")
    if not all(np.isfinite(matrix).all() for matrix in (a, b, c) + (() if d is None else (d,))):
        raise BadInput(f"{verb} needs matrices of finite numbers; one of them is infinite or no number at all.")
    through = (c.shape[0], b.shape[1])
    if d is None or not d.any():
        d = np.zeros(through)
    d = d.reshape(1, 1) if d.size == 1 else d
    if d.shape != through:
        raise BadInput(f"{verb} needs D of shape {through}, got {d.shape}.")
    states, inputs, outputs = (
        tuple(f"{letter}[{i}]" for i in range(size)) for letter, size in zip("xuy", (*b.shape, c.shape[0]), strict=True)
    )
    return NamedModel(A=a, B=b, C=c, D=d, states=states, inputs=inputs, outputs=outputs, bare=True)


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
