"""What a rig's model says before anything moves: the numbers that the guide of the page lets a student predict."""

from __future__ import annotations

from typing import Any

from upright.gains.requests import read_poles
from upright.paper.reproduce import TABLE_1
from upright.physics import Furuta
from upright.rig import Rig


def facts(model: Rig, at: str, tracked: int | None) -> dict[str, Any]:
    """Of a pendulum its frequency hanging [rad/s] and its unstable pole upright [1/s]; what is printed for such a rig.

    Parameters
    ----------
    at : str
        Equilibrium that is held.
    tracked : int or None
        Coordinate that follows a reference; its zero furthest right [1/s] is given where one lies right of the axis.
    """
    out: dict[str, Any] = {"sets": [], "zero": None}
    if {"hanging", "inverted"} <= set(model.plant.equilibria):
        swings = [abs(pole) for pole in model.linear("hanging").poles() if pole.imag > 0]
        out |= {"hanging": float(max(swings, default=0.0)), "unstable": float(model.linear("inverted").poles()[0].real)}
        if isinstance(model.plant, Furuta):
            out["sets"] = [[[z.real, z.imag] for z in read_poles(text)] for text in TABLE_1]
    if tracked is not None:
        linear = model.linear(at)
        right = [
            float(z.real) for z in linear[model.plant.coordinates[tracked].name, linear.inputs[0]].zeros() if z.real > 0
        ]
        out["zero"] = max(right, default=None)
    return out
