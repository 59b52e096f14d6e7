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
    for unit in (1.0, 1e-6, 1e6):
        assert spikes(unit * x).tolist() == ([1000] if seen else [])


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


@pytest.mark.parametrize(("size", "seen"), [(3.0, False), (5.0, True), (4.5, False)])
def test_of_two_values_alone_counts_differ_by_whole_ones(size, seen):
    """A spike stands out by four steps: of counts a step is 1, of anything else all that the two differ by."""
    x = np.full(400, 7.0)
    x[200] += size
    assert spikes(x).tolist() == ([200] if seen else [])


def test_a_record_of_less_than_four_surroundings_shows_no_jump():
    for n, seen in ((23, []), (24, [12])):
        found = jumps(0.01 * np.arange(n), np.where(np.arange(n) < 12, 0.0, 90.0) + np.arange(n), 1.0)
        assert found.steps.tolist() == seen
        assert bool(found) == bool(seen)
        assert (found.modulus, found.wraps.size, found.spikes.size) == (0.0, 0, 0)


def test_anything_that_jumps_is_a_jump():
    t, clean = (signal[:2000] for signal in swing())
    assert not jumps(t, clean, 1.0)
    for change in ("steps", "spikes", "wraps"):
        x = clean.copy()
        x[1000 : 1001 if change == "spikes" else None] += 4096 if change == "wraps" else 700
        found = jumps(t, x, 1.0, (4096,))
        assert found
        assert [kind for kind in ("steps", "spikes", "wraps") if getattr(found, kind).size] == [change]
        assert found.modulus == (4096 if change == "wraps" else 0)


def test_noise_at_the_edge_of_a_counter_turns_it_there_and_back():
    t, clean = (signal[:2000] for signal in swing())
    x = clean.copy()
    x[1000] += 4096
    x[1500:] += 4096
    found = jumps(t, x, 1.0, (4096,))
    assert found.wraps.tolist() == [1000, 1001, 1500]
    assert found.spikes.size == 0
    assert found.mended(x).tolist() == clean.tolist()


@pytest.mark.parametrize("gap", [3, 8])
def test_what_moves_on_while_samples_are_missing_does_not_jump(gap):
    """At its fastest it goes 1.5 counts a millisecond."""
    t, x = (signal[:2000] for signal in swing())
    fastest = round(np.pi / 2 / 3 / 1e-3)
    kept = np.r_[:fastest, fastest + gap : 2000]
    assert not jumps(t[kept], x[kept], 1.0)
    # a real one beside the gap is still found
    x[fastest + 40 :] += 700
    assert jumps(t[kept], x[kept], 1.0).steps.tolist() == [fastest + 40 - gap]


def test_a_jump_is_found_although_every_third_sample_comes_late():
    """At 1.5 counts a millisecond steps of time of 1, 1 and 4 ms make 1.5, 1.5 and 6 counts; the jump is one of 60."""
    t = np.cumsum(np.tile([1e-3, 1e-3, 4e-3], 300))
    x = 1500.0 * t
    assert not jumps(t, x, 1.0)
    x[450:] += 60
    found = jumps(t, x, 1.0)
    assert found.steps.tolist() == [450]
    assert found.step_sizes == pytest.approx([60], abs=1e-6)


@pytest.mark.parametrize(("missing", "spike"), [(999, False), (1001, False), (997, True), (1003, True)])
def test_an_outlier_beside_a_missing_sample_may_be_motion(missing, spike):
    t, x = (signal[:2000] for signal in swing())
    x[1000] += 700
    found = jumps(np.delete(t, missing), np.delete(x, missing), 1.0)
    assert found.spikes.tolist() == ([1000 - (missing < 1000)] if spike else [])


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
