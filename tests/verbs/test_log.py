"""Do the verbs of a log answer in a notebook what the commands answer, and write nothing unless asked?"""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.closed_loop.programs import Pid, closed_loop
from upright.errors import BadInput
from upright.records import Record
from upright.study.load import load_study
from upright.verbs.log import doctor, init, law, read, show, show_logs

T = np.arange(1500) * 4e-3
SWING = np.round(0.8 * np.exp(-0.3 * T) * np.cos(7 * T), 4)


def record(theta: np.ndarray = SWING) -> Record:
    return Record(t=T, signals={"theta": theta}, units={"theta": "rad"})


@pytest.fixture(autouse=True)
def nothing_is_written_unasked(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    yield
    assert list((tmp_path / "here").iterdir()) == []


def forms(tmp_path: Path):
    """One log as file name, record and data frame."""
    pandas = pytest.importorskip("pandas")
    np.savetxt(tmp_path / "swing.csv", np.column_stack([T, SWING]), "%.9g", ",", header="t,theta [rad]", comments="")
    return (str(tmp_path / "swing.csv"), tmp_path / "swing.csv", record(), pandas.DataFrame({"t": T, "theta": SWING}))


def test_a_log_is_a_file_a_record_or_a_data_frame(tmp_path):
    for log in forms(tmp_path):
        seen = read(log)
        np.testing.assert_allclose(seen.t, T, atol=1e-9)
        np.testing.assert_allclose(seen[seen.names[0]], SWING, atol=1e-9)
        assert show(log).value.time.period == pytest.approx(4e-3)


@pytest.mark.parametrize("thing", [3, {"t": T}, None])
def test_what_is_no_log_is_refused_in_a_sentence(thing):
    with pytest.raises(BadInput, match="a Record or a pandas DataFrame"):
        read(thing)


def test_a_planted_jump_is_found_where_it_was_planted():
    found = doctor(record(SWING + np.where(T > 2.2, 0.15, 0.0)))
    (jump,) = [f for f in found.findings if f.kind == "jump"]
    # between two samples the swing itself moves by at most 0.022 rad
    assert jump.evidence["jump [rad]"] == pytest.approx(0.15, abs=0.03)
    assert found.wrong
    assert found.numbers["wrong"] is True
    assert not doctor(record(), rig="pendulum").wrong
    assert "jump" in repr(found)
    assert found.files == ()


def test_the_picture_and_the_page_are_written_where_they_are_asked_for(tmp_path):
    assert show(record(), out=tmp_path / "out").files == (tmp_path / "out" / "show-log.svg",)
    assert show(record(), out=tmp_path / "mine.png").files == (tmp_path / "mine.png",)
    page = doctor(record(), html=tmp_path / "page.html")
    assert page.files == (tmp_path / "page.html",)
    assert "<html" in page.files[0].read_text(encoding="utf-8")


def test_a_draft_is_answered_and_written_only_where_asked(tmp_path):
    drafted = init(record())
    assert tomllib.loads(drafted.value)["rig"]["plant"] == "pendulum"
    assert drafted.files == ()
    written = init(record(), out=tmp_path / "study.toml")
    assert written.files == (tmp_path / "study.toml", tmp_path / "study.csv")
    (run,) = tomllib.loads(written.files[0].read_text(encoding="utf-8"))["runs"]
    np.testing.assert_allclose(read(tmp_path / run["file"])["theta"], SWING)
    with pytest.raises(BadInput, match="exists already"):
        init(record(), out=tmp_path / "study.toml")
    init(record(), out=tmp_path / "study.toml", force=True)


def test_the_gains_of_a_simulated_loop_come_back(tmp_path):
    log = closed_loop(Pid(kp=4.0, ki=3.0, kd=0.2, second=0.8, on="measurement"), rows=2000, step=0.01)
    found = law(log, command="u", measured="y", reference="r", out=tmp_path / "out")
    for name, true in (("kp", 4.0), ("ki", 3.0), ("kd", 0.2)):
        low, high = found.gains[name].interval
        assert low <= true <= high
        assert found.numbers["gains"][name]["value"] == pytest.approx(true, rel=0.01)
    assert [f.name for f in found.files] == ["law-log.json", "law-log.svg", "law-log.html"]
    with pytest.raises(BadInput, match="holds the columns y, r, u"):
        law(log)


def test_the_verbs_load_no_numerical_library_before_they_are_called():
    code = (
        "import sys, upright.verbs.log, upright.verbs.model.ladder\n"
        "import upright.verbs.control.regulate, upright.verbs.course\n"
        "print([n for n in ('numpy', 'scipy', 'sympy', 'llvmlite', 'matplotlib', 'pandas') if n in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True)
    assert out.stdout.strip() == "[]"


def test_a_clock_in_milliseconds_that_states_no_unit_is_read_with_one(tmp_path):
    log = tmp_path / "swing.csv"
    np.savetxt(log, np.column_stack([1e3 * T, SWING]), "%.9g", ",", header="t,theta [rad]", comments="")
    np.testing.assert_allclose(read(log, time_unit="ms").t, T, atol=1e-9)
    assert show(log, time_unit="ms").value.time.period == pytest.approx(4e-3)
    init(log, out=tmp_path / "swing.toml", time_unit="ms")
    study = load_study(tmp_path / "swing.toml")  # which holds the unit for every later command
    assert study.runs[0].t[1] - study.runs[0].t[0] == pytest.approx(4e-3)


@pytest.mark.parametrize("unit", ["mV", "fortnights"])
def test_a_time_unit_that_is_none_is_refused_in_a_sentence(tmp_path, unit):
    log = tmp_path / "swing.csv"
    np.savetxt(log, np.column_stack([1e3 * T, SWING]), "%.9g", ",", header="t,theta [rad]", comments="")
    with pytest.raises(BadInput, match=f"a unit of time.*{unit}"):
        read(log, time_unit=unit)


def test_a_study_keeps_how_its_log_was_read_and_says_what_is_left_to_measure(tmp_path):
    """A driven arm leaves masses to weigh; a reader and a clock that were named stand under [defaults]."""
    log = tmp_path / "arm.csv"
    t = np.arange(2000) * 2.0  # ms
    theta = 0.3 * np.sin(0.007 * t)
    np.savetxt(log, np.column_stack([t, 0.2 * theta, theta, np.sin(0.003 * t)]), "%.9g", ",",
               header="t,psi [rad],theta [rad],u [V]", comments="")  # fmt: skip
    drafted = init(log, out=tmp_path / "arm.toml", plant="furuta", time_unit="ms", reader="table")
    content = tomllib.loads(drafted.value)
    assert (content["defaults"]["time_unit"], content["defaults"]["reader"]) == ("ms", "table")
    (points,) = drafted.chapter.parts[0].content
    (left,) = [s for s in points.sentences if s.startswith("Placeholders to replace by what you measured: ")]
    named = left.partition(": ")[2].split(", ")
    assert len(named) == len(set(named)) > 1
    assert "m_p" in named
    assert drafted.chapter.steps[0].command.startswith("upright identify ")
    assert drafted.chapter.steps[0].command.endswith("arm-fit")
    folder = tmp_path / "studies"
    folder.mkdir()
    assert init(log, out=folder, plant="furuta", time_unit="ms").files == (folder / "arm.toml",)


def test_logs_are_shown_one_by_one_and_the_last_says_what_to_do_next(tmp_path):
    """Pictures of one name keep apart; signs that no file should bear are replaced."""
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        np.savetxt(tmp_path / name / "swing one.csv", np.column_stack([T, SWING]), "%.9g", ",", header="t,theta [rad]",
                   comments="")  # fmt: skip
    logs = [tmp_path / name / "swing one.csv" for name in ("a", "b")]
    first, last = show_logs(logs, out=tmp_path / "out")
    assert [f.name for answer in (first, last) for f in answer.files] == [
        "show-swing_one.svg", "show-swing_one-2.svg",
    ]  # fmt: skip
    assert first.chapter.steps == ()
    assert last.chapter.steps[0].command == f'upright init "{logs[0]}" -o study.toml'
    assert all(answer.files == () for answer in show_logs(logs, plot=False))
    assert show(logs[0], time_unit="s").chapter.steps[0].command.endswith("--time-unit s -o study.toml")
