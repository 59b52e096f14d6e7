"""Does the board's tick last as long as it says? Its clock beside the host's, over so long that jitter is nothing."""

from __future__ import annotations

OFF = 0.03
"""Share by which two clocks may differ: a ceramic resonator is within 0.5 %, a wrong prescaler off by 2 and more."""
JITTER, LEAST = 0.03, 0.5
"""What a sample may be late by on its way at least [s], and the least time over which clocks are compared [s]."""


Sample = tuple[float, float]
"""Times of a sample by the board's clock and by the host's [s]."""


class TickLength:
    """Board's time and host's time since the first sample, and lately; late samples alone are not a slow tick.

    A sample that its host takes later than the board's watchdog waits is the last before the board's own fault, so that
    clocks have to be apart for two samples in a row.

    What a clock may be off by grows with the time since the first sample, so that a tick that changes later is not seen
    there for a long time. The promptest samples of successive pieces of `LEAST` show it: they too are apart by more
    than what is allowed twice in a row.
    """

    def __init__(self, watchdog: float = 0.0) -> None:
        self._late = max(JITTER, watchdog)
        self._first: Sample | None = None
        self._before: Sample | None = None
        self._promptest: Sample = (0.0, 0.0)
        self._end, self._off, self._apart = 0.0, False, False

    def sees(self, board: float, host: float) -> float:
        """Take the times of a sample [s]; the tick's length over what it should be, 1 while nothing is wrong."""
        now = board, host
        if self._first is None:
            self._first, self._promptest, self._end = now, now, host + LEAST
        lately = 1.0
        if host >= self._end:
            length = 1.0 if self._before is None else self._length(self._before, self._promptest)
            lately = length if self._off else 1.0
            self._before, self._promptest, self._end, self._off = self._promptest, now, host + LEAST, length != 1.0
        elif host - board < self._promptest[1] - self._promptest[0]:
            self._promptest = now
        if max(board - self._first[0], host - self._first[1]) < LEAST:
            return 1.0
        length = self._length(self._first, now)
        throughout, self._apart = length if self._apart else 1.0, length != 1.0
        return max(throughout, lately, key=lambda length: abs(length - 1.0))

    def _length(self, since: Sample, now: Sample) -> float:
        """Of a tick in between, over what it should be; 1 where lateness and two sound clocks explain it."""
        passed, truly = now[0] - since[0], now[1] - since[1]
        if passed <= 0 or abs(truly - passed) < self._late + OFF * max(passed, truly):
            return 1.0
        return truly / passed
