"""Are jumps and spikes of a long signal found wherever they are? It is looked through in blocks."""

import numpy as np
import pytest

from upright.signals.spikes import jumps, spikes

EDGE = 1 << 16
N = 2 * EDGE + 100


def swing():
    t = np.arange(N) * 1e-3
    return t, np.round(500 * np.cos(3 * t))


@pytest.mark.parametrize("at", [EDGE - 2, EDGE - 1, EDGE, EDGE + 1, 2 * EDGE - 1, 2 * EDGE, N - 40])
def test_a_spike_is_found_at_the_edge_of_a_block(at):
    t, x = swing()
    x[at] += 3000
    assert spikes(x, 1.0).tolist() == [at]
    found = jumps(t, x, 1.0)
    assert found.spikes.tolist() == [at]
    assert found.spike_sizes == pytest.approx([3000], abs=5)
    assert found.steps.size == 0


@pytest.mark.parametrize("at", [EDGE - 5, EDGE - 1, EDGE, EDGE + 1, EDGE + 6])
def test_a_lasting_jump_is_found_at_the_edge_of_a_block(at):
    t, x = swing()
    x[at:] += 700
    found = jumps(t, x, 1.0)
    assert found.steps.tolist() == [at]
    assert found.step_sizes == pytest.approx([700], abs=5)


def test_a_long_swing_has_neither():
    assert not jumps(*swing(), 1.0)
