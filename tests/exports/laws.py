"""Laws of every kind, to be written in every form."""

from __future__ import annotations

import numpy as np

from tests.gains.furuta import RIG
from upright.exports.controller import SampledController, of_law
from upright.gains import feedback, filtered, kalman, place, process_noise
from upright.laws import Law

PERIOD, TURN = 2e-3, 2 * np.pi
REST = {"target": np.array([0.0, np.pi]), "measured": ("psi", "theta"), "resolution": TURN / 16000, "limit": 0.6}
POLES = [-4.15 + 1.63j, -4.15 - 1.63j, -16.9, -3.2]


def designed(way: str) -> Law:
    """State feedback of the Furuta pendulum upright, speeds by filtered differences or by a Kalman filter."""
    model = RIG.linear("inverted")
    sampled = model.to_sampled(PERIOD, 1.0)
    K = place(model.A, model.B, POLES).K
    if way == "filtered":
        return feedback(filtered(sampled, 0.5), K, 0.2)
    return feedback(kalman(sampled, process_noise(sampled, 5.0), TURN / 16000 / np.sqrt(12)), K)


def pid() -> Law:
    """A PID that holds its sum at the limit and rounds its command; sum, last reading, filtered difference."""
    kp, ki, kd, alpha, T = 9.0, 14.0, 1.1, 0.4, 0.01
    rate = (1 - alpha) / T
    e = np.array([-1.0, 1.0])
    return Law(
        [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, rate, alpha]], [T * e, [1.0, 0.0], [-rate, 0.0]],
        [[ki, kd * rate, kd * alpha]], [kp * e + ki * T * e + [-kd * rate, 0.0]], windup="hold", limit=2.5,
        command_resolution=0.01, period=T, reference_names=("r",), initial=[0.0, 0.3, 0.0],
    )  # fmt: skip


def dense() -> Law:
    """Two commands from three readings with nothing that is 0 or 1, and a beginning from all readings."""
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    return Law(
        0.8 * A / np.abs(np.linalg.eigvals(A)).max(), rng.normal(size=(4, 3)), rng.normal(size=(2, 4)),
        rng.normal(size=(2, 3)), begin=rng.normal(size=(4, 3)), target=rng.normal(size=3), limit=1.7, period=0.005,
        command_resolution=[0.0, 20 / 4096],
    )  # fmt: skip


def proportional() -> Law:
    """No memory, no limit."""
    return Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[-3.3]], period=0.1)


def laws() -> dict[str, SampledController]:
    """By name."""
    from dataclasses import replace

    made = {
        "filtered": replace(designed("filtered"), **REST, command_resolution=1e-3),
        "kalman": replace(designed("kalman"), **REST),
        "pid": pid(),
        "dense": dense(),
        "proportional": proportional(),
    }
    return {name: of_law(law) for name, law in made.items()}
