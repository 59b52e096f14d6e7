"""A reversed sign and a zero that stands upright are named, and nothing is where the declared convention is right."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.identification.twins import FURUTA, PENDULUM, noisy, rig, swing
from upright.identification import Run
from upright.identification.checks.conventions import wrong_conventions
from upright.physics import Furuta, Pendulum
from upright.simulation import simulate

ARM = rig(Furuta, FURUTA, {n: 1.3 * FURUTA[n] for n in ("J_d", "l_cg", "b_1")})
ROD = rig(Pendulum, PENDULUM, {"J_p": 2.4e-3, "b_2": 1.4e-3, "b_2c": 2.4e-3})


def moved(torque: float, angle: float) -> Run:
    """A Furuta pendulum released from an angle while a motor shakes its arm."""
    n, dt = 601, 4e-3
    t = np.arange(n) * dt
    u = torque * (np.sin(2 * np.pi * 0.7 * t) + np.sin(2 * np.pi * 1.9 * t))[:, None]
    x = simulate(Furuta(**FURUTA), {}, [0.0, 0.0, angle, 0.0], u, dt, samples=n, substeps=4)
    run = Run(label="moved", role="fit", t=t, u=u, y=x[:, [0, 2], 0], measured=("psi", "theta"))
    return noisy(run, 1e-5, seed=1)


def told(sentences: tuple[str, ...]) -> tuple[set[str], set[str]]:
    """Coordinates whose sign, and whose zero, is said to be wrong."""
    (sentence,) = sentences
    signs = re.findall(r"sign = -1 for (\w+)", sentence)
    return set(signs), set(re.findall(r"offset of pi to (\w+)", sentence))


@pytest.mark.parametrize("reversed_", [{"psi"}, {"theta"}, {"psi", "theta"}])
def test_every_reversed_sign_of_a_driven_rig_is_named(reversed_: set[str]) -> None:
    run = moved(0.1, 0.3)
    wrong = replace(run, y=run.y * [-1.0 if c in reversed_ else 1.0 for c in run.measured])
    sentences = wrong_conventions(ARM, [wrong])
    assert told(sentences) == (reversed_, set())
    now = re.search(r"explained to (\d+) % instead of (\d+) %", sentences[0])
    assert now is not None
    assert 98 < int(now[1]) <= 100  # all but noise of 1e-5 rad in an acceleration
    assert int(now[2]) < 50


def test_of_signs_that_only_count_together_one_is_named() -> None:
    """Without a drive a mirror image obeys the same equations, so both signs reversed are no fault, and one is."""
    run = moved(0.0, 1.5)
    assert wrong_conventions(ARM, [run]) == ()
    assert wrong_conventions(ARM, [replace(run, y=-run.y)]) == ()
    assert told(wrong_conventions(ARM, [replace(run, y=run.y * [1.0, -1.0])])) == ({"theta"}, set())


def test_one_driven_run_tells_the_signs_of_a_free_one_beside_it() -> None:
    """Both signs are reversed in both runs; the free one obeys its equations all the same."""
    both = [replace(run, y=-run.y) for run in (moved(0.1, 0.3), moved(0.0, 0.3))]
    assert told(wrong_conventions(ARM, both)) == ({"psi", "theta"}, set())


def test_a_zero_upright_is_named_and_no_sign_with_it() -> None:
    run = noisy(swing(angle=1.2), 1e-4, seed=2)
    assert told(wrong_conventions(ROD, [replace(run, y=run.y + np.pi)])) == (set(), {"theta"})
    assert told(wrong_conventions(ROD, [replace(run, y=np.pi - run.y)])) == (set(), {"theta"})


def test_a_sign_and_a_zero_are_named_together() -> None:
    run = moved(0.1, 0.3)
    assert told(wrong_conventions(ARM, [replace(run, y=run.y * [-1.0, 1.0] + [0.0, np.pi])])) == ({"psi"}, {"theta"})


def test_what_no_convention_explains_brings_no_advice() -> None:
    right = moved(0.1, 0.3)
    assert wrong_conventions(ARM, [right]) == ()
    noise = np.cumsum(np.random.default_rng(3).normal(size=right.y.shape), axis=0)
    assert wrong_conventions(ARM, [replace(right, y=noise)]) == ()
    short = replace(right, t=right.t[:20], u=right.u[:20], y=right.y[:20])
    assert wrong_conventions(ARM, [short]) == ()


@pytest.mark.parametrize(("gravity", "named"), [(1.9, False), (1.6, True)])
def test_a_convention_that_explains_less_than_half_is_not_named(gravity: float, named: bool) -> None:
    """Small swings under f times the gravity assumed: (f - 1)^2 of the variance is left, (f + 1)^2 from upright."""
    run = swing(PENDULUM | {"b_2c": 0.0, "b_2q": 0.0}, angle=0.1)
    truth = PENDULUM | {"b_2c": 0.0, "b_2q": 0.0}
    heavy = rig(Pendulum, truth | {"g": gravity * 9.81}, {"b_2": truth["b_2"]})
    found = wrong_conventions(heavy, [replace(run, y=run.y + np.pi)])
    assert bool(found) is named
    if named:
        assert told(found) == (set(), {"theta"})
        assert "explained to 64 % instead of 0 %" in found[0]  # 1 - 0.6^2
