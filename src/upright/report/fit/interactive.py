"""A run as models explain it, for a page that answers."""

from __future__ import annotations

from collections.abc import Mapping

from upright.identification import RunScore
from upright.physics import Plant
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
