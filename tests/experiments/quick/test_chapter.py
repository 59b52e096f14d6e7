"""Does the chapter of a minute at a rig say what its log, its wiring and its swing-up came to?"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.experiments.quick.test_quick import described
from tests.experiments.swing_up_2b.closed_form import LAW, RIG, climbed
from upright.basis import DESCRIBED
from upright.control.exploration import CALMS, COASTS, ENDS, KICKS, PUMPS, RISES, WAITS
from upright.control.wiring import WiringCheck
from upright.experiments.quick.chapter import chapter
from upright.experiments.quick.figures import first_motions_figure
from upright.experiments.quick.run import HELD, LANES, QuickRun
from upright.experiments.stand.live import live_stand
from upright.identification.model.fit import Estimate
from upright.records import Record

GOOD = WiringCheck(
    names=("psi", "theta"), unit="V", described=(16000.0, 16000.0), turns=(True, True), moves=1.0, swings=1.0,
    scale=(1.0, 0.99), error=(0.01, 0.002), drive=0.52, drive_error=0.02, dead_zone=0.25, dead_error=0.015,
    delay=0.004, broke_away=(0.375, 0.4375),
)  # fmt: skip
T = 0.5 + np.arange(60) * 0.25
"""A log whose clock did not begin at zero."""
BEGUN = {WAITS: 0, RISES: 4, KICKS: 10, PUMPS: 20, COASTS: 30, CALMS: 40, ENDS: 56}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A minute that came upright 2 s after the swing began and stood for 6 s, the first motions having taken 15 s."""
    stand = live_stand(described(tmp_path_factory.mktemp("quick")))
    mode = np.zeros(T.size)
    for phase, k in BEGUN.items():
        mode[k:] = phase
    log = Record(t=T, signals={"u_applied": np.sin(T), "psi": 7.0 + 0.1 * T, "theta": -2.0 + np.cos(T)})
    estimates = {
        "J_d": replace(Estimate.within(0.0125, 0.0001, 0.0002), status="good", unit="kg m^2"),
        "m_p": replace(Estimate.within(0.25, 0.0, 0.0), status="known", unit="kg"),
        "offset.theta": replace(Estimate.within(0.5, 0.1, 0.2), status="good", unit="rad"),
    }
    fit = SimpleNamespace(
        estimates=estimates,
        model=SimpleNamespace(parameters={"J_d": None, "m_p": None}),
        trusted=True,
        verdict="Fits.",
        interrupted=False,
        failed=False,
        answers=(),
    )
    return QuickRun(
        stand=stand, log=log, mode=mode, wiring=GOOD, seconds=23.4, model=RIG, fit=fit, law=LAW, share=0.75,
        ascent=climbed(),
    )  # fmt: skip


def table(page, caption):
    (found,) = [b for part in page.parts for b in part.content if getattr(b, "caption", "").startswith(caption)
                and hasattr(b, "rows")]  # fmt: skip
    return found


def test_a_pendulum_that_stands_is_said_to_after_how_long(done):
    assert done.upright
    page = chapter(done)
    weak = "Supply at half: the drive gives 0.52 ± 0.04 times its description."
    assert page.verdict.endswith(f"Upright 2 s after the swing-up began, 23 s after the first motion. {weak}")
    assert page.detail == f"In simulation 75 % of {LANES} rigs sampled from the fit's covariance were caught."
    assert [(k.what, k.value) for k in page.findings] == [("time at the rig", "23 s")]
    (step,) = page.steps
    assert step.sentence == "Identify it at more length, and compare pole sets."
    assert step.command.startswith("upright lab --rig ")
    assert "--quick" not in step.command
    told = page.numbers
    assert (told["upright"], told["refused"], told["wrong"], told["share"]) == (True, None, [], 0.75)
    assert told["swing_up"] == {"upright_after": 2.0, "peak_command": 8.0, "travel": pytest.approx(0.6, rel=1e-3),
                                "ended": None}  # fmt: skip
    assert told["K"].tolist() == LAW.K.tolist()
    assert told["rule"]["kind"] == "rule"
    assert told["basis"] == RIG.basis.plain()
    assert told["fit"]["parameters"]["J_d"]["value"] == 0.0125


def test_standing_for_less_than_three_seconds_at_the_end_is_not_upright(done):
    """Of 8 s it must stand from 5 s on."""
    assert HELD == 3.0
    for falls, stands in (([(2.5, 4.9)], True), ([(2.5, 5.1)], False)):
        result = replace(done, ascent=climbed(falls=falls))
        assert result.upright == stands
    page = chapter(result)
    assert "It did not stand for the last 3 s; peak command 8 V." in page.verdict
    assert not page.sound
    assert [s.sentence for s in page.steps] == ["Identify it at more length, with a person beside it."]
    stopped = replace(done, ended="a limit.")
    assert not stopped.upright
    assert "The swing-up was stopped after 8 s: a limit." in chapter(stopped).verdict


