"""Is a linear model that MATLAB's format holds the one that was saved? SciPy and Octave write the files."""

from __future__ import annotations

import shutil
import subprocess

import numpy as np
import pytest
from scipy.io import savemat

import upright as up

A, B = np.array([[0.0, 1.0], [20.0, -0.1]]), np.array([[0.0], [3.0]])
C, D = np.array([[1.0, 0.0]]), np.array([[0.0]])


def saved(path, **content):
    savemat(path, content)
    return path


def test_matrices_of_ssdata_are_a_continuous_model(tmp_path):
    model = up.from_matlab(saved(tmp_path / "m.mat", A=A, B=B, C=C, D=D, Ts=0.0))
    assert model.dt is None
    for name, wanted in zip("ABCD", (A, B, C, D), strict=True):
        np.testing.assert_array_equal(getattr(model, name), wanted)
    # s^2 + 0.1 s - 20 = 0
    np.testing.assert_allclose(sorted(model.poles().real), [-0.05 - np.sqrt(20.0025), -0.05 + np.sqrt(20.0025)])


def test_matrices_without_a_period_are_a_continuous_model_whose_outputs_are_its_states(tmp_path):
    model = up.from_matlab(saved(tmp_path / "m.mat", A=A, B=B))
    assert model.dt is None
    np.testing.assert_array_equal(model.C, np.eye(2))


def test_a_structure_keeps_period_and_names(tmp_path):
    fields = {"A": A, "B": B, "C": C, "D": D, "Ts": 2e-3, "StateName": np.array(["theta", "theta_dot"], dtype=object)}
    rig, notes = fields | {"InputName": np.array(["v"], dtype=object)}, {"by": "somebody", "D": D}
    path = saved(tmp_path / "m.mat", rig=rig, other=1.0, notes=notes)
    model = up.from_matlab(path)
    assert model.dt == 2e-3
    assert tuple(model.states) == ("theta", "theta_dot")
    assert tuple(model.inputs) == ("v",)
    np.testing.assert_array_equal(up.from_matlab(path, "rig").A, A)


@pytest.mark.parametrize(
    ("content", "name", "words"),
    [
        ({"x": A}, "", r"holds no matrix A and no matrix B; in MATLAB: .*ssdata"),
        ({"A": A}, "", "holds no matrix B"),
        ({"one": {"A": A}, "two": {"A": A}}, "", "several models; give the name of one: one, two"),
        ({"one": {"A": A, "B": B}}, "on", "no structure 'on' .* did you mean 'one'"),
        ({"A": A, "B": np.ones((3, 1))}, "", "B"),
    ],
)
def test_what_is_no_model_is_a_sentence(tmp_path, content, name, words):
    with pytest.raises(up.BadInput, match=words):
        up.from_matlab(saved(tmp_path / "m.mat", **content), name)


@pytest.mark.skipif(not shutil.which("octave-cli"), reason="octave-cli is missing")
def test_a_file_that_octave_saved_is_read(tmp_path):
    code = "m = struct('A', [0 1; 20 -0.1], 'B', [0; 3], 'C', [1 0], 'D', 0, 'Ts', 0.002); save('-v7', 'm.mat', 'm')"
    subprocess.run(["octave-cli", "--eval", code], cwd=tmp_path, check=True, capture_output=True)
    model = up.from_matlab(tmp_path / "m.mat")
    np.testing.assert_array_equal(model.A, A)
    np.testing.assert_array_equal(model.B, B)
    assert model.dt == 0.002
