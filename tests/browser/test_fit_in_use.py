"""Does a fit of the bench become the model of its rig, with a law of its own, and does what is not trusted stay out?"""

from __future__ import annotations

import json
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

import upright as up
from tests.browser.runs import SOON, ByHand, hardware, twin
from tests.browser.students import Server, student
from tests.browser.test_fits import ask
from tests.browser.test_page import tab_to
from tests.browser.test_served import client
from upright.basis import RESERVED, TRUSTED
from upright.browser.identify.fits import COLUMNS, OWN, Identifications
from upright.browser.identify.fitted import fitted_rig
from upright.browser.identify.last_use import keep_use
from upright.browser.rig import HARDWARE, BenchRig, known_rig
from upright.browser.serve import TWIN, Bench
from upright.errors import BadInput
from upright.laws import of_values
from upright.rig.makes import make_rig
from upright.running.rig import model_and_truth
from upright.study.stored_fit import FORMAT

DESIGN = 120
"""Seconds that a law may take on a loaded machine."""
TRUE = make_rig("furuta", 3)
"""Which the fits of these tests are of: its numbers are not those of the design."""


def written_fit(folder: Path, key: str, *, trusted: bool = True, of: str = OWN) -> Path:
    """A fit as the bench keeps it, with the numbers of a rig that is known."""
    place = folder / "fits" / key
    place.mkdir(parents=True)
    numbers = {**TRUE.plant.parameters(), "actuator.gain": TRUE.gain}
    content = {
        "format": FORMAT, "plant": "furuta", "trusted": trusted, "rig": TRUE.hardware.plain(),
        "verdict": "Rely on this model." if trusted else "It explains 12 % of theta.",
        "parameters": {
            n: {"value": v, "stderr": 0.01 * abs(v), "unit": "(N m)/V" if n == "actuator.gain" else "",
                "status": "well determined"}
            for n, v in numbers.items()
        },
        "estimated": list(numbers), "correlation": np.eye(len(numbers)).tolist(),
    }  # fmt: skip
    facts = {"verdict": content["verdict"], "sound": trusted, "interrupted": False, "plant": "furuta"} | {
        name: [] for name in ("warnings", "windows", "rests", "assessments", "assumed", "parameters", "curves")
    }
    about = {"id": key, "log": "run", "of": of, "name": "run of yesterday", "since": 1.8e9, "verdict": "a verdict"}
    for name, values in (("fit.json", content), ("facts.json", facts), (f"{key}.json", about)):
        (place / name).write_text(json.dumps(values), encoding="utf-8")
    return place / "fit.json"


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return twin(tmp_path_factory.mktemp("bench"))


@pytest.fixture
def served(rig, tmp_path):
    carry = ByHand()
    with Bench([rig], tmp_path, carry=carry, report=lambda *_: "") as bench, client(bench) as page:
        yield bench, page, carry, tmp_path / "furuta"
        if not bench.stations[0].over:
            carry.end()


def use(bench, me, fit):
    return ask(bench, "api/rigs/furuta/model", me, data=json.dumps({"fit": fit}).encode(), wait=DESIGN)[::2]


@pytest.mark.slow
def test_a_fit_gives_the_law_that_upright_design_gives_and_the_twin_stays_what_it_is(served, rig):
    bench, page, _, folder = served
    fit = written_fit(folder, "fit-1")
    nominal, truth = page.scene, model_and_truth(rig.file)[1]
    assert nominal["model"] == {"fit": "", "of": ""}
    assert use(bench, page.me, "fit-1") == (200, "{}")
    scene = page.note("scene", model={"fit": "fit-1", "of": "run of yesterday"})
    assert scene["K"] == pytest.approx(up.design(fit, at="inverted").K[0].tolist(), rel=1e-6)
    assert np.abs(np.array(scene["K"]) / nominal["K"] - 1).max() > 0.1
    assert (scene["name"], scene["basis"]["level"]) == ("furuta", TRUSTED)
    station = bench.stations[0]
    model, still = model_and_truth(station.rig.file)
    assert (still.plant, still.gain) == (truth.plant, truth.gain)
    assert model.plant.J_p == pytest.approx(TRUE.plant.J_p)
    assert station.rig.model.draws  # from which the rigs of the screen Design are drawn
    assert use(bench, page.me, "")[0] == 200
    assert page.note("scene", model={"fit": "", "of": ""})["K"] == nominal["K"]


