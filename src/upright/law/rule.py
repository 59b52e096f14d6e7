"""Which sampled law closes the loop, when no matrices can say it: one that switches, swings up, limits, adapts?

The law is a Python function of numbers. Its text is compiled into the kernel beside the plant, so that ten thousand
motions under it run at the kernel's speed; the same function can be called sample by sample on a rig.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.law.linear import shared

Array = NDArray[np.float64]
Numbers = tuple[float, ...]
Function = Callable[[float, Any, Any, Any, Any], tuple[Any, Any]]

KNOWN = frozenset({"sin", "cos", "tan", "exp", "sqrt", "floor", "pi"})
"""Names from `math` that the function may use."""
_BUILT_IN = frozenset({"abs", "min", "max", "float", "int", "range", "len", "round", "bool"})
_SIGNATURE = 5


@dataclass(frozen=True)
class Written:
    """What of a rule is compiled in: its text and the sizes of what goes in and out."""

    text: str
    states: int
    references: int
    parameters: int

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of its per-lane numbers: parameters, then its state."""
        return tuple([f"rp{i}" for i in range(self.parameters)] + [f"z{i}" for i in range(self.states)])


@dataclass(frozen=True, kw_only=True, eq=False)
class Rule:
    """Sampled controller given as a function, evaluated at every sample, its output held until the next.

    ``u, z = function(t, y, r, z, p)`` with the time since the first sample of `references`, the readings of the
    encoders, the references, what it remembers and its parameters, all tuples of floats; it returns the commands and
    what it remembers next, as tuples. The command is rounded and limited as that of a `Law`. ::

        def hop(t, y, r, z, p):
            push = p[0] if y[0] < z[0] else -p[0]
            return (push,), (y[0],)

        simulate(cart, {}, x0, None, 1e-3, samples=2000, loop=Rule(function=hop, initial=[0.0], parameters=[2.0]))

    Attributes
    ----------
    function : callable
        A plain function of those five arguments, defined in a file or notebook. It uses arithmetic, ``abs, min,
        max``, names of `KNOWN` imported from `math`, and numbers of its own; what it needs else is a parameter.
    initial : array, shape (z,) or (z, lanes)
        What it remembers at a lane's first sample.
    parameters : array, shape (p,) or (p, lanes)
    references : array, shape (T,) or (T, references), optional
        Reference signals at the samples; the last values are held.
    quantum, delay, command_quantum
        As those of a `Law`.
    """

    function: Function
    initial: ArrayLike = ()
    parameters: ArrayLike = ()
    references: ArrayLike | None = None
    quantum: ArrayLike = 0.0
    delay: float = 0.0
    command_quantum: ArrayLike = 0.0

    def __post_init__(self) -> None:
        text_of(self.function)
        for name in ("initial", "parameters"):
            if np.ndim(getattr(self, name)) not in (1, 2):
                raise BadInput(f"{name} of a rule needs one axis, or a second for the lanes; give a list of numbers.")
        if not 0.0 <= self.delay < 1e4:
            raise BadInput(f"the rule's delay must be at least 0 samples, got {self.delay:g}; give it in samples.")
        if np.any(np.asarray(self.quantum) < 0.0) or np.any(np.asarray(self.command_quantum) < 0.0):
            raise BadInput("a quantum must be at least 0, which means no rounding.")
        r = self.signal()
        if r.ndim != 2 or (r.shape[1] > 0 and r.shape[0] == 0) or not np.isfinite(r).all():
            raise BadInput(f"references need finite values in shape (T, references), got {r.shape}.")

    @property
    def sizes(self) -> Written:
        """What is compiled in."""
        return Written(
            text=text_of(self.function),
            states=np.shape(self.initial)[0],
            references=self.signal().shape[1],
            parameters=np.shape(self.parameters)[0],
        )

    def widths(self) -> dict[str, int]:
        """Lanes that each array is given for."""
        shapes = {name: np.shape(getattr(self, name)) for name in ("initial", "parameters")}
        return {name: shape[1] if len(shape) == 2 else 1 for name, shape in shapes.items()}

    def signal(self) -> Array:
        """References, shape (T, references)."""
        if self.references is None:
            return np.zeros((1, 0))
        r: Array = np.asarray(self.references, dtype=np.float64)
        return np.ascontiguousarray(r[:, None] if r.ndim == 1 else r)

    def scalars(self, n: int, nu: int) -> Array:
        """What all lanes share, as the kernel reads it: see `Loop.scalars`."""
        return shared(self.quantum, self.command_quantum, n, nu, (0.0, 0.0, self.delay))

    def rows(self, n: int, nu: int, lanes: int) -> Array:
        """Parameters and first memory as the kernel reads them, shape (numbers, lanes)."""
        parts: list[Array] = []
        for name in ("parameters", "initial"):
            a: Array = np.asarray(getattr(self, name), dtype=np.float64)
            if a.ndim == 2 and a.shape[1] not in (1, lanes):
                raise BadInput(f"{name} of the rule is given for {a.shape[1]} lanes, where there are {lanes}.")
            parts.append(np.broadcast_to(a.reshape(len(a), -1) if a.size else np.zeros((0, lanes)), (len(a), lanes)))
        with suppress(ZeroDivisionError):  # compiled, it would go on with infinity
            u, z = self.function(0.0, (0.0,) * n, _tuple(self.signal()[0]), *(_tuple(p[:, 0]) for p in parts[::-1]))
            for what, got, needed in (("commands", len(u), nu), ("numbers to remember", len(z), len(parts[1]))):
                if got != needed:
                    raise BadInput(f"a rule here must return {needed} {what}, and this one returns {got}.")
        return np.concatenate(parts)

    def replay(self, y: ArrayLike, dt: float, lane: int = 0) -> tuple[Array, Array]:
        """Commands and memory that the function has for given readings, called sample by sample as on a rig.

        Parameters
        ----------
        y : array, shape (T, coordinates), or (T,) of one
            As the encoders show them.
        dt : float
            Sample time [s].
        lane : int
            Whose parameters and first memory.

        Returns
        -------
        commands, shape (T, inputs), before limit and rounding; memory at each sample, shape (T, z)
        """
        readings: Array = np.asarray(y, dtype=np.float64)
        readings = readings[:, None] if readings.ndim == 1 else readings
        both = [np.asarray(getattr(self, n), dtype=np.float64) for n in ("initial", "parameters")]
        z, p = (_tuple(a[:, min(lane, a.shape[1] - 1)] if a.ndim == 2 else a) for a in both)
        r = self.signal()
        commands: list[Numbers] = []
        memory: list[Numbers] = []
        for k, reading in enumerate(readings):
            memory.append(z)
            u, z = self.function(k * dt, _tuple(reading), _tuple(r[min(k, len(r) - 1)]), z, p)
            commands.append(u)
        return np.array(commands), np.array(memory)


