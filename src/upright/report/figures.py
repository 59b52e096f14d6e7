"""Does the model follow the data, and what is left over?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from upright.identification import RunScore
from upright.physics import Plant
from upright.report.drawing import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    VERMILLION,
    WIDTH,
    Array,
    broken,
    decimated,
    figure,
    hide_inner_times,
    styled,
)
from upright.report.symbols import axis, number, percent, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def units_of(plant: type[Plant] | None) -> dict[str, str]:
    """Unit of each coordinate of a plant."""
    return {} if plant is None else {c.name: c.unit for c in plant.coordinates}


@styled
def fit_figure(
    score: RunScore,
    plant: type[Plant] | None = None,
    *,
    title: str = "",
    width: float = WIDTH,
    height: float = 2.2,
    buckets: int = 450,
) -> Figure:
    """Data against model, signal by signal, each with a strip of what is left over.

    Parameters
    ----------
    score : RunScore
        The run, measured and simulated.
    plant : type of Plant, optional
        States the units on the axes.
    title : str
        Put above, with the fit percent of each signal.
    width, height : float
        Inches; `height` is for each signal.
    buckets : int
        Long runs are thinned to the extremes in so many buckets.
    """
    units, n = units_of(plant), len(score.measured)
    drawing = figure(0.7 + height * n, width, margins=(0.85, 0.1, 0.28, 0.46))
    grid = drawing.add_gridspec(2 * n, 1, height_ratios=[3.2, 1] * n, hspace=0.32)
    panels: list[Axes] = []
    for j, name in enumerate(score.measured):
        upper = drawing.add_subplot(grid[2 * j], sharex=panels[0] if panels else None)
        lower = drawing.add_subplot(grid[2 * j + 1], sharex=upper)
        panels += [upper, lower]
        _signal(upper, lower, score, j, units.get(name, ""), buckets)
        upper.set_title(f"fit {percent(score.fit_percent.get(name, float('nan')))}", loc="right", fontsize=9)
    if title:
        panels[0].set_title(_short(title, 70), parse_math=False)
    drawing.legend(
        *panels[0].get_legend_handles_labels(),
        loc="lower left",
        bbox_to_anchor=(0.85 / width, 0.0),
        ncols=3,
        columnspacing=1.0,
        borderpad=0,
        borderaxespad=0.1,
    )
    panels[0].set_xlim(float(score.t[0]), float(score.t[-1]))
    hide_inner_times(panels)
    for panel in panels:
        panel.yaxis.set_label_coords(-0.62 / (width - 0.95), 0.5)
    return drawing


def _signal(upper: Axes, lower: Axes, score: RunScore, j: int, unit: str, buckets: int) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    t, y, model = score.t, score.y[:, j], score.simulated[:, j]
    left = y - model
    upper.plot(*decimated(t, y, buckets), color=SKY, linewidth=2.6, solid_capstyle="butt", label="measured")
    foreseen = broken(*decimated(t, model, buckets), None if score.ahead else score.horizon)
    upper.plot(*foreseen, color=BLACK, linewidth=0.9, linestyle=(0, (5, 1.5)), label="model")
    upper.set_ylabel(axis(plain(score.measured[j]), unit))
    lower.axhline(0, color=GREY, linewidth=0.6)
    lower.plot(*decimated(t, left, buckets), color=VERMILLION, linewidth=0.7)
    lower.set_ylabel("residual", fontsize=8)
    lower.yaxis.set_major_locator(MaxNLocator(nbins=3, symmetric=True))
    lower.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(float(f"{value:.3g}"), 1)))
    if score.score_from > 0:
        for panel, label in ((upper, "not scored"), (lower, None)):
            panel.axvspan(t[0], t[0] + score.score_from, color=GREY, alpha=0.25, linewidth=0, label=label)
    for panel, values in ((upper, np.concatenate([y, model])), (lower, left)):
        _limits(panel, values)


def _limits(panel: Axes, values: Array) -> None:
    """A model that ran away must not flatten the data."""
    values = values[np.isfinite(values)]
    if values.size == 0:
        return
    low, high = np.percentile(values, [0.1, 99.9])
    spread = float(high - low) or max(abs(float(high)), 1.0) * 1e-3
    lo, hi = float(values.min()), float(values.max())
    panel.set_ylim(max(lo, low - spread) - 0.06 * spread, min(hi, high + spread) + 0.06 * spread)


def autocorrelation(rest: Array, lags: int) -> Array:
    """Correlation of what is left over with itself, at lags 0 to `lags`; 1 at lag 0, 0 throughout for a constant."""
    rest = rest - rest.mean()
    power = float(rest @ rest)
    if power <= 0:
        return np.zeros(lags + 1)
    n = 1 << int(2 * rest.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(rest, n)) ** 2
    return np.fft.irfft(spectrum, n)[: lags + 1] / power


@styled
def autocorrelation_figure(runs: Mapping[str, RunScore]) -> Figure:
    """Autocorrelation of the residuals of every run, with the band in which 95 % of white noise stays."""
    panels = [(label, score, j) for label, score in runs.items() for j in range(len(score.measured))]
    columns = min(3, max(1, len(panels)))
    rows = -(-len(panels) // columns)
    height = 0.35 + 1.65 * max(rows, 1)
    drawing = figure(height, margins=(0.62, 0.08, 0.24, 0.42))
    drawing.subplots_adjust(hspace=0.42, wspace=0.22)
    for i, (label, score, j) in enumerate(panels):
        ax = drawing.add_subplot(rows, columns, i + 1)
        rest = score.y[:, j] - score.simulated[:, j]
        rest = rest[np.isfinite(rest)]
        lags = max(1, min(rest.size // 4, 400 if rest.size < 20_000 else 2000))
        period = float(score.t[-1] - score.t[0]) / max(score.t.size - 1, 1)
        lag, r = decimated(np.linspace(0, lags * period, lags + 1), autocorrelation(rest, lags), 150)
        band = 1.96 / np.sqrt(max(rest.size, 1))
        ax.axhspan(-band, band, color=GREY, alpha=0.4, linewidth=0)
        ax.axhline(0, color=GREY, linewidth=0.6)
        ax.plot(lag, r, color=BLUE)
        ax.set_ylim(-1.05, 1.05)
        ax.set_title(f"{_short(label)}: {plain(score.measured[j])}", fontsize=8.5, parse_math=False)
        if i >= len(panels) - columns:
            ax.set_xlabel("lag [s]")
        if i % columns == 0:
            ax.set_ylabel("correlation")
    return drawing


def _short(label: str, most: int = 26) -> str:
    return label if len(label) <= most else f"{label[: most - 1]}…"
