"""What shakes: a chain of inertias joined by springs, carts on a rail or disks on a shaft, and masses added to them.

Body i has inertia ``m_i`` (``J_i``), a known addition ``a_i``, a spring ``k_i`` and a dashpot ``c_i`` to ground, and a
spring ``k_ij`` and a dashpot ``c_ij`` to its neighbour. Two bodies without ground springs have one rigid mode and one
flexible mode at ``sqrt(k_12 (1/m_1 + 1/m_2))``: the paper's flexible manipulator.
"""

from __future__ import annotations

from functools import cache
from numbers import Integral
from typing import Any

from upright.errors import BadInput, ImpossiblePhysics
from upright.physics.outline import Outline, box, circle
from upright.physics.plant import Plant
from upright.physics.statement import Coordinate, Input, Joint
from upright.quantities import quantity

MASS = 0.5  # kg, one brass mass of ECP 205 and ECP 210
_UNITS = {
    "rectilinear": ("kg", "m", "N", "N/m", "N s/m", "N s^2/m^2", "m/s", "mass", "force", "position of cart"),
    "torsional": (
        "kg m^2",
        "rad",
        "N m",
        "N m/rad",
        "N m s/rad",
        "N m s^2/rad^2",
        "rad/s",
        "inertia",
        "torque",
        "angle of disk",
    ),
}


def chain(bodies: int, kind: str = "rectilinear") -> type[Plant]:
    """Class of a chain of `bodies` inertias.

    Parameters
    ----------
    bodies : int
        1 to 9.
    kind : {"rectilinear", "torsional"}
        Carts with masses ``m_i`` and positions ``x_i`` driven by F, or disks with inertias ``J_i`` and angles
        ``theta_i`` driven by T; both act on body 1.

    Raises
    ------
    BadInput
        When `bodies` or `kind` is none of these.
    """
    if str(kind) not in _UNITS:
        raise BadInput(f"a chain is 'rectilinear' or 'torsional', got '{kind}'")
    if not (isinstance(bodies, Integral) and 1 <= bodies <= 9):
        raise BadInput(f"a chain has 1 to 9 bodies, got {bodies}")
    built_in = _BUILT_IN.get((kind, bodies))
    return built_in if built_in is not None else _chain(bodies, kind)


