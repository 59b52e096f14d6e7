"""What does a plant hand to the code that steps it?

Equations of motion as plain text, derived once from the plant's energies, so that nothing needs SymPy at run time.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class DryJoint:
    """Dry friction of one coordinate: names of the parameters that set it, "" where a term is absent."""

    coordinate: int
    coulomb: str = ""
    quadratic: str = ""
    stiction: str = ""
    stribeck_speed: str = ""
    presliding: str = ""


@dataclass(frozen=True, kw_only=True)
class Derived:
    """Equations of motion ``M(q) a = f(q, v, u) + dry friction`` as text.

    Attributes
    ----------
    name : str
        Name of the plant's class.
    coordinates, inputs, parameters : tuple of str
        Names, in order; the velocity of ``theta`` is called ``theta_dot``.
    lumps : tuple of str
        Expressions in the parameters alone; the i-th is called ``k{i}`` below.
    trig : tuple of (str, str, str)
        Name of a sine, name of the cosine, their common argument.
    steps : tuple of (str, str)
        Intermediate results in the order in which to evaluate them.
    mass : tuple of str
        Upper triangle of the mass matrix, row by row.
    force : tuple of str
        Generalized forces: inputs, gravity, springs, gyroscopic and viscous terms, no dry friction.
    stiffness, damping, gain : tuple of str
        ``-df/dq``, ``-df/dv`` (n x n, row by row) and ``df/du`` (n x inputs) at rest without input,
        in parameters and coordinates, with ``sin`` and ``cos`` written out.
    kinetic, potential, power_lost : str
        Energies [J] and viscous power [W], in parameters, coordinates and velocities.
    joints : tuple of DryJoint
        Dry friction, joint by joint.
    """

    name: str
    coordinates: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    lumps: tuple[str, ...]
    trig: tuple[tuple[str, str, str], ...]
    steps: tuple[tuple[str, str], ...]
    mass: tuple[str, ...]
    force: tuple[str, ...]
    stiffness: tuple[str, ...]
    damping: tuple[str, ...]
    gain: tuple[str, ...]
    kinetic: str
    potential: str
    power_lost: str
    joints: tuple[DryJoint, ...] = ()
