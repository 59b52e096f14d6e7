"""A plant's coordinates in terms of a file's joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from upright.physics import Plant
from upright.quantities import with_unit
from upright.records import Array
from upright.rig.mjcf.bodies import Bodies


@dataclass(frozen=True, kw_only=True)
class Axes:
    """The plant's coordinates in terms of the file's joints: q_i = sign_i (joint_order_i - zero_i)."""

    order: tuple[int, ...]
    sign: Array
    zero: Array

    def joints(self, q: Array) -> Array:
        """The file's joints (or their speeds, about zero) at the plant's coordinates."""
        out = np.empty(len(self.order))
        out[[*self.order]] = self.zero + self.sign * q
        return out

    def turned(self, matrix: Array) -> Array:
        """A matrix over joints as one over coordinates."""
        return self.sign[:, None] * matrix[np.ix_(self.order, self.order)] * self.sign

    def described(self, bodies: Bodies, plant: Plant) -> dict[str, str]:
        """By coordinate, how it follows from the file's joints."""
        out: dict[str, str] = {}
        for c, j, sign, zero in zip(plant.coordinates, self.order, self.sign, self.zero, strict=True):
            joint = bodies.joint(int(j)).strip("'")
            zero = 0.0 if abs(zero) < 1e-12 else float(zero)
            shift = f" {'-' if zero > 0 else '+'} {with_unit(abs(zero), c.unit, 5)}" if zero else ""
            out[c.name] = f"{joint}{shift}" if sign > 0 else f"-({joint}{shift})" if shift else f"-{joint}"
        return out
