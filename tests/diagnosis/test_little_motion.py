"""A body that moves by a few counts has lost none, and is at no limit; a speed is no place and may jump."""

from __future__ import annotations

import numpy as np
import pytest

from upright.diagnosis import examine, read_known
from upright.physics import CartPendulum
from upright.records import Provenance, Record
from upright.simulation import simulate

DT = 5e-3
T = np.arange(3000) * DT
HEAVY = CartPendulum(m_c=50.0, m_p=0.1, l_cg=0.3, J_p=1e-3, b_2=1e-3)
"""A cart that its pendulum pushes to and fro by m_p l_cg (2 sin 0.6)/(m_c + m_p) = 0.68 mm."""


def swing(step: float) -> dict[str, np.ndarray]:
    """Cart, read in steps [m], and pendulum, read in 4096 steps per turn."""
    x, theta = simulate(HEAVY, {}, [0.0, 0.0, 0.6, 0.0], None, DT, samples=T.size, substeps=2)[:, ::2, 0].T
    turn = 2 * np.pi / 4096
    return {"x": np.round(np.round(x / step) * step, 7), "theta": np.round(theta / turn) * turn}


def record(**columns: np.ndarray) -> Record:
    return Record(t=T, signals=columns, provenance=Provenance(file="log.csv", reader="table"))


def found(rig: str, **columns: np.ndarray) -> list[str]:
    return [f.kind for f in examine(record(**columns), *(read_known(rig) if rig else ())).findings]


@pytest.mark.parametrize("rig", ["", "cart-pendulum"])
@pytest.mark.parametrize("step", [1e-4, 1e-4 / 3, 3.9e-4, 7e-4])  # 7, 20, 2 and 1 counts
def test_a_cart_that_moves_by_a_few_counts_is_sound(step: float, rig: str) -> None:
    columns = swing(step)
    assert np.ptp(columns["x"]) > 0.9 * step
    assert not {"jump", "wrap", "spike", "stuck", "saturation"} & set(found(rig, **columns))


@pytest.mark.parametrize("rig", ["", "cart-pendulum"])
def test_counts_that_such_a_cart_loses_are_found(rig: str) -> None:
    columns = swing(1e-4)
    assert "jump" in found(rig, x=columns["x"] + np.where(T > 7, 2.5e-3, 0.0), theta=columns["theta"])


def test_one_reading_that_differs_by_a_count_is_no_spike() -> None:
    columns = swing(1e-4)
    once = np.where(np.arange(T.size) == 1500, 1.0, 0.0)
    assert not {"jump", "wrap", "spike"} & set(found("", x_counts=once, theta=columns["theta"]))
    assert "spike" in found("", x_counts=300 * once, theta=columns["theta"])


def test_a_speed_that_jumps_at_a_stop_has_lost_no_counts() -> None:
    speed = np.where(T < 4, 0.3 * np.sin(T), -0.3 * np.sin(T))
    assert "jump" not in found("", theta=swing(1e-4)["theta"], velocity=speed)
    assert "jump" in found("", theta=swing(1e-4)["theta"], alpha=speed)


@pytest.mark.parametrize(("counts", "limited"), [(7, False), (300, True)])
def test_the_play_in_which_a_cart_is_held_is_no_limit_of_its_travel(counts: int, limited: bool) -> None:
    t = np.arange(1000) * 0.02
    x = np.round(np.clip(3 * counts * np.cos(6 * t), -counts, counts))
    log = Record(t=t, signals={"x_counts": x}, provenance=Provenance(file="log.csv", reader="table"))
    assert ("saturation" in {f.kind for f in examine(log).findings}) == limited
