"""Pendulums on drives that are not as models have them: the force ripples along the way, the frame is out of level.

Twins are made of them, and nothing is fitted with them.
"""

from __future__ import annotations

from typing import Any

from upright.physics.furuta import Furuta
from upright.physics.pendulums import CartPendulum
from upright.quantities import quantity
from upright.systems import StateSpace


class NonidealFuruta(Furuta):
    """A Furuta pendulum whose drive's torque ripples with its angle; out of level by `tilt_x` and `tilt_y`."""

    T_r: float = quantity("N m", "ripple of the drive's torque", default=0.0, at_least=0)
    n_r: float = quantity("1/rad", "radians of the ripple per radian of the drive", default=1.0, above=0)
    phi_r: float = quantity("rad", "phase of the ripple", default=0.0)

    optional = ()

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Those of the pendulum; the ripple is a force ``T_r sin(n_r psi + phi_r)``."""
        from sympy import cos

        T, V, D = Furuta.energies(p, q, v)
        return T, V + p.T_r / p.n_r * cos(p.n_r * q[0] + p.phi_r), D

    def linear(self, at: str | None = None, *, side: float = 0.0) -> StateSpace:
        """That of the rig without ripple and tilt, which are local."""
        plant = Furuta(**{n: getattr(self, n) for n in Furuta.names()})
        return plant.replace(tilt_x=0.0, tilt_y=0.0).linear(at, side=side)


class NonidealCartPendulum(CartPendulum):
    """A pendulum on a cart whose drive's force ripples along a rail that is out of level."""

    F_r: float = quantity("N", "ripple of the drive's force", default=0.0, at_least=0)
    n_r: float = quantity("1/m", "radians of the ripple per metre of the rail", default=1.0, above=0)
    phi_r: float = quantity("rad", "phase of the ripple", default=0.0)
    slope: float = quantity(
        "1", "sine of the rail's slope, falling towards +x", default=0.0, at_least=-0.5, at_most=0.5
    )

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Those of the pendulum; its angle is that from the vertical, so that a slope pulls along the rail alone."""
        from sympy import cos

        T, V, D = CartPendulum.energies(p, q, v)
        V += p.F_r / p.n_r * cos(p.n_r * q[0] + p.phi_r) - (p.m_c + p.m_p) * p.g * p.slope * q[0]
        return T, V, D

    def linear(self, at: str | None = None, *, side: float = 0.0) -> StateSpace:
        """That of the rig without ripple and slope, which are local."""
        return CartPendulum(**{n: getattr(self, n) for n in CartPendulum.names()}).linear(at, side=side)
