"""Which law closed the loop? How programs write laws, their recovery from a log, and the law of a run."""

from __future__ import annotations

from upright.closed_loop.recovery import Gain, Recovery
from upright.closed_loop.search import recover_law
from upright.closed_loop.structures import Channel, ClosedLoop, Filter, joined, pid

__all__ = ["Channel", "ClosedLoop", "Filter", "Gain", "Recovery", "joined", "pid", "recover_law"]
