"""Does the tail of a log wait for its writer as long as it was asked to?"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import upright as up
from tests.logs.test_file import written
from upright.errors import BadInput
from upright.verbs import logs


@pytest.fixture
def clock(monkeypatch):
    """Virtual time, in which a wait is over at once; `later` is done once three seconds have passed."""
    state = SimpleNamespace(now=100.0, later=lambda: None)

    def wait(seconds):
        before, state.now = state.now, state.now + seconds
        if before < 103.0 <= state.now:
            state.later()

    monkeypatch.setattr(logs, "time", SimpleNamespace(monotonic=lambda: state.now))
    monkeypatch.setattr(logs, "threading", SimpleNamespace(Event=lambda: SimpleNamespace(wait=wait)))
    return state


@pytest.mark.parametrize("patience", [0.5, 20.0])
def test_a_writer_that_falls_silent_is_waited_for_as_long_as_was_asked(tmp_path, clock, patience):
    path = tmp_path / "run.mcap"
    path.write_bytes(written(200, finish=False))
    assert sum(part.columns["t"].size for part in up.log_tail(path, patience=patience)) == 200
    assert clock.now - 100.0 == pytest.approx(patience, abs=0.06)


@pytest.mark.parametrize(("patience", "whole"), [(0.0, True), (20.0, True), (2.0, False)])
def test_a_writer_that_goes_on_is_followed_to_its_end(tmp_path, clock, patience, whole):
    """The second half of the file comes after three seconds; with no patience said it is waited for, for ever."""
    path, data = tmp_path / "run.mcap", written(200, every=50)
    path.write_bytes(data[: len(data) // 2])
    clock.later = lambda: path.write_bytes(data)
    ticks = np.concatenate([part.columns["tick"] for part in up.log_tail(path, patience=patience)])
    assert ticks.tolist() == list(range(200 if whole else 100)), ticks.size


def test_patience_begins_anew_with_every_chunk(tmp_path, clock):
    path, data = tmp_path / "run.mcap", written(200, every=50, finish=False)
    path.write_bytes(data[: len(data) // 2])
    clock.later = lambda: path.write_bytes(data)
    list(up.log_tail(path, patience=4.0))
    assert clock.now - 103.0 == pytest.approx(4.0, abs=0.11)


def test_a_log_that_is_not_there_is_said(tmp_path):
    with pytest.raises(BadInput, match="There is no file"):
        next(iter(up.log_tail(tmp_path / "run.mcap")))
