"""JAX: jit and lax.scan in double precision; the ensemble is elementwise over arrays of rigs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks import problem


def trajectory() -> Callable[[], Any]:
    """One free swing of 10 s at 1 kHz, RK4 on scalars."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp

    k = tuple(map(float, problem.lumps(problem.RIG)))

    def step(x: Any, _: None) -> Any:
        x = problem.rk4(jnp, x, 0.0, problem.PERIOD, k)
        return x, jnp.stack(x)

    swing = jax.jit(lambda x: jax.lax.scan(step, tuple(x), None, length=problem.STEPS)[1])
    start = jnp.array(problem.RELEASE)
    return lambda: np.vstack([problem.RELEASE, swing(start)])


def ensemble(n: int) -> Callable[[], Any]:
    """n closed loops as arrays of n."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import jax.numpy as jnp

    p, x0 = (jnp.array(a) for a in problem.ensemble(n))
    c = problem.loop_numbers()

    @jax.jit
    def loops(p: Any, x0: Any) -> Any:
        k = problem.lumps(p)

        def period(state: Any, _: None) -> Any:
            x, seen = state
            u, seen = problem.controller(jnp, x, seen, c)
            u = jnp.clip(u, -problem.LIMIT, problem.LIMIT)
            for _substep in range(problem.SUBSTEPS):
                x = problem.rk4(jnp, x, u, problem.PERIOD / problem.SUBSTEPS, k)
            return (x, seen), None

        start = (tuple(x0), problem.at_rest(jnp, x0))
        return jnp.stack(jax.lax.scan(period, start, None, length=problem.SAMPLES)[0][0])

    return lambda: np.asarray(loops(p, x0))
