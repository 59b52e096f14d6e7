"""Can a student balance the twin in the browser, stop it from anywhere, and lose neither the rig nor the page?"""

from __future__ import annotations

import math
import re
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from tests.browser.students import DESK, PHONE, Server, student
from tests.browser.test_frames import decoded
from tests.live.browser import settled, until
from upright.logs import read_log
from upright.logs.replay import replay
from upright.rig.makes import make_rig

pytestmark = pytest.mark.slow

SCREENS = ("run", "identify", "design", "track", "runs")
LIGHT = 400_000
"""Bytes of the first load at most (issue 25)."""
COVERS = """() => { const box = document.getElementById('stop').getBoundingClientRect(), inset = 3;
  return [[0.5, 0.5], [0, 0], [1, 1], [0, 1], [1, 0]].map(([x, y]) => document.elementFromPoint(
    box.left + inset + x * (box.width - 2 * inset), box.top + inset + y * (box.height - 2 * inset)))
    .filter((e) => !e?.closest('#stop')).map((e) => e?.outerHTML.slice(0, 100) ?? 'outside') }"""
"""What lies over a place of the button STOP."""

SPILLS = """[...document.querySelectorAll('#design:not([hidden]) > .panel, #track:not([hidden]) > .panel')]
  .filter((e) => e.scrollHeight > e.clientHeight + 1).map((e) => e.innerText.slice(0, 60))"""
"""Panels of the screens Design and Track whose content lies over what is below them."""

STANDS = """most => { const text = document.querySelectorAll('#readings dd')[1].textContent;
  return Math.abs(parseFloat(text.replace('\u2212', '-'))) < most * 180 / Math.PI }"""
"""Whether the page says that the pendulum is so far from upright at most."""
RIG = make_rig("furuta")


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    opened = Server(tmp_path_factory.mktemp("bench"))
    yield opened
    opened.close()


def pole_at(page) -> tuple[float, float]:
    """Middle of the first pole, once the plane is laid out, which is a frame after it is seen, and lies still."""
    page.wait_for_selector("#plane[viewBox]")
    box = settled(page, "document.querySelector('.pole[role=slider]').getBoundingClientRect()")
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


MOVED = "wanted => Math.abs(document.querySelector('#pairs input').valueAsNumber - wanted) < 0.06"
"""Whether the first pair has a natural frequency."""
ANOTHER_PLACE = "before => document.querySelector('#pairs tr:first-child td:last-child').innerText !== before"


def tab_to(page, selector: str) -> None:
    """Press Tab until something has the focus."""
    page.evaluate("document.activeElement.blur()")
    for _ in range(40):
        page.keyboard.press("Tab")
        if page.locator(f"{selector}:focus").count():
            return
    raise AssertionError(f"{selector} cannot be reached by Tab")


def test_a_whole_session_by_keyboard_alone(server, chromium):
    with student(chromium, server) as one:
        page = one.page
        one.reads("#operator", "Nobody operates")
        tab_to(page, "#start")
        page.keyboard.press("Enter")
        one.sees("running")
        one.reads("#operator", "You operate")
        page.wait_for_selector("#tab-design:not([hidden])")
        tab_to(page, "#tab-run")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        one.reads("#share", r"\d+ of 200 rigs are stabilised")
        tab_to(page, ".pole[role=slider]")
        before = page.locator("#pairs input").first.input_value()
        for _ in range(5):
            page.keyboard.press("ArrowLeft")
        page.wait_for_function(MOVED, arg=float(before) + 1.0)
        spoken = page.locator(".pole[role=slider]").first.get_attribute("aria-valuetext")
        assert re.fullmatch(r"natural frequency [\d.]+ rad/s, damping ratio [\d.]+", spoken)
        tab_to(page, "#apply")
        page.keyboard.press("Enter")
        one.reads("#message", r"act from tick \d+")
        page.keyboard.press("Escape")
        one.sees("stopped")
        one.reads("#latch", "Stopped by its operator")
        tab_to(page, "#stop")
        one.leaves()
        assert one.wrong == []


