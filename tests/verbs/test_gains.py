"""Do gains behave as the array and the triple that they stand for, and do courses keep their bounds?"""

from __future__ import annotations

import numpy as np
import pytest

import upright as up
from upright.errors import BadInput

MODEL = up.StateSpace([[0.0, 1.0], [4.0, 0.0]], [0.0, 2.0], states=("x", "v"), inputs=("F",))
RECORD = up.Record(t=[0.0, 1.0], signals={"a": [1.0, 2.0]})


def test_gains_are_an_array_a_triple_and_a_table():
    """x'' = 4 x + 2 F with poles -1 and -4: s^2 + 5 s + 4 = s^2 + 2 k_v s + 2 k_x - 4."""
    gains = up.place(MODEL, "-1, -4")
    np.testing.assert_allclose(np.asarray(gains), [[4.0, 2.5]])
    assert np.asarray(gains, dtype=np.float32).dtype == np.float32
    K, S, E = gains
    assert (len(gains), gains.shape, S) == (3, (1, 2), None)
    np.testing.assert_allclose(np.sort(E.real), [-4, -1])
    assert gains[0, 1] == K[0, 1]
    np.testing.assert_allclose(gains @ [1.0, 2.0], [9.0])
    assert (gains.states, gains.inputs, gains.point, gains.period) == (("x", "v"), ("F",), None, None)
    assert up.place(MODEL.to_sampled(0.1), [0.5, 0.25]).period == 0.1
    table = gains.to_pandas()
    assert (list(table.index), list(table.columns), table.loc["F", "v"]) == (["F"], ["x", "v"], K[0, 1])


def test_gains_of_a_loop_that_is_not_stable_begin_with_a_warning():
    """A pole on the border does not decay either; z = e^(s T) maps the left half-plane onto the unit disk."""
    warned = "Warning: this loop is not stable."
    assert all(up.place(MODEL, poles).sentence.startswith(warned) for poles in ("1, -4", "0, -4", "2+-1j"))
    assert "requested 2±1j." in up.place(MODEL, "2+-1j").sentence
    assert not up.place(MODEL, "-1, -4").sentence.startswith(warned)
    sampled = MODEL.to_sampled(0.1)
    assert up.place(sampled, np.exp(0.1 * np.array([1.0, -4.0]))).sentence.startswith(warned)
    assert not up.place(sampled, np.exp(0.1 * np.array([-1.0, -4.0]))).sentence.startswith(warned)


def test_weights_are_a_diagonal_a_matrix_or_a_text():
    full = up.lqr(MODEL, np.diag([1.0, 3.0]), [[2.0]]).K
    for Q, R in (([1.0, 3.0], 2.0), ("1, 3", [2.0]), ("1, 3", "2")):
        np.testing.assert_array_equal(up.lqr(MODEL, Q, R).K, full)


def test_arrays_without_a_period_are_a_model_at_its_samples():
    """x[k+1] = x + u, Q = R = 1: S = (1 + sqrt 5)/2 and K = S/(1 + S)."""
    golden = (1 + 5**0.5) / 2
    found = up.dlqr(([[1.0]], [[1.0]]), [1.0], 1.0)
    assert found.K[0, 0] == pytest.approx(golden / (1 + golden))
    assert found.S[0, 0] == pytest.approx(golden)
    assert found.poles[0] == pytest.approx(1 - golden / (1 + golden))


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: up.margins(MODEL, [1 + 1j, 2]), "K holds the gains of u = -K x, real numbers"),
        (lambda: up.prefilter(MODEL, [1, 2], output=-1), "output is a number from 0 to 1 or one of"),
        (lambda: up.place(MODEL, [object()]), "poles are complex numbers, or a text"),
        (lambda: up.dlqr(up.Pendulum(m_p=0.2, l_cg=0.2).linear(), [1, 1], 1.0), "this one is continuous"),
        (lambda: up.identify("a.toml", method="guess"), "there is no 'guess'"),
        (lambda: up.identify(up.Pendulum(m_p=0.2, l_cg=0.2, J_p=1e-3)), "takes a log of it first"),
        (lambda: up.identify(RECORD, 3), r"takes a plant such as up\.Pendulum"),
        (lambda: up.identify("a.toml", up.Pendulum), "plant belongs to a log"),
        (lambda: up.identify("a.toml", known={"m_p": 1}), "known belongs to a log"),
        (lambda: up.lab(seed=-1), "at least 0, got -1"),
        (lambda: up.lab(rig="nowhere.toml"), "there is no file 'nowhere.toml'"),
        (lambda: up.lab(rig="nowhere.toml", workers=2), "are for twins of makes"),
        (lambda: up.lab(rig="nowhere.toml", nonideal=True), "are for twins of makes"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said_at_once(call, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match=said):
        call()
    assert list(tmp_path.iterdir()) == []


PRINTED = "concept,pre,post\nfeedback,2,3\n"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"n": 1}, "at least 2, got 1"), ({}, "say with n how many answers"),
        ({"n": 9, "scale": "4-4"}, "its two ends"),
        ({"n": 9, "scale": "1"}, "its two ends"), ({"n": 9, "scale": "1-1000"}, "its two ends"),
    ],
)  # fmt: skip
def test_a_survey_needs_two_answers_and_two_ends(options, said, tmp_path):
    (tmp_path / "means.csv").write_text(PRINTED, encoding="utf-8")
    with pytest.raises(BadInput, match=said):
        up.survey(tmp_path / "means.csv", **options)


def test_a_survey_of_two_answers_and_a_scale_in_words_is_read(tmp_path):
    (tmp_path / "my_means.csv").write_text(PRINTED, encoding="utf-8")
    done = up.survey(tmp_path / "my_means.csv", n=2, scale=" 1 to 5 ")
    assert done.chapter.title == "Survey: my means"
    assert done.chapter.steps[0].command.endswith("my_means.csv --n 2 --json")
    assert (done.numbers["report"], done.files) == ("", ())


def test_a_file_is_no_folder_for_a_laboratory(tmp_path):
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    with pytest.raises(BadInput, match=r"out needs a folder, and .* is a file"):
        up.lab(out=tmp_path / "out")


def test_the_former_name_of_a_faulty_encoder_means_the_same_and_warns():
    with pytest.warns(DeprecationWarning, match="fault="), pytest.raises(up.BadInput, match=r"got '-100\.1'"):
        up.swing_up(lie={"theta": -100.1})


def test_the_former_name_of_a_twin_to_weigh_means_the_same_and_warns():
    with pytest.warns(DeprecationWarning, match="rig="), pytest.raises(up.BadInput, match="got 'pendulum'"):
        up.loadings(twin="pendulum")


def test_the_former_name_of_nonideal_rigs_means_the_same_and_warns():
    with (
        pytest.warns(DeprecationWarning, match="nonideal="),
        pytest.raises(up.BadInput, match="on hardware there is one"),
    ):
        up.lab(rig="nowhere.toml", worn=True)
