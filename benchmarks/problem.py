"""Which rig, which controller, which friction: the same numbers for every contender.

States in the order of the C baseline: psi, theta, psi_dot, theta_dot; theta = 0 hanging; SI and radians.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

#: A table-top Furuta pendulum, in the baseline's order.
NAMES = ("m_p", "r", "l_cg", "J_p", "J_d", "b_1", "b_2", "b_1c", "b_2c", "g")
RIG = np.array([0.2, 0.12, 0.15, 1e-4, 0.008, 0.005, 2e-4, 1e-3, 2e-4, 9.81])
SMOOTHING = 0.05  # rad/s, where friction is a tanh
PERIOD, SUBSTEPS = 1e-3, 2
STEPS = 10_000  # one trajectory: 10 s
SAMPLES = 2_000  # one closed loop: 2 s
LOOPS = 10_000
RELEASE = np.array([0.0, 1.5, 0.0, 0.0])
QUANTUM = 2 * math.pi / 16_000
CUTOFF = 50.0  # Hz, of the filtered differentiator
KEEP = math.exp(-2 * math.pi * CUTOFF * PERIOD)
LIMIT = 0.4  # N m

#: The fit: eight unknowns, their truth, where the search starts, over which steps, under which torque.
UNKNOWN = ("J_d", "l_cg", "J_p", "b_1", "b_2", "b_1c", "b_2c")
WHERE = [NAMES.index(name) for name in UNKNOWN]
TRUTH = np.array([*RIG[WHERE], RELEASE[1]])
START = TRUTH * (1 + 0.3 * np.array([1, -1, 1, -1, 1, -1, 1, -1]))
HORIZONS = (1_000, STEPS)
TORQUE = 0.02 * np.sin(2 * math.pi * 0.7 * PERIOD * np.arange(STEPS))


def without_dry_friction(p: np.ndarray) -> np.ndarray:
    """Same rig(s), Coulomb levels zero."""
    p = p.copy()
    p[[7, 8]] = 0.0
    return p


def lumps(p: Any) -> tuple[Any, ...]:
    """Arm, swing, coupling, weight, b_1, b_2, b_1c, b_2c from the ten parameters."""
    m_p, r, l_cg, J_p, J_d, b_1, b_2, b_1c, b_2c, g = p
    return m_p * r**2 + J_d, m_p * l_cg**2 + J_p, m_p * r * l_cg, m_p * g * l_cg, b_1, b_2, b_1c, b_2c


def accelerations(lib: Any, theta: Any, v: Any, w: Any, torque: Any, k: Any, *, friction: bool = False) -> Any:
    """psi'' and theta'' of eq. (3) with J_a = 0; `lib` is the module that owns sin, cos and tanh."""
    arm, swing, coupling, weight, b_1, b_2, b_1c, b_2c = k
    s, c = lib.sin(theta), lib.cos(theta)
    m_11, m_12, spin = arm + swing * s * s, -coupling * c, swing * s * c * v
    f_1 = torque - 2 * spin * w - coupling * s * w * w - b_1 * v
    f_2 = -weight * s + spin * v - b_2 * w
    if friction:
        f_1 = f_1 - b_1c * lib.tanh(v / SMOOTHING)
        f_2 = f_2 - b_2c * lib.tanh(w / SMOOTHING)
    scale = 1 / (m_11 * swing - m_12 * m_12)
    return (swing * f_1 - m_12 * f_2) * scale, (m_11 * f_2 - m_12 * f_1) * scale


def rk4(lib: Any, x: Any, torque: Any, h: float, k: Any, *, friction: bool = False) -> Any:
    """One Runge-Kutta step of the four states, as a tuple."""

    def slope(psi: Any, theta: Any, v: Any, w: Any) -> Any:
        return (v, w, *accelerations(lib, theta, v, w, torque, k, friction=friction))

    a = slope(*x)
    b = slope(*(y + h / 2 * d for y, d in zip(x, a, strict=True)))
    c = slope(*(y + h / 2 * d for y, d in zip(x, b, strict=True)))
    d = slope(*(y + h * d for y, d in zip(x, c, strict=True)))
    return tuple(y + h / 6 * (p + 2 * q + 2 * r + s) for y, p, q, r, s in zip(x, a, b, c, d, strict=True))


def gains() -> np.ndarray:
    """State feedback about upright, by LQR: effort on psi, theta - pi, psi_dot, theta_dot."""
    from scipy.linalg import solve_continuous_are

    arm, swing, coupling, weight, b_1, b_2, *_ = lumps(RIG)
    mass = np.array([[arm, coupling], [coupling, swing]])  # cos(pi) = -1
    A, B = np.zeros((4, 4)), np.zeros((4, 1))
    A[:2, 2:] = np.eye(2)
    A[2:, :2] = np.linalg.solve(mass, np.diag([0.0, weight]))
    A[2:, 2:] = -np.linalg.solve(mass, np.diag([b_1, b_2]))
    B[2:, 0] = np.linalg.solve(mass, [1.0, 0.0])
    R = 20.0
    X = solve_continuous_are(A, B, np.diag([1.0, 5.0, 0.05, 0.05]), np.array([[R]]))
    return (B.T @ X / R).ravel()


def loop_numbers() -> np.ndarray:
    """Gains, resolution, filter, limit and period, in the baseline's order."""
    return np.array([*gains(), QUANTUM, KEEP, LIMIT, PERIOD])


def controller(lib: Any, x: Any, seen: Any, c: Any) -> tuple[Any, Any]:
    """Encoder, filtered difference, feedback, without the saturation; returns effort and memory."""
    y = tuple(lib.floor(q / QUANTUM + 0.5) * QUANTUM for q in x[:2])
    speeds = tuple(
        KEEP * old + (1 - KEEP) * (new - was) / PERIOD for old, new, was in zip(seen[2:], y, seen[:2], strict=True)
    )
    return -(c[0] * y[0] + c[1] * (y[1] - math.pi) + c[2] * speeds[0] + c[3] * speeds[1]), (*y, *speeds)


def at_rest(lib: Any, x: Any) -> tuple[Any, ...]:
    """What the controller remembers before its first sample: the counts it sees, no speed."""
    zero = 0.0 * x[0]
    return (*(lib.floor(q / QUANTUM + 0.5) * QUANTUM for q in x[:2]), zero, zero)


def ensemble(n: int = LOOPS, *, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """n rigs spread by 20 % (10, n), started up to 0.25 rad from upright (4, n)."""
    random = np.random.default_rng(seed)
    p = RIG[:, None] * (1 + 0.2 * random.uniform(-1, 1, (len(RIG), n)))
    p[9] = RIG[9]
    x0 = np.zeros((4, n))
    x0[1] = math.pi + random.uniform(-0.25, 0.25, n)
    return np.ascontiguousarray(p), x0


def rig(unknown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ten parameters and the initial state for eight values of the unknowns."""
    p, x0 = RIG.copy(), RELEASE.copy()
    p[WHERE], x0[1] = unknown[:-1], unknown[-1]
    return p, x0


def counts(states: np.ndarray) -> np.ndarray:
    """What two encoders make of psi and theta."""
    return np.floor(states[:, :2] / QUANTUM + 0.5) * QUANTUM
