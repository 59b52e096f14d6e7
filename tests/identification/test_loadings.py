"""Does 1/omega^2 over added inertia give stiffness and bare inertia, with intervals that hold?"""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import curve_fit
from scipy.special import erfinv

from tests.signals.swings import swing
from upright.errors import BadInput, NotIdentifiable
from upright.identification.loadings import Loaded, fit_loadings, swings
from upright.readers import read
from upright.records import Record
from upright.signals.free_swing import Decay, decay

K, BARE, C, F = 390.0, 0.77, 1.2, 0.2


def loaded(added: float, seed: int = 0, noise: float = 1e-5) -> Loaded:
    t, y, _ = swing(BARE + added, K, C, F, x0=0.02, noise=noise, seed=seed)
    return Loaded(label=f"{added:g} kg", added=added, decay=decay(t, y, resolution=2 * noise))


@pytest.fixture(scope="module")
def campaign() -> list[Loaded]:
    return [loaded(a, seed) for seed, a in enumerate((0.0, 0.5, 1.0, 2.0) * 2)]


def test_the_line_gives_what_was_put_in(campaign):
    found = fit_loadings(campaign)
    for what, truth in ((found.k, K), (found.bare, BARE), (found.damping, C)):
        assert abs(what.value - truth) < 3 * what.stderr
        assert what.value == pytest.approx(truth, rel=1e-2)
    assert "A line explains all 4 loadings" in found.verdict


@pytest.mark.parametrize(
    ("share", "resolution", "seen"),
    [(0.04, 1e-6, 1), (0.06, 1e-6, 2), (0.3, 5e-4, 2), (0.3, 8e-4, 1), (0.5, 8e-4, 2)],
)
def test_a_step_is_at_rest_below_a_twentieth_of_the_log_or_twenty_counts(share, resolution, seen):
    """Two swings, 38 mm from peak to trough and a share of that: 5 % of it is 1.9 mm, 20 counts of 0.8 mm are 16."""
    t = np.arange(2000) * 1e-3
    one = 0.02 * np.exp(-0.8 * t) * np.cos(25 * t)
    both = np.concatenate([one, share * one])
    log = Record(
        t=np.arange(4000) * 1e-3, signals={"x": both, "u": np.repeat([0.0, 1.0], 2000)}, inputs=("u",), outputs=("x",)
    )
    found = swings(log, added=0.0, label="log", signal="x", command="u", resolution=resolution)
    assert [s.label for s in found] == ["log, step 0", "log, step 1"][:seen]
    assert found[0].decay.omega_d == pytest.approx(25.0, rel=1e-2)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    clean = {a: swing(BARE + a, K, C, F, x0=0.02)[:2] for a in (0.0, 0.5, 1.0, 2.0)}
    held = np.zeros(3)
    for trial in range(60):
        rng = np.random.default_rng(trial)
        again = []
        for a, (t, y) in clean.items():
            for _ in range(2):
                noisy = decay(t, y + 1e-5 * rng.normal(size=t.size), resolution=2e-5)
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
    found = swings(record, added=0.0, label="bare", signal="x", command="u", resolution=0.0)
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


def by_hand(added: float, omega: float, omega_error: float, sigma: float = 0.2, sigma_error: float = 0.01) -> Loaded:
    """A swing of which the frequency and the decay are given."""
    none = np.zeros(0)
    numbers = Decay(
        t=none, x=none, maximum=none.astype(bool), omega_d=omega, omega_n=omega, sigma=sigma, rho=0.9, centre=0.0,
        delta=0.0, model=none, omega_error=omega_error, sigma_error=sigma_error, delta_error=0.0,
    )  # fmt: skip
    return Loaded(label="", added=added, decay=numbers)


def test_two_swings_have_the_errors_of_a_line_through_two_points():
    """y = (m + a)/k at a = 0 and 3 kg: k = 3/(y_2 - y_1), so dk = k^2/3 times the root of the errors' squares.

    y = 1/4 and 1 s^2: k = 4 N/m, m = 1 kg. An error of 1 % in omega is one of 2 % in y: 0.005 and 0.02 s^2. And
    m = k y_1: dm = sqrt((y_1 dk/dy_1 + k)^2 0.005^2 + (y_1 dk/dy_2)^2 0.02^2), with dk/dy = +- 16/3.
    """
    found = fit_loadings([by_hand(0.0, 2.0, 0.02), by_hand(3.0, 1.0, 0.01)])
    assert (found.k.value, found.bare.value) == (pytest.approx(4.0), pytest.approx(1.0))
    assert found.y_error == pytest.approx([0.005, 0.02])
    dk = 16 / 3 * math.hypot(0.005, 0.02)
    dm = math.hypot((0.25 * 16 / 3 + 4) * 0.005, 0.25 * 16 / 3 * 0.02)
    assert found.k.stderr == pytest.approx(dk)
    assert found.bare.stderr == pytest.approx(dm)
    # 95 % of a normal distribution lie within its error function's argument sqrt(2) erfinv(0.95)
    within = math.sqrt(2) * erfinv(0.95)
    assert found.k.interval == pytest.approx((4 - within * dk, 4 + within * dk), rel=1e-12)
    assert found.bare.interval == pytest.approx((1 - within * dm, 1 + within * dm), rel=1e-12)
    assert math.isnan(found.misfit)
    assert math.isnan(found.repeat)
    assert found.verdict.startswith("Two loadings fix a line")


