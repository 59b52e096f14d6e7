"""How far ahead an unstable plant is predicted at best follows from its pole and its sensors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.problem.test_predictor import LEVELS, QUANTUM, balanced, posed
from tests.identification.twins import rig
from upright.identification import Run
from upright.identification.inference.ceiling import ENOUGH, ceilings, judged
from upright.identification.inference.scoring import score_run
from upright.identification.problem.residuals import Problem, formulate
from upright.physics import Pendulum

AHEAD = (25, 50, 100)
STILL = dict.fromkeys(LEVELS, 0.0)
PENDULUM = {"m_p": 0.1, "l_cg": 0.2, "J_p": 0.0, "g": 9.81}
POLE = math.sqrt(9.81 / 0.2)


def upright_pendulum(resolution: float, *, spread: float = 0.1, dt: float = 0.01) -> Problem:
    """A frictionless pendulum near upright that no random force moves; its record has the standard deviation `spread`.

    What the readings are does not matter for how well a state can be known from them.
    """
    t = np.arange(1001) * dt
    y = np.pi + spread * math.sqrt(2) * np.sin(2 * np.pi * t)[:, None]
    run = Run(
        label="balanced", role="fit", t=t, u=np.zeros((t.size, 1)), y=y, measured=("theta",), resolution=(resolution,),
        horizon=(0.1, 0.8), restart="kalman", unknown=(),
    )  # fmt: skip
    known = rig(Pendulum, {**PENDULUM, "noise.theta": 0.0, "noise.T": 0.0}, {})
    return formulate(known, [run])


def missed(resolution: float, ahead: float, dt: float = 0.01) -> float:
    """Root mean square of what is missed `ahead` seconds later, in closed form.

    Without a random force the filter forgets the mode that decays; of the one that grows by exp(a dt) it keeps, from
    readings of variance R, R (1 - exp(-2 a dt)), the scalar Riccati equation's solution.
    """
    R = resolution**2 / 12
    return math.sqrt(R + R * (1 - math.exp(-2 * POLE * dt)) * math.exp(2 * POLE * ahead))


@pytest.mark.parametrize("resolution", [1e-4, 1e-3, 5e-3])
def test_the_start_state_of_one_unstable_mode_limits_a_prediction_as_its_riccati_equation_says(
    resolution: float,
) -> None:
    problem = upright_pendulum(resolution)
    found = ceilings(problem, 0, problem.start, [1, 10, 40])[:, 0]
    spread = float(np.std(problem.tracks[0].y[problem.tracks[0].restarts[0] :]))
    expected = [100 * (1 - missed(resolution, h) / spread) for h in (0.01, 0.1, 0.4)]
    # the filter has followed the record for 3.2 s, so the mode that decays is forgotten to exp(-7 * 3.2)
    np.testing.assert_allclose(100 - found, 100 - np.array(expected), rtol=1e-3)


def test_a_fit_is_judged_where_the_start_state_still_allows_ninety_percent() -> None:
    for resolution in (2e-3, 5e-3, 2e-2):
        problem = upright_pendulum(resolution)
        found = judged(problem, problem.start)
        assert found is not None
        spread = float(np.std(problem.tracks[0].y[problem.tracks[0].restarts[0] :]))
        most = (1 - ENOUGH / 100) * spread
        assert missed(resolution, found.seconds) <= most * (1 + 1e-3)
        assert missed(resolution, found.seconds + 0.01) > most * (1 - 1e-3)
        assert found.growth == pytest.approx(POLE, rel=1e-6)


def test_an_encoder_that_is_finer_by_e_lets_a_fit_be_judged_by_one_time_constant_further() -> None:
    near, far = (judged(p, p.start) for p in (upright_pendulum(1e-2), upright_pendulum(1e-2 / math.e)))
    assert near is not None
    assert far is not None
    assert far.seconds - near.seconds == pytest.approx(1 / POLE, abs=0.011)  # horizons are whole samples of 10 ms


def test_no_horizon_longer_than_the_one_asked_decides() -> None:
    problem = upright_pendulum(1e-7)
    found = judged(problem, problem.start)
    assert found is not None
    assert found.seconds == pytest.approx(0.8)


def test_where_the_record_hardly_moves_a_single_sample_is_left() -> None:
    problem = upright_pendulum(1e-2, spread=0.01)
    found = judged(problem, problem.start)
    assert found is not None
    assert found.seconds == pytest.approx(0.01)
    assert ceilings(problem, 0, problem.start, [1])[0, 0] < ENOUGH


@pytest.mark.slow
def test_the_true_model_misses_by_what_its_start_state_is_unknown() -> None:
    """A Furuta pendulum balanced by its loop, moved by no force that is not logged, readings with white noise."""
    sigma = QUANTUM / math.sqrt(12)
    squares: list[list[np.ndarray]] = []
    expected: list[list[np.ndarray]] = []
    for seed in range(6):
        clean = balanced(seed, push=0.0, friction=0.0, exact=True)
        noise = np.random.default_rng(100 + seed).normal(scale=sigma, size=clean.y.shape)
        problem = posed(replace(clean, y=clean.y + noise), STILL, b_1c=0.0)
        track, x = problem.tracks[0], problem.start
        scores = [score_run(problem, 0, x, ahead * track.dt) for ahead in AHEAD]
        squares.append([np.mean((s.y - s.simulated) ** 2, axis=0) for s in scores])
        spread = np.std(track.y[track.restarts[0] :], axis=0)
        expected.append([*(((1 - ceilings(problem, 0, x, AHEAD) / 100) * spread) ** 2)])
    # errors of the state are alike over a time constant of the filter, 70 ms: 6 * 7 s / 0.14 s = 300 of them, 4 % each
    np.testing.assert_allclose(np.sqrt(np.mean(squares, axis=0) / np.mean(expected, axis=0)), 1.0, atol=0.12)
