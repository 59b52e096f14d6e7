"""Pictures of experiment 4: paths of the disk and the way of the energy."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from upright.experiments.free_swing_4.release import DriftPath
from upright.report.drawing import (
    BLUE,
    CYCLE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Array,
    decimated,
    figure,
    styled,
)
from upright.report.symbols import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def drift_figure(paths: Sequence[DriftPath], body: str = "disk") -> Figure:
    """Angle of the disk (or place of the cart) over time, free on the left, anchored on the right, one scale."""
    factor, what = (180 / math.pi, "angle of the disk [°]") if body == "disk" else (100.0, f"place of the {body} [cm]")
    drawing = figure(3.3, margins=(0.62, 0.1, 0.3, 0.42))
    free, held = drawing.subplots(1, 2, sharey=True, gridspec_kw={"wspace": 0.06})
    for ax, remedy, title in ((free, False, f"{body} free"), (held, True, f"{body} anchored by a soft spring")):
        for path, (colour, line) in zip((p for p in paths if p.remedy == remedy), CYCLE, strict=False):
            ax.plot(*decimated(path.t, factor * path.psi, 300), color=colour, linewidth=0.6, alpha=0.45)
            ax.plot(*decimated(path.t, factor * path.centre, 150), color=colour, linestyle=line, linewidth=1.9)
            ax.plot([], [], color=colour, linestyle=line, linewidth=1.9, label=path.name)
        ax.set_title(title)
        ax.set_xlabel("time [s]")
        ax.legend(loc="upper left")
        ax.margins(x=0)
    low, high = free.get_ylim()
    free.set_ylim(low, high + 0.25 * (high - low))  # room for the legend
    free.set_ylabel(what)
    return drawing


def _with_symbols(text: str) -> str:
    return " ".join(plain(word) for word in text.split())


@styled
def energy_figure(t: Array, stored: Array, dissipated: Mapping[str, Array]) -> Figure:
    """Stacked: energy still in the motion, and what each kind of friction has taken."""
    drawing = figure(2.7, margins=(0.62, 0.1, 0.12, 0.42))
    ax = drawing.subplots()
    thin = max(1, t.size // 400)
    layers = [stored, *dissipated.values()]
    colours = [SKY, VERMILLION, ORANGE, PURPLE, GREEN, GREY, BLUE]
    ax.stackplot(
        t[::thin],
        *[1e3 * layer[::thin] for layer in layers],
        labels=["still in the motion", *(f"taken by {_with_symbols(name)}" for name in dissipated)],
        colors=colours[: len(layers)],
        edgecolor="white",
        linewidth=0.4,
    )
    for layer, hatch in zip(ax.collections, ("", "///", "\\\\\\", "...", "xxx", "|||", "---"), strict=False):
        layer.set_hatch(hatch)  # tells the areas apart on grey paper
    ax.set_xlabel("time [s]")
    ax.set_ylabel("energy [mJ]")
    ax.margins(x=0, y=0)
    ax.legend(loc="center right", frameon=True, framealpha=0.9, edgecolor="none")
    return drawing
