"""A rig: a plant with its numbers, its drive, encoders and servo, each with its source, and what a fit allows."""

from upright.rig.hardware import Entry, Hardware
from upright.rig.rig import Rig

__all__ = ["Entry", "Hardware", "Rig"]
