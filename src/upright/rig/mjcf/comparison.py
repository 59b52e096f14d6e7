"""Does the plant accelerate as MuJoCo's bodies do?"""

from __future__ import annotations

import numpy as np

from upright.physics import Plant, name_of
from upright.physics.equations import mass_and_force
from upright.rig.mjcf.axes import Axes
from upright.rig.mjcf.bodies import OWN, Bodies

AGREEMENT = 1e-6
"""How far the plant's accelerations may be from MuJoCo's, of the largest, where a file's numbers are rounded."""


def check_accelerations(bodies: Bodies, plant: Plant, axes: Axes) -> list[str]:
    """Refuse a plant that accelerates otherwise than the file's bodies, at 20 random states and forces."""
    rng, order = np.random.default_rng(24), [*axes.order]
    n = len(order)
    parameters, derived = plant.parameters(), type(plant).derived_for(plant.parameters())
    ours, theirs = np.empty((20, n)), np.empty((20, n))
    slow = np.array([2.5 if c.unit == "rad" else 0.5 for c in plant.coordinates])
    for k in range(20):
        q, v = rng.uniform(-slow, slow), rng.uniform(-3.0, 3.0, n)
        u = float(rng.uniform(-1.0, 1.0))
        state = {c.name: x for c, x in zip(plant.coordinates, q, strict=True)}
        state |= {f"{c.name}_dot": x for c, x in zip(plant.coordinates, v, strict=True)}
        M, force = mass_and_force(derived, {**parameters, **state, plant.inputs[0].name: u})
        ours[k] = np.linalg.solve(M, force)
        speeds, applied = np.empty(n), np.zeros(n)
        speeds[order], applied[axes.order[0]] = axes.sign * v, axes.sign[0] * u
        theirs[k] = axes.sign * bodies.place(axes.joints(q), speeds, applied).qacc[order]
    far = np.abs(ours - theirs).max(axis=0) / np.abs(theirs).max()
    if far.max() > AGREEMENT:
        worst = plant.coordinates[int(far.argmax())].name
        raise bodies.error(
            f"its joints are those of a {name_of(type(plant))}, but its accelerations of {worst} are up to "
            f"{100 * far.max():.2g} % of the largest away from such a plant's; {_reasons(bodies, axes)}{OWN}"
        )
    return [f"Accelerations agree with MuJoCo's within {far.max():.0e} of the largest."] if far.max() > 1e-9 else []


def _reasons(bodies: Bodies, axes: Axes) -> str:
    """What in the file may be behind it."""
    m, out = bodies.model, list[str]()
    if m.opt.density or m.opt.viscosity:
        out.append("a medium (density, viscosity)")
    if np.any(m.body_gravcomp):
        out.append("gravity compensation")
    for name, what in (("jnt_stiffnesspoly", "nonlinear springs"), ("dof_dampingpoly", "nonlinear damping")):
        if np.any(getattr(m, name, 0.0)):
            out.append(what)
    if np.any(m.dof_armature[[*axes.order[1:]]]):
        out.append("armature of a joint behind the first")
    if any(m.body_ipos.ravel()) or any(m.body_iquat[:, 1:].ravel()):
        out.append("bodies that are out of balance, or out of the plane")
    return f"the file has {', '.join(out)}; " if out else ""
