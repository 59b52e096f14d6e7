"""Is there one operator at a time, and is the place free again when they are gone?"""

from __future__ import annotations

from upright.browser.lease import PATIENCE, Lease


def lease():
    now = [100.0]
    return Lease(lambda: now[0]), now


def test_the_second_to_ask_gets_it_when_the_first_gives_it():
    place, _ = lease()
    assert place.take("a")
    assert place.take("a")
    assert not place.take("b")
    place.give("b")
    assert not place.take("b")
    place.give("a")
    assert place.take("b")


def test_who_comes_back_in_time_has_it_still_and_who_does_not_has_lost_it_once():
    place, now = lease()
    place.take("a")
    place.gone("b")  # nobody's business
    place.gone("a")
    now[0] += PATIENCE
    assert not place.lapsed()
    assert not place.take("b")
    place.back("a")
    now[0] += 10 * PATIENCE
    assert not place.lapsed()
    place.gone("a")
    now[0] += PATIENCE + 1
    assert place.lapsed()
    assert not place.lapsed()
    assert place.take("b")
