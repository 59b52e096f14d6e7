"""Does the page of a run show, at every time, where the rig was and where the model says that it was?"""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import upright as up
from tests.live.browser import WIDTHS, opened, until
from upright.identification import RunScore
from upright.live.motion import MOST, RATE, motion_page
from upright.verbs.control.moving import played_run

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=0.003, b_2=2e-4)
T = np.arange(0, 5, 2e-3)


def swing(t=T):
    y = np.column_stack([0.4 * np.sin(2 * t), np.cos(7 * t) * np.exp(-0.2 * t)])
    return RunScore(
        role="predict", fit_percent={"psi": 99.0, "theta": 95.0}, horizon=None, t=t, y=y, simulated=0.95 * y,
        measured=("psi", "theta"),
    )  # fmt: skip


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("motion") / "run.html"
    played_run(swing(), ARM, "tail", out=path)
    return path


def test_the_page_holds_no_address_evaluates_nothing_and_is_small(written):
    text = written.read_text(encoding="utf-8")
    assert not re.findall(r"https?://(?!www\.w3\.org)", text)
    assert "unsafe" not in text
    assert len(text) < 60_000


@pytest.mark.parametrize("seconds", [0.1, 5.0, 59.0, 600.0])
def test_it_has_at_most_sixty_pictures_a_second_and_a_minute_of_them(seconds):
    t = np.linspace(0, seconds, 30_000)
    text = motion_page(ARM, t, {"theta": np.cos(t)}, {"theta": np.cos(t)}, name="run")
    frames = int(re.search(r'"frames":(\d+)', text)[1])
    assert 2 <= frames <= min(MOST, seconds * RATE + 1) or seconds < 2 / RATE


def test_a_motion_without_bounds_and_a_plant_without_a_drawing_are_sentences():
    with pytest.raises(up.BadInput, match="beyond all bounds"):
        motion_page(ARM, T, {"theta": T}, {"theta": np.full(T.size, np.inf)}, name="run")
    with pytest.raises(up.BadInput, match=r"ending in \.html"):
        played_run(swing(), ARM, "tail", out="run.txt")


@pytest.mark.slow
def test_the_slider_shows_the_record_and_the_model_at_its_time(written):
    run = swing()
    with opened(written) as (page, wrong):
        until(page, "window.motion !== undefined")
        last = int(page.locator("#scrub").get_attribute("max"))
        assert last == math.floor(T[-1] * RATE)
        for k in (0, 37, 150, last):
            page.locator("#scrub").fill(str(k))
            t = T[-1] * k / last
            assert page.inner_text("#time") == f"{t:.2f} s"
            for i in (0, 1):
                expected = math.degrees(np.interp(t, run.t, run.y[:, i]))
                text = page.inner_text(f"#value-{i}").replace("\u2212", "-")
                shown = [float(v) for v in re.findall(r"(-?[\d.]+)°", text)]
                assert shown == pytest.approx([expected, 0.95 * expected], abs=0.06)
        assert wrong == []


@pytest.mark.slow
def test_it_plays_pauses_and_is_scrubbed_on_its_traces(written):
    with opened(written) as (page, wrong):
        until(page, "window.motion !== undefined")
        page.click("#play")
        until(page, "motion.frame > 5")
        page.click("#play")
        stood = page.evaluate("motion.frame")
        page.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert page.evaluate("motion.frame") == stood
        box = page.locator("svg.strip").first.bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 10)
        assert page.evaluate("motion.frame") == pytest.approx(150, abs=1)
        page.locator("#scrub").focus()
        page.keyboard.press("ArrowRight")
        assert page.evaluate("motion.frame") == pytest.approx(151, abs=1)
        assert wrong == []


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_run_fits_a_phone_and_axe_finds_nothing(written, width, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with opened(written, width=width, dark=dark) as (page, wrong):
        until(page, "window.motion !== undefined")
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        violations = axe.Axe().run(page).response["violations"]
        assert [(v["id"], [n["html"][:100] for n in v["nodes"]]) for v in violations] == []
        assert wrong == []


@pytest.mark.slow
def test_without_a_script_rig_and_traces_are_there(written):
    with opened(written, script=False) as (page, _):
        assert page.locator("#rig polyline").count() >= 3
        assert page.locator("svg.strip polyline").count() == 4
        assert not page.locator("#scrub").is_visible()
