"""Pictures of experiment 2: the runs, their predictions, and the velocity estimators."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.control import Trial, score
from upright.control.preflight import WORDS
from upright.experiments.regulation_2.run import Attempt
from upright.report.drawing import BLACK, BLUE, GREY, ORANGE, PALE, SKY, VERMILLION, decimated, figure, styled
from upright.report.symbols import axis, mathtext

if TYPE_CHECKING:
    from matplotlib.figure import Figure


COLOURS: Mapping[str, tuple[str, str]] = {
    "stabilised": (SKY, ""),
    "stabilised with saturation": (SKY, "///"),
    "stabilised with excessive effort": (ORANGE, "///"),
    "does not settle": (ORANGE, "|||"),
    "leaves its travel": (PALE, "---"),
    "falls": (VERMILLION, "xxx"),
}
"""Fill and hatching of every end of a run, so that grey print tells them apart."""


@styled
def runs_figure(attempts: Sequence[Attempt], seconds: float) -> Figure:
    """Deviations and command over the first seconds, one column per pole set; a cross where a run was lost."""
    first = attempts[0].before.run
    coordinates = first.rig.plant.coordinates
    order = [*range(len(coordinates))][::-1]  # the pendulum on top
    drawing = figure(1.45 * (len(order) + 1) + 0.7)
    axes: Any = drawing.subplots(len(order) + 1, len(attempts), sharex=True, sharey="row", squeeze=False)
    for column, a in enumerate(attempts):
        runs = [(a.before.run, "predicted", ORANGE, "--", 2.0)]
        runs += [(a.after, "measured", BLUE, "-", 1.1)] if a.after is not None else []
        for run, name, colour, line, width in runs:
            scored = score(run)
            lost = min(scored.fell, scored.ran_out)
            shown = run.t <= min(seconds, lost)
            for row, i in enumerate(order):
                turn = 180 / math.pi if coordinates[i].unit == "rad" else 100.0
                t, y = decimated(run.t[shown], turn * run.deviation[shown, i], 250)
                axes[row, column].plot(t, y, color=colour, linestyle=line, linewidth=width, label=name)
                if lost <= seconds:
                    axes[row, column].plot(t[-1], y[-1], "x", color=colour, markersize=6, markeredgewidth=width)
            t, u = decimated(run.t[shown], run.u[shown], 250)
            axes[-1, column].plot(t, u, color=colour, linestyle=line, linewidth=width)
        for side in (-1, 1):
            axes[-1, column].axhline(side * first.rig.limit, color=GREY, linestyle=":", linewidth=1.0)
        axes[0, column].set_title(fill(a.title, 22))
        axes[-1, column].set_xlabel("time [s]")
    for row, i in enumerate(order):
        turned = coordinates[i].unit == "rad"
        axes[row, 0].set_ylabel(axis(mathtext(coordinates[i].name), "deg" if turned else "cm"))
        if coordinates[i].name == first.rig.plant.inputs[0].on and math.isfinite(first.rig.travel):
            _ends(axes[row], first.rig.travel * (180 / math.pi if turned else 100.0))
    axes[-1, 0].set_ylabel(axis("command", first.rig.unit))
    axes[-1, 0].text(
        0.98 * seconds, first.rig.limit, "limit", ha="right", va="bottom", fontsize=8.5, color=GREY
    )  # fmt: skip
    low, high = axes[-1, 0].get_ylim()
    axes[-1, 0].set_ylim(low * 1.15, high * 1.15)
    axes[0, -1].legend(loc="upper right")
    drawing.align_ylabels(axes[:, 0])
    return drawing


def _ends(row: Any, travel: float) -> None:
    """Where the travel ends, if that is in sight."""
    shown = max(abs(v) for v in row[0].get_ylim())
    for ax in row:
        for side in (-1, 1):
            if shown > 0.8 * travel:
                ax.axhline(side * travel, color=GREY, linestyle=":", linewidth=1.0)
    if shown > 0.8 * travel:
        row[0].text(0.0, travel, "end of travel", va="bottom", fontsize=8.5, color=GREY)


@styled
def chances_figure(predicted: Mapping[str, Mapping[str, float]], measured: Mapping[str, str]) -> Figure:
    """Share of the rigs allowed that come to each end, one bar per pole set, with what came written beside."""
    drawing = figure(0.42 * len(predicted) + 1.3)
    ax: Any = drawing.subplots()
    names = list(predicted)
    left = np.zeros(len(names))
    for w in WORDS:
        share = np.array([100 * predicted[n][w] for n in names])
        colour, hatch = COLOURS[w]
        ax.barh(names, share, left=left, color=colour, hatch=hatch, edgecolor=BLACK, linewidth=0.6, label=w)
        left += share
    for i, n in enumerate(names):
        if measured.get(n):
            ax.text(101.5, i, fill(f"measured: {measured[n]}", 20), va="center", fontsize=8.5)
    ax.invert_yaxis()
    ax.set_xlim(0, 100)
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("share of the sampled rigs [%]")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=len(WORDS) // 2)
    return drawing


@styled
def ways_figure(ways: Mapping[str, Trial], seconds: float = 0.8) -> Figure:
    """The command while the rig comes back, one panel for each way to the velocities."""
    drawing = figure(1.9)
    axes: Any = drawing.subplots(1, len(ways), sharex=True, sharey=True, squeeze=False)[0]
    for ax, (name, run) in zip(axes, ways.items(), strict=True):
        shown = run.t <= seconds
        ax.plot(run.t[shown], run.u[shown], color=BLUE, linewidth=0.7, drawstyle="steps-post")
        ax.set_title(name, fontsize=8.5)
        ax.set_xlabel("time [s]")
    axes[0].set_ylabel(axis("command", next(iter(ways.values())).rig.unit))
    return drawing
