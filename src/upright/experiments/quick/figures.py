"""How did a rig answer its first motions?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from upright.control.exploration import CALMS, COASTS, KICKS, PUMPS, RISES
from upright.experiments.quick.run import QuickRun
from upright.experiments.stand.stand import APPLIED
from upright.report.drawing import BLUE, GREY, VERMILLION, decimated, figure, hide_inner_times, styled
from upright.report.symbols import axis, mathtext

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASES = {RISES: "ramps", KICKS: "kicks", PUMPS: "swung", COASTS: "coasts", CALMS: "calmed"}


@styled
def first_motions_figure(result: QuickRun) -> Figure:
    """Command, driven body and pendulum as the encoders show them, and what the motion was for."""
    log, stand = result.log, result.stand
    t = log.t - log.t[0]
    drawing = figure(4.2, margins=(0.75, 0.1, 0.4, 0.5))
    axes: list[Any] = drawing.subplots(3, 1, sharex=True).tolist()
    units = {c.name: c.unit for c in stand.rig.plant.coordinates}
    axes[0].plot(*decimated(t, log[APPLIED]), color=VERMILLION, linewidth=0.9)
    axes[0].set_ylabel(axis("command", stand.rig.unit))
    for ax, name in zip(axes[1:], stand.names, strict=True):
        ax.plot(*decimated(t, log[name] - log[name][0]), color=BLUE)
        ax.set_ylabel(axis(mathtext(name), units[name]))
    for row, (phase, name) in enumerate(PHASES.items()):
        at = np.flatnonzero(result.mode == phase)
        if at.size:
            for ax in axes:
                ax.axvline(t[at[0]], color=GREY, linestyle=":", linewidth=0.9)
            axes[0].text(
                t[at[0]],
                1.03 + 0.12 * (row % 2),
                f" {name}",
                fontsize=7.5,
                color=GREY,
                transform=axes[0].get_xaxis_transform(),
            )
    hide_inner_times(axes)
    drawing.align_ylabels(axes)
    return drawing
