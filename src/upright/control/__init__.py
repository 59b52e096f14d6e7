"""The gain at work: a rig, a law, and what came of putting them together."""

from upright.control.rig import Rig
from upright.control.score import Score, Scores, score
from upright.control.trial import Trial, trial

__all__ = ["Rig", "Score", "Scores", "Trial", "score", "trial"]
