"""A loop around a linear model: gains by poles or by LQR, its model at the samples, prefilter and margins."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput, nearest
from upright.laws import Law
from upright.physics import Plant
from upright.renamed import outside
from upright.shown import Shown
from upright.systems import LinearForm, StateSpace

if TYPE_CHECKING:
    from upright.gains import Estimator, Margins

Array = NDArray[np.float64]
P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Gains(Shown):
    """State feedback ``u = -K x`` for one linear model; where an array is expected, it is K.

    It unpacks as ``K, S, E = gains``, as python-control's `lqr` does.

    Attributes
    ----------
    K : array, shape (inputs, states)
    poles : array, shape (states,)
        Of the closed loop [1/s, or z of a sampled model].
    S : array or None
        Solution of the Riccati equation; None where poles were placed, since no cost was minimised.
    model : StateSpace
        What they were computed for; a simulation takes its point and its period.
    sentence : str
        How well conditioned the gains are.
    """

    K: Array
    poles: NDArray[np.complex128]
    S: Array | None
    model: StateSpace
    sentence: str

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.K, dtype=dtype or np.float64)

    def __iter__(self) -> Iterator[Any]:
        return iter((self.K, self.S, self.poles))

    def __len__(self) -> int:
        return 3

    def __getitem__(self, key: Any) -> Any:
        return self.K[key]

    def __matmul__(self, other: Any) -> Any:
        return self.K @ np.asarray(other)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of K."""
        return self.K.shape

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, a column of K each."""
        return tuple(self.model.states)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the commands, a row of K each."""
        return tuple(self.model.inputs)

    @property
    def point(self) -> Mapping[str, float] | None:
        """Equilibrium about which the model holds, by coordinate; None for a model that names none."""
        return self.model.point

    @property
    def period(self) -> float | None:
        """Period of a sampled model [s]; None for a continuous one."""
        return self.model.dt

    def to_pandas(self) -> Any:
        """K as a table, an input per row and a state per column."""
        import pandas as pd

        return pd.DataFrame(self.K, index=list(self.inputs), columns=list(self.states))


def _model_first(verb: Callable[P, R]) -> Callable[P, R]:
    """A function of a linear model that says its form when it is called otherwise.

    Loose arrays ``A, B`` in front are taken for ``(A, B)``, for one version with a warning.
    """
    about = signature(verb)
    name = verb.__name__

    @wraps(verb)
    def called(*args: Any, **kwargs: Any) -> Any:
        if len(args) > 1 and isinstance(args[0], list | np.ndarray):
            warnings.warn(
                f"{name}(A, B, ...) is going: put the matrices into one argument, {name}((A, B), ...).",
                DeprecationWarning, stacklevel=outside(),
            )  # fmt: skip
            args = ((args[0], args[1]), *args[2:])
        try:
            bound = about.bind(*args, **kwargs)
        except TypeError as error:
            raise BadInput(f"{name} is called as {name}{_form(about)}: {error}.") from None
        return verb(*bound.args, **bound.kwargs)

    return called


def _form(about: Any) -> str:
    """Arguments of a call without their types."""
    shown = [p.replace(annotation=p.empty) for p in about.parameters.values()]
    return str(about.replace(parameters=shown, return_annotation=about.empty))


def _read(model: LinearForm, verb: str) -> StateSpace:
    plant = model if isinstance(model, Plant) else getattr(model, "plant", None)
    if isinstance(plant, Plant):
        raise BadInput(
            f"{verb} takes a linear model, and {type(plant).__name__} is none; say about which equilibrium: "
            + " or ".join(f'.linear("{at}")' for at in plant.equilibria)
            + "."
        )
    try:
        return StateSpace.of(model)
    except BadInput as error:
        raise BadInput(f"{verb}: {error}") from None


@_model_first
def place(model: LinearForm, poles: str | ArrayLike) -> Gains:
    """Gains that put the poles of a linear model where requested, by Ackermann's formula.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B)
        Such as ``plant.linear("inverted")``, or what `hold` gives.
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
    >>> up.place(([[0, 1], [4, 0]], [0, 1]), [-2, -3]).K
    array([[10.,  5.]])
    """
    from upright.gains import place as placed
    from upright.gains.requests import read_poles

    model = _read(model, "place")
    wanted = read_poles(poles) if isinstance(poles, str) else _complex(poles)
    placement = placed(model.A, model.B, wanted)
    sentence = " ".join(filter(None, (_unstable(wanted, model.dt), placement.sentence)))
    return Gains(K=placement.K, poles=placement.attained, S=None, model=model, sentence=sentence)


