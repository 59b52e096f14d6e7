"""Does a picture show what is in the data, on a screen and on grey paper?"""

import itertools
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
    broken,
    decimated,
    figure,
    narrowed,
    picture_format,
    save,
    svg,
)
from upright.report.fit.figures import autocorrelation, fit_figure
from upright.report.symbols import axis, number, percent, plain, unit, with_error


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


def test_markup_in_a_page_is_well_formed_where_groups_are_empty_too():
    """An axis without labels and a curve without points are empty groups."""
    from xml.etree import ElementTree

    drawing = figure(1.0)
    ax = drawing.add_subplot()
    ax.plot([], [])
    ax.scatter([], [])
    ax.fill_between([], [], [])
    text = svg(drawing, "a").replace("<svg", '<svg xmlns:xlink="http://www.w3.org/1999/xlink"', 1)
    assert ElementTree.fromstring(text).tag == "svg"


def places(path: str) -> np.ndarray:
    """Points of a path of straight lines, by the rules of SVG: M and L absolute, l relative."""
    here, points, command = np.zeros(2), [], ""
    words = iter(re.findall(r"[a-zA-Z]|-?(?:\d+\.?\d*|\.\d+)", path))
    for word in words:
        if word.isalpha():
            command = word
            continue
        place = np.array([float(word), float(next(words))])
        here = here + place if command == "l" else place
        command = "l" if command == "l" else "L"
        points.append(here)
    return np.array(points)


def test_a_curve_in_a_page_lies_where_matplotlib_puts_it_to_a_hundredth_of_a_point():
    """However many places are counted one from the other, rounding does not add up."""
    t = np.linspace(0, 10, 300)
    y = np.random.default_rng(4).uniform(1, 2, size=t.size) * (-1) ** np.arange(t.size)  # no place between two others
    drawing = figure(2.0, margins=(0.8, 0.2, 0.3, 0.5))
    ax = drawing.add_subplot()
    ax.plot(t, y)
    drawn = max(re.findall(r' d="([^"]*)"', svg(drawing, "a")), key=len)
    at = ax.transData.transform(np.column_stack([t, y])) * 72 / drawing.dpi
    expected = np.column_stack([at[:, 0], 72 * 2.0 - at[:, 1]])
    np.testing.assert_allclose(places(drawn)[: t.size], expected, rtol=0, atol=0.0051)


@pytest.mark.parametrize(("name", "form"), [("a.svg", "svg"), ("b.PNG", "png")])
def test_a_picture_s_format_is_its_ending(name, form):
    assert picture_format(Path(name)) == form


def test_a_picture_of_another_format_is_refused():
    with pytest.raises(BadInput, match=r"ending in .svg or .png, got 'a.pdf'"):
        picture_format(Path("a.pdf"))


def test_on_a_phone_panels_stand_below_one_another_and_every_letter_can_be_read():
    """Shown 328 px wide, letters are at least 10 px high, and no text leaves the picture."""
    drawing = figure(3.0)
    for k, axes in enumerate(drawing.subplots(1, 3, sharey=True)):
        axes.plot([0.0, 1.0], [0.0, k])
        axes.set_title("a title that says at length what is to be seen here and why")
        axes.set_xlabel("time [s]")
    drawing.axes[0].set_yticks([0.0, 1.0], ["The class helped me to understand feedback", "agree"])
    assert narrowed(drawing)
    drawing.draw_without_rendering()
    width, height = drawing.bbox.size
    boxes = [axes.get_tightbbox() for axes in drawing.axes]
    assert [box.y0 for box in boxes] == sorted((box.y0 for box in boxes), reverse=True)
    for box, below in itertools.pairwise(boxes):
        assert below.y1 <= box.y0
    for box in boxes:
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) > -1  # px
    view = [float(v) for v in re.search(r'viewBox="([^"]*)"', svg(drawing, "x"))[1].split()]
    sizes = [float(v) for v in re.findall(r"\bfont(?:-size)?:[^;\"]*?([\d.]+)px", svg(drawing, "x"))]
    assert min(sizes) * 328 / view[2] > 10


def test_a_figure_that_fits_a_phone_is_left_as_it_is():
    assert not narrowed(figure(2.0, 3.5))
