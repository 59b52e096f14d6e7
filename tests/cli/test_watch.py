"""Does a person at a terminal see how a run goes, and what a command answers, and no more than that?"""

from __future__ import annotations

import io
import json
import math
import sys
from dataclasses import replace

import pytest

from upright.cli import terminal
from upright.cli.sentences import sentences
from upright.cli.watch import effort_bar, lines, view
from upright.errors import RigStopped, nearest
from upright.progress import part
from upright.realtime.session import RunScene, RunState
from upright.report.page import Chapter
from upright.rigs.board import fault_text
from upright.rigs.protocol import Fault, Mode
from upright.verbs.answer import Answer

FULL = "█" * 20


@pytest.mark.parametrize(
    ("value", "largest", "bar"),
    [
        (0.0, 1.0, f"[{' ' * 20}|{' ' * 20}]"), (5.0, 10.0, f"[{' ' * 20}|{'█' * 10}{' ' * 10}]"),
        (-2.5, 10.0, f"[{' ' * 15}{'█' * 5}|{' ' * 20}]"), (10.0, 10.0, f"[{' ' * 20}|{FULL}]"),
        (-30.0, 10.0, f"[{FULL}|{' ' * 20}]"), (float("inf"), 10.0, f"[{' ' * 20}|{FULL}]"),
    ],
)  # fmt: skip
def test_a_command_is_a_bar_from_the_middle_to_its_own_side(value, largest, bar):
    assert effort_bar(value, largest) == bar


def test_a_run_shows_its_time_deviations_command_and_what_is_wrong():
    state = RunState(phase="running", time=1.5, tick=150, mode=Mode.HOST, applied=-2.5, readings=(0.25, -1.0))
    text = lines(state, 10.0)
    assert text.plain.splitlines() == [
        "    1.50 s  HOST  tick 150  0 late", "away   +0.2500    -1.0000", f"command   -2.500 {effort_bar(-2.5, 10.0)}",
        "space, q or Esc: stop",
    ]  # fmt: skip
    fault = next(iter(Fault))
    wrong = lines(replace(state, late=3, faults=fault), 10.0)
    assert "3 late" in wrong.plain
    assert fault_text(fault) in wrong.plain
    red = {wrong.plain[s.start : s.end].strip() for s in wrong.spans if "red" in str(s.style)}
    assert red == {"3 late", fault_text(fault)}
    assert not any("red" in str(s.style) for s in text.spans)
    assert lines(RunState(phase="waiting for you"), 1.0).plain == "Waiting for you\nspace, q or Esc: stop"


def test_a_view_names_readings_units_limit_and_the_time_that_is_left():
    scene = RunScene(
        readings=(("x", "m"), ("theta", "rad")), command_unit="V", limit=10.0, seconds=6.0
    )  # fmt: skip
    state = RunState(
        phase="running", time=1.5, mode=Mode.HOST, applied=-2.5, readings=(0.25, -math.pi / 6), scene=scene
    )
    first, away, command, _ = lines(state, 3.0).plain.splitlines()
    assert first.startswith("    1.50 s, 4.5 s left  HOST")
    assert away == "away x   +0.2500 m  theta   -30.00 deg"
    # a quarter of the limit fills a quarter of the bar, whatever the largest command so far
    assert command == f"command   -2.500 of 10 V {effort_bar(-2.5, 10.0)}"
    assert "0.0 s left" in lines(replace(state, time=6.5), 3.0).plain


def test_parts_of_a_work_tell_their_share_of_the_whole():
    told = []
    tell = part(lambda step, share: told.append((step, share)), 0.2, 0.6, "fitting")
    tell("one", 0.0)
    tell("two", 0.5)
    tell("three", 1.0)
    assert told == [("fitting: one", 0.2), ("fitting: two", pytest.approx(0.4)), ("fitting: three", pytest.approx(0.6))]


def test_the_nearest_name_is_offered_and_forty_are_listed_where_none_is_near():
    assert nearest("thetta", ["psi", "theta"]) == "did you mean 'theta'?"
    assert nearest("x", []) == "nothing is defined here"
    many = [f"b{i:02d}" for i in range(41)]
    assert nearest("zzzzzz", many[:40]) == f"valid names: {', '.join(many[:40])}"
    assert nearest("zzzzzz", many) == f"valid names: {', '.join(many[:40])} and 1 more"
    assert str(RigStopped("twin stopped. See why.")) == "Twin stopped. See why."


def written(answer, **how):
    stream = io.StringIO()
    before, sys.stdout = sys.stdout, stream
    try:
        terminal.tell(answer, **how)
    finally:
        sys.stdout = before
    return stream.getvalue()


def test_an_answer_is_told_as_a_chapter_or_as_numbers_and_many_piece_by_piece():
    def answer(n):
        return Answer(n, Chapter(title="T", verdict=f"It is {n}.", numbers={"n": n, "none": float("nan")}))

    assert "Verdict: It is 3." in written(answer(3))
    assert json.loads(written(answer(3), as_json=True)) == {"n": 3, "none": None}
    assert written(iter([answer(1), answer(2)])).count("Verdict: It is") == 2
    assert [piece["n"] for piece in json.loads(written(iter([answer(1), answer(2)]), as_json=True))] == [1, 2]
    assert written("a word") == "a word\n"


def test_steps_are_lines_of_their_own_without_their_counts(capsys):
    with terminal.step_lines() as progress:
        for step in ("run 1: fit: 10 evaluations", "run 1: fit: 20 evaluations", "run 1: check", "run 1: check: 3"):
            progress(step, 0.5)
    assert capsys.readouterr().err.splitlines() == ["run 1: fit: 10 evaluations", "run 1: check"]
    with terminal.step_lines(quiet=True) as progress:
        progress("a", 0.0)
    assert capsys.readouterr().err == ""


def test_nobody_sees_a_bar_or_a_view_where_nobody_watches(capsys):
    with terminal.progress_bar() as progress, view(quiet=False) as observe:
        progress("a", 0.5)
        assert observe(None) == ""
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (OSError(5, "Input/output error", "a.csv"), 2, "'a.csv' could not be used: Input/output error; check"),
        (OSError("odd"), 2, "a file could not be used: odd; check"),
        (NotADirectoryError(20, "x", "b"), 2, "a folder is needed"),
        (FileExistsError(17, "x", "b"), 2, "a folder is needed where 'b' is a file"),
        (MemoryError(), 2, "not enough memory"),
        (KeyboardInterrupt(), 130, "stopped by Ctrl-C"),
        (ZeroDivisionError(), 1, "a bug in upright (ZeroDivisionError);"),
        (PermissionError(13, "x", "b"), 2, "may not be read or written by you"),
        (IsADirectoryError(21, "x", "b"), 2, "is a folder"),
    ],
)  # fmt: skip
def test_every_error_is_one_sentence_with_its_exit_code(error, code, said, capsys):
    import typer

    with pytest.raises(typer.Exit) as ended, sentences():
        raise error
    assert ended.value.exit_code == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("upright: ")
    assert said in line