def test_what_is_not_trusted_or_of_another_rig_is_refused_and_nothing_changes(served):
    bench, page, carry, folder = served
    for key, how in (("fit-1", {"trusted": False}), ("fit-2", {"of": COLUMNS}), ("fit-3", {})):
        written_fit(folder, key, **how)
    before = bench.stations[0].rig
    for key, why in (
        ("fit-1", "not trusted. The fit's own verdict: It explains 12 % of theta"), ("fit-2", "columns tell"),
        ("fit-9", "no such fit"), ("../fit-1", "no such fit"),
    ):  # fmt: skip
        status, text = use(bench, page.me, key)
        assert (status, why in text) == (400, True), text
    for body in (b"", b"[]", b'{"fit": 1}', b"nonsense", b'{"memory": 1' + 310 * b"0" + b"}"):
        assert '{"fit": "fit-1"}' in ask(bench, "api/rigs/furuta/model", page.me, data=body)[2]
    assert "for the page of this bench" in use(bench, "nobody", "fit-3")[1]
    page.ask("operate")
    with client(bench) as another:
        assert use(bench, another.me, "fit-3") == (400, "Somebody else operates it.")
    page.ask("start")
    carry.go()
    page.note("state", state="running")
    assert "runs; stop it first" in use(bench, page.me, "fit-3")[1]
    assert bench.stations[0].rig is before


def test_another_filter_gives_the_same_gains_other_velocities_from_the_next_start_on(served):
    bench, page, carry, folder = served
    written_fit(folder, "fit-1", trusted=False)
    K = np.array(page.scene["K"])
    assert page.scene["memory"] == 0.5
    body = json.dumps({"memory": 0.9}).encode()
    assert ask(bench, "api/rigs/furuta/model", page.me, data=body)[0] == 200
    scene = page.note("scene", memory=0.9)
    assert (scene["K"], scene["model"]) == (K.tolist(), {"fit": "", "of": ""})
    page.ask("start")
    carry.go()
    law, T = of_values(carry.orders[0].law), scene["period"]
    y = np.cumsum(np.random.default_rng(0).normal(size=(200, 2)), axis=0)
    z, v = law.begin @ y[0], np.zeros(2)
    for k in range(200):
        if k:
            v = 0.9 * v + 0.1 * (y[k] - y[k - 1]) / T
        reading = np.concatenate([y[k], np.zeros(law.B.shape[1] - 2)])  # with its reference at 0
        assert law.C @ z + law.D @ reading == pytest.approx(-K[0::2] @ y[k] - K[1::2] @ v, rel=1e-9)
        z = law.A @ z + law.B @ reading
    for body in (b'{"memory": "0.9"}', b'{"memory": true}', b"{}"):
        assert "memory" in ask(bench, "api/rigs/furuta/model", page.me, data=body)[2]
    carry.end()
    page.note("state", state="ended")
    assert "from 0 to 0.99" in ask(bench, "api/rigs/furuta/model", page.me, data=b'{"memory": 1.5}')[2]


def test_a_rig_that_can_really_move_gets_another_filter_only_where_that_is_confirmed(rig, tmp_path):
    with Bench([hardware(rig)], tmp_path, carry=ByHand(), report=lambda *_: "") as bench, client(bench) as page:
        before = bench.stations[0].rig
        for sure in ("", ', "confirm": 1', ', "confirm": "true"'):
            status, _, text = ask(bench, "api/rigs/furuta/model", page.me, data=f'{{"memory": 0.9{sure}}}'.encode())
            assert (status, "confirm it" in text) == (400, True), text
        assert bench.stations[0].rig is before
        assert ask(bench, "api/rigs/furuta/model", page.me, data=b'{"memory": 0.9, "confirm": true}')[0] == 200
        assert bench.stations[0].rig.memory == pytest.approx(0.9)


def test_while_another_filter_is_made_everybody_else_is_answered(served, monkeypatch):
    bench, page, _, _ = served
    begun, go, make = threading.Event(), threading.Event(), BenchRig.with_memory

    def slow(*given):
        begun.set()
        assert go.wait(SOON)
        return make(*given)

    monkeypatch.setattr(BenchRig, "with_memory", slow)
    with ThreadPoolExecutor(1) as pool, client(bench) as another:
        answer = pool.submit(ask, bench, "api/rigs/furuta/model", page.me, data=b'{"memory": 0.9}')
        assert begun.wait(SOON)
        another.ask("stop")
        another.note("state", state="stopped")
        go.set()
        assert answer.result(SOON)[0] == 200


