"""Does a controller given as a function do in the kernel what it says on paper?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from math import floor, sin

import numpy as np
import pytest

from tests.simulation.conftest import BLOCK, FURUTA
from upright.errors import BadInput
from upright.laws import Law, Rule
from upright.simulation import Simulator, choose, ensemble, simulate

SPRING = {**BLOCK, "m": 0.8, "k": 12.0, "c": 0.4}
DT = 0.02
R = np.column_stack([0.2 * np.sin(np.arange(90) * 0.15), np.cos(np.arange(90) * 0.15)])


def pid(t: float, y: Sequence[float], r, z, p) -> tuple[Sequence[float], Sequence[float]]:
    """Sum, last reading, filtered difference of the error."""
    kp, ki, kd, alpha, dt = p
    e = r[0] - y[0]
    d = alpha * z[2] + (1.0 - alpha) * (r[1] - (y[0] - z[1]) / dt)
    return (kp * e + ki * (z[0] + e * dt) + kd * d,), (z[0] + e * dt, y[0], d)


def as_matrices(kp, ki, kd, alpha, dt):
    rate = (1.0 - alpha) / dt
    e, d = np.array([-1.0, 1.0, 0.0]), np.array([-rate, 0.0, rate * dt])
    return {
        "A": [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, rate, alpha]],
        "B": [dt * e, [1.0, 0.0, 0.0], d],
        "C": [[ki, kd * rate, kd * alpha]],
        "D": [kp * e + ki * dt * e + kd * d],
    }


@pytest.mark.parametrize("delay", [0.0, 1.6])
def test_a_law_written_as_a_function_moves_the_plant_alike(block, delay):
    numbers = [(9.0, 14.0, 1.1, 0.4, DT), (4.0, 2.0, 0.6, 0.7, DT)]
    start = np.array([[0.0, 0.1], [0.12, 0.2], [0.0, -0.5]])
    common = {"references": R, "resolution": 0.01, "command_resolution": 0.005, "delay": delay, "initial": start}
    law = Law(**{c: np.stack([np.array(as_matrices(*n)[c]) for n in numbers], axis=-1) for c in "ABCD"}, **common)
    rule = Rule(function=pid, parameters=np.array(numbers).T, **common)
    p, feed = {**SPRING, "actuator.limit": 2.5}, 0.1 * np.cos(np.arange(90) * 0.3)
    a, b = (simulate(block, p, [0.12, 0.0], feed, DT, samples=90, substeps=4, loop=c) for c in (law, rule))
    assert 0 < np.mean(np.abs(a[:, 2]) == 2.5) < 1  # saturated at times
    assert np.allclose(a, b, rtol=0, atol=1e-12)
    more = (ensemble(block, p, [0.12, 0.0], feed, DT, samples=90, substeps=4, loop=c) for c in (law, rule))
    assert np.allclose(*(m.saturated for m in more), rtol=0, atol=0)


def dead_zone(t, y, r, z, p):
    """A relay that waits, counts and follows the clock: nothing a matrix can say."""
    if abs(y[0]) < p[0]:
        u = 0.5 * sin(7.0 * t)
    else:
        u = -p[1] if y[0] > 0.0 else p[1]
    return (u,), (z[0] + floor(abs(u) + 0.5),)


def test_what_the_kernel_computes_is_what_the_function_says_called_by_hand(block):
    rule = Rule(function=dead_zone, initial=[0.0], parameters=[0.03, 1.0], resolution=0.01)
    for lanes in (1, 3):
        out = simulate(block, SPRING, [[0.2, 0.0]] * lanes, None, DT, samples=200, loop=rule)[:, :, 0]
        commands, memory = rule.follow(np.floor(out[:, 0] / 0.01 + 0.5) * 0.01, DT)
        assert {-1.0, 1.0} < set(commands[:, 0].tolist())  # both sides of the relay, and the wait between
        assert np.allclose(out[:, 2], commands[:, 0], rtol=0, atol=1e-14)
        assert memory[-1, 0] == np.floor(np.abs(commands[:-1, 0]) + 0.5).sum()


def test_a_lane_that_starts_later_follows_the_clock_of_the_record(block):
    rule = Rule(function=dead_zone, initial=[0.0], parameters=[9.0, 1.0])
    start = np.array([0, 35])
    out = simulate(block, SPRING, [0.0, 0.0], None, DT, samples=50, start=start, loop=rule)
    t = (start + np.arange(50)[:, None]) * DT
    assert np.allclose(out[:, 2], 0.5 * np.sin(7.0 * t), rtol=0, atol=1e-13)


def test_a_function_may_drive_any_plant(rotary):
    def spin(t, y, r, z, p):
        return (0.01,), ()

    p = {**FURUTA, "b_1": 5e-3}
    by_rule = simulate(rotary, p, np.zeros(4), None, 1e-3, samples=300, loop=Rule(function=spin))
    open_loop = simulate(rotary, p, np.zeros(4), [0.01], 1e-3, samples=300)
    assert np.allclose(by_rule[:, :4], open_loop, rtol=0, atol=1e-13)


def test_a_wrong_rule_is_answered_in_a_sentence(block):
    gain = 3.0

    def needs(t, y, r, z, p):
        return (gain * math.cos(y[0]),), ()

    def short(t, y, r, z, p):
        return (), ()

    def mixed(t, y, r, z, p):
        if y[0] > 0.5:
            return (1.0, 2.0), ()
        return (1.0,), ()

    with pytest.raises(BadInput, match="uses gain, math, which the kernel does not know"):
        Rule(function=needs)
    with pytest.raises(BadInput, match="t, y, r, z, p"):
        Rule(function=lambda t, y, r, z, p: ((0.0,), ()))
    with pytest.raises(BadInput, match="text could not be read"):
        Rule(function=eval("abs"))
    for function, words in ((short, "must return 1 commands, and this one returns 0"), (mixed, "cannot be compiled")):
        with pytest.raises(BadInput, match=words) as caught:
            simulate(block, SPRING, [0.0, 0.0], None, DT, samples=2, loop=Rule(function=function))
    line = mixed.__code__.co_firstlineno + 3  # the second return, of another length than the first
    assert f"(line {line} of test_rule.py)" in str(caught.value)
    rule = Rule(function=pid, initial=np.zeros((3, 2)), parameters=np.ones(5), references=R)
    with pytest.raises(BadInput, match="lanes"):
        simulate(block, SPRING, np.zeros((3, 2)), None, DT, samples=2, loop=rule)
    flavour = choose(block, SPRING)
    with pytest.raises(BadInput, match="without a flavour for it"):
        Simulator(derived=block, flavour=flavour, dt=DT, loop=rule)
