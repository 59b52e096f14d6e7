"""Does a verb in Python leave files only where it was told to?"""

from pathlib import Path

import numpy as np
import pytest

import upright as up
from tests.logs.runs import written
from upright.verbs.command import command_of

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-3, b_2=2e-4)
RIG = up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096, travel="200 deg")
VERBS = {
    "regulate": lambda **out: up.regulate(RIG, draws=2, seconds=0.5, which=1, **out),
    "swing_up": lambda **out: up.swing_up(RIG, seconds=1.0, **out),
}


@pytest.mark.parametrize("verb", [pytest.param("regulate", marks=pytest.mark.slow), "swing_up"])
def test_no_file_is_left_where_no_folder_is_named(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = VERBS[verb]()
    assert answer.files == ()
    assert not list(tmp_path.iterdir())
    assert not {"report", "files"} & set(answer.numbers)
    assert answer.chapter.steps == ()  # what they propose would read files that are not there
    answer.plot()


@pytest.mark.parametrize("verb", [pytest.param("regulate", marks=pytest.mark.slow), "swing_up"])
def test_files_are_written_into_the_folder_that_is_named(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answer = VERBS[verb](out=tmp_path / "here")
    assert [p.name for p in tmp_path.iterdir()] == ["here"]
    assert answer.files
    assert all(f.is_file() for f in answer.files)


def test_a_pdf_needs_a_folder():
    with pytest.raises(up.BadInput, match="none was named"):
        up.swing_up(RIG, pdf=True)


def test_an_export_is_in_memory_where_no_folder_is_named_and_the_same_in_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    law = up.design(RIG, speed="plain").law
    for source, to in ((law, "c"), (law, "python"), (RIG, "mjcf")):
        held = up.export(source, to=to)
        assert not list(tmp_path.iterdir())
        stored = up.export(source, to=to, out=tmp_path.parent / f"stored-{to}")
        assert {f.name: f.read_bytes() for f in stored.files} == held.contents


LOOKED = {
    "show": lambda **out: up.show(SWING, **out),
    "init": lambda **out: up.init(SWING, **out),
    "log_show": lambda **out: up.log_show("run.mcap", **out),
    "log_convert": lambda **out: up.log_convert("run.mcap", **out),
    "log_recover": lambda **out: up.log_recover("run.mcap", **out),
}
OUT = {"show": "show.svg", "init": "study.toml", "log_show": ".", "log_convert": "run.csv", "log_recover": "whole.mcap"}
SWING = up.simulate(RIG, start={"theta": 0.3}, seconds=1)


@pytest.mark.parametrize("verb", LOOKED)
def test_who_looks_at_a_log_leaves_a_file_only_where_one_is_named(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.mcap").write_bytes(written(400, finish=False)[:-3000])
    answer = LOOKED[verb]()
    assert [p.name for p in tmp_path.iterdir()] == ["run.mcap"]
    assert answer.files == ()
    again = LOOKED[verb](out=OUT[verb])
    assert all(f.is_file() for f in again.files)
    assert len(list(tmp_path.iterdir())) == 1 + len(again.files)
    assert again.files


def test_a_torn_log_is_the_same_rows_in_memory_and_in_the_file_that_is_named(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(written(400, finish=False)[:-3000])
    held, stored = up.log_recover(path), up.log_recover(path, out=tmp_path / "whole.mcap")
    assert len(held.log) == len(stored.log) == 300
    record = up.log_convert(path).value
    up.log_convert(path, out=tmp_path / "run.csv")
    for name in record.names:
        np.testing.assert_array_equal(record[name], up.read(tmp_path / "run.csv")[name])


def test_the_former_option_that_drew_a_log_still_does_and_warns(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.warns(DeprecationWarning, match="out="):
        up.show(SWING, plot=True)
    assert [p.name for p in tmp_path.iterdir()] == ["show-log.svg"]
    with pytest.warns(DeprecationWarning, match="out="):
        assert up.show(SWING, plot=True, out="mine.svg").files[0].name == "mine.svg"


@pytest.mark.slow
def test_a_laboratory_on_a_twin_leaves_no_file_and_answers_with_every_picture(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lab = up.lab(experiment="1a", rig="rectilinear", seed=2)
    assert not list(tmp_path.iterdir())
    assert (lab.files, lab.experiment("1a").chapter.steps) == ((), ())
    assert not {"folder", "report", "pdf"} & set(lab.numbers)
    assert all(lab.experiment("1a").plot(name) for name in lab.experiment("1a").pictures)


def test_a_laboratory_at_a_rig_asks_for_a_folder_before_anything_moves(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(up.BadInput, match="name a folder for it, such as out='laboratory'"):
        up.lab(rig="serial:/dev/ttyACM7")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("verb", ["run", "firmware_build", "firmware_flash"])
def test_what_cannot_be_but_a_file_asks_for_its_folder(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(up.BadInput, match="name a folder for it, such as out="):
        getattr(up, verb)(*(["RIG.toml"] if verb == "run" else []))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("typed", "folder"),
    [
        ({}, "upright-lab"), ({"rig": "furuta", "seed": 3}, "upright-lab-furuta-3"),
        ({"nonideal": True}, "upright-lab-nonideal"), ({"rig": "rigs/RIG.toml"}, "upright-lab-RIG"),
        ({"rig": "serial:COM3"}, "."),
    ],
)  # fmt: skip
def test_the_folder_of_a_laboratory_is_named_as_its_help_says(typed, folder):
    """What is not typed is None; a board's files stand where one is."""
    before = {"rig": None, "seed": None, "nonideal": None, "out": None, "ask": 1, "watching": 1}
    assert command_of(up.lab).prepare(before | typed)["out"] == Path(folder)
