"""A file's actuator as the drive of a rig, and how far the driven joint goes."""

from __future__ import annotations

import math

import numpy as np

from upright.physics import Plant, name_of
from upright.records import Array
from upright.rig.hardware import Entry, driven_unit
from upright.rig.mjcf.axes import Axes
from upright.rig.mjcf.bodies import OWN, Bodies, actuated


def read_drive(bodies: Bodies, plant: Plant, axes: Axes) -> tuple[tuple[float, str], dict[str, Entry], list[str]]:
    """Gain and unit of the command, numbers of the drive and the travel, and what they leave out."""
    m, mj, force = bodies.model, bodies.mujoco, plant.inputs[0].unit
    place, first, driven = driven_unit(type(plant)), int(axes.order[0]), actuated(bodies)
    numbers: dict[str, tuple[float, str]] = {}
    left_out: list[str] = []
    if m.jnt_limited[first]:
        low, high = m.jnt_range[first] - axes.zero[0]
        if low < 0 < high:
            numbers["travel"] = (float(min(-low, high)), place)
            if not math.isclose(-low, high):
                left_out.append(f"The travel is that of joint {bodies.joint(first)} to its nearer end.")
    gain, unit = 1.0, force
    if driven is None:
        left_out.append("The file has no actuator; the command is the force itself.")
    else:
        if driven != first:
            raise bodies.error(
                f"its actuator acts on joint {bodies.joint(driven)}, and the drive of a {name_of(type(plant))} on "
                f"{plant.inputs[0].on}, joint {bodies.joint(first)}; {OWN}"
            )
        gear, prm, bias = float(m.actuator_gear[0, 0]), m.actuator_gainprm[0], m.actuator_biasprm[0]
        kind, dynamics = int(m.actuator_biastype[0]), int(m.actuator_dyntype[0])
        affine, lagging = (
            kind == mj.mjtBias.mjBIAS_AFFINE,
            dynamics in (mj.mjtDyn.mjDYN_FILTER, mj.mjtDyn.mjDYN_FILTEREXACT),
        )
        plain = int(m.actuator_gaintype[0]) == mj.mjtGain.mjGAIN_FIXED and gear * prm[0]
        plain = plain and (kind == mj.mjtBias.mjBIAS_NONE or (affine and not bias[1]))
        plain = plain and (dynamics == mj.mjtDyn.mjDYN_NONE or lagging)
        if not plain or np.any(getattr(m, "actuator_damping", 0.0)):
            raise bodies.error(
                "its actuator is no drive of upright's, whose force is the command times a gain less the speed times a "
                "loss, with a first-order lag; make it a motor, or a general one with such parameters"
            )
        gain, sign = gear * float(prm[0]), float(axes.sign[0])
        unit, per = (force, force) if gain == 1.0 else ("1", "1")
        gain *= sign
        if affine and bias[2]:
            numbers["slope"] = (-float(bias[2]) * gear**2, f"({force})/({place}/s)")
        if affine and bias[0]:
            numbers["offset"] = (float(bias[0] / prm[0]), per)
        if lagging:
            numbers["lag"] = (float(m.actuator_dynprm[0, 0]), "s")
        if m.actuator_ctrllimited[0]:
            numbers["limit"] = (_symmetric(m.actuator_ctrlrange[0], "command", left_out), per)
        most = [abs(gear) * _symmetric(m.actuator_forcerange[0], "force", left_out)] * bool(m.actuator_forcelimited[0])
        if m.jnt_actfrclimited[first]:
            most.append(_symmetric(m.jnt_actfrcrange[first], "force", left_out))
        if most:
            numbers["force_limit"] = (min(most), force)
        if getattr(m, "actuator_delay", np.zeros(1))[0]:
            numbers["delay"] = (float(m.actuator_delay[0]), "s")
    entries = {n: Entry(value=value, unit=of, source=bodies.file) for n, (value, of) in numbers.items()}
    return (gain, unit), entries, left_out


def _symmetric(range_: Array, what: str, left_out: list[str]) -> float:
    """Limit that holds either way, and a sentence where the file's is not the same both ways."""
    low, high = -float(range_[0]), float(range_[1])
    if not math.isclose(low, high):
        left_out.append(f"The {what}'s limit, {-low:g} to {high:g} in the file, is the smaller one either way.")
    return min(low, high)
