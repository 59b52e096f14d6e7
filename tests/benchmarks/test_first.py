"""A stranger's log in three dialects is one log, and what moves in it is found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.first import DIALECTS, Source, moving, written
from upright.readers import read


def source() -> Source:
    t = np.arange(1000) * 0.005
    theta = np.where((t > 1) & (t < 4), np.sin(6 * (t - 1)), 0.0)
    return Source(name="a swing", t=t, columns={"theta": ("rad", theta), "u": ("V", 0 * t)})


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_dialect_says_the_same_angle_and_the_same_time(dialect: str, tmp_path: Path) -> None:
    log = source()
    record = read(written(log, dialect, tmp_path))
    column = next(n for n in record.names if n.startswith("theta"))
    per = np.pi / 180 if dialect == "milliseconds" else 1.0
    assert record.t == pytest.approx(log.t, abs=1e-9)
    assert per * record[column] == pytest.approx(log.columns["theta"][1], abs=1e-8)


def test_a_signal_that_rests_before_and_after_moves_between() -> None:
    first, last = moving(source())
    assert first == pytest.approx(1.0, abs=0.25)  # the window by which motion is told
    assert last == pytest.approx(4.0, abs=0.25)
