"""Does a minute at a rig go on only as far as what it showed allows, and is it judged by what it showed?"""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.experiments.quick.test_chapter import BEGUN, GOOD, T
from tests.experiments.quick.test_quick import described
from upright.control.exploration import CALMS, KICKS, SECONDS
from upright.control.sensors import SURE
from upright.errors import BadInput
from upright.experiments.quick import run as quick
from upright.experiments.quick.run import HELD, LANES, UP, caught, run_quick
from upright.experiments.stand.live import LiveStand, live_stand
from upright.experiments.stand.stand import APPLIED
from upright.records import Provenance, Record
from upright.rig.makes import make_rig

RIG = make_rig("furuta")


class Minute:
    """A minute whose motions, wiring, fit and law are said beforehand; what the rig is asked for is noted."""

    def __init__(self, folder, monkeypatch):
        self.stand = live_stand(described(folder))
        self.log = Record(
            t=T, signals={APPLIED: np.sin(T), "psi": 7.0 + 0.1 * T, "theta": np.cos(T) - 2.0},
            provenance=Provenance(file="explore.mcap"),
        )  # fmt: skip
        self.mode = np.zeros(T.size)
        for phase, k in BEGUN.items():
            self.mode[k:] = phase
        self.wiring, self.share, self.ended = GOOD, 0.75, None
        self.fit = SimpleNamespace(interrupted=False)
        self.law: object = SimpleNamespace(rule=lambda rig, start: ("rule", rig, start.tolist()))
        self.asked, self.told, self.folder = [], [], folder / "out"
        note = self.asked.append
        another = replace(self.stand, rig=self.stand.rig.replace(name="as fitted"))

        def explore(_stand, rule, seconds, _folder, stem):
            note(("explore", seconds, stem))
            return self.log

        def hold(stand, rule, at, _folder, stem, seconds, *, settled):
            note(("hold", stand.rig.name, rule, at, stem, seconds, settled))
            return SimpleNamespace(trial=SimpleNamespace(t=np.array([0.0, 8.0])), ended=self.ended)

        def follow(shown, period):
            np.testing.assert_array_equal(shown, np.column_stack([self.log["psi"], self.log["theta"]]))
            return None, self.mode[:, None]

        def check(rig, t, turned, command):
            np.testing.assert_allclose(turned, np.column_stack([0.1 * (T - T[0]), np.cos(T) - np.cos(T[0])]))
            np.testing.assert_array_equal(command, np.sin(T))
            return self.wiring

        def design(model, *, travel, speeds, seed):
            note(("design", model.name, travel, speeds, seed))
            if isinstance(self.law, Exception):
                raise self.law
            return self.law

        monkeypatch.setattr(LiveStand, "ask", lambda _stand, sentence: note(("ask", sentence)))
        monkeypatch.setattr(LiveStand, "explore", explore)
        monkeypatch.setattr(LiveStand, "hold", hold)
        monkeypatch.setattr(
            LiveStand, "described_by", lambda _stand, fit, _folder: note(("described by", fit.name)) or another
        )
        monkeypatch.setattr(quick, "exploration", lambda rig, travel: SimpleNamespace(follow=follow))
        monkeypatch.setattr(quick, "check_wiring", check)
        monkeypatch.setattr(quick, "fit_study", lambda path, progress: (path, self.fit))
        monkeypatch.setattr(quick, "read_stored_rig", lambda path, seed: RIG.replace(name=f"fit of seed {seed}"))
        monkeypatch.setattr(quick, "completed", lambda rig, **_: rig)
        monkeypatch.setattr(quick, "design_swing_up", design)
        monkeypatch.setattr(quick, "caught", lambda model, law, seed: self.share)
        monkeypatch.setattr(
            quick, "ascent_of", lambda trial, law, rule: SimpleNamespace(trial=trial, up=2.0, rule=rule)
        )

    def run(self, **more):
        return run_quick(self.stand, self.folder, 5, lambda step, share: self.told.append(share), **more)

    @property
    def did(self):
        return [what for what, *_ in self.asked]


@pytest.fixture
def minute(tmp_path, monkeypatch):
    return Minute(tmp_path, monkeypatch)


def test_a_minute_ends_upright_by_the_law_of_the_rig_as_fitted(minute):
    """15.25 s of first motions by the rig's clock, which began at 0.5 s, and 8 s of the way up."""
    done = minute.run()
    assert minute.did == ["ask", "explore", "described by", "design", "hold"]
    assert ("explore", SECONDS, "explore") in minute.asked
    assert ("design", minute.stand.rig.name, minute.stand.travel, minute.stand.speeds, 5) in minute.asked
    (_, who, (rule, rig, start), *rest) = minute.asked[-1]
    assert (who, rule, rig.name, start) == ("as fitted", "rule", "as fitted", [0.0] * 4)  # from hanging
    assert rest == ["inverted", "swing_up", UP, True]  # its encoders stay zeroed where the first motions began
    assert done.upright
    assert done.refused is None
    assert done.seconds == pytest.approx(T[-1] + 8.0)
    assert done.share == 0.75
    assert minute.told == sorted(minute.told)
    assert 0.0 <= minute.told[0] <= minute.told[-1] <= 1.0
    minute.ended = "a limit"
    assert not minute.run().upright


