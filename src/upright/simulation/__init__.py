"""How it moves: plants stepped in time, one motion or thousands side by side, friction exact."""

from __future__ import annotations

from upright.simulation.flavour import ACTUATOR, ACTUATOR_DEFAULTS, Flavour, choose
from upright.simulation.law import Law
from upright.simulation.parts import Held, Loop
from upright.simulation.simulate import Ensemble, ensemble, simulate
from upright.simulation.simulator import Simulator

__all__ = [
    "ACTUATOR",
    "ACTUATOR_DEFAULTS",
    "Ensemble",
    "Flavour",
    "Held",
    "Law",
    "Loop",
    "Simulator",
    "choose",
    "ensemble",
    "simulate",
]
