"""Does a command that is given something strange answer with one sentence, or just work?"""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.logs.runs import HEADER, written
from upright.cli import app
from upright.identification.frequency.response import MARK

STUDY = """\
[rig]
plant = "pendulum"
[parameters]
m_p = "0.1 kg"
l_cg = "0.2 m"
J_p = { guess = "1e-3 kg m^2" }
[sensors.theta]
unit = "counts"
counts_per_rev = 4096
[[runs]]
file = "swing.csv"
"""


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder at work with the log of a swing, nine columns of disks, and a study."""
    monkeypatch.chdir(tmp_path)
    t = np.arange(1500) * 0.01
    swing = [np.round(400 * np.exp(-0.05 * t) * np.cos(w * t)) for w in range(6, 15)]
    names = [f"theta_{i}" for i in range(1, 10)]
    for file, columns, header in (("swing.csv", swing[:1], ["theta"]), ("nine.csv", swing, names)):
        np.savetxt(file, np.column_stack([t, *columns]), "%.9g", ",", header=",".join(["t", *header]), comments="")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def run(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def sentence(*words):
    """The one sentence on stderr with which a command refuses."""
    done = run(*words)
    assert done.exit_code == 2, done.output
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("upright: ")
    return done.stderr


@pytest.mark.parametrize("command", ["identify", "ladder"])
@pytest.mark.parametrize("folder", [".", "..", "/"])
def test_a_folder_is_no_study(command, folder):
    assert "is a folder, and a study is a TOML file" in sentence(command, folder)


@pytest.mark.parametrize("bodies", [0, 10, 999_999_999])
def test_a_chain_of_too_many_bodies_is_not_derived(here, bodies):
    assert f"a chain has 1 to 9 bodies, got {bodies}" in sentence("init", "swing.csv", "--plant", f"torsional-{bodies}")


@pytest.mark.slow
@pytest.mark.parametrize("log", ["swing.csv", "nine.csv"])
def test_nine_disks_are_drafted_where_nine_columns_turn(here, log):
    done = run("init", log, "--plant", "torsional-9", "-o", "nine.toml")
    assert (done.exit_code, "bug" in done.stderr) == ((2, False) if log == "swing.csv" else (0, False))


NAMES = ["[bold]", "[link=x]", "$x", "$\\frac{", "{x}", "%s", "é∞漢", "\\"]


@pytest.mark.parametrize("name", NAMES if os.name == "posix" else NAMES[:4])
def test_markup_in_a_name_is_text(here, name):
    (here / f"{name}.csv").write_bytes((here / "swing.csv").read_bytes())
    assert f"Written: ./{name}".replace("./", "") in run("show", f"./{name}.csv", "-o", name).stdout
    assert run("init", f"./{name}.csv", "-o", f"./{name}.toml").exit_code == 0
    assert run("doctor", f"./{name}.csv", "-o", f"./{name}.html").exit_code in (0, 3)
    assert (here / f"{name}.html").stat().st_size > 1000


@pytest.mark.skipif(os.name != "posix", reason="such names are those of POSIX")
def test_a_name_with_a_line_feed_is_drafted_as_toml(here):
    (here / "a\nb\x1b.csv").write_bytes((here / "swing.csv").read_bytes())
    assert run("init", "a\nb\x1b.csv", "-o", "drafted.toml").exit_code == 0
    import tomllib

    assert tomllib.loads((here / "drafted.toml").read_text(encoding="utf-8"))["runs"][0]["file"] == "a\nb\x1b.csv"


@pytest.mark.skipif(os.name != "posix", reason="such names are those of POSIX")
def test_a_name_that_is_no_text_is_a_sentence(here):
    name = os.fsdecode(b"\xff\xfe.csv")
    (here / name).write_bytes((here / "swing.csv").read_bytes())
    for command in ("show", "doctor", "init"):
        assert "is no text, so that no study could name it" in sentence(command, name)


FURUTA = {"m_p": 0.135, "l_cg": 0.19, "r": 0.16, "J_d": 0.011, "J_p": 6e-4, "J_a": 0.0}


@pytest.fixture
def fit(here):
    """A fit.json of a Furuta pendulum, by hand."""
    content = {"format": 1, "plant": "furuta", "verdict": "sound", "parameters": FURUTA}
    (here / "fit.json").write_text(json.dumps(content), encoding="utf-8")
    return "fit.json"


@pytest.mark.parametrize("option", ["--from", "--to"])
@pytest.mark.parametrize("value", ["nan", "-1", "0", "inf"])
def test_a_band_has_frequencies(here, option, value):
    assert f"{option} needs a frequency above 0 rad/s" in sentence("frequency", "swing.csv", option, value)


def test_a_band_is_not_upside_down(here):
    said = sentence("frequency", "swing.csv", "--from", 10, "--to", 1)
    assert "--from must lie below --to, got 10 and 1 rad/s" in said


def test_frequency_says_what_it_needs(here):
    assert "needs a log, a frequency.csv or a study to read, or a twin to sweep: --rig" in sentence("frequency")
    assert "--from belongs to a log" in sentence("frequency", "--rig", "furuta", "--from", "1")
    assert sorted(p.name for p in here.iterdir()) == ["nine.csv", "study.toml", "swing.csv"]


@pytest.mark.parametrize("radius", ["4 m", "0 m", "-4 cm"])
def test_no_disk_is_as_wide_as_a_room(here, radius):
    limits = "above 0 and up to 50 cm, got"
    assert limits in sentence("plan-inertias", "--rig", "torsional", "--radius", radius)
    if not radius.startswith("-"):
        assert limits in sentence("loadings", "swing.csv", "--added", f"2 at {radius}")


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ("--poles=0,-2,-3,-4 --period=1ms", "a pole is to be where the model has one already"),
        ("--poles=-1,-2,-3,-4 --period=0s", "every 1e-6 to 10 s"),
        ("--poles=-1,-2,-3,-4 --period=1e300s", "every 1e-6 to 10 s"),
        ("--lqr 1,1,1,1 --period=1ms --limit 1e300", "above 0 and below 1e9"),
        ("--lqr 1,1,1,1 --period=1ms --limit nan", "above 0 and below 1e9"),
    ],
)
def test_a_design_that_no_loop_can_have_is_a_sentence(fit, options, says):
    assert says in sentence("design", fit, "--counts=4096", *options.split())


def test_a_servo_of_a_million_samples_per_row_is_not_drawn(here):
    t = np.arange(2000) * 0.01
    theta = np.cumsum(np.random.default_rng(1).normal(size=t.size))
    np.savetxt("loop.csv", np.column_stack([t, theta, -2 * theta]), "%.9g", ",", header="t,theta,u", comments="")
    words = ("law", "loop.csv", "--command", "u", "--measured", "theta", "--every")
    assert "2000 rows of 1000000 samples each are 2e+09 samples of the servo" in sentence(*words, 1_000_000)
    assert run(*words, 2).exit_code == 0


FILES = (
    "show swing.csv", "doctor swing.csv", "init swing.csv", "plan-inertias", "log show run.mcap --plot",
    "log recover run.mcap", "log convert run.mcap",
)  # fmt: skip


@pytest.mark.parametrize("command", FILES)
@pytest.mark.parametrize("out", ["x.exe", "x"])
def test_a_file_of_no_known_ending_is_written_or_a_sentence(here, command, out):
    (here / "run.mcap").write_bytes(written(50))
    done = run(*command.split(), "-o", out)
    assert done.exit_code in (0, 2, 3), done.output
    if done.exit_code == 2:
        assert done.stderr.count("\n") == 1
        assert f"file ending in .{'csv' if 'convert' in command else 'svg'}" in done.stderr
        assert out in done.stderr
    assert (here / out).exists() == (done.exit_code != 2)


def test_a_replay_of_a_rule_without_an_end_is_a_sentence(here, monkeypatch):
    monkeypatch.setattr("upright.logs.replay.PATIENCE", (0.3, 0.0))
    law = {"kind": "rule", "text": "def f(t, y, r, z, p):\n while True: pass"}
    (here / "run.mcap").write_bytes(written(50, header=replace(HEADER, law=law)))
    assert "the rule of 'run.mcap' was stopped" in sentence("log", "replay", "run.mcap")


def test_a_response_of_lists_in_one_another_is_a_sentence(here):
    lists = "[" * 100_000 + "]" * 100_000
    (here / "frequency.csv").write_text(f"{MARK}\n# {lists}\nomega\n1\n", encoding="utf-8")
    assert "frequency.csv" in sentence("frequency", "frequency.csv")