def test_repeats_scatter_about_the_means_of_their_loadings():
    """0.99 and 1.01, 1.96, 2 and 2.04 times what they should be: squares 2e-4 + 8e-4, of 1 + 2 degrees of freedom."""
    y = [(0.0, 0.99), (0.0, 1.01), (1.0, 1.96), (1.0, 2.0), (1.0, 2.04), (2.0, 3.0)]
    found = fit_loadings([by_hand(a, v**-0.5, 1e-5) for a, v in y])
    assert found.repeat == pytest.approx(math.sqrt((2e-4 + 8e-4) / 3))
    # it is larger than the 2e-5 that each swing says of itself, so it is the error of all, of the lone one too
    assert found.y_error == pytest.approx([found.repeat * v for _, v in y])
    careful = fit_loadings([by_hand(a, v**-0.5, 0.05 * v**-0.5) for a, v in y])
    assert careful.y_error == pytest.approx([0.1 * v for _, v in y])  # twice the error of omega, the larger here


@pytest.mark.parametrize(("bump", "error"), [(0.02, 1e-3), (0.012, 1e-3), (1e-4, 1e-3)])
def test_an_interval_is_as_wide_as_the_points_scatter_or_as_is_stated_the_larger(bump, error):
    """Three points, y = 1 + a but for a bump in the middle, each to 2 `error` y: scipy's line, chi and Student's t."""
    a, y = np.array([0.0, 1.0, 2.0]), np.array([1.0, 2.0 + bump, 3.0])
    found = fit_loadings([by_hand(x, v**-0.5, error * v**-0.5) for x, v in zip(a, y, strict=True)])
    (slope, intercept), spread = curve_fit(
        lambda a, s, i: i + s * a, a, y, sigma=2 * error * y, absolute_sigma=True, xtol=1e-14, ftol=1e-14
    )
    chi = float(np.sum(((y - intercept - slope * a) / (2 * error * y)) ** 2))
    assert found.misfit == pytest.approx(chi, rel=1e-6)  # one degree of freedom
    scatter, stated = math.sqrt(chi), math.sqrt(spread[0, 0]) / slope**2
    assert (scatter > 1) == (bump > 0.01)
    assert found.k.stderr == pytest.approx(stated * max(1.0, scatter), rel=1e-6)
    half = max(math.sqrt(2) * erfinv(0.95), stats.t.ppf(0.975, 1) * scatter) * stated
    assert found.k.interval[1] - found.k.value == pytest.approx(half, rel=1e-6)
    # points that scatter so once in a hundred times are no accident
    assert ("is an added inertia wrong" in found.verdict) == (stats.chi2.sf(chi, 1) < 0.01) == (bump == 0.02)


def test_friction_is_the_weighted_mean_of_what_the_swings_decay_by():
    """c = k g, g = 2 sigma/omega^2: 0.1 and 0.06 s, to 0.01 and 0.02 s: weights 4 and 1, mean 0.092 s, chi 3.2.

    One degree of freedom, so its error 0.01/sqrt(1.25) grows by sqrt(3.2), its interval by 12.706 of these.
    """
    swung = [
        by_hand(0.0, 2.0, 0.02, sigma=0.2, sigma_error=0.02),
        by_hand(3.0, 1.0, 0.01, sigma=0.03, sigma_error=0.01),
    ]
    found = fit_loadings(swung)
    assert found.damping.value == pytest.approx(4 * 0.092)
    dg = 0.01 / math.sqrt(1.25) * math.sqrt(3.2)
    assert found.damping.stderr == pytest.approx(math.hypot(4 * dg, 0.092 * found.k.stderr))
    t = stats.t.ppf(0.975, 1)
    reach = math.hypot(4 * t * dg, 0.092 * (found.k.interval[1] - 4))
    assert found.damping.interval == pytest.approx((4 * 0.092 - reach, 4 * 0.092 + reach))


def test_a_bare_inertia_that_may_be_nothing_is_said():
    """y = (0.01 + a)/4, to 20 %: the bare body is lost in the errors of the loaded ones."""
    swung = [by_hand(a, ((0.01 + a) / 4) ** -0.5, 0.1 * ((0.01 + a) / 4) ** -0.5) for a in (1.0, 2.0, 3.0)]
    found = fit_loadings(swung)
    assert found.bare.interval[0] <= 0
    assert found.verdict.startswith("The bare body's inertia cannot be distinguished from zero")
