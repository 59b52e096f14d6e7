"""Is what is asked of a loop within what a loop can be, on a rig as on plain matrices?"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

import upright as up
from upright.designing.estimators import chosen, estimators
from upright.designing.run import MOST_STATES, DesignRequest, design_for
from upright.errors import BadInput
from upright.physics import find
from upright.systems import StateSpace

T = 0.01
ARM = up.Rig.known(
    up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4), gain="0.65 N m/V", limit="10 V", period="2 ms",
    counts=4096,
)  # fmt: skip
TWO = np.kron(np.eye(2), [[0.0, 1.0], [0.0, 0.0]])


def carts(**changes):
    """Two bodies that nothing holds, their places measured, each followed by its velocity."""
    matrices = {"A": TWO, "B": [[0.0], [1.0], [0.0], [2.0]], "C": np.kron(np.eye(2), [[1.0, 0.0]])}
    return StateSpace(**{**matrices, **changes})


@pytest.mark.parametrize("period", [1e-6, 1e-3, 10.0])
def test_a_period_that_a_computer_keeps_is_taken(period):
    assert DesignRequest(at="", period=period).period == period


@pytest.mark.parametrize("period", [0.0, 0.99e-6, 10.1, -1e-3, math.nan, math.inf])
def test_a_period_that_none_keeps_is_refused(period):
    with pytest.raises(BadInput, match="every 1e-6 to 10 s"):
        DesignRequest(at="", period=period)


@pytest.mark.parametrize("limit", [0.0, -1.0, 1e9, math.nan, math.inf])
def test_a_limit_that_no_drive_has_is_refused(limit):
    assert DesignRequest(at="", limit=0.99e9).limit == 0.99e9
    assert DesignRequest(at="").limit is None
    with pytest.raises(BadInput, match="above 0 and below 1e9"):
        DesignRequest(at="", limit=limit)


@pytest.mark.parametrize(
    ("model", "ways"),
    [
        (carts(), ("filtered", "plain", "observer")),
        (carts(C=np.eye(4)), ("measured", "observer")),
        (carts(C=[[1.0, 0.0, 0.0, 0.0]]), ("observer",)),  # one place of two
        (carts(C=np.kron(np.eye(2), [[0.0, 1.0]])), ("observer",)),  # velocities
        (carts(C=np.kron(np.eye(2), [[2.0, 0.0]])), ("observer",)),  # half as large a unit
        (carts(B=[[1.0], [1.0], [0.0], [2.0]]), ("observer",)),  # a command that moves a place at once
        (carts(A=TWO + np.diag([0.1, 0.0, 0.0, 0.0])), ("observer",)),  # no velocity
        (carts(D=[[1.0], [0.0]]), ("observer",)),  # a command that is read
        (carts(C=np.eye(4), D=[[1.0], [0.0], [0.0], [0.0]]), ("observer",)),
        (carts(dt=T), ("observer",)),  # samples have no velocities
        (carts(C=np.eye(4), dt=T), ("measured", "observer")),
    ],
)
def test_states_are_had_in_the_ways_that_outputs_allow(model, ways):
    assert estimators(model) == ways
    assert chosen(model, "") == ways[0]
    for way in ways:
        assert chosen(model, way) == way
    for way, why in (
        ("measured", "not every state can be read off"), ("filtered", "its outputs are not positions"),
        ("plain", "its outputs are not positions"), ("kalman", "do not say how good readings are"),
        ("obsever", "did you mean"),
    ):  # fmt: skip
        if way not in ways:
            with pytest.raises(BadInput, match=why) as caught:
                chosen(model, way)
            assert str(caught.value).endswith(f"it takes {' or '.join(ways)}.")


@pytest.mark.parametrize(
    ("C", "speed", "count"),
    [([[1.0, 0.0]], "", 2), ([[1.0, 0.0]], "plain", 2), ([[1.0, 0.0]], "observer", 3), (np.eye(2), "", 1)],
)  # fmt: skip
def test_beside_the_way_that_was_asked_for_stand_those_without_an_observer(C, speed, count):
    model = StateSpace(A=[[0.0, 1.0], [-3.0, 0.0]], B=[[0.0], [1.0]], C=C)
    done = design_for(model, DesignRequest(at="", poles=(-4.0, -5.0), period=1e-3, speed=speed))
    names = [w.name for w in done.ways]
    assert len(set(names)) == len(names) == count
    assert names[0] == done.chosen.name  # the one asked for comes first


def test_a_model_that_answers_at_once_needs_a_command_that_comes_late():
    """y = x + u: a reading that holds the command computed from it is no loop that a computer closes."""
    model = StateSpace(A=[[-1.0]], B=[[1.0]], C=[[1.0]], D=[[0.5]])
    asked = {"at": "", "poles": (-3.0,), "period": T, "speed": ""}
    with pytest.raises(BadInput, match="--delay 1"):
        design_for(model, DesignRequest(**asked, delay=0.0))
    assert design_for(model, DesignRequest(**asked)).sampled.delay == 1.0
    plain = StateSpace(A=[[-1.0]], B=[[1.0]], C=[[1.0]])
    assert design_for(plain, DesignRequest(**asked, delay=0.0)).sampled.delay == 0.0


def test_matrices_of_samples_hold_their_delay_and_others_are_a_sample_late():
    asked = {"at": "", "poles": (-3.0, -4.0), "period": T, "speed": ""}
    moving, force = np.array([[0.0, 1.0], [0.0, 0.0]]), [[0.0], [1.0]]
    assert design_for(StateSpace(A=moving, B=force), DesignRequest(**asked)).sampled.delay == 1.0
    held = StateSpace(A=np.eye(2) + T * moving, B=[[T * T / 2], [T]], dt=T)
    assert design_for(held, DesignRequest(**asked)).sampled.delay == 0.0
    # a command on its way is a state like any other: its pole is asked for too
    late = StateSpace(A=moving, B=force).to_sampled(T, 1.0)
    done = design_for(late, DesignRequest(**(asked | {"poles": (-3.0, -4.0, -5.0)})))
    assert done.K.shape == (1, 3)
    assert (done.model.delay, done.model.lag, done.model.continuous) == (0.0, 0.0, None)
    z = np.linalg.eigvals(late.A - late.B @ done.K)
    assert np.sort(np.log(z.astype(complex)).real / T) == pytest.approx([-5.0, -4.0, -3.0], rel=1e-6)


def test_as_many_states_as_anyone_waits_for_are_designed_for():
    with pytest.raises(BadInput, match=f"1 to {MOST_STATES} states, an input and an output, got {MOST_STATES + 1}"):
        design_for(StateSpace(A=-np.eye(31), B=np.ones((31, 1))), DesignRequest(at="", poles=(-1.0,)))
    with pytest.raises(BadInput, match="is for one input, and this model has 2"):  # not too many states
        design_for(StateSpace(A=-np.eye(30), B=np.eye(30)[:, :2]), DesignRequest(at="", poles=(-1.0,)))


@pytest.mark.parametrize(
    ("rig", "start"),
    [
        (ARM, [0.0, 0.0, math.radians(5), 0.0]),
        (up.Rig.known(find("rectilinear-2")(m_1=1.0, m_2=2.0, k_12=400.0), gain="5 N/V", counts=4096, period="2 ms"),
         [0.0, 0.0, 0.05, 0.0]),
        (up.Rig.known(find("rectilinear-1")(m_1=1.0, k_1=40.0), gain="5 N/V", counts=4096, period="2 ms"), [0.05, 0.0]),
        (carts(A=TWO - np.kron(np.diag([3.0, 40.0]), [[0.0, 0.0], [1.0, 0.0]])), [1.0, 0.0, 0.0, 0.0]),
    ],
)  # fmt: skip
def test_without_a_start_the_last_body_is_off_by_five_degrees_or_centimetres_and_a_first_state_by_one(rig, start):
    poles = (-4.0, -5.0, -6.0, -7.0)[: len(start)]
    at = "" if isinstance(rig, StateSpace) else list(rig.plant.equilibria)[-1]
    done = design_for(rig, DesignRequest(at=at, poles=poles, period=1e-3))
    t, y, u = done.swing
    assert t[0] == 0.0
    assert y[0] == pytest.approx(np.array(start)[::2], abs=1e-15)
    assert u[0] == pytest.approx(-done.continuous @ start)
    assert done.peak == pytest.approx(np.abs(u).max())


@pytest.mark.parametrize("track", ["psi", None])
def test_a_law_that_tracks_comes_to_its_reference_and_another_has_none(track):
    """psi upright has a pole at 0: u = 0 at rest, so k_pf times the reference is the gain of psi times psi."""
    done = design_for(ARM, DesignRequest(at="inverted", poles=(-4.0, -5.0, -16.0, -3.0), period=2e-3, track=track))
    assert (done.k_pf is None) == (not track)
    if track:
        assert done.k_pf == pytest.approx(done.K[0, 0], rel=1e-6)
    assert done.law.D[0, -1] == pytest.approx(done.K[0, 0] if track else 0.0, rel=1e-6)
    assert done.law.target == pytest.approx([0.0, math.pi])
    with pytest.raises(BadInput, match="nothing called 'phi' is measured; --track one of psi, theta"):
        design_for(ARM, DesignRequest(at="inverted", poles=(-4.0, -5.0, -16.0, -3.0), track="phi"))


def test_gains_of_samples_meet_the_poles_of_least_cost_in_the_loop_as_it_runs():
    """Those of the continuous loop by scipy's Riccati equation, among the poles of the sampled one."""
    model = ARM.linear("inverted")
    S = solve_continuous_are(model.A, model.B, np.diag([1.0, 0.0, 10.0, 0.0]), [[0.05]])
    wanted = np.linalg.eigvals(model.A - model.B @ (model.B.T @ S / 0.05))
    asked = DesignRequest(
        at="inverted", weights=(1.0, 0.0, 10.0, 0.0), R=0.05, period=2e-3, speed="plain", sampled=True
    )
    done = design_for(ARM, asked)
    for pole in wanted:
        assert np.abs(done.poles - pole).min() < 1e-5 * abs(pole)
        assert np.abs(done.wanted - pole).min() < 1e-6 * abs(pole)
