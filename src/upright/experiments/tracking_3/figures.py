"""Pictures of experiment 3: steps, efforts, poles, and what PD control can have."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.experiments.tracking_3.laws import AT, loop_poles
from upright.experiments.tracking_3.run import BEFORE, DWELL, Outcome, Tracking
from upright.records import Array
from upright.report.drawing import (
    BLACK,
    BLUE,
    CYCLE,
    GREEN,
    GREY,
    VERMILLION,
    decimated,
    draw_limits,
    figure,
    styled,
)
from upright.report.interactive.charts import Chart
from upright.report.planes import Poles, pole_panels
from upright.report.symbols import axis, mathtext, plain, unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_SHOWN = {"m": (1e3, "mm"), "rad": (180 / math.pi, "deg")}


def in_reading_unit(of: str) -> tuple[float, str]:
    """Factor and unit in which lengths or angles of this size are read best."""
    return _SHOWN.get(of, (1.0, of))


@styled
def steps_figure(
    result: Tracking, outcomes: Sequence[Outcome], *, until: float = 0.5, kick: float | None = 0.1
) -> Figure:
    """Reference, positions and effort with its limit, all laws in one picture; a run ends where it tripped.

    With `kick` both positions are shown, and the command only so long [s], for that is where it acts.
    """
    bodies = result.rig.plant.coordinates
    factor, of = in_reading_unit(bodies[-1].unit)
    step = factor * result.step.size
    picked = [bodies[-1]] if kick is None else [bodies[0], bodies[-1]]
    rows = len(picked) + 1
    drawing = figure(0.85 + 1.75 * rows + 0.3 * (rows - 2), margins=(0.75, 0.15, 0.38, 0.48))
    axes: list[Any] = drawing.subplots(rows, 1, gridspec_kw={"hspace": 0.3}).tolist()
    low, high = -0.15 * step, (1.75 if kick is None else 1.3) * step
    for ax, body in zip(axes, picked, strict=False):
        ax.plot([-0.05, 0, 0, until], [0, 0, step, step], color=BLACK, linewidth=0.8, linestyle=":", label="reference")
        for (colour, style), o in zip(CYCLE, outcomes, strict=False):
            t, y = _part(o, body.name, -0.05, until)
            line = decimated(t, factor * y)
            ax.plot(*line, color=colour, linestyle=style, label=o.law.name)
            if o.measured.tripped - BEFORE < until:
                last = float(np.clip(line[1][-1], low, high))
                ax.plot(line[0][-1:], [last], "X", color=colour, markersize=7, clip_on=False, zorder=5)
        ax.set_ylabel(axis(mathtext(body.name), of))
        ax.set_ylim(low, high)
        ax.set_xlim(-0.06, 1.02 * until)
    _efforts(axes[-1], result, outcomes, until if kick is None else kick)
    if until > DWELL:
        for ax in axes:
            ax.axvline(DWELL, color=GREY, linewidth=0.8, linestyle="-.")
        axes[0].text(DWELL, 0.97 * high, " push begins", va="top", fontsize=8.5, color=GREY)
    drawing.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6, columnspacing=1.2)
    axes[-1].set_xlabel("time from the step [s]")
    hide_times = axes[:-1] if kick is None else axes[:-2]
    for ax in hide_times:
        ax.tick_params(labelbottom=False)
    drawing.align_ylabels(axes)
    return drawing


def _part(o: Outcome, name: str, start: float, stop: float) -> tuple[Array, Array]:
    """Time from the step [s] and what was logged between two instants, up to a trip."""
    record = o.measured.trial.record
    t = record.t - BEFORE
    inside = (record.t <= o.measured.tripped) & (t >= start) & (t <= stop)
    return t[inside], record[name][inside]


def _efforts(ax: Any, result: Tracking, outcomes: Sequence[Outcome], until: float) -> None:
    for (colour, style), o in zip(CYCLE, outcomes, strict=False):
        drawn = decimated(*_part(o, "u", -0.05 * until, until))
        ax.step(*drawn, color=colour, linestyle=style, linewidth=1.0, where="post")
    draw_limits(ax, result.rig.limit, "limit", until)
    ax.set_ylim(-1.3 * result.rig.limit, 1.3 * result.rig.limit)
    ax.set_xlim(-0.06 if until > 1 else -0.05 * until, 1.02 * until)
    ax.set_ylabel(axis("command", result.rig.unit))


def poles_chart(result: Tracking) -> Chart:
    """Requested and attained poles, set by set; the upper half plane, which the lower mirrors."""
    laws, open_loop = [o.law for o in result.sets], result.model.linear(AT).poles()
    left = 1.12 * min(float(law.requested.real.min()) for law in laws)
    high = 1.2 * max(float(np.abs(p.imag).max()) for p in (open_loop, *(law.requested for law in laws)))
    sets = {
        f"{law.name}, imaginary part": [
            Poles(name="open loop", values=open_loop, mark="x", colour="ink-2"),
            Poles(name="requested", values=law.requested, mark="o"),
            Poles(name="on the fitted model, sampled and late", values=law.poles, mark="+", colour="q0"),
            Poles(name="on the rig", values=loop_poles(result.rig, law.law), mark="x", colour="q1"),
        ]
        for law in laws
    }
    return pole_panels(sets, left, -0.06 * left, high)


@dataclass(frozen=True, kw_only=True, eq=False)
class Tradeoff:
    """What PD of the near encoder can have, and points beside it: stiffness [N/m or N m/rad] against decay [1/s]."""

    stiffness: Array
    decay: Array
    bound: float
    shaft: float
    points: Mapping[str, tuple[float, float]]
    unit: str


@styled
def tradeoff_figure(bargain: Tradeoff) -> Figure:
    """How fast the slowest pole decays over how hard the loop pulls at rest."""
    drawing = figure(3.3, margins=(0.65, 3.0, 0.15, 0.5))
    ax: Any = drawing.subplots()
    ax.plot(bargain.stiffness, bargain.decay, color=BLUE, label="PD, near encoder, best kd")
    ax.fill_between(bargain.stiffness, bargain.decay, 0, color=BLUE, alpha=0.08, linewidth=0)
    ax.axhline(bargain.bound, color=GREY, linestyle="--", linewidth=0.9, label="half the root of k/inertia 1")
    ax.axvline(bargain.shaft, color=GREY, linestyle=":", linewidth=1.1, label="stiffness of the shaft")
    marks = ["o", "s", "D", "^", "P", "v", "X"]
    for (name, (x, y)), mark in zip(bargain.points.items(), marks, strict=False):
        colour = GREEN if name.startswith("PD") else VERMILLION
        ax.plot(x, max(y, 0.0), mark, color=colour, markersize=7, markerfacecolor="none", markeredgewidth=1.4,
                linestyle="none", label=plain(name), clip_on=False)  # fmt: skip
    ax.set_xscale("log")
    ax.set_ylim(bottom=0)
    ax.set_xlabel(f"static force per error [{unit(bargain.unit)}]")
    ax.set_ylabel("decay of the slowest pole [1/s]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return drawing
