"""Which rigs can the laboratory be run on? Twins of four makes; every seed is another rig of the same make.

ECP 210 (rectilinear: two carts), ECP 205 (torsional: two disks), and both with the A51 pendulum (linear, furuta).
Sizes are those of the public guides where there are any; masses are chosen so that the modes lie where the paper's
tables put them: the pendulums' unstable pole near 7.98 rad/s, the flexible modes near 27.1 rad/s.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from upright.control.rig import Rig
from upright.errors import BadInput
from upright.lab.rigs.twin import COUNTS, NOMINAL, SERVO, BrassPendulum
from upright.physics import CartPendulum, Plant, chain

Make = Literal["linear", "furuta", "rectilinear", "torsional"]
MAKES: tuple[Make, ...] = ("linear", "furuta", "rectilinear", "torsional")

_TURN = COUNTS / (2 * math.pi)
_METRE = 16_000 / 0.0706
_CARTS: Any = chain(2, "rectilinear")
_DISKS: Any = chain(2, "torsional")
_ON_CART = BrassPendulum(weight_at=0.14)

PLANTS: Mapping[Make, Plant] = {
    "linear": CartPendulum(
        m_c=0.60,  # cart without its masses
        **{n: v for n, v in _ON_CART.parameters().items() if n != "J_a"},
        b_1=1.2,
        b_1c=0.25,
        b_2=3e-5,
        b_2c=2.5e-4,
    ),
    "furuta": NOMINAL.replace(b_1=2e-3, b_1c=8e-3),  # drive belt on
    "rectilinear": _CARTS(m_1=1.10, m_2=1.07, k_12=398.0, c_1=2.2, c_2=2.0, f_1c=0.2, f_2c=0.1),
    "torsional": _DISKS(J_1=7.8e-3, J_2=6.9e-3, k_12=2.7, c_1=1.2e-2, c_2=1.0e-2, f_1c=8e-3, f_2c=2e-3),
}
"""The rigs as designed."""

_TRAVEL = {"linear": 0.20, "furuta": 2 * math.pi, "rectilinear": 0.03}  # rail, pendulum's cable, stops of the carts
_LIMIT = {"torsional": 10.0}  # V; else what the vendor's program lets through, 4.884 V in its exported logs

_SPREAD = {"m": 0.02, "J": 0.02, "k": 0.04, "r": 0.01, "b": 0.14, "c": 0.14, "f": 0.14}
_NAMES = {
    "linear": "ECP 210 + A51, pendulum on a cart",
    "furuta": "ECP 205 + A51, Furuta pendulum",
    "rectilinear": "ECP 210, two carts",
    "torsional": "ECP 205, two disks",
}


def make_rig(make: str, seed: int = 0) -> Rig:
    """A rig of a make.

    Inertias differ by two percent, springs by four, friction by a seventh, the drive's gain by two; seed 0 is the rig
    as designed.

    Raises
    ------
    BadInput
        When there is no such make.
    """
    if make not in MAKES:
        raise BadInput(f"there is no make '{make}'; take one of {', '.join(MAKES)}.")
    plant, on_rail = PLANTS[make], make in ("linear", "rectilinear")
    gain = 5.25 if on_rail else 0.65
    if seed:
        rng = np.random.default_rng([seed, 41, MAKES.index(make)])
        changed: dict[str, float] = {}
        if make in ("linear", "furuta"):
            start = _ON_CART if make == "linear" else BrassPendulum()
            parts = BrassPendulum(
                length=start.length * rng.normal(1, 0.01),
                weight_thickness=start.weight_thickness * rng.normal(1, 0.02),
                weight_at=start.weight_at * rng.normal(1, 0.02),
            )
            changed = {n: v for n, v in parts.parameters().items() if n in plant.names()}
        for name, value in plant.parameters().items():
            spread = _SPREAD.get(name[0], 0.0)
            if value and name not in changed and name != "g":
                changed[name] = value * math.exp(rng.normal(0, spread))
        plant = plant.replace(**changed)
        gain *= math.exp(rng.normal(0, 0.02))
    second = _METRE if make == "rectilinear" else _TURN
    return Rig(
        name=_NAMES[make],
        plant=plant,
        gain=gain,
        limit=_LIMIT.get(make, 5.0),
        converter=10 / 32768,
        delay=SERVO,
        lag=2e-3,
        counts=(_METRE if on_rail else _TURN, second),
        period=SERVO,
        travel=_TRAVEL.get(make, math.inf),
        seed=seed,
    )
