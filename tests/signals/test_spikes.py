"""Are jumps and spikes of a long signal found wherever they are? It is looked through in blocks."""

import numpy as np
import pytest

from upright.signals.spikes import jumps, spikes, without

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


@pytest.mark.parametrize("at", [1, 2, 3, -4, -3, -2])
@pytest.mark.parametrize("size", [3000, -3000])
def test_a_spike_is_found_as_far_as_the_second_sample_from_either_end(at, size):
    """Of the outermost ones nobody can say whether they or all the others are off."""
    x = swing()[1][:2000]
    x[at] += size
    assert spikes(x, 1.0).tolist() == [at % x.size]
    x[at] -= size
    x[[0, -1]] += size
    assert spikes(x, 1.0).size == 0


@pytest.mark.parametrize("at", [1, 3, 5, 6, 7, -1, -3, -6, -7])
def test_a_lasting_jump_is_found_at_either_end(at):
    t, x = (signal[:2000] for signal in swing())
    x[at:] += 700
    found = jumps(t, x, 1.0)
    if abs(at) == 1:  # one sample is an outlier, not a level
        assert found.steps.size + found.spikes.size == 1
    else:
        assert found.steps.tolist() == [at % x.size]
        assert found.step_sizes == pytest.approx([700], abs=5)


@pytest.mark.parametrize(("back", "seen"), [(10, True), (7, True), (13, True), (5, False), (0, False), (18, False)])
def test_a_spike_comes_back_by_about_as_much_as_it_went(back, seen):
    """To within 0.4 of the larger of the two; what stays away is a jump, what goes on is one the other way."""
    t = 1e-3 * np.arange(2000)
    x = np.cos(3 * t)
    x[1000] += 10
    x[1001:] += 10 - back
    assert spikes(x).tolist() == ([1000] if seen else [])


@pytest.mark.parametrize(("width", "seen"), [(1, True), (2, True), (3, False)])
def test_a_spike_is_two_samples_wide_at_most(width, seen):
    t = 1e-3 * np.arange(2000)
    x = np.cos(3 * t)
    x[1000 : 1000 + width] += 10
    assert spikes(x).tolist() == (list(range(1000, 1000 + width)) if seen else [])


def test_a_signal_without_its_spikes_runs_straight_between_their_neighbours():
    x = np.array([1.0, 50.0, 3.0, -7.0, 60.0, 6.0, 99.0])
    assert without(x, np.array([1, 3, 4, 6])).tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 6.0]
    assert without(x, np.array([], dtype=int)).tolist() == x.tolist()


def test_a_mended_column_is_what_it_was():
    t, clean = (signal[:2000] for signal in swing())
    x = clean.copy()
    x[700:] += 400
    x[1200:] -= 700
    x[300] += 3000
    found = jumps(t, x, 1.0)
    assert found.mended(x) == pytest.approx(clean, abs=5)


def test_a_counter_that_turns_over_is_unwrapped():
    """12 bits, over its upper edge and back under it."""
    t = 1e-3 * np.arange(2000)
    clean = np.round(3000 * np.sin(np.pi * t))
    wrapped = (clean + 2048) % 4096 - 2048
    found = jumps(t, wrapped, 1.0)
    assert found.modulus == 4096
    assert found.wraps.tolist() == (np.flatnonzero(np.abs(np.diff(wrapped)) > 2048) + 1).tolist()
    assert found.steps.size == found.spikes.size == 0
    assert found.mended(wrapped).tolist() == clean.tolist()


def test_a_long_swing_has_neither():
    assert not jumps(*swing(), 1.0)