def test_by_keyboard_the_lqr_slider_gives_the_gains_of_riccati_s_equation_and_they_are_applied(server, chromium):
    """By scipy, for the deviations and the price that the page shows."""
    with student(chromium, server, screen="design") as one:
        page = one.page
        one.starts()
        one.reads("#lqr-price", "set by hand")
        tab_to(page, "#lqr-slider")
        for key in ("Home", "PageUp", "PageUp", "PageUp", "ArrowRight"):
            page.keyboard.press(key)
        slider = page.locator("#lqr-slider")
        price = 10 ** -float(slider.input_value())
        one.reads("#lqr-price", "ρ = [1-9]")
        assert "damping ratio" in slider.get_attribute("aria-valuetext")
        tab_to(page, "#lqr summary")
        page.keyboard.press("Enter")
        weighed = [math.radians(float(field.input_value())) for field in page.locator("#lqr-weights input").all()]
        linear = RIG.linear("inverted")
        Q = np.diag([1 / weighed[0] ** 2, 0, 1 / weighed[1] ** 2, 0])
        S = solve_continuous_are(linear.A, linear.B, Q, [[price / RIG.limit**2]])
        K = RIG.limit**2 / price * (linear.B.T @ S)[0]
        expected = pytest.approx(K.tolist(), rel=6e-3)  # three digits are shown

        def shown():
            text = " ".join(page.locator("#before tr:has-text('gains on') td").all_inner_texts())
            return [float(number) for number in re.findall(r"-?[\d.]+", text.replace("\u2212", "-"))]

        page.wait_for_selector("#share[aria-busy=false]")  # once the page has computed what it shows
        assert shown() == expected
        tab_to(page, "#apply")
        page.keyboard.press("Enter")
        one.reads("#message", r"act from tick \d+")
        one.reads("#lqr-price", "ρ = [1-9]")  # what acts is still the regulator's
        page.locator("#pairs input").first.press("ArrowUp")
        one.reads("#lqr-price", "set by hand")
        one.leaves()
        assert one.wrong == []


def guided(one) -> None:
    """Open the guide, and answer its first question."""
    one.page.click("#guide-toggle")
    one.page.fill("#guide-answer input", "5")
    one.page.click("#guide-predict")
    one.page.click("#guide-details summary")


def test_the_guide_asks_before_it_answers_and_remembers_by_keyboard_alone(server, chromium):
    with student(chromium, server, prepare=lambda page: page.add_init_script(f"({HOLDS})()")) as one:
        page = one.page
        page.wait_for_selector("#tab-design:not([hidden])")
        page.wait_for_selector("#guide-toggle:not([hidden])")

        def answers(text):
            tab_to(page, "#guide-answer input")
            page.keyboard.type(text)
            page.keyboard.press("Enter")

        def goes_on():
            tab_to(page, "#guide-next")
            page.keyboard.press("Enter")

        tab_to(page, "#guide-toggle")
        page.keyboard.press("Enter")
        one.reads("#guide-part", "question 1 of 7")
        assert not page.locator("#guide-after").is_visible()
        goes_on()
        one.reads("#message", "Predict first")
        tab_to(page, "#guide-predict")
        page.keyboard.press("Enter")
        one.reads("#message", "Give a number first")
        answers("8")
        one.reads("#guide-compare", r"You said 8\.00 rad/s; the model has 7\.98 rad/s: close")
        tab_to(page, "#guide-details summary")
        page.keyboard.press("Enter")
        one.reads("#guide-source", "erratum 1")
        page.reload()
        page.wait_for_selector("#tab-design:not([hidden])")
        one.reads("#guide-compare", r"You said 8\.00 rad/s")
        goes_on()
        answers("4")
        one.reads("#guide-compare", "too small, 50 % off")
        goes_on()
        answers("0.3")
        one.reads("#guide-measured", "Not measured yet")
        tab_to(page, "#start")
        page.keyboard.press("Enter")
        one.sees("running")
        one.reads("#guide-measured", r"Measured: [\d.]+ V")
        model, measured = (
            float(re.search(r"(?:has|Measured:) ([\d.]+) V", page.inner_text(f"#guide-{part}"))[1])
            for part in ("compare", "measured")
        )
        assert measured == pytest.approx(model, rel=0.25)
        goes_on()
        tab_to(page, "#guide-answer input")
        page.keyboard.press("ArrowDown")
        tab_to(page, "#guide-predict")
        page.keyboard.press("Enter")
        one.reads("#guide-compare", "The model says: set 4")  # R is halved from set to set
        tab_to(page, "#guide-actions button:nth-child(4)")
        page.evaluate("void (window.holds = (note) => note.type === 'scene')")
        page.keyboard.press("Enter")
        one.reads("#message", "act from tick")
        tab_to(page, "#guide-actions button:nth-child(5)")
        page.wait_for_function("() => window.held.length")
        page.evaluate("window.letGo()")  # the law that acts now comes while somebody is about to tap
        assert page.locator("#guide-actions button:nth-child(5):focus").count() == 1
        page.keyboard.press("Enter")
        one.reads("#guide-measured", r"set 1 –, set 2 –, set 3 –, set 4 \d\.\d+ V")
        page.keyboard.press("Escape")
        one.sees("stopped")
        one.leaves()
        assert one.wrong == []


