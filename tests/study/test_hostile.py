"""Is every key of every landed study, changed in every way, answered by a study or by one sentence?

Each study is read beside logs that stand in for its own. A part of the changes is tried every time, all of them with
the slow tests, and a few on the command line, where time, memory and the folder are watched too.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.study.landed import STUDIES, stand_ins, text_of
from tests.study.mutations import at, changed, paths, wrong
from upright.errors import UprightError
from upright.study.load import load_study

EVERY = 25
"""A part of so many is tried every time."""


def mutations(name):
    study = STUDIES[name]
    return [(place, what, value) for place in paths(study) for what, value in wrong(at(study, place))]


def judge(name, some):
    """How many of some changes were refused; anything but a study or a sentence ends the test."""
    study, refused = STUDIES[name], 0
    records = stand_ins(study)
    for place, what, value in some:
        try:
            load_study(Path("study.toml"), text=text_of(changed(study, place, value)), records=records)
        except UprightError as error:
            said = str(error)
            assert said, (place, what)
            assert "\n" not in said, (place, what, said)
            assert len(said) < 5000, (place, what, said)
            refused += 1
        except BaseException as error:
            raise AssertionError(f"{name}: {place} with {what}") from error
    return refused


@pytest.mark.parametrize("name", STUDIES)
def test_a_landed_study_is_read(name):
    assert judge(name, []) == 0
    study = STUDIES[name]
    assert load_study(Path("study.toml"), text=text_of(study), records=stand_ins(study)).runs


@pytest.mark.parametrize("part", range(4))
@pytest.mark.slow
def test_some_changes_of_every_study_are_a_study_or_a_sentence(part):
    names = list(STUDIES)[part::4]
    tried = {name: mutations(name)[part::EVERY] for name in names}
    refused = sum(judge(name, some) for name, some in tried.items())
    assert 0.3 < refused / sum(map(len, tried.values())) < 0.98


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_a_fifth_of_all_changes_of_a_study_are_a_study_or_a_sentence(name):
    assert judge(name, mutations(name)[list(STUDIES).index(name) % 5 :: 5]) > 0


CLI = [(name, change) for i, name in enumerate(STUDIES) for change in mutations(name)[i * 7 :: 3200]]
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_DATA, (1 << 30, 1 << 30))
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
from upright.cli import main
sys.argv = ['upright', *sys.argv[1:]]
main()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited as Linux does")
@pytest.mark.parametrize("n", range(len(CLI)))
def test_a_changed_study_on_the_command_line_is_a_fit_or_one_sentence(tmp_path, n):
    """Within 60 s of CPU and 1 GB, with no other file than results."""
    name, (place, what, value) = CLI[n]
    study = STUDIES[name]
    for file, record in stand_ins(study).items():
        log = tmp_path / "data" / file
        log.parent.mkdir(parents=True, exist_ok=True)
        short = record.window(0.0, 80.0)
        short.to_csv(log)
    (tmp_path / "study.toml").write_text(text_of(changed(study, place, value)), encoding="utf-8")
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    done = subprocess.run(
        [sys.executable, "-c", LIMITED, "identify", "study.toml", "--data", "data", "-o", "out"],
        cwd=tmp_path, capture_output=True, text=True, timeout=500, check=False,
        env={**os.environ, "UPRIGHT_DEBUG": "0"},
    )  # fmt: skip
    assert done.returncode in (0, 2), (place, what, done.stderr)
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == (1 if done.returncode else 0), (place, what, done.stderr)
    assert {p: p.read_bytes() for p in before} == before
    assert {p.parent for p in tmp_path.rglob("*") if p.is_file() and p not in before} <= {tmp_path / "out"}
