"""Does the board's tick last as long as it says? Its clock beside the host's, over so long that jitter is nothing."""

from __future__ import annotations

OFF = 0.03
"""Share by which two clocks may differ: a ceramic resonator is within 0.5 %, a wrong prescaler off by 2 and more."""
JITTER, LEAST = 0.03, 0.5
"""What a sample may be late by on its way [s], and the least time over which clocks are compared [s]."""


class TickLength:
    """Board's time and host's time since the first sample; late samples alone are not a slow tick."""

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None

    def sees(self, board: float, host: float) -> float:
        """Take the times of a sample [s]; the tick's length over what it should be, 1 while nothing is wrong."""
        if self._first is None:
            self._first = board, host
        passed, truly = board - self._first[0], host - self._first[1]
        if max(passed, truly) < LEAST or abs(truly - passed) < JITTER + OFF * max(passed, truly) or passed <= 0:
            return 1.0
        return truly / passed