def test_a_whole_session_by_mouse_until_it_falls(server, chromium):
    drawings = []

    def withhold(page):
        page.route(re.compile(r"/rigs/\w+/twin\.js"), lambda route: drawings.append(route), times=1)

    with student(chromium, server, prepare=withhold) as one:
        page = one.page
        one.starts()
        one.reads("#readings", r"0\.\d deg")
        page.fill("#next label:has-text('tap') input", "20")
        one.until(lambda: drawings, "the request for a drawing")
        drawings.pop().continue_()
        page.wait_for_selector("#tab-design:not([hidden])")
        assert page.input_value("#next label:has-text('tap') input") == "20"  # what was typed before stays
        one.presses("#tap")  # once: what is pressed later is answered later, in the place of what is read below
        one.sees("stopped")
        one.reads("#latch-why", ".{20}")
        assert "operator" not in page.inner_text("#latch-why")  # the supervisor stopped it, and says why
        one.presses("#start")  # it is latched
        one.reads("#message", "rearm it first")
        one.rearms()
        page.fill("#next label:has-text('tap') input", "0.8")
        page.fill("#next label:has-text('start') input", "0")
        one.starts()
        page.click("#tab-design")
        one.reads("#share", "rigs are stabilised")
        x, y = pole_at(page)
        poles = page.inner_text("#pairs tr:first-child td:last-child")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 12, y - 12, steps=4)
        page.mouse.up()
        page.wait_for_function(ANOTHER_PLACE, arg=poles)
        page.click("#apply")
        one.reads("#message", r"act from tick \d+")
        page.click("#tab-run")
        page.click("#stop")
        one.sees("stopped")
        one.leaves()
        assert one.wrong == []


def test_hanging_it_swings_up_and_stands_in_the_picture_as_in_the_frames(server, chromium):
    theta, per_turn = [], RIG.per_unit[1] * math.tau
    with student(chromium, server) as one:
        page = one.page

        def reading(frame):
            if isinstance(frame, bytes):
                theta.extend(counts[1] for counts in decoded(frame)[1])

        page.on("websocket", lambda socket: socket.on("framereceived", reading))
        page.reload()
        page.select_option("#from", "hanging")
        page.wait_for_selector("#start[aria-disabled=false]")  # its swing-up is designed
        one.starts()
        page.wait_for_function(STANDS, arg=math.radians(10))

        def stays():
            return all(abs(abs(n) - per_turn / 2) < per_turn / 36 for n in theta[-500:])

        one.until(stays, "a pendulum that stands")
        one.reads("#readings", r"from upright.?-?\u2212?\d\.\d deg")
        assert abs(theta[0]) < per_turn / 36
        page.click("#tab-design")
        one.reads("#gate", "While a swing-up runs")
        page.click("#tab-run")
        page.click("#end")
        one.sees("ended")
        one.reads("#message", "Stopped after")  # its report is written
        page.select_option("#from", "held")
        one.leaves()
        assert one.wrong == []


def test_poles_too_fast_for_the_rigs_cannot_be_applied_and_the_page_says_why(server, chromium):
    with student(chromium, server) as one:
        page = one.page
        one.starts()
        page.click("#tab-design")
        page.locator("#pairs input").nth(0).fill("0.5")
        page.keyboard.press("Enter")
        page.locator("#pairs input").nth(1).fill("0.05")
        page.keyboard.press("Enter")
        one.reads("#gate", "Apply is locked: fewer than 95 % of the rigs")
        one.presses("#apply")
        one.reads("#message", "Apply is locked")
        page.click("#dismiss")
        page.locator("#pairs input").nth(0).fill("7")
        page.keyboard.press("Enter")
        page.locator("#pairs input").nth(1).fill("0.7")
        page.keyboard.press("Enter")
        page.wait_for_selector("#apply[aria-disabled=false]")
        page.evaluate(PRESSED_AT_ONCE)  # what is judged is what would be applied, not the poles before
        one.reads("#message", "Apply is locked")
        one.leaves()


