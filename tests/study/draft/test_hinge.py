"""Are a pendulum's throw and gravity those of its equation, and is a mirrored one told?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from upright.physics import CartPendulum, Furuta, Plant
from upright.signals.smoothing import smoothed
from upright.study.draft.hinge import hinge_of

DT = 0.005
T = np.arange(1600) * DT


def swung(along: float, spin: float) -> tuple[np.ndarray, np.ndarray]:
    """Hinge ``sin(2 t)/2`` and the pendulum on it by SciPy, from the equations of PHYSICS, sections 2 and 3.

    ``theta'' = along cos(theta) x'' + spin sin(theta) cos(theta) x'^2 - 40 sin(theta)``.
    """

    def slope(t: float, y: np.ndarray) -> list[float]:
        s, c = np.sin(y[0]), np.cos(y[0])
        return [y[1], -2 * along * c * np.sin(2 * t) + spin * s * c * np.cos(2 * t) ** 2 - 40 * s]

    return np.sin(2 * T) / 2, solve_ivp(slope, (0, T[-1]), [0.9, 0.0], t_eval=T, rtol=1e-9).y[0]


@pytest.mark.parametrize(("plant", "along", "spin"), [(CartPendulum, -3.0, 0.0), (Furuta, 3.0, 1.0)])
@pytest.mark.parametrize("sign", [1, -1])
def test_throw_and_gravity_are_those_of_the_equation(plant: type[Plant], along: float, spin: float, sign: int) -> None:
    """l m/J_A on the cart, l m r/J_A on the arm, g l m/J_A on both; polynomials over 0.1 s err by less than 1 %."""
    x, theta = swung(along, spin)
    hinge = hinge_of(plant, smoothed([x, sign * theta], DT, 21), slice(21, -21))
    assert hinge.throw == pytest.approx(sign * 3.0, rel=0.01)
    assert hinge.gravity == pytest.approx(40.0, rel=0.01)
    assert hinge.left < 1e-3 * min(hinge.unthrown, hinge.weightless)


def test_a_pendulum_that_is_looked_at_from_upright_has_its_gravity_the_other_way() -> None:
    x, theta = swung(-3.0, 0.0)
    assert hinge_of(CartPendulum, smoothed([x, theta + np.pi], DT, 21), slice(21, -21)).gravity < 0


def test_a_hinge_that_stays_where_it_is_throws_nobody() -> None:
    """A pendulum of one length and no throw, J_A theta'' = -m g l sin(theta), on a cart that was clamped."""
    swing = solve_ivp(lambda _, y: [y[1], -40 * np.sin(y[0])], (0, T[-1]), [0.9, 0.0], t_eval=T, rtol=1e-9).y[0]
    hinge = hinge_of(CartPendulum, smoothed([np.zeros(T.size), swing], DT, 21), slice(21, -21))
    assert hinge.throw == 0
    assert hinge.left == pytest.approx(hinge.unthrown)
    assert hinge.gravity == pytest.approx(40.0, rel=0.01)
