"""Are the extremes of many motions those of the motions themselves?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.errors import BadInput
from upright.laws import state_feedback
from upright.physics import find
from upright.simulation import ensemble, simulate
from upright.simulation.simulate import block

CART = find("rectilinear-2")
DT, SAMPLES = 0.01, 300
LANES = {"m_1": np.linspace(1.0, 2.0, 5), "m_2": 1.0, "k_12": 300.0, "k_1": 50.0, "c_1": 2.0, "c_2": 0.5}
LANES |= dict.fromkeys(("k_2", "c_12", "a_1", "a_2"), 0.0)
LIMITED = LANES | {"actuator.limit": 3.0}
START = np.column_stack([np.linspace(-0.05, 0.1, 5), np.zeros(5), np.linspace(0.02, -0.04, 5), np.zeros(5)])
LAW = state_feedback([60.0, 12.0, 10.0, 0.0], DT, target=[0.02, -0.01])


@pytest.mark.parametrize("settle", [0.0, 1.0, 1.005])
def test_extremes_are_those_of_the_motions(settle):
    found = ensemble(CART, LIMITED, START, None, DT, samples=SAMPLES, substeps=2, loop=LAW, settle=settle, threads=1)
    x = simulate(CART, LIMITED, START, None, DT, samples=SAMPLES, substeps=2, loop=LAW)
    q, u = x[:, 0:4:2], x[:, 4:]
    # the motions are of one kernel, their sums are not
    assert found.largest == pytest.approx(np.abs(q).max(axis=0), rel=1e-9)
    first = int(np.ceil(settle / DT - 1e-9))
    away = np.abs(q - np.array([0.02, -0.01])[:, None])
    assert found.error == pytest.approx(away[first:].max(axis=0), rel=1e-9)
    assert found.saturated == pytest.approx((np.abs(u) >= 3.0).mean(axis=0), abs=1.5 / SAMPLES)
    assert found.saturated.max() > 0.05
    assert found.final == pytest.approx(x[-1, :4], rel=1e-9)


def test_without_a_law_an_error_is_a_distance_from_zero_and_lanes_begin_at_their_own_sample():
    u = np.sin(0.05 * np.arange(400))
    begin = np.array([0, 10, 20, 30, 40])
    found = ensemble(CART, LANES, START, u, DT, samples=SAMPLES, start=begin, settle=2.0, threads=1)
    x = simulate(CART, LANES, START, u, DT, samples=SAMPLES, start=begin)
    assert found.error == pytest.approx(np.abs(x[200:, ::2]).max(axis=0), rel=1e-9)
    assert found.largest == pytest.approx(np.abs(x[:, ::2]).max(axis=0), rel=1e-9)
    assert np.all(found.saturated == 0.0)


def test_a_lane_that_diverges_has_no_extremes_and_its_neighbours_have():
    far = START.copy()
    far[2, 1] = 1e308
    found = ensemble(CART, LANES | {"f_1q": 1.0}, far, None, DT, samples=50, threads=1)
    bad = ~np.isfinite(found.final).all(axis=0)
    assert bad.tolist() == [False, False, True, False, False]
    assert np.isnan(found.largest[:, bad]).all()
    assert np.isnan(found.error[:, bad]).all()
    assert np.isfinite(found.largest[:, ~bad]).all()


@pytest.mark.parametrize(
    ("lanes", "size"),
    [(1, 256), (256 * 4096, 256), (256 * 4096 + 1, 512), (512 * 4096 + 1, 1024), (10**12, 16384)],
)
def test_no_more_than_4096_pieces_are_handed_out_while_they_fit_into_memory(lanes, size):
    assert block(lanes) == size


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"params": {"m_1": 1.0}}, "needs a value for m_2, k_12, k_1, k_2"),
        ({"x0": [0.0, 0.0]}, r"x0 needs shape \(4,\) or \(lanes, 4\), got \(2,\)"),
        ({"x0": np.zeros((1, 4, 1))}, "x0 needs shape"),
        ({"start": 0.5}, "start counts samples and needs whole numbers, got float64"),
        ({"params": LANES | {"m_2": np.ones((2, 2))}}, "m_2 needs one value or one for each lane"),
        ({"params": LANES | {"m_2": np.ones(4)}}, "m_2 has 4 lanes where others have 5"),
        ({"start": np.arange(3)}, "start has 3 lanes where others have 5"),
    ],
)
def test_shapes_that_do_not_fit_are_refused_by_name(how, words):
    given = {"params": LANES, "x0": START, "start": 0} | how
    with pytest.raises(BadInput, match=words):
        simulate(CART, given["params"], given["x0"], None, DT, samples=2, start=given["start"])


def test_only_each_third_sample_is_returned_and_commands_are_held():
    whole = simulate(CART, LANES, START, np.sin(np.arange(30.0)), DT, samples=31)
    third = simulate(CART, LANES, START, np.sin(np.arange(30.0)), DT, samples=11, every=3)
    assert third == pytest.approx(whole[::3], rel=1e-12, abs=1e-15)
    assert np.all(whole[0] == START.T)
