"""The sampled law between readings and commands: linear (`Law`) or a function (`Rule`), in a simulation as on a rig."""

from __future__ import annotations

from upright.laws.linear import Law, state_feedback
from upright.laws.rule import Rule

__all__ = ["Law", "Rule", "state_feedback"]
