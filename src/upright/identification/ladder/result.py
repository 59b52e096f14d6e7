"""What did a ladder come to? Every rung with its scores, its price and the reason why it stayed or went."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from upright.identification.ladder.decision import Comparison
from upright.identification.ladder.repeats import Repeats
from upright.identification.ladder.rungs import Rung
from upright.identification.model.model import Rig, Run, RunScore

Percents = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, kw_only=True)
class Step:
    """What one rung came to.

    Attributes
    ----------
    rung : Rung
    kept : bool
    reason : str
        Why, in a sentence.
    fitted, predicted : mapping of str to mapping of str to float
        Fit percent by run and signal.
    cost : float
        Sum of squares of the fit.
    parameters, own : int
        Numbers sought for the rig, and for single runs.
    values : mapping of str to float
        Of the parameters sought, by name.
    seconds : float
    comparison : Comparison or None
        With the best rung below; None for the first.
    """

    rung: Rung
    kept: bool
    reason: str
    fitted: Percents
    predicted: Percents
    cost: float
    parameters: int
    own: int
    values: Mapping[str, float]
    seconds: float
    comparison: Comparison | None = None

    @property
    def fit_percent(self) -> float:
        """Mean over runs and signals."""
        return _mean(self.fitted)

    @property
    def predicted_percent(self) -> float:
        """Mean over runs and signals."""
        return _mean(self.predicted)


@dataclass(frozen=True, kw_only=True)
class Ladder:
    """A model grown as far as it predicts better.

    Attributes
    ----------
    steps : tuple of Step
        In the order tried.
    rig, runs : Rig, tuple of Run
        Of the chosen model: what was refused is known to do nothing.
    held_out : str
        How prediction was judged, in words.
    repeats : tuple of Repeats
        Runs that repeat one another.
    stopped : str
        Why the ladder ended, in a sentence.
    scores : mapping of str to RunScore
        Predictions of the chosen model.
    left_out : tuple of str
        Parameters asked for that the chosen model does without.
    warnings : tuple of str
    interrupted : bool
    seconds : float
    """

    steps: tuple[Step, ...]
    rig: Rig
    runs: tuple[Run, ...]
    held_out: str
    repeats: tuple[Repeats, ...]
    stopped: str
    scores: Mapping[str, RunScore]
    left_out: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    interrupted: bool = False
    seconds: float = 0.0

    @property
    def kept(self) -> tuple[Step, ...]:
        """The rungs that earned their place."""
        return tuple(s for s in self.steps if s.kept)


def reason(comparison: Comparison | None, cost: float, before: float, *, lucky: bool = False) -> str:
    """Why a rung is kept or refused, in a sentence; `cost` and `before` are of its fit and the poorer one's.

    A `lucky` fit is no closer than numbers that mean nothing would make it.
    """
    if comparison is None:
        return "The first rung: where the ladder starts."
    said = comparison.sentence()
    if lucky:
        return f"Refused: the fit is no closer than chance makes it; {said}."
    if comparison.better:
        return f"Kept: {said}."
    closer = 1 - math.sqrt(cost / before) if before > 0 else 0.0
    if comparison.gain <= 0 and closer > 0.03:
        return f"Refused: {said}, although the fit is {100 * closer:.3g} % closer: it explains what does not come back."
    return f"Refused: {said}."


def _mean(percents: Percents) -> float:
    values = [v for signals in percents.values() for v in signals.values()]
    return float(np.mean(values)) if values else math.nan
