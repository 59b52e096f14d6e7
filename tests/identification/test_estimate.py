"""Is what a fit says beside its numbers, as of their correlation, that of the covariance?"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from upright.identification.estimate import _correlation, least_explained

NAMES = ("J_p", "b_2", "offset", "m_p", "k")
SIGMA = np.array([2e-5, 3e-4, 1.0, 0.02, 40.0])
BETWEEN = np.array(
    [[1, 0.5, 0, -0.8, 0.1], [0.5, 1, 0, 0.2, 0], [0, 0, 1, 0, 0], [-0.8, 0.2, 0, 1, 0.3], [0.1, 0, 0, 0.3, 1]]
)


def best(covariance: np.ndarray, lost: tuple[str, ...] = ()) -> Any:
    unknowns = [SimpleNamespace(name=n) for n in NAMES]
    shared = [0, 1, 3, 4]  # an offset is of its run
    return SimpleNamespace(
        shared=shared, lost=lost, covariance=covariance, problem=SimpleNamespace(unknowns=unknowns),
    )  # fmt: skip


def seen(*names: str) -> Any:
    return cast(Any, SimpleNamespace(names=names))


def test_the_correlation_of_numbers_of_any_size_is_the_covariance_over_their_standard_errors() -> None:
    C = BETWEEN * np.outer(SIGMA, SIGMA)
    assert _correlation(best(C), seen("J_p", "b_2", "m_p", "k")) == pytest.approx(
        BETWEEN[np.ix_([0, 1, 3, 4], [0, 1, 3, 4])]
    )
    assert _correlation(best(C), seen("J_p", "m_p")) == pytest.approx(np.array([[1, -0.8], [-0.8, 1]]))


def test_a_number_at_its_bound_correlates_with_itself_alone() -> None:
    """It is held, so its row of the covariance is zero."""
    C = BETWEEN * np.outer(SIGMA, SIGMA)
    C[1], C[:, 1] = 0.0, 0.0
    told = _correlation(best(C), seen("J_p", "b_2", "m_p"))
    assert told == pytest.approx(np.array([[1, 0, -0.8], [0, 1, 0], [-0.8, 0, 1]]))


def test_where_a_run_is_lost_no_correlation_is_known() -> None:
    nothing = np.full((5, 5), np.nan)
    assert _correlation(best(nothing, lost=("swing",)), seen("J_p", "b_2")).tolist() == [[1, 0], [0, 1]]


def test_the_least_explained_is_the_worst_signal_of_the_fitted_runs() -> None:
    runs = {
        name: cast(Any, SimpleNamespace(role=role, fit_percent={"x": x, "theta": theta}))
        for name, role, x, theta in (("a", "fit", 99.0, 93.0), ("b", "fit", 95.0, 97.0), ("c", "predict", 12.0, 50.0))
    }
    assert least_explained(runs) == 93.0
    assert least_explained({"c": runs["c"]}) == 100.0  # nothing was fitted, so nothing is explained badly
