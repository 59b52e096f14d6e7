"""Does the bench identify what was recorded on it and what somebody brings, and does it outlive what is no log?"""

from __future__ import annotations

import io
import json
import os
import random
import re
import shutil
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.browser.runs import record_first_motions, twin
from tests.browser.students import DESK, Server, student
from tests.browser.test_fits import ask
from tests.browser.test_page import tab_to
from tests.browser.test_served import client, got
from tests.live.browser import settled, until
from upright.browser.identify.work import identify_log
from upright.browser.serve import Bench
from upright.experiments.stand.known import bench_values
from upright.progress import silent
from upright.rig.makes import make_named, make_rig

pytestmark = pytest.mark.slow

SEED = 3
"""Of the twin that is identified: its numbers are not those of the design, from which the search begins."""
LONG = 300
"""Seconds that a log may take to be read on a loaded machine."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder of the bench with first motions of a twin."""
    folder = tmp_path_factory.mktemp("recorded")
    rig = twin(folder)
    rig.rig_path.write_text(rig.rig_path.read_text("utf-8") + f"seed = {SEED}\n", encoding="utf-8")
    return folder, rig, record_first_motions(rig, folder / "furuta", started=1.8e9)


def test_first_motions_keep_the_arm_near_the_middle_and_leave_the_pendulum_nearly_still(recorded):
    _, rig, run = recorded
    arm, pendulum = (run.log.columns[name] for name in ("psi", "theta"))
    assert run.end.stopped == ""
    assert np.abs(arm).max() < rig.model.travel / 4
    assert 0.5 < np.abs(pendulum).max() < np.pi / 2
    assert np.ptp(pendulum[-1000:]) < 0.5 * np.ptp(pendulum)


def test_the_numbers_of_a_twin_are_recovered_from_its_first_motions(recorded, tmp_path):
    """Which differ from those of its design by up to a quarter; each interval that says 95 % is taken twice as wide."""
    folder, rig, _ = recorded
    file = replace(rig.file, seed=SEED)  # as a class has it, whose RIG.toml names nobody's seed
    verdict = identify_log(folder / "furuta/run.mcap", "run.mcap", file, {}, tmp_path / "fit", silent)
    assert verdict.startswith("Rely on this model")
    truth = make_rig("furuta", SEED)
    true = {**truth.plant.parameters(), "actuator.gain": truth.gain, "actuator.lag": truth.lag}
    stored = json.loads((tmp_path / "fit/fit.json").read_text())["parameters"]
    make = make_named("furuta")
    measured = bench_values(truth, make)  # a fit moves them within their tolerance; the design's mass is off by seven
    assert all(abs(stored[n]["value"] - measured[n]) < 2 * s * measured[n] for n, s in make.bench.items())
    estimated = {n: e for n, e in stored.items() if e["status"] != "known"}
    assert estimated.keys() == {"J_d", "J_p", "b_1", "b_2", "b_1c", "b_2c", "actuator.gain", "actuator.lag"}
    for name, e in estimated.items():
        low, high = e["interval"]
        assert abs(e["value"] - true[name]) < min(high - low, 0.03 * true[name]), name
    facts = json.loads((tmp_path / "fit/facts.json").read_text())
    assert {(c["signal"], c["role"]) for c in facts["curves"]} == {("psi", "predict"), ("theta", "predict")}
    for curve in facts["curves"]:  # drawn is what was measured and what was predicted of it
        t = np.array(curve["measured"][0])
        model = np.interp(t, *curve["predicted"])
        assert np.abs(model - np.array(curve["measured"][1])).max() < 0.05 * np.ptp(curve["measured"][1])


def _zipped(name, size, **others):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as file:
        for other, text in others.items():
            file.writestr(other.replace("__", "/"), text)
        with file.open(name, "w", force_zip64=True) as member:
            for _ in range(size >> 24):
                member.write(bytes(1 << 24))
    return content.getvalue()


def _matlab(size):
    """MATLAB version 5 with one packed element that unpacks to so many zeros."""
    packer = zlib.compressobj(9)
    packed = b"".join(packer.compress(bytes(1 << 24)) for _ in range(size >> 24)) + packer.flush()
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + (15).to_bytes(4, "little") + len(packed).to_bytes(
        4, "little"
    ) + packed  # fmt: skip


GIGABYTE = 1 << 30
NO_LOGS = {
    "nothing": lambda: b"",
    "random bytes": lambda: random.Random(0).randbytes(1 << 20),
    "random text": lambda: "".join(random.Random(1).choices("0123456789.,;-e \n\t", k=1 << 20)).encode(),
    "a row without an end": lambda: b"t,x\n" + b"1" * (19 << 20),
    "a million columns": lambda: b"\n".join([b",".join(b"%d" % k for k in range(1_000_000))] * 2),
    "only line ends": lambda: b"\n" * (19 << 20),
    "a workbook that is a bomb": lambda: _zipped("xl/worksheets/sheet1.xml", GIGABYTE, xl__workbook_xml="<workbook/>"),
    "arrays that are a bomb": lambda: _zipped("x.npy", GIGABYTE),
    "a MATLAB file that is a bomb": lambda: _matlab(GIGABYTE),
    "a packed text": lambda: b"\x1f\x8b\x08" + random.Random(2).randbytes(1000),
    "a torn log": lambda: b"\x89MCAP0\r\n" + random.Random(3).randbytes(10_000),
}


