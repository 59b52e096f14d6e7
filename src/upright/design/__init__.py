"""Which gain does the rig need, and what is it worth? A linear model goes in, wherever its numbers came from."""

from upright.design.placement import Placement, place

__all__ = ["Placement", "place"]
