"""The gain at work: a rig, a law, and what came of putting them together."""

from upright.control.rig import Rig

__all__ = ["Rig"]
