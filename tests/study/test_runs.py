"""Is what a run says of itself taken at its limits, and refused by line beyond them? Logs are at hand as records."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tests.study.crane_log import RIG, RUN, SENSORS, THETA, T, X
from upright.errors import BadInput
from upright.identification import Run
from upright.records import Record
from upright.study.load import Study, load_study

RECORD = Record(t=T, signals={"theta": THETA, "x": X, "v": 2 * T})


def load(text: str, record: Record = RECORD) -> Study:
    return load_study(Path("study.toml"), text=text, records={"log.csv": record})


def run_of(more: str = "", before: str = "", record: Record = RECORD) -> Run:
    (run,) = load(RIG + SENSORS + before + RUN + more, record).runs
    return run


def refusal(more: str, before: str = "") -> str:
    with pytest.raises(BadInput) as caught:
        run_of(more, before)
    return str(caught.value)


@pytest.mark.parametrize(
    ("window", "first", "last"),
    [
        ("[1.0, 2.0]", 1.0, 2.0),
        ('["start", 2.0]', 0.0, 2.0),
        ('[1.0, "end"]', 1.0, 9.995),
        ('["500 ms", "0.02 min"]', 0.5, 1.2),
        ("[-0.0049, 9.9999]", 0.0, 9.995),  # within a sample of the record
    ],
)
def test_a_window_is_two_times_inside_the_record(window, first, last):
    run = run_of(f"window = {window}\n")
    assert (run.t[0], run.t[-1]) == pytest.approx((first, last))
    assert run.record == pytest.approx((0.0, 9.995))


@pytest.mark.parametrize(
    ("window", "sentence"),
    [
        ("[1.0]", "window must be two times in s"),
        ("3", "window must be two times in s"),
        ("[2.0, 2.0]", "the window must start before it ends, got 2 to 2 s"),
        ("[3.0, 2.0]", "the window must start before it ends, got 3 to 2 s"),
        ("[-0.0051, 5]", 'inside the record, from 0 to 9.995 s; for the rest of it write window = [0, "end"]'),
        ("[2, 10.001]", 'for the rest of it write window = [2, "end"]'),
        ("[20, 30]", 'write window = [0, "end"]'),
    ],
)
def test_a_window_outside_the_record_is_refused_with_what_to_write(window, sentence):
    assert sentence in refusal(f"window = {window}\n")


def test_a_record_of_an_epoch_counts_from_its_start():
    late = RECORD.replace(t=T + 2e6)
    assert run_of("window = [1.0, 2.0]\n", record=late).t[0] == pytest.approx(1.0)
    early = RECORD.replace(t=T + 0.9e6)
    assert run_of("window = [900001, 900002]\n", record=early).t[0] == pytest.approx(900001)


@pytest.mark.parametrize(
    ("text", "horizon", "restart"),
    [
        ("", None, "smooth"),
        ('horizon = "free"\n', None, "smooth"),
        ('horizon = "500 ms"\n', 0.5, "smooth"),
        ("horizon = 0.0076\n", 0.0076, "smooth"),
        ("horizon = 9.99\n", 9.99, "smooth"),
        ("horizon = 10\n", None, "smooth"),  # longer than the run
        ("horizon = [0.5]\n", (0.5,), "kalman"),
        ('horizon = ["50 ms", 0.005]\n', (0.05, 0.005), "kalman"),
        ('horizon = [0.5]\nrestart = "smooth"\n', (0.5,), "smooth"),
        ('horizon = 0.005\nrestart = "kalman"\n', 0.005, "kalman"),
    ],
)
def test_a_horizon_is_free_one_or_several(text, horizon, restart):
    run = run_of(text)
    assert (run.horizon, run.restart) == (horizon, restart)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("horizon = 0.0074\n", "a horizon of 0.0074 s is less than two samples of 0.005 s"),
        ('horizon = [0.005]\nrestart = "smooth"\n', "less than two samples"),
        ("horizon = [0.004]\n", "less than two samples"),
        ("horizon = []\n", "horizon must be a time such as"),
        (f"horizon = {[0.1] * 51}\n", "horizon lists 51 times, and 50 are the most"),
        ("score_from = -1\n", "score_from must lie inside the run, 0 to 9.995 s after its start, got -1 s"),
        ("score_from = 9.9951\n", "score_from must lie inside the run"),
        ('locked = ["x", "theta"]\n', "every coordinate with a sensor is locked or held"),
        ('held = ["x"]\nlocked = ["x"]\n', "x is locked in this run, so it is neither held nor measured"),
        ('measured = ["x"]\nlocked = ["x"]\n', "x is locked in this run"),
        ('locked = { y = 3 }\n', "'y'"),
        ("shared = { hue = 'x' }\n", "shared has no 'hue'"),
        ("spread = { offset.x = 0.1 }\n", "spread has no 'offset.x'"),
        ("initial = { y = 0 }\n", "'y'"),
        ("period = 0\n", "period must be above zero"),
        ("known = { y = 3 }\n", "'y'"),
        ('unknown = ["offset.y"]\n', "unknown lists"),
        (RUN, "the label 'log' is taken by the run on line 13"),
    ],
)  # fmt: skip
def test_what_a_run_cannot_say_is_refused_by_line(text, sentence):
    said = refusal(text)
    assert sentence in said
    assert said.startswith("study.toml, line 1")


def test_fifty_horizons_and_a_start_at_zero_are_allowed():
    assert len(run_of(f"horizon = {[0.1] * 50}\n").horizon) == 50
    assert run_of("score_from = 0\n").score_from == 0
    assert run_of("score_from = 9.99\n").score_from == 9.99


def test_a_run_takes_its_period_from_itself_or_the_rig():
    assert run_of("period = 0.02\n").period == pytest.approx(0.02)
    rig = RIG.replace('plant = "cart-pendulum"', 'plant = "cart-pendulum"\nperiod = "10 ms"')
    for more, period in (("", 0.01), ("period = 0.02\n", 0.02)):
        (run,) = load(rig + SENSORS + RUN + more).runs
        assert run.period == pytest.approx(period)


def test_measured_locked_and_held_coordinates_go_their_ways():
    run = run_of('measured = ["theta"]\n')
    assert run.measured == ("theta",)
    assert run.held == {}
    both = run_of()
    assert both.measured == ("x", "theta")  # in the paper's order
    np.testing.assert_allclose(both.y, np.column_stack([X, THETA]))
    assert run_of('held = ["theta"]\nmeasured = ["x", "theta"]\n').measured == ("x",)
    assert run_of('locked = "x"\n').held == {"x": 0.0}
    assert run_of('locked = { theta = "90 deg" }\n').held == {"theta": pytest.approx(math.pi / 2)}


def test_a_coordinate_that_is_asked_for_needs_a_sensor():
    sensors = "[sensors.theta]\n"
    for key in ("measured", "held"):
        with pytest.raises(BadInput, match=r'x has no sensor; add \[sensors.x\] with column = "..."'):
            load(RIG + sensors + RUN + f'{key} = ["x"]\n')
    with pytest.raises(BadInput, match=r"nothing is measured: the study needs a table such as \[sensors.x\]"):
        load(RIG + RUN)


def test_a_command_goes_to_the_input_and_its_log_to_the_notes():
    run = run_of("window = [1, 2]\nperiod = 0.01\n", '[drive]\ncolumn = "v"\nscale = 3\n')
    assert run.u.shape == (101, 1)
    # held commands: the mean of two samples, 5 ms apart
    np.testing.assert_allclose(run.u[:100, 0], 6 * (run.t[:100] + 0.0025), atol=1e-9)
    assert "1 to 2 s; resampled from 201 to 101 samples of 10 ms" in run.source
    named = run_of('label = "one"\nrepeats = "step"\nrole = "predict"\nunknown = ["initial", "offset.x"]\n')
    assert (named.label, named.repeats, named.role, named.unknown) == (
        "one",
        "step",
        "predict",
        ("initial", "offset.x"),
    )
    assert run_of().label == "log"
    assert run_of().unknown == ("initial",)


TWO = RIG + SENSORS + RUN + 'label = "a"\n' + RUN + 'label = "b"\n'


def test_some_runs_are_held_out_and_never_all():
    study = load('title = "My rig"\nsource = "here"\n' + TWO)
    assert [r.role for r in study.hold_out("b").runs] == ["fit", "predict"]
    assert study.hold_out().runs == study.runs
    with pytest.raises(BadInput, match="no run is called 'c'"):
        study.hold_out("c")
    with pytest.raises(BadInput, match="holding out a, b leaves no run to fit; hold out fewer"):
        study.hold_out("a", "b")
    assert (study.title, study.source, study.plant) == ("My rig", "here", "cart-pendulum")
    assert study.provenance["data"] == "here"
    assert load(TWO).provenance["data"] == "not stated"
    assert load(TWO).title == ""


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (RIG + SENSORS, "a study needs at least one run"),
        ("runs = []\n" + RIG + SENSORS, "a study needs at least one run"),
        ("ladder = 3\n" + TWO, "a ladder is a list of rungs"),
        (TWO + '[[ladder]]\nname = "x"\nadds = ["zeta"]\n', "adds lists"),
        (TWO + '[[ladder]]\nadds = ["b_2"]\n', "needs name as text"),
        ("colour = 3\n" + TWO, "there is no key 'colour'"),
    ],
)
def test_a_study_without_runs_or_with_other_keys_is_refused(text, sentence):
    with pytest.raises(BadInput) as caught:
        load(text)
    assert sentence in str(caught.value)


def test_rungs_are_read_term_by_term():
    rung = '[[ladder]]\nname = "dry"\nadds = ["b_2c", "actuator.delay"]\ndrops = "b_2"\nunknown = ["offset.x"]\n'
    (read,) = load(TWO + rung).ladder
    assert (read.name, read.adds, read.drops, read.unknown) == (
        "dry",
        ("b_2c", "actuator.delay"),
        ("b_2",),
        ("offset.x",),
    )
    assert load(TWO).ladder == ()
