"""Does a session keep what is finished, go on where it stopped, and survive an experiment that fails?"""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.experiments.rigs import declared, made
from upright.errors import NotIdentifiable
from upright.experiments import laboratory
from upright.experiments.stand.experiment import Experiment
from upright.report.page import Chapter, KeyNumber, Part
from upright.workers import Workers


@pytest.fixture
def bench(monkeypatch):
    """Three small experiments; the second builds on the first. What was run, and what may go wrong, is noted."""
    ran, trouble = [], {}

    def small(key, needs=()):
        def tell(task):
            ran.append(key)
            if key in trouble:
                raise trouble[key]
            told = f"{key} on {task.stand.rig.name}, seed {task.seed}, after {', '.join(task.earlier) or 'nothing'}"
            finding = KeyNumber(what="x", value=str(len(ran)))
            return Chapter(key=key, title=f"Small {key}", question="?", verdict=told, detail="", sound=True,
                           parts=(Part(title="Data"),), findings=(finding,),
                           numbers={"run": len(ran), "bad": float("nan")}), True  # fmt: skip

        makes = ("furuta", "linear") if key != "3" else ("rectilinear",)
        return Experiment(
            name=key, part_of=key[0], title=f"Small {key}", makes=makes, on=lambda _: False, needs=needs, live_needs=(),
            seconds=1, tell=tell,
        )  # fmt: skip

    all_of_them = (small("1"), small("2", ("1",)), small("3", ("1",)))
    monkeypatch.setattr(laboratory, "EXPERIMENTS", declared(*all_of_them))
    return ran, trouble


def verdicts(session):
    return {t.experiment.name: t.chapter.verdict for t in session.results}


def test_numbers_go_from_one_experiment_to_those_on_the_same_rig(bench, tmp_path):
    said = verdicts(laboratory.run_laboratory((), "", 0, tmp_path))
    assert said["2"].endswith("after 1")
    assert said["3"] == "3 on ECP 210, two carts, seed 0, after nothing"  # another rig than experiment 1's


def test_interrupted_it_keeps_what_is_finished_and_goes_on_from_there(bench, tmp_path):
    ran, trouble = bench
    trouble["2"] = KeyboardInterrupt()
    first = laboratory.run_laboratory((), "", 0, tmp_path)
    assert first.interrupted
    assert [t.experiment.name for t in first.results] == ["1"]
    assert [e.name for e in first.missing] == ["2", "3"]
    told = laboratory.book(first, laboratory.date(2006, 6, 18))
    assert "Stopped by Ctrl-C" in told.notes[0]
    assert any("Go on" in s.sentence for s in told.steps)
    trouble.clear()
    second = laboratory.run_laboratory((), "", 0, tmp_path)
    assert not second.interrupted
    assert [t.state for t in second.results] == ["kept", "done", "done"]
    assert ran == ["1", "2", "2", "3"]


def test_a_ctrl_c_that_an_experiment_has_swallowed_is_still_obeyed(bench, tmp_path):
    stopped = laboratory.run_laboratory((), "", 0, tmp_path, stopped=lambda: True)
    assert [t.state for t in stopped.results] == ["stopped"]
    assert stopped.interrupted
    assert [t.state for t in laboratory.run_laboratory(("1",), "", 0, tmp_path).results] == ["done"]


@pytest.mark.parametrize("kind", [NotIdentifiable, FloatingPointError, np.linalg.LinAlgError])
def test_an_experiment_that_fails_says_why_and_the_others_go_on(bench, tmp_path, kind):
    _, trouble = bench
    trouble["2"] = kind("nothing moves; is the amplifier on?")
    session = laboratory.run_laboratory((), "", 0, tmp_path)
    assert [t.state for t in session.results] == ["done", "failed", "done"]
    failed = session.results[1].chapter
    assert not failed.sound
    assert "nothing moves; is the amplifier on?" in failed.detail
    assert laboratory.book(session, laboratory.date(2006, 6, 18)).chapters[1].state == "not finished"


@pytest.mark.parametrize("change", [{"seed": 1}, {"make": "linear"}, {"fresh": True}])
def test_what_was_made_of_something_else_is_made_again(bench, tmp_path, change):
    call = {"make": "", "seed": 0} | change
    fresh = call.pop("fresh", False)
    laboratory.run_laboratory(("1", "2"), "", 0, tmp_path)
    again = laboratory.run_laboratory(("1", "2"), call["make"], call["seed"], tmp_path, fresh=fresh)
    assert [t.state for t in again.results] == ["done", "done"]


