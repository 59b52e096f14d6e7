"""Does a rig follow the wave that somebody draws on the page, tick by tick, and does its log say what it followed?"""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.browser.runs import felt, station, twin
from upright.browser.hub import Hub
from upright.browser.messages import ClientRequest
from upright.browser.rig import known_rig
from upright.browser.station import obey
from upright.errors import BadInput
from upright.laws import as_values
from upright.logs import read_log
from upright.logs.replay import replay
from upright.realtime.desk import Desk
from upright.realtime.reference import SHAPES, Reference
from upright.realtime.session import carry_out
from upright.running.run import RunRequest, prepared

SHAFT = 'kind = "twin"\nname = "shaft"\nmake = "torsional"\nat = "rest"\n'


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return twin(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def shaft(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shaft")
    (folder / "shaft.toml").write_text(SHAFT, encoding="utf-8")
    return known_rig(folder / "shaft.toml", None, folder)


def followed(rig, folder, given, seconds):
    """Log of a run in virtual time, to which references are given before some ticks; and where each began."""
    desk, began = Desk(), []
    wish = RunRequest(rig=rig.rig_path, law=rig.law_path, seconds=seconds, check=False, steered=rig.follows)
    run = prepared(wish, folder)

    def heed(stage):
        tick = len(began)
        if tick in given:
            desk.follow(given[tick])
        now = desk.heed(stage)
        began.append(0 if desk.followed is None else desk.followed[2])
        return now

    assert carry_out(run.order, law=run.law, show=desk.put, heed=heed).stopped == ""
    return read_log(run.order.log), began


def test_every_tick_has_the_value_of_its_wave_and_the_log_is_replayed_to_the_last_bit(rig, tmp_path):
    dt, n = rig.model.period, 850
    square, sine = Reference(shape="square", size=0.1, period=0.2), Reference(shape="sine", size=0.05, period=0.25)
    log, began = followed(rig, tmp_path, {50: square, 400: sine, 700: Reference(size=-0.02)}, n * dt)
    reference = log.columns["reference"]
    half = round(0.1 / dt)  # of a square wave, in whole ticks
    assert half == 113
    expected = np.concatenate([
        np.zeros(50), np.resize([*[0.1] * half, *[-0.1] * half], 350),
        [0.05 * math.sin(math.tau * k * dt / 0.25) for k in range(300)], np.full(n - 700, -0.02),
    ])  # fmt: skip
    assert reference.tolist() == expected.tolist()
    assert (began[49], began[50], began[450], began[-1]) == (0, 50, 400, 700)
    again = replay(log)
    assert (again.identical, again.rows.size) == (True, n)
    unfollowed = replace(log, columns={**log.columns, "reference": np.zeros(n)})
    assert replay(unfollowed).differing > n / 2


def test_a_design_that_names_no_reference_signal_is_logged_with_what_it_followed(rig, tmp_path):
    """As `upright design --track` stores it."""
    law = tmp_path / "design.json"
    law.write_text(json.dumps({"law": as_values(replace(rig.law, references=None))}), encoding="utf-8")
    designed = known_rig(rig.rig_path, law, tmp_path)
    assert designed.follows
    log, _ = followed(designed, tmp_path, {20: Reference(size=0.1)}, 0.1)
    assert set(log.columns["reference"][21:]) == {0.1}
    assert replay(log).identical


def test_the_far_disk_of_the_flexible_shaft_follows_a_step(shaft, tmp_path):
    """To where dry friction holds it: less than a tenth short of half a radian after a second and a half."""
    assert (shaft.scene["tracked"], shaft.scene["coordinates"][1]["name"]) == (1, "theta_2")
    log, _ = followed(shaft, tmp_path, {100: Reference(size=0.5)}, 1.5)
    assert not log.columns["theta_2"][:100].any()
    assert log.columns["theta_2"][-1] == pytest.approx(0.5, abs=0.05)
    assert replay(log).identical


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [({"value": 7.0}, "within its travel of 6.283"), ({"value": -7.0, "shape": "sine", "period": 2.0}, "its travel"),
     ({"value": 0.1, "shape": "sine"}, "a sine has a period from 0.2 to 60 s, got 0 s"),
     ({"value": 0.1, "shape": "square", "period": 0.1}, "got 0.1 s"),
     ({"value": 0.1, "shape": "square", "period": 61.0}, "got 61 s"),
     ({"value": 0.1, "shape": "step", "period": 2.0}, "no period")],
)  # fmt: skip
def test_a_reference_that_is_none_is_refused_and_the_loop_follows_the_last_one(rig, tmp_path, fields, sentence):
    with station(rig, tmp_path) as (made, carry, _):
        obey(made, "operator", ClientRequest(do="start"))
        carry.go()
        with pytest.raises(BadInput, match=sentence):
            obey(made, "operator", ClientRequest(do="reference", fields=fields))
        assert felt(made.desk, rig.law)[2] is None


def test_whoever_looks_on_is_told_what_is_followed_and_since_when(rig, tmp_path):
    with station(rig, tmp_path) as (made, carry, _):
        hub = Hub(made)
        _, outbox = hub.join("")
        obey(made, "operator", ClientRequest(do="start"))
        for _ in range(3):
            carry.go()
        wave = {"value": 0.2, "shape": "sine", "period": 2.0}
        obey(made, "operator", ClientRequest(do="reference", fields=wave))
        hub.turn()
        assert "reference" not in scenes(outbox)[-1]  # the loop has not looked yet
        assert felt(made.desk, rig.law)[2] == 0.0
        hub.turn()
        told = scenes(outbox)[-1]["reference"]
        assert told == {**wave, "tick": 3, "about": [0.0, math.pi]}
        _, late = hub.join("")
        assert scenes(late)[-1]["reference"] == told


def scenes(outbox):
    """Of all notes that wait for somebody."""
    notes = [json.loads(text) for text in outbox._notes]
    return [note for note in notes if note["type"] == "scene"]


def test_no_reference_is_read_while_it_is_written():
    """Whoever gives sixteen of them within a tick of the loop."""
    desk = Desk()
    for k in range(40):
        desk.follow(Reference(shape=SHAPES[k % 3], size=float(k), period=float(k % 3 and 1)))
    assert felt(desk, None)[2] == 39.0  # a step
    assert desk.followed == (40, Reference(size=39.0), 0, (0.0, math.pi, *[0.0] * 6))
