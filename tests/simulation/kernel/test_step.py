"""Does one Runge-Kutta step notice what dry friction does inside it, and is what cannot be compiled said in a sentence?

The step's text is run by Python. A body with dry friction must not be carried past the moment at which it stops, breaks
away or turns: the search of events begins where the step's flag is 1.
"""

from __future__ import annotations

import pytest

from tests.simulation.kernel.interpreter import functions
from upright.errors import BadInput
from upright.laws import Law, Rule
from upright.physics import chain
from upright.simulation import choose
from upright.simulation.kernel.compiled import compiling, source
from upright.simulation.kernel.equations import step_arguments
from upright.simulation.kernel.flavour import lay_out
from upright.simulation.lowering.operands import Unsupported

BODY = chain(1)(m_1=1.0, c_1=4.0, f_1c=0.5, f_1s=0.7)


def step(plant, h, **at):
    """State and flag after a step; of what is not named nothing acts."""
    derived = plant.derived_for(plant.parameters())
    layout = lay_out(derived, choose(derived, plant.parameters()))
    names = step_arguments(layout)
    # the constants of this plant: its lumps from its parameters, levels of sliding and of breaking away
    p = plant.parameters()
    lumps = {f"k{i}": eval(text, dict(p)) for i, text in enumerate(derived.lumps)}
    values = {**lumps, "_Fc0": p["f_1c"], "_Fs0": p["f_1s"], "_h": h, **at}
    return functions(source(layout))["step"](**{name: float(values.get(name, 0.0)) for name in names})


def rates(v, h, forces, c, friction=0.5):
    """Accelerations of a unit mass in the four stages and its speed in each, by hand; it slides forwards."""
    begin, middle, end = forces
    a1 = begin - c * v - friction
    p2 = v + h / 2 * a1
    a2 = middle - c * p2 - friction
    p3 = v + h / 2 * a2
    a3 = middle - c * p3 - friction
    p4 = v + h * a3
    a4 = end - c * p4 - friction
    return (p2, p3, p4, v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4))


@pytest.mark.parametrize(
    ("damping", "forces", "turned"),
    [
        (4.0, (4.5, 4.5, 4.5), []),  # what friction takes: it goes on at 1 m/s
        (0.0, (-2.5, 3.5, 3.5), [0]),
        (4.0, (6.5, 4.5, 40.5), [1]),
        (4.0, (4.5, 8.5, 20.5), [2]),
        (4.0, (4.5, 4.5, -19.5), [3]),
    ],
)
def test_a_step_in_which_the_body_turns_at_one_stage_alone_is_not_taken_as_it_is(damping, forces, turned):
    v, h, body = 1.0, 1.0, BODY.replace(c_1=damping)
    speeds = rates(v, h, forces, damping)
    assert [k for k, speed in enumerate(speeds) if speed < 0] == turned
    q, speed, flag = step(body, h, _v0=v, _s0=1.0, _ua0=forces[0], _um0=forces[1], _ub0=forces[2])
    assert speed == pytest.approx(speeds[3])
    assert q == pytest.approx(h / 6 * (v + 2 * speeds[0] + 2 * speeds[1] + speeds[2]))
    assert flag == bool(turned)
    # and mirrored
    mirrored = step(body, h, _v0=-v, _s0=-1.0, _ua0=-forces[0], _um0=-forces[1], _ub0=-forces[2])
    assert mirrored == pytest.approx((-q, -speed, flag))


@pytest.mark.parametrize(
    ("begin", "end", "breaks"),
    [
        (0.0, 0.0, False),
        (0.6, 0.69, False),
        (0.0, 0.71, True),
        (0.71, 0.0, True),
        (-0.71, 0.0, True),
        (0, -0.69, False),
    ],
)
def test_a_body_that_sticks_breaks_away_when_more_pulls_than_stiction_holds(begin, end, breaks):
    """At the beginning or at the end of a step; meanwhile it does not move."""
    assert step(BODY, 0.1, _ua0=begin, _um0=(begin + end) / 2, _ub0=end) == (0.0, 0.0, float(breaks))


def says(loop, function="rule", line=1):
    with compiling(loop):
        error = Unsupported("something is not known")
        error.function, error.line = function, line
        raise error


def rule(t, y, r, z, p):
    return (0.0,), ()


def test_what_a_rule_may_not_use_is_said_with_its_place():
    line = rule.__code__.co_firstlineno + 1
    with pytest.raises(BadInput, match=rf"^the rule cannot be compiled: something .* \(line {line} of test_step.py\)"):
        says(Rule(function=rule), line=2)
    with pytest.raises(BadInput, match=r"not known \(what it returns\)"):
        says(Rule(function=rule), function="law")


@pytest.mark.parametrize("loop", [None, Law(A=[[0.0]], B=[[0.0]], C=[[0.0]], D=[[1.0]])])
def test_what_is_no_rules_fault_is_not_blamed_on_a_rule(loop):
    """A kernel's own text that cannot be compiled is a mistake of ours, and shows as one."""
    with pytest.raises(Unsupported, match="something is not known"):
        says(loop)


def test_what_compiles_passes():
    with compiling(Rule(function=rule)):
        pass
