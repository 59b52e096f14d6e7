"""What a score counts."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from upright.identification import Fit, RunScore

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


def test_a_band_leads_to_expect_what_its_normal_errors_leave_of_the_motion() -> None:
    """Nine tenths of normal errors lie within 1.645 standard deviations; those of a sine are a root of a half of it."""
    t = 0.01 * np.arange(1000)
    y = np.column_stack([2.0 * np.sin(2 * np.pi * t), np.full(t.size, 3.0)])
    score = RunScore(
        role="predict", fit_percent={"theta": 0.0, "x": 0.0}, horizon=None, t=t, y=y, simulated=y,
        measured=("theta", "x"), band={"theta": np.full(t.size, 0.3), "x": np.ones(t.size)},
    )  # fmt: skip
    assert score.moved == {"theta": pytest.approx(np.sqrt(2.0))}  # what stands still has no percent
    assert score.expected == {"theta": pytest.approx(100 * (1 - 0.3 / 1.6449 / np.sqrt(2.0)), abs=0.01)}
    later = RunScore(**{**vars(score), "score_from": 5.0, "band": {"theta": np.where(t < 5.0, 9.0, 0.3)}})
    assert later.expected == {"theta": pytest.approx(score.expected["theta"], abs=1e-6)}


def test_numbers_have_a_key_of_their_run_or_their_group() -> None:
    def valued(**values: float) -> dict[str, Any]:
        return {n: SimpleNamespace(value=v) for n, v in values.items()}

    fit: Any = SimpleNamespace(
        estimates=valued(J_p=2e-3, b_2=1e-3), per_run={"swing 1": valued(friction=1.2)},
        groups={"cold": valued(gain=0.9)},
    )  # fmt: skip
    assert Fit.keyed(fit) == {"J_p": 2e-3, "b_2": 1e-3, "swing 1: friction": 1.2, "group cold: gain": 0.9}
