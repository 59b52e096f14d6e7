"""Are stretches, pieces and turns of samples counted rightly, from the first sample to the last?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.signals.stretches import pieces, stretches, turning_points


def mask(text):
    return np.array([letter == "x" for letter in text])


@pytest.mark.parametrize(
    ("where", "gap", "expected"),
    [
        ("x.xx..x", 1, [(0, 0), (2, 3), (6, 6)]),
        ("x.xx..x", 2, [(0, 3), (6, 6)]),
        ("x.xx..x", 3, [(0, 6)]),
        (".x.", 1, [(1, 1)]),
        ("xxx", 1, [(0, 2)]),
        ("...", 1, []),
    ],
)
def test_a_stretch_runs_from_its_first_place_to_its_last(where, gap, expected):
    assert stretches(mask(where), gap=gap) == expected


@pytest.mark.parametrize(
    ("cut", "expected"),
    [
        (".x..x", [(2, 5), (0, 2), (5, 6)]),  # six samples, cut after the second and after the fifth
        ("x....", [(1, 6), (0, 1)]),
        ("....x", [(0, 5), (5, 6)]),
        (".....", [(0, 6)]),
        ("", [(0, 1)]),
    ],
)
def test_pieces_hold_every_sample_once_and_come_longest_first(cut, expected):
    assert pieces(mask(cut)) == expected


@pytest.mark.parametrize(
    ("x", "least", "inside", "whole"),
    [
        ([0, 3, 2, 3, 0], 1.0, [1, 2, 3], [0, 1, 2, 3, 4]),  # it turns back by exactly 1
        ([0, 3, 2, 3, 0], 1.1, [1], [0, 1, 4]),
        ([0, 3, 2, 3, 0], 3.1, [], []),
        ([1, 0, 5, 5, 2, 4], 2.0, [2, 4], [1, 2, 4, 5]),  # the first of two equal ones
        ([5, 4, 3], 1.0, [], [0, 2]),
        ([2], 1.0, [], []),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_motion_turns_where_it_goes_back_by_at_least_so_much(x, least, inside, whole, sign):
    """Upside down it turns at the same samples; ends are turns that nobody saw."""
    signal = sign * np.array(x, dtype=float)
    assert turning_points(signal, least).tolist() == inside
    assert turning_points(signal, least, ends=True).tolist() == whole
