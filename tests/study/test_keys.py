"""Does the reference say what the program accepts, and does its example work?"""

import re
from pathlib import Path

import numpy as np
import pytest

from upright.errors import BadInput
from upright.study.expressions import FUNCTIONS
from upright.study.keys import SECTIONS, write_reference
from upright.study.load import load_study

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "study.md"


def test_the_page_is_what_the_keys_say():
    page = PAGE.read_text(encoding="utf-8")
    assert page == write_reference(page), "run python -m upright.study.keys"


def test_every_function_of_an_expression_is_described():
    text = PAGE.read_text(encoding="utf-8")
    assert [name for name in FUNCTIONS if not re.search(rf"`{name}[`(]", text)] == []


def test_the_example_of_the_page_is_a_study(tmp_path):
    example = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[0]
    t = np.arange(6000) * 0.01
    rows = np.column_stack([t, 0.1 * np.sin(t), 0.2 * np.cos(5 * t)])
    for name in ("kp_025.csv", "decay.csv"):
        np.savetxt(tmp_path / name, rows, "%.12g", ",", header="t,z,theta", comments="")
    (tmp_path / "study.toml").write_text(example.replace(".mat", ".csv"), encoding="utf-8")
    study = load_study(tmp_path / "study.toml")
    assert [run.label for run in study.runs] == ["kP 2.5", "decay"]
    assert study.model.estimated == ("J_p", "b_1", "b_2c", "actuator.gain")
    np.testing.assert_allclose(study.runs[0].u[:, 0], 2.5 * (0.2 - study.runs[0].y[:, 0]))


def test_the_example_of_what_differs_from_run_to_run_is_a_study(tmp_path):
    page = PAGE.read_text(encoding="utf-8").partition("## What may differ")[2]
    example = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)[0]
    t = np.arange(600) * 0.01
    rows = np.column_stack([t, 0.1 * np.sin(t), np.ones_like(t)])
    for name in ("spin_up.csv", "pid.csv", "pd.csv"):
        np.savetxt(tmp_path / name, rows, "%.12g", ",", header="t,theta_1,v", comments="")
    rig = "[rig]\nplant = 'torsional-1'\n[parameters]\nJ_1 = { guess = 1 }\n[sensors.theta_1]\n[drive]\ncolumn = 'v'\n"
    (tmp_path / "study.toml").write_text(rig + example.replace(".mat", ".csv"), encoding="utf-8")
    first, second, third = load_study(tmp_path / "study.toml").runs
    assert (first.shared, first.spread) == ({"friction": "28 Jan"}, {"friction": 0.15})
    assert first.unknown == ("initial", "input_end")
    assert second.shared == third.shared == {
        "friction": "29 Jan", "gain": "closed loop", "scale.theta_1": "closed loop"
    }  # fmt: skip


KEYS = [(section, key.name) for section in ("rig", "sensors", "drive", "runs", "loop") for key in SECTIONS[section][1]]


@pytest.mark.parametrize(("section", "key"), KEYS)
def test_a_key_of_the_page_is_never_called_unknown(tmp_path, section, key):
    tables = {
        "rig": "",
        "sensors": "",
        "drive": "column = 'v'",
        "runs": "file = 'log.csv'",
        "loop": "gains = { x_1 = 1 }",
    }
    tables[section] = f"{tables[section] if key not in tables[section] else ''}\n{key} = []"
    rows = np.column_stack([np.arange(100) * 0.01, np.ones((100, 2))])
    np.savetxt(tmp_path / "log.csv", rows, "%.12g", ",", header="t,x_1,v", comments="")
    (tmp_path / "study.toml").write_text(
        f"[rig]\n{'' if key == 'plant' else 'plant = `rectilinear-1`'.replace('`', chr(39))}\n{tables['rig']}\n"
        f"[parameters]\nm_1 = {{ guess = 1 }}\n[sensors.x_1]\n{tables['sensors']}\n"
        f"[drive]\n{tables['drive']}\n[[runs]]\n{tables['runs']}\n"
        + (f"[runs.loop]\n{tables['loop']}\n" if section == "loop" else ""),
        encoding="utf-8",
    )
    answer = ""
    try:
        load_study(tmp_path / "study.toml")
    except BadInput as error:
        answer = str(error)
    assert "has no key" not in answer
    assert "TOML" not in answer
