"""Does a picture show what is in the data, on a screen and on grey paper?"""

import sys

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upright.report.drawing import CYCLE, broken, decimated, save, svg
from upright.report.fit.figures import autocorrelation, fit_figure
from upright.report.symbols import axis, measured, number, percent, plain, unit


@given(st.integers(2, 20_000), st.integers(0, 100))
def test_thinning_keeps_first_last_least_and_greatest(n, seed):
    y = np.random.default_rng(seed).normal(size=n)
    t = np.arange(n) * 0.01
    few_t, few_y = decimated(t, y, 100)
    assert few_t.size <= 302
    assert (few_t[0], few_t[-1]) == (t[0], t[-1])
    assert (few_y.min(), few_y.max()) == (y.min(), y.max())
    assert np.all(np.diff(few_t) > 0)


def test_a_restarted_prediction_is_broken_at_each_restart():
    t = np.arange(0, 2, 0.1)
    _, y = broken(t, np.ones_like(t), 0.5)
    assert np.isnan(y).sum() == 3
    assert not np.isnan(broken(t, np.ones_like(t), None)[1]).any()


def test_autocorrelation_of_white_noise_stays_in_its_band():
    rest = np.random.default_rng(1).normal(size=4000)
    r = autocorrelation(rest, 400)
    assert r[0] == pytest.approx(1)
    outside = np.mean(np.abs(r[1:]) > 1.96 / np.sqrt(4000))
    assert 0.01 < outside < 0.10  # 5 % of 400 lags, binomial


def test_autocorrelation_of_a_first_order_process_is_a_power():
    rng = np.random.default_rng(2)
    rest = np.zeros(200_000)
    noise = rng.normal(size=rest.size)
    for i in range(1, rest.size):
        rest[i] = 0.8 * rest[i - 1] + noise[i]
    assert autocorrelation(rest, 5) == pytest.approx(0.8 ** np.arange(6), abs=0.02)


def test_autocorrelation_agrees_with_its_definition():
    rest = np.random.default_rng(3).normal(size=50)
    centred = rest - rest.mean()
    direct = [centred[: 50 - k] @ centred[k:] / (centred @ centred) for k in range(10)]
    assert autocorrelation(rest, 9) == pytest.approx(direct, abs=1e-12)


def test_a_constant_residual_has_no_correlation_to_speak_of():
    assert not autocorrelation(np.full(10, 3.0), 4).any()


def test_curves_differ_in_line_style_too():
    assert len({str(line) for _, line in CYCLE}) == len(CYCLE)


def test_drawing_leaves_matplotlib_as_it_was_and_opens_no_window(swing):
    before = dict(matplotlib.rcParams)
    svg(fit_figure(swing(n=100)), "x")
    assert dict(matplotlib.rcParams) == before
    assert not sys.modules.get("matplotlib.pyplot") or not sys.modules["matplotlib.pyplot"].get_fignums()


@pytest.mark.parametrize(("ending", "begins"), [(".svg", b"<?xml"), (".png", b"\x89PNG")])
def test_a_figure_can_be_saved_by_itself(tmp_path, swing, ending, begins):
    path = save(fit_figure(swing(n=100), title="$x <b>"), tmp_path / f"new/figure{ending}")
    assert path.read_bytes().startswith(begins)


def test_axes_carry_the_plant_s_units(swing):
    from upright.physics import Furuta

    drawing = fit_figure(swing(n=100), Furuta)
    labels = [a.get_ylabel() for a in drawing.axes]
    assert labels[0] == "ψ [rad]"
    assert labels[2] == "θ [rad]"
    assert drawing.axes[-1].get_xlabel() == "time [s]"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1234.5678, "1235"), (0.00123456, "1.235·10⁻³"), (-2.5e-7, "−2.500·10⁻⁷"), (np.inf, "∞")],
)
def test_numbers_are_written_as_on_paper(value, text):
    assert number(value) == text


def test_a_value_shows_two_figures_of_its_error():
    assert measured(0.123456, 0.00123) == ("0.1235", "1.2·10⁻³")
    assert measured(1.0, np.inf)[1] == "∞"


def test_units_and_symbols_are_those_of_the_paper():
    assert unit("kg m^2") == "kg m²"
    assert unit("1") == ""
    assert axis("θ", "rad") == "θ [rad]"
    assert plain("theta_dot") == "θ̇"
    assert percent(-123.456) == "−123.5 %"


def test_a_notebook_can_show_any_drawing(swing):
    """Jupyter asks the last value of a cell for this method."""
    from upright.physics import Furuta

    assert fit_figure(swing(n=100), Furuta)._repr_png_().startswith(b"\x89PNG")
