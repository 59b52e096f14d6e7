"""Does a moving drawing show the rig where its record says that it was?"""

from __future__ import annotations

import math

import numpy as np
import pytest

import upright as up
from upright.views import animate

T = np.linspace(2.0, 4.0, 21)


def recorded(**columns):
    units = {n: "m" if n.startswith("x") else "rad" for n in columns}
    signals = {n: np.broadcast_to(np.asarray(v, dtype=float), T.shape).copy() for n, v in columns.items()}
    return up.Record(t=T, signals=signals, units=units)


def shown(record, i=0, **how):
    """Lines of the i-th picture, and the picture's axes."""
    played = animate(record, **({"plant": None, "speed": 1.0, "frames": 10} | how))
    *lines, clock = played._func(i)
    played._draw_was_started = True  # nobody plays it
    return [np.array(line.get_data()) for line in lines], clock.get_text(), played._fig.axes[0], played


def test_a_pendulum_hangs_from_its_support_by_its_angle():
    """At theta = 0 straight down, at pi/2 to the right."""
    record = recorded(theta=np.linspace(0.0, math.pi / 2, 21))
    lines, clock, axes, played = shown(record)
    np.testing.assert_allclose(lines, [[[0, 0], [0, -1]]], atol=1e-12)
    assert clock == "2.00 s"
    assert axes.get_ylim() == (-1.3, 1.3)
    assert axes.get_xlim() == pytest.approx((-1.15, 1.15))
    assert len(list(played.new_frame_seq())) == 20  # 2 s, ten a second
    lines, clock, *_ = shown(record, 10)
    np.testing.assert_allclose(lines, [[[0, math.sin(math.pi / 4)], [0, -math.cos(math.pi / 4)]]], atol=1e-12)
    assert clock == "3.00 s"


def test_twice_as_fast_it_has_half_as_many_pictures_and_each_lasts_as_long():
    *_, played = shown(recorded(theta=0.1), speed=2.0)
    assert len(list(played.new_frame_seq())) == 10
    assert played._interval == 100.0
    _, clock, *_ = shown(recorded(theta=0.1), 5, speed=2.0)
    assert clock == "3.00 s"


def test_a_cart_carries_its_pendulum_along():
    (cart, rod), _, axes, _ = shown(recorded(x=0.5, theta=math.pi / 6))
    np.testing.assert_allclose(cart, [[0.35, 0.65], [0, 0]], atol=1e-12)
    np.testing.assert_allclose(rod, [[0.5, 1.0], [0, -math.cos(math.pi / 6)]], atol=1e-12)
    assert axes.get_xlim() == pytest.approx((-1.15, 1.15))


def test_an_arm_is_seen_from_the_side_as_it_goes_round():
    (arm, rod), *_ = shown(recorded(psi=math.pi / 6, theta=math.pi))
    np.testing.assert_allclose(arm, [[0, 0.5], [0, 0]], atol=1e-12)
    np.testing.assert_allclose(rod, [[0.5, 0.5], [0, 1]], atol=1e-12)


def test_carts_stand_side_by_side_three_of_their_largest_motions_apart():
    record = recorded(x_1=0.1, x_2=-0.2)
    lines, *_ = shown(record)
    np.testing.assert_allclose(lines, [[[0.1, 0.9], [0, 0]], [[1.6, 2.4], [0, 0]]], atol=1e-12)
    still, *_ = shown(recorded(x_1=0.0, x_2=0.0))
    np.testing.assert_allclose([line[0] for line in still], [[-0.4, 0.4], [2.6, 3.4]], atol=1e-12)


def test_disks_turn_like_hands_of_a_clock():
    lines, *_ = shown(recorded(theta_1=0.0, theta_2=math.pi / 2))
    np.testing.assert_allclose(lines, [[[0, 0], [0, 1]], [[3, 4], [0, 0]]], atol=1e-12)


@pytest.mark.parametrize(
    ("columns", "how", "words"),
    [
        ({"theta": 0.1}, {"speed": 0.0}, "speed and frames above 0, got 0 and 10"),
        ({"theta": 0.1}, {"frames": 0}, "speed and frames above 0, got 1 and 0"),
        ({"x_a": 0.1, "theta_": 0.2}, {}, "the record has x_a, theta_"),
    ],
)
def test_what_cannot_be_drawn_is_refused(columns, how, words):
    with pytest.raises(up.BadInput, match=words):
        shown(recorded(**columns), **how)


def test_angles_in_degrees_are_not_drawn_as_radians():
    for name in ("theta", "psi"):
        record = up.Record(t=T, signals={"theta": T, name: T}, units={"theta": "rad", name: "deg"})
        with pytest.raises(up.BadInput, match=f"'{name}' is in deg; convert it first"):
            shown(record)
    assert shown(up.Record(t=T, signals={"theta": 0 * T}, units={"theta": ""}))[0]
