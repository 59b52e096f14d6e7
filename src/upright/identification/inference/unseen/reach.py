"""How far runs go: the largest commands, speeds and positions that were fitted, and what a prediction asks beyond them.

A model is tried only as far as its runs went: friction that a slow run cannot tell from none, a drive that saturates, a
spring that hardens begin to matter beyond.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from upright.identification.model.grey_box import GreyBox
from upright.identification.model.runs import Run
from upright.identification.problem.unknowns import matters
from upright.signals.smoothing import dominant_period, savitzky_golay, smoothing_width
from upright.units import denominator

Array = NDArray[np.float64]

FURTHER = 1.1
"""A run goes beyond what was fitted from this factor on; nobody sets an amplitude to the percent."""

SURE = 99.5
"""Percentile that stands for the largest speed, which a single sample of noise must not be."""


def reached(rig: GreyBox, runs: Sequence[Run]) -> dict[str, float]:
    """Largest size [SI] of each command, ``command.F``, position, ``theta``, and speed, ``theta_dot``, of some runs.

    Where a coordinate's own value is not felt its position does not count, and of an angle that comes round only how
    far it is from zero. ``horizon`` is how far ahead the runs were predicted, where none was simulated freely.
    """
    most: dict[str, float] = {}
    for run in runs:
        for name, value in _of(rig, run).items():
            most[name] = max(most.get(name, 0.0), value)
    if runs and all(run.horizons for run in runs):
        most["horizon"] = max(max(run.horizons) for run in runs)
    return most


def _of(rig: GreyBox, run: Run) -> dict[str, float]:
    reached: dict[str, float] = {}
    for k, source in enumerate(rig.plant.inputs[: run.u.shape[1]]):
        reached[f"command.{source.name}"] = float(np.abs(run.u[:, k]).max())
    for k, name in enumerate(run.measured):
        y = run.y[:, k]
        width = smoothing_width(y, run.period, dominant_period(y, run.period), run.quanta[k])
        speed = savitzky_golay(y, run.period, width, derivatives=1).v
        reached[f"{name}_dot"] = float(np.percentile(np.abs(speed), SURE))
        if matters(rig, name):
            round_again = not matters(rig, name, by=2 * math.pi)
            reached[name] = float(np.abs(np.angle(np.exp(1j * y)) if round_again else y).max())
    return reached


def beyond(rig: GreyBox, run: Run, most: Mapping[str, float]) -> tuple[str, ...]:
    """What of a run lies beyond the largest sizes `most` that were fitted, a sentence each."""
    units = {c.name: c.unit for c in rig.plant.coordinates}
    sentences: list[str] = []
    for name, value in reached(rig, [run]).items():
        fitted = most.get(name)
        if fitted is None or not value > FURTHER * fitted or name == "horizon":
            continue
        what, unit = _called(rig, name, units)
        times = (
            f"{value / fitted:.3g} times the {fitted:.3g}{unit} that was fitted" if fitted > 0 else "none was fitted"
        )
        sentences.append(f"Run '{run.label}' extrapolates: {what} reaches {value:.3g}{unit}, {times}.")
    ahead = float(run.t[-1] - run.t[0]) if not run.horizons else max(run.horizons)
    if "horizon" in most and ahead > FURTHER * most["horizon"]:
        sentences.append(
            f"Run '{run.label}' extrapolates: it is predicted {ahead:.3g} s ahead, {ahead / most['horizon']:.3g} times "
            f"the {most['horizon']:.3g} s that were fitted."
        )
    return tuple(sentences)


def _called(rig: GreyBox, name: str, units: Mapping[str, str]) -> tuple[str, str]:
    """What a size is called, and its unit after a blank."""
    source = name.removeprefix("command.")
    if source != name:
        gain = rig.parameters.get("actuator.gain")
        unit = denominator(gain.unit) if gain is not None else ""
        return f"the command of {source}", f" {unit}" if unit else ""
    if name in units:
        return name, f" {units[name]}"
    return f"the speed {name}", f" {units[name.removesuffix('_dot')]}/s"
