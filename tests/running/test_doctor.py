"""Is a rig that is wired otherwise than described told from a sound one, channel by channel, before any loop?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from upright.errors import RigStopped
from upright.rig.makes import PER_METRE, make_rig
from upright.running import doctor
from upright.running.chapter import checkup_chapter
from upright.running.doctor import Checkup, CheckupFinding, check_up
from upright.running.power_up import LENGTH
from upright.running.rig import stage_of


def rig_file(tmp_path, make="furuta", more=""):
    path = tmp_path / "RIG.toml"
    path.write_text(f'kind = "twin"\nmake = "{make}"\n{more}', encoding="utf-8")
    return path


@pytest.fixture
def wired(monkeypatch):
    """Something is done to the twin's board before anybody looks at it."""

    def so(change):
        def wrong(path, **how):
            stage = stage_of(path, **how)
            change(stage.supervisor.rig)
            return stage

        monkeypatch.setattr(doctor, "stage_of", wrong)

    return so


def found(checkup, what):
    (finding,) = [f for f in checkup.findings if f.what == what]
    return finding


@pytest.mark.parametrize("make", ["furuta", "linear"])
def test_a_sound_rig_shows_what_it_is_and_how_far_a_hand_moved_it(tmp_path, make):
    """The twin's hand turns a pendulum once round, an arm with a cable by a quarter, and moves a cart by 10 cm."""
    rig = make_rig(make)
    checkup = check_up(rig_file(tmp_path, make))
    assert checkup.sound
    assert checkup.verdict == f"Link, limits and encoders of {rig.name} answer as they should."
    assert "2 encoders, a tick every 0.884 ms" in found(checkup, "link").observed
    assert found(checkup, "servo period").observed == "0.884 ms, described as 0.884 ms"
    driven, _ = (c.name for c in rig.plant.coordinates)
    assert found(checkup, "theta by hand").observed == "showed 360 degrees"
    assert found(checkup, f"{driven} by hand").observed == ("showed 90 degrees" if driven == "psi" else "showed 100 mm")
    limit = f"command {rig.limit:.4g} V; watchdog 20 ms"
    assert found(checkup, "limits, read back").observed.endswith(limit)
    assert [f.good for f in checkup.findings] == [True] * len(checkup.findings)
    assert [f.what for f in checkup.findings[-5:]] == [
        "the drive, forward", "a small pulse", "the drive, backward", "end of travel", "watchdog"
    ]  # fmt: skip


@pytest.mark.parametrize("channel", [0, 1])
def test_a_channel_that_is_dead_or_counts_backwards_is_told_by_its_name(tmp_path, wired, channel):
    name, other = (("psi", "theta"), ("theta", "psi"))[channel]
    wired(lambda rig: rig.port.encoders.dead(channel))
    checkup = check_up(rig_file(tmp_path), pulse=False)
    finding = found(checkup, f"{name} by hand")
    assert (finding.good, finding.observed) == (False, "showed 0 degrees: not connected, or not this channel")
    assert checkup.verdict == f"Do not close a loop: {name} by hand: {finding.observed}"
    assert found(checkup, f"{other} by hand").good
    wired(lambda rig: rig.port.encoders.scaled(channel, -1.0))
    finding = found(check_up(rig_file(tmp_path), pulse=False), f"{name} by hand")
    assert (finding.good, finding.observed.split(" degrees")[0]) == (False, f"showed -{90 * (1 + 3 * channel)}")
    assert finding.observed.endswith("it counts the wrong way, swap its channels")


def test_plugs_in_each_other_s_place_are_told_from_a_dead_encoder(tmp_path, wired):
    def swapped(rig):
        read = rig.port.read
        rig.port.read = lambda: read()[::-1]

    wired(swapped)
    checkup = check_up(rig_file(tmp_path))
    finding = found(checkup, "psi by hand")
    assert (finding.good, finding.fix) == (False, "swap the plugs of psi and theta")
    assert "theta moved: their encoders are swapped" in finding.observed
    assert found(checkup, "the drive").good is None  # never switched on


def test_a_hand_is_asked_in_the_coordinate_s_unit_and_may_refuse(tmp_path):
    asked = []
    checkup = check_up(rig_file(tmp_path, "linear"), hand=lambda text: bool(asked.append(text)), pulse=False)
    assert [text.split(",")[0] for text in asked] == [
        "Move x by hand by 100 mm in the sense that is to be positive",
        "Move theta by hand by one full turn",
    ]
    assert (
        "its free end leaving in the positive sense of x" in asked[1]
    )  # fig. A1: its end is faster than the cart by l theta'
    left = [found(checkup, w) for w in ("x by hand", "theta by hand", "the drive")]
    assert [(f.observed, f.good) for f in left] == [("not moved", None)] * 2 + [("not tried", None)]
    assert checkup.sound
    assert checkup.verdict.endswith("Not looked at: x by hand, theta by hand, the drive.")


