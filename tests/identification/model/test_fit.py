"""What a score counts."""

from __future__ import annotations

import numpy as np
import pytest

from upright.identification import RunScore

N = 1200


def test_samples_inside_a_band_are_counted_where_they_are_scored() -> None:
    """Of 600 scored samples those of 1.5 lie outside a band of 1, a third of them; those before do not count."""
    missed = np.where(np.arange(N) < 600, 9.0, np.where(np.arange(N) % 3 == 0, 1.5, 1.0))
    y = np.zeros((N, 1))
    score = RunScore(
        role="predict", fit_percent={"theta": 0.0}, horizon=None, t=5.0 + 0.01 * np.arange(N), y=y,
        simulated=y - missed[:, None], measured=("theta",), score_from=6.0, band={"theta": np.ones(N)},
    )  # fmt: skip
    assert score.inside == {"theta": pytest.approx(100 * 2 / 3)}
