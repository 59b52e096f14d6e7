"""opty: direct collocation (midpoint rule) over the equations in SymPy, solved by IPOPT; it gives no intervals.

As its examples of parameter identification have it: the states' guesses are the measured angles and their smoothed
differences, the squared distance from the measured angles is least, friction at rest is a tanh.
"""

from __future__ import annotations

import numpy as np
import sympy as sm
from numpy.typing import NDArray
from opty import Problem  # type: ignore[import-untyped]
from scipy.signal import savgol_filter

from benchmarks.peers.by_hand import ROUNDED
from benchmarks.peers.least_squares import predict, started
from benchmarks.peers.task import Answer, Task, spent

Array = NDArray[np.float64]

NODES, ITERATIONS = 40000, 300
"""Nodes at most, beyond which every second, third, ... sample is one; and steps of IPOPT."""


def _equations(task: Task, t: sm.Symbol, u: sm.Expr) -> tuple[sm.Matrix, list[sm.Expr], list[sm.Symbol]]:
    """What is zero, states (angles first), and the symbols of the task's numbers, of a sensor's zero after them."""
    p = {n: sm.Symbol(n) for n in task.guesses}
    k = task.known
    symbols = list(p.values())
    if task.plant == "pendulum":
        y, w = (sm.Function(n)(t) for n in ("y", "w"))
        off = sm.Symbol("off") if task.offset else sm.Integer(0)
        J = p["J_p"] + k["m_p"] * k["l_cg"] ** 2
        fall = k["m_p"] * k["g"] * k["l_cg"] * sm.sin(y - off)
        lost = p["b_2"] * w + p["b_2c"] * sm.tanh(w / 0.01) + p["b_2q"] * w * sm.sqrt(w**2 + 1e-8)
        return sm.Matrix([y.diff(t) - w, J * w.diff(t) + fall + lost]), [y, w], symbols + ([off] if task.offset else [])
    psi, theta, w1, w2 = (sm.Function(n)(t) for n in ("psi", "theta", "w1", "w2"))
    s, c = sm.sin(theta), sm.cos(theta)
    J_A = p["J_p"] + k["m_p"] * k["l_cg"] ** 2
    m = k["m_p"] * k["r"] * k["l_cg"]
    dry1, dry2 = (p[b] * sm.tanh(w / ROUNDED) for b, w in (("b_1c", w1), ("b_2c", w2)))
    f1 = p["gain"] * u - p["b_1"] * w1 - dry1 - 2 * J_A * s * c * w1 * w2 - m * s * w2**2
    f2 = -p["b_2"] * w2 - dry2 + J_A * s * c * w1**2 - k["m_p"] * k["g"] * k["l_cg"] * s
    zero = [
        psi.diff(t) - w1,
        theta.diff(t) - w2,
        (p["J_d"] + k["m_p"] * k["r"] ** 2 + J_A * s**2) * w1.diff(t) - m * c * w2.diff(t) - f1,
        -m * c * w1.diff(t) + J_A * w2.diff(t) - f2,
    ]
    return sm.Matrix(zero), [psi, theta, w1, w2], symbols


def answer(task: Task) -> Answer:
    """The whole task; numbers are asked in units of their guesses."""
    begin = spent()
    step = -(-task.fitted.t.size // NODES)
    measured, u = task.fitted.y[::step], task.fitted.u[::step]
    count, angles = measured.shape
    dt = float(task.fitted.t[1] - task.fitted.t[0]) * step
    t, push = sm.Symbol("t"), sm.Function("u")(sm.Symbol("t"))
    zero, states, symbols = _equations(task, t, push)
    scale = np.array([*task.guesses.values(), *([1.0] if task.offset else [])])
    units = [sm.Symbol(f"{s.name}_1") for s in symbols]
    zero = zero.subs({s: float(v) * n for s, v, n in zip(symbols, scale, units, strict=True)})
    size = measured.std(axis=0)
    weight = dt / size[:, None] ** 2

    def distance(free: Array) -> float:
        return float(np.sum(weight * (free[: angles * count].reshape(angles, count) - measured.T) ** 2))

    def gradient(free: Array) -> Array:
        out = np.zeros_like(free)
        missed = free[: angles * count].reshape(angles, count) - measured.T
        out[: angles * count] = (2 * weight * missed).ravel()
        return out

    at_rest = None if task.plant == "pendulum" else tuple(w.subs(t, 0) for w in states[angles:])
    problem = Problem(
        distance, gradient, zero, states, count, dt, time_symbol=t, integration_method="midpoint",
        known_trajectory_map={push: u} if task.plant == "furuta" else {}, instance_constraints=at_rest,
        bounds=dict.fromkeys(units[:len(task.guesses)], (0.0, 1000.0)),
    )  # fmt: skip
    for name, value in (("print_level", 0), ("max_iter", ITERATIONS), ("sb", "yes")):
        problem.add_option(name, value)
    width = max(7, int(0.05 / dt) | 1)
    speeds = savgol_filter(measured, width, 4, deriv=1, delta=dt, axis=0)
    order = [str(s) for s in problem.collocator.unknown_parameters]
    first = {str(n): 1.0 if k < len(task.guesses) else 0.0 for k, n in enumerate(units)}
    guess = np.concatenate([measured.T.ravel(), speeds.T.ravel(), [first[n] for n in order]])
    free, info = problem.solve(guess)
    taken = spent() - begin
    found = dict(zip(order, free[-len(order) :], strict=True))
    numbers = np.array([found[str(n)] for n in units])
    p = (numbers * scale)[: len(task.guesses)]
    path = free[: 2 * angles * count].reshape(2 * angles, count)
    start = np.array([*path[:, 0] - [*numbers[len(p) :], *([0.0] * (2 * angles - task.offset))], *numbers[len(p) :]])
    start = start if task.plant == "pendulum" else path[:angles, 0]
    starts = {label: start if held.score_from else started(task, held) for label, held in task.held_out.items()}
    said = info["status_msg"]
    return Answer(
        values=dict(zip(task.guesses, p.tolist(), strict=True)), seconds=taken,
        predicted={label: predict(task, p, held, starts[label]) for label, held in task.held_out.items()},
        says=said.decode() if isinstance(said, bytes) else str(said),
    )  # fmt: skip