def test_one_experiment_again_does_not_cost_the_others_their_place(bench, tmp_path):
    ran, trouble = bench
    laboratory.run_laboratory((), "", 0, tmp_path)
    again = laboratory.run_laboratory(("2",), "", 0, tmp_path, fresh=True)
    assert [(t.experiment.name, t.state) for t in again.results] == [("1", "done"), ("2", "done"), ("3", "kept")]
    assert laboratory.typed_again(again) == "upright lab"
    trouble["2"] = KeyboardInterrupt()
    stopped = laboratory.run_laboratory(("2",), "", 0, tmp_path, fresh=True)
    assert stopped.interrupted
    assert [t.experiment.name for t in stopped.results] == ["1", "2", "3"]  # 2 as it was kept: it still holds
    alone = laboratory.run_laboratory(("1",), "", 1, tmp_path)
    assert laboratory.typed_again(alone) == "upright lab --experiment 1 --seed 1"
    assert laboratory.typed_again(alone, 7) == "upright lab --experiment 1 --seed 7"  # the same on another rig
    assert laboratory.typed_again(alone, 0) == "upright lab --experiment 1"
    assert ran == ["1", "2", "3", "1", "2", "1", "2", "1"]


def test_a_torn_file_is_made_again(bench, tmp_path):
    laboratory.run_laboratory(("1",), "", 0, tmp_path)
    path = tmp_path / "1" / "chapter.json"
    path.write_text(path.read_text(encoding="utf-8")[:100], encoding="utf-8")
    assert [t.state for t in laboratory.run_laboratory(("1",), "", 0, tmp_path).results] == ["done"]


def test_what_is_kept_reads_as_it_was_written(bench, tmp_path):
    first = laboratory.run_laboratory(("1",), "", 0, tmp_path).results[0].chapter
    again = laboratory.run_laboratory(("1",), "", 0, tmp_path).results[0].chapter
    assert again.numbers == {"run": 1, "bad": None}  # JSON knows no NaN
    assert (again.parts, again.findings, again.verdict) == (first.parts, first.findings, first.verdict)


def test_the_share_told_never_goes_back(bench, tmp_path):
    shares = []
    laboratory.run_laboratory((), "", 0, tmp_path, lambda step, share: shares.append(share))
    assert shares == sorted(shares)
    assert shares[0] >= 0
    assert shares[-1] <= 1


@pytest.mark.slow
@pytest.mark.thorough
def test_experiments_side_by_side_say_what_they_say_one_after_another(tmp_path):
    """Frequency response and free swing both stand on the weighing, neither on the other."""
    one = laboratory.run_laboratory(("1", "4"), "furuta", 0, tmp_path / "one")
    two = laboratory.run_laboratory(("1", "4"), "furuta", 0, tmp_path / "two", workers=Workers(number=2))
    assert [t.experiment.name for t in two.results] == ["1a", "1b", "4"]
    assert [t.state for t in two.results] == ["done"] * 3
    assert verdicts(two) == verdicts(one)
    for key in ("1b", "4"):
        fits = [json.loads((tmp_path / n / key / "fit.json").read_text("utf-8")) for n in ("one", "two")]
        assert fits[0]["parameters"] == fits[1]["parameters"]


def test_nonideal_rigs_are_other_rigs_and_are_made_again(bench, tmp_path):
    """What was kept of clean ones is none of theirs; the report and the command say which they are."""
    laboratory.run_laboratory((), "", 0, tmp_path)
    session = laboratory.run_laboratory((), "", 0, tmp_path, nonideal=True)
    assert [t.state for t in session.results] == ["done", "done", "done"]
    assert session.stand("furuta").rig.plant.b_1s > session.stand("furuta").rig.plant.b_1c > 0
    book = laboratory.book(session, laboratory.date(2006, 6, 18))
    assert "They have unmodelled effects" in dict(book.facts)["Data"]
    assert dict(book.facts)["Again"] == "upright lab --nonideal"


