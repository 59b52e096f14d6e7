"""A shaft stepped through the protocol: from wherever it stands, with the push that follows, as a simulated rig is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.experiments.stand.live import live_stand, pushed, run_of
from upright.experiments.tracking_3.laws import AT, paper_sets
from upright.experiments.tracking_3.run import asked_of, attempt, figured
from upright.files import write_json
from upright.laws import as_values
from upright.rig.makes import make_rig
from upright.rigs.supervisor import _free_with
from upright.running.run import RunRequest, run_rig


@pytest.mark.parametrize(
    ("make", "at", "along"),
    [("torsional", "rest", [1.0, 1.0]), ("furuta", "inverted", [1.0, 0.0]), ("linear", "hanging", [1.0, 0.0])],
)
def test_what_nothing_pulls_back_goes_along(make, at, along):
    """A free shaft turns as a whole; an arm or a cart goes alone, its pendulum stays where gravity has it."""
    assert _free_with(make_rig(make), at, 0) == pytest.approx(along, abs=1e-12)


def test_what_a_spring_pulls_back_is_held_where_the_spring_has_it():
    assert _free_with(make_rig("torsional").changed(k_1=1.0), "rest", 0) == [0.0, 0.0]


def test_a_step_and_the_push_after_it_come_as_simulated(tmp_path):
    rig = make_rig("torsional")
    law = paper_sets(rig, (1,))[0]
    size = 0.9 * rig.limit / abs(law.k_pf)
    simulated = attempt(rig, law, size)
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "torsional"\n', encoding="utf-8")
    reference, pushes = asked_of(rig, size)
    path = write_json(tmp_path / "law.json", as_values(pushed(law.law, reference, pushes)))
    seconds = reference.size * rig.period
    done = run_rig(RunRequest(rig=tmp_path / "RIG.toml", law=path, seconds=seconds, check=False), tmp_path)
    went = run_of(done, AT).trial
    n = simulated.trial.u.size
    np.testing.assert_allclose(
        went.record.t[:n], simulated.trial.record.t, atol=1e-12
    )  # rounding of a clock that ran on
    found = figured(went, size)
    np.testing.assert_allclose(done.log.columns["u_applied"][:n], simulated.trial.u, atol=1.01 * rig.converter)
    assert found.give == pytest.approx(simulated.give, rel=1e-9)
    assert found.figures.arrival == pytest.approx(simulated.figures.arrival, rel=1e-9)
    assert math.isinf(found.tripped)
    assert live_stand(tmp_path / "RIG.toml").resting == "rest"
