"""Does a draft say what no laboratory has, ask for a spring that a log shows, and name the plants that look alike?"""

import numpy as np
import pytest

from upright.physics import Pendulum, find
from upright.simulation import simulate
from upright.study.draft.plausible import implausible

METRE = 226629.0


def pendulum(t: np.ndarray) -> np.ndarray:
    dt = float(t[1] - t[0])
    rod = Pendulum(m_p=0.2, l_cg=0.3, J_p=2e-3, b_2=2e-3)
    return simulate(rod, {}, [0.6, 0.0], None, dt, samples=t.size, substeps=2)[:, 0, 0]


@pytest.mark.parametrize(("clock", "said"), [(1.0, False), (30.0, True), (1e-3, True)])
def test_a_length_that_no_laboratory_has_is_said(drafted, clock, said):
    # a clock that runs 30 times as fast makes a pendulum of 0.33 m one of 300 m
    t = np.arange(2000) * 0.01
    text, _ = drafted(t=t * clock, theta=pendulum(t))
    assert ("No laboratory rig has l_cg" in text) == said
    assert ("clock" in text) == said


@pytest.mark.parametrize(
    ("name", "few", "some", "many"),
    [
        ("m_1", 1e-6, 0.5, 1e3),  # a grain of sand, a cart, a car
        ("k_1", 1e-3, 400.0, 1e7),  # a hair, a coil spring, the suspension of a lorry
    ],
)
def test_a_mass_and_a_spring_that_stand_on_a_bench_are_told_from_others_and_zero_is_none(name, few, some, many):
    cart = find("rectilinear-1")
    assert implausible(cart, {name: some}, scaled_by="") == []
    assert implausible(cart, {name: 0.0}, scaled_by="") == []
    for odd in (few, many, -many):
        (sentence,) = implausible(cart, {name: odd}, scaled_by="the assumed 1 N per volt")
        assert sentence.startswith(f"No laboratory rig has {name} = ")
        assert "the clock, or the assumed 1 N per volt is likely" in sentence
    (alone,) = implausible(cart, {name: many}, scaled_by="")
    assert "the clock is likely" in alone


@pytest.mark.parametrize(
    ("name", "few", "some", "many"),
    [
        ("J_1", 1e-10, 2e-3, 100.0),  # a watch's balance wheel, a brass disk, a car's wheel set
        ("k_1", 1e-7, 2.0, 1e6),  # a watch's hairspring, a steel rod, a ship's shaft
    ],
)
def test_an_inertia_and_a_torsion_spring_that_stand_on_a_bench_are_told_from_others(name, few, some, many):
    disk = find("torsional-1")
    assert implausible(disk, {name: some}, scaled_by="") == []
    assert all(len(implausible(disk, {name: odd}, scaled_by="")) == 1 for odd in (few, many))


def carts(k_2: float, gain: float = 5.0):
    """Counts of two carts under a constant force, and its volts."""
    t = np.arange(4000) * 2e-3
    volts = np.where(t > 0.5, 0.5, 0.0)
    rig = find("rectilinear-2")(m_1=0.8, m_2=0.7, k_1=200.0, k_12=200.0, k_2=k_2, c_1=4.0, c_2=2.0)
    y = simulate(rig, {}, [0.0] * 4, gain * volts, 2e-3, samples=t.size, substeps=2)[:, ::2, 0]
    one, two = np.round(METRE * y).T
    return {"t": t, "volts": volts, "enc1": one, "enc2": two}


def test_a_spring_to_ground_that_the_log_shows_is_asked_for(drafted):
    # statics: x_2/x_1 = k_12/(k_12 + k_2), here 0.88
    log = carts(k_2=200 * (1 / 0.88 - 1))
    text, study = drafted(**log)
    assert "k_2" in study.model.estimated
    given = study.model.parameters
    assert given["k_2"].value / given["k_12"].value == pytest.approx(1 / 0.88 - 1, rel=0.02)
    assert "rests at 0.88 of its neighbour's place" in text


def test_no_spring_to_ground_is_asked_for_where_both_carts_go_equally_far(drafted):
    text, study = drafted(**carts(k_2=0.0))
    assert "k_2" not in study.model.estimated
    assert "spring to ground is estimated" not in text


def test_a_cart_of_forty_kilograms_is_said_with_the_gain_that_makes_it_one(drafted):
    placeholder = 10_000 / 226_629  # counts per metre that a draft begins with, and those of the log
    text, _ = drafted(**carts(k_2=0.0, gain=0.8 / 60 * placeholder))
    assert "No laboratory rig has m_1" in text
    assert "assumed 1 N" in text
    sound, _ = drafted(**carts(k_2=0.0))
    assert "No laboratory rig" not in sound


@pytest.mark.parametrize(
    ("columns", "plants"),
    [
        (("theta",), ("pendulum", "torsional-1")),
        (("psi", "theta"), ("furuta", "double-pendulum", "torsional-2")),
        (("enc1",), ("rectilinear-1", "torsional-1", "pendulum")),
    ],
)
def test_plants_that_look_alike_are_named(drafted, columns, plants):
    t = np.arange(2000) * 0.01
    theta = pendulum(t)
    scale = 4000 if columns[0] == "enc1" else 1.0
    log = {name: np.round(scale * theta * (1 + 0.3 * k), 5 if scale == 1 else 0) for k, name in enumerate(columns)}
    text, study = drafted(t=t, **log)
    assert study.plant == plants[0]
    guessed = " ".join(line for line in text.splitlines() if line.startswith("# GUESSED"))
    assert all(name in guessed for name in plants)
