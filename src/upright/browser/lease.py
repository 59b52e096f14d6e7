"""Who operates a rig? One at a time, and for as long as they are there."""

from __future__ import annotations

import time
from collections.abc import Callable

PATIENCE = 10.0
"""How long an operator may be gone, as for a reload of the page, before the rig is free again [s]."""


class Lease:
    """The place of the operator of a rig.

    Attributes
    ----------
    holder : str
        Who has it; empty when it is free.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.holder, self._clock, self._gone_since = "", clock, -1.0

    def take(self, who: str) -> bool:
        """Whether they have it now."""
        self.lapsed()
        if not self.holder:
            self.holder, self._gone_since = who, -1.0
        return self.holder == who

    def give(self, who: str) -> None:
        """They no longer want it."""
        if self.holder == who:
            self.holder, self._gone_since = "", -1.0

    def gone(self, who: str) -> None:
        """Their last connection ended."""
        if self.holder == who:
            self._gone_since = self._clock()

    def back(self, who: str) -> None:
        """They have a connection again."""
        if self.holder == who:
            self._gone_since = -1.0

    def lapsed(self) -> bool:
        """Whether its holder has been gone for too long, just now; it is free then."""
        if self.holder and self._gone_since >= 0.0 and self._clock() - self._gone_since > PATIENCE:
            self.holder, self._gone_since = "", -1.0
            return True
        return False
