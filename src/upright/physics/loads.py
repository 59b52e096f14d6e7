"""How much inertia do the laboratory's 500 g masses add?"""

from __future__ import annotations

from upright.errors import ImpossiblePhysics

MASS = 0.5  # kg, one brass mass of ECP 205 and ECP 210


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
