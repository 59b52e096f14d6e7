"""Which forces would this motion have needed?"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.physics.derived import Derived
from upright.physics.linear import resolved
from upright.physics.plant import evaluate

Array = NDArray[np.float64]


def needed(derived: Derived, values: Mapping[str, Any], q: Array, v: Array, a: Array) -> Array:
    """Generalized forces ``M(q) a - f(q, v)`` beyond gravity, springs and viscous friction.

    Parameters
    ----------
    derived : Derived
        Equations of the plant.
    values : mapping
        Parameters by name, each a number or an array that broadcasts with the motion.
    q, v, a : (n, ...) arrays
        Coordinates, speeds and accelerations.

    Returns
    -------
    (n, ...) array
    """
    n = len(derived.coordinates)
    states = {c: q[i] for i, c in enumerate(derived.coordinates)}
    speeds = {f"{c}_dot": v[i] for i, c in enumerate(derived.coordinates)}
    scope = resolved(derived, {**dict.fromkeys(derived.inputs, 0.0), **values, **states, **speeds})
    i, j = np.triu_indices(n)
    mass = dict(zip(zip(i.tolist(), j.tolist(), strict=True), (evaluate(e, scope) for e in derived.mass), strict=True))
    rows = [
        sum(mass[min(r, c), max(r, c)] * a[c] for c in range(n)) - evaluate(derived.force[r], scope) for r in range(n)
    ]
    return np.array(np.broadcast_arrays(*rows))


def at_rest(derived: Derived, point: Mapping[str, float]) -> Callable[[Mapping[str, Any]], tuple[Array, ...]]:
    """Function from one set of numbers to M, D, K (n, n) and G (n, inputs) of small motions about a point.

    As `small_motions`, made for a search that asks thousands of times: all expressions are compiled together.
    """
    n, m = len(derived.coordinates), len(derived.inputs)
    run = _compiled(derived)
    still = {**{f"{c}_dot": 0.0 for c in derived.coordinates}, **dict.fromkeys(derived.inputs, 0.0), **point}
    i, j = np.triu_indices(n)

    def matrices(values: Mapping[str, Any]) -> tuple[Array, ...]:
        mass, damping, stiffness, gain = run({**values, **still})
        M = np.zeros((n, n))
        M[i, j] = mass
        M[j, i] = mass
        return M, np.array(damping).reshape(n, n), np.array(stiffness).reshape(n, n), np.array(gain).reshape(n, m)

    return matrices


@cache
def _compiled(derived: Derived) -> Callable[[Mapping[str, Any]], tuple[tuple[float, ...], ...]]:
    names = (*derived.parameters, *derived.coordinates, *(f"{c}_dot" for c in derived.coordinates), *derived.inputs)
    lines = [f"    {name} = p.get({name!r}, 0.0)" for name in names]
    lines += [f"    k{i} = {text}" for i, text in enumerate(derived.lumps)]
    for s, c, argument in derived.trig:
        lines += [f"    {s} = sin({argument})", f"    {c} = cos({argument})"]
    lines += [f"    {name} = {text}" for name, text in derived.steps]
    parts = [f"({', '.join(part)},)" for part in (derived.mass, derived.damping, derived.stiffness, derived.gain)]
    text = "\n".join(["def run(p):", *lines, f"    return {', '.join(parts)}"])
    scope: dict[str, Any] = {"sin": math.sin, "cos": math.cos, "sqrt": math.sqrt, "tan": math.tan, "exp": math.exp}
    scope["pi"] = math.pi
    exec(compile(text, f"<{derived.name} at rest>", "exec"), scope)  # our own text
    return scope["run"]
