"""Where several plants suit a log's columns, is the one that made it found to explain its accelerations best?"""

import math
import re

import numpy as np
import pytest

from upright.identification import identify
from upright.physics import find
from upright.simulation import simulate

T = np.arange(2000) * 5e-3
U = np.where(T < 0.5, 0.0, np.sin(2 * T) + 0.6 * np.sin(5.3 * T))
STEP = 2 * math.pi / 4096
LINKS = {
    "m_1": 0.35, "m_2": 0.2, "l_1": 0.2, "l_c1": 0.11, "l_c2": 0.13, "J_1": 1e-3, "J_2": 8e-4, "b_1": 5e-3, "b_2": 2e-3,
    "b_1c": 3e-3, "b_2c": 2e-3,
}  # fmt: skip
DISKS = {"J_1": 2e-3, "J_2": 2e-3, "k_12": 2.0, "k_1": 0.5, "c_1": 5e-3, "c_2": 3e-3}
ROTARY = {"m_p": 0.1, "l_cg": 0.15, "r": 0.15, "J_p": 2e-4, "J_d": 1e-3, "b_1": 5e-3, "b_2": 2e-4}
ROD = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2": 2e-3}


def log(plant, numbers, start, torque=0.0, names=("q1", "q2")):
    """Columns of a simulated rig, angles in steps of 4096 per turn; the command is logged where it acts."""
    u = torque * U if torque else None
    x = simulate(find(plant)(**numbers), {}, start, u, 5e-3, samples=T.size, substeps=4)[:, ::2, 0]
    y = np.round(x / STEP) * STEP
    return {"t": T, **dict(zip(names, y.T, strict=False)), **({"u": U} if torque else {})}


def shares(text):
    """Percent of the accelerations by plant, as the draft says them, and the sentence."""
    (said,) = [line for line in text.splitlines() if "of the accelerations" in line]
    first = re.search(r"Taken for (\S+?)(?: by its columns)?\. It explains (\d+) % of the accelerations", said)
    others = re.findall(r"([a-z-]+\d?) (\d+) %", said.partition(", ")[2])
    return {first[1]: int(first[2]), **{name: int(percent) for name, percent in others}}, said


@pytest.mark.parametrize(
    ("plant", "columns"),
    [
        ("double-pendulum", log("double-pendulum", LINKS, [0.0] * 4, 0.3)),
        ("double-pendulum", log("double-pendulum", LINKS, [0.0] * 4, 0.1, ("theta_1", "theta_2"))),
        ("double-pendulum-absolute", log("double-pendulum-absolute", LINKS, [1.4, 0.0, 0.6, 0.0])),
        ("torsional-2", log("torsional-2", DISKS, [0.0] * 4, 0.3)),
        ("furuta", log("furuta", ROTARY, [0.0] * 4, 0.1)),
        ("furuta", log("furuta", ROTARY, [0.0, 0.0, 1.0, 0.0])),
    ],
    ids=["pendubot", "pendubot taken for disks", "double pendulum", "disks", "driven arm", "free arm"],
)  # fmt: skip
@pytest.mark.slow
def test_the_plant_that_made_a_log_explains_it_best_and_is_drafted(drafted, plant, columns):
    text, study = drafted(**columns)
    told, said = shares(text)
    assert max(told, key=told.get) == plant
    assert study.plant == plant
    assert said.endswith("choose with --plant.")


def test_a_sensor_that_counts_the_other_way_hides_no_plant(drafted):
    columns = log("double-pendulum", LINKS, [0.0] * 4, 0.2)
    text, _ = drafted(**{**columns, "q2": -columns["q2"]})
    told, _ = shares(text)
    assert max(told, key=told.get) == "double-pendulum"


def test_two_plants_that_explain_a_log_alike_are_both_told(drafted):
    # a swing of 0.2 rad is as sinusoidal as that of a disk on a spring: sin(0.2) is 0.2 to 0.7 %
    text, study = drafted(**log("pendulum", ROD, [0.2, 0.0], names=("theta",)))
    told, said = shares(text)
    assert study.plant == "pendulum"
    assert min(told["pendulum"], told["torsional-1"]) > 90
    assert "choose with --plant" in said


def test_the_plant_that_was_named_is_identified_as_it_is_drafted(drafted):
    # mass and inertias are taken as 1 kg and zero, so lengths are others; poles stay, here known to half a percent
    _, study = drafted("double-pendulum", **log("double-pendulum", LINKS, [0.0] * 4, 0.1, ("theta_1", "theta_2")))
    fit = identify(study.model, study.runs)
    assert min(fit.runs["log"].fit_percent.values()) > 99
    truth = find("double-pendulum")(**{**LINKS, "b_1c": 0.0, "b_2c": 0.0}).linear("inverted")
    fastest = max(np.linalg.eigvals(truth.A).real)
    assert max(p.real.value for p in fit.poles["inverted"]) == pytest.approx(fastest, rel=0.01)
