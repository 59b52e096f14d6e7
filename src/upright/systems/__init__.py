"""Linear models: one type, continuous or sampled, that knows its signals, its period and the point it holds about."""

from upright.systems.discretization import to_s, to_z
from upright.systems.state_space import LinearForm, StateSpace

__all__ = ["LinearForm", "StateSpace", "to_s", "to_z"]
