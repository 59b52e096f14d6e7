"""Do the reports of a run, a check-up and a machine's lateness say their numbers in the units they name?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from upright.basis import DESCRIBED, SIMULATED
from upright.realtime.jitter import Jitter
from upright.realtime.priority import LoopPriority
from upright.realtime.session import RunEnd
from upright.rig.makes import make_rig
from upright.rigs import Fault
from upright.running.chapter import NO_SAFETY, checkup_chapter, jitter_chapter, run_chapter
from upright.running.doctor import Checkup, CheckupFinding

BEHIND = np.full(1001, 20e-6)
WORK = np.linspace(0.0, 100e-6, 1001)
JITTER = Jitter(
    period=2e-3, behind=BEHIND, overslept=BEHIND, late=0, work=WORK,
    standing=LoopPriority(priority="FIFO 80", locked=True),
)  # fmt: skip


def test_lateness_is_told_in_microseconds_and_as_shares_of_its_ticks():
    """A thousand and one ticks of 2 ms are 2 s at 500 Hz, each 20 us behind; of work from 0 to 100 us half is 50."""
    page = jitter_chapter(replace(JITTER, late=25, stolen=0.25))
    facts = dict(page.parts[0].content[0].pairs)
    assert page.parts[0].title == "2 s at 500 Hz"
    assert facts["p50"] == facts["max"] == "20 µs"
    assert facts["law and supervision of a tick"] == "50 µs (p99 99 µs)"
    assert (facts["late ticks"], facts["priority"], facts["memory"]) == ("25 of 1001", "FIFO 80", "locked")
    assert facts["taken by the host"] == "0.25 s"
    told = page.numbers
    assert (told["late"], told["late_share"], told["ticks"], told["period"]) == (25, 25 / 1001, 1001, 2e-3)
    assert (told["work_p50"], told["work_p99"]) == (pytest.approx(50e-6), pytest.approx(99e-6))
    assert told["behind_p99"] == pytest.approx(20e-6)
    assert told["verdict"] == page.verdict
    assert "taken by the host" not in dict(jitter_chapter(JITTER).parts[0].content[0].pairs)


def test_a_faster_rate_is_proposed_only_where_time_is_left_for_it():
    page = jitter_chapter(JITTER)
    facts = dict(page.parts[0].content[0].pairs)
    assert page.sound == JITTER.held
    proposed = [s.command for s in page.steps if "--rate" in s.command]
    assert proposed == ([f"upright rig check --rate {JITTER.promising}"] if JITTER.promising else [])
    assert ("time left for" in facts) == bool(JITTER.promising)
    slow = jitter_chapter(replace(JITTER, behind=np.full(1001, 5e-3), late=1001))
    assert not slow.sound
    assert not any("--rate" in s.command for s in slow.steps)


def checkup(*goods, **more):
    findings = tuple(
        CheckupFinding(what=what, observed="so", good=good, fix="" if good is not False else f"mend {what}")
        for what, good in goods
    )
    return checkup_chapter(Checkup(name="rig", findings=findings, **more), "RIG.toml")


def test_what_to_do_after_a_check_up_follows_from_what_was_found():
    again = "upright rig doctor RIG.toml"
    untried = checkup(("link", True), ("the drive", None))
    assert [(s.sentence, s.command) for s in untried.steps] == [("Supply on, and try the drive.", again)]
    whole = checkup(("link", True), ("the drive, forward", True))
    assert whole.steps[0].command == "upright run --rig RIG.toml --law design.json --duration 30"
    wrong = checkup(("theta by hand", False), ("psi by hand", False))
    assert wrong.steps[0].sentence == "Mend it, and look again: mend theta by hand; mend psi by hand."
    assert (wrong.sound, whole.sound) == (False, True)
    written = checkup(("theta by hand", False), counts={"theta": 8000.0}, written=Path("RIG.toml"))
    assert (written.steps[0].sentence, written.steps[0].command) == (
        "The counts are in RIG.toml now; look again.",
        again,
    )
    assert written.numbers["counts"] == {"theta": 8000.0}
    assert checkup_chapter(Checkup(name="rig", findings=(CheckupFinding(what="link", observed="so", good=False),)),
                           "RIG.toml").steps[0].sentence == "Mend what is above, and look again."  # fmt: skip
    assert written.warnings == (NO_SAFETY,)


def ran(**more):
    """A run of a law of 8 V at most, 1000 ticks of a millisecond, as its report asks for it."""
    rig = make_rig("furuta")
    end = RunEnd(ticks=1000, late=3, rows=997, dropped=2, seconds=1.25, events=((0.5, "state", "running"),))
    back = SimpleNamespace(peak=7.5, saturated=0.125)
    parts = {
        "request": SimpleNamespace(rig=Path("RIG.toml"), law=Path("law.json"), seconds=1.0), "model": rig, "end": end,
        "file": SimpleNamespace(kind="twin", hardware=False, performed=SIMULATED), "log_path": Path("run.mcap"),
        "log": None, "unrest": (1e-5, 0.02), "count": (4e-4, 4e-4), "way_back": back, "limit": 8.0, "effort": None,
        "quiet": True, "sound": True, "verdict": "Ran.", "basis": DESCRIBED,
    }  # fmt: skip
    return SimpleNamespace(**(parts | more))


def commands(run):
    return [s.command for s in run_chapter(run).steps]


def test_a_run_is_told_with_its_shares_and_a_rest_below_a_count_as_that():
    page = run_chapter(ran())
    facts = dict(page.parts[0].content[0].pairs)
    assert facts["ticks"] == "1000, 3 late (0.3 %)"
    assert facts["log"] == "run.mcap: 997 rows, 2 dropped"
    assert facts["psi, rms of the second half"].startswith("below a count, ")
    assert facts["theta, rms of the second half"].replace("\N{NO-BREAK SPACE}", " ") == "0.0200 rad"
    assert facts["largest command"].replace("\N{NO-BREAK SPACE}", " ") == (
        "7.50 of 8 V, at the limit for 12 % of the ticks"
    )
    assert page.parts[0].content[1].rows[0][1:] == ("state", "running")
    assert [(k.what, k.value) for k in page.findings] == [("late ticks", "3 of 1000")]
    told = page.numbers
    assert (told["rms"], told["clock_seconds"], told["late"]) == ([1e-5, 0.02], 1.25, 3)
    assert "none" in dict(run_chapter(ran(end=RunEnd())).parts[0].content[0].pairs)["ticks"]
    assert NO_SAFETY not in page.warnings
    live = SimpleNamespace(kind="serial", hardware=True, performed="")
    assert NO_SAFETY in run_chapter(ran(file=live)).warnings


def test_what_to_do_after_a_run_follows_from_how_it_ended():
    look, wired = "upright log show run.mcap --plot", "upright rig doctor RIG.toml"
    late, again = "upright rig check", "upright log replay run.mcap"
    assert commands(ran()) == [look, late, again]
    assert commands(ran(end=RunEnd(ticks=1000))) == [look, again]
    assert commands(ran(end=RunEnd(ticks=1000), quiet=False)) == [look, "upright design --help"]
    stopped = RunEnd(ticks=10, stopped="a limit", faults=Fault.OVERTRAVEL)
    assert commands(ran(end=stopped, log=[1, 2])) == [look, wired]
    assert commands(ran(end=stopped)) == [wired]  # no loop began
    signal = SimpleNamespace(rig=Path("RIG.toml"), law=None, seconds=1.0)
    assert commands(ran(request=signal, end=RunEnd(ticks=1000))) == [look, "upright init run.mcap"]
    assert run_chapter(ran(end=stopped)).numbers["faults"] == int(Fault.OVERTRAVEL)
    assert not run_chapter(ran(quiet=False)).sound