def test_a_rig_is_looked_at_where_it_hangs_and_may_lean_as_it_will(tmp_path, monkeypatch):
    """Nothing is held upright meanwhile, so that no lean stops what a hand does."""
    stages = []
    monkeypatch.setattr(doctor, "stage_of", lambda path, **how: stages.append(stage_of(path, **how)) or stages[0])
    check_up(rig_file(tmp_path), pulse=False)
    duty = stages[0].supervisor.duty
    assert (duty.at, duty.zero, duty.lean, duty.near) == ("hanging", "hanging", math.inf, math.inf)


def test_a_stop_that_is_pressed_meanwhile_is_told_instead_of_the_next_channel(tmp_path, wired):
    rigs = []
    wired(rigs.append)
    checkup = check_up(rig_file(tmp_path), hand=lambda _: rigs[0].estop() or False, pulse=False)
    finding = found(checkup, "theta by hand")
    assert (finding.observed, finding.good) == ("it was stopped by hand", False)
    assert not checkup.sound


@pytest.mark.parametrize(
    ("share", "words"), [(0.81, None), (1.19, None), (0.78, "0.78 times"), (1.22, "1.2 times"), (0.09, "not connected")]
)
def test_a_hand_may_miss_by_a_fifth_what_it_is_asked_for(tmp_path, wired, share, words):
    """100 mm of a cart are asked for."""
    rigs = []
    wired(rigs.append)

    def hand(text):
        if "Move x" in text:
            rigs[0].port.hold("hanging", [share * LENGTH, 0.0, 0.0, 0.0])
            return True
        return False

    finding = found(check_up(rig_file(tmp_path, "linear"), hand=hand, pulse=False), "x by hand")
    assert (finding.good, words or "showed") == (words is None, words or "showed")
    assert (words or "showed") in finding.observed
    counts = math.floor(share * LENGTH * PER_METRE + 0.5)
    assert finding.observed.startswith(f"showed {1e3 * counts / PER_METRE:.3g} mm")


def test_a_rig_that_is_not_the_one_described_is_told(tmp_path, wired):
    """A board of another period and of twice the counts of theta."""

    def other(rig):
        about = rig.port.open()
        rig.port.open = lambda: replace(
            about, period=about.period * 1.01, counts=(about.counts[0], 2 * about.counts[1])
        )

    wired(other)
    checkup = check_up(rig_file(tmp_path), pulse=False)
    assert found(checkup, "servo period").good is False
    assert found(checkup, "servo period").observed == "0.8928 ms, described as 0.884 ms"
    assert found(checkup, "counts").good is False
    per = make_rig("furuta").per_unit
    assert np.allclose(
        [float(n) for n in found(checkup, "counts").observed.split(", ")], [per[0], 2 * per[1]], rtol=1e-5
    )


def test_a_drive_that_moves_nothing_is_told_as_the_drive(tmp_path, wired):
    """Its encoders are well."""
    wired(lambda rig: setattr(rig.port, "enable", lambda on: None))
    last = check_up(rig_file(tmp_path)).findings[-1]
    assert (last.what, last.good) == ("the drive, forward", False)
    assert "not even 5 V moved psi: nothing drives it" in last.observed


def test_the_board_is_let_go_whatever_was_found(tmp_path, wired):
    rigs = []
    for change in (lambda rig: None, lambda rig: rig.port.encoders.dead(0)):
        wired(lambda rig, change=change: (rigs.append(rig), change(rig)))
        check_up(rig_file(tmp_path))
        with pytest.raises(RigStopped, match="not open"):
            rigs[-1].exchange(0.0)


def test_what_was_not_looked_at_is_no_fault_and_the_first_fault_is_the_verdict():
    def of(*goods):
        return Checkup(name="rig", findings=tuple(CheckupFinding(what=f"{i}", observed="so", good=g)
                                                  for i, g in enumerate(goods)))  # fmt: skip

    assert of(True, None, True).verdict == "Link, limits and encoders of rig answer as they should. Not looked at: 1."
    assert of(True, True).verdict == "Link, limits and encoders of rig answer as they should."
    assert of(None, False, False).verdict == "Do not close a loop: 1: so"
    assert [of(*goods).sound for goods in ((True, None), (True,), (None, False))] == [True, True, False]
    told = checkup_chapter(of(True, None, False), "RIG.toml")
    assert [row[2] for row in told.parts[0].content[0].rows] == ["good", "not looked at", "wrong"]
    assert told.steps[0].command == "upright rig doctor RIG.toml"
    assert checkup_chapter(of(True), "RIG.toml").steps[0].command.startswith("upright run --rig RIG.toml")
