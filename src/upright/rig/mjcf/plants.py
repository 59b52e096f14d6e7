"""Which plant are a file's bodies, and with which numbers? Read off the mass matrix, springs, dampers and gravity."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from upright.physics import CartPendulum, DoublePendulum, FlexibleLink, Furuta, Pendulum, Plant, chain
from upright.records import Array
from upright.rig.mjcf.axes import Axes
from upright.rig.mjcf.bodies import HINGE, OWN, SLIDE, Bodies, actuated

Recognised = tuple[type[Plant], dict[str, float], Axes]


def plant_in(bodies: Bodies) -> Recognised:
    """Kind of plant, its numbers without dry friction, its coordinates."""
    kinds, parents = bodies.kinds, bodies.parents()
    row = parents == list(range(-1, len(kinds) - 1))
    if len(kinds) > 1 and not any(p >= 0 for p in parents) and len({*kinds}) == 1:
        return _chain(bodies)
    if len(kinds) == 1:
        return _pendulum(bodies) if kinds == [HINGE] and _swings(bodies, 0) else _chain(bodies)
    if row and kinds == [SLIDE, HINGE]:
        return _cart(bodies)
    if row and kinds == [HINGE, HINGE]:
        along = abs(float(bodies.data.xaxis[0] @ bodies.data.xaxis[1]))
        if along < 1e-6:
            return _furuta(bodies)
        if along > 1 - 1e-9:
            return (_two_links if _swings(bodies, 0) else _flexible)(bodies)
    shapes = ", ".join("slide" if k == SLIDE else "hinge" for k in kinds)
    between = "" if row or len(kinds) == 1 else " not all in a row"
    raise bodies.error(
        f"its joints ({shapes}{between}) are those of no plant of upright, which reads a pendulum, one on a cart or on "
        f"an arm (Furuta), two links, a flexible link, and carts or disks in a chain of springs; {OWN}"
    )


def _down(bodies: Bodies) -> tuple[Array, float]:
    """Direction of gravity and its size [m/s^2]."""
    g = np.array(bodies.model.opt.gravity, dtype=float)
    if bodies.model.opt.disableflags & bodies.mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        g[:] = 0.0
    size = float(np.linalg.norm(g))
    return (g / size if size else np.zeros(3)), size


def _swings(bodies: Bodies, joint: int) -> bool:
    """Whether gravity acts about the joint as on a pendulum: its axis is level."""
    down, size = _down(bodies)
    return size > 0 and abs(float(bodies.data.xaxis[joint] @ down)) < 1e-3


def _own_mass(bodies: Bodies, joint: int) -> tuple[float, Array]:
    """Mass of what the joint carries, and its centre of gravity, at the file's own position."""
    body = int(bodies.model.jnt_bodyid[joint])
    return float(bodies.model.body_subtreemass[body]), bodies.data.subtree_com[body].copy()


def _across(bodies: Bodies, joint: int, to: Array) -> Array:
    """Way from the joint's axis to a point, at right angles."""
    axis = bodies.data.xaxis[joint]
    way = to - bodies.data.xanchor[joint]
    return way - axis * float(axis @ way)


def _turned(axis: Array, start: Array, to: Array) -> float:
    """Angle about an axis from one direction to another [rad]."""
    return math.atan2(float(axis @ np.cross(start, to)), float(start @ to))


def _hanging(bodies: Bodies, joint: int, down: Array, to: Array) -> float:
    """Joint's position at which the way to a point, which turns with it, is along `down`."""
    angle = _turned(bodies.data.xaxis[joint], down, _across(bodies, joint, to))
    return float(bodies.model.qpos0[joint]) - angle


def _springs_and_dampers(bodies: Bodies, axes: Axes) -> tuple[Array, Array]:
    K, D, _ = bodies.stiffness_and_damping()
    return axes.turned(K), axes.turned(D)


def _no_spring(bodies: Bodies, axes: Axes, K: Array, allowed: Callable[[int], bool] = lambda _: False) -> None:
    """Refuse a spring where the plant has none."""
    for i, joint in enumerate(axes.order):
        if K[i, i] and not allowed(i):
            raise bodies.error(
                f"joint {bodies.joint(int(joint))} has a spring ({K[i, i]:.4g}), which the plant has not there; {OWN}"
            )


def _axes(bodies: Bodies, zero: list[float], sign: list[float] | None = None) -> Axes:
    """Joints in the file's order."""
    n = len(zero)
    return Axes(order=tuple(range(n)), sign=np.ones(n) if sign is None else np.array(sign), zero=np.array(zero))


