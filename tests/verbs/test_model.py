"""Do the verbs of a model give back numbers that are known, and say what cannot be used?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from upright import frequency, ladder, loadings, plan_inertias, predict
from upright.errors import BadInput
from upright.records import Record
from upright.verbs.model.frequency import _known


def swinging(k: float, m: float, decay: float = 0.4) -> Record:
    """A cart on a spring, pulled aside and let go: the closed form of m x'' + 2 decay m x' + k x = 0."""
    t = np.arange(2500) * 2e-3
    omega = np.sqrt(k / m - decay**2)
    x = 0.02 * np.exp(-decay * t) * (np.cos(omega * t) + decay / omega * np.sin(omega * t))
    return Record(t=t, signals={"x": x}, units={"x": "m"}, outputs=("x",))


def test_stiffness_and_bare_mass_of_a_spring_come_back():
    added = (0.0, 0.5, 1.0)
    found = loadings([swinging(400.0, 0.8 + a) for a in added], added=[f"{a} kg" for a in added])
    # parabolas through the samples time a swing to some 1e-4 of its period
    assert found.k.value == pytest.approx(400.0, rel=2e-3)
    assert found.bare.value == pytest.approx(0.8, rel=5e-3)
    assert found.files == ()
    assert found.numbers["k"]["value"] == found.k.value


def test_a_loading_for_each_log_is_needed():
    with pytest.raises(BadInput, match="1 logs came with 0"):
        loadings(swinging(400.0, 0.8))
    with pytest.raises(BadInput, match="takes no logs"):
        loadings(swinging(400.0, 0.8), rig="rectilinear")


def test_a_plan_is_as_exact_as_a_straight_line_can_be():
    plans = plan_inertias(runs=4, error=0.002, tolerance=0.0, bare=0.8)
    plan = plans.value[4][0]
    # 1/omega^2 = (m + a)/k with relative errors 2*0.002: weighted least squares by hand
    a = np.repeat([w.added for w in plan.loadings], plan.runs) + 0.8
    design = np.column_stack([np.ones(a.size), a - 0.8]) / (0.004 * a[:, None])
    covariance = np.linalg.inv(design.T @ design)  # of (m, 1) in units of 1/k
    assert plan.k == pytest.approx(np.sqrt(covariance[1, 1]), rel=1e-3)
    assert plan_inertias(runs=4, error="0.2 %", tolerance="0 %", bare="800 g").numbers == plans.numbers


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: plan_inertias(rig="furuta"), "rig is"),
        (lambda: plan_inertias(radius=0.04), "radius is for disks"),
        (lambda: plan_inertias(runs=2, levels=3), "at least as many as levels"),
        (lambda: plan_inertias(runs=40), "from 2 to 16"),
        (lambda: plan_inertias(error=0.6), "between 0 and 50 %"),
        (lambda: frequency(ask="noise"), "sines, multisine, sweep"),
        (lambda: frequency(rig="furuta", known={"m_p": 0.1}), "belongs to a log"),
        (lambda: predict("fit.json", "study.toml"), "the model fit.json does not exist"),
        (lambda: ladder("study.toml"), "There is no study 'study.toml'; check the path. `upright init LOG"),
    ],
)
def test_what_cannot_be_used_is_said(tmp_path, monkeypatch, call, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BadInput, match=sentence):
        call()
    assert list(tmp_path.iterdir()) == []


MATRICES = ([[0.0, 1.0], [-4.0, -0.8]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])


def test_the_line_of_a_frequency_response_comes_back(tmp_path):
    """x'' + 0.8 x' + 4 x = u, asked by a sweep: G = 1/(4 - w^2 + 0.8 j w); what the start leaves dies within 5 s."""
    t = np.arange(20000) * 5e-3
    u = np.sin(np.cumsum(4.0 + 8.0 * t / t[-1]) * 5e-3)
    # exact for a command held between samples
    A, B, C, D, _ = cont2discrete(tuple(map(np.array, MATRICES)), 5e-3)
    y = dlsim((A, B, C, D, 5e-3), u)[1][:, 0]
    log = Record(t=t, signals={"u": u, "y": y}, units={"y": "m"}, inputs=("u",), outputs=("y",))
    log.to_csv(tmp_path / "sweep.csv")
    found = frequency(tmp_path / "sweep.csv", low=5.0, high=10.0, out=tmp_path / "out")
    response = found.response
    near = np.abs(response.omega - 7.0).argmin()
    w = response.omega[near]
    assert response.response[near, 0] == pytest.approx(1 / (4 - w**2 + 0.8j * w), rel=0.05)
    assert found.files == (tmp_path / "out" / "frequency.csv", tmp_path / "out" / "report.html")


@pytest.mark.parametrize(
    ("name", "said", "value", "error"),
    [
        ("J_d", "72 g m^2 +- 1 %", 0.072, 7.2e-4),  # in the unit of the plant's own
        ("m_p", "135 g", 0.135, 0.0),
        ("actuator.delay", "4 ms +- 1 ms", 4e-3, 1e-3),
        ("actuator.lag", "2 ms", 2e-3, 0.0),
        ("actuator.gain", "0.65 +- 2 %", 0.65, 0.013),
        ("J_d", 0.072, 0.072, 0.0),
        ("J_d", (0.072, 1e-3), 0.072, 1e-3),
    ],
)
def test_what_is_known_of_a_rig_is_taken_in_the_unit_of_its_kind(name, said, value, error):
    assert _known(name, said, "furuta") == pytest.approx((value, error))
    with pytest.raises(BadInput, match="name the rig with --rig too"):
        _known(name, said, "")