@contextmanager
def compiling(rule: Written | None) -> Generator[None]:
    """Say in a sentence what of a rule cannot be compiled."""
    try:
        yield
    except Exception as error:
        if rule is None or type(error).__module__ != "numba.core.errors":
            raise
        why = next((line for line in str(error).splitlines() if "unif" in line or "No impl" in line), "")
        raise BadInput(
            f"the rule cannot be compiled{': ' + why.strip() if why else ''}; keep to floats (0.0, not 0) and return "
            "tuples of one length at every return."
        ) from None


def _tuple(values: Array) -> Numbers:
    return tuple(values.tolist())


@lru_cache(maxsize=64)
def text_of(function: Function) -> str:
    """Text of a function as the kernel takes it, free of comments, types and its own name.

    Raises
    ------
    BadInput
        When it has no text, or needs more than it is given.
    """
    try:
        tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    except (OSError, TypeError, SyntaxError, IndexError):
        raise BadInput("a rule's text could not be read; define it with def, in a file or a notebook.") from None
    if not isinstance(tree, ast.FunctionDef) or len(tree.args.args) != _SIGNATURE:
        raise BadInput("a rule is a function with the arguments t, y, r, z, p, defined with def.")
    name = tree.name
    for arg in tree.args.args:
        arg.annotation = None
    tree.name, tree.returns, tree.decorator_list = "rule", None, []
    names = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    made = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    if outside := sorted(names - made - {a.arg for a in tree.args.args} - KNOWN - _BUILT_IN):
        raise BadInput(
            f"the rule '{name}' uses {', '.join(outside)}, which the kernel does not know; pass numbers in "
            f"through its parameters, and take of math only {', '.join(sorted(KNOWN))}."
        )
    if ast.get_docstring(tree) is not None:
        tree.body = tree.body[1:]
    return ast.unparse(tree)
