"""Does a cursor tell a chart's values by mouse, touch and keys, and leave paper alone?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.live.browser import opened, settled
from upright.report.html import write_html
from upright.report.interactive.cells import Cells
from upright.report.interactive.charts import Chart, ChartLine, ChartPanel
from upright.report.page import Chapter, Part
from upright.report.planes import Poles, pole_chart

pytestmark = pytest.mark.slow

T = np.linspace(0.0, 10.0, 201)
MOTION = Chart(
    x="time", unit="s",
    panels=(ChartPanel(title="angle", unit="rad", lines=(ChartLine(name="", x=T, y=np.sin(T), colour="q0"),)),
            ChartPanel(title="speed", unit="rad/s", lines=(ChartLine(name="", x=T, y=np.cos(T), colour="q1"),))),
)  # fmt: skip
POLES = np.array([-3 + 4j, -3 - 4j, -12.0, 2.0])
PLANE = pole_chart([Poles(name="loop", values=POLES, mark="x")])
MATRIX = np.array([[1.0, 0.904, -0.31], [0.904, 1.0, math.nan], [-0.31, math.nan, 1.0]])
CELLS = Cells(names=("m_p", "J_p", "b_1"), matrix=MATRIX)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    pictures = (MOTION.picture("motion", caption="A motion.", description="Sine and cosine."),
                PLANE.picture("plane", caption="Poles.", description="Four poles."),
                CELLS.picture("cells", caption="Correlations.", description="Three numbers."))  # fmt: skip
    page = Chapter(title="Charts", verdict="Read them.", parts=(Part("Pictures", pictures),))
    return write_html(tmp_path_factory.mktemp("charts") / "page.html", page)


def told(page, name):
    """What stands below the picture, and what a reader hears, once what was just done has come to its end."""
    read = f"document.querySelector('.read[aria-label=\"{name}\"]')"
    heard, below = settled(page, f"[{read}.getAttribute('aria-valuetext'), {read}.nextElementSibling.textContent]")
    assert below == heard
    return heard.replace("\u2212", "-")


def numbers(text):
    return [float(word) for word in text.replace(":", " ").replace(";", " ").replace(",", " ").split() if _is(word)]


def _is(word):
    try:
        float(word)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize("width", [360, 1280])
def test_the_mouse_reads_every_panel_at_one_time(written, width):
    with opened(written, width=width) as (page, wrong):
        axes = page.locator("figure .panel:visible").first.locator("rect, path").first
        svg = page.locator(".read[aria-label='Sine and cosine.'] svg:visible")
        svg.scroll_into_view_if_needed()
        box = svg.bounding_box()
        for share in (0.4, 0.8):
            page.mouse.move(box["x"] + share * box["width"], box["y"] + 60)
            t, angle, speed = numbers(told(page, "Sine and cosine."))
            assert (angle, speed) == (pytest.approx(math.sin(t), abs=1e-4), pytest.approx(math.cos(t), abs=1e-4))
            # the axes leave 50 units at the left and 14 at the right
            units = 640 if width == 1280 else 330
            assert t == pytest.approx((share * units - 50) / (units - 64) * 10, abs=0.06)
        assert svg.locator(".cursor circle").count() == 2
        assert axes.count() == 1
        assert wrong == []


def test_keys_go_from_pole_to_pole_and_name_frequency_and_damping(written):
    """Of -3 + 4i: 5 rad/s and 3/5."""
    with opened(written) as (page, wrong):
        page.locator(".read[aria-label='Four poles.']").focus()
        heard = []
        for _ in range(4):
            page.keyboard.press("ArrowRight")
            heard.append(told(page, "Four poles."))
        assert heard[0] == "loop: -3 ± 4 i 1/s, natural frequency 5 rad/s, damping ratio 0.6"
        assert heard[1:3] == ["loop: -12 1/s", "loop: 2 1/s"]
        assert heard[3] == heard[2]  # the lower half is not read again
        page.keyboard.press("Home")
        assert told(page, "Four poles.") == heard[0]
        assert wrong == []


def test_a_finger_reads_the_pole_that_it_touches(written):
    with opened(written, width=360) as (page, wrong):
        read = page.locator(".read[aria-label='Four poles.']")
        read.scroll_into_view_if_needed()
        box = read.locator("svg:visible").bounding_box()
        low, high = PLANE.span
        x = box["x"] + (50 + (330 - 64) * (-12 - low) / (high - low)) * box["width"] / 330
        read.dispatch_event("pointerdown", {"clientX": x, "clientY": box["y"] + box["height"] - 60, "bubbles": True})
        assert told(page, "Four poles.") == "loop: -12 1/s"
        assert wrong == []


@pytest.mark.parametrize("width", [360, 1280])
def test_a_cell_tells_its_pair_wherever_in_it_the_mouse_is(written, width):
    heard = {(0, 1): "m_p and J_p: 0.904", (2, 0): "b_1 and m_p: -0.310", (1, 2): "J_p and b_1: not known"}
    with opened(written, width=width) as (page, wrong):
        svg = page.locator(".read[aria-label='Three numbers.'] svg:visible")
        svg.scroll_into_view_if_needed()
        box = svg.bounding_box()
        units = svg.evaluate("e => e.viewBox.baseVal.width")
        left, top, wide, high = map(float, svg.locator(".panel").get_attribute("data-area").split())
        for (i, j), pair in heard.items():
            for inside in (0.1, 0.9):
                x, y = left + (j + inside) * wide / 3, top + (i + inside) * high / 3
                page.mouse.move(box["x"] + x * box["width"] / units, box["y"] + y * box["width"] / units)
                assert told(page, "Three numbers.") == f"correlation of {pair}"
        page.locator(".read[aria-label='Three numbers.']").focus()
        page.keyboard.press("Home")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowRight")
        assert told(page, "Three numbers.") == "correlation of J_p and J_p: 1.000"
        assert wrong == []


def test_without_a_script_and_on_paper_the_drawing_for_its_width_is_there(written):
    for width, kind in ((360, "narrow"), (1280, "wide")):
        with opened(written, width=width, script=False) as (page, _):
            shown = page.locator(".chart svg:visible")
            assert [s.get_attribute("class") for s in shown.all()] == [kind] * 3
    with opened(written) as (page, _):
        page.emulate_media(media="print")
        assert page.locator(".chart-reading:visible").count() == 0
