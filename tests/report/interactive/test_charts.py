"""Do charts put values where their axes say, in text that a phone shows and an SVG that a PDF takes?"""

from __future__ import annotations

import json
import re
from itertools import pairwise

import numpy as np
import pytest

from tests.report.interactive.drawn import circles, curve, drawings
from upright.report.interactive.charts import WIDTHS, Chart, ChartLine, ChartPanel, _needed, decade_ticks, round_ticks

T = np.linspace(0.0, 2.0, 101)
SINE = ChartLine(name="sine", x=T, y=3.0 * np.sin(T), colour="q0")
POINTS = ChartLine(name="points", x=np.array([0.5, 1.5]), y=np.array([-1.0, 2.0]), mark="o", colour="q1")


def chart(*lines, **how):
    return Chart(
        x="time", unit="s", panels=(ChartPanel(title="angle", unit="rad", lines=lines or (SINE, POINTS), **how),)
    )


def test_a_curve_and_its_points_lie_where_the_axes_say():
    drawn = chart()
    x, y = curve(drawn, 0, "--q0")
    np.testing.assert_allclose(y, 3.0 * np.sin(x), atol=0.05)  # a tenth of a unit of 150 is 0.003 of 4.3 rad
    np.testing.assert_allclose(circles(drawn, 0, "--q1"), [[0.5, -1.0], [1.5, 2.0]], atol=5e-3)


def test_logarithmic_axes_take_the_logarithm():
    w = np.geomspace(1.0, 100.0, 50)
    line = ChartLine(name="", x=w, y=1e3 / w**2, colour="q0")
    drawn = Chart(x="frequency", panels=(ChartPanel(title="gain", lines=(line,), logarithmic=True),), logarithmic=True)
    x, y = curve(drawn, 0, "--q0")
    np.testing.assert_allclose(x[[0, -1]], [1.0, 100.0], rtol=0.01)
    np.testing.assert_allclose(x**2 * y, 1e3, rtol=0.02)


@pytest.mark.parametrize(("low", "high", "most"), [(0.0, 1.0, 5), (-3.2, 7.9, 4), (1e-4, 9e-4, 6), (-1e6, 2e6, 3)])
def test_ticks_are_few_round_and_within(low, high, most):
    at = np.array(round_ticks(low, high, most))
    steps = np.diff(at)
    assert 2 <= at.size <= most + 1
    assert low <= at.min()
    assert at.max() <= high
    digit = steps[0] / 10 ** np.floor(np.log10(steps[0]) + 1e-9)
    assert min(abs(digit - d) for d in (1, 2, 5)) < 1e-9
    np.testing.assert_allclose(steps, steps[0])


def test_decades_are_labelled_at_one_two_and_five_where_there_is_room():
    assert decade_ticks(1.0, 20.0, 9) == [1.0, 2.0, 5.0, 10.0, 20.0]
    assert decade_ticks(1e-3, 1e3, 7) == pytest.approx([1e-3, 1e-2, 0.1, 1, 10, 100, 1e3])


def test_text_has_twelve_pixels_in_the_column_that_a_phone_of_360_leaves():
    """16 px of margin on either side leave 328; the drawing for a desk stands from 580 on."""
    for kind, column in (("narrow", 328), ("wide", 580)):
        svg = drawings(chart().svg("a"))[kind]
        assert float(svg.get("font-size")) * min(1.0, column * (0.88 if kind == "wide" else 1.0) / WIDTHS[kind]) >= 10.3
        assert svg.get("viewBox").split()[2] == f"{WIDTHS[kind]:g}"
    assert float(drawings(chart().svg("a"))["narrow"].get("font-size")) * 328 / WIDTHS["narrow"] >= 12


def test_what_is_not_finite_leaves_a_gap_and_is_no_value():
    broken = ChartLine(name="", x=np.array([0.0, 1.0, 2.0, 3.0, 4.0]), y=np.array([0.0, 1.0, np.nan, 1.0, np.inf]))
    drawn = chart(broken)
    (line,) = json.loads(drawn.values())["panels"][0]["lines"]
    assert line["y"] == [0, 1, None, 1, None]
    assert "nan" not in drawn.svg("a")
    assert "inf" not in drawn.svg("a")


def test_an_empty_or_constant_line_still_has_axes():
    for y in (np.zeros(0), np.zeros(3), np.full(3, np.nan)):
        assert "<text" in chart(ChartLine(name="", x=np.arange(y.size, dtype=float), y=y)).svg("a")


def test_limits_are_named_beside_their_line():
    assert ">limit<" in chart(levels=((2.0, "limit"),)).svg("a")
    assert ">limit<" not in chart(levels=((200.0, "limit"),), limits=(-1.0, 1.0)).svg("a")


def test_names_are_text_and_not_mark_up():
    named = ChartLine(name="<b>&", x=T, y=T)
    assert "<b>" not in chart(named, SINE).svg("a")
    assert "</script" not in chart(ChartLine(name="</script>", x=T, y=T)).values()


def test_colours_are_those_of_the_page_with_one_for_paper():
    markup = chart().svg("a")
    painted = set(re.findall(r'(?:stroke|fill)="(?!none|url)([^"]*)"', markup))
    assert painted <= set(re.findall(r"var\(--[\w-]+, #[0-9a-f]{6}\)", markup))


def test_a_curve_is_drawn_through_as_few_of_its_points_as_an_eye_would_not_miss():
    """No sample is more than a tenth of a pixel from the line between the two that are kept about it."""
    x = np.linspace(0.0, 600.0, 400)
    y = 90.0 * np.sin(x / 40.0) + 0.2 * x
    kept = _needed(x, y)
    assert kept[0] == 0
    assert kept[-1] == 399
    assert len(kept) < 150
    for a, b in pairwise(kept):
        chord = np.array([x[b] - x[a], y[b] - y[a]])
        off = (chord[0] * (y[a:b] - y[a]) - chord[1] * (x[a:b] - x[a])) / np.hypot(*chord)
        assert np.abs(off).max() <= 0.1
    assert _needed(x, 3.0 - 0.7 * x) == [0, 399]
    around = np.linspace(0.0, 2 * np.pi, 9)  # ends where it began
    assert _needed(10 * np.cos(around), 10 * np.sin(around)) == list(range(9))


@pytest.mark.parametrize(("step", "multiples"), [(0.5, np.arange(-1.0, 3.1, 0.5)), (2.0, [0, 2])])
def test_the_lines_of_an_axis_with_a_step_are_its_multiples_from_end_to_end(step, multiples):
    """From the point at -1 to the crest of 3 sin t at 3, once for a desk and once for a phone."""
    svg = chart(step=step, height=400.0).svg("a")
    labels = re.findall(r'text-anchor="end"[^>]*>([−\-\d.]+)<', svg)
    np.testing.assert_allclose([float(v.replace("−", "-")) for v in labels], np.tile(multiples, 2))
