"""Mass, centre of gravity and inertias of a brass pendulum from its drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass

_BRASS = 8500.0  # kg/m^3


@dataclass(frozen=True, kw_only=True)
class BrassPendulum:
    """Hollow rod hinged at its end with a disk-shaped weight on it, all brass; lengths [m].

    `weight_at` is the distance from the hinge to the middle of the weight.
    """

    length: float = 0.330
    outer: float = 9.53e-3
    bore: float = 7.94e-3
    weight_diameter: float = 44e-3
    weight_thickness: float = 6e-3
    weight_at: float = 0.200

    def parameters(self) -> dict[str, float]:
        """Mass, centre of gravity, transverse and axial inertia by the names of `Furuta`, from solid geometry."""
        rod = _BRASS * math.pi / 4 * (self.outer**2 - self.bore**2) * self.length
        weight = _BRASS * math.pi / 4 * (self.weight_diameter**2 - self.outer**2) * self.weight_thickness
        m_p = rod + weight
        l_cg = (rod * self.length / 2 + weight * self.weight_at) / m_p
        rod_square, weight_square = self.outer**2 + self.bore**2, self.weight_diameter**2 + self.outer**2
        transverse_rod = rod * (self.length**2 / 12 + rod_square / 16 + (self.length / 2 - l_cg) ** 2)
        transverse_weight = weight * (self.weight_thickness**2 / 12 + weight_square / 16 + (self.weight_at - l_cg) ** 2)
        axial = (rod * rod_square + weight * weight_square) / 8
        return {"m_p": m_p, "l_cg": l_cg, "J_p": transverse_rod + transverse_weight, "J_a": axial}
