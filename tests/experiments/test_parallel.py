"""Do experiments side by side begin in the order that ends soonest, and is each handed what it needs?"""

from __future__ import annotations

from upright.experiments.parallel import run_parallel
from upright.workers import HERE

SECONDS = {"a": 1.0, "b": 5.0, "c": 2.0, "d": 2.0}
NEEDS = {"a": (), "b": (), "c": ("a",), "d": ("c", "b")}


def ran(trouble=""):
    """What each was handed, in the order in which they began, and the shares that were told."""
    handed, told = {}, []

    def one(key, results, progress):
        handed[key] = dict(results)
        progress("half-way", 0.5)
        if key == trouble:
            raise KeyboardInterrupt
        return key.upper()

    results, interrupted = run_parallel(SECONDS, NEEDS, one, HERE, lambda step, share: told.append((step, share)))
    return handed, results, interrupted, told


def test_the_longest_of_those_that_can_begin_begins_first_with_the_results_that_it_needs():
    handed, results, interrupted, _ = ran()
    assert list(handed) == ["b", "a", "c", "d"]
    assert handed == {"a": {}, "b": {}, "c": {"a": "A"}, "d": {"c": "C", "b": "B"}}
    assert results == {key: key.upper() for key in SECONDS}
    assert not interrupted


def test_the_bar_stands_where_the_seconds_say_and_names_what_runs():
    """Ten seconds in all: a and b are six of them, c two, d two."""
    *_, told = ran()
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    for names, low, high in (("a, b", 0.0, 0.6), ("c", 0.6, 0.8), ("d", 0.8, 1.0)):
        own = [share for step, share in told if step.startswith(f"experiments {names}")]
        assert (round(min(own), 9), round(max(own), 9)) == (low, high)


def test_ctrl_c_keeps_what_is_finished_and_begins_nothing_more():
    handed, results, interrupted, _ = ran("c")
    assert list(handed) == ["b", "a", "c"]
    assert results == {"a": "A", "b": "B"}
    assert interrupted
