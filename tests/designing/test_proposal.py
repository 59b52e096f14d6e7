"""Poles where nobody asked for any: they hold the rig, with margin, and not louder than they must."""

from __future__ import annotations

import math

import numpy as np
import pytest

import upright as up
from upright.designing.proposal import NEARLY, PACES, own_pace
from upright.errors import BadInput

ARM = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4)
CART = up.CartPendulum(m_c=0.6, m_p=0.2, l_cg=0.25, J_p=2e-3, b_1=1.0)
RIGS = {
    "furuta": up.Rig.known(ARM, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096),
    "cart": up.Rig.known(CART, gain="2 N/V", limit="10 V", period="5 ms", counts=(20_000, 4096)),
}


@pytest.mark.parametrize("at", ["hanging", "inverted"])
@pytest.mark.parametrize("name", RIGS)
def test_a_design_without_poles_holds_the_rig(name, at):
    rig = RIGS[name]
    design = up.design(rig, at=at)
    model = rig.linear(at)
    closed = np.linalg.eigvals(model.A - model.B @ np.reshape(design.K, (1, -1)))
    assert closed.real.max() < 0
    assert np.sort(closed.real) == pytest.approx(np.sort(design.request.poles.real), rel=1e-6)
    assert design.chosen.margins.modulus > 0.4
    assert "No poles were requested" in str(design)


@pytest.mark.slow
@pytest.mark.parametrize("name", RIGS)
def test_no_other_pace_is_quieter_with_as_much_margin(name):
    design = up.design(RIGS[name])
    pace = design.request.poles.real.max() / -design.request.proposed
    others = [up.design(RIGS[name], poles=design.request.poles * times / design.request.proposed) for times in PACES]
    widest = max(d.chosen.margins.modulus for d in others)
    assert design.chosen.margins.modulus >= NEARLY * widest
    louder = [d.chosen.command_noise for d in others if d.chosen.margins.modulus >= NEARLY * widest]
    assert design.chosen.command_noise == pytest.approx(min(louder))
    fall = np.linalg.eigvals(RIGS[name].linear("inverted").A).real.max()
    assert pace == pytest.approx(fall)


@pytest.mark.slow
def test_a_start_that_the_drive_cannot_take_asks_for_slower_poles():
    """Twice the tilt needs twice the command, at any pace; the pace that takes least is then the one."""
    mild, hard = (up.design(RIGS["furuta"], start={"theta": tilt}) for tilt in ("2 deg", "60 deg"))
    assert mild.peak_sampled <= 10
    peaks = [up.design(RIGS["furuta"], poles=hard.request.poles * t / hard.request.proposed, start={"theta": "60 deg"})
             .peak_sampled for t in PACES]  # fmt: skip
    assert hard.peak_sampled == pytest.approx(min(peaks))


@pytest.mark.parametrize(
    ("poles", "pace"),
    [
        ([3.0, -3.0, -0.1, 0.0], 3.0),
        ([-0.1 + 5j, -0.1 - 5j, -0.2 + 9j, -0.2 - 9j], abs(-0.1 + 5j)),
        ([-2.0, -8.0, 0.0], 2.0),
    ],
)
def test_a_model_s_pace_is_that_of_its_fall_its_swing_or_its_decay(poles, pace):
    assert own_pace(np.array(poles, dtype=complex)) == pytest.approx(pace)


def test_what_has_no_pace_of_its_own_is_asked_for_poles():
    with pytest.raises(BadInput, match="has no pace of its own; give either poles"):
        up.design(([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]]), period="10 ms")


@pytest.mark.slow
def test_no_pace_that_a_loop_can_hold_is_said():
    """A delay of half a second outlasts a fall by e every 0.13 s many times."""
    with pytest.raises(BadInput, match=r"no poles from 0\.7 to 2 times"):
        up.design(RIGS["furuta"], delay=250)


@pytest.mark.parametrize("at", ["hanging", "inverted"])
@pytest.mark.parametrize("name", RIGS)
def test_proposed_poles_are_real_a_quarter_of_the_first_apart_and_of_the_rig_s_own_pace(name, at):
    """Poles that meet make gains large; the pace is that of the fall upright, or of the slowest swing hanging."""
    rig = RIGS[name]
    poles = np.linalg.eigvals(rig.linear(at).A)
    pace = poles.real.max() if at == "inverted" else np.abs(poles[np.abs(poles.imag) > 1e-3]).min()
    request = up.design(rig, at=at).request
    assert request.proposed in (0.7, 1.0, 1.4, 2.0)
    np.testing.assert_allclose(request.poles, -request.proposed * pace * np.array([1.0, 1.25, 1.5, 1.75]), rtol=1e-9)


@pytest.mark.parametrize(
    ("poles", "pace"),
    [([3.0, 5.0, -1.0, -9.0], 5.0), ([-1 + 4j, -1 - 4j, -0.3 + 7j, -0.3 - 7j], math.sqrt(17)), ([-2.0, -5.0, 0.0], 2.0),
     ([1e-7, -5.0], 5.0)],
)  # fmt: skip
def test_the_own_pace_is_the_fastest_fall_else_the_slowest_swing_else_the_slowest_decay(poles, pace):
    assert own_pace(np.array(poles, dtype=complex)) == pytest.approx(pace)
