"""The gain at work: a rig, a law, and what came of putting them together."""

from upright.control.score import Score, Scores, score
from upright.control.swing_up import SwingUp, design_swing_up
from upright.control.trial import Trial, trial
from upright.rig import Rig

__all__ = ["Rig", "Score", "Scores", "SwingUp", "Trial", "design_swing_up", "score", "trial"]
