"""Experiment 1a at a rig: masses that its owner names are bolted on one after the other, within its travel."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput, RigStopped
from upright.experiments.laboratory import chosen_experiments
from upright.experiments.stand.live import LiveStand, live_stand
from upright.experiments.stand.studies import write_study
from upright.experiments.weighing_1a import run as weighing
from upright.experiments.weighing_1a.run import PROBE, _bolted, step_stand
from upright.readers import read
from upright.records import Provenance, Record

STUDY = """
[rig]
plant = "rectilinear-1"
name = "cart 4"
servo_period = "1.768 ms"
travel = "60 mm"
[parameters]
m_1 = { guess = "0.6 kg", min = 0 }
k_1 = { guess = "300 N/m", min = 0 }
c_1 = { guess = "2 N s/m", min = 0 }
f_1c = { guess = "0.2 N", min = 0 }
[actuator]
gain = { guess = "5 N/V", min = 0 }
limit = { value = "5 V", measured = true }
[sensors.x_1]
column = "x_1"
counts_per_m = 226000
"""
LOADINGS = """
[loadings]
added = ["0 kg", "0.5 kg", "1 kg"]
tolerance = "0.2 %"
"""


def made(folder, loadings=LOADINGS):
    """A twin of the cart, with what may be bolted to it."""
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    (folder / "RIG.toml").write_text(f'kind = "twin"\nstudy = "study.toml"\n{loadings}', encoding="utf-8")
    return live_stand(folder / "RIG.toml")


@pytest.mark.slow
@pytest.mark.parametrize("guessed", [300.0, pytest.param(120.0, marks=pytest.mark.thorough)])
def test_a_cart_is_weighed_within_its_travel_whatever_was_guessed(tmp_path, guessed):
    """A guess of a softer spring asks for less; what the probe shows makes up for it."""
    rig = made(tmp_path, LOADINGS.replace("0.2 %", "0 %"))
    told = replace(rig, rig=rig.rig.changed(k_1=guessed))
    done = step_stand(told, tmp_path / "1a", lambda _step, _share: None)
    truth = rig.twin.plant.parameters()
    for estimate, true in ((done.loadings.k, truth["k_1"]), (done.loadings.bare, truth["m_1"])):
        assert estimate.interval[0] <= true <= estimate.interval[1]
        assert estimate.stderr < 0.001 * true
    assert len(done.loadings.swings) == 12  # four steps with each loading
    wanted, held = 0.25 * 60e-3, truth["f_1c"] / truth["k_1"]  # of the travel; where friction holds it
    probe = PROBE * wanted * guessed / truth["k_1"]
    for log in done.logs.values():
        # without friction a step swings to twice where it rests, L; from anywhere within f/k, with it, to 2 L - 2 f/k
        # on one side and at most f/k more or less on the other, in the probe that told how large as well
        swing = np.ptp(log["x_1"]) / 4
        assert wanted - 1.5 * held < swing < wanted * probe / (probe - 1.5 * held)


def test_a_step_never_exceeds_its_share_of_the_limit(tmp_path, monkeypatch):
    """A quarter of 60 mm takes 300 N/m 15 mm / (0.5 N/V) = 9 V; 80 % of the limit of 5 V are 4 V."""
    made(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY.replace("5 N/V", "0.5 N/V"), encoding="utf-8")
    levels: list[float] = []

    def run(self, samples, folder, stem, **_hand):
        """A cart that hardly moves, so that what the probe shows asks for as much as there is."""
        levels.append(max(samples))
        log = tmp_path / f"{stem}.csv"
        log.write_text("t,x_1\n0,0\n0.001,1e-6\n0.002,0\n", encoding="utf-8")
        return read(log)

    monkeypatch.setattr(LiveStand, "run", run)
    rig = replace(live_stand(tmp_path / "RIG.toml"), person=lambda _sentence: len(levels) < 2)
    with pytest.raises(RigStopped, match="requested and not done"):
        step_stand(rig, tmp_path / "1a", lambda _step, _share: None)
    probe, level = levels
    assert probe == pytest.approx(PROBE * 4.0)
    assert level == pytest.approx(4.0)


def test_pieces_add_up_and_err_by_their_tolerance(tmp_path):
    rig = made(tmp_path, LOADINGS.replace("0.2 %", "0 %"))
    assert _bolted(rig, [0.0, 0.5, 1.0, 0.5]) == pytest.approx([0.0, 0.5, 1.0, 0.5], abs=1e-15)
    off = np.array(_bolted(made(tmp_path), [0.0, 0.5, 1.0, 0.5])) / [1.0, 0.5, 1.0, 0.5] - [0, 1, 1, 1]
    assert off[0] == 0
    assert off[1] == off[3] != 0  # the same piece
    assert np.abs(off).max() < 5 * 0.002


def test_a_rig_is_weighed_where_its_file_names_what_is_bolted_on(tmp_path):
    assert [e.name for e in chosen_experiments((), "RIG.toml", made(tmp_path))] == ["1a", "1b"]
    assert [e.name for e in chosen_experiments((), "RIG.toml", made(tmp_path, ""))] == ["1b"]
    with pytest.raises(BadInput, match=r"1a cannot be made on .*, which has experiments 1b;"):
        up.lab(rig=str(tmp_path / "RIG.toml"), experiment="1a", out=tmp_path / "out")


@pytest.mark.parametrize(
    ("loadings", "complaint"),
    [
        ('[loadings]\nadded = ["1 kg"]', "two or more different loadings in kg"),
        ('[loadings]\nadded = ["0", "1e-3 kg m^2"]', "two or more different loadings in kg"),
    ],
)
def test_loadings_that_make_no_line_are_told(tmp_path, loadings, complaint):
    with pytest.raises(BadInput, match=complaint):
        step_stand(made(tmp_path, loadings), tmp_path / "1a", lambda _step, _share: None)


@pytest.mark.parametrize(
    ("loadings", "complaint"),
    [
        ('[loadings]\nadded = ["1 kg"]\ntolerance = "120 %"', "tolerance is a share"),
        ('[loadings]\nmasses = ["1 kg"]', "has no key 'masses'"),
    ],
)
def test_loadings_that_say_something_else_are_told_with_their_line(tmp_path, loadings, complaint):
    with pytest.raises(BadInput, match=rf"line \d+: .*{complaint}"):
        made(tmp_path, loadings)


def test_a_person_is_asked_for_every_loading_by_the_owners_words(tmp_path):
    asked: list[str] = []

    def person(sentence):
        asked.append(sentence)
        return len(asked) < 2

    rig = replace(made(tmp_path), person=person)
    with pytest.raises(RigStopped, match=r"requested and not done: .*0 kg in all"):
        step_stand(rig, tmp_path / "1a", lambda _step, _share: None)
    # four commands, each for ten periods of the guessed 0.6 kg with 1 kg on it on 300 N/m
    assert f"steps follow for {4 * 10 * 2 * np.pi * np.sqrt((0.6 + 1.0) / 300):.0f} s" in asked[0]


@pytest.mark.parametrize(("said", "there"), [("", {"guess": "0.001768 s", "min": 0}), ("lag", "0.001768 s")])
def test_a_delay_that_nobody_said_is_found_where_nothing_else_is_late(tmp_path, said, there):
    """A loop acts a sample late at least; a fit that knows nothing of it explains 96 % of a twin's motion."""
    rig = made(tmp_path)
    if said:
        study = STUDY.replace("limit =", 'lag = { guess = "1 ms", min = 0 }\nlimit =')
        (tmp_path / "study.toml").write_text(study, encoding="utf-8")
        rig = live_stand(tmp_path / "RIG.toml")
    written = write_study(rig, tmp_path / "found.toml", "", [])
    assert tomllib.loads(written.read_text(encoding="utf-8"))["actuator"]["delay"] == there