def test_what_first_motions_tell_stands_with_its_interval_of_two_standard_errors(done):
    assert [tuple(str(x) for x in row) for row in table(chapter(done), "Estimated from the first motions").rows] == [
        ("psi, reading over true motion", "1.000", "0.020", ""),
        ("theta, reading over true motion", "0.9900", "4.0·10⁻³", ""),
        ("force of the drive over its description", "0.520", "0.040", ""),
        ("dead zone, command lost to either side", "0.250", "0.030", "V"),
        ("delay and lag of the drive", "4.0", "", "ms"),
        ("command at which psi broke away, up", "0.375", "", "V"),
        ("command at which psi broke away, down", "0.438", "", "V"),
    ]
    bare = replace(done, wiring=replace(GOOD, drive=None, delay=None, dead_error=None, swings=None))
    assert [row[0] for row in table(chapter(bare), "Estimated from the first motions").rows] == [
        "command at which psi broke away, up", "command at which psi broke away, down",
    ]  # fmt: skip


def test_estimates_are_those_of_the_rig_that_were_not_known(done):
    (row,) = table(chapter(done), "Identified").rows
    assert tuple(str(x) for x in row[:3]) == ("J_d", "0.01250", "2.0·10⁻⁴")
    assert row[4] == "good"


def test_gains_are_the_command_for_a_unit_of_each_state(done):
    """u = -K x."""
    rows = table(chapter(done), "State feedback").rows
    assert [row[0] for row in rows] == list(RIG.states)
    shown = [float(str(row[1]).replace("−", "-")) for row in rows]
    np.testing.assert_allclose(shown, -LAW.K, rtol=1e-3)
    assert [str(row[2]) for row in rows] == ["V/rad", "V/(rad/s)", "V/rad", "V/(rad/s)"]


def test_where_the_wiring_is_wrong_no_loop_is_closed_and_each_remedy_is_a_step(done):
    wiring = replace(GOOD, moves=-1.0, scale=(1.0, 0.5), drive=1.0)
    refused = "motor leads swapped; theta: counts per turn 8000, not 16000"
    page = chapter(
        replace(done, wiring=wiring, refused=refused, fit=None, law=None, model=None, share=None, ascent=None)
    )
    assert page.verdict.endswith(f"No loop was closed: {refused}.")
    assert [s.sentence for s in page.steps] == [
        "Change the motor's two leads over.", "It shows 0.5 ± 0.004 times what is true; correct its counts.",
    ]  # fmt: skip
    assert [s.command.endswith("--quick") for s in page.steps] == [True, False]
    assert page.detail.startswith("Motor leads swapped: change the motor's two leads over. Theta: counts per turn 8000")
    assert [part.title for part in page.parts] == ["Wiring"]
    assert [(k.what, k.value) for k in page.findings] == [("wiring", refused)]
    unwired = replace(done, refused="too few", ascent=None, share=None)
    assert [(k.what, k.value) for k in chapter(unwired).findings] == [("no loop", "too few")]
    assert chapter(unwired).detail == ""
    assert page.numbers["basis"] == DESCRIBED.plain()  # nothing was identified
    assert page.numbers["rule"] is None
    assert chapter(replace(unwired, law=None)).numbers["rule"] is None


def test_first_motions_begin_at_zero_and_every_phase_is_marked_where_it_begins(done):
    command, body, pendulum = first_motions_figure(done).axes
    names = {WAITS: None, RISES: "ramps", KICKS: "kicks", PUMPS: "swung", COASTS: "coasts", CALMS: "calmed"}
    marked = {t.get_text().strip(): t.get_position()[0] for t in command.texts}
    assert marked == {n: 0.25 * BEGUN[phase] for phase, n in names.items() if n}
    for ax, signal in ((command, np.sin(T)), (body, 0.1 * (T - T[0])), (pendulum, np.cos(T) - np.cos(T[0]))):
        curve = max(ax.lines, key=lambda line: len(line.get_xdata()))
        np.testing.assert_allclose(curve.get_xdata(), T - 0.5)
        np.testing.assert_allclose(curve.get_ydata(), signal, atol=1e-12)
        assert sorted(line.get_xdata()[0] for line in ax.lines if len(line.get_xdata()) == 2) == sorted(marked.values())
    assert [ax.get_ylabel().rpartition(" ")[2] for ax in (command, body, pendulum)] == ["[V]", "[rad]", "[rad]"]
