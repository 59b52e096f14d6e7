"""Pictures of a fit: data against model, what is left over, and which numbers the data fix."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from upright.identification import RunScore
from upright.identification.model.fit import Estimate, Fit
from upright.physics import Plant
from upright.report.drawing import (
    BLACK,
    BLUE,
    CYCLE,
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
from upright.report.symbols import axis, mathtext, number, percent, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 1.5  # relative half-width [1] of an interval from which on it becomes an arrow


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
    """Data against model, signal by signal, each with a strip of what is left over; of a prediction with its band.

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
    units, n = {c.name: c.unit for c in plant.coordinates} if plant else {}, len(score.measured)
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
        loc="outside lower left",
        ncols=4,
        columnspacing=1.0,
        borderpad=0,
        borderaxespad=0.1,
    )
    panels[0].set_xlim(float(score.t[0]), float(score.t[-1]))
    hide_inner_times(panels)
    drawing.align_ylabels(panels)
    return drawing


def _signal(upper: Axes, lower: Axes, score: RunScore, j: int, unit: str, buckets: int) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter

    t, y, model = score.t, score.y[:, j], score.simulated[:, j]
    left = y - model
    if (half := score.band.get(score.measured[j])) is not None:
        for panel, middle, label in ((upper, model, "90 % band"), (lower, np.zeros_like(t), None)):
            edges = _envelope(t, middle - half, middle + half, buckets)
            panel.fill_between(*edges, color=GREY, alpha=0.3, linewidth=0, label=label)
    upper.plot(*decimated(t, y, buckets), color=SKY, linewidth=2.6, solid_capstyle="butt", label="measured")
    predicted = broken(*decimated(t, model, buckets), None if score.ahead else score.horizon)
    upper.plot(*predicted, color=BLACK, linewidth=0.9, linestyle=(0, (5, 1.5)), label="model")
    upper.set_ylabel(axis(plain(score.measured[j]), unit))
    lower.axhline(0, color=GREY, linewidth=0.6)
    lower.plot(*decimated(t, left, buckets), color=VERMILLION, linewidth=0.7)
    lower.set_ylabel("residual", fontsize=8.5)
    if score.score_from > 0:
        for panel, label in ((upper, "not scored"), (lower, None)):
            panel.axvspan(t[0], t[0] + score.score_from, color=GREY, alpha=0.25, linewidth=0, label=label)
    for panel, values in ((upper, np.concatenate([y, model])), (lower, np.append(left, 0.0))):
        _limits(panel, values)
    lower.yaxis.set_major_locator(FixedLocator(_two_ticks(*lower.get_ylim())))
    lower.yaxis.set_major_formatter(FuncFormatter(lambda value, _: number(float(f"{value:.3g}"), 1)))


def _two_ticks(low: float, high: float) -> list[float]:
    """The largest 1, 2 or 5 times a power of ten in sight of a flat panel about zero, on each side where it is."""
    most = max(-low, high)
    power = 10.0 ** math.floor(math.log10(most))
    tick = power * max(m for m in (1, 2, 5) if m * power <= most)
    return [at for at in (-tick, tick) if low <= at <= high]


def _envelope(t: Array, low: Array, high: Array, buckets: int) -> tuple[Array, Array, Array]:
    """Edges of a band, thinned to the outermost of every bucket."""
    if t.size <= 3 * buckets:
        return t, low, high
    first = np.linspace(0, t.size, buckets, endpoint=False).astype(int)
    return t[first], np.minimum.reduceat(low, first), np.maximum.reduceat(high, first)


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