def test_every_loading_is_stepped_once_as_far_as_the_probe_says_for_ten_of_the_slowest_swings(tmp_path, monkeypatch):
    """A volt puts the cart at 10 mm, and it swings to 20: 1.5 V for the 15 mm that are wanted of a travel of 60."""
    stand = made(tmp_path)
    runs, told, weighed = [], [], {}

    def run(_self, samples, _folder, stem, *, bolted):
        u = np.array(samples)
        runs.append((stem, u, bolted))
        return Record(t=np.arange(u.size) * stand.rig.period, signals={"x_1": 0.02 * u, "u_applied": u},
                      provenance=Provenance(file=f"{stem}.mcap"))  # fmt: skip

    def weigh(logs, values, signals, commands, *, tolerance):
        weighed.update(logs=logs, values=values, signals=signals, commands=commands, tolerance=tolerance)
        return "line", ()

    monkeypatch.setattr(LiveStand, "run", run)
    monkeypatch.setattr(weighing, "weigh", weigh)
    done = step_stand(stand, tmp_path / "1a", lambda step, share: told.append((step, share)))
    assert [stem for stem, *_ in runs] == ["probe", "loaded_1", "loaded_2", "loaded_3"]
    values = [0.0, 0.5, 1.0]
    assert [b for *_, b in runs] == _bolted(stand, [0.0, *values])
    assert told == [(f"stepping with {m} kg added", i / 4) for i, m in enumerate(("0", "0", "0.5", "1"))]
    p = stand.rig.plant.parameters()
    seconds = 10 * 2 * math.pi / math.sqrt(p["k_1"] / (p["m_1"] + p["a_1"] + max(values)))
    still = math.ceil(0.5 / stand.rig.period)
    for _, u, _ in runs:
        assert not u[:still].any()
        forth, rest, back, end = np.split(u[still:], 4)
        assert forth.size * stand.rig.period == pytest.approx(seconds, abs=stand.rig.period)
        assert len({*forth}) == len({*back}) == 1
        assert forth[0] == -back[0] > 0
        assert not rest.any()
        assert not end.any()
    steps = [u.max() for _, u, _ in runs]
    assert steps == pytest.approx([PROBE * 300 * 0.015 / 5, 1.5, 1.5, 1.5])  # the first by the guesses
    assert list(weighed["logs"]) == ["0 kg", "0.5 kg", "1 kg"]  # the probe is no loading
    assert weighed["values"] == values
    assert set(weighed["signals"].values()) == {"x_1"}
    assert set(weighed["commands"].values()) == {"u_applied"}
    assert weighed["tolerance"] == stand.tolerance
    assert (done.loadings, list(done.files.values())) == ("line", ["loaded_1.mcap", "loaded_2.mcap", "loaded_3.mcap"])
    assert list(done.added.values()) == values
    assert (done.truth["k"], done.truth["c"]) == (stand.truth["k_1"], stand.truth["c_1"])
    assert stand.truth["m_1"] in done.truth.values()
