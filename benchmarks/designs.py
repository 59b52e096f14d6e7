"""The laboratory's Furuta pendulum on a 10 V drive, and laws for it, to be tried on the firmware."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from upright.gains import feedback, kalman, place, process_noise
from upright.laws import Law, state_feedback
from upright.rig.makes import NOMINAL
from upright.rigs.protocol import Limits

GAIN = 0.65
"""Torque of the drive [N m/V]."""
PERIOD = 1e-3
FURUTA = NOMINAL.replace(b_1c=0.0, b_2c=0.0)  # the firmware's plant has viscous friction
PARAMETERS = FURUTA.parameters()
SET_1 = (-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220)
"""Poles of Table 1, set 1."""
SWING_FREE = (-6.0 + 6.0j, -6.0 - 6.0j, -5.0, -7.0)
LIMITS = Limits(travel=(6.0, 1.2), speed=(40.0, 40.0), start=(0.5, 0.5), command=8.0, watchdog=0.02, saturation=0.5)


def gains(at: str, poles: tuple[complex, ...]) -> np.ndarray:
    """State feedback [V] on psi, psi', theta, theta'."""
    model = FURUTA.linear(at)
    return place(model.A, GAIN * model.B, poles).K[0]


def inverted(memory: float = 0.8, period: float = PERIOD) -> Law:
    """Holds it upright, where it was zeroed."""
    return state_feedback(gains("inverted", SET_1), period, memory=memory, limit=LIMITS.command)


def observed() -> Law:
    """The same by a Kalman observer of all four states, whose matrices have few zeros: the most that a board takes."""
    model = FURUTA.linear("inverted")
    sampled = replace(model, B=GAIN * model.B).to_sampled(PERIOD, 0.0)
    estimator = kalman(sampled, process_noise(sampled, [30.0, 30.0]), math.tau / 16_000 / math.sqrt(12))
    return replace(feedback(estimator, gains("inverted", SET_1)), limit=LIMITS.command, period=PERIOD)


def swing_free() -> Law:
    """Takes the hanging rig's arm to a reference without swinging."""
    K = gains("hanging", SWING_FREE)
    return state_feedback(K, PERIOD, memory=0.8, k_pf=K[0], limit=LIMITS.command)


def pid() -> Law:
    """PI on the first reading with the sum standing still at the limit."""
    return Law(
        np.array([[1.0]]), np.array([[-PERIOD, 0.0, PERIOD]]), np.array([[30.0]]), np.array([[-2.0, 0.0, 2.0]]),
        reference_names=("psi",), windup="hold", limit=1.5, target=[0.1, math.pi],
    )  # fmt: skip
