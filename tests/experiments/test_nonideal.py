"""Are the flaws of non-ideal twins those that are told, and the rest of the rig as it was?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.experiments.nonideal import nonideal
from upright.physics.equations import mass_and_force
from upright.rig.makes import PENDULUMS, make_of, make_rig
from upright.simulation import simulate


def force_at_rest(plant, q):
    """Generalized forces (coordinates,) without motion and command."""
    names = plant.derived().coordinates
    still = {n: 0.0 for c in names for n in (c, f"{c}_dot")} | {i.name: 0.0 for i in plant.inputs}
    return mass_and_force(plant.derived(), {**plant.parameters(), **still, **dict(zip(names, q, strict=True))})[1]


@pytest.mark.parametrize("key", PENDULUMS)
def test_a_nonideal_rig_has_the_same_numbers_and_flaws_within_the_sizes_told(key):
    sound = make_rig(key, 5)
    for seed in range(1, 30):
        rig = nonideal(sound, seed)
        plant = rig.plant
        assert make_of(plant).key == key
        same = [n for n in sound.plant.names() if not n.startswith(("tilt", "b_1s", "b_2s", "v_"))]
        assert [getattr(plant, n) for n in same] == [getattr(sound.plant, n) for n in same]
        assert 1.1 <= plant.b_1s / plant.b_1c <= 1.5
        assert 0 <= rig.delay - sound.delay <= 2e-3
        assert all(
            0 <= p <= {"rad": 1e-3, "m": 5e-5}[c.unit]
            for p, c in zip(rig.mounting.play, plant.coordinates, strict=True)
        )
        np.testing.assert_array_equal(plant.linear("inverted").A, sound.plant.linear("inverted").A)


def test_the_torque_of_a_nonideal_furuta_ripples_with_its_angle():
    plant = nonideal(make_rig("furuta", 5), 2).plant.replace(tilt_x=0.0, tilt_y=0.0)
    for psi in (-0.4, 0.0, 1.3):
        f = force_at_rest(plant, (psi, 0.0))
        assert f[0] == pytest.approx(plant.T_r * math.sin(plant.n_r * psi + plant.phi_r), abs=1e-12)
        assert f[1] == pytest.approx(0.0, abs=1e-12)


def test_a_nonideal_cart_without_friction_rolls_down_its_slope():
    """The centre of mass of cart and hanging pendulum gains g times the slope, whatever swings below."""
    plant = nonideal(make_rig("linear", 5), 2).plant
    bare = plant.replace(F_r=0.0, **dict.fromkeys(("b_1", "b_2", "b_1c", "b_2c", "b_1s", "b_2s"), 0.0))
    x, _, theta, _ = simulate(bare, {}, np.zeros(4), None, 1e-3, samples=2001)[-1, :, 0]
    centre = x + bare.m_p * bare.l_cg * math.sin(theta) / (bare.m_c + bare.m_p)
    assert centre == pytest.approx(9.81 * plant.slope * 2.0**2 / 2, rel=1e-6)
    rippling = force_at_rest(plant.replace(slope=0.0), (0.01, 0.0))
    assert rippling[0] == pytest.approx(plant.F_r * math.sin(plant.n_r * 0.01 + plant.phi_r), abs=1e-12)


def spreads(values, low, high):
    """Whether sixty of them lie between two ends and come within a tenth of both; one even set in 300 does not."""
    values = np.array(values)
    assert values.min() >= low
    assert values.max() <= high
    return values.min() < low + 0.1 * (high - low) and values.max() > high - 0.1 * (high - low)


@pytest.mark.parametrize("key", PENDULUMS)
def test_every_flaw_is_drawn_evenly_up_to_the_size_told(key):
    """Of sixty rigs: play, eccentricity, lateness, excess, ripples of 6 to 23 to a turn, a lean of 0.3 degrees."""
    sound = make_rig(key, 5)
    rigs = [nonideal(sound, seed) for seed in range(60)]
    units = [c.unit for c in sound.plant.coordinates]
    turn = {"rad": 2 * math.pi, "m": 0.0706}  # of an ECP 210's shaft
    for i, unit in enumerate(units):
        assert spreads([r.mounting.play[i] for r in rigs], 0.0, {"rad": 1e-3, "m": 5e-5}[unit])
        off = math.radians(0.1) * turn[unit] / (2 * math.pi)
        assert spreads([r.mounting.off_centre[i] for r in rigs], 0.0, off)
        assert spreads([r.mounting.phase[i] for r in rigs], 0.0, 2 * math.pi)
        assert {r.mounting.turn[i] for r in rigs} == {turn[unit]}
    assert spreads([r.delay - sound.delay for r in rigs], 0.0, 2e-3)
    plants = [r.plant for r in rigs]
    for s, c in (("b_1s", "b_1c"), ("b_2s", "b_2c")):
        assert spreads([getattr(p, s) / getattr(p, c) for p in plants], 1.1, 1.5)
    assert {(p.v_1s, p.v_2s) for p in plants} == {(0.25 if units[0] == "rad" else 0.025, 0.25)}
    assert spreads([getattr(p, "T_r" if key == "furuta" else "F_r") / p.b_1c for p in plants], 0.0, 0.2)
    ripples = np.array([p.n_r for p in plants]) * turn[units[0]] / (2 * math.pi)
    np.testing.assert_allclose(ripples, np.round(ripples), atol=1e-9)
    assert spreads(ripples, 6, 23)
    assert spreads([p.phi_r for p in plants], 0.0, 2 * math.pi)
    lean = math.sin(math.radians(0.3))
    if key == "furuta":
        assert spreads([math.hypot(p.tilt_x, p.tilt_y) for p in plants], 0.0, lean)
        assert min(p.tilt_x for p in plants) < -0.5 * lean < 0.5 * lean < max(p.tilt_x for p in plants)
        assert min(p.tilt_y for p in plants) < -0.5 * lean < 0.5 * lean < max(p.tilt_y for p in plants)
    else:
        assert spreads([p.slope for p in plants], -lean, lean)


def test_a_shaft_without_a_pendulum_sticks_and_plays_and_does_not_lean():
    for key in ("torsional", "rectilinear"):
        rig = nonideal(make_rig(key, 5), 3)
        assert type(rig.plant) is type(make_rig(key).plant)
        assert rig.plant.f_1s / rig.plant.f_1c == pytest.approx(rig.plant.f_2s / rig.plant.f_2c)
        assert 1.1 <= rig.plant.f_1s / rig.plant.f_1c <= 1.5
