"""Do chances and refits say the same to the last bit, whoever computes them; and how is a wrong wish answered?"""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.identification.ladder.test_crossval import QUESTION, RUNS
from upright import gains as design
from upright.cli import app
from upright.control.score import outcomes
from upright.gains.requests import read_poles
from upright.identification.ladder.cross_validation import leave_one_out
from upright.paper.reproduce import TABLE_1
from upright.rig.makes import make_rig
from upright.workers import Workers


@pytest.mark.slow
def test_runs_of_other_rigs_come_to_the_same():
    rig, rng = make_rig("furuta"), np.random.default_rng(3)
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    law = design.feedback(design.filtered(sampled, 0.5), design.place(model.A, model.B, read_poles(TABLE_1[2])).K)
    starts = rng.normal(size=(200, 4)) * [0, 0, 0.5, 2.0]
    others = {"J_p": rig.plant.J_p * np.exp(rng.normal(0, 0.05, 200))}
    one, two, three = (
        outcomes(rig, law, at="inverted", starts=starts, seconds=2.0, parameters=others, workers=Workers(number=n))
        for n in (1, 2, 3)
    )
    assert 0 < np.mean(one.held) < 1
    for other in (two, three):
        assert all(np.array_equal(value, getattr(other, name)) for name, value in vars(one).items())


@pytest.mark.slow
def test_runs_left_out_are_predicted_the_same():
    start = {"J_p": 2.2e-3, "b_2": 1.8e-3}
    one, two = (leave_one_out(QUESTION, RUNS, start, workers=Workers(number=n)).all() for n in (1, 2))
    for a, b in zip(one, two, strict=True):
        assert (a.label, a.values, a.blind) == (b.label, b.values, b.blind)
        assert np.array_equal(a.score.simulated, b.score.simulated)


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("regulate --rig furuta --workers 0", "from 1 to 1024, got 0"),
        ("regulate --rig furuta --workers nearby", "tcp://host:8786"),
        ("regulate --rig furuta --workers 2.5", "tcp://host:8786"),
        ("lab --workers -3", "from 1 to 1024, got -3"),
    ],
)
def test_workers_that_cannot_be_are_answered_in_one_sentence(tmp_path, monkeypatch, typed, said):
    monkeypatch.chdir(tmp_path)
    answer = CliRunner().invoke(app, typed.split())
    assert answer.exit_code == 2
    assert said in answer.stderr
    assert answer.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())
