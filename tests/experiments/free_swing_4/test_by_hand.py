"""Is a person asked to lift the pendulum twice, and is what swings freely told from what a hand does?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.experiments.rigs import made
from upright.errors import NotIdentifiable
from upright.experiments.free_swing_4 import by_hand
from upright.experiments.free_swing_4.by_hand import carrier_of, run_by_hand
from upright.experiments.stand.twin import TwinStand
from upright.progress import silent
from upright.records import Provenance, Record
from upright.rig.makes import BODIES, MAKES, make_rig


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """A rig by hand whose pendulum is lifted for three seconds and let go; what is asked and fitted is noted."""
    stand = made(tmp_path)
    w = max(abs(p.imag) for p in stand.rig.linear("hanging").poles())
    noted = {"runs": [], "asked": [], "told": []}

    def run(_stand, samples, _folder, stem, *, lifted):
        t = 2.0 + np.arange(len(samples)) * stand.rig.period
        free = t - 5.0
        swing = lifted * np.exp(-0.1 * free) * np.cos(w * free)
        theta = np.where(free < 0, lifted * (3 * (t - 2) ** 2 / 9 - 2 * (t - 2) ** 3 / 27), swing)
        noted["runs"].append((stem, len(samples), max(samples), lifted))
        signals = {"psi": 0.0 * t, "theta": noted.get("share", 1.0) * theta}
        return Record(t=t, signals=signals, provenance=Provenance(file=f"{stem}.mcap"))

    def study(_stand, path, title, runs, **more):
        noted["study"] = runs, more
        return path

    monkeypatch.setattr(type(stand), "run", run)
    monkeypatch.setattr(type(stand), "ask", lambda _stand, sentence: noted["asked"].append(sentence))
    monkeypatch.setattr(by_hand, "write_study", study)
    monkeypatch.setattr(by_hand, "fit_study", lambda path, tell: (tell("fitting", 1.0), path))
    return stand, noted


def test_the_higher_release_is_fitted_and_the_lower_foreseen_from_where_the_hand_lets_go(asked, tmp_path):
    """75 and 50 degrees, the drive silent for the hand's 15 s and the swing's 15."""
    stand, noted = asked
    run_by_hand(stand, tmp_path, lambda step, share: noted["told"].append(share), ("known",))
    seconds = 15.0 + (0.0 if stand.performed else 15.0)
    samples = math.ceil(seconds / stand.rig.period)
    assert [(stem, n, most) for stem, n, most, _ in noted["runs"]] == [
        ("release_75", samples, 0.0), ("release_50", samples, 0.0),
    ]  # fmt: skip
    assert [math.degrees(lifted) for *_, lifted in noted["runs"]] == pytest.approx([75, 50])
    assert ["to about 75 degrees" in noted["asked"][0], "to about 50 degrees" in noted["asked"][1]] == [True, True]
    runs, more = noted["study"]
    assert [run["role"] for run in runs] == ["fit", "predict"]
    assert [run["file"] for run in runs] == ["release_75.mcap", "release_50.mcap"]
    assert (more["known"], more["drive"]) == (("known",), False)
    for run in runs:
        begin, end = run["window"]
        assert begin == pytest.approx(5.0, abs=0.5)  # half a swing is 0.4 s
        assert end == pytest.approx(2.0 + (samples - 1) * stand.rig.period)
    assert noted["told"] == sorted(noted["told"])
    assert noted["told"][-1] <= 1.0


@pytest.mark.parametrize(("degrees", "lifted"), [(14.5, False), (15.5, True)])
def test_a_pendulum_that_was_not_lifted_by_fifteen_degrees_is_asked_for_again(asked, tmp_path, degrees, lifted):
    """The lower release goes to 50 of 75 of it, so that it is the one that is asked for where the higher was seen."""
    stand, noted = asked
    noted["share"] = degrees / 75
    file = "release_50" if lifted else "release_75"
    with pytest.raises(NotIdentifiable, match=rf"theta went no further than 1\d degrees in {file}\.mcap"):
        run_by_hand(stand, tmp_path, silent, ())


def test_what_carries_a_pendulum_is_the_disk_or_the_cart():
    for make, body in (("furuta", "J_d"), ("linear", "m_c")):
        assert carrier_of(TwinStand(rig=make_rig(make), make=MAKES[make])) == body
    shaft = make_rig("torsional").replace(plant=BODIES["torsional"].rig.plant, counts=(1.0,))
    assert carrier_of(TwinStand(rig=shaft)) == ""
