"""Does a run begin as far aside as was said, or as can be seen, and is it asked for what was typed?"""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from tests.running.test_accepted import SERIAL, STUDY
from upright.errors import BadInput
from upright.report.page import Chapter
from upright.running import chapter as chapters
from upright.running import run as runs
from upright.verbs.rig import _let_go, run


@pytest.fixture
def rig(tmp_path):
    def write(make="furuta"):
        path = tmp_path / "RIG.toml"
        path.write_text(f'kind = "twin"\nmake = "{make}"\n', encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize(
    ("start", "make", "law", "aside"),
    [
        (None, "furuta", True, math.radians(3)), (None, "rectilinear", True, 3e-3), (None, "furuta", False, 0.0),
        (0.1, "furuta", True, 0.1), (0, "furuta", True, 0.0), ("5 deg", "furuta", True, math.radians(5)),
        ("theta=5 deg, psi=0", "furuta", False, math.radians(5)), ({"theta": 0.05}, "linear", True, 0.05),
        ("2 mm", "rectilinear", True, 2e-3), ({"psi": 0.0}, "furuta", True, 0.0),
    ],
)  # fmt: skip
def test_a_twin_s_hand_lets_go_as_far_aside_as_was_said_or_as_can_be_seen(rig, start, make, law, aside):
    assert _let_go(start, rig(make), law=law) == pytest.approx(aside)


@pytest.mark.parametrize("start", ["theta_dot=1 rad/s", {"psi": 0.1}, "theta=5 deg, psi=0.1"])
def test_a_hand_lets_go_of_the_pendulum_at_rest(rig, start):
    with pytest.raises(BadInput, match="the hand of a twin lets go of theta at rest"):
        _let_go(start, rig(), law=True)


def test_a_rig_itself_begins_where_a_person_holds_it(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "RIG.toml").write_text(SERIAL, encoding="utf-8")
    assert _let_go(None, tmp_path / "RIG.toml", law=True) == 0.0


def test_a_run_is_asked_for_what_was_typed_and_its_page_lies_beside_its_log(rig, tmp_path, monkeypatch):
    asked = []
    log = tmp_path / "out" / "run-2.mcap"

    def carry_out(request, folder, *, watch):
        asked.append((request, folder, watch))
        folder.mkdir(exist_ok=True)
        return SimpleNamespace(log=object(), log_path=log)

    monkeypatch.setattr(runs, "run_rig", carry_out)
    monkeypatch.setattr(chapters, "run_chapter", lambda result: Chapter(title="Ran", verdict="Ran."))
    path = rig()
    done = run(path, law=tmp_path / "law.json", duration=7.0, check=False, watch=False, out=tmp_path / "out",
               start="2 deg", reference="step 0.1", mode="mcu", accept="so")  # fmt: skip
    ((request, folder, _),) = asked
    assert (request.rig, request.law, request.excite, folder) == (path, tmp_path / "law.json", None, tmp_path / "out")
    assert (request.seconds, request.check, request.watch, request.mode) == (7.0, False, False, "mcu")
    assert (request.tilt, request.reference, request.accept) == (pytest.approx(math.radians(2)), "step 0.1", "so")
    assert [f.name for f in done.files] == ["run-2.mcap", "run-2.html"]
    run(path, excite="sine 0.5 1", out=tmp_path / "out")
    request = asked[1][0]
    assert (request.law, request.excite, request.seconds, request.tilt) == (None, "sine 0.5 1", 30.0, 0.0)
    assert (request.check, request.watch, request.mode, request.accept) == (True, True, "host", "")
    with pytest.raises(BadInput, match="the log of a run is kept"):
        run(path, excite="free")
    with pytest.raises(BadInput, match="There is no file"):
        run(tmp_path / "NONE.toml", excite="free", out=tmp_path / "out")
