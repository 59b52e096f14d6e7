"""Pictures of experiment 1a: swings, decrements, the line, and what plans promise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.identification.loadings import Loaded, Loadings, Plan
from upright.records import Record
from upright.report.drawing import BLUE, CYCLE, GREY, PALE, VERMILLION, decimated, figure, styled
from upright.report.symbols import unit
from upright.signals.free_swing import Decay

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def line_figure(loadings: Loadings, what: str) -> Figure:
    """Points of the line with their 95 % bars, the line down to where it meets zero, and what it leaves."""
    a = np.array([s.added for s in loadings.swings])
    drawing = figure(4.4)
    top, left = drawing.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [3, 1.5]})
    over = np.array([-loadings.bare.value, 1.08 * float(a.max())])
    model = (loadings.bare.value + a) / loadings.k.value
    top.plot(over, (loadings.bare.value + over) / loadings.k.value, color=BLUE, label="line, slope 1/k")
    top.errorbar(
        a, loadings.y, 1.96 * loadings.y_error, fmt="o", color=VERMILLION, markersize=4, capsize=2, label="swings"
    )
    top.axvline(0, color=GREY, linewidth=0.8)
    top.plot([-loadings.bare.value], [0], marker="s", color=BLUE, linestyle="none", label="minus the bare inertia")
    top.set_ylabel("1/ω$_n$² [s²]")
    top.set_ylim(bottom=0)
    top.legend(loc="upper left")
    left.axhline(0, color=BLUE)
    left.errorbar(a, 100 * (loadings.y / model - 1), 196 * loadings.y_error / model, fmt="o", color=VERMILLION,
                  markersize=4, capsize=2)  # fmt: skip
    left.set_ylabel("off the line [%]")
    left.set_xlabel(f"added inertia [{unit(what)}]")
    drawing.align_ylabels([top, left])
    return drawing


@styled
def extremes_figure(swings: Sequence[tuple[Loaded, Record, str]]) -> Figure:
    """Signal, extremes found, and the recursion's extremes, one panel per log."""
    drawing = figure(0.6 + 1.25 * len(swings))
    panels: list[Any] = drawing.subplots(len(swings), 1, squeeze=False)[:, 0].tolist()
    for axes, (loaded, record, signal) in zip(panels, swings, strict=True):
        d = loaded.decay
        near = (record.t > d.t[0] - 2 / d.omega_d) & (record.t < d.t[-1] + 8 / d.omega_d)
        axes.axhspan(d.centre - d.delta, d.centre + d.delta, color=PALE)
        axes.plot(*decimated(record.t[near], record[signal][near]), color=BLUE, linewidth=1.0, label="log")
        axes.plot(d.t, d.x, "o", color=VERMILLION, markersize=4.5, fillstyle="none", label="extremes")
        axes.plot(d.t, d.model, "+", color="black", markersize=6, label="recursion")
        axes.set_title(f"{loaded.label}: {d.omega_n:.4g} rad/s, damping ratio {d.zeta:.3f}", parse_math=False)
        unit_of = record.units.get(signal, "")
        axes.set_ylabel(f"{signal[:14]}\n[{unit_of}]" if unit_of else signal[:14], parse_math=False)
    panels[0].legend(loc="upper right", ncols=3)
    panels[-1].set_xlabel("time [s]")
    return drawing


@styled
def decrement_figure(swings: Sequence[Loaded]) -> Figure:
    """How far each extreme lies from the centre, on a logarithmic scale: dry friction bends the straight line."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    drawing = figure(3.0)
    axes = drawing.subplots()
    for (colour, style), loaded in zip(CYCLE, swings, strict=False):
        d = loaded.decay
        scale = abs(d.x[0] - d.centre)
        axes.plot(np.abs(d.x - d.centre) / scale, color=colour, marker="o", linestyle="none", markersize=4)
        axes.plot(np.abs(d.model - d.centre) / scale, color=colour, linestyle=style, label=loaded.label)
        axes.plot(viscous(d) / scale, color=colour, linewidth=0.7, alpha=0.6)
    axes.set_yscale("log")
    for ticks in (axes.yaxis.set_major_formatter, axes.yaxis.set_minor_formatter):
        ticks(FuncFormatter(lambda v, _: f"{v:g}" if f"{v:e}"[0] in "125" else ""))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("half swings")
    axes.set_ylabel("height over the first")
    for text in axes.legend(loc="lower left").get_texts():
        text.set_parse_math(False)
    return drawing


def viscous(d: Decay) -> Any:
    """Heights above the centre that viscous friction alone would leave."""
    return abs(d.x[0] - d.centre) * d.rho ** np.arange(d.x.size)


@styled
def plan_figure(plans: Mapping[int, tuple[Plan, Plan]], chosen: int) -> Figure:
    """Errors that the best plans promise over the number of runs."""
    drawing = figure(3.0)
    axes = drawing.subplots()
    runs = sorted(plans)
    names = ("stiffness, planned for it", "bare inertia, then", "stiffness, planned for both", "bare inertia, then")
    curves = [[100 * getattr(plans[n][i], what) for n in runs] for i in (0, 1) for what in ("k", "bare")]
    for (colour, style), name, curve in zip(CYCLE, names, curves, strict=False):
        axes.plot(runs, curve, color=colour, linestyle=style, marker="o", markersize=3.5, label=name)
    axes.axvline(chosen, color=GREY, linewidth=0.8, linestyle=":")
    axes.set_xlabel("runs")
    axes.set_ylabel("standard error [%]")
    axes.set_ylim(bottom=0)
    axes.set_xticks(runs)
    axes.legend(loc="upper right")
    return drawing
