"""How does a swing-up look: angle, energy, command and travel over time, and the way into upright?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from upright.control.sensors import Scales
from upright.control.swing_up import HOLDING, SWINGING, Ascent
from upright.report.drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    VERMILLION,
    Array,
    decimated,
    draw_limits,
    figure,
    hide_inner_times,
    styled,
)
from upright.report.symbols import axis, mathtext

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def ascent_figure(run: Ascent, *, after: float = 2.5) -> Figure:
    """Angle, energy, command and driven body up to `after` seconds of holding; holding is shaded."""
    trial, rig = run.trial, run.trial.rig
    last = min(float(trial.t[-1]), (run.up if np.isfinite(run.up) else float(trial.t[-1])) + after)
    shown = trial.t <= last
    t = trial.t[shown]
    drawing = figure(6.0, margins=(0.75, 0.1, 0.1, 0.5))
    axes: list[Any] = drawing.subplots(4, 1, sharex=True, gridspec_kw={"height_ratios": [1.3, 1.3, 1, 1]}).tolist()
    name, unit = rig.plant.coordinates[0].name, rig.plant.coordinates[0].unit
    degrees = np.degrees(trial.record["theta"][shown])
    axes[0].plot(*decimated(t, degrees), color=BLUE)
    for turn in np.arange(np.floor(degrees.min() / 360), np.ceil(degrees.max() / 360) + 1) * 360 + 180:
        if degrees.min() - 40 < turn < degrees.max() + 40:
            axes[0].axhline(turn, color=GREY, linestyle="--", linewidth=0.9)
            axes[0].text(0.0, turn, " upright", ha="left", va="bottom", fontsize=8.5, color=GREY)
    axes[0].margins(y=0.1)
    axes[0].set_ylabel("angle θ [°]")
    low = 2 * run.law.body.weight
    axes[1].plot(*decimated(t, 1e3 * run.energy[shown]), color=GREEN)
    axes[1].axhline(0.0, color=GREY, linestyle="--", linewidth=0.9)
    axes[1].text(last, 0.0, "upright at rest ", ha="right", va="bottom", fontsize=8.5, color=GREY)
    axes[1].axhline(-1e3 * low, color=GREY, linestyle=":", linewidth=0.9)
    axes[1].text(last, -1e3 * low, "hanging at rest ", ha="right", va="bottom", fontsize=8.5, color=GREY)
    axes[1].set_ylabel("energy [mJ]")
    axes[2].plot(*decimated(t, trial.u[shown]), color=VERMILLION, linewidth=0.9)
    _limits(axes[2], rig.limit, float(np.abs(trial.u[shown]).max()), "limit", last)
    axes[2].set_ylabel(axis("command", rig.unit))
    axes[3].plot(*decimated(t, trial.record[name][shown]), color=BLUE)
    _limits(axes[3], run.law.travel, float(np.abs(trial.x[shown, 0]).max()), "travel", last)
    axes[3].set_ylabel(axis(mathtext(name), unit))
    for ax in axes:
        for begin, end in _stretches(run.mode[shown] == HOLDING):
            ax.axvspan(t[begin], t[end], color=ORANGE, alpha=0.14, linewidth=0)
    hide_inner_times(axes)
    drawing.align_ylabels(axes)
    return drawing


def _limits(ax: Any, limit: float, most: float, name: str, where: float) -> None:
    """Draw a bound where it is near enough to be seen beside the curve, else say how far it is."""
    if limit <= 4 * most:
        draw_limits(ax, limit, name, where)
        ax.set_ylim(-1.3 * limit, 1.3 * limit)
    else:
        ax.text(0.995, 0.97, f"{name} ±{limit:.3g}", ha="right", va="top", fontsize=8.5, color=GREY,
                transform=ax.transAxes)  # fmt: skip


def _stretches(on: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last sample of every stretch that is on."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@styled
def portrait_figure(run: Ascent) -> Figure:
    """Speed over angle from hanging, every turn laid over the last; the separatrix is the energy aimed at."""
    angle = np.degrees(np.mod(run.trial.record["theta"] + np.pi, 2 * np.pi) - np.pi)
    speed = run.speeds[:, 1]
    shown = slice(None, None, 6)  # five milliseconds
    drawing = figure(3.8, margins=(0.75, 2.4, 0.1, 0.75))
    ax: Any = drawing.subplots()
    grid = np.linspace(-180, 180, 400)
    edge = 2 * run.law.body.omega * np.cos(np.radians(grid) / 2)  # E = 0: theta'^2 = 2 omega^2 (1 + cos theta)
    for side in (-1, 1):
        label = "energy of upright" if side == 1 else None
        ax.plot(grid, side * edge, color=GREY, linestyle="--", linewidth=0.9, label=label)
    for mode, colour, name in ((SWINGING, BLUE, "pump"), (HOLDING, VERMILLION, "feedback")):
        on = run.mode == mode
        ax.plot(*_broken(np.where(on, angle, np.nan)[shown], speed[shown]), color=colour, label=name)
    for when in run.handovers:
        k = int(np.searchsorted(run.trial.t, when))
        label = "handover" if when == run.handovers[0] else None
        ax.plot(angle[k], speed[k], "o", color="black", markerfacecolor="none", markersize=8, label=label)
    ax.set_xlim(-180, 180)
    ax.set_xticks([-180, -90, 0, 90, 180], ["−180\nupright", "−90", "0\nhanging", "90", "180\nupright"])
    ax.set_xlabel("angle θ [°]")
    ax.set_ylabel("speed θ′ [rad/s]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return drawing


def _broken(angle: Array, speed: Array) -> tuple[Array, Array]:
    """Curve with a gap where the angle goes over the edge of the picture."""
    jump = np.flatnonzero(np.abs(np.diff(angle)) > 180) + 1
    return np.insert(angle, jump, np.nan), np.insert(speed, jump, np.nan)


@styled
def check_figure(scales: Scales, units: tuple[str, ...]) -> Figure:
    """What the encoders of the hanging rig showed, and the model's motion times the scales found."""
    drawing = figure(1.4 * len(scales.names) + 1.0, margins=(0.75, 0.1, 0.1, 0.5))
    axes: list[Any] = drawing.subplots(len(scales.names), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for i, (ax, name, unit) in enumerate(zip(axes, scales.names, units, strict=True)):
        ax.plot(scales.t, scales.shown[:, i], color=BLUE, linewidth=2.6, alpha=0.45, label="shown")
        label = f"model × {scales.value[i]:.4g}"
        ax.plot(scales.t, scales.motion[:, i], color="black", linestyle="--", linewidth=0.9, label=label)
        ax.set_ylabel(axis(mathtext(name), unit))
        ax.margins(y=0.22)  # room for the names of the curves
        ax.legend(loc="upper right", ncols=2)
    hide_inner_times(axes)
    drawing.align_ylabels(axes)
    return drawing
