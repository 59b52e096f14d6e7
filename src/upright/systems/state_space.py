"""Linear state-space model, continuous or sampled: poles, zeros, frequency response, other programs' forms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput, nearest
from upright.shown import Shown
from upright.systems.discretization import Matrices, held, with_past_commands
from upright.systems.motion import march

Array = NDArray[np.float64]
Roots = NDArray[np.complex128]


class HasMatrices(Protocol):
    """A linear model of another package by its matrices, such as `control.StateSpace`."""

    A: Any
    B: Any


class HasPolynomials(Protocol):
    """A transfer function of another package, such as `control.TransferFunction`."""

    num: Any
    den: Any


@dataclass(frozen=True, eq=False, repr=False)
class StateSpace(Shown):
    """Linear model ``x' = A x + B u, y = C x + D u``; with a period `dt`, ``x[k+1] = A x[k] + B u[k]``.

    It unpacks as ``A, B, C, D`` (a sampled one with its dt behind them), so that ``control.ss(*model)`` and
    ``scipy.signal.StateSpace(*model[:4])`` take it. `to_control` keeps the names of its signals. python-control takes
    nothing but its own classes, so ``control.ss(model)`` is its TypeError.

    Parameters
    ----------
    A : array, shape (n, n)
    B : array, shape (n, m) or (n,)
    C : array, shape (p, n), optional
        Every state is measured when omitted.
    D : array, shape (p, m), optional
        Zero when omitted.
    dt : float, optional
        Time between samples [s]; None for a continuous model.
    states, inputs, outputs : sequence of str, optional
        Names of the signals; ``x[0], u[0], y[0], ...`` when omitted.
    units : mapping of str to str, optional
        Units of signals, by name; what has none is a pure number.
    name : str, optional
    point : mapping of str to float, optional
        Equilibrium about which the model holds, by coordinate [SI]; the model's states are deviations from it.
    continuous : StateSpace, optional
        Of a sampled model, what was discretised.
    delay : float
        Of a sampled model, how late a command acts [samples].
    lag : float
        Of a sampled model, the drive's time constant [s].

    Raises
    ------
    BadInput
        When the sizes of the matrices do not fit each other, a number is not finite, or the period is not positive.
    """

    A: Array
    B: Array
    C: Array = None  # type: ignore[assignment] # filled in below
    D: Array = None  # type: ignore[assignment]
    dt: float | None = None
    states: Sequence[str] = field(default=(), kw_only=True)
    inputs: Sequence[str] = field(default=(), kw_only=True)
    outputs: Sequence[str] = field(default=(), kw_only=True)
    units: Mapping[str, str] = field(default_factory=dict[str, str], kw_only=True)
    name: str = field(default="", kw_only=True)
    point: Mapping[str, float] | None = field(default=None, kw_only=True)
    continuous: StateSpace | None = field(default=None, kw_only=True)
    delay: float = field(default=0.0, kw_only=True)
    lag: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        matrices = _matrices(self.A, self.B, self.C, self.D)
        for name, matrix in zip("ABCD", matrices, strict=True):
            object.__setattr__(self, name, matrix)
        if self.dt is not None and not 0 < self.dt < math.inf:
            raise BadInput(f"a sampled model needs its period dt in seconds, above 0, got {self.dt!r:.40}.")
        sizes = {"states": ("x", self.A.shape[0]), "inputs": ("u", self.B.shape[1]), "outputs": ("y", len(self.C))}
        for kind, (letter, size) in sizes.items():
            names = tuple(getattr(self, kind)) or tuple(f"{letter}[{i}]" for i in range(size))
            if len(names) != size:
                raise BadInput(f"{kind} needs {size} names, got {len(names)}: {', '.join(names)}.")
            object.__setattr__(self, kind, names)

    @property
    def period(self) -> float:
        """Time between samples [s].

        Raises
        ------
        BadInput
            When the model is continuous.
        """
        if self.dt is None:
            raise BadInput("this model is continuous and has no period; sample it with up.hold(model, period).")
        return self.dt

    @property
    def unit(self) -> str:
        """Unit of the first command; empty for a pure number."""
        return self.units.get(self.inputs[0], "") if self.inputs else ""

    @property
    def state_units(self) -> list[str]:
        """Unit of every state."""
        return [self.units.get(name, "1") for name in self.states]

    @property
    def output_units(self) -> list[str]:
        """Unit of every output."""
        return [self.units.get(name, "1") for name in self.outputs]

    @property
    def remembered(self) -> int:
        """How many states are not the plant's: what the drive gives, and commands on their way."""
        return (math.ceil(self.delay - 1e-12) + (self.lag > 0)) * self.B.shape[1]

    def __iter__(self) -> Any:
        return iter((self.A, self.B, self.C, self.D) if self.dt is None else (self.A, self.B, self.C, self.D, self.dt))

    def __getitem__(self, key: Any) -> Any:
        """``model[output, input]``, by name or number: the model of these signals alone; ``model[:4]`` its matrices."""
        if isinstance(key, slice):
            return tuple(self)[key]
        output, command = key if isinstance(key, tuple) and len(key) == 2 else (key, slice(None))
        i, j = _chosen(output, self.outputs, "output"), _chosen(command, self.inputs, "input")
        return replace(
            self, B=self.B[:, j], C=self.C[i], D=self.D[np.ix_(i, j)], outputs=[self.outputs[k] for k in i],
            inputs=[self.inputs[k] for k in j], continuous=None if self.continuous is None else self.continuous[key],
        )  # fmt: skip

    def poles(self) -> Roots:
        """Eigenvalues of A [1/s; z of a sampled model], the fastest growing first."""
        poles = np.linalg.eigvals(self.A).astype(np.complex128)
        growth = poles.real if self.dt is None else np.abs(poles)
        return poles[np.lexsort((poles.imag, -growth))]

    def zeros(self) -> Roots:
        """Invariant zeros of a model with as many outputs as inputs [1/s; z of a sampled model], the rightmost first.

        Finite eigenvalues of the pencil ``[[A, B], [C, D]] - s [[I, 0], [0, 0]]`` (Emami-Naeini and Van Dooren,
        Automatica 18, 1982).

        Raises
        ------
        BadInput
            When outputs and inputs are not equally many.
        """
        import scipy.linalg

        n, (p, m) = self.A.shape[0], self.D.shape
        if p != m:
            raise BadInput(
                f"zeros are those of as many outputs as inputs, and this model has {p} and {m}; choose, as in "
                f'model["{self.outputs[0]}", "{self.inputs[0]}"].zeros().'
            )
        left = np.block([[self.A, self.B], [self.C, self.D]])
        right = np.zeros_like(left)
        right[:n, :n] = np.eye(n)
        scale = max(float(np.abs(self.A).max(initial=0.0)), 1e-300)  # time in the model's own unit
        left[:n] /= scale
        pairs: Any = scipy.linalg.eigvals(left, right, homogeneous_eigvals=True)
        above, below = np.asarray(pairs, dtype=np.complex128)
        finite = np.abs(below) > 1e-10 * np.abs(above)
        finite_zeros = scale * above[finite] / below[finite]
        return finite_zeros[np.lexsort((finite_zeros.imag, -finite_zeros.real))]

    def damping(self) -> tuple[Array, Array, Roots]:
        """Natural frequency [rad/s] and damping ratio of every pole, and the pole, as python-control's `damp`."""
        poles = self.poles()
        s = poles
        if self.dt is not None:
            with np.errstate(divide="ignore"):
                s = np.log(poles.astype(np.complex128)) / self.dt
        size = np.abs(s)
        return size, np.where(size > 0, -s.real / np.where(size > 0, size, 1.0), 1.0), poles

    def response(self, omega: ArrayLike) -> Roots:
        """Frequency response, shape (len(omega), outputs, inputs), at angular frequencies `omega` [rad/s]."""
        s = 1j * np.atleast_1d(np.asarray(omega, dtype=np.float64))
        s = s if self.dt is None else np.exp(s * self.dt)
        n = self.A.shape[0]
        gap = s[:, None, None] * np.eye(n) - self.A
        return self.C @ np.linalg.solve(gap, np.broadcast_to(self.B.astype(np.complex128), (len(s), *self.B.shape))) + (
            self.D
        )

    def step(self, seconds: float, *, command: str | int = 0, samples: int = 1001) -> tuple[Array, Array]:
        """Times (T,) [s] and outputs (T, p) from rest after a unit step of one command.

        Parameters
        ----------
        seconds : float
            How long.
        command : str or int
            Which one steps.
        samples : int
            Of a continuous model, evenly over these seconds, exact at each; a sampled one has its own.

        Raises
        ------
        BadInput
            When there is no such command, or no time passes.
        """
        if not (math.isfinite(seconds) and seconds > 0 and samples > 1):
            raise BadInput(f"a step response takes more than 0 s and one sample, got {seconds!r:.20} s.")
        sampled = self.to_sampled(seconds / (samples - 1)) if self.dt is None else self
        (j,) = _chosen(command, self.inputs, "input")[:1]
        u = np.zeros((math.floor(seconds / sampled.period * (1 + 1e-12)) + 1, len(self.inputs)))
        u[:, j] = 1.0
        x, u = march(sampled.A, sampled.B, u, np.zeros(len(sampled.A)))
        return sampled.period * np.arange(len(x), dtype=np.float64), x @ sampled.C.T + u @ sampled.D.T

    def to_sampled(self, period: float, delay: float = 0.0, lag: float = 0.0, *, method: str = "zoh") -> StateSpace:
        """The model at its samples, exactly; see `held`.

        Parameters
        ----------
        period : float
            Time between samples [s].
        delay : float
            How late a command acts [samples]: computation, converters, drive. Not only whole ones; a model that is
            sampled already takes whole ones.
        lag : float
            Time constant with which the drive follows its command [s].
        method : {"zoh", "foh"}
            Each command stays until the next, or runs straight to it, as a logged force does.

        Returns
        -------
        StateSpace
            Its states are those of this model, then what a drive with lag gives, then the commands still on their way.

        Raises
        ------
        BadInput
            When the period is not positive, the delay negative or beyond 1000 samples, the lag negative, or a sampled
            model is evaluated between its samples.
        """
        if not (math.isfinite(period) and period > 0):
            raise BadInput(f"a sampled model needs a period above 0 s, got {period:g}; give it in seconds.")
        if not 0 <= delay <= 1000:
            raise BadInput(f"the delay must be between 0 and 1000 samples, got {delay:g}; give it in samples.")
        if not (math.isfinite(lag) and lag >= 0):
            raise BadInput(f"the drive's lag must be at least 0 s, got {lag:g}; give it in seconds.")
        if method not in ("zoh", "foh"):
            raise BadInput(f'a hold is of order zero, "zoh", or one, "foh", got {method!r}.')
        if self.dt is not None:
            return self._delayed(period, delay, lag)
        matrices = held(self.A, self.B, self.C, self.D, period, delay, lag, method == "foh")
        inputs = tuple(f"{u} given" for u in self.inputs) if lag > 0 else ()
        return self._with(matrices, inputs, delay, dt=period, lag=lag, continuous=self)

    def _delayed(self, period: float, delay: float, lag: float) -> StateSpace:
        """A sampled model with commands some whole samples later."""
        if not math.isclose(period, self.period, rel_tol=1e-9):
            raise BadInput(
                f"this model is sampled already, with a period of {self.period:g} s, and {period:g} s is another; give "
                "the continuous model."
            )
        if lag or delay != math.floor(delay):
            raise BadInput(
                f"a model known at its samples alone takes no lag, and a delay of 0 to 1000 whole samples, got "
                f"{1e3 * lag:g} ms and {delay:g}; put them into the matrices, or give a continuous model."
            )
        if self.delay or self.lag:
            raise BadInput("this sampled model has a delay or a lag already; sample the continuous one again.")
        return self._with(with_past_commands(self.A, {int(delay): self.B}, self.C, self.D, delay), (), delay)

    def _with(self, matrices: Matrices, inputs: Sequence[str], delay: float, **fields: Any) -> StateSpace:
        """The same signals and point about other matrices, with the states that drive and delay add."""
        ago = [f"{u} {k} ago" for k in range(1, math.ceil(delay - 1e-12) + 1) for u in self.inputs]
        A, B, C, D = matrices
        return replace(self, A=A, B=B, C=C, D=D, delay=delay, states=(*self.states, *inputs, *ago), **fields)

    def to_control(self) -> Any:
        """The same model as a `control.StateSpace` with named signals.

        ``control.ss2tf(model["psi", "T"].to_control()).minreal()`` is a transfer function of it.
        """
        import control

        names = {"states": list(self.states), "inputs": list(self.inputs), "outputs": list(self.outputs)}
        return control.StateSpace(self.A, self.B, self.C, self.D, self.dt or 0, **names)

    @classmethod
    def of(cls, model: LinearForm) -> StateSpace:
        """The linear model that any of the usual forms stands for.

        Parameters
        ----------
        model : StateSpace, control.StateSpace, control.TransferFunction, or tuple of arrays (A, B[, C[, D[, dt]]])

        Raises
        ------
        BadInput
            When it is none of these, its matrices do not make a model, or it is sampled without saying its period.
        """
        if isinstance(model, cls):
            return model
        if hasattr(model, "reference_names"):
            raise BadInput("a linear model of what is controlled is needed, and this is a law.")
        if hasattr(model, "num") and hasattr(model, "den"):
            model = _realised(model)
        if hasattr(model, "A") and hasattr(model, "B"):
            step = getattr(model, "dt", None)
            if step is True:
                raise BadInput("this sampled model does not say its period; give its dt in seconds.")
            A, B, C, D = (getattr(model, letter, None) for letter in "ABCD")
            bare = cls(A, B, C, D, step or None)  # type: ignore[arg-type]
            names: Any = {f"{kind}s": _labels(model, kind, getattr(bare, f"{kind}s")) for kind in _KINDS}
            return replace(bare, name=str(getattr(model, "name", "") or "linear model"), **names)
        if isinstance(model, tuple | list) and 2 <= len(model) <= 5:  # type: ignore[reportUnknownArgumentType]
            A, B, C, D, step = (*model, None, None, None)[:5]  # type: ignore[reportUnknownVariableType]
            return cls(A, B, C, D, step or None)  # type: ignore[reportUnknownArgumentType]
        raise BadInput(
            'a linear model is needed: plant.linear("inverted"), a control.StateSpace or TransferFunction, or arrays '
            f"(A, B[, C[, D]]); got {type(model).__name__}."
        )


