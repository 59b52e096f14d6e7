"""Is what a compiled kernel cannot be called with refused before it is, by shape and number? Nothing is compiled."""

from __future__ import annotations

import math

import numpy as np
import pytest

from upright.errors import BadInput
from upright.laws import state_feedback
from upright.physics import CartPendulum
from upright.physics.actuator import ACTUATOR
from upright.simulation import Held, Simulator, choose

VALUES = CartPendulum(m_c=0.6, m_p=0.14, l_cg=0.19, J_p=6e-4).parameters()
DERIVED = CartPendulum.derived_for(VALUES)
LAW = state_feedback([1.0, 0.1, 2.0, 0.2], 0.01, limit=3.0)


def simulator(*, values=VALUES, loop=None, held=None, **more):
    flavour = choose(DERIVED, values, loop=loop, held=held or {})
    return Simulator(derived=DERIVED, flavour=flavour, loop=loop, **({"dt": 0.01, "held": held or {}} | more))


def test_rows_are_parameters_then_the_drive_and_what_is_not_given_takes_its_default():
    made = simulator()
    assert made.names == (*DERIVED.parameters, *ACTUATOR)  # one input
    table = made.table({"m_c": [1.0, 2.0], "actuator.limit": 5.0}, lanes=2)
    rows = dict(zip(made.names, table.tolist(), strict=True))
    assert (rows["m_c"], rows["actuator.limit"], rows["m_p"]) == ([1.0, 2.0], [5.0, 5.0], [0.0, 0.0])
    assert rows["actuator.end"] == [ACTUATOR["actuator.end"].default] * 2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"dt": 0.0}, "the sample time must be positive, got 0 s"),
        ({"dt": -0.01}, "sample time must be positive, got -0.01"),
        ({"dt": math.inf}, "sample time must be positive, got inf"),
        ({"substeps": 0}, "substeps must be at least 1, got 0"),
    ],
)
def test_a_sample_has_a_length_and_a_step(changes, said):
    with pytest.raises(BadInput, match=said):
        simulator(**changes)
    assert simulator(dt=1e-9, substeps=1)


def test_motion_is_prescribed_for_exactly_the_coordinates_that_the_flavour_holds():
    flavour = choose(DERIVED, VALUES, held={"x": Held()})
    for held in ({}, {"theta": Held()}, {"x": Held(), "theta": Held()}):
        with pytest.raises(BadInput, match=r"the flavour holds \['x'\], but motion was given for"):
            Simulator(derived=DERIVED, flavour=flavour, dt=0.01, held=held)


PARAMS, X0, U = np.ones((len(DERIVED.parameters) + len(ACTUATOR), 3)), np.zeros((4, 3)), np.zeros((9, 1))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"params": PARAMS[:-1]}, rf"params needs shape \({len(PARAMS)}, lanes\), got \({len(PARAMS) - 1}, 3\)"),
        ({"params": PARAMS[:, :0], "x0": X0[:, :0]}, rf"params needs shape .*, got \({len(PARAMS)}, 0\)"),
        ({"params": PARAMS[:, 0]}, r"params needs shape"),
        ({"x0": X0.T}, r"x0 needs shape \(4, 3\): states first, lanes last; got \(3, 4\)"),
        ({"samples": 0}, "samples and every must be at least 1, got 0 and 1"),
        ({"every": 0}, "samples and every must be at least 1, got 5 and 0"),
        ({"u": U[:, 0]}, r"u needs shape \(T, 1\): time first, one column for each input; got \(9,\)"),
        ({"u": np.zeros((9, 2))}, r"u needs shape \(T, 1\)"),
        ({"start": np.array([0, 1])}, r"start needs 3 sample numbers that are not negative"),
        ({"start": np.array([0, -1, 2])}, r"start needs 3 sample numbers that are not negative"),
    ],
)
def test_what_does_not_fit_the_kernel_is_refused_by_its_shape(changes, said):
    fits = {"params": PARAMS, "x0": X0, "u": U, "samples": 5, "width": 16}
    made = simulator()
    with pytest.raises(BadInput, match=said):
        made.call(**(fits | changes))
    call = made.call(**(fits | {"samples": 1, "start": np.array([0, 7, 2])}))
    assert (call.lanes, call.blocks, call.start[:3].tolist()) == (3, 1, [0, 7, 2])
    assert made.call(**(fits | {"params": np.ones((len(PARAMS), 33)), "x0": np.zeros((4, 33))})).blocks == 3


def test_a_loop_whose_drive_is_late_by_more_than_ten_thousand_samples_is_asked_for_its_unit():
    late = VALUES | {"actuator.delay": 100.0}
    made = simulator(values=late, loop=LAW)
    table = made.table(late, lanes=1)
    row = made.names.index("actuator.delay")
    assert made.call(table, X0[:, :1], samples=2, width=1)  # 10,000 of them
    table[row] = 100.1
    with pytest.raises(BadInput, match=r"a delay of 10010 samples is too long for a loop; is it in seconds\?"):
        made.call(table, X0[:, :1], samples=2, width=1)
    table[row] = np.inf  # never at work, which needs no memory
    assert made.call(table, X0[:, :1], samples=2, width=1)


def test_a_loop_commands_within_the_narrower_of_its_limit_and_the_drive_s():
    for drive, limit in ((5.0, 3.0), (2.0, 2.0)):
        values = VALUES | {"actuator.limit": drive}
        made = simulator(values=values, loop=LAW)
        call = made.call(made.table(values, lanes=1), X0[:, :1], samples=2, width=1)
        assert call.params[made.names.index("actuator.limit"), 0] == limit
