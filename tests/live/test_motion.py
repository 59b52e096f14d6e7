"""Does the page of a run show, at every time, where the rig was and where the model says that it was?"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import upright as up
from tests.live.browser import WIDTHS, opened, until
from upright.basis import SIMULATED
from upright.identification import RunScore
from upright.live.motion import MOST, RATE, _strip, motion_page
from upright.live.page import still
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
        until(page, f"document.documentElement.scrollWidth <= {width}")
        violations = axe.Axe().run(page).response["violations"]
        assert [(v["id"], [n["html"][:100] for n in v["nodes"]]) for v in violations] == []
        assert wrong == []


@pytest.mark.slow
def test_without_a_script_rig_and_traces_are_there(written):
    with opened(written, script=False) as (page, _):
        assert page.locator("#rig polyline").count() >= 3
        assert page.locator("svg.strip polyline").count() == 4
        assert not page.locator("#scrub").is_visible()


def numbers_of(packed):
    """What a page unpacks: a middle, and levels of 16 bits about it."""
    return packed["middle"] + packed["scale"] * np.frombuffer(base64.b64decode(packed["levels"]), dtype="<i2")


def test_a_picture_shows_the_record_at_its_time_and_what_nobody_measured_as_the_model_has_it():
    """Straight lines from 2 s on, so that between two samples the middle is right; four seconds are 241 pictures."""
    t = np.array([2.0, 3.0, 6.0])
    text = motion_page(ARM, t, {"theta": 2 * t}, {"psi": -t, "theta": 3 * t}, name="run", remark="Read this.")
    data = json.loads(re.search(r"const RUN = (\{.*?\});\n", text)[1])
    assert (data["frames"], data["start"], data["step"]) == (241, 2.0, pytest.approx(4 / 240))
    psi, theta = data["coordinates"]
    grid = 2.0 + np.arange(241) / 60
    assert psi["measured"] is None
    for shown, values in ((psi["simulated"], -grid), (theta["measured"], 2 * grid), (theta["simulated"], 3 * grid)):
        np.testing.assert_allclose(numbers_of(shown), values, atol=24 / 2**16)
    assert [(c["name"], c["unit"]) for c in (psi, theta)] == [("psi", "rad"), ("theta", "rad")]
    assert "Read this." in text
    brief = motion_page(ARM, np.array([0.0, 1e-3]), {}, {"theta": np.zeros(2)}, name="run")
    assert json.loads(re.search(r"const RUN = (\{.*?\});\n", brief)[1])["frames"] == 2


def sixtieths(seconds=2.0, **columns):
    """A record with a sample for every picture of its page."""
    t = np.linspace(0.0, seconds, round(60 * seconds) + 1)
    units = {n: "m" if n == "x" else "rad" for n in columns}
    return up.Record(t=t, signals={n: f(t) for n, f in columns.items()}, units=units)


SWUNG = {"psi": lambda t: 0.4 * np.sin(2 * t), "theta": lambda t: np.cos(7 * t) * np.exp(-0.2 * t)}


def motion_in(page):
    """Word and angles of every coordinate that a page plays, by its name."""
    data = json.loads(re.search(r"const RUN = (\{.*?\});\n", page)[1])
    kinds = ("measured", "simulated")
    return {c["name"]: {k: numbers_of(c[k]) for k in kinds if c[k] is not None} for c in data["coordinates"]}


def test_a_record_is_played_at_its_own_angles_and_called_measured(tmp_path):
    """A picture at every sample, so nothing is interpolated: half a 16-bit level of the range is lost."""
    record = sixtieths(**SWUNG)
    played = record.play(ARM, out=tmp_path / "run.html")
    shown = motion_in(played.page)
    assert [*shown] == ["psi", "theta"]
    for name, words in shown.items():
        assert [*words] == ["measured"]
        np.testing.assert_allclose(words["measured"], record[name], atol=np.ptp(record[name]) / 2**16)
    assert "simulated motion" not in played.page
    assert "SIMULATED" not in played.page + repr(played)
    assert (tmp_path / "run.html").read_text(encoding="utf-8") == played.page
    policy = html.unescape(re.search(r'Content-Security-Policy" content="([^"]*)"', played.page)[1])
    body = re.search(r'<script id="script">(.*)</script>', played.page, re.DOTALL)[1]
    digest = base64.b64encode(hashlib.sha256(body.encode()).digest()).decode()
    alone = f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'sha256-"  # and nothing is fetched
    assert policy.startswith(alone)


def test_degrees_of_a_log_are_drawn_as_the_same_angles():
    record = sixtieths(**SWUNG)
    degrees = record.replace(signals={n: np.degrees(record[n]) for n in record}, units={"psi": "deg", "theta": "deg"})
    for name, words in motion_in(degrees.play(ARM).page).items():
        np.testing.assert_allclose(words["measured"], record[name], atol=np.ptp(record[name]) / 2**15)


def test_what_was_simulated_is_played_by_the_plant_that_moved_and_says_so():
    """A rod let go at 0.1 rad is back after 2 pi sqrt(J/(m g l)) = 2 pi sqrt(4 l/3 g), l half its length."""
    rod = up.Pendulum(m_p=0.2, l_cg=0.15, J_p=0.2 * 0.15**2 / 3)
    period = 2 * math.pi * math.sqrt(4 * 0.15 / (3 * rod.g)) * (1 + 0.1**2 / 16)
    run = up.simulate(rod, start={"theta": 0.1}, seconds=period, dt=period / 500)
    played = run.play()
    assert [*motion_in(played.page)["theta"]] == ["simulated"]
    assert motion_in(played.page)["theta"]["simulated"][[0, -1]] == pytest.approx(0.1, abs=1e-4)
    assert played.chapter.first_line == SIMULATED
    assert SIMULATED in played.page
    assert "simulated motion" in played.page
    assert run.window(0.1, 0.3).play().value.t[0] == pytest.approx(0.1, abs=period / 500)  # a part knows its plant


def test_a_coordinate_that_no_column_has_is_named_and_drawn_at_zero_without_a_trace():
    page = sixtieths(theta=np.sin).play(ARM).page
    assert motion_in(page)["psi"] == {}
    assert "Not in the record, drawn at zero: psi." in page
    assert page.count('<svg class="strip"') == 1
    assert 'id="value-1"' in page


@pytest.mark.parametrize(
    ("record", "rig", "words"),
    [
        (sixtieths(**SWUNG), None, r"play needs what moved, with its numbers: run\.play\(rig\)"),
        (sixtieths(roll=np.sin), ARM, "columns called psi, theta, and the record has roll; rename them"),
        (sixtieths(**SWUNG), 3, "got int"),
        (sixtieths(**SWUNG).replace(units={"theta": "V"}), ARM, "draws theta in rad, and its column is in V"),
        (sixtieths(**SWUNG).replace(units={"theta": "counts"}), ARM, "its column is in counts; convert it first"),
    ],
)  # fmt: skip
def test_what_cannot_be_played_is_a_sentence(record, rig, words):
    with pytest.raises(up.BadInput, match=words):
        record.play(rig)


@pytest.mark.slow
def test_a_run_that_was_only_measured_moves_alone(tmp_path):
    record = sixtieths(**SWUNG)
    record.play(ARM, out=tmp_path / "run.html")
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with opened(tmp_path / "run.html", width=360) as (page, wrong):
        until(page, "window.motion !== undefined")
        until(page, "document.documentElement.scrollWidth <= 360")
        assert [v["id"] for v in axe.Axe().run(page).response["violations"]] == []
        assert page.locator("#rig g").count() == 1
        for k in (0, 60, 120):
            page.locator("#scrub").fill(str(k))
            for i, name in enumerate(SWUNG):
                text = page.inner_text(f"#value-{i}").replace("\u2212", "-")
                assert re.fullmatch(r"measured -?[\d.]+°", text)
                assert float(text[9:-1]) == pytest.approx(math.degrees(record[name][k]), abs=0.06)
        assert wrong == []


def test_a_strip_is_the_record_with_a_tenth_of_room_and_the_model_within_it():
    """From 0 to 1 rad the box spans -0.1 to 1.1: the record ends 1/12 of 100 below its top, a model beyond it there."""
    rise = np.linspace(0.0, 1.0, 5)
    t = np.linspace(2.0, 3.0, 5)
    drawn = _strip("theta", "rad", t, rise, 3 * rise)
    points = [tuple(map(float, pair.split(","))) for pair in drawn["measured"].split()]
    np.testing.assert_allclose(points, np.column_stack([250 * np.arange(5), 100 * (1.1 - rise) / 1.2]), atol=0.01)
    model = [tuple(map(float, pair.split(","))) for pair in drawn["simulated"].split()]
    assert model[0] == pytest.approx((0.0, 100 * 1.1 / 1.2), abs=0.01)
    assert model[-1] == (1000.0, 0.0)
    assert drawn["range"] == "[−5.73 to 63 deg]"
    assert drawn["label"] == "θ over time, from −5.73 to 63 deg"
    cart = _strip("x", "m", t, None, 0.2 * rise)
    assert (cart["measured"], cart["range"]) == ("", "[−2 to 22 cm]")
    still = _strip("x", "m", t[:3], np.zeros(3), np.zeros(3))
    assert still["range"] == "[−0.1 to 0.1 cm]"
    assert {pair.split(",")[1] for pair in still["simulated"].split()} == {"50"}
    uneven = _strip("x", "m", np.array([2.0, 2.1, 3.0]), None, np.arange(3.0))["simulated"].split()
    assert [float(pair.split(",")[0]) for pair in uneven] == pytest.approx([0, 100, 1000])


def test_of_a_million_samples_the_page_shows_the_one_that_stands_out_and_stays_small():
    """Seen by no picture of the rig, one in 277 samples: the trace has it at its time, 1 rad above all others."""
    t = np.arange(1_000_000) * 1e-3
    theta = 0.1 * np.sin(t)
    theta[123_456] = 1.1
    page = motion_page(ARM, t, {"theta": theta}, {}, name="run")
    line = re.search(r'class="q1 measured" points="([^"]*)"', page)[1].split()
    points = np.array([[float(x) for x in pair.split(",")] for pair in line])
    top = points[points[:, 1].argmin()]
    assert top[0] == pytest.approx(123.456, abs=0.05)
    assert top[1] == pytest.approx(100 * 0.12 / (1.2 * 1.2), abs=0.01)
    assert np.sort(points[:, 1])[1] == pytest.approx(100 * 1.12 / (1.2 * 1.2), abs=0.01)  # the crest of the sine
    assert "a picture every 0.28 s, traces with every extreme" in page
    assert len(page) < 100_000


def test_predictions_that_overlap_are_shown_in_the_order_of_their_times():
    run = swing()
    mixed = np.random.default_rng(3).permutation(run.t.size)
    shuffled = replace(run, t=run.t[mixed], y=run.y[mixed], simulated=run.simulated[mixed], horizon=0.5)
    plain, told = (played_run(r, ARM, "tail").page for r in (run, shuffled))
    assert re.search(r"const RUN = .*", plain)[0] == re.search(r"const RUN = .*", told)[0]
    assert "Predicted 0.5 s ahead, again and again." in told
    assert "again and again" not in plain
    alone = replace(
        run, y=run.y[:, 1:], simulated=run.simulated[:, 1:], measured=("theta",), fit_percent={"theta": 95.0}
    )
    assert "Not measured, drawn at zero: psi." in played_run(alone, ARM, "tail").page
    assert "drawn at zero" not in plain
    assert played_run(alone, ARM, "tail").chapter.verdict.endswith("of 'tail': theta 95.0 %.")
    assert 'height="760"' in played_run(run, ARM, "tail")._repr_html_()


class Drawn:
    """A plant whose lines are said; the second is the pendulum's."""

    def __init__(self, *lines):
        self.lines, self.coordinates = lines, [SimpleNamespace(name="x"), SimpleNamespace(name="theta")]

    def outline(self, _plant, q):
        return self.lines


