"""Does a picture show what is in the data, on a screen and on grey paper?"""

import math
import re
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from upright.errors import BadInput
from upright.report.drawing import (
    CYCLE,
    WIDTH,
    Poles,
    broken,
    decimated,
    figure,
    locus_figure,
    picture_format,
    pole_map,
    save,
    svg,
    swing_figure,
)
from upright.report.fit.figures import autocorrelation, fit_figure
from upright.report.symbols import axis, identifier, mathtext, number, percent, plain, slanted, typed, unit, with_error


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
    assert with_error(0.123456, 0.00123) == ("0.1235", "1.2·10⁻³")
    assert with_error(1.0, np.inf)[1] == "∞"


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


@pytest.mark.parametrize(("n", "thinned"), [(30, False), (31, True)])
def test_a_curve_is_thinned_from_three_samples_a_bucket_on(n, thinned):
    """Ten buckets keep two each, and the first and the last."""
    t, y = np.arange(n) * 0.1, np.sin(np.arange(n) * 2.0)
    few_t, few_y = decimated(t, y, 10)
    assert (few_t.size < n) == thinned
    assert few_t.size <= 22 or not thinned
    np.testing.assert_array_equal(few_y, np.interp(few_t, t, y))


def test_a_gap_stands_at_the_first_sample_after_each_restart():
    t, y = broken(np.array([5.0, 6.0, 7.0, 8.0]), np.array([1.0, 2.0, 3.0, 4.0]), 2.0)
    np.testing.assert_array_equal(t, [5, 6, 7, 7, 8])
    np.testing.assert_array_equal(y, [1, 2, np.nan, 3, 4])
    one = broken(np.array([5.0]), np.array([1.0]), 2.0)
    assert [v.tolist() for v in one] == [[5.0], [1.0]]
    two = broken(np.array([0.0, 1.0]), np.array([1.0, 2.0]), 1.0)
    np.testing.assert_array_equal(two[1], [1, np.nan, 2])


def test_margins_are_inches_on_paper():
    drawing = figure(4.0, 8.0, margins=(1.0, 0.8, 0.4, 0.5))
    area = drawing.add_subplot().get_position()
    assert (area.x0, area.x1, area.y0, area.y1) == pytest.approx((1 / 8, 1 - 0.1, 0.5 / 4, 1 - 0.1))
    assert tuple(figure(3.0).get_size_inches()) == (WIDTH, 3.0)


def test_markup_in_a_page_has_ids_of_its_own_and_is_as_wide_as_it_was_drawn():
    drawing = figure(1.0, WIDTH / 2)
    drawing.add_subplot().plot([0, 1], [0, 1.23456789])
    text = svg(drawing, "pic")
    assert 'style="max-width:50%"' in text
    assert 'id="pic-' in text
    assert " width=" not in text[: text.index(">")]
    assert "viewBox" in text
    assert not re.search(r' d="[^"]*\.\d\d\d', text)
    assert 'style="max-width:100%"' in svg(figure(1.0, 2 * WIDTH), "wide")


@pytest.mark.parametrize(("name", "form"), [("a.svg", "svg"), ("b.PNG", "png")])
def test_a_picture_s_format_is_its_ending(name, form):
    assert picture_format(Path(name)) == form


def test_a_picture_of_another_format_is_refused():
    with pytest.raises(BadInput, match=r"ending in .svg or .png, got 'a.pdf'"):
        picture_format(Path("a.pdf"))


def points(axes):
    """What has a name, as pairs of real and imaginary part, sorted."""
    return {
        line.get_label(): sorted(zip(line.get_xdata(), line.get_ydata(), strict=True))
        for line in axes.lines if not str(line.get_label()).startswith("_")
    }  # fmt: skip


def poles(name, *values, mark="x"):
    return Poles(name=name, values=np.array(values, dtype=complex), mark=mark, colour="#000000")


