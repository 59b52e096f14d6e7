"""Is a stop final until the operator arms again, whoever stops and whatever was going on?"""

from __future__ import annotations

import math
import threading
from dataclasses import replace

import numpy as np
import pytest

from tests.browser.runs import SOON, felt, hardware, settled, station, twin
from upright.basis import NOT_TRUSTED, Basis
from upright.browser.hanging import first_motions, write_swing_up
from upright.browser.lease import PATIENCE
from upright.browser.messages import ClientRequest
from upright.browser.runs import listed, report_apart
from upright.browser.station import obey
from upright.control.exploration import SECONDS
from upright.errors import BadInput
from upright.realtime.process import BY_HAND, DEAF, run_in_process
from upright.realtime.session import RunState
from upright.running.run import RunRequest, prepared


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return twin(tmp_path_factory.mktemp("bench"))


@pytest.fixture
def at_work(rig, tmp_path):
    with station(rig, tmp_path) as made:
        yield made


def ask(made, who, do, **fields):
    obey(made, who, ClientRequest(do=do, fields=fields))


def test_a_run_goes_from_idle_to_its_end_and_has_a_verdict(at_work):
    made, carry, _ = at_work
    ask(made, "operator", "start", seconds=5.0)
    assert made.state == "starting"
    carry.go(RunState(phase="testing: a small pulse"))
    assert made.state == "starting"
    assert carry.go() == ""
    assert made.state == "running"
    assert (carry.orders[0].seconds, carry.orders[0].wall) == (5.0, True)
    assert not made.described("operator")["writing"]
    carry.end()
    assert settled(made, lambda m: m.verdict)
    assert (made.state, made.why, made.verdict, made.last.late) == ("ended", "", "the verdict", 7)
    assert not made.described("operator")["writing"]
    ask(made, "operator", "start")
    assert made.state == "starting"


def test_a_verdict_that_comes_when_the_next_run_has_begun_is_not_taken_for_its_own(rig, tmp_path):
    """The page of that run would not show its verdict, since it had one before it ended."""
    first, second = threading.Event(), threading.Event()
    turn = iter([(first, "of the first"), (second, "of the second")])

    def report(run, end, started):
        written, verdict = next(turn)
        assert written.wait(SOON)
        return verdict

    with station(rig, tmp_path, report=report) as (made, carry, _):
        ask(made, "operator", "start")
        carry.go()
        writing = made._thread
        carry.end()
        assert settled(made, lambda m: m.state == "ended")
        assert made.described("operator")["writing"]
        ask(made, "operator", "start")
        carry.go()
        assert made.described("operator")["writing"]  # still that of the first
        first.set()
        writing.join(SOON)
        assert (made.state, made.verdict, made.described("operator")["writing"]) == ("running", "", False)
        carry.end()
        second.set()
        assert settled(made, lambda m: m.verdict == "of the second")


@pytest.mark.parametrize("when", ["idle", "starting", "running"])
@pytest.mark.parametrize(("who", "why"), [("operator", "its operator"), ("a watcher", "somebody who watches")])
def test_anybody_stops_it_at_any_time_and_only_the_operator_arms_it_again(at_work, when, who, why):
    made, carry, _ = at_work
    if when != "idle":
        ask(made, "operator", "start")
    if when == "running":
        carry.go()
    assert made.state == when
    ask(made, who, "stop")
    assert (made.state, why in made.why) == ("stopped", True)
    assert when == "idle" or made.desk.stopping
    with pytest.raises(BadInput, match="Arm it again"):
        ask(made, "operator", "start")
    with pytest.raises(BadInput, match="somebody else operates"):
        ask(made, "a watcher", "rearm")
    if when != "idle":
        carry.go()  # a loop that has not looked yet changes nothing
        assert made.state == "stopped"
        with pytest.raises(BadInput, match="on its way to rest"):
            ask(made, "operator", "rearm")
        carry.end("Stopped by hand.")
        assert settled(made, lambda m: m.over)
    assert why in made.why  # who, and not the loop's own sentence
    ask(made, "operator", "rearm")
    assert (made.state, made.why) == ("idle", "")
    ask(made, "operator", "start")
    assert not made.desk.stopping


def test_an_operator_ends_a_run_without_a_stop_and_a_stop_meanwhile_is_one(at_work):
    made, carry, _ = at_work
    for stopped, state in ((False, "ended"), (True, "stopped")):
        ask(made, "operator", "start")
        carry.go()
        with pytest.raises(BadInput, match="somebody else"):
            ask(made, "a watcher", "end")
        assert not made.desk.stopping
        ask(made, "operator", "end")
        assert made.desk.stopping
        if stopped:
            ask(made, "a watcher", "stop")
        carry.end(BY_HAND)
        assert settled(made, lambda m: m.over)
        assert made.state == state


