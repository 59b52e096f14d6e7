"""What a dead zone of the drive does to a loop: a cycle, of the size that the describing function says."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.integrate import quad

import upright as up
from upright.control.trial import trial
from upright.gains import feedback, filtered, margins, place

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=2e-3, b_2=3e-5)
RIG = up.Rig.known(ARM, gain=0.65, limit=10.0, period=1e-3, counts=1_000_000)
POLES = (-4.15 + 1.63j, -4.15 - 1.63j, -16.9, -3.2)


def loop():
    model = RIG.linear("inverted")
    sampled = model.to_sampled(RIG.period, 0.0)
    law = feedback(filtered(sampled, 0.2), place(model.A, model.B, POLES).K)
    return law, margins(sampled, law)


@pytest.mark.parametrize("dead_zone", [0.05, 0.2])
def test_a_pendulum_held_through_a_dead_zone_cycles_as_harmonic_balance_says(dead_zone):
    law, standing = loop()
    amplitude, frequency = standing.dead_zone_cycle(dead_zone)
    rig = RIG.replace(more={"actuator.dead_zone": dead_zone})
    run = trial(rig, law, at="inverted", start=[0.0, 0.0, 0.02, 0.0], seconds=30.0)
    last = run.t > 15.0
    u, t, leans = run.u[last], run.t[last], run.deviation[last, 1]
    rises = t[1:][(leans[:-1] < 0) & (leans[1:] >= 0)]
    # the balance knows the first harmonic alone: the command's size within a tenth, its frequency within a third
    assert np.abs(u).max() == pytest.approx(amplitude, rel=0.1)
    assert 2 * math.pi / np.diff(rises).mean() == pytest.approx(frequency, rel=0.33)


def test_the_share_that_a_dead_zone_passes_is_its_first_harmonic():
    _, standing = loop()
    amplitude, _ = standing.dead_zone_cycle(0.3)
    passed, _ = quad(
        lambda a: math.copysign(max(abs(amplitude * math.sin(a)) - 0.3, 0.0), math.sin(a)) * math.sin(a), 0, 2 * math.pi
    )  # fmt: skip
    assert passed / (math.pi * amplitude) == pytest.approx(standing.least_gain, rel=1e-6)


def test_no_dead_zone_keeps_up_no_cycle():
    assert loop()[1].dead_zone_cycle(0.0) == (0.0, 0.0)


@pytest.mark.parametrize("dead_zone", [0.1, 0.4])
def test_a_design_says_the_cycle_by_its_first_harmonic_beside_the_simulated_one(dead_zone):
    """Both scale with the dead zone, as everything in a loop without another nonlinearity does."""
    rig = RIG.replace(more={"actuator.dead_zone": dead_zone})
    page = up.design(rig, poles=list(POLES), memory=0.2).chapter
    text = next(block for part in page.parts if part.title == "The loop as it runs" for block in part.content
                if isinstance(block, str))  # fmt: skip
    said = text.partition(" dead zone of ")[2].replace("±", "")
    numbers = [float(n) for n in re.findall(r"(?<![\w.])\d+\.?\d*(?= V| rad/s)", said)]
    swallowed, size, frequency, simulated, at = numbers
    assert swallowed == dead_zone
    amplitude, expected = loop()[1].dead_zone_cycle(dead_zone)
    assert (size, frequency) == (pytest.approx(amplitude, rel=0.06), pytest.approx(expected, rel=0.06))  # two digits
    # the bounds of harmonic balance above
    assert simulated == pytest.approx(size, rel=0.15)
    assert at == pytest.approx(frequency, rel=0.38)


def test_a_design_for_a_drive_without_a_dead_zone_says_nothing_of_one():
    page = up.design(RIG, poles=list(POLES)).chapter
    assert "dead zone" not in str(page.parts)
