"""Does `upright design --matrices` give what python-control and scipy make of the same matrices?"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from typer.testing import CliRunner

import upright as up
from tests.gains.furuta import RIG, STUDY
from upright.cli import app

control = pytest.importorskip("control")

A, B, C = [[0.0, 1.0], [20.0, -0.1]], [[0.0], [3.0]], [[1.0, 0.0]]
POLES = [-4 + 2j, -4 - 2j]
T = 0.01


def design(*arguments: object):
    return CliRunner().invoke(app, ["design", *map(str, arguments)], terminal_width=200)


def written(folder: Path, text: str = "", **matrices: object) -> Path:
    path = folder / "model.toml"
    keys = "".join(f"{n} = {np.asarray(m).tolist()}\n" for n, m in matrices.items())
    path.write_text(keys + text, encoding="utf-8")
    return path


def numbers(folder: Path, *arguments: object) -> dict:
    outcome = design("--matrices", *arguments, "-o", folder)
    assert outcome.exit_code == 0, outcome.stderr
    return json.loads((folder / "design.json").read_text(encoding="utf-8"))


def complex_of(pairs) -> np.ndarray:
    return np.array([complex(*p) for p in pairs])


def sampled(a=A, b=B, period: float = T) -> tuple[np.ndarray, np.ndarray]:
    block = expm(np.block([[np.array(a), np.array(b)], [np.zeros((1, len(a) + 1))]]) * period)
    return block[: len(a), : len(a)], block[: len(a), len(a) :]


def nearest_to(wanted, found) -> float:
    return max(float(np.abs(np.asarray(found) - w).min()) for w in np.atleast_1d(wanted))


def test_placed_gains_are_python_controls(tmp_path):
    found = numbers(tmp_path, written(tmp_path, A=A, B=B, C=C), "--poles", "-4+-2j", "--period", "10 ms")
    np.testing.assert_allclose([found["K"]], control.place(A, B, POLES), rtol=1e-9)


def test_gains_of_least_cost_are_python_controls(tmp_path):
    options = ("--lqr", "10,1", "--effort-weight", 0.5)
    found = numbers(tmp_path, written(tmp_path, A=A, B=B), *options, "--period", "10 ms")
    np.testing.assert_allclose([found["K"]], control.lqr(A, B, np.diag([10, 1]), [[0.5]])[0], rtol=1e-9)


def test_sampled_matrices_are_designed_for_as_they_are(tmp_path):
    a, b = sampled()
    path = written(tmp_path, 'dt = "10 ms"\n', A=a, B=b)
    placed = numbers(tmp_path, path, "--poles", "-4+-2j")
    np.testing.assert_allclose([placed["K"]], control.place(a, b, np.exp(T * np.array(POLES))), rtol=1e-8)
    least = numbers(tmp_path, path, "--lqr", "10,1", "--effort-weight", 0.5)
    np.testing.assert_allclose([least["K"]], control.dlqr(a, b, np.diag([10, 1]), [[0.5]])[0], rtol=1e-9)
    assert placed["period"] == least["period"] == T
    assert placed["delay_samples"] == 0


def test_margins_of_sampled_matrices_are_python_controls(tmp_path):
    """Every state read at the sample: the loop gain is K (z - A)^-1 B; python-control leaves out z = -1."""
    a, b = sampled(period=0.05)
    found = numbers(tmp_path, written(tmp_path, "dt = 0.05\n", A=a, B=b), "--poles", "-4+-2j")
    loop = control.ss(a, b, [found["K"]], 0, 0.05)
    gains, phases = control.stability_margins(loop, returnall=True)[:2]
    told = found["margins"]
    assert told["phase"] == pytest.approx(math.radians(np.abs(phases).min()), rel=1e-6)
    assert told["least_gain"] == pytest.approx(gains[gains < 1].max(), rel=1e-6)
    z = np.exp(1j * np.linspace(1e-4, math.pi, 200_001))
    first, last = np.array(found["K"]) @ b, np.array(found["K"]) @ (a @ b - np.trace(a) * b)
    L = (first * z + last) / (z**2 - np.trace(a) * z + np.linalg.det(a))  # Cayley and Hamilton
    assert told["modulus"] == pytest.approx(np.abs(1 + L).min(), rel=1e-6)
    assert told["most_gain"] == pytest.approx(-1 / L[-1].real, rel=1e-6)


@pytest.mark.parametrize("through", [0.0, 0.05])
@pytest.mark.parametrize("delay", [1, 2])
def test_the_sampled_law_holds_the_model_with_its_observer(tmp_path, delay, through):
    """The loop by hand, command late in a shift register; observer poles stay where placed, by separation.

    With the extra delay told, in whole samples, it stands at the last below and falls at the first above.
    """
    path = written(tmp_path, A=A, B=B, C=C, D=[[through]])
    found = numbers(tmp_path, path, "--poles", "-4+-2j", "--period", "10 ms", "--speed", "observer", "--delay", delay)
    law = {name: np.array(found["law"][name]) for name in "ABCD"}
    a, b = sampled()

    def poles(samples: int) -> np.ndarray:
        n = 2 + samples
        plant, inlet, row = np.eye(n, k=-1), np.zeros((n, 1)), np.zeros((1, n))
        plant[2] = plant[:2] = 0.0
        plant[:2, :2], plant[:2, n - 1 :], inlet[2] = a, b, 1.0
        row[0, 0], row[0, n - 1] = 1.0, through
        top = np.hstack([plant + inlet @ law["D"][:, :1] @ row, inlet @ law["C"]])
        return np.linalg.eigvals(np.vstack([top, np.hstack([law["B"][:, :1] @ row, law["A"]])]))

    z = poles(delay)
    assert np.abs(z).max() < 1
    assert nearest_to(np.exp(3 * T * np.array(POLES)), z) < 1e-6
    slow = complex_of(found["poles"]["sampled_loop"])
    assert nearest_to(np.exp(T * slow[slow.real > -100]), z) < 1e-6
    more = found["margins"]["delay"] / T
    assert np.abs(poles(delay + math.floor(more))).max() < 1
    assert np.abs(poles(delay + math.ceil(more))).max() > 1


def test_an_observer_bridges_dead_time_within_the_matrices(tmp_path):
    """A command two samples late as states of the matrices: what dies out at once cannot be undone."""
    a, b = sampled()
    late = np.zeros((4, 4))
    late[:2, :2], late[:2, 3:], late[3, 2] = a, b, 1.0
    path = written(tmp_path, f"dt = {T}\n", A=late, B=[[0], [0], [1], [0]], C=[[1, 0, 0, 0]])
    found = numbers(tmp_path, path, "--poles", "-4+-2j, -60, -80")
    z = np.exp(T * complex_of(found["poles"]["sampled_loop"]))
    wanted = np.exp(T * np.array([*POLES, -60, -80]))
    assert nearest_to(np.concatenate([wanted, wanted**3]), z) < 1e-6


def test_a_rig_s_own_matrices_lead_to_its_design(tmp_path):
    model = RIG.linear("inverted")
    study = tmp_path / "rig.toml"
    study.write_text(STUDY, encoding="utf-8")
    wish = {"poles": "-4.1484+-1.6341j, -16.8545, -3.222"}
    rig, plain = up.design(study, **wish), up.design(model, period=1e-3, **wish)
    system = up.design(model.to_control(), period="1 ms", **wish)
    for name in ("K", "K_sampled"):
        np.testing.assert_allclose(plain.numbers[name], rig.numbers[name], rtol=1e-9)
        np.testing.assert_allclose(system.numbers[name], rig.numbers[name], rtol=1e-9)
    assert plain.chosen.margins.phase == pytest.approx(rig.chosen.margins.phase, rel=1e-9)
    assert plain.chosen.margins.delay == pytest.approx(rig.chosen.margins.delay, rel=1e-9)


def test_names_and_units_are_those_of_the_file(tmp_path):
    text = 'states = ["phi", "omega"]\noutputs = ["angle"]\ninputs = ["volts"]\n[units]\nphi = "deg"\nomega = "deg/s"\n'
    text += 'angle = "deg"\nvolts = "V"\n'
    path = written(tmp_path, text, A=A, B=B, C=C)
    outcome = design("--matrices", path, "--poles", "-4+-2j", "--period", "10 ms", "--start", "phi=0.1 rad",
                     "--limit", 1000, "--track", "angle", "-o", tmp_path)  # fmt: skip
    assert outcome.exit_code == 0, outcome.stderr
    told = " ".join(outcome.stdout.split())
    assert "V/deg" in told
    assert "Plain matrices say nothing of a rig: dry friction, steps of encoders" in told
    found = json.loads((tmp_path / "design.json").read_text(encoding="utf-8"))
    # K x at the start, in V: the command falls from there, as the slowest poles are well damped
    assert found["peak_command"] == pytest.approx(math.degrees(0.1) * found["K"][0], rel=1e-6)
    # in rest at r: 0 = 20 r + 3 u and u = k_pf r - K_1 r
    assert found["k_pf"] == pytest.approx(found["K"][0] - 20 / 3, rel=1e-9)


HOSTILE = [
    ("B = [[1]]", "has no A"),
    ("A = [[1]]", "has no B"),
    ("A = [[0, 1], [2]]\nB = [0, 1]", "line 1: A is a list of rows of the same length"),
    ("A = [[0, 1], [2, nan]]\nB = [0, 1]", "A holds finite numbers, got nan in row 2, column 2"),
    ("A = [[0, 1], [2, 3]]\nB = [0, inf]", "line 2: B holds finite numbers"),
    ('A = [[0, 1], [2, "3"]]\nB = [0, 1]', "A holds finite numbers, got '3'"),
    ("A = [[0, 1], [2, true]]\nB = [0, 1]", "A holds finite numbers, got True"),
    ("A = [[0, 1], [2, [3]]]\nB = [0, 1]", "A holds finite numbers"),
    ("A = [[0, 1], 2]\nB = [0, 1]", "row 2 is 2"),
    ("A = []\nB = []", "A is empty"),
    ("A = 'cat'\nB = [1]", "A holds finite numbers, got 'cat'"),
    ("A = [[0, 1, 2], [2, 3, 4]]\nB = [0, 1]", "A of shape (n, n)"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1, 2]", "B of shape (n, m), got (2, 2) and (3, 1)"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1]\nC = [[1, 0, 0]]", "C of shape (p, 2)"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1]\nC = [[1, 0]]\nD = [[1, 2]]", "D of shape (1, 1)"),
    ("A = [[0, 1], [2, 3]]\nB = [[0, 1], [1, 0]]", "one input"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1]\ndt = -1", "a loop is closed every"),
    ('A = [[0, 1], [2, 3]]\nB = [0, 1]\ndt = "3 kg"', "line 3"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1]\nE = 3", "matrices come with no 'E'"),
    ('A = [[0, 1], [2, 3]]\nB = [0, 1]\nstates = ["a"]', "states needs 2 different names"),
    ('A = [[0, 1], [2, 3]]\nB = [0, 1]\nstates = ["a", "a"]', "states needs 2 different names"),
    ('A = [[0, 1], [2, 3]]\nB = [0, 1]\n[units]\nphi = "rad"', "got 'phi'"),
    ('A = [[0, 1], [2, 3]]\nB = [0, 1]\nstates = ["a", "b"]\n[units]\na = "parrot"', "line 5"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 0]", "cannot move the pole"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1]\nC = [[0, 0]]", "the outputs do not show the mode"),
    ("A = [[0, 1], [2, 3]]\nB = [0, 1]\nC = [[1, 0]]\nD = [[1]]\ndt = 0.01", "--delay 1"),
    ("A = [[0, 1", "this is not TOML"),
    ("[rig]\nplant = 'furuta'", "matrices come with no 'rig'"),
]


@pytest.mark.parametrize(("text", "words"), HOSTILE)
def test_files_that_hold_no_model_are_told_in_a_sentence(tmp_path, text, words):
    path = tmp_path / "model.toml"
    path.write_text(text, encoding="utf-8")
    period = () if "dt" in text else ("--period", "10 ms")
    outcome = design("--matrices", path, "--poles", "-2, -3", *period, "-o", tmp_path)
    assert outcome.exit_code == 2, outcome.stdout
    assert words in " ".join(outcome.stderr.split())


@pytest.mark.parametrize(
    ("text", "arguments", "words"),
    [
        ("", (), "--period"),
        ("", ("--period", "10 ms", "--counts", "4096"), "plain matrices are none"),
        ("", ("--period", "10 ms", "--vendor", "ECP 205"), "plain matrices are none"),
        ("", ("--period", "10 ms", "--speed", "kalman"), "do not say how good readings are"),
        ("", ("--period", "10 ms", "--speed", "measured"), "not every state can be read off"),
        ("", ("--period", "10 ms", "--speed", "observer", "--sampled"), "--sampled is for states"),
        ("", ("--period", "10 ms", "--track", "x[0]"), "--track one of y[0]"),
        ("", ("--period", "10 ms", "--start", "y=1"), "--start names states"),
        ("dt = 0.02", ("--period", "10 ms"), "sampled every 20 ms"),
        ("dt = 0.02", ("--lag", "10 ms"), "takes no lag"),
        ("dt = 0.02", ("--delay", "0.5"), "whole samples"),
    ],
)
def test_what_plain_matrices_cannot_have_is_said_in_a_sentence(tmp_path, text, arguments, words):
    path = written(tmp_path, text, A=A, B=B, C=C)
    outcome = design("--matrices", path, "--poles", "-4+-2j", *arguments, "-o", tmp_path)
    assert outcome.exit_code == 2, outcome.stdout
    assert words in " ".join(outcome.stderr.split())


def test_one_model_is_asked_for(tmp_path):
    for given in ((), (tmp_path / "fit.json", "--matrices", tmp_path / "model.toml")):
        outcome = design(*given, "--poles", "-1")
        assert outcome.exit_code == 2
        assert "give one" in outcome.stderr


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (control.frd([1], [1]), "FrequencyResponseData"),
        (control.ss([[0.5]], [[1]], [[1]], 0, True), "does not say its period"),
        (control.ss([], [], [], 3), "1 to 30 states"),
        (([[math.nan]], [[1]]), "finite"),
        (3, "got int"),
    ],
)
def test_what_is_no_model_to_design_for_is_told(model, words):
    with pytest.raises(up.BadInput, match=words):
        up.design(model, poles=[-1], period=0.01)
