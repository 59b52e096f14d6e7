"""Does the picture of a machine's lateness hold every tick, in microseconds?"""

from __future__ import annotations

import numpy as np
import pytest

from upright.realtime.jitter import Jitter
from upright.realtime.priority import LoopPriority
from upright.running.figures import jitter_figure


def test_every_tick_is_in_the_histogram_and_lines_stand_at_the_period_and_the_quantiles():
    """Ticks from next to nothing to 30 ms behind; the axis begins at 0.1 us and ends with the decade of the last."""
    behind = np.concatenate([np.zeros(10), np.geomspace(1e-6, 30e-3, 1001)])
    found = Jitter(
        period=2e-3, behind=behind, overslept=behind, late=0, work=np.full(behind.size, 1e-5),
        standing=LoopPriority(priority="FIFO", locked=True),
    )  # fmt: skip
    (axis,) = jitter_figure(found).axes
    assert sum(bar.get_height() for bar in axis.patches) == behind.size
    edges = [bar.get_x() for bar in axis.patches] + [axis.patches[-1].get_x() + axis.patches[-1].get_width()]
    assert (edges[0], edges[-1]) == (pytest.approx(0.1), pytest.approx(1e5))
    solid, *dashed = axis.get_lines()
    assert solid.get_xdata()[0] == pytest.approx(2000)
    at = [np.percentile(1e6 * behind, share) for share in (50, 99, 99.9, 100)]
    assert [line.get_xdata()[0] for line in dashed] == pytest.approx(at)
    assert [text.get_position()[0] for text in axis.texts] == pytest.approx([2000, *at])
    assert [text.get_text() for text in axis.texts] == [" a period", " p50", " p99", " p99.9", " max"]
