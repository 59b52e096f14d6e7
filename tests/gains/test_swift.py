"""Are the gains of a slider those of the design, and is what no slider can have refused?"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from upright.errors import BadInput
from upright.gains import place
from upright.gains.placement import swift_gains
from upright.rig.makes import MAKES, make_rig

MODELS = {name: make_rig(name).linear(at) for name in MAKES for at in make_rig(name).plant.equilibria}


@pytest.mark.parametrize("name", MODELS)
def test_they_agree_with_60_digits_as_far_as_the_model_is_conditioned(name):
    model = MODELS[name]
    n = len(model.A)
    poles = -np.linspace(4.0, 18.0, n) + 0j
    placed = place(model.A, model.B, poles)
    K = swift_gains(model.A, model.B, poles)
    assert np.abs(K - placed.K).max() <= 1e-14 * placed.condition * np.abs(placed.K).max()


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 20.0), st.floats(0.2, 0.999), st.floats(1.0, 40.0), st.floats(0.2, 0.999))
def test_their_loop_has_the_poles_wherever_two_pairs_are_dragged(w1, z1, w2, z2):
    model = MODELS["furuta"]
    pairs = [w * complex(-z, s * np.sqrt(1 - z**2)) for w, z in ((w1, z1), (w2, z2)) for s in (1, -1)]
    K = swift_gains(model.A, model.B, pairs)
    # of the characteristic polynomial, which does not mind poles that meet
    assert np.poly(model.A - model.B @ K) == pytest.approx(np.real(np.poly(pairs)), rel=1e-6, abs=1e-6 * w2**4)


def test_poles_that_meet_are_placed_and_what_cannot_be_placed_is_left_to_60_digits_or_refused():
    model = MODELS["furuta"]
    assert swift_gains(model.A, model.B, [-5.0] * 4) == pytest.approx(place(model.A, model.B, [-5.0] * 4).K, rel=1e-9)
    with pytest.raises(BadInput, match="conjugate"):
        swift_gains(model.A, model.B, [-5 + 1j, -5, -6, -7])
    assert swift_gains(np.diag([-1.0, 2.0]), [[1.0], [0.0]], [-3.0, -4.0]) is None