LinearForm = StateSpace | HasMatrices | HasPolynomials | Sequence[ArrayLike]
"""What `StateSpace.of` reads: a model of this package or of python-control, or arrays ``(A, B[, C[, D[, dt]]])``."""


def _realised(transfer: Any) -> Any:
    """State space of a `control.TransferFunction`."""
    import control

    try:
        return control.tf2ss(transfer)
    except Exception as error:
        raise BadInput(
            f"this transfer function has no state space here ({error}); give one input and one output, or "
            "a control.StateSpace."
        ) from None


_KINDS = ("state", "input", "output")


def _labels(system: Any, kind: str, default: Sequence[str]) -> Sequence[str]:
    """Names as python-control or a plain object has them."""
    labels = getattr(system, f"{kind}_labels", None)
    labels = getattr(system, f"{kind}s", None) if labels is None else labels
    fits = isinstance(labels, list | tuple) and len(labels) == len(default)  # type: ignore[reportUnknownArgumentType]
    return tuple(labels) if fits else default  # type: ignore[reportUnknownArgumentType]


def _chosen(key: Any, names: Sequence[str], kind: str) -> list[int]:
    """Numbers of the signals that a key names."""
    if isinstance(key, slice):
        return list(range(len(names)))[key]
    if isinstance(key, str) and key not in names:
        raise BadInput(f"this model has no {kind} '{key}'; {nearest(key, names)}")
    if isinstance(key, list | tuple):
        return [i for one in key for i in _chosen(one, names, kind)]  # type: ignore[reportUnknownVariableType]
    i = list(names).index(key) if isinstance(key, str) else key
    if not isinstance(i, int | np.integer) or not 0 <= i < len(names):
        raise BadInput(f"{kind} is a number from 0 to {len(names) - 1} or one of {', '.join(names)}, got {key!r:.40}.")
    return [int(i)]


