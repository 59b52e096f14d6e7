"""Does a client that takes nothing lose frames, the oldest first, and never what it was told?"""

from __future__ import annotations

import asyncio

from upright.browser.outbox import FRAMES, NOTES, Outbox


def test_the_newest_frames_wait_and_notes_come_first():
    async def scenario():
        box = Outbox()
        for k in range(10):
            box.frame(bytes([k]))
        box.note("a")
        box.note("b")
        out = [await box.next() for _ in range(2 + FRAMES)]
        return box.lost, out

    lost, out = asyncio.run(scenario())
    assert out == ["a", "b", *(bytes([k]) for k in range(10 - FRAMES, 10))]
    assert lost == 10 - FRAMES


def test_who_waits_is_woken_by_what_comes():
    async def scenario():
        box = Outbox()
        waiting = asyncio.create_task(box.next())
        await asyncio.sleep(0)
        assert not waiting.done()
        box.frame(b"x")
        return await waiting

    assert asyncio.run(scenario()) == b"x"


def test_notes_that_nobody_takes_do_not_pile_up():
    box = Outbox()
    assert [box.note("x") for _ in range(NOTES + 3)] == [True] * NOTES + [False] * 3
