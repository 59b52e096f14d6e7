"""What is left of runs once stretches of them are taken out: by hand, with both sides of every limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from upright.identification.checks.outliers import (
    BUMPED,
    SELF_EXCITED,
    SPIKES,
    Outlier,
    part_of_run,
    without_outliers,
    without_spikes,
)
from upright.identification.model.runs import Run

N = 301
RUN = Run(
    label="a", role="fit", t=0.1 * np.arange(N), u=np.zeros((N, 1)), y=np.cos(np.arange(N))[:, None],
    measured=("x",), initial={"x": 1.0}, source="log.csv",
)  # fmt: skip


def outlier(start: float, stop: float, reason: str = BUMPED, run: str = "a") -> Outlier:
    return Outlier(run=run, start=start, stop=stop, reason=reason, evidence="e")


def kept(*found: Outlier, run: Run = RUN) -> list[tuple[float, float]]:
    """First and last moment of each part that stays."""
    return [(round(float(r.t[0]), 6), round(float(r.t[-1]), 6)) for r in without_outliers([run], found)]


@pytest.mark.parametrize(
    ("spans", "parts"),
    [
        ([], [(0.0, 30.0)]),
        ([(14.0, 16.0)], [(0.0, 13.9), (16.1, 30.0)]),
        ([(10.1, 12.0)], [(0.0, 10.0), (12.1, 30.0)]),  # 101 of 301 samples are a third
        ([(10.0, 12.0)], [(12.1, 30.0)]),  # 100 are less
        ([(0.0, 12.0)], [(12.1, 30.0)]),
        ([(18.0, 30.0)], [(0.0, 17.9)]),
        ([(22.0, 23.0), (11.0, 12.0)], [(0.0, 10.9)]),  # 99 samples between them
        ([(8.0, 23.0)], []),
    ],
)
def test_a_third_of_a_run_is_worth_fitting(spans: list[tuple[float, float]], parts: list[tuple[float, float]]) -> None:
    assert kept(*(outlier(a, b) for a, b in spans)) == parts


def test_fifty_samples_are_the_least() -> None:
    short = RUN.samples(slice(110))
    assert kept(outlier(4.95, 5.05), run=short) == [(0.0, 4.9), (5.1, 10.9)]
    assert kept(outlier(4.85, 5.05), run=short) == [(5.1, 10.9)]  # 49 of 110 are more than a third


@pytest.mark.parametrize(("size", "stays"), [(0.11, True), (0.09, False)])
def test_what_hardly_moves_says_nothing(size: float, stays: bool) -> None:
    """A tenth of what the run spans."""
    y = RUN.y.copy()
    y[150:] *= size * np.ptp(RUN.y) / np.ptp(RUN.y[150:])
    spans = kept(outlier(14.5, 15.0), run=replace(RUN, y=y))
    assert ((15.1, 30.0) in spans) == stays
    assert spans[0] == (0.0, 14.4)


def test_others_and_predicted_runs_stay_whole_and_what_excites_itself_goes() -> None:
    assert without_outliers([RUN], [outlier(14.0, 16.0, run="b")]) == [RUN]
    ahead = replace(RUN, role="predict")
    assert without_outliers([ahead], [outlier(14.0, 16.0)]) == [ahead]
    assert without_outliers([RUN], [outlier(14.0, 16.0, SELF_EXCITED)]) == []
    assert without_outliers([RUN], [outlier(14.0, 16.0, SPIKES)])[0].t.size == N


def test_a_part_is_called_by_its_times_and_keeps_a_first_state_of_its_own_alone() -> None:
    late, early = part_of_run(RUN, 100, 201), part_of_run(RUN, 0, 100)
    assert (late.label, late.source) == ("a, 10 to 20 s", "log.csv; cut to 10 to 20 s")
    assert (late.t[0], late.t.size, dict(late.initial)) == (pytest.approx(10.0), 101, {})
    assert (early.label, dict(early.initial)) == ("a, 0 to 9.9 s", {"x": 1.0})
    assert part_of_run(RUN, 0, N) is RUN


def test_a_sample_that_jumps_away_and_back_is_replaced_and_told_with_its_time() -> None:
    smooth = np.cos(0.05 * np.arange(N))
    y = np.column_stack([smooth, smooth])
    run = replace(RUN, y=y, measured=("x", "z"), resolution=(1e-3, 1e-3))
    assert without_spikes(run) == (run, [])
    jumped = y.copy()
    jumped[[50, 200], [1, 0]] += 3.0
    clean, told = without_spikes(replace(run, y=jumped))
    assert [(round(t, 6), c) for t, c in told] == [(20.0, "x"), (5.0, "z")]
    assert clean.y == pytest.approx(y, abs=2e-3)
    mended = without_outliers([replace(run, y=jumped)], [outlier(5.0, 20.0, SPIKES)])[0]
    assert mended.y == pytest.approx(y, abs=2e-3)


def test_a_sentence_says_when_and_why() -> None:
    assert outlier(1.2345, 2.0).sentence == f"a, 1.23 to 2 s: {BUMPED} (e)."
