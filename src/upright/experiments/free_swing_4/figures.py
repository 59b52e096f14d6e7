"""Pictures of experiment 4: its frames, paths of the disk and the way of the energy."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from upright.experiments.free_swing_4.release import DriftPath
from upright.report.drawing import (
    BLACK,
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
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_UNIT = 0.55  # length of a unit vector on the page
_ANGLE = math.radians(35)


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
    for layer, hatch in zip(ax.collections, ("", "///", "\\\\\\", "+++", "xxx", "|||", "---"), strict=False):
        layer.set_hatch(hatch)  # tells the areas apart on grey paper
    ax.set_xlabel("time [s]")
    ax.set_ylabel("energy [mJ]")
    ax.margins(x=0, y=0)
    ax.legend(loc="center right", frameon=True, framealpha=0.9, edgecolor="none")
    return drawing


@styled
def frames_figure() -> Figure:
    """Ground n, arm a and rod b: from above for the angle of the arm, from outside for the angle of the rod.

    Axis 1 of the ground points down, axis 2 of the arm outwards through the hinge, axis 1 of the rod along it.
    """
    drawing = figure(2.9, 7.0, margins=(0.05, 0.05, 0.25, 0.02))
    above, outside = drawing.subplots(1, 2)
    _from_above(above)
    _from_outside(outside)
    for axes in (above, outside):
        axes.set_aspect("equal")
        axes.axis("off")
    return drawing


def _from_above(axes: Axes) -> None:
    """Axis 1 points into the page, so a positive turn is clockwise."""
    outwards = np.array([math.cos(_ANGLE), -math.sin(_ANGLE)])
    onwards = np.array([-math.sin(_ANGLE), -math.cos(_ANGLE)])
    hinge = 1.3 * outwards
    _bar(axes, hinge)
    _vector(axes, np.zeros(2), np.array([1.0, 0.0]), "n", 2, BLACK)
    _vector(axes, np.zeros(2), np.array([0.0, -1.0]), "n", 3, BLACK)
    _vector(axes, hinge, outwards, "a", 2, BLUE)
    _vector(axes, hinge, onwards, "a", 3, BLUE)
    turn = np.linspace(0.0, _ANGLE, 40)
    axes.plot(0.95 * np.cos(turn), -0.95 * np.sin(turn), color=BLACK, linewidth=0.8)
    _say(axes, np.array([1.02, -0.3]), r"$\psi$", BLACK)
    _say(axes, 0.5 * hinge + 0.22 * onwards, "arm, $r$", GREY)
    axes.set_title("from above ($\\mathbf{n}_1 = \\mathbf{a}_1$ points down)")
    axes.set(xlim=(-0.5, 2.1), ylim=(-1.75, 0.35))


def _from_outside(axes: Axes) -> None:
    """Axis 2 points at the reader, so a positive turn is counter-clockwise and axis 3 = 1 x 2 points to the left."""
    along = np.array([math.sin(_ANGLE), -math.cos(_ANGLE)])
    across = np.array([-math.cos(_ANGLE), -math.sin(_ANGLE)])
    _bar(axes, 1.5 * along)
    axes.plot(*(0.85 * along), "o", color=BLACK, markersize=6)
    _say(
        axes,
        0.85 * along + np.array([0.7, 0.0]),
        "centre of gravity,\n$l_{cg}$ from the hinge",
        BLACK,
    )
    _vector(axes, np.zeros(2), np.array([0.0, -1.0]), "a", 1, BLUE)
    _vector(axes, np.zeros(2), np.array([-1.0, 0.0]), "a", 3, BLUE)
    _vector(axes, 1.5 * along, along, "b", 1, VERMILLION)
    _vector(axes, 1.5 * along, across, "b", 3, VERMILLION)
    turn = np.linspace(0.0, _ANGLE, 40)
    axes.plot(0.95 * np.sin(turn), -0.95 * np.cos(turn), color=BLACK, linewidth=0.8)
    _say(axes, np.array([0.3, -1.03]), r"$\theta$", BLACK)
    axes.set_title("from outside ($\\mathbf{a}_2 = \\mathbf{b}_2$ points at you)")
    axes.set(xlim=(-0.9, 1.7), ylim=(-1.85, 0.25))


def _bar(axes: Axes, end: Array) -> None:
    axes.plot(
        [0.0, end[0]],
        [0.0, end[1]],
        color=GREY,
        alpha=0.7,
        linewidth=6,
        solid_capstyle="round",
        zorder=0,
    )


def _vector(axes: Axes, start: Array, direction: Array, letter: str, number: int, colour: str) -> None:
    end = start + _UNIT * direction
    axes.annotate(
        "",
        tuple(end),
        tuple(start),
        arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.5},
    )
    _say(axes, end + 0.14 * direction, rf"$\mathbf{{{letter}}}_{number}$", colour, 11)


def _say(axes: Axes, place: Array, words: str, colour: str, size: int = 9) -> None:
    axes.text(
        float(place[0]),
        float(place[1]),
        words,
        color=colour,
        fontsize=size,
        ha="center",
        va="center",
    )
