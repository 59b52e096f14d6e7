"""Three carts in a row, all with dry friction: who sticks, who slides, and when does each change?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from upright.physics import chain
from upright.simulation import simulate

M = np.array([1.0, 0.6, 0.8])
SPRINGS = np.array([[12.0 + 30.0, -30.0, 0.0], [-30.0, 30.0 + 18.0, -18.0], [0.0, -18.0, 18.0]])
COULOMB, STICTION = np.array([0.5, 0.25, 0.35]), np.array([0.8, 0.3, 0.45])
CARTS = {
    **{f"m_{i + 1}": M[i] for i in range(3)},
    "k_1": 12.0,
    "k_12": 30.0,
    "k_23": 18.0,
    **{f"f_{i + 1}c": COULOMB[i] for i in range(3)},
    **{f"f_{i + 1}s": STICTION[i] for i in range(3)},
}


def by_events(x, v, force, t_end):
    """Positions, speeds, modes met and number of changes, by scipy's events between the changes of mode.

    Carts are coupled by springs alone, so that each joint decides for itself: it slides as it moves, at rest it
    breaks away towards the net force when that exceeds the stiction level, and holds else.
    """
    t, met, away = 0.0, [], -1
    for _ in range(200):
        net = force - SPRINGS @ x
        pulled = np.where(np.abs(net) > STICTION, np.sign(net), 0.0)
        mode = np.where(v != 0.0, np.sign(v), pulled)
        if away >= 0:
            mode[away] = np.sign(net[away])
        met.append(tuple(mode))

        def slope(_, y, mode=mode):
            pull = force - SPRINGS @ y[:3] - mode * COULOMB
            return np.concatenate([y[3:], np.where(mode == 0.0, 0.0, pull / M)])

        events = []
        for i in range(3):
            if mode[i] != 0.0:
                events.append(lambda _, y, i=i, mode=mode: mode[i] * y[3 + i])
            else:
                events.append(lambda _, y, i=i: STICTION[i] - abs((force - SPRINGS @ y[:3])[i]))
            events[-1].terminal, events[-1].direction = True, -1
        r = solve_ivp(slope, (t, t_end), np.concatenate([x, v]), "DOP853", rtol=1e-12, atol=1e-14, events=events)
        x, v, t, away = r.y[:3, -1].copy(), r.y[3:, -1].copy(), r.t[-1], -1
        for i in range(3):
            if r.t_events[i].size:
                away = i if mode[i] == 0.0 else away
                v[i] = 0.0
        if r.status == 0:
            return x, v, met
    raise AssertionError("too many changes of mode")


@pytest.mark.slow
@pytest.mark.parametrize("lanes", [1, 17])
@pytest.mark.parametrize(
    ("x", "v", "force"),
    [
        ([0.20, 0.0, 0.0], [0.0, 0.0, 0.0], 0.0),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.9),
        ([-0.1, 0.15, 0.05], [0.4, 0.0, -0.7], -0.3),
    ],
)
def test_modes_of_three_carts_drift_as_an_independent_event_solver_says(x, v, force, lanes):
    q, speed, met = by_events(np.array(x), np.array(v), np.array([force, 0.0, 0.0]), 5.0)
    changes = len(met) - 1
    assert changes >= 10
    assert {sum(m == 0.0 for m in mode) for mode in met} == {0, 1, 2, 3}  # so many stick at one time or another
    x0 = np.tile(np.stack([x, v], axis=1).ravel(), (lanes, 1))
    end = simulate(chain(3)(**CARTS), {}, x0, np.array([force]), 1e-3, samples=5001, substeps=4)[-1]
    # RK4 with w h = 2e-3 leaves (w h)^5/120 of 0.2 m in each of 20,000 steps; a graze could amplify it tenfold
    assert np.allclose(end[::2].T, q, rtol=0, atol=1e-10)
    assert np.all(speed == 0.0)
    assert np.all(end[1::2] == 0.0)


def test_carts_at_rest_between_the_levels_stay_to_the_last_bit():
    # the net forces are within stiction but beyond the Coulomb level of each cart
    x = np.linalg.solve(SPRINGS, 0.95 * STICTION * [1, -1, 1])
    x0 = np.stack([x, np.zeros(3)], axis=1).ravel()
    end = simulate(chain(3)(**CARTS), {}, [x0, x0], None, 1e-3, samples=2, every=2000)[-1]
    assert np.array_equal(end[:, 0], x0)
    assert np.array_equal(end[:, 1], x0)
