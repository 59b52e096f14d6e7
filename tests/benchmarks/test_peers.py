"""Are peers and upright given the same rig? A swing of small amplitude has a closed form that each can be held to."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import upright as up
from benchmarks import measure, peers
from benchmarks.peers import black_boxes, leads, ours, qube_fits, qube_starts
from benchmarks.peers.task import Samples, Task, fit_percent, study_text

M_P, L_CG, G = 0.2, 0.25, 9.81
J_P, B_2 = 2e-3, 4e-3
J_A = J_P + M_P * L_CG**2
DECAY = B_2 / (2 * J_A)
OMEGA = math.sqrt(M_P * G * L_CG / J_A - DECAY**2)


def swing(seconds: float) -> Samples:
    """theta = 0.02 exp(-b_2 t/(2 J_A)) cos(omega t), sin(theta) = theta to 7e-5."""
    t = np.arange(round(100 * seconds)) * 0.01
    y = 0.02 * np.exp(-DECAY * t) * np.cos(OMEGA * t)
    return Samples(t=t, u=np.zeros(t.size), y=y[:, None])


TASK = Task(
    name="swing", plant="pendulum", known={"m_p": M_P, "l_cg": L_CG, "g": G}, guesses={"J_p": 3e-3, "b_2": 2e-3},
    fitted=swing(8.0), held_out={"longer": swing(12.0)},
)  # fmt: skip


def test_a_study_asks_what_the_task_asks():
    study = tomllib.loads(study_text(TASK))
    assert study["parameters"]["m_p"] == "0.2 kg"
    assert {n for n, v in study["parameters"].items() if isinstance(v, dict)} == set(TASK.guesses)
    assert [run.get("role") for run in study["runs"]] == [None, "predict"]


def test_upright_finds_inertia_and_friction_of_a_small_swing():
    said = ours.answer(TASK)
    # a swing of 0.02 rad is slower than a linear one by 0.02^2/16 = 2.5e-5, J_A by twice that: J_p is 0.14 of J_A
    assert said.values["J_p"] == pytest.approx(J_P, rel=1e-3)
    assert said.values["b_2"] == pytest.approx(B_2, rel=1e-3)
    assert fit_percent(TASK.held_out["longer"], said.predicted["longer"])[0] > 99.9


def test_opty_estimates_inertia_and_friction_and_gives_no_intervals():
    pytest.importorskip("opty")
    from benchmarks.peers import with_opty

    said = with_opty.answer(replace(TASK, guesses={**TASK.guesses, "b_2c": 1e-6, "b_2q": 1e-6}))
    # the midpoint rule in steps of h slows a swing by (omega h)^2/12 = 3e-4, J_A by twice that: J_p is 0.14 of J_A
    assert said.values["J_p"] == pytest.approx(J_P, rel=6e-3)
    assert said.values["b_2"] == pytest.approx(B_2, rel=2e-3)
    assert fit_percent(TASK.held_out["longer"], said.predicted["longer"])[0] > 99.0
    assert not said.intervals


def test_arx_continues_a_damped_sine(monkeypatch):
    """Two past samples tell the next one exactly."""
    monkeypatch.setattr(black_boxes, "DECIMATIONS", (1,))
    said = black_boxes.arx(TASK)
    assert fit_percent(TASK.held_out["longer"], said.predicted["longer"])[0] > 99.99


def test_fit_percent_of_the_mean_is_zero():
    run = swing(2.0)
    assert fit_percent(run, run.y) == [100.0]
    assert fit_percent(run, np.full_like(run.y, run.y.mean())) == [pytest.approx(0.0, abs=1e-9)]


def test_the_qube_of_the_peers_moves_as_the_plant_of_upright_does():
    """Ahead of every start by the equations written out, and by those derived from the energies."""
    p = {"l_cg": 0.0645, "J_p": 3.3e-5, "J_d": 6e-5, "b_1": 2.1e-4, "b_1c": 0.0, "k_psi": 1e-3}
    m_p, r, g, gain, dt = 0.024, 0.085, 9.81, 5e-3, 2e-3
    t = dt * np.arange(400)
    u = 2 * np.sin(9 * t) + np.sin(23 * t)
    arm = up.Furuta(m_p=m_p, r=r, g=g, **p)
    motion = up.simulate(arm, u=np.append(gain * u, 0.0), seconds=400 * dt, dt=dt, start={"theta": "170 deg"})
    names = ("psi", "theta", "psi_dot", "theta_dot")
    states = motion.to_pandas()[list(names)].to_numpy()[:400]
    run = qube_fits.Episode(u=u, y=states[:, :2], states=states, dt=dt)
    first = run.starts(50)
    y = qube_fits.ahead(np.array([*p.values(), 0.0]), np.array([m_p, r, g, gain]), np.zeros(2), run, first, 50)
    assert y == pytest.approx(run.y[first[:, None] + 1 + np.arange(50)], abs=1e-5)


@pytest.mark.parametrize("step", [1, 5])
def test_arx_predicts_a_linear_plant_ahead_exactly(step):
    """A discrete oscillator that is driven by a command held for as long as ARX looks at once."""
    g = np.random.default_rng(1)
    u = np.repeat(g.normal(size=400), 5)
    y = np.zeros((2000, 2))
    for k in range(2, 2000):
        y[k] = [1.9, 1.8] * y[k - 1] - [0.97, 0.9] * y[k - 2] + [0.1, 0.05] * u[k - 1 : k]
    y, u = y - y[:1000].mean(axis=0), u - u[:1000].mean()
    y, u = y[::step], u[::step]
    run = qube_fits.Episode(u=u, y=y, states=np.zeros((y.shape[0], 4)), dt=0.01)
    predicted = qube_fits.arx([run], 4, 1)(run, 0.2)
    at = run.starts(20) + 20
    assert predicted == pytest.approx(run.y[at], abs=1e-6 * float(np.abs(y).max()))


def test_the_carts_of_the_peers_move_as_the_plant_of_upright_does():
    pytest.importorskip("numba")
    from benchmarks.peers import carts

    p = {"m_1": 0.17, "m_2": 0.15, "k_1": 40.0, "k_12": 36.0, "c_1": 0.3, "c_2": 0.2}
    u = np.where(np.arange(600) < 300, 0.6, 0.0)
    motion = up.simulate(up.chain(2)(**p), u=np.append(u, 0.0), seconds=1.2, dt=2e-3)
    y = carts.moved(np.array([*p.values(), 0.0, 0.0, 0.0, 0.05]), np.zeros(2), u, 2e-3)
    assert motion.to_pandas()[["x_1", "x_2"]].to_numpy()[:600] == pytest.approx(y, abs=1e-6)


def test_output_error_finds_a_linear_plant_exactly():
    """Two outputs of fourth order with common poles, free of noise."""
    pytest.importorskip("numba")
    from benchmarks.peers import carts

    poles = np.poly([0.9 + 0.3j, 0.9 - 0.3j, 0.8 + 0.1j, 0.8 - 0.1j])[1:]
    x = np.concatenate([poles, [0.0, 0.2, 0.1, 0.0], [0.0, 0.0, 0.1, 0.1]])
    u = [np.repeat(np.random.default_rng(seed).normal(size=60), 10) for seed in range(3)]
    first, second, third = (carts.Run(u=v, y=carts._linear(x, v), dt=0.01) for v in u)
    predicted = carts.linear([first, second], output_error=True)(third)
    assert min(carts.percent(third, predicted)) > 99.99


def test_nodes_between_samples_lie_on_the_swing():
    fine = leads.finer(TASK, 4).fitted
    assert fine.y[::4] == pytest.approx(TASK.fitted.y, abs=1e-12)
    exact = 0.02 * np.exp(-DECAY * fine.t) * np.cos(OMEGA * fine.t)
    # a cubic spline errs by (omega h)^4/384 inside, and by some ten times as much in its first piece
    assert fine.y[:, 0] == pytest.approx(exact, abs=0.02 * 10 * (6 * 0.01) ** 4 / 384)


def test_numbers_of_a_small_swing_explain_it_in_the_simulation_of_upright():
    percents = leads.simulated(TASK, {"J_p": J_P, "b_2": B_2})
    assert min(min(p) for p in percents.values()) > 99.9
    wrong = leads.simulated(TASK, {"J_p": 1.5 * J_P, "b_2": B_2})
    assert max(max(p) for p in wrong.values()) < 95


def test_the_qube_twin_stays_upright_and_is_read_in_counts():
    p = np.array([0.0645, 3.3e-5, 1e-4, 2.1e-4, 1e-4, 1e-3, 1.3e-3])
    known = np.array([0.024, 0.085, 9.81, 5e-3])
    first, second = qube_starts.balanced(p, known, range(2), 1000, 2e-3)
    for run in (first, second):
        assert np.abs(run.y[:, 1] - np.pi).max() < 0.3
        counts = run.y * 2048 / (2 * np.pi)
        assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.abs(first.u - second.u).max() > 0.5


@pytest.mark.parametrize("name", peers.SECTIONS)
def test_a_section_put_in_its_own_place_leaves_the_page_as_it_is(name):
    text = (Path(measure.__file__).parent / "peers.md").read_text(encoding="utf-8")
    section = text.split(f"\n## {peers.SECTIONS[name]}\n\n")[1].split("\n\n## ")[0]
    assert peers.renewed(text, name, section.split("\n")) == text
