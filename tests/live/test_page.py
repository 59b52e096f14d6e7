"""Can a person push the rig in its page, drag its poles, read it on a phone, on paper and without a script?"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

import upright as up
from tests.live.browser import WIDTHS, opened, until

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=0.003, b_2=2e-4, b_1c=0.008, b_2c=3e-4)
RIG = up.Rig.known(ARM, name="bench 3", gain="0.65 N m/V", limit="3 V", period="2 ms", counts=4096, travel="120 deg")
POLES = "-4.5+-2j, -20, -3"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("play") / "play.html"
    return path, up.play(RIG, poles=POLES, start="26 deg", draws=100, out=path)


def test_it_tells_the_share_that_chance_tells(written):
    gains = up.design(RIG, at="inverted", poles=POLES).continuous
    told = up.chance(RIG, gains, start="26 deg", seconds=3.0, draws=100)
    assert written[1].numbers["held"] == round(100 * told.numbers["chance"])
    reach = re.fullmatch(r"It recovers from tilts up to (.*)° and taps up to (.*) rad/s\.", told.chapter.detail)
    assert float(reach[1]) == pytest.approx(math.degrees(told.numbers["tilt"]), rel=0.05)  # two digits
    assert float(reach[2]) == pytest.approx(told.numbers["push"], rel=0.05)
    assert 5 <= written[1].numbers["held"] <= 95


def test_the_page_tells_the_numbers_of_the_rig_in_their_units(written):
    rows = re.findall(r"<tr><td>(.*?)</td><td>(.*?)</td><td[^>]*>(.*?)</td></tr>", written[0].read_text("utf-8"))
    told = [(what, value) for _, what, value in rows]
    assert ("gain of the drive [N m per V]", "0.6500") in told
    assert ("limit of the drive [V]", "3.000") in told
    assert ("servo period [ms]", "2.000") in told
    assert [value for what, value in told if what == "encoder counts"] == ["4096", "4096"]
    assert sum("friction" in what for what, _ in told) == sum(bool(v) for n, v in ARM.parameters().items() if "b" in n)


def test_without_a_covariance_the_page_says_what_alone_varies(written, tmp_path):
    blind = "The fit has no covariance: only dry friction and the hand vary."
    assert blind in written[0].read_text("utf-8")
    drawn = replace(RIG, draws=((RIG.plant, RIG.gain),) * 2)
    up.play(drawn, poles=POLES, start="26 deg", draws=2, out=tmp_path / "play.html")
    assert blind not in (tmp_path / "play.html").read_text("utf-8")


def test_the_page_holds_no_address_and_evaluates_nothing(written):
    text = written[0].read_text(encoding="utf-8")
    assert not re.findall(r"https?://(?!www\.w3\.org)", text)
    assert not re.findall(r"\beval\(|new Function", text)
    assert "unsafe-inline" not in text
    assert "'unsafe-eval'" not in text
    assert len(text) < 150_000


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        ({"out": "page.txt"}, "ending in .html"),
        ({"seconds": 0}, "more than 0"),
        ({"draws": 0}, "1 to 1000"),
        ({"speed": "kalman"}, "plain or filtered"),
    ],
)
def test_what_it_cannot_do_is_a_sentence(change, wrong):
    with pytest.raises(up.BadInput, match=wrong):
        up.play(RIG, **change)


def test_a_rig_without_an_upright_position_is_refused():
    with pytest.raises(up.BadInput, match="inverted equilibrium"):
        up.play(up.chain(2)(m_1=1.0, m_2=0.5, k_12=50.0))


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", WIDTHS)
def test_nothing_is_clipped_and_axe_finds_nothing(written, width, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with opened(written[0], width=width, dark=dark) as (page, wrong):
        until(page, "upright.answered.length > 0")
        until(page, f"document.documentElement.scrollWidth <= {width}")
        # the page's own policy keeps axe's script out, so it is run from outside of it
        found = axe.Axe().run(page).response["violations"]
        assert [(v["id"], [n["html"][:100] for n in v["nodes"]]) for v in found] == []
        assert wrong == []


@pytest.mark.slow
def test_the_share_in_the_page_is_the_one_that_is_told(written):
    with opened(written[0]) as (page, wrong):
        until(page, "upright.answered.length > 0")
        assert page.inner_text("#share").startswith(f"{written[1].numbers['held']} of 100 rigs are stabilised")
        assert page.locator("#rigs g").count() == 100
        assert wrong == []


@pytest.mark.slow
def test_a_person_pushes_it_until_it_falls_and_stands_it_up_again(written):
    with opened(written[0]) as (page, wrong):
        away = "Math.abs(upright.twin.state()[2] - Math.PI)"
        until(page, f"upright.twin.k > 2000 && {away} < 0.03")
        page.keyboard.press("ArrowRight")
        until(page, f"{away} > 0.03")
        until(page, f"{away} < 0.03")
        page.click("#left")
        page.evaluate("for (let i = 0; i < 9; i++) document.getElementById('right').click()")
        until(page, "upright.twin.lost !== ''")
        until(page, "document.getElementById('status').textContent.includes('The drive is off')")
        # in one turn of the page: what is stood up is on its way upright before another question comes
        lost, leans = page.evaluate(f"(document.getElementById('stand').click(), [upright.twin.lost, {away}])")
        assert lost == ""
        assert leans == pytest.approx(math.radians(26), abs=0.2)
        page.click("#play")
        before = page.evaluate("upright.twin.k")
        until(page, f"upright.frames > {page.evaluate('upright.frames')} + 5")
        assert page.evaluate("upright.twin.k") == before
        assert wrong == []


@pytest.mark.slow
def test_poles_are_dragged_by_mouse_and_moved_by_keys_and_numbers(written):
    with opened(written[0]) as (page, wrong):
        until(page, "upright.answered.length > 0")
        poles = "upright.twin.poles.map((z) => [...z])"
        page.locator(".pole").nth(0).hover()  # once it lies still
        box = page.locator(".pole").nth(0).bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2 + 60, box["y"] + box["height"] / 2, steps=4)
        page.mouse.up()
        until(page, "upright.twin.poles[0][0] > -20 + 3")
        first = page.evaluate(poles)
        page.locator(".pole").nth(1).focus()
        page.keyboard.press("ArrowUp")
        assert page.evaluate(poles)[1][1] == pytest.approx(first[1][1] + 0.2)
        page.locator("#poles input").last.fill("2.5")
        page.keyboard.press("Enter")
        assert min(abs(re + 2.5) for re, _ in page.evaluate(poles)) < 1e-9
        answered = page.evaluate("upright.answered.length")
        page.locator("#friction").fill("5")
        until(page, f"upright.answered.length > {answered}")
        assert wrong == []


@pytest.mark.slow
def test_picture_and_numbers_are_there_without_a_script(written):
    with opened(written[0], script=False) as (page, _):
        assert page.locator("#rig polyline").count() >= 3
        assert page.inner_text("#share") == f"{written[1].numbers['held']} of 100 rigs are stabilised for 3 s."
        assert page.locator("td", has_text="hinge to centre of gravity").is_visible()
        assert not page.locator("#friction").is_visible()
