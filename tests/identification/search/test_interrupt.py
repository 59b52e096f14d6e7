"""Ctrl-C at any moment ends a fit soon, and what was found so far is told."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, noisy, rig, swing
from upright.identification import Fit
from upright.identification.estimate import METHODS, identify
from upright.physics import Pendulum
from upright.report.fit.chapter import chapter

GUESSES = {"J_p": 3e-3, "b_2": 1e-3, "b_2c": 1e-3, "b_2q": 2e-3}


class Stopped:
    """Somebody who presses Ctrl-C at the k-th call, and counts the calls."""

    def __init__(self, at: int) -> None:
        self.at, self.calls = at, 0

    def __call__(self, stage: str, share: float) -> None:
        self.calls += 1
        if self.calls == self.at:
            raise KeyboardInterrupt


def fitted(method: str, at: int) -> tuple[Fit, Stopped]:
    runs = [
        noisy(swing(seconds=4.0), 1e-3, 8),
        noisy(swing(seconds=4.0, angle=1.0, label="b", role="predict"), 1e-3, 9),
    ]
    stopped = Stopped(at)
    return identify(rig(Pendulum, PENDULUM, GUESSES), runs, method=method, progress=stopped), stopped


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_interrupt_at_any_call_ends_the_fit(method: str) -> None:
    whole, counted = fitted(method, 10**9)
    assert not whole.interrupted
    assert counted.calls > 8
    first, last = [], []
    for at in itertools.chain(range(1, 9), range(9, counted.calls + 1, max(1, counted.calls // 12)), [counted.calls]):
        fit, stopped = fitted(method, at)
        assert fit.interrupted, at
        assert "interrupted" in fit.verdict
        assert not fit.trusted
        assert stopped.calls == at, "it ran on"
        assert set(fit.estimates) == set(GUESSES)
        assert np.isfinite(fit.cost)
        (first if at < 9 else last).append(fit.cost)
    assert last[-1] < first[0], "what is kept gets better"


@pytest.mark.parametrize("at", [2, 6])
def test_what_an_interrupted_fit_did_not_look_at_is_said_to_be_not_evaluated(at: int) -> None:
    """Silence would read as "looked at, and found nothing"."""
    fit, _ = fitted("auto", at)
    whole, _ = fitted("auto", 10**9)
    assert whole.not_evaluated == ()
    assert set(fit.runs) == {"swing"}, "what was held out is not predicted"
    told = chapter(fit, title="t")
    steps = " ".join(s.sentence for s in told.steps)
    page = f"{told.verdict} {told.detail} {fit.verdict} {steps}"
    for claim in ("No equilibrium of this plant is unstable", "Every run was fitted", "can be used:"):
        assert claim not in page
    for answer in fit.answers[1:]:
        assert answer.answer in ("not tested", "no")
        assert "Not evaluated: interrupted." in answer.text()
    (warning,) = (w for w in told.warnings if "Not evaluated: interrupted." in w)
    for what in fit.not_evaluated:
        assert what in warning
    assert any("held out" in what for what in fit.not_evaluated)
