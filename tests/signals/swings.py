"""A body on a spring with viscous and dry friction, moved by scipy half swing after half swing; sampled and rounded."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp


def swing(m, k, c, f, *, x0=1.0, centre=0.0, rate=500.0, resolution=0.0, noise=0.0, seed=0):
    """Time, signal and true extremes until friction holds the body, then as long again at rest."""
    t0, x, pieces, extremes = 0.0, x0, [], [(0.0, x0)]
    while abs(k * (x - centre)) > f and len(extremes) < 60:
        side = np.sign(x - centre)  # the body moves against it, friction along it

        def f_dot(t, z, side=side):
            return [z[1], (-k * (z[0] - centre) - c * z[1] + side * f) / m]

        def back(t, z, side=side):
            return z[1] if t > 1e-6 else -side

        back.terminal = True
        back.direction = float(side)
        half = solve_ivp(f_dot, (0, 10), [x, 0.0], method="DOP853", rtol=1e-11, atol=1e-13, events=back,
                         dense_output=True)  # fmt: skip
        pieces.append((t0, t0 + half.t[-1], half.sol))
        t0, x = t0 + half.t[-1], float(half.y[0, -1])
        extremes.append((t0, x))
    t = np.arange(0, t0 + 1.0, 1 / rate)
    y = np.full(t.size, x)
    for first, last, sol in pieces:
        inside = (t >= first) & (t < last)
        y[inside] = sol(t[inside] - first)[0]
    y = y + noise * np.random.default_rng(seed).normal(size=t.size)
    return t, (np.round(y / resolution) * resolution if resolution else y), np.array(extremes)
