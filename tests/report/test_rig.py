"""Does a rig's drawing show its coordinates, their zeros and their positive senses where its geometry has them?"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

import upright as up
from tests.physics.bumpers import Bumpers
from upright.physics import find
from upright.report.rig import rig_drawing, rig_table
from upright.rig import Hardware
from upright.rig.hardware import Entry

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
CART = up.CartPendulum(m_c=0.6, m_p=0.14, l_cg=0.19)
ROD = up.Pendulum(m_p=0.2, l_cg=0.3)
SHAFT = find("torsional-2")(J_1=0.01, J_2=0.01, k_12=2.0)
SWING, TURN, STEP = 0.7, 1.2, 0.2
"""Pose: an angle in a plane [rad], one about the vertical [rad], and a way as a share of the rig's size."""
ROUNDED = 0.11  # px, two tenths rounded


@dataclass(frozen=True)
class Line:
    points: np.ndarray
    colour: str
    width: float
    dashed: bool
    pale: bool


@cache
def drawn(plant):
    """Lines, arrow heads (tip first), and texts with their places [px], y down."""
    text = rig_drawing(plant).svg
    lines = [
        Line(np.array([p.split(",") for p in points.split()], dtype=float), colour, float(width), "dash" in more,
             "opacity" in more)
        for points, colour, width, more in re.findall(
            r'<polyline points="([^"]*)"[^>]*?stroke="([^"]*)" stroke-width="([^"]*)"([^>]*)/>', text)
    ]  # fmt: skip
    heads = [np.array(re.findall(r"(-?[\d.]+) (-?[\d.]+)", d), dtype=float)
             for d in re.findall(r'<path d="(M[^"]* L[^"]*z)"', text)]  # fmt: skip
    said = {re.sub("<[^>]*>|\u200b", "", inner): (float(x), float(y))
            for x, y, inner in re.findall(r'<text x="([^"]*)" y="([^"]*)"[^>]*>(.*?)</text>', text)}  # fmt: skip
    return text, lines, heads, said


def bodies(plant):
    return [line for line in drawn(plant)[1] if "--q" in line.colour and line.width in (3, 7) and not line.pale]


def arrows(plant):
    """Way of each arrow with the tip of its head."""
    shafts = [line.points for line in drawn(plant)[1] if "--q" in line.colour and line.width == 2]
    return list(zip(shafts, drawn(plant)[2], strict=True))


def close(a, b, atol=ROUNDED):
    np.testing.assert_allclose(a, b, rtol=0, atol=atol)


@pytest.mark.parametrize("plant", [ROD, CART])
def test_a_pendulum_is_drawn_swung_to_the_right_between_hanging_and_upright(plant):
    """From hanging to upright it takes two lengths, which are 250 px; its angle is 0 hanging and grows to +x."""
    rod, hinge = bodies(plant)[-1], hinge_of(plant)
    assert (hinge > 0) == (plant is CART)  # which stands where its arrow ends
    close(rod.points, [[hinge, 0], [hinge + 125 * math.sin(SWING), 125 * math.cos(SWING)]])
    assert rod.width == 7
    (pale,) = [line for line in drawn(plant)[1] if line.pale]
    close(pale.points, [[hinge, 0], [hinge, -125]])
    zero = next(line for line in drawn(plant)[1] if line.dashed and abs(line.points[1, 1] - 125) < 1)
    close(zero.points, [[hinge, 0], [hinge, 125]])
    shaft, head = arrows(plant)[-1]
    angles = np.linspace(0, SWING, 24)
    way = np.column_stack([hinge + 82.5 * np.sin(angles), 82.5 * np.cos(angles)])  # 0.66 of the rod
    close(shaft, way[:-2])
    close(head[0], way[-1])
    said = drawn(plant)[3]
    assert {"θ", "θ = 0, hanging", "θ = π, upright", "g"} <= said.keys()
    assert said["θ = 0, hanging"][1] > 125
    assert said["θ = π, upright"][1] < -100
    assert said["θ"][0] > hinge + 17
    assert f'<circle cx="{rod.points[0, 0]:.1f}" cy="-0.0" r="5"' in drawn(plant)[0]


def test_a_cart_s_arrow_points_right_from_the_middle_of_the_cart_at_zero_to_that_of_the_cart():
    cart = bodies(CART)[0]
    assert cart.width == 3
    close(cart.points[0], cart.points[-1])
    size = np.ptp(cart.points, axis=0)
    close(size, [125 / 3, 125 / 6])  # two thirds and one third of the distance to the centre of gravity
    middle = cart.points.min(axis=0) + size / 2
    close(middle[1], 0.0)
    moving = 125 + size[1] / 2  # from the rod's end to the top of the cart at zero
    close(middle[0], STEP * moving)
    shaft, head = arrows(CART)[0]
    close(shaft[0, 0], 0.0)
    close(head[0], [middle[0], shaft[0, 1]])
    assert (np.diff(shaft[:, 0]) > 0).all()
    assert np.ptp(shaft[:, 1]) == 0
    assert shaft[0, 1] > size[1] / 2  # below the cart
    (zero,) = [line for line in drawn(CART)[1] if line.dashed and np.ptp(line.points[:, 0]) == 0
               and abs(line.points[0, 0]) < 1]  # fmt: skip
    close(zero.points[:, 0], 0.0)
    rail = next(line for line in drawn(CART)[1] if "strong" in line.colour and line.width == 3)
    close(rail.points[:, 1], 0.0)
    assert rail.points[0, 0] < 0 < hinge_of(CART) < rail.points[1, 0]


def hinge_of(plant):
    return bodies(plant)[-1].points[0, 0]


