"""Closed-form starts are within a few percent of the truth, without a simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, shaken, swing
from upright.closed_loop.structures import ClosedLoop, pid
from upright.identification.model.grey_box import base_values
from upright.identification.model.runs import Run
from upright.identification.search.starts import friction_from_energy, observe, regress, samples_of, turning_points
from upright.physics import Furuta, Pendulum, find
from upright.signals.smoothing import dominant_period, savitzky_golay


def test_energy_lost_between_turns_gives_all_three_frictions() -> None:
    asked = rig(Pendulum, PENDULUM, {"b_2": 1.0, "b_2c": 1.0, "b_2q": 1.0})
    run = noisy(swing(angle=2.5, seconds=15.0, dt=2e-3), 1e-4, seed=0)
    sample = observe(asked, run)
    assert sample is not None
    found = friction_from_energy(asked, [sample], base_values(asked))
    # the swing decays by a factor of ten, which separates the three integrals to some percent
    assert found == pytest.approx({n: PENDULUM[n] for n in ("b_2", "b_2c", "b_2q")}, rel=0.08)


def test_coulomb_alone_takes_a_straight_line_from_the_amplitude() -> None:
    """Small swing with dry friction only: the amplitude falls by 2 b_2c/(m g l) per half swing."""
    values = {**PENDULUM, "b_2": 0.0, "b_2q": 0.0, "J_p": 0.0}
    run = swing(values, angle=0.3, seconds=8.0, dt=1e-3)
    motion = savitzky_golay(run.y[:, 0], 1e-3, 41)
    turns = turning_points(motion.q, 0.01)
    falls = -np.diff(np.abs(motion.q[turns]))
    assert falls == pytest.approx(np.full(falls.size, 2 * 2e-3 / (0.2 * 9.81 * 0.3)), rel=0.02)


@pytest.mark.parametrize("factor", [0.3, 1.0, 3.0])
def test_accelerations_give_the_furuta_from_any_guess(factor: float) -> None:
    names = ("J_d", "l_cg", "b_1", "b_1c")
    asked = rig(Furuta, FURUTA, {n: factor * FURUTA[n] for n in names})
    sample = observe(asked, noisy(shaken(), 1e-5, seed=1))
    assert sample is not None
    found = regress(asked, [sample])
    assert found.unexplained < 0.01
    for n in ("J_d", "l_cg", "b_1"):
        assert found.values[n] == pytest.approx(FURUTA[n], rel=0.06)


def test_guesses_thousands_of_times_beside_the_inertia_that_is_given_still_lead_to_the_flexible_link() -> None:
    """A hub of 1 kg m^2 whose link was guessed at 0.2 g m^2; the log by SciPy, its counts 4096 to a turn."""
    J_l, k_s, b_1, b_2, gain, dt, n = 0.9, 600.0, 40.0, 0.4, 70.0, 0.004, 2000
    per_torque, both = np.array([0.0, 1.0, 0.0, -1.0]), 1 + 1 / J_l
    A = np.array([[0, 1, 0, 0], [0, -b_1, k_s, b_2], [0, 0, 0, 1], [0, b_1, -k_s * both, -b_2 * both]])
    u = 2 * np.sign(np.sin(4.5 * dt * np.arange(n)))
    _, x, _ = dlsim(cont2discrete((A, gain * per_torque[:, None], np.eye(4), np.zeros((4, 1))), dt), u)
    count = 2 * np.pi / 4096
    run = Run(label="log", role="fit", t=dt * np.arange(n), u=u[:, None], measured=("theta", "alpha"),
              y=np.round(x[:, [0, 2]] / count) * count, resolution=(count, count))  # fmt: skip
    beside = {"J_l": 2e-4, "k_s": 0.14, "b_1": 1e-5, "b_2": 1e-5, "actuator.gain": 0.07}
    truth = {"J_h": 1.0, "J_l": J_l, "k_s": k_s, "b_1": b_1, "b_2": b_2, "actuator.gain": gain}
    asked = rig(find("flexible-link"), truth, beside)
    asked.parameters["actuator.gain"] = replace(asked.parameters["actuator.gain"], unit="(N m)/V")
    (sample,) = samples_of(asked, [run])
    found = regress(asked, [sample])
    for n in ("J_l", "k_s", "b_1", "actuator.gain"):
        assert found.values[n] == pytest.approx(truth[n], rel=0.3)  # a start; counts are 4 % of the deflection


@pytest.mark.parametrize("factor", [0.5, 1.0, 3.0])
def test_masses_that_only_scale_together_stay_where_the_guess_put_them(factor: float) -> None:
    """A free swing tells J/m, b/m: with both twice as large it swings the same."""
    truth = {**PENDULUM, "b_2c": 0.0, "b_2q": 0.0}
    asked = rig(Pendulum, truth, {n: factor * truth[n] for n in ("m_p", "J_p", "b_2")})
    sample = observe(asked, noisy(swing(truth, angle=0.8), 1e-5, seed=3))
    assert sample is not None
    found = regress(asked, [sample])
    assert found.unexplained < 0.01
    for n in ("m_p", "J_p", "b_2"):
        assert found.values[n] == pytest.approx(factor * truth[n], rel=0.1)


def test_dominant_period_of_a_sine_is_its_period() -> None:
    t = np.arange(0, 10, 0.01)
    # a Hann window over ten periods widens the line by one tenth
    assert dominant_period(np.sin(2 * np.pi * t), 0.01) == pytest.approx(1.0, rel=0.05)


def test_smoothing_polynomials_are_exact_for_polynomials() -> None:
    t = np.arange(200) * 0.01
    motion = savitzky_golay(t**4 - 2 * t**2, 0.01, 21)
    assert motion.q == pytest.approx(t**4 - 2 * t**2, abs=1e-10)
    assert motion.v == pytest.approx(4 * t**3 - 4 * t, abs=1e-8)
    assert motion.a == pytest.approx(12 * t**2 - 4, abs=1e-5)


@pytest.mark.parametrize(("runs", "samples"), [(1, 4500), (3, 1800), (10, 1500)])
def test_long_runs_share_six_thousand_samples_and_keep_fifteen_hundred_each(runs: int, samples: int) -> None:
    """Of 9000 samples every second is taken, one in ceil(9000/2000) = 5 of three runs, one in 6 of ten."""
    run = swing(seconds=9000 * 2e-3 - 2e-3, dt=2e-3)
    assert run.t.size == 9000
    found = samples_of(rig(Pendulum, PENDULUM, {"J_p": 2e-3}), [run] * runs)
    assert [(s.q.shape[1], s.dt) for s in found] == [(samples, pytest.approx(2e-3 * 9000 / samples))] * runs


def test_a_law_runs_at_its_own_rate_through_a_run_that_was_thinned() -> None:
    """An integrator of five samples a row sums -theta dt, whether every row or every third is looked at."""
    run = swing(angle=0.5, seconds=6.0)
    law = pid(ki=2.0, period=2e-3, measured="theta")
    closed = replace(run, loop=ClosedLoop(law=law, every=5))
    asked = rig(Pendulum, PENDULUM, {"J_p": 2e-3})
    (sample,) = samples_of(asked, [closed], most=250)
    assert sample.q.shape[1] == 201
    sums = -2.0 * np.concatenate([[0.0], np.cumsum((run.y[1:, 0] + run.y[:-1, 0]) / 2 * 0.01)])[::3]
    # rectangles of 2 ms under 0.5 rad, and what smoothing over a fiftieth of a second takes off the turns
    assert np.abs(sample.u[0] - sums)[10:-10].max() < 0.01 * np.ptp(sums)


def test_nothing_heavy_is_imported_to_fit() -> None:
    """scipy.signal alone takes longer to import than a free swing takes to fit."""
    import subprocess
    import sys

    code = (
        "import sys\n"
        "from tests.identification.twins import PENDULUM, rig, swing\n"
        "from upright.identification.estimate import identify\n"
        "from upright.physics import Pendulum\n"
        "guesses = {'J_p': 3e-3, 'b_2': 1e-3, 'b_2c': 1e-3}\n"
        "identify(rig(Pendulum, PENDULUM, guesses), [swing(seconds=3.0)])\n"
        "heavy = ('scipy.signal', 'scipy.stats', 'sympy', 'pandas', 'matplotlib', 'control')\n"
        "print([m for m in heavy if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