def _unstable(poles: NDArray[np.complex128], period: float | None) -> str:
    """The warning that a loop with such poles does not come to rest; empty of one that does."""
    from upright.gains.requests import written

    out = poles[poles.real >= 0] if period is None else poles[np.abs(poles) >= 1]
    if not out.size:
        return ""
    where = "left of 0 1/s" if period is None else "within |z| < 1, since the model is sampled"
    return f"Warning: this loop is not stable. Its poles must lie {where}; requested {written(out)}."


@_model_first
def lqr(model: LinearForm, Q: str | ArrayLike, R: str | ArrayLike) -> Gains:
    """LQR gains, which minimise the integral of ``x' Q x + u' R u``; ``K, S, E = lqr(...)`` as python-control gives it.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B)
        Of a sampled model the sum over its samples is minimised, as by `dlqr`.
    Q : array, shape (states, states) or (states,), or text
        Weights of the states; one number for each is the diagonal: ``[1, 0, 1, 0]`` or ``"1, 0, 1, 0"``.
    R : array, shape (inputs, inputs) or (inputs,), or float
        Weights of the inputs.

    Returns
    -------
    Gains
        With the solution `S` of the Riccati equation.

    Raises
    ------
    BadInput
        When the model or a weight cannot be read or has another size, or no such gains exist.
    """
    model = _read(model, "lqr")
    return _of_least_cost(model, Q, R)


@_model_first
def dlqr(model: LinearForm, Q: str | ArrayLike, R: str | ArrayLike) -> Gains:
    """LQR gains of a sampled model, which minimise the sum of ``x' Q x + u' R u``; ``K, S, E = dlqr(...)``.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B)
        What `hold` gives, or any model with its period; arrays without one are taken for a model at its samples.
    Q, R
        Weights of the states and of the inputs, as for `lqr`; R may be 0 where ``B' S B`` is not.

    Returns
    -------
    Gains
        Poles are those in z.

    Raises
    ------
    BadInput
        When the model is continuous, it or a weight cannot be read, or no such gains exist.
    """
    model = _read(model, "dlqr")
    if model.dt is None:
        if model.point is not None or model.name:
            raise BadInput("dlqr takes a sampled model, and this one is continuous; sample it with hold, or use lqr.")
        model = replace(model, dt=1.0)
    return _of_least_cost(model, Q, R)


def _of_least_cost(model: StateSpace, Q: Any, R: Any) -> Gains:
    from upright.gains.lqr import least_cost

    n, m = model.B.shape
    q, r = _weights(Q, n, "Q", "states"), _weights(R, m, "R", "inputs")
    K, S, E = least_cost(model.A, model.B, q, r, sampled=model.dt is not None, states=tuple(model.states))
    return Gains(K=K, poles=E, S=S, model=model, sentence="")


@_model_first
def hold(
    model: LinearForm, period: float | str, delay: float = 0.0, lag: float = 0.0, method: str = "zoh"
) -> StateSpace:
    """A continuous linear model at its samples, exactly.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B[, C[, D]])
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
    StateSpace
        With `dt`; its first states are the model's, about the same point.

    Raises
    ------
    BadInput
        When the model cannot be read or is sampled already, or a time is impossible.
    """
    from upright.verbs.values import si

    model = _read(model, "hold")
    if model.dt is not None:
        raise BadInput(f"hold samples a continuous model, and this one has a period of {model.dt:g} s already.")
    return model.to_sampled(si(period, "s"), delay, lag, method=method)


@_model_first
def observer(model: LinearForm, poles: str | ArrayLike) -> Estimator:
    """Observer of a sampled model whose error decays with the requested poles.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B, C, D, dt)
        Sampled, such as what `hold` gives.
    poles : text or sequence of complex
        In z, one for each state but those of drive and delay.

    Returns
    -------
    Estimator
        ``z[k+1] = A z[k] + B y[k] + E u[k]``, states ``x[k] = C z[k] + D y[k]``.

    Raises
    ------
    BadInput
        When the model is continuous, the outputs do not show a mode, or the poles cannot be had.
    """
    from upright.gains import placed_observer
    from upright.gains.requests import read_poles

    model = _read(model, "observer")
    if model.dt is None:
        raise BadInput("observer takes a sampled model, and this one is continuous; sample it: hold(model, period).")
    return placed_observer(model, read_poles(poles) if isinstance(poles, str) else _complex(poles))


