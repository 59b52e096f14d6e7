"""A run as models explain it, for a page that answers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from upright.identification import Fit, RunScore
from upright.physics import Plant
from upright.report.drawing import Array
from upright.report.interactive.traces import ROOM, TracePanel, traces
from upright.report.symbols import plain


def score_traces(
    scores: Mapping[str, RunScore], plant: type[Plant], *, name: str, room: int = ROOM
) -> str:  # fmt: skip
    """One run, measured and as several models explain it, with their bands and, of the first, its initial guesses.

    Parameters
    ----------
    scores : mapping of str to RunScore
        Of the same run, by who explains it; over the same samples.
    plant : type of Plant
        States units and the order of coordinates.
    name : str
        What is shown, for readers who cannot see it.
    room : int
        Characters that the data may take.
    """
    first = next(iter(scores.values()))
    places = {c.name: i for i, c in enumerate(plant.coordinates)}
    units = {c.name: c.unit for c in plant.coordinates}
    panels = [
        TracePanel(
            name=plain(signal), unit=units.get(signal, ""), colour=places.get(signal, k), measured=first.y[:, k],
            models={who: score.simulated[:, k] for who, score in scores.items()},
            bands={who: score.band[signal] for who, score in scores.items() if signal in score.band},
            guess=first.guess[:, k] if first.guess is not None else None,
        )
        for k, signal in enumerate(first.measured)
    ]  # fmt: skip
    return traces(first.t, panels, name=name, restarts=None if first.ahead else first.horizon, room=room)


def path_traces(fit: Fit) -> str:
    """How the cost and every parameter moved during the search, by accepted step."""
    steps = np.arange(1, len(fit.path) + 1, dtype=np.float64)
    cost, relative = search_path(fit)
    panels = [
        TracePanel(name="mean squared residual", unit="", models={"cost": cost}, colour=0),
        TracePanel(name="parameters relative to their estimates", unit="", models=relative, colour=1),
    ]
    return traces(
        steps, panels, name="The search", axis="accepted step", unit="", logarithmic=("mean squared residual",)
    )


def search_path(fit: Fit) -> tuple[Array, dict[str, Array]]:
    """Mean squared residual (steps,), and by symbol every parameter (steps,) relative to its estimate."""
    cost = np.array([c for c, _ in fit.path])
    last = {n: fit.estimates[n].value for n in fit.names if n in fit.estimates and fit.estimates[n].value}
    return cost, {plain(n): np.array([values.get(n, math.nan) for _, values in fit.path]) / v for n, v in last.items()}