def test_a_map_of_poles_holds_its_first_two_kinds_and_counts_what_lies_outside():
    kinds = [poles("open", 2.0, -3.0), poles("asked", -10 + 4j, -10 - 4j, mark="o"),
             poles("fast", -14.0, -12.9, 2.7, 3 + 1j, -5 + 6j, -5 - 6j, mark="+")]  # fmt: skip
    (axes,) = pole_map(kinds, np.array([-1 + 2j])).axes
    # 1.3 times the farthest; upwards at least a quarter of the width, 0.25 x 15.6 = 3.9 < 4
    assert axes.get_xlim() == pytest.approx((-13.0, 2.6))
    assert axes.get_ylim() == pytest.approx((-5.2, 5.2))
    # outside: -14, 2.7, 3 + j, -5 +- 6 j
    assert axes.get_xlabel() == "real part [1/s]; 5 faster ones outside the picture"
    assert axes.get_ylabel() == "imaginary part [rad/s]"
    assert points(axes) == {
        "rigs that the fit allows": [(-1, 2)], "open": [(-3, 0), (2, 0)], "asked": [(-10, -4), (-10, 4)],
        "fast": [(-14, 0), (-12.9, 0), (-5, -6), (-5, 6), (2.7, 0), (3, 1)],
    }  # fmt: skip
    # on the edge is inside
    assert pole_map([*kinds[:2], poles("edge", -13.0, 2.6)]).axes[0].get_xlabel() == "real part [1/s]"
    (stable,) = axes.patches
    assert (stable.get_x(), stable.get_x() + stable.get_width()) == pytest.approx((-13.0, 0.0))
    fills = {line.get_label(): line.get_markerfacecolor() for line in axes.lines}
    assert fills["asked"] == "none" != fills["open"]


def test_a_map_of_slow_real_poles_is_still_a_plane():
    (axes,) = pole_map([poles("slow", -0.2, 0.1)]).axes
    assert axes.get_xlim() == pytest.approx((-1.3, 1.3))
    assert axes.get_ylim() == pytest.approx((-1.3 * 0.25 * 2.6, 1.3 * 0.25 * 2.6))
    assert axes.get_xlabel() == "real part [1/s]"
    (one,) = pole_map([poles("a", -1.0), poles("b", -1.0), poles("c", -4.0)]).axes
    assert one.get_xlabel().endswith("; 1 faster one outside the picture")
    (three,) = pole_map([poles("a", -1.0), poles("b", -1.0), poles("c", -4.0)], frame=3).axes
    assert three.get_xlim()[0] == pytest.approx(-5.2)


def test_a_motion_stands_above_its_command_between_the_limits():
    t, u = np.linspace(0, 2, 5), np.array([0.0, 6.0, -7.0, 3.0, 0.0])
    shown = {"x": (t**2, "m"), "theta": (1 - t, "rad")}
    drawing = swing_figure(t, shown, u, "V", 5.0)
    assert [a.get_ylabel() for a in drawing.axes] == ["$x$ [m]", "$θ$ [rad]", "command [V]"]
    assert [a.get_xlabel() for a in drawing.axes] == ["", "", "time [s]"]
    for axes, values in zip(drawing.axes, (t**2, 1 - t, u), strict=True):
        np.testing.assert_array_equal(axes.lines[0].get_data(), (t, values))
    last = drawing.axes[-1]
    assert sorted(line.get_ydata()[0] for line in last.lines[1:]) == [-5.0, 5.0]
    (word,) = last.texts
    assert (word.get_text().strip(), word.get_position()) == ("limit", (2.0, 5.0))
    assert last.get_ylim() == pytest.approx((-8.75, 8.75))  # a quarter more than the larger of limit and command
    assert swing_figure(t, shown, 0.1 * u, "V", 5.0).axes[-1].get_ylim() == pytest.approx((-6.25, 6.25))
    assert len(swing_figure(t, shown, u, "V", None).axes[-1].lines) == 1