def _pendulum(bodies: Bodies) -> Recognised:
    down, g = _down(bodies)
    m, com = _own_mass(bodies, 0)
    l_cg = float(np.linalg.norm(_across(bodies, 0, com)))
    if l_cg < 1e-9:
        return _chain(bodies)
    axes = _axes(bodies, [_hanging(bodies, 0, down, com)])
    K, D = _springs_and_dampers(bodies, axes)
    _no_spring(bodies, axes, K)
    J = _rounded(bodies.mass(axes.zero)[0, 0], m * l_cg**2)
    return Pendulum, {"m_p": m, "l_cg": l_cg, "J_p": J, "b_2": D[0, 0], "g": g}, axes


def _cart(bodies: Bodies) -> Recognised:
    down, g = _down(bodies)
    m_p, com = _own_mass(bodies, 1)
    l_cg = float(np.linalg.norm(_across(bodies, 1, com)))
    if not g or l_cg < 1e-9:
        raise bodies.error("gravity does not act on the pendulum, so that it is none; set gravity, or its mass")
    *_, rest = bodies.stiffness_and_damping()
    hanging = _hanging(bodies, 1, down, com)
    zero = [float(rest[0]), hanging]
    sign = math.copysign(1.0, bodies.mass(np.array(zero))[0, 1])
    axes = _axes(bodies, zero, [1.0, sign])
    K, D = _springs_and_dampers(bodies, axes)
    _no_spring(bodies, axes, K, lambda i: i == 0)
    M = axes.turned(bodies.mass(axes.zero))
    return CartPendulum, {
        "m_c": M[0, 0] - m_p, "m_p": m_p, "l_cg": l_cg, "J_p": _rounded(M[1, 1], m_p * l_cg**2), "b_1": D[0, 0],
        "b_2": D[1, 1], "k_x": K[0, 0], "g": g,
    }, axes  # fmt: skip


def _furuta(bodies: Bodies) -> Recognised:
    """From the mass matrix at hanging and level: J_d and J_a then hold a rod's products of inertia and armature."""
    down, g = _down(bodies)
    up, across = bodies.data.xaxis[0].copy(), bodies.data.xaxis[1].copy()
    upward = math.copysign(1.0, float(-down @ up))
    m_p, com = _own_mass(bodies, 1)
    l_cg = float(np.linalg.norm(_across(bodies, 1, com)))
    if not g or l_cg < 1e-9:
        raise bodies.error("gravity does not act on the pendulum, so that it is none; set gravity, or its mass")
    *_, rest = bodies.stiffness_and_damping()
    hanging = _hanging(bodies, 1, -upward * up, com)
    zero = np.array([float(rest[0]), hanging])
    sign = -math.copysign(1.0, bodies.mass(zero)[0, 1])
    axes = _axes(bodies, list(zero), [1.0, sign])
    K, D = _springs_and_dampers(bodies, axes)
    _no_spring(bodies, axes, K, lambda i: i == 0)
    M, level = (axes.turned(bodies.mass(axes.joints(np.array([0.0, q])))) for q in (0.0, math.pi / 2))
    r = -M[0, 1] / (m_p * l_cg)
    J_d = level[0, 0] - m_p * r**2 - M[1, 1]
    arm = -upward * sign * across
    turn = float(rest[0] - bodies.model.qpos0[0])  # the arm's direction at psi = 0
    arm = arm * math.cos(turn) + np.cross(up, arm) * math.sin(turn)
    return Furuta, {
        "m_p": m_p, "l_cg": l_cg, "r": r, "J_d": J_d, "J_p": _rounded(M[1, 1], m_p * l_cg**2),
        "J_a": _rounded(M[0, 0], J_d + m_p * r**2), "b_1": D[0, 0], "b_2": D[1, 1], "k_psi": K[0, 0], "g": g,
        "tilt_x": _tilt(float(down @ arm)), "tilt_y": _tilt(float(down @ np.cross(up, arm))),
    }, axes  # fmt: skip