def test_a_fall_on_the_way_to_the_end_is_a_stop(at_work):
    made, carry, _ = at_work
    ask(made, "operator", "start")
    carry.go()
    ask(made, "operator", "end")
    carry.end("theta is 31 degrees from where it is to be stabilised: it fell.")
    assert settled(made, lambda m: m.over)
    assert (made.state, "it fell" in made.why) == ("stopped", True)


def test_what_the_supervisor_stops_stays_stopped(at_work):
    made, carry, _ = at_work
    ask(made, "operator", "start")
    carry.go()
    carry.end("theta is 31 degrees from where it is to be stabilised: it fell.")
    assert settled(made, lambda m: m.over)
    assert (made.state, "it fell" in made.why) == ("stopped", True)
    with pytest.raises(BadInput, match="it fell"):
        ask(made, "operator", "start")


@pytest.mark.parametrize(
    ("do", "fields"),
    [("start", {}), ("rearm", {}), ("tap", {"coordinate": "theta", "speed": 1.0}), ("reference", {"value": 0.1}),
     ("poles", {"poles": [-5.0, -6.0, -7.0, -8.0]})],
)  # fmt: skip
def test_who_watches_changes_nothing(at_work, do, fields):
    made, carry, _ = at_work
    ask(made, "operator", "start")
    carry.go()
    with pytest.raises(BadInput, match="somebody else operates it"):
        ask(made, "a watcher", do, **fields)
    assert (made.state, made.desk.stopping) == ("running", False)
    assert felt(made.desk, made.rig.law) == ([], [], None)


def test_one_operates_until_they_give_it_away(at_work):
    made, _, _ = at_work
    with pytest.raises(BadInput, match="somebody else"):
        ask(made, "second", "operate")
    ask(made, "operator", "release")
    with pytest.raises(BadInput, match="take it first"):
        ask(made, "operator", "start")
    ask(made, "second", "operate")
    ask(made, "second", "start")
    assert made.state == "starting"
    assert [made.described(who)["operator"] for who in ("operator", "second")] == ["another", "you"]


def test_a_rig_whose_operator_stays_away_is_stopped(at_work):
    made, carry, clock = at_work
    ask(made, "operator", "start")
    carry.go()
    made.lease.gone("operator")
    clock.now += PATIENCE
    made.beat()
    assert made.state == "running"
    clock.now += 0.1
    made.beat()
    assert (made.state, made.desk.stopping, made.lease.holder) == ("stopped", True, "")
    assert "gone" in made.why


def test_a_reload_within_ten_seconds_stops_nothing(at_work):
    made, carry, clock = at_work
    ask(made, "operator", "start")
    carry.go()
    made.lease.gone("operator")
    clock.now += PATIENCE - 0.1
    made.lease.back("operator")
    clock.now += 100.0
    made.beat()
    assert (made.state, made.lease.holder) == ("running", "operator")


def test_a_server_that_does_not_answer_ends_the_run(at_work):
    """Whose thread still looks at the loop although nobody can stop it through the server."""
    made, carry, clock = at_work
    ask(made, "operator", "start")
    made.beat()
    clock.now += DEAF
    assert carry.go() == ""
    clock.now += 0.1
    assert "has not answered" in carry.go()
    made.beat()
    assert carry.go() == ""


@pytest.mark.parametrize(
    ("start", "sentence"),
    [([0.0, 0.0, 0.3, 0.0], "within 10 degrees"), ([0.1, 0.0, 0.0, 0.0], "lets go of theta"),
     ([0.1], "lets go of theta"), ([0.0, 0.0, 0.05, 1.0], "lets go of theta")],
)  # fmt: skip
def test_a_start_that_no_hand_gives_is_refused_before_anything_begins(at_work, start, sentence):
    made, carry, _ = at_work
    with pytest.raises(BadInput, match=sentence):
        ask(made, "operator", "start", start=start)
    assert (made.state, carry.orders) == ("idle", [])


@pytest.mark.parametrize("seconds", [0.0, -1.0, 3601.0])
def test_a_run_is_no_longer_than_an_hour(at_work, seconds):
    with pytest.raises(BadInput, match="at most 3600 s"):
        ask(at_work[0], "operator", "start", seconds=seconds)