def test_anybody_stops_and_only_the_operator_arms_again(server, chromium):
    with student(chromium, server) as one, student(chromium, server) as another:
        one.starts()
        another.sees("running")
        another.reads("#operator", "you can stop it, you cannot steer it")
        another.presses("#tap")
        another.reads("#message", "you cannot steer it")
        another.page.keyboard.press("Escape")
        for each in (one, another):
            each.sees("stopped")
            each.reads("#latch", "Stopped by somebody who watches")
        another.presses("#rearm")
        another.page.wait_for_selector("#state[data-state=stopped]")
        one.leaves()
        another.sees("idle")


def test_loaded_again_in_the_middle_the_operator_still_operates(server, chromium):
    with student(chromium, server) as one:
        one.starts()
        one.page.reload()
        one.sees("running")
        one.reads("#operator", "You operate")
        one.reads("#readings", "deg")
        one.leaves()


def test_a_phone_watches_and_stops(server, chromium):
    with student(chromium, server) as one, student(chromium, server, screen="design", **PHONE) as phone:
        one.starts()
        phone.sees("running")
        phone.reads("#operator", "You can stop the rig")
        phone.reads("#readings", "deg")
        for hidden in ("#start", "#tap", "#tab-design", "#control", "#design"):
            assert not phone.page.locator(hidden).is_visible()
        until(phone.page, "document.documentElement.scrollWidth <= 390")
        box = settled(phone.page, "document.getElementById('stop').getBoundingClientRect()")
        assert (box["width"], box["height"]) == (390, pytest.approx(72))
        assert box["y"] + box["height"] == pytest.approx(844)
        phone.page.tap("#stop")
        one.sees("stopped")
        one.leaves()
        assert phone.wrong == []


def test_stop_ends_a_run_with_log_and_report_and_escape_stops_from_within_the_report(server, chromium):
    with student(chromium, server, prepare=lambda page: page.add_init_script(f"({HOLDS})()")) as one:
        page = one.page
        one.starts()
        one.reads("#readings", "deg")
        page.evaluate("void (window.holds = (note) => note.type === 'state' && note.verdict !== '')")
        page.click("#end")
        one.sees("ended")
        for screen in ("identify", "runs"):
            page.click(f"#tab-{screen}")
            one.reads(f"#{screen} .writing", "The report of the last run is being written")
            assert not page.locator(f"#no-{'logs' if screen == 'identify' else 'runs'}").is_visible()
        page.wait_for_function("() => window.held.length")
        page.evaluate("window.letGo()")
        page.wait_for_selector("#runs .writing", state="hidden")
        page.wait_for_selector("#runs-rows tr")
        with page.expect_download() as download:
            page.locator("#runs-rows tr").first.locator("a").click()
        assert Path(download.value.path()).read_bytes()[:5] == b"\x89MCAP"
        page.locator("#runs-rows tr").first.locator("button").click()
        page.frame_locator("#report").locator("h1").wait_for()
        page.wait_for_selector("#report:not(.unheard)")
        assert settled(page, f"({COVERS})()") == []
        page.click("#start")
        one.sees("running")
        page.frame_locator("#report").locator("h1").click()
        page.keyboard.press("Escape")
        one.sees("stopped")
        one.leaves()


