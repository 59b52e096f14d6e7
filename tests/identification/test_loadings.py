"""Does 1/omega^2 over added inertia give stiffness and bare inertia, with intervals that hold?"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit

from tests.signals.swings import swing
from upright.errors import BadInput, NotIdentifiable
from upright.identification.loadings import Loaded, fit_loadings, swings
from upright.readers import read
from upright.records import Record
from upright.signals.free_swing import decay

K, BARE, C, F = 390.0, 0.77, 1.2, 0.2


def loaded(added: float, seed: int = 0, noise: float = 1e-5) -> Loaded:
    t, y, _ = swing(BARE + added, K, C, F, x0=0.02, noise=noise, seed=seed)
    return Loaded(label=f"{added:g} kg", added=added, decay=decay(t, y, quantum=2 * noise))


@pytest.fixture(scope="module")
def campaign() -> list[Loaded]:
    return [loaded(a, seed) for seed, a in enumerate((0.0, 0.5, 1.0, 2.0) * 2)]


def test_the_line_gives_what_was_put_in(campaign):
    found = fit_loadings(campaign)
    for what, truth in ((found.k, K), (found.bare, BARE), (found.damping, C)):
        assert abs(what.value - truth) < 3 * what.stderr
        assert what.value == pytest.approx(truth, rel=1e-2)
    assert "A line explains all 4 loadings" in found.verdict


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    clean = {a: swing(BARE + a, K, C, F, x0=0.02)[:2] for a in (0.0, 0.5, 1.0, 2.0)}
    held = np.zeros(3)
    for trial in range(60):
        rng = np.random.default_rng(trial)
        again = []
        for a, (t, y) in clean.items():
            for _ in range(2):
                noisy = decay(t, y + 1e-5 * rng.normal(size=t.size), quantum=2e-5)
                again.append(Loaded(label="", added=a, decay=noisy))
        found = fit_loadings(again)
        held += [w.interval[0] <= v <= w.interval[1] for w, v in ((found.k, K), (found.bare, BARE), (found.damping, C))]
    # of 60 honest 95 % intervals fewer than 53 hold once in 60 times; the larger of two accounts errs on the safe side
    assert (held >= 53).all()


def test_errors_in_the_pieces_are_those_of_a_fit_with_their_whole_covariance(campaign):
    """scipy's curve_fit with the covariance of points whose loadings share their pieces."""
    piece, tolerance = 0.5, 5e-3
    found = fit_loadings(campaign, tolerance=tolerance, piece=piece)
    a = np.array([s.added for s in campaign])
    covariance = np.diag(found.y_error**2) + tolerance**2 * piece * np.minimum.outer(a, a) / found.k.value**2
    (k, bare), spread = curve_fit(lambda a, k, m: (m + a) / k, a, found.y, [300.0, 1.0], sigma=covariance,
                                  absolute_sigma=True, xtol=1e-14, ftol=1e-14)  # fmt: skip
    assert found.k.value == pytest.approx(k, rel=1e-6)
    assert found.bare.value == pytest.approx(bare, rel=1e-6)
    assert found.misfit < 1  # so that no scatter widens the stated errors
    assert found.k.stderr == pytest.approx(np.sqrt(spread[0, 0]), rel=1e-3)
    assert found.bare.stderr == pytest.approx(np.sqrt(spread[1, 1]), rel=1e-3)


def test_a_wrongly_labelled_mass_widens_the_intervals_and_is_said(campaign):
    wrong = [Loaded(label=s.label, added=1.5 if s.added == 1.0 else s.added, decay=s.decay) for s in campaign]
    found = fit_loadings(wrong)
    assert found.misfit > 10
    assert "is an added inertia wrong" in found.verdict
    assert found.k.interval[0] <= K <= found.k.interval[1]


def test_one_loading_fixes_nothing_and_swapped_logs_are_noticed(campaign):
    with pytest.raises(NotIdentifiable, match="two different"):
        fit_loadings([s for s in campaign if s.added == 0.5])
    swapped = [Loaded(label=s.label, added=2.0 - s.added, decay=s.decay) for s in campaign]
    with pytest.raises(NotIdentifiable, match="does not grow"):
        fit_loadings(swapped)


def test_a_step_on_and_off_are_two_swings():
    t, y, _ = swing(BARE, K, C, F, x0=0.02)
    n = t.size
    record = Record(
        t=np.arange(2 * n) * 2e-3,
        signals={"x": np.concatenate([0.02 - y, y]), "u": np.repeat([1.0, 0.0], n)},
    )
    found = swings(record, added=0.0, label="bare", signal="x", command="u", quantum=0.0)
    assert [s.command for s in found] == [1.0, 0.0]
    assert found[0].decay.omega_n == pytest.approx(found[1].decay.omega_n, rel=1e-6)


def test_a_command_that_is_no_step_is_refused():
    t, y, _ = swing(BARE, K, C, F, x0=0.02)
    with pytest.raises(BadInput, match="a step response needs steps"):
        swings(Record(t=t, signals={"x": y, "u": np.sin(t)}), added=0.0, label="run", signal="x", command="u")


@pytest.mark.real_data
def test_a_real_cart_repeats_its_frequency_to_the_errors_stated():
    """Five steps of one day on an ECP 210; each swing after the end of the command, when the drive is silent."""
    folder = Path(os.environ["UPRIGHT_REAL_DATA"]) / "ecp210_rectilinear_ucsd_1khz"
    logs = [
        next(folder.glob(f"07-Feb*{stamp}.txt"))
        for stamp in ("09_29_44", "09_35_19", "11_16_25", "11_17_48", "11_18_23")
    ]
    found = []
    for log in logs:
        record = read(log)
        told = swings(record, added=0.0, label=log.name, signal="Encoder 1 Pos", command="Control Effort")
        found.append(next(s for s in told if s.command == 0).decay)
    omega, error = np.array([(d.omega_n, d.omega_error) for d in found]).T
    mean = np.average(omega, weights=error**-2)
    # chi square of five repeats about their mean: 13.3 is its 99 % quantile at four degrees of freedom
    assert np.sum(((omega - mean) / error) ** 2) < 13.3
    assert (error / omega < 5e-3).all()
