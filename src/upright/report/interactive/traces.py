"""Traces of a run for a page: its samples, thinned to the extremes where they are many, packed for `traces.js`."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from upright.report.interactive.script import in_script

Array = NDArray[np.float64]

MOST = 4000
"""Samples of a run that a page holds at most: two for each pixel of a wide screen."""
LEAST = 200
"""Samples of a run that a page holds, however many runs share it."""
ROOM = 160_000
"""Characters that all traces of a fit take in its page."""
BEYOND = 8.0
"""Ranges of what was measured that a band goes beyond it: past any picture, yet fine in 16 bits where it is narrow."""
_LEVELS = 32767  # 16 bits for each value, over the range of its own line; -32768 is no value


@dataclass(frozen=True, kw_only=True, eq=False)
class TracePanel:
    """Lines over one axis of time; where something was measured, what models leave over stands below it.

    Attributes
    ----------
    name, unit : str
        Of the quantity.
    measured : array, shape (N,), optional
    models : mapping of str to array, shape (N,)
        What was predicted, by who predicts it; lines of their own where nothing was measured.
    bands : mapping of str to array, shape (N,)
        Half of the width of the band that should hold 90 % of the samples, by model.
    guess : array, shape (N,), optional
        Motion of the initial guesses.
    colour : int
        Place of its coordinate in the plant: a colour belongs to a coordinate.
    """

    name: str
    unit: str
    measured: Array | None = None
    models: Mapping[str, Array] = field(default_factory=dict[str, Array])
    bands: Mapping[str, Array] = field(default_factory=dict[str, Array])
    guess: Array | None = None
    colour: int = 0

    def lines(self) -> int:
        """Number of columns that a page holds of it."""
        return (self.measured is not None) + len(self.models) + len(self.bands) + (self.guess is not None)


def traces(
    t: Array, panels: Sequence[TracePanel], *, name: str, restarts: float | None = None, room: int = ROOM,
    axis: str = "time", unit: str = "s", logarithmic: Sequence[str] = (),
) -> str:  # fmt: skip
    """What ``traces.js`` draws, as JSON that may stand inside a script.

    Residuals are packed beside what was measured, each over its own range to 16 bits, so that a small one is not
    rounded by a large signal. Where a run has more samples than there is room for, the samples at which a measured
    signal or its residual is least and greatest are kept of every stretch: what is shown is a sample, never a mean.

    Parameters
    ----------
    t : array, shape (N,)
        Times [s], or what else the abscissa is.
    name : str
        What is shown, for readers who cannot see it.
    restarts : float, optional
        Seconds after which predictions were restarted; lines of models have a gap there.
    room : int
        Characters that the data may take.
    axis, unit : str
        Of the abscissa.
    logarithmic : sequence of str
        Panels with a logarithmic ordinate.
    """
    per_sample = 4 / 3 * 2 * (1 + sum(p.lines() for p in panels))
    rows = extreme_rows(_deciding(panels), t.size, max(LEAST, min(MOST, int(room / per_sample))))
    content = {
        "name": name, "axis": axis, "unit": unit, "of": int(t.size), "restarts": restarts, **_times(t, rows),
        "panels": [{**_panel(p, rows), "logarithmic": p.name in logarithmic} for p in panels],
    }  # fmt: skip
    return in_script(content)


def extreme_rows(deciding: Sequence[Array], samples: int, most: int) -> NDArray[np.int64]:
    """Rows of the least and greatest value of each signal in every stretch; all rows where they are at most `most`."""
    if samples <= most or not deciding:
        return np.arange(samples) if samples <= most else np.linspace(0, samples - 1, most).astype(np.int64)
    stretches = max(1, (most - 2) // (2 * len(deciding)))
    wide = -(-samples // stretches)
    first = np.arange(-(-samples // wide)) * wide
    rows = [np.array([0, samples - 1])]
    for values in deciding:
        padded = np.full(first.size * wide, values[-1])
        padded[:samples] = values
        padded[~np.isfinite(padded)] = 0.0
        cells = padded.reshape(-1, wide)
        rows += [np.minimum(first + at, samples - 1) for at in (cells.argmin(axis=1), cells.argmax(axis=1))]
    return np.unique(np.concatenate(rows))


def _deciding(panels: Sequence[TracePanel]) -> list[Array]:
    """Signals whose extremes must be seen."""
    signals: list[Array] = []
    for p in panels:
        signals += [] if p.measured is None else [p.measured]
        signals += [m if p.measured is None else p.measured - m for m in p.models.values()]
    return signals


def _times(t: Array, rows: NDArray[np.int64]) -> dict[str, object]:
    """Times of the rows: samples to the next one of a uniform grid, else the times themselves."""
    step = float(t[-1] - t[0]) / max(t.size - 1, 1)
    ahead = np.diff(rows, prepend=rows[:1])
    uniform = t.size < 2 or np.allclose(t, t[0] + step * np.arange(t.size), rtol=0, atol=1e-6 * step)
    if uniform and ahead.max(initial=0) < 2**16:
        return {"start": float(t[0]), "step": step, "ahead": _base64(ahead.astype("<u2"))}
    return {"t": _base64(t[rows].astype("<f8"))}


def _panel(panel: TracePanel, rows: NDArray[np.int64]) -> dict[str, object]:
    measured = panel.measured
    models = {n: packed((m if measured is None else measured - m)[rows]) for n, m in panel.models.items()}
    bands = {
        n: b if measured is None else np.minimum(b, np.abs(measured - panel.models[n]) + BEYOND * _range(measured))
        for n, b in panel.bands.items()
    }
    return {
        "name": panel.name, "unit": panel.unit, "colour": panel.colour,
        "measured": None if measured is None else packed(measured[rows]),
        "models": [
            {"name": n, "values": values, "band": packed(bands[n][rows]) if n in bands else None}
            for n, values in models.items()
        ],
        "guess": None if panel.guess is None else packed(panel.guess[rows]),
    }  # fmt: skip


def _range(values: Array) -> float:
    return float(np.nanmax(values) - np.nanmin(values)) if np.isfinite(values).any() else np.inf


def packed(values: Array) -> dict[str, object]:
    """Values over their own range in 16 bits each; what is not finite is no value."""
    finite = np.isfinite(values)
    low, high = (float(values[finite].min()), float(values[finite].max())) if finite.any() else (0.0, 0.0)
    middle, scale = low / 2 + high / 2, (high / 2 - low / 2) / _LEVELS
    levels = np.full(values.shape, -_LEVELS - 1, dtype="<i2")
    levels[finite] = np.rint((values[finite] - middle) / (scale or 1.0))
    return {"middle": middle, "scale": scale, "levels": _base64(levels)}


def _base64(values: NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
