"""What a simulated loop reads, remembers and is held by, beside the run it explains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import PENDULUM, rig, swing
from upright.closed_loop import ClosedLoop
from upright.errors import BadInput
from upright.identification import Run
from upright.identification.problem.residuals import formulate
from upright.identification.problem.simulated import finely, law_of_loop
from upright.laws import Law
from upright.physics import CartPendulum, Pendulum
from upright.simulation import Held

LAW = Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-7.0]]), period=0.01,
          measured=("theta",), command_resolution=0.02)  # fmt: skip
T = 0.01 * np.arange(50)
RUN = Run(label="tip", role="fit", t=T, u=np.zeros((50, 1)), y=np.column_stack([T, 2 * T]), measured=("theta", "x"),
          resolution=(1e-3, 5e-4))  # fmt: skip


def test_a_law_reads_the_coordinates_of_its_plant_in_their_order():
    law = law_of_loop(ClosedLoop(law=LAW), RUN, CartPendulum)
    assert law.measured == ("x", "theta")
    assert law.D.tolist() == [[0.0, -7.0]]
    with pytest.raises(BadInput, match="the law of run 'tip' reads 'x'; Pendulum has theta"):
        law_of_loop(ClosedLoop(law=replace(LAW, measured=("x",))), RUN, Pendulum)


@pytest.mark.parametrize("quantized", [False, True])
def test_a_law_rounds_as_its_encoders_and_its_converter_do_only_where_that_is_asked(quantized):
    """In the plant's order, whatever the order of the run; what the run does not measure is not rounded."""
    law = law_of_loop(ClosedLoop(law=LAW, quantized=quantized), RUN, CartPendulum)
    assert law.command_resolution == (0.02 if quantized else 0.0)
    assert np.any(law.resolution) == quantized
    if quantized:
        assert list(law.resolution) == [5e-4, 1e-3]
        alone = replace(RUN, y=RUN.y[:, :1], measured=("theta",), resolution=(1e-3,))
        assert list(law_of_loop(ClosedLoop(law=LAW, quantized=True), alone, CartPendulum).resolution) == [0.0, 1e-3]


def test_a_prescribed_motion_passes_through_its_samples_at_the_law_s_rate():
    """A parabola is its own cubic spline."""
    held = Held(q=T**2)
    fine = finely(held, 4)
    assert len(fine.q) == 4 * 49 + 1
    np.testing.assert_allclose(fine.q, (0.0025 * np.arange(4 * 49 + 1)) ** 2, atol=1e-12)
    assert finely(held, 1) is held


@pytest.mark.parametrize("horizon", [None, 1.0])
def test_a_simulated_run_stays_as_it_is_when_another_is_simulated_after_it(horizon):
    """Memory is used again, and no answer lies in it: a pendulum of half the inertia swings otherwise."""
    problem = formulate(rig(Pendulum, PENDULUM, {"J_p": 3e-3}), [swing(seconds=3.0, horizon=horizon)])
    x, length = problem.start[:, None], problem.tracks[0].length
    first = problem.simulate(0, x, length)
    kept = first.copy()
    wider = problem.beside(replace(problem.rig.parameters["b_2"], estimate=True))
    other = wider.simulate(0, np.append(problem.start - 0.7, 1e-3)[:, None], length)
    assert np.array_equal(first, kept)
    assert not np.allclose(first, other)
    assert np.array_equal(problem.simulate(0, x, length), kept)
