"""Which of the plants that a log's columns could be of explains its accelerations?

Each plant is drafted for the log, and its numbers are regressed on the smoothed accelerations, which takes a tenth of a
second. A fit from a draft's guesses takes seconds and may stay in a valley where the right plant scores worst.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from upright.errors import BadInput
from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.identification.search.starts import Sample, regress, samples_of
from upright.records import Record
from upright.study.load import load_study

LONGEST = 60_000
"""Samples of a log that are looked at; more tell no more."""

MOST = 1500
"""Samples of a run that accelerations are regressed on."""

SPRUNG = {"N/m": "kg", "N m/rad": "kg m^2"}
"""Units of stiffnesses, and of what they hold."""

MIRRORED = 3
"""Coordinates of a plant up to which sensors are tried the other way round as well."""

DOUBTFUL, CLEAR = 0.1, 0.5
LITTLE, BY_FAR = 0.02, 0.1
"""A plant that leaves more than the first is worse than one that leaves less than the second of it; two whose
accelerations were smoothed over other spans are not distinguished by less. Of a double pendulum's angles a Furuta
pendulum, its arm's length estimated, explains 96 %.
"""


def explained(record: Record, drafts: Mapping[str, str], log: str) -> dict[str, float]:
    """Share of the variance of the accelerations that each plant explains, 0 to 1, the best first.

    Of a coordinate whose motion a draft prescribes, although a command drives the rig, it explains nothing.

    Parameters
    ----------
    drafts : mapping of str to str
        Text of a study of it by plant; one that cannot be read, or has a coordinate without a column, is left out.
    log : str
        How they name the log.
    """
    shares: dict[str, float] = {}
    for plant, text in drafts.items():
        try:
            study = load_study(Path("draft.toml"), text=text, records={log: record})
        except BadInput:
            continue
        moving = [c for run in study.runs for c in run.measured if c not in run.held]
        others = tuple(dict.fromkeys(moving))[1:] if len(study.model.plant.coordinates) <= MIRRORED else ()
        left = math.inf
        for signs in itertools.product((1.0, -1.0), repeat=len(others)):
            samples = samples_of(study.model, study.runs, most=MOST, flips=dict(zip(others, signs, strict=True)))
            left = min(left, regress(sprung(study.model, samples[0]), samples).unexplained) if samples else left
        if math.isfinite(left):
            shares[plant] = max(0.0, 1 - left) * _part_left_free(study.runs)
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def _part_left_free(runs: Sequence[Run]) -> float:
    """Share of the coordinates of driven runs whose motion is not prescribed, of those that move."""
    free = {c for run in runs for c in run.measured if c not in run.held}
    moved = {c for run in runs if run.u.any() for c, motion in run.held.items() if isinstance(motion, np.ndarray)}
    return len(free) / len(free | moved)


def sprung(rig: GreyBox, sample: Sample) -> GreyBox:
    """The rig with every spring estimated that a draft leaves out until a log shows it; guesses swing like the log."""
    w = 2 * math.pi / sample.period
    held = {p.unit: p.value for p in rig.parameters.values() if p.unit in SPRUNG.values() and p.value}
    left_out = [p for p in rig.parameters.values() if p.unit in SPRUNG and not p.estimate and not p.value]
    springs = {
        p.name: replace(p, value=held[SPRUNG[p.unit]] * w**2, estimate=True, lower=0.0)
        for p in left_out
        if SPRUNG[p.unit] in held
    }
    return replace(rig, parameters={**rig.parameters, **springs})