def places(picture):
    return [
        [tuple(map(float, pair.split(","))) for pair in line.split()] for line in re.findall(r'points="(.*?)"', picture)
    ]


def test_what_moves_in_a_plane_is_drawn_in_it_and_what_does_not_from_above_and_aside():
    """Seen from 25 degrees aside and 20 above: the axes' pictures are columns of two rotations."""
    view, picture = still(Drawn(("", [(0, 0, 0), (1, 0, 0)]), ("theta", [(0, 0, 0), (0, 0, -2)])), [0.0, 0.0])
    assert places(picture) == [[(0, 0), (1, 0)], [(0, 0), (0, 2)]]  # down is down
    assert re.findall(r'class="(\w+)"', picture) == ["fixed", "q1"]
    assert [float(n) for n in view.split()] == pytest.approx([-2.2, -2.3, 4.4, 4.6])
    widths = [float(n) for n in re.findall(r'stroke-width="(.*?)"', picture)]
    assert widths == pytest.approx([0.7 * 0.044, 1.8 * 0.044])
    axes = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    view, picture = still(Drawn(*(("x", [(0, 0, 0), axis]) for axis in axes)), [0.0, 0.0])
    c, s, C, S = (f(math.radians(a)) for a in (25, 20) for f in (math.cos, math.sin))
    seen = [line[1] for line in places(picture)]
    np.testing.assert_allclose(seen, [(c, s * S), (s, -c * S), (0, -C)], atol=1e-4)
    assert [float(n) for n in view.split()] == pytest.approx([-1.1, -1.15, 2.2, 2.3])
    flat = still(Drawn(("x", [(0, 0, 0), (4, 0, 0)])), [0.0, 0.0])[0]
    assert [float(n) for n in flat.split()] == pytest.approx([-4.4, -2.3, 8.8, 4.6])  # half as high as it reaches
