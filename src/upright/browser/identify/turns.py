"""Who is next? Tasks that take a processor for a minute, one after the other in the order in which they came."""

from __future__ import annotations

import threading


class Turns:
    """A queue, of one rig or of all rigs of a class."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._queue: list[Turn] = []

    def join(self) -> Turn:
        """A place at its end."""
        with self._changed:
            self._queue.append(turn := Turn(self._changed, self._queue))
        return turn


class Turn:
    """A place in a queue; `Turns` gives it."""

    def __init__(self, changed: threading.Condition, queue: list[Turn]) -> None:
        self._changed, self._queue = changed, queue

    @property
    def before(self) -> int:
        """How many are to be through before it."""
        with self._changed:
            return self._queue.index(self) if self in self._queue else 0

    def wait(self) -> bool:
        """Wait until it is first; False where it was left meanwhile."""
        with self._changed:
            self._changed.wait_for(lambda: self not in self._queue or self._queue[0] is self)
            return self in self._queue

    def leave_waiting(self) -> bool:
        """Leave the queue unless it is first; whether it waited."""
        with self._changed:
            waited = self in self._queue and self._queue[0] is not self
            if waited:
                self._queue.remove(self)
                self._changed.notify_all()
            return waited

    def leave(self) -> None:
        """It is through; the next one is first."""
        with self._changed:
            if self in self._queue:
                self._queue.remove(self)
            self._changed.notify_all()
