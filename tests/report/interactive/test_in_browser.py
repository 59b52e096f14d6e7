"""Do traces in a page answer: values of the record under the cursor, one span of time for all, keys, paper, phones?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.live.browser import WIDTHS, opened, settled, until
from tests.report.conftest import make_fit
from upright.report.fit.chapter import chapter
from upright.report.html import write_html

pytestmark = pytest.mark.slow
TAIL, RELEASE, RESTARTED = 0, 1, 2
"""Places on the page: the run that was predicted stands on its first screen."""
SEEN = "document.querySelectorAll('figure:has(script.traces)')"


@pytest.fixture(scope="module")
def fit():
    fit = make_fit()
    first = fit.runs["release"]
    guess = 0.9 * first.simulated
    banded = replace(fit.runs["tail"], band={"theta": np.full(first.t.size, 0.02)})
    return replace(fit, runs={**fit.runs, "release": replace(first, guess=guess), "tail": banded})


@pytest.fixture(scope="module")
def written(fit, tmp_path_factory):
    return write_html(tmp_path_factory.mktemp("traces") / "report.html", chapter(fit))


def traces(place=0):
    """Those of a figure: which figure answers first is the browser's choice."""
    return f"TRACES.find((t) => t.figure === {SEEN}[{place}])"


def show(page, place=0):
    """Scroll to a figure and wait until its plots lie still; what begins in view may move it out of view."""
    page.evaluate(f"{SEEN}[{place}].scrollIntoView()")
    until(page, f"{traces(place)}?.plots[0].bbox.width > 0")
    page.evaluate(f"{SEEN}[{place}].scrollIntoView()")
    settled(page, f"{SEEN}[{place}].getBoundingClientRect()")
    return page.locator("figure:has(script.traces)").nth(place)


def told(page, place=0):
    """Time and values that stand at the cursor, by name."""
    text = page.evaluate(
        f"(() => {{ const t = {traces(place)}; return [t.time.textContent,"
        " t.heads.map(({ line, value }) => [line.name, value.textContent])]; })()"
    )
    number = lambda s: float(s.replace("\u2212", "-"))  # noqa: E731
    return number(text[0].split()[1]), [(name, number(value)) for name, value in text[1]]


def test_the_cursor_tells_what_the_record_holds_at_that_time(written, fit):
    run = fit.runs["release"]
    with opened(written) as (page, wrong):
        over = show(page, RELEASE).locator(".u-over").nth(2)  # theta
        box = over.bounding_box()
        for share in (0.2, 0.47, 0.9):
            page.mouse.move(box["x"] + share * box["width"], box["y"] + 20)
            until(page, f"Math.abs({traces(RELEASE)}.t[{traces(RELEASE)}.index] - {10 * share}) < 0.02")
            t, lines = told(page, RELEASE)
            i = int(np.argmin(np.abs(run.t - t)))
            assert t == pytest.approx(run.t[i], abs=1e-3)
            assert t == pytest.approx(share * 10, abs=0.02)
            pairs = zip(run.y[i], run.simulated[i], strict=True)
            expected = [v for y, model in pairs for v in (y, 0.9 * model, model, y - model)]
            # five digits are told of values packed to 16 bits of a range of 3 rad
            assert [v for _, v in lines] == pytest.approx(expected, abs=3.2 / 65534 + 2e-5)
            assert [n for n, _ in lines[:4]] == ["measured", "initial guesses", "model", "measured \u2212 model"]
        assert wrong == []


def test_a_drag_zooms_every_panel_to_the_same_seconds_and_a_double_click_shows_all(written):
    plots = f"{traces()}.plots"
    axes = f"{plots}.map((u) => [u.scales.x.min, u.scales.x.max])"
    with opened(written) as (page, wrong):
        figure = show(page)
        assert page.evaluate(axes) == [[0, 10]] * 4
        box = figure.locator(".u-over").first.bounding_box()
        page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 50)
        page.mouse.down()
        page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 55, steps=4)
        page.mouse.up()
        until(page, f"{plots}.every((u) => u.scales.x.max < 6)")
        for low, high in page.evaluate(axes):
            assert (low, high) == (pytest.approx(3.0, abs=0.05), pytest.approx(5.0, abs=0.05))
        page.mouse.dblclick(box["x"] + 60, box["y"] + 50)
        until(page, f"{plots}.every((u) => u.scales.x.max === 10)")
        assert wrong == []


def test_keys_move_the_cursor_sample_by_sample_and_zoom(written, fit):
    run, shown = fit.runs["release"], traces(RELEASE)
    with opened(written) as (page, wrong):
        figure = show(page, RELEASE)
        figure.locator(".panels").focus()
        for _ in range(4):
            page.keyboard.press("ArrowRight")
        until(page, f"{shown}.index === 3 && {shown}.heard.textContent !== ''")
        t, lines = told(page, RELEASE)
        assert t == pytest.approx(run.t[3], abs=1e-4)
        assert lines[0][1] == pytest.approx(run.y[3, 0], abs=1e-4)
        heard = figure.locator(".heard").inner_text()
        assert heard.startswith(f"time {float(f'{run.t[3]:.5g}')} s: measured")
        page.keyboard.press("Shift+ArrowRight")
        until(page, f"{shown}.index === 13")
        page.keyboard.press("+")
        until(page, f"{shown}.plots.every((u) => u.scales.x.max - u.scales.x.min < 5.01)")
        page.keyboard.press("Home")
        until(page, f"{shown}.plots.every((u) => u.scales.x.max - u.scales.x.min > 9.99)")
        assert wrong == []


def test_the_band_of_a_prediction_is_drawn_about_its_model(written, fit):
    with opened(written) as (page, wrong):
        show(page, TAIL)
        drawn = page.evaluate(f"{traces(TAIL)}.plots.map((u) => u.bands.length)")
        assert drawn == [0, 0, 1, 1]  # psi has none
        edges = np.array(page.evaluate(f"{traces(TAIL)}.plots[2].data.slice(1, 3)"))
        np.testing.assert_allclose(edges[0] - edges[1], 0.04, atol=1e-4)
        np.testing.assert_allclose(edges.mean(axis=0), fit.runs["tail"].simulated[:, 1], atol=1e-4)
        assert wrong == []


def test_a_prediction_that_was_restarted_is_broken_there(written):
    with opened(written) as (page, _):
        show(page, RESTARTED)
        gaps = page.evaluate(f"(t => t.gaps(t.plots[0], 1, 0, t.t.length - 1).length)({traces(RESTARTED)})")
        assert gaps == 20  # 10 s in windows of 0.5 s, the last sample begins one


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", WIDTHS)
def test_it_fits_a_phone_and_axe_finds_nothing(written, width, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with opened(written, width=width, dark=dark) as (page, wrong):
        for place in range(3):
            show(page, place)
        until(page, f"document.documentElement.scrollWidth <= {width}")
        found = axe.Axe().run(page, ".moving").response["violations"]
        assert [(v["id"], [n["html"][:100] for n in v["nodes"]]) for v in found] == []
        assert wrong == []


def test_paper_and_a_page_without_a_script_have_the_still_picture(written):
    with opened(written, script=False) as (page, _):
        assert page.locator(".still svg").first.is_visible()
    with opened(written) as (page, _):
        show(page)
        assert not page.locator("figure:has(script.traces) .still").first.is_visible()
        page.emulate_media(media="print")
        assert page.locator("figure:has(script.traces) .still").first.is_visible()
        assert not page.locator(".moving").first.is_visible()