def test_what_a_client_sends_to_a_run_is_bounded(at_work):
    made, carry, _ = at_work
    with pytest.raises(BadInput, match="does not run"):
        ask(made, "operator", "tap", coordinate="theta", speed=1.0)
    ask(made, "operator", "start")
    carry.go()
    for do, fields, sentence in (
        ("tap", {"coordinate": "phi", "speed": 1.0}, "no coordinate 'phi'"),
        ("tap", {"coordinate": "theta", "speed": 21.0}, "at most 20"),
        ("reference", {"value": 2 * math.tau}, "within its travel"),
        ("poles", {"poles": [1.0, -6.0, -7.0, -8.0]}, "left of 0"),
        ("poles", {"poles": [-5e3, -6.0, -7.0, -8.0]}, "within 1131"),
        ("poles", {"poles": [-5.0, -6.0, -7.0]}, "4"),
        ("poles", {"poles": [-5.0 + 1j, -6.0, -7.0, -8.0]}, "conjugate"),
    ):
        with pytest.raises(BadInput, match=sentence):
            ask(made, "operator", do, **fields)
    assert felt(made.desk, made.rig.law) == ([], [], None)
    ask(made, "operator", "tap", coordinate="theta", speed=-2.0)
    ask(made, "operator", "reference", value=0.5)
    assert felt(made.desk, made.rig.law) == ([[0.0, -2.0]], [], 0.5)


def test_gains_are_those_of_the_poles(at_work, rig):
    made, carry, _ = at_work
    ask(made, "operator", "start")
    carry.go()
    wanted = [-5.0 + 2j, -5.0 - 2j, -20.0, -4.0]
    ask(made, "operator", "poles", poles=wanted)
    linear = rig.model.linear("inverted")
    closed = np.linalg.eigvals(linear.A - linear.B @ made.requested.K)
    assert sorted(closed, key=lambda z: (z.real, z.imag)) == pytest.approx(
        sorted(np.array(wanted), key=lambda z: (z.real, z.imag)), rel=1e-6
    )
    with pytest.raises(BadInput, match="not answered yet"):
        ask(made, "operator", "poles", poles=wanted)


def test_hardware_is_not_tapped_and_other_gains_are_confirmed(rig, tmp_path):
    with station(hardware(rig), tmp_path) as (made, carry, _):
        ask(made, "operator", "start")
        carry.go()
        with pytest.raises(BadInput, match="by hand"):
            ask(made, "operator", "tap", coordinate="theta", speed=1.0)
        with pytest.raises(BadInput, match="confirm"):
            ask(made, "operator", "poles", poles=[-5.0, -6.0, -7.0, -8.0])
        ask(made, "operator", "poles", poles=[-5.0, -6.0, -7.0, -8.0], confirm=True)


def test_hardware_whose_model_is_not_trusted_runs_only_for_a_reason(rig, tmp_path):
    doubtful = hardware(rig, Basis(level=NOT_TRUSTED, sentence="It explains 40 % of theta."))
    with station(doubtful, tmp_path) as (made, carry, _):
        for accept in ("", "  "):
            with pytest.raises(BadInput, match="explains 40 %"):
                ask(made, "operator", "start", accept=accept)
        assert (made.state, carry.orders) == ("idle", [])
        ask(made, "operator", "start", accept="to see it fall")
        assert made.state == "starting"


def test_a_swing_up_begins_where_the_rig_hangs_once_it_is_designed_and_keeps_its_gains(at_work):
    made, carry, _ = at_work
    with pytest.raises(BadInput, match="being designed"):
        ask(made, "operator", "start", **{"from": "hanging"})
    assert (made.state, carry.orders) == ("idle", [])
    assert settled(made, lambda m: not m.hanging)  # whoever asks has it designed
    with pytest.raises(BadInput, match="hand"):
        ask(made, "operator", "start", **{"from": "hanging", "start": [0.0, 0.0, 0.05, 0.0]})
    ask(made, "operator", "start", **{"from": "hanging"})
    carry.go()
    assert (made.state, made.described("operator")["from"]) == ("running", "hanging")
    stage = carry.orders[0].make()
    assert (stage.supervisor.duty.at, stage.supervisor.duty.lean) == ("inverted", math.inf)
    assert made.gains == pytest.approx(made.rig.loop.K)
    for do, fields, words in (("poles", {"poles": [-5.0, -6.0, -7.0, -8.0]}, "a swing-up runs"),
                              ("reference", {"value": 0.1}, "follows no reference")):  # fmt: skip
        with pytest.raises(BadInput, match=words):
            ask(made, "operator", do, **fields)
    carry.end()
    assert settled(made, lambda m: m.over)
    ask(made, "operator", "start")
    carry.go()
    assert made.described("operator")["from"] == "held"
    ask(made, "operator", "poles", poles=[-5.0, -6.0, -7.0, -8.0])


def test_first_motions_begin_where_the_rig_hangs_and_are_no_feedback_of_states(at_work):
    made, carry, _ = at_work
    with pytest.raises(BadInput, match="hand"):
        ask(made, "operator", "start", **{"from": "motions", "start": [0.0, 0.0, 0.05, 0.0]})
    ask(made, "operator", "start", **{"from": "motions", "seconds": 600})
    carry.go()
    order = carry.orders[0]
    assert (order.seconds, made.described("operator")["seconds"]) == (SECONDS, SECONDS)
    assert order.make().supervisor.duty.at == "hanging"
    with pytest.raises(BadInput, match="first motions run"):
        ask(made, "operator", "poles", poles=[-5.0, -6.0, -7.0, -8.0])
    assert made.described("operator")["from"] == "motions"


