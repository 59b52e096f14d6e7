"""A dead zone of the drive, identified from the same log as the rest."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identification.twins import FURUTA, noisy, rig
from upright.identification import Run, identify
from upright.identification.checks.structure import proposed
from upright.physics import Furuta
from upright.simulation import simulate

GAIN, COUNT = 0.65, 2 * np.pi / 16_000
TRUE = {**FURUTA, "actuator.gain": GAIN}
GUESSES = {"J_d": 0.012, "b_1": 8e-3, "b_1c": 2e-3, "actuator.gain": 0.5}


def driven(dead_zone: float, *, seconds: float = 6.0, dt: float = 2e-3) -> Run:
    """A hanging Furuta pendulum whose arm is shaken through a dead zone, without noise."""
    n = round(seconds / dt) + 1
    t = np.arange(n) * dt
    u = (0.25 * np.sin(2 * np.pi * 0.7 * t) + 0.2 * np.sin(2 * np.pi * 1.9 * t))[:, None]
    drive = {"actuator.gain": GAIN, "actuator.dead_zone": dead_zone}
    x = simulate(Furuta(**FURUTA), drive, [0.0, 0.0, 0.0, 0.0], u, dt, samples=n, substeps=2)
    return Run(label="driven", role="fit", measured=("psi", "theta"), u=u, t=t, y=x[:, [0, 2], 0])


def model(**more: float):
    return rig(Furuta, {n: v for n, v in TRUE.items() if n not in GUESSES}, {**GUESSES, **more})


@pytest.mark.parametrize("counts", [0.3, 3.0, 30.0])
def test_a_dead_zone_is_recovered_beside_gain_and_dry_friction(counts):
    fit = identify(model(**{"actuator.dead_zone": 0.02}), [noisy(driven(0.08), counts * COUNT, seed=1)])
    for name, true in {"actuator.dead_zone": 0.08, **{n: TRUE[n] for n in GUESSES}}.items():
        low, high = fit.estimates[name].interval
        assert low <= true <= high, name
    assert fit.estimates["actuator.dead_zone"].value == pytest.approx(0.08, abs=2e-4 * counts)


@pytest.mark.slow
def test_a_dead_zone_scatters_over_seeds_within_its_standard_error():
    clean, runs = driven(0.08), 24
    fits = [identify(model(**{"actuator.dead_zone": 0.05}), [noisy(clean, 5 * COUNT, seed=k)]) for k in range(runs)]
    each = [fit.estimates["actuator.dead_zone"] for fit in fits]
    scatter, stderr = np.std([e.value for e in each], ddof=1), np.mean([e.stderr for e in each])
    # chi-squared of 23 degrees of freedom, 99 %: at most 1.39 of the truth; a fit with dry friction is careful by
    # up to three times, for all its numbers alike
    assert scatter < 1.39 * stderr < 1.39 * 3 * scatter


def test_of_a_drive_without_a_dead_zone_the_interval_holds_zero():
    fit = identify(model(**{"actuator.dead_zone": 0.05}), [noisy(driven(0.0), 3 * COUNT, seed=2)])
    estimate = fit.estimates["actuator.dead_zone"]
    assert estimate.interval[0] <= 0.0
    assert estimate.value < 2e-3
    assert estimate.status != "well determined"


def test_what_a_model_without_a_dead_zone_leaves_out_is_named():
    proposal = proposed(model(), [noisy(driven(0.15), 3 * COUNT, seed=3)], worst=70.0)
    assert proposal is not None
    assert set(proposal.values) == {"actuator.dead_zone"}
    assert proposal.values["actuator.dead_zone"] == pytest.approx(0.15, rel=0.02)
