"""A law from a design runs on the twin of a RIG.toml; the log is whole, and the logged law gives its commands again."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import upright as up
from upright.basis import DESCRIBED, MEASURED, SIMULATED
from upright.errors import BadInput
from upright.gains import feedback, filtered, place, prefilter
from upright.laws import as_values
from upright.logs import read_log
from upright.logs.replay import replay
from upright.realtime.jitter import TOLERATED
from upright.realtime.session import QUIET, RunEnd, RunOrder, carry_out
from upright.report.run import chapter, draw_run
from upright.rig.makes import make_rig
from upright.rigs import Fault
from upright.rigs.rigfile import read_rig_file
from upright.rigs.supervisor import BRAKING
from upright.running import run as run_module
from upright.running.chapter import run_chapter
from upright.running.rig import about_what_is_held, excitation_law, model_and_truth, read_law, stage_of
from upright.running.run import RunRequest, fresh, run_rig
from upright.verbs.rig import RunAnswer

RIG = make_rig("furuta")
LINEAR = RIG.linear("inverted")
POLES = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """RIG.toml of a twin with numbers of its own, and a law."""
    place_of = tmp_path_factory.mktemp("bench")
    (place_of / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
    model = RIG.linear("inverted")
    sampled = model.to_sampled(RIG.period, RIG.delay / RIG.period)
    K = place(model.A, model.B, POLES).K
    law = feedback(filtered(sampled, 0.5), K, prefilter(model.A, model.B, model.C[0], K))
    (place_of / "design.json").write_text(json.dumps({"law": as_values(law)}), encoding="utf-8")
    return place_of


def test_a_law_holds_the_twin_and_its_log_replays_to_the_last_bit(folder, tmp_path):
    done = run_rig(RunRequest(rig=folder / "RIG.toml", law=folder / "design.json", seconds=1.0, tilt=0.05), tmp_path)
    assert not done.end.stopped
    assert done.sound
    assert done.end.ticks == math.ceil(1.0 / RIG.period)
    assert len(done.log) == done.end.ticks
    assert abs(done.away[-1, 1]) < math.radians(2)
    again = replay(read_log(done.log_path))
    assert again.rows.size == done.end.ticks
    assert again.identical


@pytest.mark.parametrize("key", ["law", "as_run"])
def test_a_design_of_before_and_of_now_holds_its_law(folder, tmp_path, key):
    law = json.loads((folder / "design.json").read_text(encoding="utf-8"))["law"]
    before = {"law": {"A": law["A"], "inputs": "readings, readings at rest, reference"}}
    (tmp_path / "design.json").write_text(json.dumps(before | {key: law}), encoding="utf-8")
    read, basis = read_law(tmp_path / "design.json")
    assert as_values(replace(read, target=0.0)) == law
    assert np.asarray(about_what_is_held(read, RIG, "inverted", "hanging").target).tolist() == [0.0, math.pi]
    assert not basis.trusted
    assert "does not say whether it can be trusted" in basis.sentence


def test_a_file_that_is_a_law_rests_on_no_model(folder, tmp_path):
    law = json.loads((folder / "design.json").read_text(encoding="utf-8"))["law"]
    (tmp_path / "law.json").write_text(json.dumps(law), encoding="utf-8")
    _, basis = read_law(tmp_path / "law.json")
    assert basis == DESCRIBED


def test_a_rest_within_one_count_is_said_in_counts(folder, tmp_path):
    """A twin that is its model, let go upright: no count changes. 16,000 counts a turn are 0.0225 degrees each."""
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\n', encoding="utf-8")
    wish = RunRequest(rig=tmp_path / "RIG.toml", law=folder / "design.json", seconds=0.3, check=False)
    done = run_rig(wish, tmp_path)
    assert done.unrest[-1] < 1e-9
    assert "theta stayed within one encoder count, 0.022 degrees (rms" in done.verdict
    told = dict(run_chapter(done).parts[0].content[0].pairs)
    assert told["theta, rms of the second half"] == "below a count, 3.9·10⁻⁴ rad"
    moved = run_rig(replace(wish, tilt=0.05), tmp_path)
    assert f"theta stayed within {math.degrees(moved.unrest[-1]):.2g} degrees" in moved.verdict


def test_a_run_is_told_with_its_tick_its_late_ticks_and_its_log(folder, tmp_path):
    """3 of 400 ticks late are 0.75 %; a rig that did not answer has no name and no tick, and no log to look at."""
    wish = RunRequest(rig=folder / "RIG.toml", law=folder / "design.json", seconds=0.2, check=False)
    done = run_rig(wish, tmp_path)
    told = run_chapter(replace(done, end=replace(done.end, ticks=400, late=3, rows=399, dropped=1)))
    facts = dict(told.parts[0].content[0].pairs)
    assert facts["rig"] == f"{done.end.about.name}, a tick every 0.884 ms"  # the servo of the ECP 205
    assert facts["ticks"] == "400, 3 late (0.75 %)"
    assert facts["log"] == f"{done.log_path.name}: 399 rows, 1 dropped"
    assert [p.title for p in told.parts] == ["The run", "What was logged"]
    assert told.findings[0].value == "3 of 400"
    assert [s.command.split()[1:3] for s in told.steps] == [["log", "show"], ["rig", "check"], ["log", "replay"]]
    silent = run_chapter(replace(done, end=RunEnd(stopped="No rig answered at the port."), log=None))
    (run,) = silent.parts
    assert dict(run.content[0].pairs) == {
        "ticks": "0, 0 late (none)",
        "log": f"{done.log_path.name}: 0 rows, 0 dropped",
    }
    assert silent.verdict.endswith("Stopped before its loop began: No rig answered at the port.")
    assert not silent.sound
    assert [s.command.split()[1:3] for s in silent.steps] == [["rig", "doctor"]]


def test_a_reference_is_in_the_log_with_its_unit_and_a_law_without_one_has_no_column(folder, tmp_path):
    wish = RunRequest(rig=folder / "RIG.toml", law=folder / "design.json", seconds=0.4, reference="sine 0.1 2.5")
    done = run_rig(wish, tmp_path)
    t = np.arange(len(done.log)) * RIG.period
    np.testing.assert_allclose(done.log.columns["reference"], 0.1 * np.sin(5 * math.pi * t), atol=1e-12)
    assert done.log.header.references == (("reference", "rad"),)
    assert replay(read_log(done.log_path)).identical
    assert ("followed", "reference [rad]") in chapter(done.log).parts[0].content[0].pairs
    assert up.read(str(done.log_path)).units["reference"] == "rad"
    up.log_convert(done.log_path, out=tmp_path / "run.csv")
    assert np.array_equal(up.read(str(tmp_path / "run.csv"))["reference"], done.log.columns["reference"])
    plain = run_rig(replace(wish, reference=None, tilt=0.02), tmp_path)
    assert "reference" not in plain.log.columns
    assert "excitation" not in run_rig(replace(wish, law=None, reference=None, excite="free"), tmp_path).log.columns


@pytest.mark.slow
def test_a_reference_is_followed_and_replays(folder, tmp_path):
    wish = RunRequest(rig=folder / "RIG.toml", law=folder / "design.json", seconds=2.5, reference="step 0.4")
    done = run_rig(wish, tmp_path)
    assert not done.end.stopped
    assert done.away[-1, 0] == pytest.approx(0.4, abs=0.1)  # dry friction stops the arm short of it
    assert replay(read_log(done.log_path)).identical


def test_a_record_is_played_back_as_a_rig(folder, tmp_path):
    first = run_rig(RunRequest(rig=folder / "RIG.toml", law=folder / "design.json", seconds=0.5, tilt=0.05), tmp_path)
    first.log.record().to_csv(tmp_path / "run.csv")
    (tmp_path / "REPLAY.toml").write_text('kind = "replay"\nmake = "furuta"\nrecord = "run.csv"\n', encoding="utf-8")
    (tmp_path / "law.json").write_text(json.dumps(dict(first.log.header.law)), encoding="utf-8")
    done = run_rig(RunRequest(rig=tmp_path / "REPLAY.toml", law=tmp_path / "law.json", seconds=0.4), tmp_path)
    n = len(done.log)
    assert n > 400
    assert done.log.columns["u"].tobytes() == first.log.columns["u"][:n].tobytes()


def test_a_signal_swings_the_hanging_twin_and_free_does_not(folder, tmp_path):
    swung = run_rig(RunRequest(rig=folder / "RIG.toml", excite="sine 0.5 1.2", seconds=1.0), tmp_path)
    still = run_rig(RunRequest(rig=folder / "RIG.toml", excite="free", seconds=0.5, check=False), tmp_path)
    assert swung.sound
    assert np.ptp(swung.away[:, 1]) > 0.1
    t = np.arange(len(swung.log)) * RIG.period
    np.testing.assert_allclose(swung.log.columns["u"], 0.5 * np.sin(2 * math.pi * 1.2 * t), atol=RIG.converter)
    assert np.ptp(still.away[:, 1]) == 0


@pytest.mark.slow
def test_it_runs_in_a_process_of_its_own_just_the_same(folder, tmp_path):
    wish = {"rig": folder / "RIG.toml", "law": folder / "design.json", "seconds": 0.3, "tilt": 0.05, "check": False}
    inline = run_rig(RunRequest(**wish), tmp_path)
    seen = []
    own = run_rig(RunRequest(**wish, own_process=True), tmp_path, watch=lambda s: seen.append(s.phase) or "")
    assert own.end.ticks == inline.end.ticks
    assert own.log.columns["u"].tobytes() == inline.log.columns["u"].tobytes()
    assert own.log_path != inline.log_path


def run_within(travel, folder, at, *, tilt):
    """A run of the law from a tilt, where the arm may go so far."""
    text = f'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "5 V"\n[limits.psi]\ntravel = "{travel}"\n'
    (at / "RIG.toml").write_text(text, encoding="utf-8")
    order = RunRequest(rig=at / "RIG.toml", law=folder / "design.json", seconds=2.0, tilt=tilt, check=False)
    return run_rig(order, at)


def test_a_limit_ends_a_run_and_the_verdict_says_which(folder, tmp_path):
    done = run_within("3 deg", folder, tmp_path, tilt=0.08)
    assert done.end.faults & Fault.OVERTRAVEL
    assert "travel" in done.verdict
    assert not done.sound
    assert np.abs(done.log.columns["psi"]).max() <= math.radians(3)
    assert any(event.kind == "fault" for event in done.log.events)


def test_the_samples_of_a_braked_run_are_in_its_log_and_are_not_its_law_s(folder, tmp_path):
    """Let go where its law drives it out, it is braked to rest: output against speed, until the log ends."""
    done = run_within("0.8 rad", folder, tmp_path, tilt=0.12)
    assert done.end.faults & Fault.OVERTRAVEL
    log = done.log
    braked = np.flatnonzero(log.columns["mode"] == BRAKING)
    assert log.header.modes[BRAKING] == "BRAKING"
    assert braked.size > 5
    assert braked.tolist() == list(range(len(log) - braked.size, len(log)))
    assert set(np.diff(log.columns["tick"])) == {1}  # no tick is missing between law and brake
    speed = np.gradient(log.columns["psi"], log.columns["t"])
    assert abs(speed[-2]) < 0.3 * abs(speed[braked[0]])
    assert np.sign(log.columns["u"][braked[0]]) == -np.sign(speed[braked[0]])
    again = replay(read_log(done.log_path))
    assert again.identical
    assert again.rows.tolist() == list(range(braked[0]))


def test_a_run_that_ended_well_leaves_no_fault_in_the_rig(folder, tmp_path):
    stage = stage_of(folder / "RIG.toml", balance=False)
    law = excitation_law([0.0], 2, RIG.period)
    order = RunOrder(make=lambda: stage, law=as_values(law), seconds=0.1, log=tmp_path / "run.mcap", check=False)
    assert not carry_out(order, law=law).stopped
    assert stage.supervisor.rig.sample.faults == Fault(0)


def test_ctrl_c_stops_a_run_at_the_time_it_has_reached(folder, tmp_path):
    """Pressed when 0.5 s of the loop are over, which a twin shows at every 100th of its ticks of 0.884 ms.

    A view counts from where the loop began, events and log by the rig's own clock.
    """
    began: list[float] = []

    def watch(state):
        began.append(state.time)
        if state.time - began[0] >= 0.5:
            raise KeyboardInterrupt
        return ""

    wish = RunRequest(rig=folder / "RIG.toml", excite="free", seconds=2.0, check=False)
    done = run_rig(wish, tmp_path, watch=watch)
    t, kind, _ = done.end.events[-1]
    assert kind == "fault"
    assert t - done.log.columns["t"][0] == pytest.approx(began[-1], abs=1.5 * RIG.period)
    assert t == pytest.approx(done.log.columns["t"][-1], abs=1.5 * RIG.period)
    assert done.log.events[-1].t == t
    assert done.end.faults & Fault.STOP
    assert "0.5" in done.verdict or "0.6" in done.verdict


def test_a_run_in_which_nothing_moves_is_drawn_with_no_empty_axis(folder, tmp_path):
    """Twin and command rest: every column is a constant, drawn inside its axis, which says so."""
    wish = RunRequest(rig=folder / "RIG.toml", excite="free", seconds=0.2, check=False)
    drawing = draw_run(run_rig(wish, tmp_path).log)
    names = [axes.get_ylabel().split("\n")[0] for axes in drawing.axes]
    assert {"psi", "theta", "u"} <= set(names)
    for axes, name in zip(drawing.axes, names, strict=True):
        (line,) = axes.get_lines()
        low, high = axes.get_ylim()
        assert low < min(line.get_ydata()) == max(line.get_ydata()) < high, name
        assert any("constant" in text.get_text() for text in axes.texts)


def test_a_loop_waits_for_a_driven_body_that_is_off_its_start_window(folder, tmp_path):
    text = 'kind = "twin"\nmake = "furuta"\nseed = 3\n[limits]\ncommand = "5 V"\n[limits.psi]\nstart = "0.2 rad"\n'
    (tmp_path / "RIG.toml").write_text(text, encoding="utf-8")
    stage = stage_of(tmp_path / "RIG.toml")
    port, waited = stage.supervisor.rig.port, []

    def person(state):
        """Brings the pendulum up beside the window, then the arm into it."""
        if state.phase == "waiting":
            waited.append(state.time)
            if waited[-1] - waited[0] > 2.0:
                port.hold("inverted", [0.1, 0.0, 0.02, 0.0])

    stage = replace(stage, bring=lambda: port.hold("inverted", [0.5, 0.0, 0.02, 0.0]))
    law = feedback(
        filtered(LINEAR.to_sampled(RIG.period, RIG.delay / RIG.period), 0.5), place(LINEAR.A, LINEAR.B, POLES).K
    )
    order = RunOrder(make=lambda: stage, law=as_values(law), seconds=0.1, log=tmp_path / "run.mcap", check=False)
    done = carry_out(order, law=law, show=person)
    assert not done.stopped
    assert done.target[0] == pytest.approx(0.1, abs=1e-3)
    assert waited[-1] - waited[0] == pytest.approx(2.0 + QUIET, abs=0.01)


def test_a_signal_on_a_real_rig_rests_on_no_model_and_a_law_on_that_of_its_design(folder, tmp_path, monkeypatch):
    """As if the twin were a rig: its loop would run in another process, at the pace of the clock on the wall."""
    paces = []

    def beside(order, *, watch, paced):
        paces.append(paced)
        return RunEnd(stopped="It was not run.")

    monkeypatch.setattr(run_module, "run_in_process", beside)
    blind = RunRequest(rig=folder / "RIG.toml", excite="free", seconds=0.05, check=False)
    held = replace(blind, excite="", law=folder / "design.json")
    model = model_and_truth(read_rig_file(folder / "RIG.toml"))[0].basis
    assert run_rig(replace(blind, own_process=True), tmp_path).basis == model  # a twin is one
    assert paces == [False]
    real = replace(read_rig_file(folder / "RIG.toml"), performed="")
    monkeypatch.setattr(run_module, "read_rig_file", lambda path: real)
    assert run_rig(blind, tmp_path).basis == MEASURED
    assert run_rig(replace(held, accept="it is not run"), tmp_path).basis.level != MEASURED.level
    assert paces == [False, True, True]


def test_logs_of_one_folder_are_numbered_from_the_second_on(tmp_path):
    names = []
    for _ in range(4):
        path = fresh(tmp_path, "run", ".mcap")
        path.write_bytes(b"")
        names.append(path.name)
    assert names == ["run.mcap", "run-2.mcap", "run-3.mcap", "run-4.mcap"]
    assert fresh(tmp_path, "other", ".mcap").name == "other.mcap"


def test_a_rig_that_refuses_its_limits_has_no_log(folder, tmp_path):
    text = 'kind = "twin"\nmake = "furuta"\n[limits]\ncommand = "100 V"\n'
    (tmp_path / "RIG.toml").write_text(text, encoding="utf-8")
    done = run_rig(RunRequest(rig=tmp_path / "RIG.toml", excite="free", seconds=0.1), tmp_path)
    assert done.log is None
    assert not done.log_path.exists()
    assert (done.t.size, done.away.shape, done.unrest) == (0, (0, 2), ())
    assert not done.complete
    assert not done.sound
    assert done.verdict.startswith("Stopped before its loop began: ")
    assert "beyond the converter's" in done.verdict


def test_a_run_is_sound_with_a_whole_log_and_few_late_ticks(folder, tmp_path):
    wish = RunRequest(rig=folder / "RIG.toml", excite="free", seconds=0.1, check=False)
    done = run_rig(wish, tmp_path)
    assert done.verdict.startswith(f"The signal was put out for 0.1 s, {done.end.ticks} ticks, none late.")

    def ended(**how):
        return replace(done, end=replace(done.end, **how))

    assert done.sound
    assert ended(ticks=1000, late=math.floor(1000 * TOLERATED)).sound
    assert not ended(ticks=1000, late=math.floor(1000 * TOLERATED) + 1).sound
    assert "1000 ticks, 1 of them late." in ended(ticks=1000, late=1).verdict
    missed = ended(ticks=5216, late=7061, passed=2300)  # of 7516 deadlines
    assert "5216 ticks of 7516 due, 7061 of them late." in missed.verdict
    assert "5216 of 7516 due, 7061 late (94 %)" in dict(run_chapter(missed).parts[0].content[0].pairs).values()
    missing = ended(dropped=1)
    assert not missing.complete
    assert not missing.sound
    assert missing.verdict.endswith("The log is incomplete: rows are missing.")
    torn = replace(done, log=replace(done.log, complaint="its end is missing"))
    assert not torn.sound
    stopped = ended(stopped="The rig stopped.")
    assert stopped.complete
    assert not stopped.sound
    assert stopped.verdict == f"Stopped after {done.t[-1]:.3g} s: The rig stopped."


@pytest.mark.parametrize("at", ["hanging", "inverted"])
def test_the_rest_is_told_from_the_second_half_about_what_was_held_or_what_it_varied_about(folder, tmp_path, at):
    """Readings that are a constant in each half, and a sine about another one in the second."""
    wish = RunRequest(rig=folder / "RIG.toml", excite="free", seconds=0.2, check=False)
    done = run_rig(wish, tmp_path)
    n = 200
    swing = np.where(np.arange(n) < n // 2, 7.0, 0.3 + 0.04 * np.sqrt(2) * np.sin(2 * math.pi * np.arange(n) / 20))
    target = np.array([0.5, {"hanging": 0.0, "inverted": math.pi}[at]])
    columns = {
        "t": 3.0 + 0.01 * np.arange(n),
        "psi": swing + target[0],
        "theta": swing + target[1],
        "u_applied": np.zeros(n),
    }
    held = replace(
        done, log=replace(done.log, columns=columns), end=replace(done.end, target=target),
        request=replace(wish, law=folder / "design.json", excite=""),
    )  # fmt: skip
    assert held.t[[0, -1]] == pytest.approx([0.0, 1.99])
    assert held.unrest == pytest.approx([math.hypot(0.3, 0.04)] * 2)
    assert f"theta stayed within {math.degrees(math.hypot(0.3, 0.04)):.2g} degrees (rms, second half)" in held.verdict
    followed = replace(held, request=replace(held.request, reference="sine 0.1 2.5"))
    assert followed.unrest == pytest.approx([0.04] * 2)
    assert "theta varied by 2.3 degrees (rms, second half)" in followed.verdict


@pytest.mark.parametrize("turns", [-1, 0, 1])
def test_a_swing_up_is_told_by_the_nearest_upright_and_by_when_it_stands(folder, tmp_path, turns):
    """A pendulum that hangs for a second, and then stands a tenth of a radian off, on either side of where it hung."""
    wish = RunRequest(rig=folder / "RIG.toml", excite="free", seconds=0.2, check=False)
    done = run_rig(wish, tmp_path)
    t = 0.01 * np.arange(400)
    upright = (2 * turns + 1) * math.pi

    def ended(theta):
        columns = {"t": t, "psi": np.zeros(400), "theta": theta, "u_applied": np.zeros(400)}
        return replace(
            done, log=replace(done.log, columns=columns), end=replace(done.end, target=(0.0, math.pi)),
            request=replace(wish, law=folder / "design.json", excite="", from_rest=True),
        )  # fmt: skip

    stood = ended(np.where(t < 2.995, 0.0, upright + 0.1))
    assert (stood.stands, stood.unrest[-1], stood.sound) == (300, pytest.approx(0.1), True)
    assert "Stabilised" in stood.verdict
    assert "It stands since 3 s" in stood.verdict
    for theta, words in ((np.zeros(400), "180 degrees off"), (np.where(t < 3.9, upright, upright + 0.5), "29 degrees")):
        fallen = ended(theta)
        assert not fallen.sound
        assert fallen.verdict.startswith(f"Not swung up in 0.2 s, {done.end.ticks} ticks, none late; it is ")
        assert words in fallen.verdict


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"seconds": 0.0}, "more than 0 and at most 86400 s, got 0 s"),
        ({"seconds": -1.0}, "got -1 s"),
        ({"seconds": 86_401.0}, "got 86401 s"),
        ({"seconds": math.nan}, "got nan s"),
        ({"mode": "board"}, "--mode is host or mcu, got 'board'"),
        ({"reference": "step 0.1"}, "a reference needs a law"),
        ({"excite": ""}, "either a law"),
        ({"law": "design.json"}, "either a law"),
    ],
)
def test_a_run_that_cannot_be_asked_is_refused(folder, how, words):
    asked = {"rig": folder / "RIG.toml", "excite": "free"}
    assert RunRequest(**asked, seconds=86_400.0, mode="mcu").seconds == 86_400.0
    assert RunRequest(rig=folder / "RIG.toml", samples=(0.0, 1.0)).law is None
    with pytest.raises(BadInput, match=words):
        RunRequest(**(asked | how))


def test_a_law_that_is_none_is_told_before_what_the_rig_lacks(tmp_path):
    """A person who mistyped it would else measure a limit first, and learn of the law then."""
    study = (
        '[rig]\nplant = "furuta"\n[parameters]\nm_p = "0.1 kg"\nl_cg = "0.2 m"\nr = "0.2 m"\nJ_d = 5e-3\nJ_p = 1e-3\n'
    )
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\n', encoding="utf-8")
    (tmp_path / "law.json").write_text("{}", encoding="utf-8")
    request = RunRequest(rig=tmp_path / "RIG.toml", law=tmp_path / "law.json")
    with pytest.raises(BadInput, match="holds no law that can run"):
        run_rig(request, tmp_path)
    with pytest.raises(BadInput, match="a run on a rig needs numbers"):
        run_rig(replace(request, law=None, excite="free"), tmp_path)


def test_a_twin_s_hand_brings_it_where_it_is_held_and_lets_go_with_the_tilt_asked(folder):
    for how, away in (({}, 0.0), ({"tilt": 0.05}, 0.05), ({"tilt": -0.05}, -0.05)):
        stage = stage_of(folder / "RIG.toml", **how)
        stage.supervisor.prepare()
        stage.bring()
        psi, theta = stage.supervisor.rig.port.read()
        per = RIG.per_unit[1]
        assert (psi, theta) == (0, round((math.pi + away) * per))
    for how in ({"balance": False}, {"from_rest": True, "tilt": 0.05}):
        stage = stage_of(folder / "RIG.toml", **how)
        stage.supervisor.prepare()
        stage.bring()  # what holds itself is not brought
        assert stage.supervisor.rig.port.read() == (0, 0)


def test_what_contradicts_itself_is_refused(folder, tmp_path):
    with pytest.raises(BadInput, match="either a law"):
        RunRequest(rig=folder / "RIG.toml")
    (tmp_path / "law.json").write_text("{}", encoding="utf-8")
    with pytest.raises(BadInput, match="design again"):
        run_rig(RunRequest(rig=folder / "RIG.toml", law=tmp_path / "law.json"), tmp_path)
    with pytest.raises(BadInput, match="sweep SIZE FROM TO"):
        run_rig(RunRequest(rig=folder / "RIG.toml", excite="sweep 1"), tmp_path)


def test_a_start_beyond_the_window_of_a_run_is_refused_by_its_size(folder, tmp_path):
    """A run that holds a pendulum upright begins within 10 degrees of it: a person holds no more still."""
    late = RunRequest(rig=folder / "RIG.toml", law=folder / "design.json", seconds=0.5, tilt=math.radians(12))
    with pytest.raises(BadInput, match=r"--start is 12 deg from 'inverted', and a run starts within 10 deg"):
        run_rig(late, tmp_path)
    assert run_rig(replace(late, tilt=math.radians(9.9)), tmp_path).end.ticks > 0


@pytest.mark.parametrize("name", ["bench 3", ""])
def test_a_rig_is_called_by_its_file_where_a_make_alone_describes_it_too(tmp_path, name):
    (tmp_path / "RIG.toml").write_text(
        'kind = "twin"\nmake = "furuta"\n' + (f'name = "{name}"\n' if name else ""), encoding="utf-8"
    )
    model, truth = model_and_truth(read_rig_file(tmp_path / "RIG.toml"))
    assert model.name == (name or make_rig("furuta").name)
    assert truth.name == make_rig("furuta").name


@pytest.mark.slow
@pytest.mark.parametrize(("start", "degrees"), [("", 3.0), ("0 deg", 0.0), ("5 deg", 5.0)])
def test_a_twin_begins_off_upright_unless_somebody_says_otherwise(folder, tmp_path, start, degrees):
    answer = up.run(folder / "RIG.toml", law=folder / "design.json", duration=0.1, start=start, out=tmp_path)
    log, target = answer.value.log, answer.value.end.target
    assert log.columns["theta"][0] - target[1] == pytest.approx(math.radians(degrees), abs=2 * math.pi / 2000)


def test_a_run_is_played_as_its_encoders_saw_it_and_says_that_no_rig_moved(tmp_path):
    """Told by the run itself, and by its log when that is read back."""
    rig = tmp_path / "RIG.toml"
    rig.write_text('kind = "twin"\nmake = "furuta"\n', encoding="utf-8")
    run = up.run(rig, excite="step 0.5", duration=0.1, check=False, watch=False, out=tmp_path)
    played = run.play(out=tmp_path / "run_played.html")
    assert (played.chapter.first_line, played.files) == (SIMULATED, (tmp_path / "run_played.html",))
    assert played.value["psi"] == pytest.approx(run.value.log.columns["psi"])
    again = up.read(run.value.log_path).play(run.value.model)
    assert again.page == played.page
    with pytest.raises(BadInput, match="nothing to play, since no loop began"):
        RunAnswer(replace(run.value, log=None), run.chapter).play()


@pytest.mark.slow
def test_a_rig_of_one_body_is_told_by_its_one_coordinate(tmp_path):
    """The last coordinate is the first here: what a verdict names is that of the body that is held."""
    (tmp_path / "study.toml").write_text(
        '[rig]\nplant = "torsional-1"\nservo_period = "2 ms"\n[parameters]\nJ_1 = "0.01 kg m^2"\nk_1 = "1 N m/rad"\n'
        'c_1 = 0.01\n[actuator]\ngain = "0.1 N m/V"\nlimit = "5 V"\n[sensors.theta_1]\ncounts_per_rev = 16000\n',
        encoding="utf-8",
    )
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nstudy = "study.toml"\nat = "rest"\n', encoding="utf-8")
    up.design(tmp_path / "study.toml", at="rest", poles="-8+-6j", out=tmp_path)
    done = up.run(tmp_path / "RIG.toml", law=tmp_path / "design.json", duration=0.3, out=tmp_path / "run")
    assert "; theta_1 stayed within" in done.verdict