@_model_first
def margins(model: LinearForm, K: ArrayLike | Gains | Law | None = None) -> Margins:
    """How much a loop stands: gain, phase and delay margins, its least distance to -1, and every crossing.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B[, C[, D[, dt]]])
        A loop gain of one input and one output with negative feedback around it; or, with K, what is controlled.
    K : array, shape (1, states), Gains, or Law, optional
        Gains of ``u = -K x``; or a sampled `Law` around a model that `hold` made, as a computer runs it.

    Returns
    -------
    Margins
        `least_gain` and `most_gain` as factors, `phase` [rad], `delay` [s], `modulus`; `gain_crossings` and
        `phase_crossings` with every frequency [rad/s] and the margin there.

    Raises
    ------
    BadInput
        When the loop cannot be read, has several inputs or outputs, or is not stable.
    """
    from upright.gains import margins as as_it_runs
    from upright.gains.margins import loop_margins

    model = _read(model, "margins")
    if isinstance(K, Law):
        if model.dt is None:
            raise BadInput("margins of a Law need the model at its samples: margins(hold(model, law.period), law).")
        return as_it_runs(model, K)
    period = model.dt or 0.0
    if K is not None:
        gains = _row_of_gains(K)
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


@_model_first
def prefilter(model: LinearForm, K: ArrayLike | Gains, output: int | str = 0) -> float:
    """Gain k_pf of ``u = k_pf r - K x`` with which an output comes to rest at the reference r.

    Parameters
    ----------
    model : StateSpace, control.StateSpace or TransferFunction, or arrays (A, B, C[, D])
        With one input.
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

    model = _read(model, "prefilter")
    names = model.outputs
    if isinstance(output, str) and output not in names:
        raise BadInput(f"this model has no output '{output}'; {nearest(output, names)}")
    i = names.index(output) if isinstance(output, str) else output
    if not isinstance(i, int | np.integer) or not 0 <= i < len(names):  # type: ignore[reportUnnecessaryIsInstance]
        raise BadInput(f"output is a number from 0 to {len(names) - 1} or one of {', '.join(names)}, got {output}.")
    k = _row_of_gains(K)
    if k.shape != (1, model.A.shape[0]) or model.B.shape[1] != 1:
        raise BadInput(
            f"a prefilter is for one input and K of shape (1, {model.A.shape[0]}), got {model.B.shape[1]} inputs and "
            f"K of shape {k.shape}."
        )
    return static(model.A, model.B, model.C[i], k, D=float(model.D[i, 0]), sampled=model.dt is not None)


def _complex(poles: Any) -> NDArray[np.complex128]:
    try:
        return np.atleast_1d(np.asarray(poles, dtype=np.complex128))
    except (TypeError, ValueError):
        raise BadInput(f'poles are complex numbers, or a text such as "-4+-2j, -17, -3"; got {poles!r:.60}.') from None


def _row_of_gains(K: Any) -> Array:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", np.exceptions.ComplexWarning)
            gains = np.atleast_2d(np.asarray(K, dtype=np.float64))
        if not np.isfinite(gains).all():
            raise ValueError
        return gains
    except (TypeError, ValueError, np.exceptions.ComplexWarning):
        raise BadInput(f"K holds the gains of u = -K x, real numbers, one for each state, got {K!r:.40}.") from None


def _weights(weights: Any, size: int, name: str, of: str) -> Array:
    try:
        w = np.asarray(
            [float(x) for x in weights.split(",")] if isinstance(weights, str) else weights, dtype=np.float64
        )
    except (TypeError, ValueError):
        raise BadInput(
            f"{name} takes numbers, one for each of the {size} {of}, or a matrix; got {weights!r:.60}."
        ) from None
    w = np.diag(np.atleast_1d(w)) if w.ndim < 2 else w
    if w.shape != (size, size):
        raise BadInput(f"{name} needs shape {(size, size)}, or {size} numbers for its diagonal, got {w.shape}.")
    return w