@pytest.mark.parametrize("kind", ["sweep", "step"])
def test_a_sweep_and_a_step_are_runs_that_stop_as_others_do(at_work, kind):
    made, carry, _ = at_work
    ask(made, "operator", "start", **{"from": kind})
    carry.go()
    order = carry.orders[0]
    assert order.make().supervisor.duty.at == "hanging"
    assert order.seconds == made.described("operator")["seconds"] == made.recording.request.seconds
    with pytest.raises(BadInput, match=f"a {kind} runs"):
        ask(made, "operator", "poles", poles=[-5.0, -6.0, -7.0, -8.0])
    shown = made.recording
    assert (shown.described()["kind"], shown.described()["over"]) == (kind, False)
    ask(made, "a watcher", "stop")
    assert made.desk.stopping
    carry.end("Stopped by hand.")
    assert settled(made, lambda m: m.over and m.recording.described()["over"])
    assert made.recording is shown  # it is looked at until the next one
    ask(made, "operator", "rearm")
    ask(made, "operator", "start")
    assert made.recording is shown


def test_a_rig_that_has_no_first_motions_says_why(rig):
    with pytest.raises(BadInput, match="stands beside it"):
        first_motions(hardware(rig))
    with pytest.raises(BadInput, match="hanging pendulum"):
        first_motions(replace(rig, file=replace(rig.file, zero="inverted")))


def test_a_rig_without_a_swing_up_says_why(rig, tmp_path):
    with pytest.raises(BadInput, match="encoders are checked"):
        write_swing_up(hardware(rig), tmp_path / "s.json")
    upright = replace(rig, file=replace(rig.file, zero="inverted"))
    with pytest.raises(BadInput, match="goes from inverted to inverted"):
        write_swing_up(upright, tmp_path / "s.json")
    assert not (tmp_path / "s.json").exists()
    with station(rig, tmp_path) as (made, _, _):
        made._swing_up = lambda rig, path: write_swing_up(upright, path)
        made.prepare()
        assert settled(made, lambda m: "inverted" in m.hanging)
        with pytest.raises(BadInput, match="goes from inverted"):
            ask(made, "operator", "start", **{"from": "hanging"})
        assert made.state == "idle"


def test_a_design_whose_process_is_killed_is_told_and_nothing_waits_for_it(rig, tmp_path):
    def killed(rig, path):
        raise RuntimeError("the process ended without an answer")

    with station(rig, tmp_path) as (made, _, _):
        made._swing_up = killed
        made.prepare()
        assert settled(made, lambda m: "not designed: the process ended" in m.hanging)
        with pytest.raises(BadInput, match="not designed"):
            ask(made, "operator", "start", **{"from": "hanging"})
        ask(made, "operator", "start")
        assert made.state == "starting"


@pytest.mark.slow
def test_the_furuta_twin_stands_within_ten_degrees_after_six_seconds_from_hanging(rig, tmp_path):
    """By its log, whose encoders begin at 0 and end half a turn on, on either side; its report says since when."""
    write_swing_up(rig, tmp_path / "swing_up.json")
    wish = RunRequest(rig=rig.rig_path, law=tmp_path / "swing_up.json", seconds=6.0, from_rest=True)
    run = prepared(wish, tmp_path)
    end = run_in_process(run.order, paced=False)
    t, theta = (run.ended(end).log.columns[name] for name in ("t", "theta"))
    assert abs(theta[0]) < math.radians(5)
    off = np.abs(np.abs(theta) - math.pi) > math.radians(10)
    assert not off[-1000:].any()
    since = t[np.flatnonzero(off)[-1] + 1] - t[0]
    assert f"It stands since {since:.3g} s." in report_apart(run, end, 0.0)
    assert listed(tmp_path, "furuta")[0]["report"] == "/rigs/furuta/runs/run.html"


@pytest.mark.parametrize(
    ("by", "does", "told"),
    [("operator", "end", "Ended by its operator."), ("operator", "stop", "Stopped by its operator."),
     ("a watcher", "stop", "Stopped by somebody who watches.")],
)  # fmt: skip
def test_a_report_says_who_ended_its_run_and_how(at_work, by, does, told):
    made, carry, _ = at_work
    made._report = lambda run, end, started: end.stopped
    ask(made, "operator", "start")
    carry.go()
    ask(made, by, does)
    carry.end("Stopped by hand.")  # all that the loop knows
    assert settled(made, lambda m: m.verdict == told)