@pytest.mark.parametrize(
    ("wiring", "pumped", "said"),
    [
        (
            replace(GOOD, moves=-1.0, scale=(1.0, 0.5)),
            True,
            "motor leads swapped; theta: counts per turn 8000, not 16000",
        ),
        (replace(GOOD, moves=-1.0), False, "motor leads swapped"),
        (GOOD, False, "the drive hardly moves it: look at its supply and its current limit"),
    ],
)
def test_a_rig_that_is_wired_otherwise_or_hardly_moves_is_neither_fitted_nor_driven_again(minute, wiring, pumped, said):
    minute.wiring = wiring
    if not pumped:
        minute.mode = np.minimum(minute.mode, KICKS)
    done = minute.run()
    assert done.refused == said
    assert minute.did == ["ask", "explore"]
    assert (done.fit, done.law, done.upright, done.seconds) == (None, None, False, T[-1])


def test_no_loop_is_closed_where_no_law_can_be_made_or_less_than_half_of_the_rigs_are_caught(minute):
    law, minute.law = minute.law, BadInput("no swing-up of it; allow more travel.")
    refused = minute.run()
    assert refused.refused == "no swing-up of it; allow more travel"
    assert refused.fit is minute.fit  # what it is was found all the same
    assert refused.share is None
    minute.law, minute.share = law, 0.49
    refused = minute.run()
    assert refused.refused == f"of {LANES} rigs that the fit allows only 49% are caught"
    assert refused.share == 0.49
    assert "hold" not in minute.did
    minute.share = 0.5
    assert minute.run().upright


def test_a_stop_is_obeyed_after_the_fit_also_where_the_fit_has_swallowed_it(minute):
    with pytest.raises(KeyboardInterrupt):
        minute.run(stopped=lambda: True)
    minute.fit = SimpleNamespace(interrupted=True)
    with pytest.raises(KeyboardInterrupt):
        minute.run()
    assert "design" not in minute.did


@pytest.mark.parametrize(
    ("dead", "error", "asked"),
    [(0.25, 0.24 / SURE, True), (0.25, 0.26 / SURE, False), (0.25, None, False), (None, None, False)],
)
def test_the_kicks_and_the_swing_are_fitted_and_the_calming_foreseen(minute, dead, error, asked):
    """A dead zone is asked of the fit where it was seen beyond its error, from what was seen."""
    minute.wiring = replace(GOOD, dead_zone=dead, dead_error=error)
    study = tomllib.loads(minute.run().study.read_text(encoding="utf-8"))
    fitted, foreseen = study["runs"]
    kicks, calms = (float(T[BEGUN[phase]]) for phase in (KICKS, CALMS))
    assert fitted["window"] == [kicks, calms]
    assert (foreseen["window"], foreseen["role"]) == ([calms, float(T[-1])], "predict")
    assert fitted.get("role", "fit") == "fit"
    assert fitted["file"] == foreseen["file"] == "explore.mcap"
    assert study["actuator"].get("dead_zone") == ({"guess": "0.25 V", "min": 0} if asked else None)


def test_caught_is_what_stands_for_the_last_three_seconds_on_any_turn_and_kept_within_its_travel(monkeypatch):
    """Of 24 motions from hanging that are upright but for one thing each; an exact count, by hand."""
    n = round(UP / RIG.period)
    t = np.arange(n) * RIG.period

    def simulate(plant, parameters, start, command, period, *, samples, substeps, loop):
        assert (plant, command, period, samples, loop) == (RIG.plant, None, RIG.period, n, "rule")
        assert parameters["actuator.gain"] == pytest.approx(RIG.gain)
        np.testing.assert_array_equal(start, np.zeros((LANES, 4)))
        x = np.zeros((n, 4, LANES))
        x[:, 2] = math.pi
        x[:, 2, :6] += 2 * math.pi * np.arange(-3, 3)  # after whole turns
        x[t < UP - HELD - 0.01, 2, 6] = 0.0  # up in time
        x[t < UP - HELD + 0.01, 2, 7] = 0.0  # late
        x[:, 2, 8:10] += np.radians([9.9, 10.1])
        x[:, 2, 10:12] -= np.radians([9.9, 10.1])
        x[n // 2, 0, 12:16] = [1.49, 1.51, -1.49, -1.51]
        return x

    monkeypatch.setattr(quick, "simulate", simulate)
    law = SimpleNamespace(travel=1.5, rule=lambda model, start: "rule")
    assert caught(RIG, law, 0) == pytest.approx((LANES - 5) / LANES)
