"""Which numbers do the data fix, and which can be traded against each other?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from upright.identification import Estimate, Fit
from upright.report.drawing import BLACK, BLUE, GREY, VERMILLION, Array, figure, styled
from upright.report.symbols import mathtext, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 1.5  # relative half-width [1] at which an interval becomes an arrow


@styled
def interval_figure(estimates: Mapping[str, Estimate]) -> Figure:
    """Every estimate's interval relative to its value; what leaves the picture is an arrow."""
    shown = {n: e for n, e in estimates.items() if e.status != "known" and e.value != 0}
    drawing = figure(0.55 + 0.27 * max(len(shown), 1))
    ax = drawing.add_subplot()
    ends = [_relative(e) for e in shown.values()]
    finite = [abs(x) for pair in ends for x in pair if math.isfinite(x) and abs(x) < _MOST]
    reach = min(_MOST, 1.25 * max(finite, default=0.1))
    for row, ((low, high), e) in enumerate(zip(ends, shown.values(), strict=True)):
        firm = e.status == "firm"
        colour = BLUE if firm else VERMILLION
        lo, hi = max(low, -reach), min(high, reach)
        ax.plot([100 * lo, 100 * hi], [row, row], color=colour, linewidth=2, linestyle="-" if firm else (0, (3, 1)))
        ax.plot(0, row, marker="o" if firm else "s", color=colour, markersize=4.5)
        for end, limit, mark in ((low, -reach, "<"), (high, reach, ">")):
            if not abs(end) <= reach:
                ax.plot(100 * limit, row, marker=mark, color=colour, markersize=6, clip_on=False)
    ax.axvline(0, color=GREY, linewidth=0.6)
    ax.set_yticks(range(len(shown)), [f"{mathtext(n)}  ({e.status})" for n, e in shown.items()])
    ax.set_ylim(len(shown) - 0.5, -0.5)
    ax.set_xlim(-100 * reach, 100 * reach)
    ax.set_xlabel("95 % interval relative to the estimate [%]")
    ax.grid(visible=False, axis="y")
    return drawing


def _relative(e: Estimate) -> tuple[float, float]:
    low, high = sorted((end - e.value) / abs(e.value) for end in e.interval)
    return low, high


@styled
def correlation_figure(fit: Fit) -> Figure:
    """Correlation matrix of the estimates as numbers on colour."""
    n = len(fit.names)
    drawing = figure(0.7 + 0.36 * n, min(7.4, 1.6 + 0.55 * n))
    ax = drawing.add_subplot()
    _cells(ax, fit.correlation)
    for i in range(n):
        for j in range(n):
            r = float(fit.correlation[i, j])
            strong = abs(r) > 0.9 and i != j
            ax.text(
                j, i, _correlation(r), ha="center", va="center", fontsize=7.5, weight="bold" if strong else "normal"
            )
    names = [mathtext(name) for name in fit.names]
    ax.set_xticks(range(n), names, rotation=45 if n > 7 else 0, ha="right" if n > 7 else "center")
    ax.set_yticks(range(n), names)
    ax.grid(visible=False)
    ax.spines[:].set_visible(False)
    ax.tick_params(length=0)
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
        mix.text(j, i, _correlation(float(shares[i, j])), ha="center", va="center", fontsize=7)
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
            number(float(v), 2), (max(v, floor), i), (5, 0), textcoords="offset points", va="center", fontsize=7
        )
    ax.set_xscale("log")
    ax.set_xlim(floor, 30)
    ax.set_ylim(values.size - 0.5, -0.5)
    ax.set_yticks(range(values.size), [str(i + 1) for i in range(values.size)])
    ax.set_title("How strongly the data speak …")
    ax.set_xlabel("singular value, largest = 1")
    ax.grid(visible=False, axis="y")
    ax.axvline(1e-6, color=BLACK, linewidth=0.7, linestyle=(0, (2, 2)))