def test_the_cover_names_each_rig_once_with_the_seed_that_makes_it_again(bench, tmp_path):
    """Experiments 1 and 2 share the disk of the 205, the third takes carts of the 210."""
    session = laboratory.run_laboratory((), "", 4, tmp_path)
    cover = laboratory.book(session, laboratory.date(2006, 6, 18))
    facts = dict(cover.facts)
    assert facts["Rig"] == "ECP 205 + A51, Furuta pendulum (seed 4); ECP 210, two carts (seed 4)"
    assert facts["Data"] == laboratory.TWINS
    assert cover.first_line.startswith("SIMULATED")
    assert facts["Experiments"] == "1, 2, 3"
    assert facts["Made"].startswith("2006-06-18, upright ")
    assert facts["Again"] == "upright lab --seed 4"
    assert (cover.title, cover.notes, cover.missing) == (laboratory.TITLE, (), ())
    empty = replace(session, results=[], interrupted=True)
    cover = laboratory.book(empty, laboratory.date(2006, 6, 18))
    assert dict(cover.facts)["Rig"] == "seed 4"
    assert dict(cover.facts)["Experiments"] == "none"
    assert "not yet experiments 1, 2, 3." in cover.notes[0]
    assert cover.missing == (("1", "Small 1"), ("2", "Small 2"), ("3", "Small 3"))


def test_a_changed_line_or_another_file_is_another_program_and_its_experiments_are_made_again(
    bench, tmp_path, monkeypatch
):
    """Of the files that are read when it runs: code and templates."""
    room = tmp_path / "upright" / "experiments"
    room.mkdir(parents=True)
    monkeypatch.setattr(laboratory, "__file__", str(room / "laboratory.py"))

    def program(**files):
        for name, text in files.items():
            (room / name.replace("_", ".")).write_text(text, encoding="utf-8")
        return laboratory._program.__wrapped__()

    seen = [
        program(a_py="x = 1"), program(a_py="x = 2"), program(b_md="One."), program(b_md="Two."), program(c_py="x = 2"),
    ]  # fmt: skip
    assert len(set(seen)) == 5
    assert program(d_txt="notes") == seen[-1]
    (room / "c.py").rename(room / "d.py")
    assert program() != seen[-1]
    (room / "d.py").rename(room / "c.py")
    assert program() == seen[-1]
    laboratory.run_laboratory((), "", 0, tmp_path)
    monkeypatch.setattr(laboratory, "_program", lambda: "another")
    again = laboratory.run_laboratory((), "", 0, tmp_path)
    assert [t.state for t in again.results] == ["done", "done", "done"]


def test_what_to_do_next_is_go_on_another_rig_and_a_log_of_one_s_own(bench, tmp_path):
    _, trouble = bench
    whole = laboratory.run_laboratory((), "linear", 4, tmp_path)
    assert [s.command for s in laboratory.next_steps(whole)] == [
        "upright lab --rig linear --seed 5", "upright lab --rig furuta", "upright init LOG",
    ]  # fmt: skip
    on_paper = laboratory.run_laboratory((), "", 0, tmp_path / "paper")
    assert [s.command for s in laboratory.next_steps(on_paper)][:2] == [
        "upright lab --seed 1", "upright lab --rig linear",
    ]  # fmt: skip
    trouble["2"] = NotIdentifiable("nothing moves.")
    failed = laboratory.run_laboratory((), "linear", 4, tmp_path / "failed")
    assert not failed.interrupted
    assert laboratory.next_steps(failed)[0].command == f"upright lab --rig linear --seed 4 -o {tmp_path / 'failed'}"


def test_a_live_rig_goes_on_with_the_law_that_was_recommended(bench, tmp_path, monkeypatch):
    """And neither its description nor another version of the program is mistaken for another rig."""
    live = made(tmp_path)
    task = laboratory.EXPERIMENTS["2"]
    page = Chapter(title="Held", verdict="Held.", numbers={"recommended": "set 2"})
    held = replace(task, on=lambda _: True, live_needs=(), tell=lambda _: (page, True))
    monkeypatch.setattr(laboratory, "EXPERIMENTS", declared(held))
    session = laboratory.run_laboratory((), "RIG.toml", 0, tmp_path, live=live)
    (step,) = laboratory.next_steps(session)
    law = tmp_path / "2" / "law_regulation_set_2.json"
    assert step.command == f"upright run --rig {tmp_path / '2' / 'rig.toml'} --law {law} --duration 60"
    cover = laboratory.book(session, laboratory.date(2006, 6, 18))
    assert dict(cover.facts)["Rig"] == live.rig.name  # no seed: there is one rig
    assert dict(cover.facts)["Data"] == live.source
    assert cover.first_line == live.performed
    empty = laboratory.book(replace(session, results=[]), laboratory.date(2006, 6, 18))
    assert dict(empty.facts)["Rig"] == "RIG.toml"
    monkeypatch.setattr(laboratory, "_program", lambda: "another")
    again = laboratory.run_laboratory((), "RIG.toml", 0, tmp_path, live=made(tmp_path))
    assert [t.state for t in again.results] == ["kept"]