@styled
def interval_figure(estimates: Mapping[str, Estimate], *, truth: Mapping[str, float] | None = None) -> Figure:
    """Every estimate's interval relative to its value, or to a twin's `truth`; what leaves the picture is an arrow.

    Solid are estimates that are well determined, or whose interval holds the truth.
    """
    shown = {n: e for n, e in estimates.items() if e.status != "known" and e.value != 0}
    centres = {n: e.value for n, e in shown.items()} if truth is None else {n: truth[n] for n in shown if truth.get(n)}
    drawing = figure(0.55 + 0.27 * max(len(centres), 1))
    ax = drawing.add_subplot()
    ends = {n: sorted((end - c) / abs(c) for end in shown[n].interval) for n, c in centres.items()}
    finite = [abs(x) for pair in ends.values() for x in pair if math.isfinite(x) and abs(x) < _MOST]
    reach = min(_MOST, 1.25 * max(finite, default=0.1))
    for row, (name, (low, high)) in enumerate(ends.items()):
        e, centre = shown[name], centres[name]
        firm = e.status == "well determined" if truth is None else low <= 0 <= high
        colour = BLUE if firm else VERMILLION
        lo, hi = max(low, -reach), min(high, reach)
        ax.plot([100 * lo, 100 * hi], [row, row], color=colour, linewidth=2, linestyle="-" if firm else (0, (3, 1)))
        ax.plot(100 * (e.value - centre) / abs(centre), row, marker="o" if firm else "s", color=colour, markersize=4.5)
        for end, limit, mark in ((low, -reach, "<"), (high, reach, ">")):
            if not abs(end) <= reach:
                ax.plot(100 * limit, row, marker=mark, color=colour, markersize=6, clip_on=False)
    ax.axvline(0, color=GREY, linewidth=0.6)
    status = {n: f"  ({shown[n].status})" if truth is None else "" for n in ends}
    ax.set_yticks(range(len(ends)), [f"{mathtext(n)}{word}" for n, word in status.items()])
    ax.set_ylim(len(ends) - 0.5, -0.5)
    ax.set_xlim(-100 * reach, 100 * reach)
    what = "95 % interval relative to the estimate" if truth is None else "estimate and 95 % interval, from the truth"
    ax.set_xlabel(f"{what} [%]")
    ax.grid(visible=False, axis="y")
    return drawing


def _cells(ax: Axes, matrix: Array) -> None:
    """Colour per entry, pale enough for black figures on it, row 0 at the top."""
    rows, columns = matrix.shape
    edges = np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5
    ax.pcolormesh(*edges, matrix, cmap="PuOr", vmin=-1.6, vmax=1.6, edgecolors="white", linewidth=0.6)
    ax.set_ylim(rows - 0.5, -0.5)


def _correlation(r: float) -> str:
    if not math.isfinite(r):
        return "–"
    return "1" if r == 1 else f"{r:.2f}".replace("-", "−")


@styled
def directions_figure(fit: Fit) -> Figure:
    """Singular values of the scaled Jacobian, each with the combination of parameters that it weighs."""
    n = fit.singular_values.size
    drawing = figure(0.9 + 0.3 * n)
    bars, mix = drawing.subplots(1, 2, width_ratios=[1, 1.9], sharey=True)
    _bars(bars, fit)
    shares = fit.directions[:n]
    _cells(mix, shares)
    for i, j in zip(*np.nonzero(np.abs(shares) >= 0.1), strict=True):
        mix.text(j, i, _correlation(float(shares[i, j])), ha="center", va="center", fontsize=8.5)
    mix.set_xticks(range(len(fit.names)), [mathtext(name) for name in fit.names], rotation=45, ha="right")
    mix.set_title("… of this combination")
    mix.grid(visible=False)
    mix.spines[:].set_visible(False)
    mix.tick_params(length=0)
    return drawing


def _bars(ax: Axes, fit: Fit) -> None:
    values = np.abs(fit.singular_values)
    largest = float(values.max(initial=0.0)) or 1.0
    values = values / largest
    floor = max(float(values[values > 0].min(initial=1.0)) / 10, 1e-17)
    ax.hlines(range(values.size), floor, np.maximum(values, floor), color=BLUE, linewidth=3)
    ax.plot(np.maximum(values, floor), range(values.size), "o", color=BLUE, markersize=4)
    for i, v in enumerate(values):
        ax.annotate(
            number(float(v), 2), (max(v, floor), i), (5, 0), textcoords="offset points", va="center", fontsize=8.5
        )
    ax.set_xscale("log")
    ax.set_xlim(floor, 30)
    ax.set_ylim(values.size - 0.5, -0.5)
    ax.set_yticks(range(values.size), [str(i + 1) for i in range(values.size)])
    ax.set_title("How strongly the data speak …")
    ax.set_xlabel("singular value, largest = 1")
    ax.grid(visible=False, axis="y")
    ax.axvline(1e-6, color=BLACK, linewidth=0.7, linestyle=(0, (2, 2)))


@styled
def path_figure(cost: Array, relative: Mapping[str, Array]) -> Figure:
    """How the cost and every parameter moved during the search, by accepted step."""
    drawing = figure(4.2)
    above, below = drawing.subplots(2, 1, sharex=True)
    steps = np.arange(1, cost.size + 1)
    above.semilogy(steps, cost, color=BLUE)
    above.set_ylabel("mean squared\nresidual")
    for (name, values), (colour, style) in zip(relative.items(), CYCLE * 5, strict=False):
        below.plot(steps, values, color=colour, linestyle=style, label=name)
    below.set_ylabel("relative to\nthe estimate")
    below.set_ylim(0, 3)
    below.set_xlabel("accepted step")
    below.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return drawing