def test_while_a_law_is_on_its_way_no_other_one_is_begun(served, monkeypatch):
    bench, page, _, _ = served
    begun, go, rig = threading.Event(), threading.Event(), bench.stations[0].rig

    def slow(_own, _key):
        begun.set()
        assert go.wait(SOON)
        return rig

    monkeypatch.setattr(Identifications, "described_by", slow)
    with ThreadPoolExecutor(1) as pool:
        first = pool.submit(use, bench, page.me, "fit-1")
        assert begun.wait(SOON)
        status, text = use(bench, page.me, "fit-1")
        go.set()
        assert (status, "being designed" in text) == (400, True), text
        assert first.result(SOON)[0] == 200
    assert use(bench, page.me, "fit-1")[0] == 200


def copied(_task, _path, law):
    """Stands for the design of a law: the paper's gains, in its place."""
    law.write_bytes((law.parents[2] / "law.json").read_bytes())
    return ""


@pytest.fixture
def next_bench(tmp_path, monkeypatch):
    """Opens one bench after the other on the same folder."""
    monkeypatch.setattr("upright.browser.identify.fitted.in_own_process", copied)
    path = tmp_path / "RIG.toml"
    path.write_text(TWIN, encoding="utf-8")

    @contextmanager
    def opened(how=lambda rig: rig):
        rig, carry = how(known_rig(path, None, tmp_path)), ByHand()
        with Bench([rig], tmp_path, carry=carry, report=lambda *_: "") as bench, client(bench) as page:
            yield bench, page, carry
            if not bench.stations[0].over:
                carry.end()

    return opened


def request(bench, page, **what):
    return ask(bench, "api/rigs/furuta/model", page.me, data=json.dumps(what).encode())[::2]


def used(next_bench, tmp_path):
    """A rig that was used with a fit and another filter, when a bench has closed."""
    written_fit(tmp_path / "furuta", "fit-1")
    with next_bench() as (bench, page, _):
        assert page.scene["last_use"] is None
        assert request(bench, page, fit="fit-1", memory=0.8)[0] == 200
        return bench.stations[0].rig, page.note("scene", memory=0.8)


def test_the_next_bench_uses_a_twin_as_it_was_used_last_until_it_is_used_as_it_came(next_bench, tmp_path):
    last, scene = used(next_bench, tmp_path)
    with next_bench() as (bench, page, carry):
        again = page.scene
        assert {n: again[n] for n in ("model", "memory", "K", "basis")} == {
            n: scene[n] for n in ("model", "memory", "K", "basis")
        }
        assert (
            "the fit of run of yesterday and the velocity filter a = 0.8, and so it is" in again["last_use"]["sentence"]
        )
        assert again["last_use"]["offer"] is None
        page.ask("operate")
        page.ask("start")
        carry.go()
        law = of_values(carry.orders[0].law)
        assert all(np.array_equal(getattr(law, n), getattr(last.law, n)) for n in ("A", "B", "C", "D"))
        carry.end()
        page.note("state", state="ended")
        assert request(bench, page, fit="")[0] == 200
        assert page.note("scene", model={"fit": "", "of": ""})["last_use"] is None
    with next_bench() as (_, page, _):
        assert (page.scene["model"]["fit"], page.scene["memory"], page.scene["last_use"]) == ("", 0.5, None)


def rewritten(path, change):
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")


OFFER = {"fit": "fit-1", "memory": 0.8}


@pytest.mark.parametrize(
    ("what", "why", "then"),
    [("RIG.toml", "has changed since", ""), ("furuta/fits/fit-1/law.json", "has changed since", ""),
     ("furuta/fits/fit-1/fit.json", "has changed since", "not trusted"),
     ("hardware", "until you confirm", "confirm it"), ("furuta/fits/fit-1/fit-1.json", "no longer there", None),
     ("furuta/last_use.json", "cannot be read", None)],
)  # fmt: skip
def test_what_has_changed_or_can_really_move_is_as_it_came_and_the_last_use_at_most_offered(
    next_bench, tmp_path, what, why, then
):
    used(next_bench, tmp_path)
    if what.endswith(("fit-1.json", "use.json")):
        rewritten(tmp_path / what, lambda text: "{}" if "use" in what else text.replace('"fit-1"', '"fit-2"'))
    elif what != "hardware":
        rewritten(tmp_path / what, lambda text: text.replace('"trusted": true', '"trusted": false') + "\n")
    with next_bench(hardware if what == "hardware" else lambda rig: rig) as (bench, page, _):
        assert (page.scene["model"]["fit"], page.scene["memory"]) == ("", 0.5)
        assert why in page.scene["last_use"]["sentence"]
        assert page.scene["last_use"]["offer"] == (None if then is None else OFFER)
        if then is None:
            return
        status, text = request(bench, page, **OFFER)
        assert (status, then in text) == (400 if then else 200, True), text
        if not then:
            assert page.note("scene", memory=0.8)["model"]["fit"] == "fit-1"


