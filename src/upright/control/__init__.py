"""The gain at work: a rig, a law, and what came of putting them together."""

from upright.control.score import Score, Scores, score
from upright.control.swing_up import SwingUp, design_swing_up
from upright.control.trial import ServoRig, Trial, trial

__all__ = ["Score", "Scores", "ServoRig", "SwingUp", "Trial", "design_swing_up", "score", "trial"]
