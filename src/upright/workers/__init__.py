"""Where what is many is computed: in this process, in several, or on a cluster; the numbers are the same."""

from __future__ import annotations

from upright.workers.blocks import cut
from upright.workers.linear_algebra import one_thread
from upright.workers.spread import HERE, Finished, Workers, spread
from upright.workers.threads import cores, one_core, share

__all__ = ["HERE", "Finished", "Workers", "cores", "cut", "one_core", "one_thread", "share", "spread"]