def seen(points, scale):
    """From 24 degrees above and 125 degrees about the vertical: two turns of space, and depth left out."""
    up_, about = math.radians(24), math.radians(125)
    turn = np.array([[math.cos(about), math.sin(about), 0], [-math.sin(about), math.cos(about), 0], [0, 0, 1]])
    tilt = np.array([[1, 0, 0], [0, math.cos(up_), -math.sin(up_)], [0, math.sin(up_), math.cos(up_)]])
    x, _, z = tilt @ turn @ np.atleast_2d(points).T
    return np.column_stack([x, -z]) * scale


def test_an_arm_is_drawn_in_space_with_its_pendulum_at_right_angles_to_it():
    """Fig. 3a: seen along the arm from its end, the pendulum swings as psi turns it; all by a typed geometry."""
    r, length = ARM.r, 2 * ARM.l_cg
    circle = next(line for line in drawn(ARM)[1] if line.dashed and len(line.points) == 25)
    width, height = np.ptp(circle.points, axis=0)
    assert height / width == pytest.approx(math.sin(math.radians(24)), rel=0.02)  # of 24 corners
    scale = 1.0

    def arm(psi):
        return np.array([[0, 0, 0], [r * math.cos(psi), r * math.sin(psi), 0]])

    def rod(psi, theta):
        end = arm(psi)[1]
        across = np.array([math.sin(psi), -math.cos(psi), 0])
        return np.array([end, end + length * (math.sin(theta) * across - math.cos(theta) * np.array([0, 0, 1]))])

    first, second = bodies(ARM)
    scale = np.linalg.norm(first.points[1]) / np.linalg.norm(seen(arm(TURN), 1.0)[1])
    close(first.points, seen(arm(TURN), scale), 0.15)
    close(second.points, seen(rod(TURN, SWING), scale), 0.15)
    (pale,) = [line for line in drawn(ARM)[1] if line.pale]
    close(pale.points, seen(rod(TURN, math.pi), scale), 0.15)
    turned, swung = arrows(ARM)
    psi, theta = np.linspace(0, TURN, 24), np.linspace(0, SWING, 24)
    close(turned[0], np.vstack([0.66 * seen(arm(a)[1], scale) for a in psi])[:-2], 0.15)
    close(turned[1][0], 0.66 * seen(arm(TURN)[1], scale)[0], 0.15)
    ends = [rod(TURN, a) for a in theta]
    close(swung[0], np.vstack([seen(p[0] + 0.66 * (p[1] - p[0]), scale) for p in ends])[:-2], 0.15)
    assert {"ψ", "ψ = 0", "θ = 0, hanging", "θ = π, upright", "g"} <= drawn(ARM)[3].keys()
    every = np.vstack([line.points for line in drawn(ARM)[1]])
    assert np.ptp(every, axis=0).max() >= 249


def test_disks_on_a_shaft_turn_the_same_way_and_nothing_pulls_them_down():
    """The arrow of each goes with its spoke, from its zero; such a rig has no gravity and no upright."""
    said = drawn(SHAFT)[3]
    assert {"θ1", "θ2", "θ1 = 0", "θ2 = 0"} <= said.keys()
    assert "g" not in said
    assert not any(line.pale for line in drawn(SHAFT)[1])
    (one, head_1), (two, head_2) = arrows(SHAFT)
    close(one - one[0], two - two[0], 0.15)
    close(head_1[0] - one[0], head_2[0] - two[0], 0.15)
    assert two[0, 1] < one[0, 1]  # the second disk is above the first
    assert [line.width for line in bodies(SHAFT)] == [7, 7]


@pytest.mark.parametrize("plant", [ROD, CART, ARM, SHAFT])
def test_every_arrow_has_a_head_along_its_way_and_all_is_within_the_picture(plant):
    text, lines, heads, _ = drawn(plant)
    for shaft, head in arrows(plant):
        tip, *corners = head
        foot = np.mean(corners, axis=0)
        assert np.linalg.norm(tip - foot) == pytest.approx(11, abs=0.15)
        assert np.linalg.norm(corners[0] - corners[1]) == pytest.approx(10, abs=0.15)
        along = (tip - shaft[-2]) / np.linalg.norm(tip - shaft[-2])
        assert (tip - foot) @ along / 11 > 0.99
    assert len(heads) == len(plant.coordinates)
    left, top, width, height = map(float, re.search(r'viewBox="([^"]*)"', text)[1].split())
    assert width >= 329.9
    every = np.vstack([*(line.points for line in lines), *heads])
    assert (every >= [left + 20, top + 20]).all()
    assert (every <= [left + width - 20, top + height - 20]).all()


def test_a_plant_of_which_no_lines_are_known_has_no_drawing():
    assert rig_drawing(Bumpers(m=1.0, J=1e-3, k=500.0, gap=0.1)) is None
    picture = rig_drawing(CART)
    assert picture.caption == "CartPendulum: arrows point in the positive sense."
    assert picture.description == (
        "CartPendulum with its coordinates. x: position of the cart; theta: angle of the pendulum, 0 hanging."
    )


def test_a_rig_s_table_has_what_its_numbers_rest_on_but_no_signs_and_zeros():
    entries = {
        "limit": Entry(value=10.0, unit="V", source="--limit"),
        "counts.theta": Entry(value=4096, unit="1/rev", source="known"),
        "sign.theta": Entry(value=-1.0, unit="", source="known"),
        "offset.theta": Entry(value=0.1, unit="rad", source="known"),
    }
    table = rig_table(up.Rig(plant=CART, hardware=Hardware(entries=entries)))
    assert table.rows == (
        ("command limit", "10 V", "--limit"), ("encoder counts of theta", "4096 1/rev", "known"),
    )  # fmt: skip
    assert (table.headings, table.numbers) == (("", "value", "from"), (1,))
