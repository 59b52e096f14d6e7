"""Sampled law given as a function, where no matrices can say it: one that switches, swings up, limits, adapts.

The law is a Python function of numbers. Its text is compiled into the kernel beside the plant, so that ten thousand
motions under it run at the kernel's speed; the same function can be called sample by sample on a rig.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.laws.linear import FORMER, Controller
from upright.renamed import renamed

Array = NDArray[np.float64]
Numbers = tuple[float, ...]
Function = Callable[[float, Any, Any, Any, Any], tuple[Any, Any]]

KNOWN = frozenset(
    {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "floor", "pi"}
)
"""Names from `math` that the function may use."""
_BUILT_IN = frozenset({"abs", "min", "max", "float", "int", "range", "len", "round", "bool"})
_SIGNATURE = 5


@dataclass(frozen=True)
class Written:
    """What of a `Rule` is compiled in: its text and the sizes of what goes in and out."""

    text: str = field(repr=False)  # it stands in the kernel as it is
    states: int
    references: int
    parameters: int

    @property
    def numbers(self) -> tuple[str, ...]:
        """Names of its per-lane numbers: parameters, then its state."""
        return tuple([f"rp{i}" for i in range(self.parameters)] + [f"z{i}" for i in range(self.states)])


@renamed(FORMER)
@dataclass(frozen=True, kw_only=True, eq=False)
class Rule(Controller):
    """Sampled controller given as a function, evaluated at every sample, its output held until the next.

    ``u, z = function(t, y, r, z, p)`` with the time since the first sample of `references`, the readings of the
    encoders, the references, what it remembers and its parameters, all tuples of floats; it returns the commands and
    what it remembers next, as tuples. ::

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
    measured : tuple of str
        Names of the readings, where it is to be exported.
    """

    function: Function
    initial: ArrayLike = ()
    parameters: ArrayLike = ()
    measured: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        text_of(self.function)
        for name in ("initial", "parameters"):
            if np.ndim(getattr(self, name)) not in (1, 2):
                raise BadInput(f"{name} of a rule needs one axis, or a second for the lanes; give a list of numbers.")
        super().__post_init__()

    @property
    def compiled_in(self) -> Written:
        """What the kernel is written for; everything else is data."""
        return Written(
            text=text_of(self.function),
            states=np.shape(self.initial)[0],
            references=self.signal().shape[1],
            parameters=np.shape(self.parameters)[0],
        )

    def arrays(self) -> dict[str, tuple[Array, int]]:
        """Parameters and first memory."""
        return {n: (np.asarray(getattr(self, n), dtype=np.float64), 1) for n in ("parameters", "initial")}

    def commands(self, readings: int) -> int:
        """How many commands it gives for so many readings."""
        p, z = (_tuple(a[:, 0]) for a in self.by_lane(1).values())
        try:
            return len(self.function(0.0, (0.0,) * readings, _tuple(self.signal()[0]), z, p)[0])
        except Exception as error:
            raise BadInput(
                f"the rule stops at readings of zero: {type(error).__name__}: {error}; it needs a command for any."
            ) from error

    def rows(self, nu: int, lanes: int, q: Array) -> Array:
        """Numbers as the kernel reads them, shape (numbers, lanes), for lanes that begin at coordinates `q`."""
        parts = self.by_lane(lanes)
        p, z = (parts[n] for n in ("parameters", "initial"))
        with suppress(ZeroDivisionError):  # compiled, it would go on with infinity
            u, memory = self.function(0.0, (0.0,) * len(q), _tuple(self.signal()[0]), _tuple(z[:, 0]), _tuple(p[:, 0]))
            for what, got, needed in (("commands", len(u), nu), ("numbers to remember", len(memory), len(z))):
                if got != needed:
                    raise BadInput(f"a rule here must return {needed} {what}, and this one returns {got}.")
        return np.concatenate([p, z])

    def follow(self, readings: ArrayLike, dt: float) -> tuple[Array, Array]:
        """Commands and memory that the function has for given readings, called sample by sample as on a rig.

        Parameters
        ----------
        readings : array, shape (T, coordinates), or (T,) of one
            As the encoders show them.
        dt : float
            Sample time [s].

        Returns
        -------
        commands, shape (T, inputs), before limit and rounding; memory at each sample, shape (T, z)
        """
        y: Array = np.asarray(readings, dtype=np.float64)
        y = y[:, None] if y.ndim == 1 else y
        (p, z), r = (_tuple(a[:, 0]) for a in self.by_lane(1).values()), self.signal()
        commands: list[Numbers] = []
        memory: list[Numbers] = []
        for k, reading in enumerate(y):
            memory.append(z)
            u, z = self.function(k * dt, _tuple(reading), _tuple(r[min(k, len(r) - 1)]), z, p)
            commands.append(u)
        return np.array(commands), np.array(memory)


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


def line_in(function: Function, line: int) -> str:
    """Where a line of `text_of` a function, counted from its first, stands in the file that the function is from."""
    text = ast.parse(text_of(function)).body[0]
    written = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    assert isinstance(text, ast.FunctionDef) and isinstance(written, ast.FunctionDef)  # as `text_of` made sure
    body = written.body[1:] if ast.get_docstring(written) is not None else written.body
    pairs = zip(ast.walk(ast.Module(text.body, [])), ast.walk(ast.Module(body, [])), strict=False)
    first = inspect.getsourcelines(function)[1]
    for ours, theirs in pairs:
        if isinstance(ours, ast.stmt) and isinstance(theirs, ast.stmt) and ours.lineno == line:
            return f"line {first + theirs.lineno - 1} of {Path(inspect.getfile(function)).name}"
    return f"the rule '{written.name}'"