WORST = ("random bytes", "a million columns", "a workbook that is a bomb", "a MATLAB file that is a bomb")


@pytest.mark.parametrize(
    "names", [WORST, pytest.param(tuple(NO_LOGS), marks=pytest.mark.thorough)], ids=["worst", "all"]
)
def test_whatever_is_brought_the_answer_is_a_sentence_and_the_bench_goes_on(recorded, tmp_path, names):
    # the page of this test reads nothing, while it waits for answers
    with Bench([recorded[1]], tmp_path) as bench, client(bench, max_queue=None) as page:
        for name in names:
            data = NO_LOGS[name]()
            status, _, text = ask(bench, "api/rigs/furuta/logs?name=it.csv", page.me, data=data, wait=LONG)
            assert (status, text[:1].isupper() or text[:1] == "'", text[-1:]) == (400, True, "."), (name, text)
            assert "Traceback" not in text
            assert got(bench, "api/rigs")[0] == 200
        assert json.loads(got(bench, "api/rigs/furuta/fits")[2])["logs"] == []
        assert list((tmp_path / "furuta" / "uploads").iterdir()) == []


@pytest.fixture(scope="module")
def server(recorded, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    shutil.copytree(recorded[0] / "furuta", folder / "furuta")
    opened = Server(folder)
    yield opened
    opened.close()


def identified(one, verdict):
    """Wait for the fit that was begun, and look at what stands there."""
    one.reads("#fit-status", "The fit is written")
    one.reads("#fit-verdict", verdict)
    assert one.page.locator("#fit-pictures canvas").count() >= 1
    one.page.click("#fit-report")
    one.page.frame_locator("#fit-frame").locator("h1").wait_for()
    one.page.wait_for_selector("#fit-frame:not(.unheard)")


def shows_a_fit(page):
    """Choose the newest fit; a recording that came later is shown instead until somebody does."""
    page.wait_for_selector("#fit-list option", state="attached")
    page.select_option("#fit-list", index=0)
    page.wait_for_selector("#fit-result:not([hidden])")


@pytest.fixture(scope="module")
def fitted(server, chromium):
    """The server with a fit, whichever of these tests came before."""
    if not list((server.folder / "furuta/fits").glob("fit-*/fit-*.json")):
        with student(chromium, server, screen="identify") as one:
            one.page.wait_for_selector("#fit-log option", state="attached")
            one.page.click("#fit-begin")
            one.reads("#fit-step", "evaluations")
            one.page.click("#fit-interrupt")
            identified(one, ".")
            one.leaves()
    return server


def test_a_run_is_identified_by_keyboard_alone(server, chromium):
    with student(chromium, server, screen="identify") as one:
        page = one.page
        page.wait_for_selector("#fit-log option", state="attached")
        tab_to(page, "#fit-begin")
        page.keyboard.press("Enter")
        one.reads("#fit-step", "evaluations")
        one.reads("#fit-live-says", r"After \d+ simulations the latest step explains ψ")
        one.until(lambda: page.locator("#fit-live-pictures canvas").count() == 2, "a curve for each signal")
        tab_to(page, "#fit-interrupt")
        identified(one, "model")
        assert page.locator("#fit-rows th", has_text="inertia of disk and arm").count() == 1
        with page.expect_download() as download:
            page.click("#fit-file-link")
        assert json.loads(Path(download.value.path()).read_text())["plant"] == "furuta"
        page.frame_locator("#fit-frame").locator("h1").click()
        page.keyboard.press("Escape")  # is heard in the report too
        one.sees("stopped")
        one.leaves()
        assert one.wrong == []
        assert one.foreign(server) == []


def test_first_motions_are_recorded_and_identified_by_mouse_and_a_fit_can_be_interrupted(server, chromium):
    with student(chromium, server, screen="identify") as one:
        page = one.page
        page.wait_for_selector("#fit-log option", state="attached")
        before = page.locator("#fit-log option").count()
        page.click("#fit-motions")
        one.sees("running")
        one.presses("#fit-motions")
        one.reads("#fit-status", "runs already")
        one.sees("ended")
        page.wait_for_function("n => document.querySelectorAll('#fit-log option').length > n", arg=before)
        assert page.locator("#fit-log").input_value() != "run"
        written = []
        page.route(re.compile(r"/fits/fit-\d+\.json$"), lambda route: written.append(route))
        page.click("#fit-begin")
        one.reads("#fit-step", "evaluations")
        page.click("#fit-interrupt")
        one.until(lambda: written, "the request for the fit")
        assert "is written" not in page.inner_text("#fit-status")  # not before it stands there
        written.pop().continue_()
        identified(one, ".")
        one.leaves()
        assert one.wrong == []


def test_a_sweep_a_step_and_a_weighing_are_drawn_as_they_come_and_stop_as_every_run_does(server, chromium):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    with student(chromium, server, screen="identify") as one:
        page = one.page
        page.click("#record-sweep")
        one.reads("#record-says", r"0 of 10 sines measured, \d+ s of 1\d\d s")
        assert page.locator("#record-pictures canvas").count() == 4
        page.keyboard.press("Escape")
        one.sees("stopped")
        one.rearms()
        page.click("#record-step")
        one.reads("#record-reading", r"measured swing\d\.\d+ ± ")
        assert page.locator("#record-pictures canvas").count() == 2
        page.click("#end")
        one.reads("#record-says", "kept as a run")
        page.reload()  # as after another model came into use; what was recorded is drawn again
        one.reads("#record-reading", r"measured swing\d\.\d+ ± ")
        inked = "c.width && c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v)"
        until(page, f"[...document.querySelectorAll('#record-pictures canvas')].every((c) => {inked})")
        violations = axe.Axe().run(page).response["violations"]
        page.click("#weigh")
        one.reads("#weigh-says", "A line explains all 5 loadings")
        one.reads("#weigh-rows", "stiffness of the spring2\\.\\d+ ±")
        one.reads("#weigh-title", "SIMULATED")
        assert violations + axe.Axe().run(page).response["violations"] == []
        if page.locator("#fit-list option").count():
            assert page.input_value("#fit-list") == ""  # and any fit may be chosen, the newest too
        one.leaves()
        assert one.wrong == []
        assert one.foreign(server) == []


@pytest.mark.thorough  # it identifies twice
def test_a_log_that_is_none_is_refused_and_a_stranger_s_is_identified(server, chromium, tmp_path):
    data = os.environ.get("UPRIGHT_REAL_DATA", "")
    log = Path(data) / "pendulum_cart_coulomb_aau/pend1test/test1pend1.csv"
    if not data or not log.is_file():
        pytest.skip("UPRIGHT_REAL_DATA does not name the folder of public logs")
    (tmp_path / "novel.csv").write_text("It was a dark and stormy night.\n", encoding="utf-8")
    with student(chromium, server, screen="identify") as one:
        page = one.page
        page.on("filechooser", lambda _: None)  # caught from now on: the first one asked for may come too soon
        tab_to(page, "#fit-file")
        with page.expect_file_chooser() as chooser:
            page.keyboard.press("Space")
        chooser.value.set_files(tmp_path / "novel.csv")
        one.reads("#fit-status", "'novel.csv'.*rows of numbers")
        page.set_input_files("#fit-file", log)
        one.reads("#fit-status", "test1pend1.csv is there")
        one.reads("#fit-about", "10,442 rows")
        page.click("#fit-begin")
        identified(one, ".")
        assumed = {box.get_attribute("name") for box in page.locator("#fit-assumed input").all()}
        assert {"m_p", "J_p"} <= assumed
        page.click("#fit-again")
        one.reads("#fit-status", "Type what you measured first")
        page.fill("#fit-assumed input[name=m_p]", "0.2 parsec")
        page.click("#fit-again")
        one.reads("#fit-status", "parsec")
        page.fill("#fit-assumed input[name=m_p]", "0.2 kg")
        page.click("#fit-again")
        one.reads("#fit-status", "Identifying")
        one.reads("#fit-status", "The fit is written")
        page.wait_for_selector("#fit-assumed input[name=m_p]", state="detached")  # it is assumed no more
        one.leaves()
        assert [text for text in one.wrong if "400" not in text] == []


def test_who_watches_reads_the_fit_and_is_refused_with_a_reason(fitted, chromium):
    with student(chromium, fitted, screen="identify") as one, student(chromium, fitted, screen="identify") as another:
        one.page.click("#control")
        one.reads("#operator", "You operate")
        another.reads("#operator", "Watching")
        another.page.wait_for_selector("#fit-begin[aria-disabled=true]")
        another.presses("#fit-begin")
        another.reads("#fit-status", "you cannot steer it")
        assert another.page.locator("#fit-file").is_disabled()
        shows_a_fit(another.page)
        one.leaves()


@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_nothing_on_a_fit_and_nothing_is_clipped(fitted, chromium, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    violations = []
    for kind in (DESK, {"viewport": {"width": 768, "height": 900}}, {"viewport": {"width": 390, "height": 844}}):
        with student(chromium, fitted, screen="identify", dark=dark, **kind) as one:
            shows_a_fit(one.page)
            present = axe.Axe().run(one.page).response["violations"]
            violations += [(kind["viewport"], v["id"], [n["html"][:100] for n in v["nodes"]]) for v in present]
            until(one.page, f"document.documentElement.scrollWidth <= {kind['viewport']['width']}")
            spills = "[...document.querySelectorAll('#identify .panel')].filter(e => e.scrollWidth > e.clientWidth + 1)"
            assert settled(one.page, f"{spills}.length") == 0
            assert one.foreign(fitted) == []
    assert violations == []
