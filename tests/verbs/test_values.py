"""Is what a call hands over taken as it was meant: values with units, poles, pairs, matrices, answers?"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput
from upright.report.page import Chapter, Part, Picture
from upright.verbs.answer import Answer
from upright.verbs.linear.matrices import is_linear, linear_model, read_matrices
from upright.verbs.values import open_log, pairs, paths, read_pole_list, si, si_if_given, texts


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [(2, "m", 2.0), ("2 mm", "m", 2e-3), ("90 deg", "rad", math.pi / 2), (np.float64(-1.5), "V", -1.5)],
)
def test_a_number_is_in_si_and_a_text_is_converted(value, unit, expected):
    assert si(value, unit) == pytest.approx(expected)
    assert si_if_given(value, unit) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("value", "said"),
    [(math.nan, "finite number was needed, in the SI unit of m, got nan"), (math.inf, "got inf"), (None, "got None")],
)
def test_what_is_no_number_is_refused(value, said):
    with pytest.raises(BadInput, match=said):
        si(value, "m")
    with pytest.raises(BadInput, match="in the SI unit of 1"):
        si(value, "")


def test_what_is_left_out_is_none_and_zero_is_not():
    assert si_if_given(None, "m") is None
    assert si_if_given("", "m") is None
    assert si_if_given(0.0, "m") == 0.0


def test_poles_are_texts_or_numbers():
    assert sorted(read_pole_list("-4+-2j, -10"), key=lambda p: (p.real, p.imag)) == [-10, -4 - 2j, -4 + 2j]
    assert read_pole_list(-3.0).tolist() == [-3]
    assert read_pole_list([[-1, -2]]).tolist() == [-1, -2]
    assert read_pole_list([]) is None
    assert read_pole_list("") is None
    assert read_pole_list(None) is None


@pytest.mark.parametrize(
    ("value", "expected"),
    [({"a": 1}, {"a": 1}), ("a = b=c", {"a": "b=c"}), (["x=1", " y = 2 "], {"x": "1", "y": "2"}), (None, {}), ("", {})],
)
def test_pairs_are_split_at_the_first_equals_sign(value, expected):
    assert pairs(value, "--set") == expected


@pytest.mark.parametrize("text", ["a", "=b", "a=", " = b", "a = "])
def test_half_a_pair_is_refused(text):
    with pytest.raises(BadInput, match=f"--set takes NAME=VALUE, got '{text}'"):
        pairs([text], "--set")


def test_one_text_or_path_stands_for_a_list_of_one():
    assert texts("a") == ("a",)
    assert texts(["a", "b"]) == ("a", "b")
    assert texts(None) == texts("") == ()
    assert paths("a") == ("a",)
    assert paths(["a", "b"]) == paths(("a", "b")) == ("a", "b")
    assert paths(None) == ()


def test_a_log_in_memory_is_called_log():
    import pandas

    record, path = open_log(pandas.DataFrame({"t": [0.0, 0.1], "x": [1.0, 2.0]}))
    assert (path, record.provenance.file) == (Path("log"), "log")
    assert record["x"].tolist() == [1.0, 2.0]
    with pytest.raises(BadInput, match="a Record or a pandas DataFrame, got 3"):
        open_log(3)


def written(tmp_path, text):
    path = tmp_path / "tower.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_matrices_of_a_file_make_a_model_with_their_names_and_units(tmp_path):
    model = read_matrices(written(tmp_path, '''
        A = [[0, 1], [20, -1]]
        B = [0, 3]
        C = [1, 0]
        D = 0.5
        dt = "20 ms"
        states = ["x", "v"]
        inputs = ["F"]
        outputs = ["x_seen"]
        [units]
        F = "V"
    '''))  # fmt: skip
    assert (model.A.tolist(), model.B.tolist()) == ([[0, 1], [20, -1]], [[0], [3]])
    assert (model.C.tolist(), model.D.tolist()) == ([[1, 0]], [[0.5]])
    assert (model.dt, model.name) == (pytest.approx(0.02), "tower")
    assert (model.states, model.inputs, model.outputs) == (("x", "v"), ("F",), ("x_seen",))
    assert dict(model.units) == {"F": "V"}


def test_without_c_the_states_are_measured_under_their_own_names(tmp_path):
    model = read_matrices(written(tmp_path, 'A = [[0, 1], [20, -1]]\nB = [[0], [3]]\nstates = ["x", "v"]\n'))
    assert (model.C.tolist(), model.outputs, model.dt) == (np.eye(2).tolist(), ("x", "v"), None)
    assert not model.D.any()
    measured = 'A = [[0, 1], [20, -1]]\nB = [[0], [3]]\nC = [[1, 0], [0, 1]]\nstates = ["x", "v"]\n'
    assert read_matrices(written(tmp_path, measured)).outputs != ("x", "v")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("B = [1]\n", "has no A; a model needs A and B"), ("A = [[1]]\n", "has no B"),
        ("A = [[1]]\nB = [1]\nE = 3\n", "matrices come with no 'E'"),
        ("A = [[1, 2], [3]]\nB = [1, 2]\n", "row 2 has 1 numbers and row 1 has 2"),
        ("A = [[1, 2], 3]\nB = [1, 2]\n", "but row 2 is 3"),
        ("A = [[1, inf], [3, 4]]\nB = [1, 2]\n", "A holds finite numbers, got inf in row 1, column 2"),
        ("A = [[1, 0], [true, 4]]\nB = [1, 2]\n", "got True in row 2, column 1"),
        ("A = []\nB = [1]\n", "A is empty"), ("A = [[]]\nB = [1]\n", "A is empty"),
        ("A = [[1]]\nB = [1]\ndt = 20\n", "every 1e-6 to 10 s, got 20 s"), ("A = [[1]]\nB = [1]\ndt = 0\n", "got 0 s"),
        ("A = [[1]]\nB = [1]\nstates = ['x', 'y']\n", "states needs 1 different names"),
        ("A = [[1, 0], [0, 1]]\nB = [1, 1]\nstates = ['x', 'x']\n", "states needs 2 different names"),
        ("A = [[1]]\nB = [1]\nstates = [' ']\n", "states needs 1 different"),
        ("A = [[1]]\nB = [1]\nstates = 'x'\n", "needs 1"),
        ("A = [[1]]\nB = [1]\nstates = ['x']\n[units]\ny = 'm'\n", "names states, inputs and outputs, got 'y'"),
        ("A = [[1]]\nB = [1]\nstates = ['x']\n[units]\nx = 3\n", "a unit is text"),
        ("A = [[1]]\nB = [1]\nstates = ['x']\n[units]\nx = 'parsek'\n", "parsek"),
    ],
)  # fmt: skip
def test_what_is_no_model_is_refused_at_its_line(text, said, tmp_path):
    with pytest.raises(BadInput, match=said):
        read_matrices(written(tmp_path, text))


@pytest.mark.parametrize(("dt", "taken"), [("10", 10.0), ("1e-6", 1e-6)])
def test_the_ends_of_the_range_of_periods_are_periods(dt, taken, tmp_path):
    assert read_matrices(written(tmp_path, f"A = [[1]]\nB = [1]\ndt = {dt}\n")).dt == taken


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(BadInput, match=r"nowhere\.toml does not exist"):
        read_matrices(tmp_path / "nowhere.toml")


def test_a_linear_model_is_told_from_a_rig_and_has_a_name():
    import upright as up

    assert is_linear(([[1.0]], [[1.0]]))
    assert is_linear(up.StateSpace([[1.0]], [1.0]))
    assert not is_linear(up.Pendulum(m_p=0.2, l_cg=0.25))
    assert linear_model(([[1.0]], [[1.0]])).name == "a linear model"
    assert linear_model(up.StateSpace([[1.0]], [1.0], name="tower")).name == "tower"


def picture(name, draw):
    return Picture(name=name, draw=draw, caption="", description="")


def test_an_answer_draws_its_first_picture_or_the_one_that_is_named():
    page = Chapter(title="T", verdict="V", numbers={"a": 1}, parts=(
        Part("A", ("prose", picture("one", lambda: "drawn one"))),
        Part("B", (picture("two", lambda: "drawn two"), picture("kept", "<svg/>"))),
    ))  # fmt: skip
    answer = Answer(np.array([1.0, 2.0]), page)
    assert answer.pictures == ("one", "two", "kept")
    assert answer.plot() == "drawn one"
    assert answer.plot("two") == "drawn two"
    assert (answer.numbers, answer.shape, answer.files) == ({"a": 1}, (2,), ())
    assert {"shape", "plot"} <= set(dir(answer))
    assert "__len__" not in dir(answer)
    with pytest.raises(BadInput, match="plot draws one, two, kept, got 'three'"):
        answer.plot("three")
    assert answer.plot("kept")._repr_svg_() == "<svg/>"
    with pytest.raises(BadInput, match="there is no picture of 'T'"):
        Answer(1, Chapter(title="T", verdict="")).plot()
    assert Answer(1, Chapter(title="T", verdict="It holds.")).verdict == "It holds."
    with pytest.raises(BadInput, match=r"ending in \.html or \.pdf, got 'page\.txt'"):
        answer.report("page.txt")
    with pytest.raises(AttributeError):
        answer._hidden  # noqa: B018


def test_the_value_of_a_fit_alone_is_refused_with_what_to_hand_over():
    """It lacks the study that the answer has."""
    from upright.identification import Fit

    with pytest.raises(BadInput, match=r"got Fit\. Give the whole answer of up\.identify, without \.value"):
        up.design(object.__new__(Fit))
