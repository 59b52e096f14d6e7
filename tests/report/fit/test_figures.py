"""Does every picture of a fit show what its axes say, at the places that the numbers have?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.identification import Estimate, RunScore
from upright.physics import Furuta
from upright.report.drawing import BLUE, GREY, VERMILLION
from upright.report.fit.figures import (
    autocorrelation_figure,
    directions_figure,
    fit_figure,
    interval_figure,
)

T = np.array([2.0, 3.0, 4.0, 6.0])
Y = np.array([[1.0, 20.0], [2.0, 10.0], [3.0, 0.0], [5.0, -10.0]])
OFF = np.array([[0.1, -1.0], [0.2, -2.0], [-0.3, 3.0], [0.4, 4.0]])
SCORE = RunScore(
    role="fit", fit_percent={"psi": 91.0, "theta": 82.0}, horizon=None, t=T, y=Y, simulated=Y - OFF,
    measured=("psi", "theta"),
)  # fmt: skip


def curve(line):
    return np.array(line.get_xdata(), dtype=float), np.array(line.get_ydata(), dtype=float)


def test_each_signal_stands_over_time_beside_its_model_and_above_its_residual():
    drawing = fit_figure(SCORE, Furuta, title="a" * 71)
    assert len(drawing.axes) == 4
    for j, (label, fit) in enumerate((("ψ [rad]", "fit 91.0 %"), ("θ [rad]", "fit 82.0 %"))):
        above, below = drawing.axes[2 * j : 2 * j + 2]
        lines = {line.get_label(): curve(line) for line in above.lines}
        np.testing.assert_array_equal(lines["measured"], (T, Y[:, j]))
        np.testing.assert_array_equal(lines["model"], (T, Y[:, j] - OFF[:, j]))
        zero, residual = below.lines
        np.testing.assert_array_equal(zero.get_ydata(), [0, 0])
        np.testing.assert_allclose(curve(residual), (T, OFF[:, j]), atol=1e-12)
        assert (above.get_ylabel(), above.get_title(loc="right"), below.get_ylabel()) == (label, fit, "residual")
        for panel, values in ((above, np.r_[Y[:, j], Y[:, j] - OFF[:, j]]), (below, OFF[:, j])):
            low, high = panel.get_ylim()  # all of it, and hardly more
            room = 0.1 * np.ptp(values)
            assert values.min() - room < low < values.min()
            assert values.max() < high < values.max() + room
    assert drawing.axes[0].get_xlim() == (2.0, 6.0)
    assert [a.get_xlabel() for a in drawing.axes] == ["", "", "", "time [s]"]
    assert drawing.axes[0].get_title(loc="left") == "a" * 69 + "…"
    assert [text.get_text() for text in drawing.legends[0].get_texts()] == ["measured", "model"]


def test_a_title_of_seventy_letters_is_whole_and_a_signal_of_no_plant_has_no_unit():
    drawing = fit_figure(SCORE, title="a" * 70)
    assert drawing.axes[0].get_title(loc="left") == "a" * 70
    assert drawing.axes[0].get_ylabel() == "ψ"


def test_the_model_is_broken_where_it_was_restarted_but_not_where_every_sample_was_predicted():
    restarted = fit_figure(replace(SCORE, horizon=2.0)).axes[0].lines[1]
    np.testing.assert_array_equal(restarted.get_xdata(), [2, 3, 4, 4, 6, 6])
    assert np.flatnonzero(np.isnan(restarted.get_ydata())).tolist() == [2, 4]
    ahead = replace(SCORE, horizon=2.0, ahead={2.0: {"psi": 91.0}})
    assert np.isfinite(fit_figure(ahead).axes[0].lines[1].get_ydata()).all()


def test_what_is_not_scored_is_shaded_from_the_first_sample_on():
    assert not fit_figure(SCORE).axes[0].patches
    for panel in fit_figure(replace(SCORE, score_from=1.5)).axes:
        (shade,) = panel.patches
        assert (shade.get_x(), shade.get_x() + shade.get_width()) == (2.0, 3.5)


def test_one_sample_that_ran_away_does_not_flatten_the_rest():
    """The picture ends one width of the data beyond them, plus a margin of 6 %."""
    t = np.linspace(0, 1, 2001)
    y = np.sin(40 * t)[:, None]
    model = y.copy()
    model[1000], model[1001] = 1e30, np.nan
    wild = replace(SCORE, t=t, y=y, simulated=model, measured=("theta",))
    low, high = fit_figure(wild).axes[0].get_ylim()
    assert low == pytest.approx(-1 - 0.12, abs=0.01)
    assert high == pytest.approx(1 + 2 + 0.12, abs=0.01)
    low, high = fit_figure(replace(wild, y=-y, simulated=-model)).axes[0].get_ylim()
    assert (low, high) == pytest.approx((-3.12, 1.12), abs=0.01)


@pytest.mark.parametrize("value", [0.0, 5.0, -400.0])
def test_a_constant_stands_in_the_middle_of_an_axis_of_some_height(value):
    flat = np.full((4, 1), value)
    low, high = fit_figure(replace(SCORE, y=flat, simulated=flat, measured=("theta",))).axes[0].get_ylim()
    assert low < value < high
    assert high - value == pytest.approx(value - low)
    assert high - low < 1e-3 * max(abs(value), 1.0)


@pytest.mark.parametrize(("largest", "round_one"), [(0.16, 0.1), (0.27, 0.2), (1.6, 1.0), (4e-5, 2e-5), (0.5, 0.5)])
def test_the_ticks_of_a_residual_say_where_they_are(largest, round_one):
    y = np.zeros((4, 1))
    off = largest * np.array([[1.0], [-1.0], [0.3], [0.0]])
    panel = fit_figure(replace(SCORE, y=y, simulated=y - off, measured=("theta",))).axes[1]
    ticks = panel.yaxis.get_major_locator()()
    # 1, 2 or 5 of a decade, on either side: more would lie on one another
    assert list(ticks) == pytest.approx([-round_one, round_one])
    for at in ticks:
        said = panel.yaxis.get_major_formatter()(at).replace("−", "-").replace("·10", "e")
        said = said.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789"))
        assert float(said) == pytest.approx(at, rel=1e-9, abs=1e-15)


def test_a_residual_that_is_off_throughout_stands_off_from_zero():
    y = np.zeros((4, 1))
    off = np.array([[5.3], [5.4], [5.5], [5.6]])
    panel = fit_figure(replace(SCORE, y=y, simulated=y - off, measured=("theta",))).axes[1]
    assert panel.get_ylim()[0] < 0 < 5.6 < panel.get_ylim()[1]
    assert list(panel.yaxis.get_major_locator()()) == [5.0]


def alternating(n, start=2.0, step=0.01):
    """Residuals +1, -1, +1, ...: at lag k their correlation is (-1)^k (n - k)/n."""
    off = np.where(np.arange(n) % 2, -1.0, 1.0)
    return replace(SCORE, t=start + step * np.arange(n), y=np.column_stack([off, 3 * off]), simulated=np.zeros((n, 2)))


def test_correlations_stand_over_their_lag_in_seconds_with_the_band_of_white_noise():
    runs = {"release": alternating(1000), "b" * 27: alternating(400)}
    panels = autocorrelation_figure(runs).axes
    assert [p.get_title(loc="left") for p in panels] == [
        "release: ψ",
        "release: θ",
        "b" * 25 + "…: ψ",
        "b" * 25 + "…: θ",
    ]
    for panel, n in zip(panels, (1000, 1000, 400, 400), strict=True):
        lag, r = curve(panel.lines[-1])
        k = np.arange(n // 4 + 1)  # a quarter of the samples
        np.testing.assert_allclose(lag, 0.01 * k, atol=1e-12)
        np.testing.assert_allclose(r, (-1.0) ** k * (n - k) / n, atol=1e-12)
        (band,) = panel.patches
        assert (band.get_y(), band.get_y() + band.get_height()) == pytest.approx((-1.96 / n**0.5, 1.96 / n**0.5))
        assert panel.get_ylim()[0] < -1 < 1 < panel.get_ylim()[1]
        np.testing.assert_array_equal(panel.lines[0].get_ydata(), [0, 0])
    # three in a row: the fourth begins another; times below the last of each column, words before the first of a row
    assert [p.get_xlabel() for p in panels] == ["", "lag [s]", "lag [s]", "lag [s]"]
    assert [p.get_ylabel() for p in panels] == ["correlation", "", "", "correlation"]


@pytest.mark.parametrize(("n", "lags"), [(2000, 400), (19_999, 400), (20_000, 2000)])
def test_correlations_of_a_long_run_end_at_four_hundred_or_two_thousand_samples(n, lags):
    panel = autocorrelation_figure({"long": replace(alternating(n), measured=("psi",))}).axes[0]
    assert panel.lines[-1].get_xdata()[-1] == pytest.approx(0.01 * lags)


def estimate(value, low, high, status="well determined"):
    return Estimate(value=value, stderr=0.1, interval=(low, high), unit="kg", status=status)


ESTIMATES = {
    "m_p": estimate(2.0, 1.8, 2.4),
    "b_1": estimate(9.0, 8.0, 10.0, "known"),
    "tilt_x": estimate(-4.0, -5.0, -3.6, "poorly determined"),
    "b_2": estimate(0.0, 0.0, 1.0),
    "J_p": estimate(3.0, 0.0, math.inf, "poorly determined"),
}


def intervals(drawing, row):
    """Ends [%], place of the estimate [%], its mark, the arrows, and the colour of a row."""
    ax = drawing.axes[0]
    lines = [line for line in ax.lines if np.size(line.get_ydata()) and np.all(np.asarray(line.get_ydata()) == row)]
    bar = next(line for line in lines if np.size(line.get_xdata()) == 2)
    points = [line for line in lines if np.size(line.get_xdata()) == 1]
    marked = {line.get_marker(): float(np.ravel(line.get_xdata())[0]) for line in points}
    assert {line.get_color() for line in lines} == {bar.get_color()}
    return np.asarray(bar.get_xdata()).tolist(), marked, bar.get_color()


def test_an_interval_stands_in_percent_of_the_size_of_its_value():
    drawing = interval_figure(ESTIMATES)
    ax = drawing.axes[0]
    # known and zero have none; the farthest end that stays in the picture is J_p's, 100 % below, a quarter more shows
    assert [t.get_text() for t in ax.get_yticklabels()] == [
        "$m_{\\mathrm{p}}$  (well determined)", "$\\mathrm{tilt}_{\\mathrm{x}}$  (poorly determined)",
        "$J_{\\mathrm{p}}$  (poorly determined)",
    ]  # fmt: skip
    assert ax.get_xlim() == pytest.approx((-125.0, 125.0))
    assert ax.get_ylim() == (2.5, -0.5)
    assert ax.get_xlabel() == "95 % interval relative to the estimate [%]"
    ends, marks, colour = intervals(drawing, 0)
    assert ends == pytest.approx([-10.0, 20.0])
    assert (marks, colour) == ({"o": 0.0}, BLUE)
    ends, marks, colour = intervals(drawing, 1)
    assert ends == pytest.approx([-25.0, 10.0])
    assert (marks, colour) == ({"s": 0.0}, VERMILLION)
    ends, marks, colour = intervals(drawing, 2)
    assert ends == pytest.approx([-100.0, 125.0])
    assert (marks, colour) == ({"s": 0.0, ">": 125.0}, VERMILLION)
    assert [line.get_color() for line in ax.lines if np.ravel(line.get_xdata()).tolist() == [0, 0]] == [GREY]


def test_what_lies_far_below_is_an_arrow_to_the_left_and_no_picture_is_wider_than_its_value_and_a_half():
    far = {"m_p": estimate(1.0, -9.0, 9.0), "J_p": estimate(1.0, -0.3, 1.4)}
    drawing = interval_figure(far)
    assert drawing.axes[0].get_xlim() == (-150.0, 150.0)
    ends, marks, _ = intervals(drawing, 0)
    assert (ends, marks) == ([-150.0, 150.0], {"o": 0.0, "<": -150.0, ">": 150.0})
    assert interval_figure({"m_p": estimate(1.0, -9.0, 9.0)}).axes[0].get_xlim() == pytest.approx((-12.5, 12.5))


def test_beside_a_truth_everything_is_told_from_it_and_solid_is_what_holds_it():
    """tilt_x is -5 in truth: -4 lies 20 % of its size above, and so does its interval, from -4.5 to -3.5."""
    beside = ESTIMATES | {"tilt_x": estimate(-4.0, -4.5, -3.5), "b_2": estimate(1.0, 0.5, 2.0)}
    drawing = interval_figure(beside, truth={"m_p": 2.4, "tilt_x": -5.0, "b_2": 0.0})
    ax = drawing.axes[0]
    assert [t.get_text() for t in ax.get_yticklabels()] == ["$m_{\\mathrm{p}}$", "$\\mathrm{tilt}_{\\mathrm{x}}$"]
    assert ax.get_xlabel() == "estimate and 95 % interval, from the truth [%]"
    ends, marks, colour = intervals(drawing, 0)
    assert ends == pytest.approx([-25.0, 0.0])  # the interval ends at the truth, which is in it
    assert marks["o"] == pytest.approx(-100 / 6)
    assert colour == BLUE
    ends, marks, colour = intervals(drawing, 1)
    assert ends == pytest.approx([10.0, 30.0])
    assert marks["s"] == pytest.approx(20.0)
    assert colour == VERMILLION


def written(ax):
    return {(t.get_position()[0], t.get_position()[1]): (t.get_text(), t.get_weight()) for t in ax.texts}


def test_singular_values_stand_beside_the_combination_that_they_weigh(changed):
    shares = np.array([[0.8, -0.6, 0.09], [0.1, 0.0, -0.99], [0.6, 0.8, 0.05]])
    fit = changed(names=("m_p", "J_p", "b_1"), singular_values=np.array([4.0, 0.02, 0.0]), directions=shares)
    bars, mix = directions_figure(fit).axes
    assert written(mix) == {
        (0, 0): ("0.80", "normal"), (1, 0): ("−0.60", "normal"), (0, 1): ("0.10", "normal"),
        (2, 1): ("−0.99", "normal"), (0, 2): ("0.60", "normal"), (1, 2): ("0.80", "normal"),
    }  # fmt: skip
    np.testing.assert_array_equal(mix.collections[0].get_array().reshape(3, 3), shares)
    assert [t.get_text() for t in mix.get_xticklabels()] == [
        "$m_{\\mathrm{p}}$", "$J_{\\mathrm{p}}$", "$b_{\\mathrm{1}}$",
    ]  # fmt: skip
    # relative to the largest; what is zero stands at the left edge, a tenth of the smallest that is not
    disks = next(line for line in bars.lines if line.get_marker() == "o")
    np.testing.assert_allclose(disks.get_xdata(), [1.0, 5e-3, 5e-4])
    assert list(disks.get_ydata()) == [0, 1, 2]
    np.testing.assert_allclose([s[:, 0] for s in bars.collections[0].get_segments()],
                               [[5e-4, 1.0], [5e-4, 5e-3], [5e-4, 5e-4]])  # fmt: skip
    assert [(a.get_text(), *a.xy) for a in bars.texts] == [
        ("1.0", 1.0, 0), ("5.0·10⁻³", 5e-3, 1), ("0", 5e-4, 2),
    ]  # fmt: skip
    assert bars.get_xscale() == "log"
    assert bars.get_xlim()[0] == pytest.approx(5e-4)
    assert bars.get_xlim()[1] > 1
    assert bars.get_ylim() == (2.5, -0.5)
    assert [t.get_text() for t in bars.get_yticklabels()] == ["1", "2", "3"]
    assert [1e-6, 1e-6] in [np.ravel(line.get_xdata()).tolist() for line in bars.lines]


def test_where_the_data_say_nothing_every_bar_is_at_the_edge(changed):
    bars, _ = directions_figure(changed(names=("m_p",), singular_values=np.zeros(1), directions=np.eye(1))).axes
    assert [a.get_text() for a in bars.texts] == ["0"]
    tiny = directions_figure(changed(names=("m_p", "J_p"), singular_values=np.array([1.0, 1e-20]),
                                     directions=np.eye(2))).axes[0]  # fmt: skip
    assert tiny.get_xlim()[0] == pytest.approx(1e-17)


def test_the_path_of_a_search_is_drawn_relative_to_the_estimates(changed):
    from upright.report.fit.figures import path_figure
    from upright.report.fit.interactive import search_path

    values = ({"J_p": 2.2e-3}, {"J_p": 1.1e-3, "J_d": 6.3e-3})
    fit = changed(path=tuple(zip((4.0, 0.5), values, strict=True)))
    cost, relative = search_path(fit)
    assert cost.tolist() == [4.0, 0.5]
    assert relative["J_p"] == pytest.approx([2.0, 1.0])
    assert relative["J_d"] == pytest.approx([np.nan, 1.0], nan_ok=True)
    above, below = path_figure(cost, relative).axes
    assert above.lines[0].get_ydata().tolist() == [4.0, 0.5]
    assert len(below.lines) == 6