def test_a_wave_is_followed_once_the_model_can_and_all_who_look_on_see_it(server, chromium):
    with student(chromium, server) as one, student(chromium, server, screen="track") as another:
        page = one.page
        page.fill("#next label:has-text('start') input", "0")
        page.click("#tab-track")
        one.reads("#track-model", "twin in this page")
        one.presses("#follow")
        one.reads("#message", "Start the rig")
        one.starts()
        for shape, size, why in (
            ("step", "400", "beyond the travel of 360 deg"), ("square", "300", "The pendulum of the model falls")
        ):  # fmt: skip
            page.select_option("#shape", shape)
            page.fill("#wave-size", size)
            page.keyboard.press("Enter")
            one.reads("#track-gate", why)
            one.presses("#follow")
            one.reads("#message", why)
        one.reads("#track-now", "nothing is followed")
        page.select_option("#shape", "step")
        page.fill("#wave-size", "20")
        page.keyboard.press("Enter")
        one.reads("#track-before", r"first the wrong way by\s*[1-9] %")  # a zero right of the axis
        page.click("#follow")
        for each in (one, another):
            each.reads("#track-now", "step, 20.0 deg")
            each.reads("#track-figures", r"error, rms, last second\s*\d")
        another.presses("#follow")
        another.reads("#message", "you cannot steer it")
        page.click("#end")
        one.sees("ended")
        one.reads("#message", "Stopped after")  # its report is written
        one.leaves()
        assert one.wrong == another.wrong == []
    log = read_log(max((server.folder / "furuta").glob("run*.mcap"), key=lambda path: path.stat().st_mtime))
    assert set(log.columns["reference"]) == {0.0, math.radians(20)}
    assert replay(log).identical


def test_a_server_that_is_gone_is_said_and_its_successor_is_found(server, chromium):
    with student(chromium, server) as one:
        one.starts()
        server.kill()
        one.sees("lost")
        one.reads("#latch", "use the rig's own switch")
        one.page.keyboard.press("Escape")
        one.reads("#message", "STOP could not be sent")
        server.open()
        one.sees("stopped")  # by the stop that was still to be sent
        one.leaves()


@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_nothing_nothing_is_clipped_and_stop_lies_open(server, chromium, dark, tmp_path):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    violations = []
    for kind in (DESK, {"viewport": {"width": 768, "height": 900}}, {"viewport": {"width": 390, "height": 844}}, PHONE):
        with student(chromium, server, dark=dark, **kind) as one:
            width = kind["viewport"]["width"]
            one.page.wait_for_selector("#drawing polyline", state="attached")
            for screen in (*SCREENS, "run", "track"):  # the last two beside the guide
                if kind is not PHONE:
                    one.page.click(f"#tab-{screen}")
                    if screen == SCREENS[-1]:
                        guided(one)
                if screen == "design" and kind is not PHONE:
                    one.reads("#share", "rigs are stabilised")
                present = axe.Axe().run(one.page).response["violations"]
                violations += [(width, screen, v["id"], [n["html"][:100] for n in v["nodes"]]) for v in present]
                until(one.page, f"document.documentElement.scrollWidth <= {width}")
                assert settled(one.page, f"({COVERS})()") == []
                assert settled(one.page, SPILLS) == []
            name, stop = (one.page.locator(q).bounding_box() for q in ("#rig-name", "#stop"))
            assert width < 700 or stop["y"] < name["y"] + name["height"], "STOP stands below the first row"
            assert one.wrong == []
            assert one.foreign(server) == []
    assert violations == []


def test_the_first_load_is_below_400_kB_and_asks_nobody_else(server, chromium):
    loaded = []
    with student(chromium, server) as one:
        one.page.on("response", lambda response: loaded.append(response))
        one.page.reload()
        one.page.wait_for_selector("#tab-design:not([hidden])")
        one.page.click("#tab-design")
        one.reads("#share", "rigs are stabilised")
        assert one.foreign(server) == []
    sizes = [(response.url, int(response.headers["content-length"])) for response in loaded]
    assert 10_000 < sum(size for _, size in sizes) < LIGHT, sizes


