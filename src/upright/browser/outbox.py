"""What waits for one client: a slow one loses frames, and holds nobody up."""

from __future__ import annotations

import asyncio
from collections import deque

FRAMES = 4
"""Frames that wait for a client; the oldest is dropped for a new one."""
NOTES = 64
"""Notes that wait; who lets more of them pile up is gone."""


class Outbox:
    """Frames and notes for a client; notes are sent first, in their order.

    Attributes
    ----------
    lost : int
        Frames that were dropped.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._frames: deque[bytes] = deque()
        self._notes: deque[str] = deque()
        self._more = asyncio.Event()

    @property
    def behind(self) -> bool:
        """Whether a frame still waits."""
        return bool(self._frames)

    def frame(self, content: bytes) -> None:
        """Let a frame wait."""
        if len(self._frames) == FRAMES:
            self._frames.popleft()
            self.lost += 1
        self._frames.append(content)
        self._more.set()

    def note(self, text: str) -> bool:
        """Let a note wait; False when there is no place for it."""
        if len(self._notes) >= NOTES:
            return False
        self._notes.append(text)
        self._more.set()
        return True

    async def next(self) -> str | bytes:
        """What is sent next."""
        while not self._notes and not self._frames:
            self._more.clear()
            await self._more.wait()
        return self._notes.popleft() if self._notes else self._frames.popleft()
