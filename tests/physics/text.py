"""A plain reader of derived equations, independent of the kernel: text in, accelerations out."""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from upright.physics import Derived, Plant


def acceleration(derived: Derived, parameters: dict[str, float]) -> Callable:
    """Function (q, v, u) -> a, without dry friction."""
    n = len(derived.coordinates)
    velocities = [f"{c}_dot" for c in derived.coordinates]
    lines = [f"def a(q, v, u, {', '.join(f'{k}={v!r}' for k, v in parameters.items())}):"]
    for names, source in ((derived.coordinates, "q"), (velocities, "v"), (derived.inputs, "u")):
        lines += [f"    {name} = {source}[{i}]" for i, name in enumerate(names)]
    lines += [f"    k{i} = {lump}" for i, lump in enumerate(derived.lumps)]
    lines += [f"    {s}, {c} = sin({of}), cos({of})" for s, c, of in derived.trig]
    lines += [f"    {name} = {step}" for name, step in derived.steps]
    rows, upper = [], iter(derived.mass)
    entries = {(i, j): next(upper) for i in range(n) for j in range(i, n)}
    for i in range(n):
        rows.append(f"[{', '.join(entries[min(i, j), max(i, j)] for j in range(n))}]")
    lines.append(
        f"    return solve(array([{', '.join(rows)}], dtype=float), array([{', '.join(derived.force)}], dtype=float))"
    )
    scope = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt, "pi": np.pi, "solve": np.linalg.solve, "array": np.array}
    exec("\n".join(lines), scope)
    return scope["a"]


def slope(plant: Plant, u=lambda t: (0.0,)) -> Callable:
    """Function (t, x) -> x' of a plant, states in the paper's order, for scipy."""
    a = acceleration(plant.derived_for(plant.parameters()), plant.parameters())

    def f(t, x):
        rate = np.empty_like(x)
        rate[0::2], rate[1::2] = x[1::2], a(x[0::2], x[1::2], u(t))
        return rate

    return f


def swing(plant: Plant, x0, duration: float, *, u=lambda t: (0.0,), samples: int = 2, rtol: float = 1e-11):
    """States (samples, nx) by Dormand and Prince's eighth order."""
    t = np.linspace(0, duration, samples)
    return solve_ivp(slope(plant, u), (0, duration), x0, "DOP853", t, rtol=rtol, atol=rtol * 1e-2).y.T
