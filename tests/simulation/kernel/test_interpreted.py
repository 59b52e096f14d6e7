"""Does the machine code of a kernel give what Python gives when it runs the same text?"""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.bumpers import BUMPERS
from tests.simulation.kernel.interpreter import interpreted
from upright.laws import Law, Rule
from upright.physics import Furuta, chain
from upright.simulation import Held, Simulator, choose

SAMPLES, DT = 60, 2e-3
FURUTA = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=6e-4)
CARTS = chain(2)(m_1=1.0, m_2=0.5, k_1=80.0, k_12=50.0, c_1=0.4)
FRICTION = {"f_1c": 2.0, "f_2c": 0.3, "f_1s": 2.6, "f_2s": 0.4}
LATE = {"actuator.limit": 2.0, "actuator.delay": 0.0037, "actuator.lag": 0.006, "actuator.slope": 0.2}
DRIVE = {
    "actuator.start": 0.01, "actuator.end": 0.09, "actuator.damping": 0.5, "actuator.standby": 0.2,
    "actuator.fade": 0.4, "actuator.knee": 0.05, "actuator.relaxation": 0.01,
    "actuator.droop": 0.4, "actuator.dead_zone": 0.05, "actuator.force_limit": 1.5, "actuator.damping_rise": 0.3,
}  # fmt: skip


def switching(t, y, r, z, p):
    """A rule with branches, a loop, a memory and a sum over a tuple."""
    total = 0.0
    for angle in y:
        total += angle
    k = 0
    while k < 3 and total > 0.1:
        total -= 0.05
        k += 1
    push = p[0] if y[0] < r[0] and z[1] > 2.0 else -p[0] * min(k, 2)
    if abs(total) > 0.2:
        push = 0.5 * push
    elif t > 0.05:
        return (push // 0.3,), (total, 0.0)
    return (push,), (total, z[1] + 1.0)


def linear(lanes):
    rng = np.random.default_rng(3)
    return Law(
        A=0.5 * np.eye(2), B=0.1 * rng.standard_normal((2, 3)), C=rng.standard_normal((1, 2)),
        D=rng.standard_normal((1, 3)), references=np.sin(0.1 * np.arange(SAMPLES)), resolution=1e-3, delay=0.0011,
    )  # fmt: skip


def rule(lanes):
    return Rule(
        function=switching, initial=[0.0, 0.0], parameters=np.linspace(0.4, 0.6, lanes)[None, :], references=[0.02]
    )


CASES = {
    "smooth": (FURUTA, {}, None, {}),
    "dry friction at two joints": (CARTS, FRICTION, None, {}),
    "drag and presliding": (CARTS, {"f_1c": 2.0, "delta_1": 1e-3, "f_2c": 0.3, "f_1q": 0.8}, None, {}),
    "friction that falls with speed": (CARTS, {**FRICTION, "v_1s": 0.05, "v_2s": 0.1}, None, {}),
    "an actuator that is late": (FURUTA, {**LATE, "b_1c": 0.02}, None, {}),
    "a drive that brakes and dies": (CARTS, {**DRIVE, "actuator.lag": 0.004}, None, {}),
    "a held arm": (FURUTA, {"b_2c": 0.004}, None, {"psi": Held(q=0.2 * np.sin(0.1 * np.arange(SAMPLES)))}),
    "a linear law": (FURUTA, LATE, linear, {}),
    "a rule": (FURUTA, {}, rule, {}),
    "elementary functions and kinks": (BUMPERS, {}, None, {}),
}


@pytest.mark.parametrize("lanes", [1, 3])
@pytest.mark.parametrize("case", CASES)
def test_machine_code_and_python_run_the_same_text_alike(case, lanes):
    plant, more, loop, held = CASES[case]
    values = {**plant.parameters(), **more}
    derived = plant.derived_for(values)
    law = loop and loop(lanes)
    flavour = choose(derived, values, held=held, loop=law)
    x0 = np.random.default_rng(5).uniform(-0.4, 0.4, (4, lanes))
    x0[1] = 0.0
    u = np.where(np.arange(SAMPLES) < 40, 1.5 * np.sin(0.2 * np.arange(SAMPLES)), 0.0)[:, None]
    paths = []
    for change in (lambda s: s, interpreted):
        s = change(Simulator(derived=derived, flavour=flavour, dt=DT, loop=law, held=held))
        paths.append(s.run(s.table(values, lanes), x0, u, samples=SAMPLES))
    assert np.isfinite(paths[1]).all()
    assert np.ptp(paths[1], axis=0).max() > 1e-3
    # the order of additions differs: rounding, amplified a thousandfold at most over 0.12 s
    assert np.allclose(*paths, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("lanes", [1, 3])
def test_reduced_motions_too(lanes):
    values = {**FURUTA.parameters(), "b_1c": 0.05, "actuator.limit": 0.1}
    derived = FURUTA.derived_for(values)
    law = Law(C=np.zeros((1, 0)), D=[[0.5, 1.0]], A=np.zeros((0, 0)), B=np.zeros((0, 2)), target=[0.1, 0.0])
    flavour = choose(derived, values, loop=law, record=False)
    x0 = np.random.default_rng(5).uniform(-0.4, 0.4, (4, lanes))
    rows = []
    for change in (lambda s: s, interpreted):
        s = change(Simulator(derived=derived, flavour=flavour, dt=DT, loop=law))
        rows.append(s.run(s.table(values, lanes), x0, samples=SAMPLES, settle=0.02))
    assert np.allclose(*rows, rtol=0.0, atol=1e-12)
    assert rows[1][4].any()  # the limit was met
