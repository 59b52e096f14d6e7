"""How late does this machine wake a loop? A histogram over decades."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from upright.realtime.jitter import Jitter
from upright.report.drawing import BLUE, GREY, VERMILLION, figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def jitter_figure(jitter: Jitter) -> Figure:
    """Ticks by how far behind their deadline they were woken, both axes logarithmic; the period is marked."""
    drawing = figure(2.8, margins=(0.75, 0.1, 0.1, 0.5))
    axis = drawing.subplots()
    last = float(np.ceil(np.log10(max(1e6 * jitter.behind.max(), 1e4))))
    edges = np.logspace(-1, last, 120)
    # a prompt tick stands in the first bar, by its very edge: a rounding below it would not be drawn
    axis.hist(np.maximum(1e6 * jitter.behind, edges[0]), bins=edges.tolist(), color=BLUE)
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.axvline(1e6 * jitter.period, color=VERMILLION, linewidth=0.9)
    axis.text(1e6 * jitter.period, axis.get_ylim()[1], " a period", color=VERMILLION, fontsize=8.5, va="top")
    for name, value in jitter.quantiles.items():
        axis.axvline(1e6 * value, color=GREY, linestyle="--", linewidth=0.7)
        axis.text(1e6 * value, 0.6, f" {name}", color=GREY, fontsize=8.5, rotation=90, va="bottom")
    axis.set_xlabel("woken behind the deadline [µs]")
    axis.set_ylabel("ticks")
    return drawing