def _two_links(bodies: Bodies) -> Recognised:
    down, g = _down(bodies)
    (whole, _), (m_2, com_2) = (_own_mass(bodies, i) for i in (0, 1))
    first, second = (int(b) for b in bodies.model.jnt_bodyid)
    elbow = bodies.data.xanchor[1].copy()
    m_1 = whole - m_2
    com_1 = (whole * bodies.data.subtree_com[first] - m_2 * bodies.data.subtree_com[second]) / m_1
    link, lower = _across(bodies, 0, elbow), _across(bodies, 1, com_2)
    l_1, l_c2 = float(np.linalg.norm(link)), float(np.linalg.norm(lower))
    if min(l_1, l_c2) < 1e-9:
        raise bodies.error("both links need a length: their joints, or a joint and its centre of gravity, coincide")
    l_c1 = float(_across(bodies, 0, com_1) @ link) / l_1
    same = math.copysign(1.0, float(bodies.data.xaxis[0] @ bodies.data.xaxis[1]))
    axes = _axes(bodies, [_hanging(bodies, 0, down, elbow), _hanging(bodies, 1, link, com_2)], [1.0, same])
    K, D = _springs_and_dampers(bodies, axes)
    _no_spring(bodies, axes, K)
    M = axes.turned(bodies.mass(axes.joints(np.array([0.0, math.pi / 2]))))
    J_1 = _rounded(M[0, 0] - M[1, 1], m_1 * l_c1**2 + m_2 * l_1**2)
    return DoublePendulum, {
        "m_1": m_1, "m_2": m_2, "l_1": l_1, "l_c1": l_c1, "l_c2": l_c2, "J_1": J_1,
        "J_2": _rounded(M[1, 1], m_2 * l_c2**2), "b_1": D[0, 0], "b_2": D[1, 1], "g": g,
    }, axes  # fmt: skip


def _flexible(bodies: Bodies) -> Recognised:
    *_, rest = bodies.stiffness_and_damping()
    same = math.copysign(1.0, float(bodies.data.xaxis[0] @ bodies.data.xaxis[1]))
    axes = _axes(bodies, list(rest), [1.0, same])
    K, D = _springs_and_dampers(bodies, axes)
    _no_spring(bodies, axes, K, lambda i: i == 1)
    M = axes.turned(bodies.mass(axes.zero))
    return FlexibleLink, {
        "J_h": M[0, 0] - M[1, 1], "J_l": M[1, 1], "k_s": K[1, 1], "b_1": D[0, 0], "b_2": D[1, 1],
    }, axes  # fmt: skip


def _chain(bodies: Bodies) -> Recognised:
    """Bodies each on a joint to ground, neighbours joined by tendons, from the driven one on."""
    K, D, rest = bodies.stiffness_and_damping()
    n = len(rest)
    if n > 9:
        raise bodies.error(f"a chain has at most 9 bodies, this one has {n}; {OWN}")
    coupled = (np.abs(K) + np.abs(D) > 0) & ~np.eye(n, dtype=bool)
    order = _in_a_row(bodies, coupled)
    sign = np.ones(n)
    for i in range(1, n):
        a, b = order[i - 1], order[i]
        sign[i] = -sign[i - 1] * math.copysign(1.0, K[a, b] or D[a, b] or -1.0)
    axes = Axes(order=tuple(order), sign=sign, zero=rest[order])
    K, D, M = axes.turned(K), axes.turned(D), axes.turned(bodies.mass(rest))
    kind = "rectilinear" if bodies.kinds[0] == SLIDE else "torsional"
    letter = "m" if kind == "rectilinear" else "J"
    values: dict[str, float] = {}
    for i in range(n):
        values[f"{letter}_{i + 1}"] = M[i, i]
        values |= {f"k_{i + 1}": _rounded(K[i].sum(), 0.0, K[i, i]), f"c_{i + 1}": _rounded(D[i].sum(), 0.0, D[i, i])}
        if i + 1 < n:
            values |= {f"k_{i + 1}{i + 2}": -K[i, i + 1] + 0.0, f"c_{i + 1}{i + 2}": -D[i, i + 1] + 0.0}
    return chain(n, kind), values, axes


def _in_a_row(bodies: Bodies, coupled: NDArray[np.bool_]) -> list[int]:
    """Joints from the driven end of a chain on; in the file's order where nothing couples them."""
    n = len(coupled)
    driven = actuated(bodies)
    start = driven if driven is not None else next((i for i in range(n) if coupled[i].sum() < 2), 0)
    if not coupled.any():
        return [start, *(i for i in range(n) if i != start)]
    order = [start]
    while len(order) < n:
        onward = [i for i in np.flatnonzero(coupled[order[-1]]) if i not in order]
        if len(onward) != 1:
            raise bodies.error(
                f"its bodies are not coupled in a row that begins at joint {bodies.joint(start)}, "
                f"the driven one, so that they are no chain of upright's; {OWN}"
            )
        order.append(int(onward[0]))
    return order


def _rounded(total: float, part: float, scale: float | None = None) -> float:
    """A difference, zero where rounding is all that it holds."""
    rest = float(total - part)
    return 0.0 if abs(rest) < 1e-14 * abs(total if scale is None else scale) else rest


def _tilt(sine: float) -> float:
    """Sine of a lean, zero where the file's rounding is all that it holds."""
    return 0.0 if abs(sine) < 1e-12 else float(sine)
