"""The sampled law between readings and commands: linear (`Law`) or a function (`Rule`), in a simulation as on a rig."""

from __future__ import annotations

from upright.laws.at_work import AtWork, at_work
from upright.laws.linear import Law, state_feedback
from upright.laws.rule import Rule
from upright.laws.values import as_values, of_values

__all__ = ["AtWork", "Law", "Rule", "as_values", "at_work", "of_values", "state_feedback"]
