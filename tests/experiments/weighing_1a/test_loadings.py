"""Which swings of labelled logs are weighed, and what is said of a log in which none can be seen?"""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from upright.errors import NotIdentifiable
from upright.experiments.weighing_1a import loadings
from upright.experiments.weighing_1a.loadings import weigh

LOGS = dict.fromkeys(("bare", "half", "one", "still"), "record")
ADDED = (0.0, 0.5, 1.0, 2.0)


@pytest.fixture
def seen(monkeypatch):
    """Two swings of each log but the last, one of them under a command; what is fitted is noted."""
    fitted = []

    def swings(record, *, added, label, signal, command):
        assert (record, signal, command) == ("record", "x", "u")
        if label == "still":
            raise NotIdentifiable("still: it does not swing.")
        return [SimpleNamespace(added=added, label=label, command=c) for c in (0.0, 1.0)]

    monkeypatch.setattr(loadings, "swings", swings)
    monkeypatch.setattr(loadings, "fit_loadings", lambda found, **more: fitted.append((found, more)) or "line")
    return fitted


def weighed(*labels, **more):
    logs = {label: LOGS[label] for label in labels}
    added = [ADDED[list(LOGS).index(label)] for label in labels]
    return weigh(logs, added, dict.fromkeys(logs, "x"), dict.fromkeys(logs, "u"), **more)


def test_swings_at_zero_command_are_counted_alone_where_that_is_asked(seen):
    assert weighed("bare", "half", tolerance=0.002, piece=0.5) == ("line", ())
    assert weighed("bare", "half", free=True) == ("line", ())
    (every, how), (free, _) = seen
    assert [(s.label, s.command) for s in every] == [("bare", 0.0), ("bare", 1.0), ("half", 0.0), ("half", 1.0)]
    assert [(s.label, s.command) for s in free] == [("bare", 0.0), ("half", 0.0)]
    assert how == {"tolerance": 0.002, "piece": 0.5}


def test_a_log_that_does_not_swing_is_left_out_as_long_as_two_loadings_stay(seen):
    assert weighed("bare", "half", "still") == ("line", ("still: it does not swing.",))
    with pytest.raises(NotIdentifiable, match="it does not swing"):
        weighed("bare", "still")
    assert weighed("bare")[1] == ()  # what makes no line is for the fit to say
