"""The prediction without physics that a model is compared with: exact where the truth is a difference equation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from upright.identification.inference.black_box import Paced, _percents, _sampled, black_box, black_box_run
from upright.identification.model.runs import Run

DT = 0.01


def oscillator(seed: int, *, seconds: float = 12.0, **about: object) -> Run:
    """A mass on a spring under steps of force held over 0.1 s, by scipy; exactly a difference equation of order 2."""
    t = np.arange(0, seconds, DT)
    u = np.repeat(np.random.default_rng(seed).normal(size=len(t) // 10 + 1), 10)[: len(t)]
    plant = StateSpace([[0, 1], [-30.0, -0.8]], [[0], [1.0]], [[1, 0]], [[0]])
    _, y, _ = lsim(plant, u, t, interp=False)
    base: dict[str, object] = {"label": f"run {seed}", "role": "fit", "t": t, "u": u[:, None], "y": y[:, None]}
    return Run(**(base | {"measured": ("x1",)} | about))


@pytest.mark.parametrize("horizon", [None, 0.5])
def test_a_linear_plant_is_predicted_exactly(horizon: float | None) -> None:
    seen, asked = oscillator(1), oscillator(2, horizon=horizon, role="predict")
    assert black_box([seen], asked, period=20 * DT)["x1"] == pytest.approx(100, abs=1e-3)


def test_what_it_cannot_know_is_not_predicted() -> None:
    """White noise has no past: no equation does better than its mean."""
    g = np.random.default_rng(5)
    seen, asked = (oscillator(k) for k in (1, 2))
    noise = [Run(label=r.label, role="fit", t=r.t, u=0 * r.u, y=g.normal(size=r.y.shape), measured=("x1",))
             for r in (seen, asked)]  # fmt: skip
    assert black_box(noise[:1], noise[1], period=1.0)["x1"] == pytest.approx(0, abs=5)


def test_held_motion_drives_it_and_is_not_predicted() -> None:
    """A mass on a spring whose other end is moved: the end's motion is an input."""

    def pulled(seed: int) -> Run:
        r = oscillator(seed)
        end = r.u[:, 0] / 30.0
        return Run(
            label=r.label, role="fit", t=r.t, u=0 * r.u, y=np.hstack([end[:, None], r.y]), measured=("x1", "x2"),
            held={"x1": end},
        )  # fmt: skip

    found = black_box([pulled(1)], pulled(2), period=20 * DT)
    assert found.keys() == {"x2"}
    assert found["x2"] == pytest.approx(100, abs=1e-3)


def test_runs_that_are_not_alike_are_passed_over() -> None:
    asked = oscillator(2, role="predict")
    other = oscillator(1, measured=("x2",))
    short = oscillator(3, seconds=0.02)
    assert black_box([other, short], asked, period=1.0) == {}


def test_what_drives_is_the_mean_over_the_step_ahead_of_commands_and_of_what_is_held() -> None:
    """By hand: steps of two samples; past the end the mean counts what is there over the whole step."""
    y = np.array([[1.0, 10.0, 5.0], [2.0, 20.0, 6.0], [3.0, 40.0, 7.0], [4.0, 80.0, 8.0]])
    run = Run(label="a", role="fit", t=DT * np.arange(4), u=np.array([[0.0], [2.0], [4.0], [8.0]]), y=y,
              measured=("x1", "x2", "x3"), held={"x2": y[:, 1], "x3": y[:, 2]})  # fmt: skip
    found = _sampled(run, 2 * DT)
    assert found is not None
    assert found.stride == 2
    assert found.y.tolist() == y[:, [0]].tolist()
    assert found.w == pytest.approx(np.array([[1.0, 15.0, 5.5], [3.0, 30.0, 6.5], [6.0, 60.0, 7.5], [4.0, 40.0, 4.0]]))


@pytest.mark.parametrize(("step", "fits"), [(2.0, True), (2.015, True), (2.03, False), (2.5, False), (3.0, False)])
def test_a_run_fits_a_step_of_whole_samples_to_one_percent_that_it_holds_twice(step: float, fits: bool) -> None:
    run = Run(label="a", role="fit", t=DT * np.arange(5), u=np.zeros((5, 1)), y=np.zeros((5, 1)), measured=("x1",))
    assert (_sampled(run, step * DT) is not None) is fits


def left(measured: np.ndarray, foreseen: np.ndarray) -> float:
    """Fit percent as it is defined: 100 for all, 0 for the mean's."""
    return 100 * (1 - np.linalg.norm(measured - foreseen) / np.linalg.norm(measured - measured.mean()))


@pytest.mark.parametrize("stride", [1, 2])
def test_exactly_so_many_steps_ahead_only_the_last_of_them_counts_from_every_origin(stride: int) -> None:
    """By hand: an equation that says "as now" misses a signal by what changes in three steps, from each origin."""
    y = np.cumsum(np.arange(12.0))[:, None]
    still = np.array([[0.0], [1.0], [0.0]])  # of one, y and the command
    paced = Paced(y=y, w=np.zeros((12, 1)), stride=stride)
    ahead, every = 3 * stride, np.arange(0, 12 - 3 * stride, stride)
    found = _percents(still, 1, paced, 3, exactly=True)
    assert found == {0: pytest.approx(left(y[every + ahead, 0], y[every, 0]))}
    skipped = every[every + ahead >= 8]
    found = _percents(still, 1, paced, 3, 8.0, exactly=True)
    assert found == {0: pytest.approx(left(y[skipped + ahead, 0], y[skipped, 0]))}


def test_windows_laid_end_to_end_count_all_their_steps_and_without_them_the_whole_run() -> None:
    y = np.cumsum(np.arange(12.0))[:, None]
    still = np.array([[0.0], [1.0], [0.0]])
    paced = Paced(y=y, w=np.zeros((12, 1)), stride=1)
    begun = np.repeat([0, 3, 6], 3)  # a fourth window would end behind the run
    at = np.arange(1, 10)
    assert _percents(still, 1, paced, 3) == {0: pytest.approx(left(y[at, 0], y[begun, 0]))}
    assert _percents(still, 1, paced, 3, 5.0) == {0: pytest.approx(left(y[at[4:], 0], y[begun[4:], 0]))}
    assert _percents(still, 1, paced, None) == {0: pytest.approx(left(y[1:, 0], np.zeros(11)))}
    assert _percents(still, 1, paced, 3, 12.0) == {}
    assert _percents(still, 1, paced, 12) == {0: -1000.0}  # no window fits


def test_an_equation_that_is_linear_is_predicted_exactly_from_what_was_seen():
    """A damped oscillation under a held command obeys a difference equation of second order exactly."""
    t = np.arange(0, 20, 0.05)
    y = np.exp(-0.2 * t) * np.cos(3 * t) + 0.1
    run = Run(label="swing", role="predict", t=t, u=np.zeros((t.size, 1)), y=y[:, None], measured=("theta",))
    seen = run.samples(slice(0, 200))
    rest = replace(run.samples(slice(150, None)), score_from=t[200] - t[150])
    score = black_box_run(seen, rest, period=2 * np.pi / 3)
    np.testing.assert_allclose(score.simulated, score.y, atol=1e-8)
    assert score.t[0] > t[200]
    assert score.fit_percent["theta"] == pytest.approx(100, abs=1e-4)