def test_a_whole_session_by_touch(server, chromium):
    """Let go at what is held and tapped lightly: however slowly its time goes, that throws no pendulum over."""
    tablet, sent = {"viewport": {"width": 1024, "height": 768}, "has_touch": True}, []

    def listen(page):
        page.on("websocket", lambda socket: socket.on("framesent", lambda frame: sent.append(str(frame))))

    with student(chromium, server, prepare=listen, **tablet) as one:
        page = one.page
        page.wait_for_selector("#tab-design:not([hidden])")
        page.fill("#next label:has-text('start') input", "0")
        page.fill("#next label:has-text('tap') input", "0.2")
        page.tap("#start")
        one.sees("running")
        one.reads("#rig-note", "touch it")
        page.touchscreen.tap(40, 300)  # a finger beside the pendulum taps it
        one.until(lambda: any('"tap"' in message for message in sent))
        page.tap("#tab-design")
        one.reads("#share", "rigs are stabilised")
        x, y = pole_at(page)
        before = page.inner_text("#pairs tr:first-child td:last-child")
        finger = page.context.new_cdp_session(page)
        for kind, step in (("touchStart", 0), ("touchMove", 8), ("touchMove", 16), ("touchEnd", None)):
            points = [] if step is None else [{"x": x - step, "y": y - step}]
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        page.wait_for_selector("#apply[aria-disabled=false]")
        page.wait_for_function(ANOTHER_PLACE, arg=before)
        page.wait_for_selector("#share[aria-busy=false]")
        page.tap("#apply")
        one.reads("#message", r"act from tick \d+")
        page.tap("#stop")
        one.sees("stopped")
        one.leaves()
        assert one.wrong == []


def test_of_several_rigs_each_has_its_page_and_one_without_a_drawing_says_why(chromium, tmp_path):
    for name, make in (("cart", "linear"), ("disks", "torsional")):
        at = "" if make == "linear" else 'at = "rest"\n'
        (tmp_path / f"{name}.toml").write_text(f'kind = "twin"\nname = "{name}"\nmake = "{make}"\n{at}', "utf-8")
    several = Server(tmp_path / "runs", tmp_path / "cart.toml", tmp_path / "disks.toml")
    with closing(several), student(chromium, several) as one:
        one.reads("#rig-name", "cart")
        one.reads("#strips", r"cart \[cm\]")
        one.page.click("#rigs a:has-text('disks')")
        one.reads("#rig-name", "disks")
        one.reads("#rig-note", "needs a rig with one drive and an inverted equilibrium")
        assert not one.page.locator("#tab-design").is_visible()
        one.page.select_option("#filter", "0.9")
        one.page.wait_for_function("() => document.querySelector('#velocity-why')?.textContent.includes('a = 0.9 ')")
        one.page.check("#velocities")
        one.reads("#strips", r"velocity of the .* \[deg/s\]")
        one.starts()
        one.reads("#readings", "deg")
        tab_to(one.page, "#tab-run")
        for _ in ("identify", "track"):  # Design is not there
            one.page.keyboard.press("ArrowRight")
        one.reads("#track-model", "linear model with the command's limit")
        one.page.select_option("#shape", "sine")
        one.page.fill("#wave-size", "540")
        one.page.fill("#wave-period", "0.5")
        one.page.keyboard.press("Enter")
        one.reads("#track-gate", r"at its limit for \d\d % of the time")
        one.page.select_option("#shape", "step")
        one.page.fill("#wave-size", "30")
        one.page.keyboard.press("Enter")
        tab_to(one.page, "#follow")
        one.page.keyboard.press("Enter")
        one.reads("#track-now", "step, 30.0 deg")
        one.reads("#track-figures", r"error, rms, last second\s*(0\.\d|below one count)")  # the far disk is there
        one.leaves()
        assert one.wrong == []


def test_all_samples_of_1_kHz_take_less_than_15_kB_a_second(server, chromium):
    """Of a client, with 40 frames a second; how many samples come in one is the machine's affair."""
    frames = []

    def samples():
        return [frame for frame in frames if isinstance(frame, bytes)]

    def listen(page):
        page.on("websocket", lambda socket: socket.on("framereceived", lambda frame: frames.append(frame)))

    with student(chromium, server, prepare=listen) as one:
        one.starts()
        one.until(lambda: len(samples()) >= 10)
        one.leaves()
    for frame in samples():
        ticks, encoders = int.from_bytes(frame[4:6], "little"), frame[6]
        each = 2 * (encoders + 1)  # bytes of a sample: an i16 for every encoder and one for the command
        assert ticks > 0
        assert 1000 * each + 40 * (len(frame) - each * ticks) < 15_000


