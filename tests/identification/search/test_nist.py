"""NIST's certified nonlinear regressions: parameters and standard errors to 6 digits from both starts."""

import numpy as np
import pytest

from benchmarks.nist import digits, model, problems
from upright.errors import BadInput
from upright.identification.search.curve import fit_curve

CASES = [(p, start) for p in problems() for start in ("start1", "start2")]


@pytest.mark.parametrize(
    ("problem", "start"),
    [pytest.param(p, s, marks=pytest.mark.slow) if (p["name"], s) == ("MGH10", "start1") else (p, s) for p, s in CASES],
    ids=[f"{p['name']}-{s}" for p, s in CASES],
)
def test_certified_values_are_found(problem, start):
    fit = fit_curve(model(problem), problem["y"], problem[start])
    assert digits(fit.values, problem["certified"]) >= 6
    assert digits(fit.stderr, problem["certified_sd"]) >= 6
    np.testing.assert_allclose(fit.cost, problem["rss"], rtol=1e-9)


def test_unequal_weights_agree_with_the_closed_form_of_a_line():
    x = np.linspace(0.0, 2.0, 9)
    sigma = 1.0 + x
    y = 3.0 - 2.0 * x + np.array([0.1, -0.2, 0.0, 0.3, -0.1, 0.2, -0.3, 0.1, 0.05])
    X = np.stack([np.ones_like(x), x], axis=1) / sigma[:, None]
    expected, rss, *_ = np.linalg.lstsq(X, y / sigma)
    fit = fit_curve(lambda b: b[0] + b[1] * x, y, [0.0, 0.0], sigma=sigma)
    np.testing.assert_allclose(fit.values, expected, rtol=1e-9)
    np.testing.assert_allclose(fit.covariance, np.linalg.inv(X.T @ X) * rss[0] / 7, rtol=1e-6)


def test_bounds_hold():
    x = np.linspace(0.0, 1.0, 20)
    fit = fit_curve(lambda b: b[0] * x, 2.0 * x, [0.5], upper=1.5)
    assert fit.values[0] == 1.5


def test_too_few_data_are_refused():
    with pytest.raises(BadInput, match="more than 3 data"):
        fit_curve(lambda b: b, [1.0, 2.0, 3.0], [0.0, 0.0, 0.0])


def test_a_start_where_the_model_is_not_finite_is_refused():
    with pytest.raises(BadInput, match="start elsewhere"):
        fit_curve(lambda b: np.log(b[0]) * np.ones(4), [0.0, 1.0, 2.0, 3.0], [-1.0])
