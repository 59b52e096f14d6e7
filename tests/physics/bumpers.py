"""An own plant whose forces are elementary functions, and forces with kinks."""

from typing import Any

import sympy as sp

from upright.physics import Coordinate, Input, Plant
from upright.quantities import quantity


class Bumpers(Plant):
    """A cart between two bumpers, with a magnet, that carries a wheel on a spring that yields."""

    m: float = quantity("kg", "cart", above=0)
    J: float = quantity("kg m^2", "wheel", above=0)
    k: float = quantity("N/m", "stiffness", above=0)
    gap: float = quantity("m", "from the middle to a bumper", at_least=0)
    b: float = quantity("N", "drag at speed", default=0.0)
    coordinates = (Coordinate("x", "m", "cart"), Coordinate("phi", "rad", "wheel"))
    inputs = (Input("F", "N", "push", on="x"),)

    @staticmethod
    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        """Hertz's contact on the right, a hard spring on the left; each elementary function has its part."""
        (x, phi), (x_dot, phi_dot) = q, v
        T = (p.m * x_dot**2 + p.J * phi_dot**2) / 2 + p.J / 10 * sp.cosh(phi) * phi_dot**2
        V = p.k * sp.Max(x - p.gap, 0) ** sp.Rational(5, 2) + p.k * sp.Min(x + p.gap, 0) ** 2 / 2
        V += p.k / 50 * (x * sp.atan(30 * x) + sp.log(1 + x**2) + sp.exp(-(x**2))) + sp.Abs(x) ** 3
        V += phi * sp.asin(phi / 9) - phi * sp.acos(phi / 9) / 50 + sp.sinh(phi / 3) ** 2
        V += phi**2 / 10 * sp.tan(phi / 9) + sp.log(2 + phi**2) * sp.tanh(phi) ** 2
        V += sp.Piecewise((phi**2, phi < sp.pi / 20), (sp.pi / 10 * phi - sp.pi**2 / 400, True))
        V += sp.atan2(sp.sin(phi), 2 + sp.cos(phi)) ** 2
        return T, V, p.b * sp.log(sp.cosh(10 * x_dot)) / 10 + sp.Abs(phi_dot) ** 3 / 30


BUMPERS = Bumpers(m=1.2, J=0.3, k=1200.0, gap=0.03, b=0.4)
