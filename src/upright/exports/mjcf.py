"""An identified rig as MuJoCo's MJCF: bodies, joints and springs whose motion is that of our equations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from upright.errors import BadInput
from upright.physics import CartPendulum, DoublePendulum, DoublePendulumAbsolute, FlexibleLink, Furuta, Pendulum
from upright.physics.oscillators import chain
from upright.rig import Rig

LEAST = 1e-12
"""Inertia of what has none [kg m^2], which MuJoCo does not take."""
_DRIVE = {
    "delay": "dead time of the drive", "offset": "offset of the drive", "knee": "its torque-speed curve",
    "droop": "its falling gain", "dead_zone": "its dead zone", "relaxation": "braking that builds up",
    "damping_rise": "braking by the command",
}  # fmt: skip


def model(rig: Rig, *, timestep: float = 1e-3) -> tuple[str, tuple[str, ...]]:
    """Text of the model, and in sentences what MuJoCo does not have or has otherwise.

    Viscous friction and springs are exact. Coulomb friction is MuJoCo's ``frictionloss``, a soft constraint: it slides
    alike and creeps where our joints stick.

    Raises
    ------
    BadInput
        When no bodies of this plant are known.
    """
    p: Any = rig.plant
    bodies, tendons, gravity = _bodies(p, rig.name)
    remarks = [*_left_out(rig)]
    if isinstance(p, DoublePendulumAbsolute):
        remarks.append("Joint theta_2_relative is theta_2 - theta_1: joints of MJCF turn against the body they are on.")
    return (
        f"""\
<mujoco model="{rig.name.rpartition(":")[2]}">
  <!-- Written by upright export. Joints are the coordinates: SI and radians, angles as the plant counts them. -->
{"".join(f"  <!-- {line} -->{chr(10)}" for line in (*_first_line(rig), *remarks))}\
  <compiler angle="radian" autolimits="false" inertiafromgeom="false" balanceinertia="false"/>
  <option timestep="{timestep!r}" integrator="RK4" gravity="{_vector(gravity)}"><flag contact="disable"/></option>
  <worldbody>
{bodies}
  </worldbody>
{tendons}  <actuator>
{_actuator(rig)}
  </actuator>
