"""Experiment 4 at a rig: a hand lifts the pendulum and lets go, twice; one swing is fitted, the other predicted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from upright.errors import NotIdentifiable
from upright.experiments.stand.fits import fit_study
from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import TestStand, file_of
from upright.experiments.stand.studies import write_study
from upright.identification.model.fit import Fit
from upright.progress import Progress, part
from upright.records import Record
from upright.rig.makes import MAKES
from upright.signals.release import free_from
from upright.study.load import Study

HIGH, LOW = math.radians(75), math.radians(50)
"""How high the pendulum is lifted, for the run that is fitted and the one that is predicted."""
HAND, SWING = 15.0, 15.0
"""Time that a person has to lift it and let go, and time for which it swings [s]."""
CLEAR = math.radians(15)
"""A pendulum that was lifted less was not lifted."""


def run_by_hand(
    stand: TestStand, folder: Path, progress: Progress, known: Sequence[Known]
) -> tuple[Study, Fit]:  # fmt: skip
    """Let it swing and fit; leaves logs, `study.toml` and `fit.json`.

    Parameters
    ----------
    known : sequence of Known
        What earlier experiments say of the body that carries the pendulum: nothing else gives a free swing its scale.

    Raises
    ------
    RigStopped
        When the rig was stopped by a limit.
    NotIdentifiable
        When no release is seen.
    """
    names = stand.names
    runs: list[dict[str, Any]] = []
    for i, (role, angle) in enumerate((("fit", HIGH), ("predict", LOW))):
        progress(f"swinging from about {math.degrees(angle):.0f} degrees", 0.2 * i)
        stand.ask(
            f"Let {names[-1]} hang at rest until the run begins; the drive is silent. Within {HAND:.0f} s from then "
            f"lift {names[-1]} to about {math.degrees(angle):.0f} degrees, hold it and {names[0]} still, let both go "
            "together, and keep away."
        )
        seconds = SWING + (0.0 if stand.performed else HAND)
        samples = [0.0] * math.ceil(seconds / stand.rig.period)
        log = stand.run(samples, folder, f"release_{math.degrees(angle):.0f}", lifted=angle)
        begin, end = _window(stand, log)
        runs.append({"label": Path(file_of(log)).stem, "file": file_of(log), "window": [begin, end], "role": role})
    title = f"Free swings of {stand.rig.name}"
    path = write_study(stand, folder / "study.toml", title, runs, known=known, drive=False)
    return fit_study(path, part(progress, 0.4, 1.0, "fitting the swings"))


def _window(stand: TestStand, log: Record) -> tuple[float, float]:
    pivot, swing = stand.names
    theta = log[swing]
    if abs(theta).max() < CLEAR:
        raise NotIdentifiable(
            f"{swing} went no further than {math.degrees(abs(theta).max()):.2g} degrees in {file_of(log)}: it was not "
            "lifted in time; run the experiment again."
        )
    swings = max(abs(p.imag) for p in stand.rig.linear(stand.resting).poles())
    begin = free_from(log.t, theta, swings, float(log.t[0]), log[pivot])
    return begin, float(log.t[-1])


def carrier_of(stand: TestStand) -> str:
    """Inertia of the body that carries the pendulum; empty where no make has such a plant."""
    return next((m.body for m in MAKES.values() if m.pendulum and isinstance(stand.rig.plant, type(m.rig.plant))), "")
