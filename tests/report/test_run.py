"""Does the chapter of a run's log say what ran, what happened and what is missing, and of a replay what differs?"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from upright.laws import Law, as_values
from upright.logs import LogHeader, RunLog
from upright.logs.replay import Difference, Replay, replay
from upright.logs.salvage import Salvaged
from upright.logs.whole import RunEvent
from upright.report.run import chapter, draw_replay, law_in_words, log_numbers, recovered_chapter, replayed

LAW = Law(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((1, 0)), [[-2.0, 0.5]], references=np.zeros((1, 1)), period=0.25)
HEADER = LogHeader(
    rig="  kind = 'twin'\n", law=as_values(LAW),
    coordinates=(("theta", "rad"),), references=(("r", "rad"),), command_unit="V", period=0.25, driven=(2,),
    modes={0: "IDLE", 2: "HOST"}, faults={1: "WATCHDOG", 4: "OVERSPEED"}, versions={"upright": "0.1", "git": ""},
)  # fmt: skip
THETA, R = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0]), np.array([0.0, 0.0, 2.0, 2.0, 0.0, 0.0, 4.0])


def log(header=HEADER, *, complaint="", events=(), rows=7, u=-2.0 * THETA + 0.5 * R):
    columns = {
        "t": np.array([10.0, 10.25, 10.5, 10.75, 11.25, 11.5, 11.75]), "tick": np.arange(7),
        "theta_counts": np.arange(7), "theta": THETA, "r": R, "u": u, "u_applied": u,
        "mode": np.array([0, 2, 2, 0, 2, 2, 7]), "faults": np.array([0, 0, 0, 5, 0, 0, 0]),
    }  # fmt: skip
    return RunLog(
        file="runs/my run.mcap", header=header, columns={n: c[:rows] for n, c in columns.items()}, events=tuple(events),
        complaint=complaint, size=900, readable=900,
    )  # fmt: skip


def part(page, title):
    return next((p.content[0] for p in page.parts if p.title == title), None)


def test_the_run_is_told_with_its_times_in_milliseconds():
    page = chapter(log())
    assert part(page, "Run").pairs == (
        ("rows", "7 over 1.75 s, every 250 ms"), ("longest step", "500 ms at 10.75 s"), ("dropped", "none"),
        ("law", "linear, 0 memories"), ("followed", "r [rad]"), ("written by", "upright 0.1"),
    )  # fmt: skip
    assert (page.title, page.verdict, page.sound) == ("my run.mcap", "The log is whole: 7 rows.", True)
    assert [s.command for s in page.steps] == ['upright log replay "runs/my run.mcap"']
    assert part(page, "Rig").lines == "kind = 'twin'"
    assert part(page, "Events") is None
    assert page.parts[-1].content[0].description.startswith("7 rows of t, tick")


def test_modes_and_faults_are_told_from_their_first_row_to_their_last():
    table = part(chapter(log()), "Modes and faults")
    assert table.headings == ("from [s]", "to [s]", "rows", "mode", "faults")
    assert table.rows == (
        ("10", "10", "1", "IDLE", ""), ("10.25", "10.5", "2", "HOST", ""),
        ("10.75", "10.75", "1", "IDLE", "WATCHDOG, OVERSPEED"), ("11.25", "11.5", "2", "HOST", ""),
        ("11.75", "11.75", "1", "mode 7", ""),
    )  # fmt: skip
    assert table.numbers == (0, 1, 2)


def test_events_stand_with_the_rows_before_them_forty_at_most():
    event = RunEvent(t=10.5, kind="stop", text="asked", row=3)
    table = part(chapter(log(events=[event] * 40)), "Events")
    assert (table.caption, len(table.rows), table.rows[0]) == ("Events", 40, ("10.5", "3", "stop", "asked"))
    many = part(chapter(log(events=[event] * 41)), "Events")
    assert (many.caption, len(many.rows)) == ("Events, the first 40 of 41", 40)
    assert many.headings[many.numbers[0]] == "t [s]"
    assert many.headings[many.numbers[1]] == "after row"


def test_what_is_missing_takes_the_log_s_soundness():
    dropped = chapter(log(events=[RunEvent(t=10.5, kind="dropped", text="x", row=3, dropped=12)]))
    assert dict(part(dropped, "Run").pairs)["dropped"] == "12 rows of the loop"
    assert not dropped.sound
    torn = chapter(log(complaint="It ends at byte 5."))
    assert (torn.verdict, torn.sound) == ("7 whole rows. It ends at byte 5.", False)
    assert [s.command for s in torn.steps][0] == 'upright log recover "runs/my run.mcap"'
    assert len(torn.steps) == 2
    assert not chapter(log(replace(HEADER, law={}))).steps


def test_a_log_of_one_row_or_none_is_told_without_steps_and_pictures():
    one = chapter(log(rows=1))
    assert dict(part(one, "Run").pairs)["rows"] == "1 over 0 s, every 250 ms"
    assert "longest step" not in dict(part(one, "Run").pairs)
    assert part(one, "Columns") is None
    none = chapter(log(rows=0))
    assert part(none, "Modes and faults") is None
    assert none.numbers["faults"] == []
    two = chapter(log(rows=2))
    assert part(two, "Columns") is not None
    assert dict(part(two, "Run").pairs)["longest step"] == "250 ms at 10 s"


def test_numbers_of_a_run_are_those_of_its_columns():
    event = RunEvent(t=10.5, kind="stop", text="asked", row=3)
    told = log_numbers(log(events=[event]))
    assert (told["rows"], told["seconds"], told["period"], told["bytes"]) == (7, 1.75, 0.25, 900)
    assert told["faults"] == ["WATCHDOG", "OVERSPEED"]
    assert told["columns"]["theta_counts"] == "counts"
    assert told["columns"]["u_applied"] == "V"
    assert told["events"] == [{"t": 10.5, "kind": "stop", "text": "asked", "row": 3, "dropped": 0}]
    assert log_numbers(log(rows=1))["seconds"] == 0.0
    assert log_numbers(log(rows=2))["seconds"] == 0.25


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({}, "none was logged"),
        ({"kind": "linear", "A": [[1.0], [2.0]], "limit": 2.5}, "linear, 2 memories, limited to 2.5 V"),
        ({"kind": "linear", "A": [], "limit": None}, "linear, 0 memories"),
        ({"kind": "rule", "text": "a\nb\nc", "initial": [0.0, 0.0]}, "a rule of 3 lines, 2 memories"),
        ({"kind": "rule"}, "a rule of 0 lines, 0 memories"),
        ({"K": 1, "note": 2}, "K, note"),
    ],
)
def test_a_law_is_told_in_a_line(law, said):
    assert law_in_words(replace(HEADER, law=law)) == said


def test_what_was_kept_of_a_torn_log_is_told_with_what_was_lost():
    event = RunEvent(t=10.5, kind="stop", text="asked", row=3)
    torn = Salvaged(log=log(complaint="It ends.", events=[event]), file=Path("new.mcap"), lost_bytes=64, lost_rows=2)
    page = recovered_chapter(torn)
    assert page.verdict == "7 rows and 1 events kept; 64 bytes behind them (about 2 rows) could not be read."
    assert (page.title, page.steps[0].command) == ("my run.mcap recovered", "upright log show new.mcap")
    assert page.parts[0].content[0].sentences == ("It ends.",)
    whole = recovered_chapter(replace(torn, log=log(), lost_bytes=0, lost_rows=0))
    assert whole.verdict == "7 rows and 0 events kept; nothing that was written is missing."
    assert whole.parts[0].content[0].sentences == ("The log was whole.",)


def test_a_law_is_asked_again_wherever_it_commanded():
    """u = -2 theta + r/2 in modes 2, rows 1, 2, 4 and 5."""
    found = replay(log())
    assert (found.rows.tolist(), found.starts, found.differing, found.passed_over) == ([1, 2, 4, 5], 2, 0, 0)
    assert found.commands.tolist() == [-2.0, -3.0, -16.0, -32.0]
    assert (found.identical, found.first, found.largest) == (True, None, 0.0)
    everywhere = replay(log(replace(HEADER, driven=())))
    assert (everywhere.rows.tolist(), everywhere.starts) == ([0, 1, 2, 3, 4, 5, 6], 1)


@pytest.mark.parametrize(
    ("row", "rows", "passed_over"),
    [(1, [4, 5], 2), (2, [1, 4, 5], 1), (3, [1, 2, 4, 5], 0), (4, [1, 2], 2), (5, [1, 2, 4], 1), (6, [1, 2, 4, 5], 0)],
)
def test_rows_behind_dropped_ones_are_passed_over_until_the_law_begins_anew(row, rows, passed_over):
    found = replay(log(events=[RunEvent(t=0.0, kind="dropped", text="", row=row, dropped=1)]))
    assert (found.rows.tolist(), found.passed_over) == (rows, passed_over)
    told = replay(log(events=[RunEvent(t=0.0, kind="fault", text="", row=row)]))
    assert told.passed_over == 0


def test_the_first_command_that_differs_is_told_and_the_largest_distance():
    u = -2.0 * THETA + 0.5 * R
    u[2], u[5], u[3] = u[2] + 0.5, u[5] - 0.75, 99.0  # the last while the law did not command
    found = replay(log(u=u))
    assert (found.differing, found.largest) == (2, 0.75)
    assert found.first == Difference(row=3, t=10.5, logged=-2.5, replayed=-3.0)
    page = replayed(log(u=u), found)
    assert page.verdict == ("2 of 4 commands differ, the first in row 3 at 10.5 s: logged -2.5 V, replayed -3.0 V.")
    assert page.parts[0].content[0].sentences == (
        "4 rows compared; the law began 2 times.", "The largest difference is 0.75 V.",
    )  # fmt: skip
    assert not page.sound
    assert page.numbers["first"] == {"row": 3, "t": 10.5, "logged": -2.5, "replayed": -3.0}
    assert (page.numbers["compared"], page.numbers["differing"], page.numbers["starts"]) == (4, 2, 2)


def test_a_law_that_gives_its_commands_again_is_sound():
    found = replace(replay(log()), starts=1, passed_over=3)
    page = replayed(log(), found)
    assert page.verdict == "All 4 commands are bit-identical to the logged ones."
    assert page.sound
    assert page.parts[0].content[0].sentences[0] == "4 rows compared; the law began 1 time."
    assert page.parts[0].content[0].sentences[1].startswith("3 rows were passed over")
    assert page.numbers["first"] is None


def test_commands_are_drawn_logged_and_replayed_above_their_difference():
    rows, given = np.array([1, 2, 4]), np.array([-2.0, -2.5, -17.0])
    found = Replay(rows=rows, commands=given, starts=1, differing=2, largest=1.0, first=None, passed_over=0)
    drawing = draw_replay(log(), found)
    above, below = drawing.axes
    lines = {line.get_label(): np.array(line.get_data()).tolist() for line in above.lines}
    assert lines == {
        "logged": [[10.25, 10.5, 11.25], [-2, -3, -16]],
        "replayed": [[10.25, 10.5, 11.25], [-2, -2.5, -17]],
    }
    assert not above.yaxis.label.get_parse_math()
    assert np.array(below.lines[0].get_data()).tolist() == [[10.25, 10.5, 11.25], [0, 0.5, -1]]
    assert (above.get_ylabel(), below.get_ylabel(), below.get_xlabel()) == ("u [V]", "difference", "time [s]")


@pytest.mark.parametrize("counts", [False, True])
def test_a_log_is_a_record_with_the_applied_command_as_its_input(counts):
    record = log(events=[RunEvent(t=1.0, kind="dropped", text="", row=1, dropped=3)], complaint="Torn.").record(
        counts=counts
    )
    assert (record.inputs, record.outputs) == (("u_applied",), ("theta",))
    assert ("theta_counts" in record.signals) == counts
    assert "t" not in record.signals
    assert record.units["theta"] == "rad"
    dropped = "3 rows of the loop were dropped while it ran."
    assert record.provenance.notes == ("Torn.", "This log was simulated; no rig was touched.", dropped)
    real = log(header=replace(HEADER, rig="kind = 'serial'\n")).record()
    assert real.provenance.notes == ()
    np.testing.assert_array_equal(record["theta"], THETA)


def test_a_time_that_steps_back_is_told_by_its_row():
    back = log()
    back.columns["t"][4] = 10.75
    with pytest.raises(ValueError, match=r"row 5: time must increase from row to row, got 10.75 s after 10.75 s"):
        back.record()
    with pytest.raises(ValueError, match="holds 1 whole rows, and a record needs 2"):
        log(rows=1).record()
    assert len(log(rows=2).record()) == 2
