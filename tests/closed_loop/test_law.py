"""Does a sampled law compute what a program of a few lines computes, alone and in the compiled loop?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.closed_loop.programs import Pid, T
from upright.closed_loop import ClosedLoop, Filter, pid
from upright.errors import BadInput
from upright.identification import GreyBox, Parameter, Run
from upright.identification.problem.simulated import motions, simulator
from upright.identification.problem.tracks import prepare
from upright.laws import Law, state_feedback
from upright.physics import find

LAWS = {
    "plain": ({"kp": 4.0, "ki": 3.0, "kd": 0.2}, {}),
    "filtered": ({"kp": 4.0, "ki": 3.0, "kd": 0.2, "tau": 0.01}, {"derivative": 0.01}),
    "two taps": (
        {"kp": 4.0, "ki": 3.0, "kd": 0.2, "second": 0.8, "on": "measurement"},
        {"derivative": Filter(second=0.8), "on": "measurement"},
    ),
    "held": ({"kp": 4.0, "ki": 30.0, "kd": 0.2, "limit": 3.0, "hold": True}, {"limit": 3.0, "windup": "hold"}),
}


def pair(name: str) -> tuple[Pid, Law]:
    program, law = LAWS[name]
    gains = {k: program[k] for k in ("kp", "ki", "kd")}
    return Pid(**program), pid(**gains, period=T, **law)


def commands(law: Law, y: np.ndarray, r: np.ndarray) -> np.ndarray:
    return replace(law, references=r).follow(y)[0][:, 0]


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_the_program_line_by_line(name: str) -> None:
    program, law = pair(name)
    generator = np.random.default_rng(5)
    y, r = np.cumsum(generator.normal(size=(2, 400)), axis=1) * 0.05
    y[0] = r[0] = 0.0  # both start from zero: the program with its first sample, the law with what was before
    expected = [program(a, b) for a, b in zip(y, r, strict=True)]
    np.testing.assert_allclose(commands(law, y, r), expected, atol=1e-10)


def test_feedback_of_states_differences_the_positions() -> None:
    law = state_feedback([2.0, 0.1, 30.0, 2.5], T, k_pf=2.0, memory=0.9, begin=None)
    generator = np.random.default_rng(6)
    y, r = generator.normal(size=(300, 2)), generator.normal(size=300)
    v, last, expected = np.zeros(2), np.zeros(2), []
    for now, target in zip(y, r, strict=True):
        v, last = 0.9 * v + 0.1 * (now - last) / T, now
        expected.append(2.0 * target - 2.0 * now[0] - 0.1 * v[0] - 30.0 * now[1] - 2.5 * v[1])
    np.testing.assert_allclose(commands(law, y, r), expected, atol=1e-9)


def test_a_law_between_other_units_gives_the_same_commands() -> None:
    law = pid(4.0, 3.0, 0.2, period=T)
    counts = np.round(np.random.default_rng(7).normal(size=200) * 1000)
    in_radians, reference = law.in_units([500.0], [30.0], -0.5), np.full(200, 100.0)
    np.testing.assert_allclose(
        commands(in_radians, (counts - 30.0) / 500.0, reference), -0.5 * commands(law, counts, reference)
    )


def test_gains_of_many_lanes_change_their_units_lane_by_lane() -> None:
    """Two readings and a reference, three lanes: counts to radians, volts to converter steps."""
    K = np.random.default_rng(8).normal(size=(1, 4, 3))
    k_pf = np.array([2.0, 1.0, 0.5])
    scale, offset = [500.0, 800.0], [30.0, -7.0]
    lanes = state_feedback(K, T, memory=0.5, k_pf=k_pf, limit=2.0, command_resolution=0.1).in_units(scale, offset, -3.0)
    for k in range(3):
        alone = state_feedback(
            K[..., k], T, memory=0.5, k_pf=float(k_pf[k]), limit=2.0, command_resolution=0.1
        ).in_units(scale, offset, -3.0)  # fmt: skip
        for name, (value, axes) in alone.arrays().items():
            many = lanes.arrays()[name][0]
            np.testing.assert_array_equal(many[..., k] if many.ndim > axes else many, value, err_msg=name)
        assert (lanes.limit, float(np.max(lanes.command_resolution))) == pytest.approx((6.0, 0.3))


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("name", LAWS)
def test_the_compiled_loop_runs_the_law(name: str, every: int) -> None:
    """Cart on a spring under the law, against a program that steps the cart by its matrix exponential."""
    from scipy.linalg import expm

    program, law = pair(name)
    n, m, k, c = 300, 0.5, 8.0, 0.3
    motion = expm(np.array([[0, 1, 0], [-k / m, -c / m, 1 / m], [0, 0, 0]]) * T)
    x, states, commands = np.zeros(2), [], []
    for _ in range(n * every):
        u = program(x[0], 1.0)
        states.append(x)
        commands.append(u)
        x = motion[:2, :2] @ x + motion[:2, 2] * u
    values = {"m_1": m, "k_1": k, "c_1": c}
    rig = GreyBox(
        plant=find("rectilinear-1"), parameters={n: Parameter(name=n, value=v) for n, v in values.items()}, substeps=4
    )
    # the program sees its first sample as no step of the reference, so must the law
    start = np.zeros(len(law.A))
    if "measurement" not in LAWS[name][0].values():
        start[1] = 1.0
    loop = ClosedLoop(law=replace(law, measured=("x_1",), initial=start, references=np.ones(1)), every=every)
    y = np.array(states)[::every, :1]
    run = Run(
        label="loop", role="predict", t=np.arange(n) * T * every, u=np.zeros((n, 1)), y=y, measured=("x_1",), loop=loop
    )
    track = prepare(rig, run, thin=False)
    every_value = {**{n: p.value for n, p in rig.parameters.items()}}
    solver = simulator(rig, track, every_value, ())
    found = motions(solver, track, every_value, np.zeros((2, 1, 1)), samples=n)[:, :, 0]
    np.testing.assert_allclose(found[:, :2], np.array(states)[::every], atol=1e-6)
    np.testing.assert_allclose(found[:, 2], np.array(commands)[::every], atol=1e-3)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"A": np.eye(2)}, "A of a law with 1 memories.* needs shape"),
        ({"period": -1.0}, "sample period"),
        ({"limit": -1.0}, "limit above zero"),
        ({"D": np.array([[np.nan, 1.0]])}, "finite numbers"),
        ({"initial": np.zeros(3)}, r"initial state of the law needs shape \(1,\)"),
        ({"measured": ("y", "z")}, "and 3 signals"),
    ],
)
def test_a_law_that_fits_nothing_is_refused(fields: dict, sentence: str) -> None:
    good = {"A": [[1.0]], "B": [[-1.0, 1.0]], "C": [[2.0]], "D": [[-1.0, 1.0]], "period": T, "measured": ("y",)}
    with pytest.raises(BadInput, match=sentence):
        Law(**{**good, **fields}, reference_names=("r",))


@pytest.mark.parametrize("period", [0.0, np.inf])
def test_a_program_without_a_period_is_no_law(period: float) -> None:
    with pytest.raises(BadInput, match="sample period"):
        pid(1.0, period=period)