def test_on_hardware_poles_are_applied_only_after_a_second_press(server, chromium):
    """The server's twin, told to the page as hardware on its way through the socket."""
    sent = []

    def between(route):
        real = route.connect_to_server()
        real.on_message(lambda m: route.send(m.replace('"TWIN"', '"HARDWARE"') if isinstance(m, str) else m))
        route.on_message(lambda m: (sent.append(m), real.send(m)))

    with student(chromium, server, prepare=lambda page: page.route_web_socket(re.compile("/live/"), between)) as one:
        page = one.page

        def confirmed():
            one.until(lambda: any("poles" in message for message in sent), "a request for poles")
            return next(m for m in sent if "poles" in m).endswith('"confirm":true}')

        page.wait_for_selector(".badge.hardware")
        assert not page.locator("#tap").is_visible()
        one.starts()
        page.click("#tab-design")
        page.click("#apply")
        one.reads("#gate", "This moves a real rig")
        assert not any("poles" in message for message in sent)
        page.click("#cancel")
        page.click("#apply")
        page.click("#apply")
        one.reads("#message", "act from tick")
        assert confirmed()
        sent.clear()
        page.click("#guide-toggle")
        while not page.locator("#guide-answer input[type=radio]").count():  # until the sets of poles are asked about
            page.fill("#guide-answer input", "1")
            page.click("#guide-predict")
            page.click("#guide-next")
        page.locator("#guide-answer input").first.check()
        page.click("#guide-predict")
        page.click("#guide-actions >> text=Apply set 1")
        page.wait_for_selector("text=Confirm: apply set 1 to HARDWARE")
        assert not any("poles" in message for message in sent)
        page.click("text=Confirm: apply set 1 to HARDWARE")
        page.wait_for_selector("#guide-actions >> text=Apply set 1")
        assert confirmed()
        one.leaves()


PRESSED_AT_ONCE = """() => {
  const [frequency, ratio] = document.querySelectorAll('#pairs input');
  for (const [input, value] of [[frequency, 0.5], [ratio, 0.05]]) {
    input.value = value;
    input.dispatchEvent(new Event('change'));
  }
  document.querySelector('#apply').click();
}"""
HOLDS = """() => {
  window.held = []; window.holds = () => false;
  window.letGo = () => { window.holds = () => false; for (const hear of window.held.splice(0)) hear(); };
  window.WebSocket = class extends WebSocket {
    set onmessage(hear) {
      super.onmessage = (event) => {
        const text = typeof event.data === 'string' ? event.data : '{}';
        if (window.holds(JSON.parse(text))) window.held.push(() => hear(event));
        else hear(event);
      };
    }
  };
}"""
"""Keeps some notes from a page until they are let go."""
HEARS = """() => {
  window.heard = []; window.drawn = 0;
  const count = () => { window.drawn += 1; requestAnimationFrame(count); };
  requestAnimationFrame(count);
  window.WebSocket = class extends WebSocket {
    set onmessage(hear) {
      super.onmessage = (event) => {
        if (event.data instanceof ArrayBuffer) {
          const view = new DataView(event.data);
          window.heard.push([view.getUint32(0, true), view.getUint16(4, true)]);
        }
        hear(event);
      };
    }
  };
}"""
"""Keeps first tick and number of samples of every frame that a page is given, and counts what it draws."""


def test_a_page_behind_another_tab_is_given_every_sample_and_still_stops(server, chromium):
    with student(chromium, server, prepare=lambda page: page.add_init_script(f"({HEARS})()")) as one:
        page = one.page
        one.starts()
        page.wait_for_function("() => window.heard.length > 40")
        other = page.context.new_page()
        other.goto("about:blank")
        other.bring_to_front()
        other.wait_for_timeout(500)
        drawn, before = page.evaluate("[window.drawn, window.heard.at(-1)]")
        other.wait_for_timeout(4000)
        drawn = page.evaluate("window.drawn") - drawn
        if drawn > 60:
            pytest.skip(f"this browser drew {drawn} times on in 4 s behind another tab")
        page.bring_to_front()
        other.close()
        more = page.evaluate("window.drawn")
        page.wait_for_function("more => window.drawn > more + 10", arg=more)
        heard = page.evaluate("window.heard")
        firsts, counts = np.array(heard).T
        assert np.array_equal(firsts[1:], firsts[:-1] + counts[:-1])  # no tick is missing, none is given twice
        assert firsts[-1] - before[0] > 0.5 * 4.0 / RIG.period  # some are of the time behind, however busy the machine
        shown = float(page.locator("#clock").inner_text().split()[0])
        assert shown >= firsts[-1] * RIG.period - 0.1
        page.keyboard.press("Escape")
        one.sees("stopped")
        one.leaves()
        assert one.wrong == []
