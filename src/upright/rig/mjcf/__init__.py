"""A rig that an MJCF file describes.

MuJoCo compiles the file, so that its defaults, includes and inertias of geoms are MuJoCo's own. Parameters are read off
the compiled model's mass matrix and forces, which holds armature and products of inertia too, and the accelerations of
the plant are compared with MuJoCo's before anything is answered.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from upright.basis import RESERVED, Basis
from upright.errors import ImpossiblePhysics
from upright.physics import Plant, name_of
from upright.rig.hardware import Hardware
from upright.rig.mjcf.axes import Axes
from upright.rig.mjcf.bodies import OWN, Bodies
from upright.rig.mjcf.comparison import check_accelerations
from upright.rig.mjcf.drive import read_drive
from upright.rig.mjcf.plants import plant_in
from upright.rig.rig import Rig


@dataclass(frozen=True, kw_only=True)
class FromMjcf:
    """A rig of an MJCF file.

    Attributes
    ----------
    rig : Rig
    joints : mapping of str to str
        By coordinate, how it follows from the file's joint: ``"pole - 3.1416 rad"``.
    left_out : tuple of str
        What the file has and the rig has not, in sentences.
    """

    rig: Rig
    joints: Mapping[str, str]
    left_out: tuple[str, ...]

    @property
    def coordinates(self) -> str:
        """The same as a sentence."""
        return f"In the file's joints: {', '.join(f'{c} = {joint}' for c, joint in self.joints.items())}."


def read_mjcf(path: Path) -> FromMjcf:
    """Rig of an MJCF file, where its bodies are one of our plants.

    Raises
    ------
    BadInput
        When MuJoCo is missing or cannot read the file, or the file has what none of our plants has.
    """
    bodies = Bodies(path)
    kind, values, axes = plant_in(bodies)
    names = kind.names()
    try:
        plant = kind(**values)
    except ImpossiblePhysics as error:
        raise bodies.error(f"as a {name_of(kind)} it would be impossible: {str(error).rstrip('.')}; {OWN}") from error
    left_out = [*check_accelerations(bodies, plant, axes), *_friction_without_place(bodies, plant, axes)]
    plant = _with_dry_friction(bodies, plant, axes)
    (gain, command), entries, of_drive = read_drive(bodies, plant, axes)
    left_out += [*bodies.left_out(axes.order[1:]), *of_drive]
    basis = " ".join([f"Parameters as {path.name} has them, not identified.", *left_out])
    rig = Rig(
        plant=plant, name=bodies.name or name_of(kind), gain=gain, unit=command, hardware=Hardware(entries=entries),
        sources=dict.fromkeys((*names, "actuator.gain"), path.name), basis=Basis(level=RESERVED, sentence=basis),
    )  # fmt: skip
    return FromMjcf(rig=rig, joints=axes.described(bodies, plant), left_out=tuple(left_out))


def _with_dry_friction(bodies: Bodies, plant: Plant, axes: Axes) -> Plant:
    """The plant with the joints' frictionloss as Coulomb friction."""
    of = {j.on: j.coulomb for j in plant.joints}
    losses = bodies.model.dof_frictionloss[[*axes.order]]
    return plant.replace(**{
        of[c.name]: float(loss) for c, loss in zip(plant.coordinates, losses, strict=True) if c.name in of
    })  # fmt: skip


def _friction_without_place(bodies: Bodies, plant: Plant, axes: Axes) -> list[str]:
    of = {j.on for j in plant.joints}
    lost = [
        bodies.joint(int(j)) for c, j in zip(plant.coordinates, axes.order, strict=True)
        if c.name not in of and bodies.model.dof_frictionloss[j]
    ]  # fmt: skip
    return [f"Left out: dry friction of joint {', '.join(lost)}."] if lost else []