def _matrices(A: Any, B: Any, C: Any, D: Any) -> tuple[Array, Array, Array, Array]:
    """The four matrices, two-dimensional and of sizes that fit."""
    try:
        a = np.array(A, dtype=np.float64, ndmin=2)
        b = np.array(B, dtype=np.float64)
        c = np.eye(len(a)) if C is None else np.array(C, dtype=np.float64, ndmin=2)
        d = None if D is None else np.array(D, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(
            "a linear model needs A and B, C and D where they are given, as arrays of real numbers."
        ) from None
    if a.size == 0 and d is not None and d.ndim == 2:  # a gain without states
        a, b, c = np.zeros((0, 0)), np.zeros((0, d.shape[1])), np.zeros((d.shape[0], 0))
    b = b.reshape(-1, 1) if b.ndim < 2 else b
    if a.ndim != 2 or a.shape[0] != a.shape[1] or b.ndim != 2 or b.shape[0] != a.shape[0]:
        raise BadInput(f"a linear model needs A of shape (n, n) and B of shape (n, m), got {a.shape} and {b.shape}.")
    if c.ndim != 2 or c.shape[1] != a.shape[0]:
        raise BadInput(f"a linear model of {a.shape[0]} states needs C of shape (p, {a.shape[0]}), got {c.shape}.")
    through = (c.shape[0], b.shape[1])
    if d is None or not d.any():
        d = np.zeros(through)
    d = d.reshape(1, 1) if d.size == 1 else d
    if d.shape != through:
        raise BadInput(f"a linear model of these sizes needs D of shape {through}, got {d.shape}.")
    if not all(np.isfinite(matrix).all() for matrix in (a, b, c, d)):
        raise BadInput(
            "a linear model needs finite numbers; one of its matrices holds an infinite one, or none at all."
        )
    return a, b, c, d