</mujoco>
""",
        tuple(remarks),
    )


def _first_line(rig: Rig) -> list[str]:
    """How far the numbers can be trusted, as it can stand in a comment."""
    return [line.replace("--", "- -") for line in [rig.basis.first_line()] if line]


def _bodies(p: Any, name: str) -> tuple[str, str, tuple[float, float, float]]:
    """Bodies, tendons, gravity."""
    v: Mapping[str, float] = p.parameters()
    down = (0.0, 0.0, -v.get("g", 0.0))
    if isinstance(p, Pendulum):
        rod = _joint(v, "theta", "0 -1 0", "b_2") + _inertial(p.m_p, p.J_p, p.J_p, p.l_cg) + _rod(p.l_cg)
        return _body(rod), "", down
    if isinstance(p, CartPendulum):
        rod = _joint(v, "theta", "0 -1 0", "b_2") + _inertial(p.m_p, p.J_p, p.J_p, p.l_cg) + _rod(p.l_cg)
        cart = _joint(v, "x", "1 0 0", "b_1", stiffness=p.k_x, kind="slide") + _inertial(p.m_c, 1e-3, 1e-3)
        return _body(cart + _BOX + _body(rod)), "", down
    if isinstance(p, Furuta):
        if p.J_a > 2 * p.J_p:
            raise BadInput(
                f"MuJoCo takes no body whose axial inertia, J_a = {p.J_a:g} kg m^2, is above twice its transverse one, "
                f"J_p = {p.J_p:g}; no rod has that: identify with J_a known, 0 for a thin rod."
            )
        rod = _joint(v, "theta", "-1 0 0", "b_2") + _inertial(p.m_p, p.J_p, p.J_a, p.l_cg) + _rod(p.l_cg)
        arm = _joint(v, "psi", "0 0 1", "b_1", stiffness=p.k_psi) + _inertial(1.0, p.J_d / 2, p.J_d)
        arm += f'<geom type="capsule" fromto="0 0 0 {p.r!r} 0 0" {_SHOWN}/>'
        level = math.sqrt(1 - p.tilt_x**2 - p.tilt_y**2)
        return _body(arm + _body(rod, f"{p.r!r} 0 0")), "", (p.g * p.tilt_x, p.g * p.tilt_y, -p.g * level)
    if isinstance(p, DoublePendulum | DoublePendulumAbsolute):
        second = "theta_2" if isinstance(p, DoublePendulum) else "theta_2_relative"
        lower = _joint(v, second, "0 -1 0", "b_2") + _inertial(p.m_2, p.J_2, p.J_2, p.l_c2) + _rod(p.l_c2)
        upper = _joint(v, "theta_1", "0 -1 0", "b_1") + _inertial(p.m_1, p.J_1, p.J_1, p.l_c1) + _rod(p.l_1 / 2)
        return _body(upper + _body(lower, f"0 0 {-p.l_1!r}")), "", down
    if isinstance(p, FlexibleLink):
        link = _joint(v, "alpha", "0 0 1", "b_2", stiffness=p.k_s) + _inertial(1.0, p.J_l / 2, p.J_l)
        hub = _joint(v, "theta", "0 0 1", "b_1") + _inertial(1.0, p.J_h / 2, p.J_h)
        return _body(hub + _body(link)), "", down
    return _chained(p, v, name)


def _chained(p: Any, v: Mapping[str, float], name: str) -> tuple[str, str, tuple[float, float, float]]:
    """Carts or disks, each on its own joint to ground, neighbours joined by tendons."""
    n = len(p.coordinates)
    kind = next((k for k in ("rectilinear", "torsional") if n <= 9 and type(p) is chain(n, k)), "")
    if not kind:
        raise BadInput(f"the bodies of a '{name}' are not known, only its equations; the target fmu takes any plant.")
    letter, axis, joint = ("m", "1 0 0", "slide") if kind == "rectilinear" else ("J", "0 0 1", "hinge")
    bodies, tendons = "", ""
    for i, c in enumerate(p.coordinates, start=1):
        total = v[f"{letter}_{i}"] + v[f"a_{i}"]
        inside = _joint(v, c.name, axis, f"c_{i}", f"f_{i}c", v[f"k_{i}"], joint) + _inertial(total, total / 2, total)
        bodies += _body(inside, f"0 {0.3 * i!r} 0" if kind == "rectilinear" else f"0 0 {-0.1 * i!r}")
        if i < n:
            ends = f'<joint joint="{c.name}" coef="-1"/><joint joint="{p.coordinates[i].name}" coef="1"/>'
            spring = f'stiffness="{v[f"k_{i}{i + 1}"]!r}" damping="{v[f"c_{i}{i + 1}"]!r}" springlength="0 0"'
            tendons += f"    <fixed {spring}>{ends}</fixed>\n"
    return bodies, f"  <tendon>\n{tendons}  </tendon>\n" if tendons else "", (0.0, 0.0, 0.0)


def _actuator(rig: Rig) -> str:
    """The drive: its gain, limits, lag, and what it loses with speed."""
    out: list[str] = []
    drive, hardware = rig.more, rig.hardware
    lost = sum(drive.get(f"actuator.{n}", 0.0) for n in ("slope", "damping", "standby"))
    limit, most = hardware.value("limit", math.inf), drive.get("actuator.force_limit", math.inf)
    for force in rig.plant.inputs:
        lag = f' dyntype="filter" dynprm="{rig.lag!r}"' if rig.lag else ""
        ranges = f' ctrllimited="true" ctrlrange="{-limit!r} {limit!r}"' if math.isfinite(limit) else ""
        ranges += f' forcelimited="true" forcerange="{-most!r} {most!r}"' if math.isfinite(most) else ""
        out.append(
            f'    <general name="{force.name}" joint="{force.on}" gainprm="{rig.gain!r}" biastype="affine" '
            f'biasprm="0 0 {-lost!r}"{lag}{ranges}/>'
        )
    return "\n".join(out)


def _left_out(rig: Rig) -> list[str]:
    """What MuJoCo does otherwise."""
    v, out = rig.plant.parameters(), list[str]()
    if any(v.get(j.coulomb, 0.0) for j in rig.plant.joints):
        out.append("Approximate: Coulomb friction is frictionloss, a soft constraint; where a joint sticks it creeps.")
    terms = {"quadratic": "quadratic drag", "stiction": "break-away friction", "presliding": "presliding deflection"}
    for name, words in terms.items():
        of = [j.on for j in rig.plant.joints if v.get(getattr(j, name), 0.0)]
        if of:
            out.append(f"Left out: {words} of {', '.join(of)}.")
    hardware = rig.hardware
    for name, words in _DRIVE.items():
        idle = math.inf if name == "knee" else 0.0
        if hardware.value(name, idle) != idle:
            out.append(f"Left out: {words}.")
    if any(rig.more.get(f"actuator.{n}") for n in ("damping", "standby")):
        out.append("Approximate: the drive brakes whether it is commanded or not.")
    return out


_SHOWN = 'size="0.005" mass="0" contype="0" conaffinity="0"'
_BOX = '<geom type="box" size="0.05 0.03 0.02" mass="0" contype="0" conaffinity="0"/>'


def _joint(
    v: Mapping[str, float], name: str, axis: str, viscous: str, dry: str = "", stiffness: float = 0.0,
    kind: str = "hinge",
) -> str:  # fmt: skip
    loss = v.get(dry or f"{viscous}c", 0.0)
    return (
        f'<joint name="{name}" type="{kind}" axis="{axis}" damping="{v[viscous]!r}" stiffness="{stiffness!r}" '
        f'frictionloss="{loss!r}"/>'
    )


def _inertial(mass: float, transverse: float, axial: float, below: float = 0.0) -> str:
    """A body symmetric about its own z axis, centre of gravity so far below its frame."""
    t, a = max(transverse, LEAST), max(axial, LEAST)
    return f'<inertial pos="0 0 {-below!r}" mass="{mass!r}" diaginertia="{t!r} {t!r} {a!r}"/>'


def _rod(l_cg: float) -> str:
    """A rod to look at, twice as long as far as its centre of gravity."""
    return f'<geom type="capsule" fromto="0 0 0 0 0 {-2 * l_cg!r}" {_SHOWN}/>'


def _body(inside: str, at: str = "0 0 0") -> str:
    return f'<body pos="{at}">{inside}</body>'


def _vector(values: tuple[float, ...]) -> str:
    return " ".join(repr(v) for v in values)
