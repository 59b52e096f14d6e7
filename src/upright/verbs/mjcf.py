"""A rig that an MJCF file describes: `from_mjcf`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.rig import Rig


def from_mjcf(file: PathLike) -> Rig:
    """Rig of a MuJoCo model (MJCF), where its bodies are one of upright's plants.

    Read are a pendulum, one on a cart or on an arm (Furuta), two links, a flexible link, and up to nine carts or disks
    in a chain of springs (tendons). MuJoCo compiles the file, so that defaults, includes and masses of geoms are its
    own. Damping and springs become the plant's, ``frictionloss`` its Coulomb friction, armature part of its inertias,
    the actuator its drive, the range of the driven joint its travel. The plant's accelerations are compared with
    MuJoCo's at 20 states before it is answered. Verbs that take a rig take the file itself too.

    Parameters
    ----------
    file : path
        MJCF, ending in .xml.

    Returns
    -------
    Rig
        Its numbers have the file as their source; `basis` says what was left out. Commands have no unit in MJCF:
        ``rig.replace(unit="V")`` gives them one.

    Raises
    ------
    BadInput
        When MuJoCo is not installed (``pip install 'upright[mujoco]'``) or cannot read the file, or it has what none of
        the plants has.
    """
    from upright.rig.mjcf import read_mjcf

    return read_mjcf(Path(file)).rig