def test_a_fit_that_is_no_longer_trusted_is_not_used_again_though_no_file_has_changed(next_bench, tmp_path):
    last, _ = used(next_bench, tmp_path)
    rewritten(tmp_path / "furuta/fits/fit-1/fit.json", lambda text: text.replace('"trusted": true', '"trusted": false'))
    keep_use(last, known_rig(tmp_path / "RIG.toml", None, tmp_path), tmp_path / "furuta")
    with next_bench() as (_, page, _):
        assert page.scene["model"]["fit"] == ""
        assert (
            "cannot be used now: this fit cannot be used, since it is not trusted" in page.scene["last_use"]["sentence"]
        )


REAL = """kind = "serial"
port = "/dev/ttyACM0"
name = "furuta"
fit = "first.json"
[limits]
command = "3 V"
lean = "20 deg"
[limits.psi]
travel = "1.5 rad"
speed = "20 rad/s"
start = "0.3 rad"
"""


@pytest.mark.slow
def test_a_rig_that_can_really_move_keeps_its_limits_and_its_port(tmp_path):
    written_fit(tmp_path, "first").rename(tmp_path / "first.json")
    path, law = tmp_path / "RIG.toml", twin(tmp_path / "law").law_path
    path.write_text(REAL, encoding="utf-8")
    nominal = known_rig(path, law, tmp_path)
    rig = fitted_rig(nominal, written_fit(tmp_path, "fit-1"), "a run")
    units = {c.name: c.unit for c in rig.model.plant.coordinates}
    assert (rig.kind, rig.file.port, rig.lean) == (HARDWARE, "/dev/ttyACM0", nominal.lean)
    assert rig.file.limits(units, "V") == nominal.file.limits(units, "V")
    assert (nominal.basis.level, rig.basis.level) == (RESERVED, TRUSTED)  # the other law was of no fit


def test_a_twin_of_its_own_description_is_refused_another_one(tmp_path):
    written_fit(tmp_path, "first").rename(tmp_path / "first.json")
    path, law = tmp_path / "RIG.toml", twin(tmp_path / "law").law_path
    path.write_text('kind = "twin"\nname = "furuta"\nfit = "first.json"\n', encoding="utf-8")
    with pytest.raises(BadInput, match='make = "furuta"'):
        fitted_rig(known_rig(path, law, tmp_path), written_fit(tmp_path, "fit-1"), "a run")


@pytest.mark.slow
def test_a_student_takes_a_fit_into_use_by_keyboard_and_goes_back(chromium, tmp_path):
    written_fit(tmp_path / "furuta", "fit-1")
    server = Server(tmp_path)
    try:
        with student(chromium, server, screen="identify") as one, student(chromium, server) as another:
            page = one.page
            page.wait_for_selector("#fit-result:not([hidden])")
            one.reads("#identify .in-use", "nominal model")
            tab_to(page, "#fit-use")
            page.keyboard.press("Enter")
            one.reads("#identify .in-use", "fit of run of yesterday")
            another.reads("#run .in-use", "fit of run of yesterday")
            page.wait_for_selector("#tab-design:not([hidden])")
            page.click("#tab-design")
            one.reads("#lanes", "200 rigs that the fit of run of yesterday allows")
            one.reads("#share", "200 of 200 rigs are stabilised")
            one.reads("#gate-badge", "^trusted")
            one.starts()
            page.click("#tab-identify")
            one.presses("#nominal")
            one.reads("#message", "stop it first")
            page.click("#end")
            one.sees("ended")
            server.kill()
            one.sees("lost")
            server.open()
            one.reads("#message", "with the fit of run of yesterday, and so it is again")
            one.reads("#identify .in-use", "fit of run of yesterday")
            tab_to(page, "#nominal")
            page.keyboard.press("Enter")
            one.reads("#identify .in-use", "nominal model")
            another.reads("#run .in-use", "nominal model")
            assert not page.locator("#last-use").is_visible()
            one.leaves()
            gone = ("ERR_CONNECTION", "ERR_EMPTY_RESPONSE", "ERR_SOCKET", "before receiving a handshake")  # the server
            assert [w for w in one.wrong + another.wrong if not any(why in w for why in gone)] == []
    finally:
        server.close()