@cache
def _chain(bodies: int, kind: str) -> type[Plant]:
    mass_unit, position_unit, force_unit, k_unit, c_unit, q_unit, v_unit, inertia, effort, place = _UNITS[kind]
    m, x, u = ("m", "x", "F") if kind == "rectilinear" else ("J", "theta", "T")
    indices = range(1, bodies + 1)
    members: dict[str, Any] = {"__annotations__": {}, "__module__": __name__, "__qualname__": f"{kind.title()}{bodies}"}

    def add(name: str, unit: str, meaning: str, **bounds: float) -> None:
        members["__annotations__"][name] = float
        members[name] = quantity(unit, meaning, **bounds)

    for i in indices:
        add(f"{m}_{i}", mass_unit, f"{inertia} of body {i}", above=0)
    for i in indices[:-1]:
        add(f"k_{i}{i + 1}", k_unit, f"stiffness between bodies {i} and {i + 1}", at_least=0)
    for i in indices:
        add(f"k_{i}", k_unit, f"stiffness from body {i} to ground", default=0.0, at_least=0)
    for i in indices:
        add(f"c_{i}", c_unit, f"viscous friction of body {i}", default=0.0, at_least=0)
    for i in indices[:-1]:
        add(f"c_{i}{i + 1}", c_unit, f"damping between bodies {i} and {i + 1}", default=0.0, at_least=0)
    for i in indices:
        add(f"a_{i}", mass_unit, f"known {inertia} added to body {i}", default=0.0, at_least=0)
        add(f"f_{i}c", force_unit, f"Coulomb friction of body {i}", default=0.0, at_least=0)
        add(f"f_{i}q", q_unit, f"quadratic drag of body {i}", default=0.0, at_least=0)
        add(f"f_{i}s", force_unit, f"break-away {effort} of body {i} (0: as Coulomb)", default=0.0, at_least=0)
        add(f"v_{i}s", v_unit, f"Stribeck speed of body {i}", default=0.0, at_least=0)
        add(f"delta_{i}", position_unit, f"presliding length of body {i} (Dahl)", default=0.0, at_least=0)

    def energies(p: Any, q: Any, v: Any) -> tuple[Any, Any, Any]:
        links = [(i - 1, i, f"{i}{i + 1}") for i in indices[:-1]]
        T = sum((getattr(p, f"{m}_{i}") + getattr(p, f"a_{i}")) * v[i - 1] ** 2 / 2 for i in indices)
        V = sum(getattr(p, f"k_{i}") * q[i - 1] ** 2 / 2 for i in indices)
        D = sum(getattr(p, f"c_{i}") * v[i - 1] ** 2 / 2 for i in indices)
        V_links = sum(getattr(p, f"k_{name}") * (q[j] - q[i]) ** 2 / 2 for i, j, name in links)
        D_links = sum(getattr(p, f"c_{name}") * (v[j] - v[i]) ** 2 / 2 for i, j, name in links)
        return T, V + V_links, D + D_links

    def outline(p: Any, q: Any) -> Outline:
        """Carts on a rail, or disks on a vertical shaft with a spoke each; distances are for the eye."""
        last = bodies - 1
        if kind == "rectilinear":
            rail = [(-0.1, 0, -0.03), (0.25 * last + 0.1, 0, -0.03)]
            return [("", rail), *((f"{x}_{i}", box(0.25 * (i - 1) + q[i - 1], 0.12, 0.06)) for i in indices)]
        from sympy import cos, sin

        lines: Outline = [("", [(0, 0, -0.12), (0, 0, 0.12 * last + 0.06)])]
        for i in indices:
            z = 0.12 * (i - 1)
            spoke = [(0, 0, z), (0.1 * cos(q[i - 1]), 0.1 * sin(q[i - 1]), z)]
            lines += [("", circle(0.1, z)), (f"{x}_{i}", spoke)]
        return lines

    members |= {
        "outline": staticmethod(outline),
        "__doc__": f"Chain of {bodies} {inertia}(s), {effort} on body 1.",
        "coordinates": tuple(Coordinate(f"{x}_{i}", position_unit, f"{place} {i}") for i in indices),
        "inputs": (Input(u, force_unit, f"{effort} on body 1", on=f"{x}_1"),),
        "joints": tuple(Joint(f"{x}_{i}", f"f_{i}c", f"f_{i}q", f"f_{i}s", f"v_{i}s", f"delta_{i}") for i in indices),
        "energies": staticmethod(energies),
    }
    made: Any = type(Plant)
    return made(f"{kind.title()}{bodies}", (Plant,), members)


_BUILT_IN: dict[tuple[str, int], type[Plant]] = {}
for _kind in _UNITS:
    for _bodies in (1, 2, 3):
        _BUILT_IN[_kind, _bodies] = _chain(_bodies, _kind)

# under the names their classes carry, so that a plant can be pickled and sent to another process
Rectilinear1, Rectilinear2, Rectilinear3 = (_BUILT_IN["rectilinear", n] for n in (1, 2, 3))
Torsional1, Torsional2, Torsional3 = (_BUILT_IN["torsional", n] for n in (1, 2, 3))


def added_mass(count: int, mass: float = MASS) -> float:
    """Mass [kg] of `count` masses on a cart."""
    if count < 0 or mass <= 0:
        raise ImpossiblePhysics(f"masses are counted from 0 and weigh something, got {count} of {mass:g} kg.")
    return count * mass


def added_inertia(count: int, radius: float, *, mass: float = MASS, mass_radius: float = 0.0) -> float:
    """Inertia [kg m^2] about the disk's axis of `count` masses bolted at `radius` [m]; parallel axes.

    Parameters
    ----------
    count : int
        Number of masses, all at the same radius.
    radius : float
        Axis of the disk to axis of a mass [m]; 0.02 to 0.09 on the ECP 205.
    mass : float
        One mass [kg].
    mass_radius : float
        Radius [m] of one cylindrical mass; 0 takes it as a point.
    """
    if radius < 0 or mass_radius < 0:
        raise ImpossiblePhysics(f"a radius cannot be negative, got {radius:g} m and {mass_radius:g} m.")
    return added_mass(count, mass) * (radius**2 + mass_radius**2 / 2)
