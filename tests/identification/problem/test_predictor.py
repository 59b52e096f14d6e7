"""Predictions of a plant that would fall know the past alone, filter as Kalman does, and find the pole."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

from tests.identification.twins import rig
from upright.errors import BadInput
from upright.identification import GreyBox, Run
from upright.identification.estimate import identify
from upright.identification.inference.scoring import predict
from upright.identification.model.grey_box import NOISE
from upright.identification.problem.residuals import Problem, formulate
from upright.identification.problem.simulated import discrete_model, gains, restart_states, with_noise
from upright.laws import state_feedback
from upright.physics import Furuta, Pendulum
from upright.simulation import simulate

VALUES = {
    "m_p": 0.024, "l_cg": 0.0645, "r": 0.085, "J_d": 1.1e-4, "J_p": 3.3e-5, "b_1": 2.5e-4, "b_1c": 3e-4, "g": 9.81,
    "actuator.gain": 5e-3,
}  # fmt: skip
PLANT = {n: v for n, v in VALUES.items() if not n.startswith("actuator")}
QUANTUM = 2 * np.pi / 2048
GUESSES = {"l_cg": 0.07, "J_d": 9e-5, "b_1": 2e-4, "b_1c": 2e-4}


def balanced(
    seed: int, *, seconds: float = 8.0, push: float = 0.01, friction: float = 3e-4, exact: bool = False, **run: Any
) -> Run:
    """A balanced rotary pendulum: encoders count, the voltage is excited, white noise `push` [V s^(1/2)] not logged.

    Logged are counts, unless the readings are to be `exact`.
    """
    dt = 2e-3
    n = round(seconds / dt) + 1
    generator = np.random.default_rng(seed)
    t = np.arange(n) * dt
    known = sum(
        a * np.sin(2 * np.pi * f * t + generator.uniform(0, 6.3)) for a, f in ((0.8, 0.4), (0.8, 1.1), (0.6, 2.7))
    )
    hidden = push / np.sqrt(dt) * generator.normal(size=n)
    law = state_feedback([-6.0, -1.8, -30.0, -2.5], dt, memory=1 / 1.1, target=[0.0, np.pi], resolution=QUANTUM)
    x0 = Furuta(**PLANT).state("inverted")
    plant, drive = Furuta(**{**PLANT, "b_1c": friction}), {"actuator.gain": VALUES["actuator.gain"]}
    command = (known + hidden)[:, None]
    motion = simulate(plant, drive, x0, command, dt, samples=n, substeps=2, loop=law)[:, :, 0]
    y = motion[:, [0, 2]] if exact else np.round(motion[:, [0, 2]] / QUANTUM) * QUANTUM
    fields = {"label": f"seed {seed}", "role": "fit", "horizon": (0.05, 0.2), "restart": "kalman", "unknown": ()} | run
    return Run(
        t=t, u=motion[:, 4:] - hidden[:, None], y=y, measured=("psi", "theta"), resolution=(QUANTUM, QUANTUM), **fields
    )


def true_rig(**changes: float) -> GreyBox:
    return rig(Furuta, VALUES, {}, **changes)


def posed(run: Run, levels: dict[str, float], **changes: float) -> Problem:
    """The problem at the true values, with given levels of noise."""
    known = with_noise(true_rig(**changes), [run])
    parameters = {
        n: replace(p, value=levels.get(n, p.value), estimate=False) if n.startswith(NOISE) else p
        for n, p in known.parameters.items()
    }
    return formulate(replace(known, parameters=parameters), [run])


LEVELS = {"noise.psi": 5e-5, "noise.theta": 4e-6, "noise.T": 0.01}


def test_the_model_of_the_filter_is_the_linear_plant_integrated_over_a_sample() -> None:
    problem = posed(balanced(0, seconds=3.0), LEVELS)
    track = problem.tracks[0]
    plant = Furuta(**{**PLANT, "b_1c": 0.0})
    linear = plant.linear("inverted")
    Phi, Q = discrete_model(problem.solver(0), track, {**problem.base}, 1)
    A = np.zeros((5, 5))
    A[:4, :4], A[:4, 4:] = linear.A, linear.B * VALUES["actuator.gain"]  # the fifth state drifts with the command
    np.testing.assert_allclose(Phi[0], expm(A * track.dt), rtol=1e-10, atol=1e-12)
    B = np.zeros((5, 3))
    B[[1, 3], :2] = np.linalg.inv(plant.mass_matrix("inverted")) * [LEVELS["noise.psi"], LEVELS["noise.theta"]]
    B[4, 2] = LEVELS["noise.T"]
    # Gauss-Legendre of degree 15 is exact to rounding for so short a sample
    s, w = np.polynomial.legendre.leggauss(8)
    parts = [expm(A * track.dt * (1 + z) / 2) @ B for z in s]
    expected = sum(track.dt / 2 * k * p @ p.T for k, p in zip(w, parts, strict=True))
    np.testing.assert_allclose(Q[0], expected, rtol=1e-8, atol=1e-12 * np.abs(expected).max())


def test_back_emf_of_the_drive_damps_its_own_joint_as_friction_there_does() -> None:
    run = balanced(0, seconds=1.5)
    slope = 3e-4
    drive, joint = (
        posed(run, LEVELS, **changes) for changes in ({"actuator.slope": slope}, {"b_1": VALUES["b_1"] + slope})
    )
    for Phi, expected in zip(*(discrete_model(p.solver(0), p.tracks[0], {**p.base}, 1) for p in (drive, joint)),
                             strict=True):  # fmt: skip
        np.testing.assert_allclose(Phi, expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())


def test_the_gain_settles_at_the_solution_of_the_riccati_equation() -> None:
    problem = posed(balanced(0, seconds=3.0), LEVELS)
    track = problem.tracks[0]
    Phi, Q = discrete_model(problem.solver(0), track, {**problem.base}, 1)
    settled = gains(problem.solver(0), track, {**problem.base}, 200_000, 1)[-1][:, :, 0].T
    C = np.eye(5)[[0, 2]]
    R = QUANTUM**2 / 12 * np.eye(2)
    P = solve_discrete_are(Phi[0].T, C.T, Q[0], R)
    np.testing.assert_allclose(settled, P @ C.T @ np.linalg.inv(C @ P @ C.T + R), rtol=1e-3, atol=1e-3)


def test_a_filter_without_friction_is_the_textbook_kalman_filter() -> None:
    # so close to upright that the plant is linear to 1e-6 of its motion
    run = balanced(1, seconds=3.0)
    small = 1e-3
    upright = np.array([0.0, np.pi])
    run = replace(run, y=upright + small * (run.y - upright), u=small * run.u, resolution=(small * QUANTUM,) * 2)
    levels = {n: small * v for n, v in LEVELS.items()}
    problem = posed(run, levels, b_1c=0.0)
    track = problem.tracks[0]
    plan = track.ahead
    assert plan is not None
    found = restart_states(problem.solver(0), track, {**problem.base}, np.zeros((2, 1)), None)[:, 0, 0]
    Phi, Q = discrete_model(problem.solver(0), track, {**problem.base}, 1)
    plant = Furuta(**{**PLANT, "b_1c": 0.0})
    linear = plant.linear("inverted")
    A = np.zeros((5, 5))
    A[:4, :4], A[:4, 4:] = linear.A, linear.B * VALUES["actuator.gain"]
    C, R = np.eye(5)[[0, 2]], np.diag(plan.sensor)
    P = np.diag([*plan.initial, *plan.drift])
    x = np.array([run.y[0, 0], 0.0, run.y[0, 1] - np.pi, 0.0, 0.0])
    for k in range(1, int(track.restarts[0]) + 1):
        x = Phi[0] @ x + Phi[0][:, 4] * run.u[k - 1, 0] - np.eye(5)[4] * run.u[k - 1, 0]
        P = Phi[0] @ P @ Phi[0].T + Q[0]
        K = P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        x = x + K @ (run.y[k] - upright - C @ x)
        P = (np.eye(5) - K @ C) @ P
    scale = small * np.array([0.1, 1.0, 0.1, 1.0, 1.0])
    np.testing.assert_array_less(np.abs(found - x - [0, 0, np.pi, 0, 0]) / scale, 1e-3)


def test_a_filter_of_a_pendulum_whose_arm_is_locked_is_that_of_the_pendulum_alone() -> None:
    alone = {n: VALUES[n] for n in ("m_p", "l_cg", "J_p", "g")} | {"b_2": 1e-5, "b_2c": 1e-5}
    t = np.arange(2001) * 2e-3
    swing = simulate(Pendulum, alone, [0.3, 0.0], None, 2e-3, samples=t.size)[:, 0]
    arm = {n: VALUES[n] for n in ("r", "J_d", "actuator.gain")}
    fields: dict[str, Any] = {"label": "swing", "role": "fit", "horizon": (0.05,), "restart": "kalman", "unknown": ()}
    pendulum = Run(t=t, u=np.zeros((t.size, 1)), y=swing, measured=("theta",), resolution=(QUANTUM,), **fields)
    locked = Run(
        t=t, u=np.zeros((t.size, 1)), y=np.hstack([np.full_like(swing, 0.7), swing]), measured=("psi", "theta"),
        resolution=(QUANTUM, QUANTUM), held={"psi": 0.7}, **fields,
    )  # fmt: skip
    noise = {"noise.theta": LEVELS["noise.theta"], "noise.psi": 0.0, "noise.T": 0.0}
    known = []
    for run, plant, numbers in ((pendulum, Pendulum, alone), (locked, Furuta, alone | arm)):
        problem = formulate(rig(plant, numbers, {}), [run])
        values, still = {**problem.base, **noise}, np.zeros((len(run.measured), 1))
        known.append(restart_states(problem.solver(0), problem.tracks[0], values, still, None)[..., 0])
    np.testing.assert_allclose(known[1][2:4], known[0][:2], rtol=0, atol=1e-9)
    np.testing.assert_array_equal(known[1][0], 0.7)


def test_restarts_know_the_past_alone() -> None:
    run = balanced(2, seconds=4.0)
    problem = posed(run, LEVELS)
    restarts = problem.tracks[0].restarts
    middle = int(restarts[restarts.size // 2])
    y, u = run.y.copy(), run.u.copy()
    y[middle + 1 :] += 0.02
    u[middle:] += 1.0  # what is commanded at a sample acts after it
    other = posed(replace(run, y=y, u=u), LEVELS)
    # the filter's plan is drawn up from the whole record: its level, its spread; hold it
    other.tracks[0] = replace(problem.tracks[0], run=other.tracks[0].run, y=other.tracks[0].y, u=other.tracks[0].u)
    before, after = (
        restart_states(p.solver(0), p.tracks[0], {**p.base}, np.zeros((2, 1)), None)[:, :, 0] for p in (problem, other)
    )
    seen = restarts <= middle
    np.testing.assert_array_equal(before[:, seen], after[:, seen])
    assert np.all(np.any(before[:, ~seen] != after[:, ~seen], axis=0))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4])
def test_the_pole_of_a_balanced_pendulum_lies_in_its_interval(seed: int) -> None:
    fit = identify(rig(Furuta, VALUES, GUESSES), [balanced(seed)], method="least-squares")
    pole = fit.poles["inverted"][0].real
    truth = float(Furuta(**PLANT).linear("inverted").poles()[0].real)
    assert pole.interval[0] <= truth <= pole.interval[1]
    assert pole.stderr < 0.05 * truth
    ahead = fit.runs[f"seed {seed}"].ahead
    assert {0.05, 0.2} <= ahead.keys()  # those requested; the one that the start state allows may be another
    assert list(ahead) == sorted(ahead)
    assert all(ahead[0.05][c] > ahead[0.2][c] for c in ("psi", "theta"))  # the further, the harder


def test_a_prediction_with_true_numbers_errs_as_its_covariance_says() -> None:
    # rounding is nearly white while the plant moves by many counts; without dry friction the linear model holds, and
    # the spread of the errors is C Phi^h P Phi^h' C' and what the noise adds on the way
    run = balanced(5, seconds=20.0, push=0.02, friction=0.0)
    level = 0.02 * VALUES["actuator.gain"]
    levels = {"noise.psi": level, "noise.theta": 1e-9, "noise.T": 1e-9}
    problem = posed(run, levels, b_1c=0.0)
    track = problem.tracks[0]
    Phi, Q = discrete_model(problem.solver(0), track, {**problem.base}, 1)
    F, N = Phi[0][:4, :4], Q[0][:4, :4]
    C, R = np.eye(4)[[0, 2]], QUANTUM**2 / 12 * np.eye(2)
    P = solve_discrete_are(F.T, C.T, N, R)
    P = P - P @ C.T @ np.linalg.inv(C @ P @ C.T + R) @ C @ P
    score = predict(dict(problem.base), problem.rig, [replace(run, horizon=(0.05,))])[run.label]
    for _ in range(25):
        P = F @ P @ F.T + N
    error = np.std(score.y - score.simulated, axis=0)
    # 390 errors, independent where they do not overlap: four standard deviations of a standard deviation are 14 %
    np.testing.assert_allclose(error, np.sqrt(np.diag(P)[[0, 2]]), rtol=0.14)


def test_every_horizon_is_scored_by_the_motion_from_the_filtered_states() -> None:
    """Simulated from them under the logged command and its drift, so many samples on, against what was logged then."""
    run = balanced(6, seconds=4.0)
    problem = posed(run, LEVELS)
    track = problem.tracks[0]
    told = predict({}, problem.rig, [run])[run.label]
    at = restart_states(problem.solver(0), track, {**problem.base}, np.zeros((2, 1)), None)[..., 0]
    drive = {"actuator.gain": VALUES["actuator.gain"], "actuator.offset": at[4]}

    def percents(y: np.ndarray, measured: np.ndarray) -> dict[str, float]:
        missed, moved = (np.linalg.norm(e, axis=0) for e in (y - measured, measured - measured.mean(axis=0)))
        return dict(zip(("psi", "theta"), 100 * (1 - missed / moved), strict=True))

    judged = told.horizon
    assert judged is not None
    for horizon in (0.05, judged, 0.2):
        steps = round(horizon / 2e-3)
        motion = simulate(
            Furuta(**PLANT), drive, at[:4].T, run.u, 2e-3, samples=steps + 1, substeps=problem.rig.substeps,
            start=track.restarts,
        )  # fmt: skip
        assert told.ahead[horizon] == pytest.approx(percents(motion[steps][[0, 2]].T, run.y[track.restarts + steps]))
        if horizon == judged:
            assert told.fit_percent == told.ahead[judged]
            assert told.t == pytest.approx(run.t[track.restarts + steps])
            held = (at[[0, 2]] + judged * at[[1, 3]]).T
            assert told.naive == pytest.approx(percents(held, run.y[track.restarts + steps]))


def test_a_list_of_horizons_needs_the_filter() -> None:
    with pytest.raises(BadInput, match="several horizons"):
        formulate(true_rig(), [balanced(0, seconds=3.0, restart="smooth")])


def test_a_record_shorter_than_its_warming_up_is_refused() -> None:
    with pytest.raises(BadInput, match=r"warms up for 0\.8 s"):
        formulate(with_noise(true_rig(), [balanced(0, seconds=3.0)]), [balanced(0, seconds=0.9)])