def test_poles_of_least_cost_are_drawn_in_the_upper_half_with_those_that_were_chosen():
    tracks = np.array([[-1 + 1j, -1 - 1j], [-2 + 3j, -2 - 3j]])
    sets = {"set 1": np.array([-4 + 2j, -4 - 2j]), "set 2": np.array([-6.0 + 0j, -5.0])}
    (axes,) = locus_figure(tracks, sets, np.array([4.0 + 0j, -2 + 1j, -2 - 1j]), origin="open loop, recovered").axes
    assert points(axes) == {
        "LQR poles as effort gets cheaper": [(-2, 3), (-1, 1)], "open loop, recovered": [(-2, 1), (4, 0)],
        "set 1": [(-4, 2)], "set 2": [(-6, 0), (-5, 0)],
    }  # fmt: skip
    marks = {line.get_label(): line.get_marker() for line in axes.lines}
    assert (marks["set 1"], marks["set 2"], marks["open loop, recovered"]) == ("o", "s", "x")
    assert axes.get_xlim() == pytest.approx((-6 - 0.8, 4 + 0.8))  # 8 % of the width beside the poles
    low, high = axes.get_ylim()
    assert low < 0 < 2 < high < 3
    (real,) = locus_figure(np.array([[-1.0 + 0j]]), {"set": np.array([-10.0 + 0j])}, np.array([0j])).axes
    assert real.get_ylim()[1] == pytest.approx(1.15)  # a tenth of the width, when every pole is real
    assert (real.get_xlabel(), real.get_ylabel()) == ("real part [1/s]", "imaginary part [rad/s]")


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.001, 2, "1.0·10⁻³"), (0.01, 2, "0.010"), (999999.0, 4, "999999"),
        (1e6, 4, "1.000·10⁶"), (-1.5, 2, "−1.5"), (12.0, 1, "12"), (math.nan, 4, "not known"), (-math.inf, 4, "−∞"),
        (-3e-10, 1, "−3·10⁻¹⁰"),
    ],
)  # fmt: skip
def test_powers_of_ten_are_written_out_below_a_hundredth_and_from_a_million_on(value, digits, text):
    assert number(value, digits) == text


@pytest.mark.parametrize(
    ("name", "written", "drawn"),
    [
        ("theta", "θ", "$θ$"), ("theta_dot", "θ̇", r"$\dot{θ}$"), ("theta1_dot", "θ̇1", r"$\dot{θ}_{\mathrm{1}}$"),
        ("b_1c", "b_1c", r"$b_{\mathrm{1c}}$"), ("x_2", "x2", r"$x_{\mathrm{2}}$"),
        ("tilt_x", "tilt_x", r"$\mathrm{tilt}_{\mathrm{x}}$"), ("theta_2_dot", "θ̇2", r"$\dot{θ}_{\mathrm{2}}$"),
        ("price $", "price $", r"price \$"),
    ],
)  # fmt: skip
def test_symbols_are_written_and_drawn_with_greek_letters_dots_and_subscripts(name, written, drawn):
    assert (plain(name), mathtext(name)) == (written, drawn)


def test_markup_of_a_symbol_raises_its_power_and_lowers_its_index():
    assert identifier("J_p") == "<msub><mi>J</mi><mtext>p</mtext></msub>"
    assert identifier("J_p", "<mn>2</mn>") == "<msubsup><mi>J</mi><mtext>p</mtext><mn>2</mn></msubsup>"
    assert identifier("r", "<mn>2</mn>") == "<msup><mi>r</mi><mn>2</mn></msup>"
    assert identifier("gap") == '<mi mathvariant="normal">gap</mi>'
    assert identifier("x_dot") == "<mover><mi>x</mi><mo>˙</mo></mover>"
    assert identifier("x_ddot") == "<mover><mi>x</mi><mo>¨</mo></mover>"


@pytest.mark.parametrize(
    ("value", "text"), [(99.0, "99.0 %"), (99.01, "99.01 %"), (0.0, "0.0 %"), (math.nan, "not known")]
)
def test_a_percent_has_two_places_above_ninety_nine(value, text):
    assert percent(value) == text


@pytest.mark.parametrize(
    ("raised", "text"), [("m/s^2", "m/s²"), ("kg**2", "kg²"), ("s^-1", "s⁻¹"), ("N*m", "N·m"), ("", ""), ("1", "")]
)
def test_powers_of_a_unit_are_raised(raised, text):
    assert unit(raised) == text


@pytest.mark.parametrize(
    ("path", "shown"),
    [("a/b-1.csv", "a/b-1.csv"), ("my log.csv", '"my log.csv"'), ("a$b.csv", "'a$b.csv'"), ("a b`c", "'a b`c'")],
)
def test_a_path_is_quoted_where_a_shell_would_read_it(path, shown):
    assert typed(path) == shown


def test_an_error_of_zero_is_a_dash():
    assert with_error(2.0, 0.0) == ("2.000", "–")


def test_a_symbol_of_a_page_is_text_with_an_upright_subscript():
    assert slanted("J_d") == "<i>J<sub>d</sub></i>"
    assert slanted("theta_dot") == "<i>θ\u0307</i>"
    assert slanted("a<b") == "<span>a&lt;b</span>"
