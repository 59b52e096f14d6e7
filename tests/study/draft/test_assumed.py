"""Does a draft, unedited, pass a placeholder for a fact? What nobody measured is assumed, and the verdict says so."""

from __future__ import annotations

import json
import re
import tomllib

import numpy as np
import pandas as pd
import pytest

import upright as up
from upright.identification.estimate import identify
from upright.identification.inference.verdict.evidence import USABLE
from upright.simulation import simulate

DT = 0.01
TRUTH = {"m_p": 0.2235, "l_cg": 0.2, "J_p": 0.0, "b_2": 1e-3, "b_2c": 8e-4}


def swing(seed: int = 1) -> pd.DataFrame:
    """A point mass on a rod let go at 1 rad, read with 0.5 mrad of noise."""
    t = np.arange(2500) * DT
    theta = simulate(up.Pendulum(**TRUTH), {}, [1.0, 0.0], None, DT, samples=t.size, substeps=2)[:, 0, 0]
    return pd.DataFrame({"t": t, "theta": theta + 5e-4 * np.random.default_rng(seed).normal(size=t.size)})


def usable(fit) -> set[str]:
    (answer,) = (a for a in fit.answers if a.question == USABLE)
    listed = re.search(r"numbers can be used: (.*?)\.(?: |$)", answer.headline)
    return set(listed[1].split(", ")) if listed else set()


def length_of_equal_period(fit):
    """J_A/(m_p l_cg), all that a free swing tells of masses and lengths; of a point mass its distance."""
    (known,) = (e for a in fit.assumptions for n, e in a.ratios.items() if n == "J_A/(m_p l_cg)")
    return known


def test_no_friction_of_an_unedited_draft_of_a_swing_can_be_used(drafted):
    log = swing()
    _, study = drafted(t=log["t"].to_numpy(), theta=log["theta"].to_numpy())
    fit = identify(study.model, study.runs)
    assert fit.estimates["b_2c"].value > 3 * TRUTH["b_2c"]  # per kilogram, as the draft assumes one
    assert not usable(fit)
    assert length_of_equal_period(fit).value == pytest.approx(TRUTH["l_cg"], rel=1e-3)
    assert "Measure m_p" in fit.verdict


def test_what_a_log_alone_gives_is_known_and_the_rest_once_it_is_measured(tmp_path):
    log = swing()
    alone = up.identify(log, up.Pendulum)
    assert not usable(alone.fit)
    low, high = length_of_equal_period(alone.fit).interval
    assert low <= TRUTH["l_cg"] <= high
    assert alone.parameters.loc["b_2c", "status"] == "rests on m_p, J_p"
    kept = json.loads(alone.save(tmp_path / "fit.json").read_text(encoding="utf-8"))
    assert kept["parameters"]["m_p"]["status"] == "assumed"
    assert kept["parameters"]["b_2c"]["rests_on"] == ["m_p", "J_p"]
    measured = up.identify(log, up.Pendulum, known={"m_p": "223.5 g", "J_p": 0.0})
    assert usable(measured.fit) >= {"l_cg", "b_2", "b_2c"}
    for name in ("b_2", "b_2c"):
        low, high = measured.fit.estimates[name].interval
        assert low <= TRUTH[name] <= high


def test_nothing_is_usable_while_the_counts_of_a_turn_are_assumed(drafted):
    """An encoder of 2400 counts that the draft takes for one of 4096: a swing of 1 rad looks like one of 0.6."""
    log = swing()
    counts = np.round(log["theta"].to_numpy() * 2400 / (2 * np.pi))
    text, study = drafted("pendulum", t=log["t"].to_numpy(), theta_counts=counts)
    assert "counts_per_rev = { value = 4096, assumed = true }" in text
    assert study.model.assumed_scales == {"sensors.theta.counts_per_rev": 4096.0}
    fit = identify(study.model, study.runs)
    assert usable(fit) == set()
    assert all("sensors.theta.counts_per_rev" in e.rests_on for e in fit.estimates.values())
    assert "Move it by one full turn" in fit.verdict


T = np.arange(4000) * DT
W = 5.0
ANGLE = np.clip(0.3 - 0.008 * T, 0, None) * np.cos(W * T)
PUSH = np.where((T > 1) & (T < 20), np.sign(np.sin(T)), 0.0)
CART = np.where(T > 1, 0.1 * (1 - np.cos(T - 1)), 0.0)
COUNTS = np.round(4000 * ANGLE)
LOGS = {
    "pendulum": {"theta": ANGLE},
    "double-pendulum": {"theta_1": ANGLE, "theta_2": 0.2 * np.exp(-0.05 * T) * np.cos(1.7 * W * T)},
    "cart-pendulum": {"v": PUSH, "x": CART, "theta": ANGLE},
    "furuta": {"psi": 3 * CART, "theta": ANGLE},
    "torsional-2": {"enc1": COUNTS, "enc2": np.round(3000 * ANGLE)},
    "rectilinear-2": {"effort": PUSH, "enc1": COUNTS, "enc2": np.zeros_like(T)},
}


@pytest.mark.parametrize("plant", LOGS)
def test_a_draft_takes_nothing_for_known(drafted, plant):
    text, _ = drafted(plant, **LOGS[plant])
    study = tomllib.loads(text)
    told = study["parameters"] | {f"actuator.{n}": v for n, v in study.get("actuator", {}).items()}
    said = {n: set(v) if isinstance(v, dict) else {"value"} for n, v in told.items()}
    plain = [n for n, keys in said.items() if not keys & {"guess", "assumed", "uncertainty", "measured"}]
    assert not plain
