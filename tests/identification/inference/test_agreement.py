"""What counts as agreement of two parts of one rig's logs, and what a run is cut into."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.agree import Pair, Part, cut, told
from tests.identification.twins import swing
from upright.errors import BadInput


def pair(first: tuple[float, float], second: tuple[float, float], values: tuple[float, float]) -> Pair:
    parts = Part("study", "run", 0), Part("study", "run", 1)
    return Pair(
        kind="halves", parts=parts, name="b_2", values=values, intervals=(first, second), unit="1", trusted=True
    )


def test_intervals_that_share_a_value_agree_and_wide_ones_are_counted_apart() -> None:
    near, apart = pair((1.0, 2.0), (2.0, 3.0), (1.5, 2.5)), pair((1.0, 2.0), (2.1, 3.0), (1.5, 2.5))
    wide = pair((0.0, 26.0), (2.0, 3.0), (1.5, 2.5))
    assert (near.agrees, apart.agrees, wide.agrees) == (True, False, True)
    assert wide.width == pytest.approx(26.0 / 2.5)
    assert told([near, apart, wide]).startswith("1 of 2 pairs agree, 50 %")


def test_halves_share_no_sample_and_leave_the_rest_out() -> None:
    run = swing(seconds=10.0)
    rested = np.concatenate([run.y, np.zeros((1000, 1))])
    run = replace(run, t=np.arange(len(rested)) * 0.01, u=np.zeros((len(rested), 1)), y=rested, resolution=(1e-3,))
    first, second = (cut(run, half) for half in (0, 1))
    assert np.concatenate([first.y, second.y]) == pytest.approx(rested[: first.t.size + second.t.size])
    assert first.t.size + second.t.size <= 1001
    assert first.t[0] == second.t[0] == 0.0


def test_a_half_that_hardly_moves_is_refused() -> None:
    with pytest.raises(BadInput, match="second half moves"):
        cut(replace(swing(seconds=10.0), y=np.exp(-np.arange(1001) / 200)[:, None], resolution=(2e-3,)), 1)
