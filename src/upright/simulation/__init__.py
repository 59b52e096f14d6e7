"""How it moves: plants stepped in time, one motion or thousands side by side, friction exact."""

from __future__ import annotations

from upright.physics.actuator import ACTUATOR
from upright.simulation.kernel.flavour import Flavour, choose
from upright.simulation.simulate import Ensemble, ensemble, simulate
from upright.simulation.simulator import Held, Simulator

__all__ = [
    "ACTUATOR",
    "Ensemble",
    "Flavour",
    "Held",
    "Simulator",
    "choose",
    "ensemble",
    "simulate",
]
