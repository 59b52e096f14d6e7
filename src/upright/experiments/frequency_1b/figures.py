"""How does a frequency response look beside its fits? The paper's fig. 5, with residuals and each point's worth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from upright.identification.frequency.answer import FrequencyFit
from upright.identification.frequency.response import FrequencyResponse
from upright.records import Array
from upright.report.drawing import BLACK, BLUE, GREY, ORANGE, SKY, VERMILLION, figure, styled
from upright.report.symbols import number, plain, unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure


LEAST = ((BLUE, "-"), "least squares")
PAPER = ((VERMILLION, "--"), "simplex on dB")


@styled
def bode_figure(
    data: FrequencyResponse, answer: FrequencyFit | None = None, *, fine: Sequence[tuple[Array, Any]] = ()
) -> Figure:
    """Magnitude [dB] and phase [deg] of every output, with 95 % bars; both fits, and what they leave over.

    `fine` are frequencies and responses (F, n) of the fits on a close grid, least squares first.
    """
    n = len(data.outputs)
    rows = 4 if answer is not None else 2
    drawing = figure(1.0 + (5.6 if answer is not None else 3.9), margins=(0.9, 0.08, 0.5, 0.45))
    heights = [3, 2.4, 1.1, 1.1][:rows]
    shape = {"height_ratios": heights, "hspace": 0.14, "wspace": 0.22}
    panels: Any = drawing.subplots(rows, n, sharex=True, squeeze=False, gridspec_kw=shape)
    used = np.isin(data.omega, answer.used.omega) if answer is not None else np.ones(len(data), dtype=bool)
    for j, name in enumerate(data.outputs):
        magnitude, phase = panels[0, j], panels[1, j]
        _points(magnitude, data, used, data.magnitude_dB[:, j], 1.96 * 20 / np.log(10) * data.error[:, j])
        turn = np.degrees(np.unwrap(np.angle(data.response[:, j])))
        turn -= 360 * np.round(np.median(turn + 90) / 360)
        _points(phase, data, used, turn, 1.96 * np.degrees(data.error[:, j]))
        for ((colour, style), label), (w, model) in zip((LEAST, PAPER), fine, strict=False):
            magnitude.plot(w, 20 * np.log10(np.abs(model[:, j])), color=colour, linestyle=style, label=label)
            angle = np.degrees(np.unwrap(np.angle(model[:, j])))
            near = int(np.argmin(np.abs(w - data.omega[len(data) // 2])))
            angle -= 360 * np.round((angle[near] - turn[len(data) // 2]) / 360)
            phase.plot(w, angle, color=colour, linestyle=style)
        magnitude.set_title(f"{plain(name)} / {data.input}")
        if j == 0:
            to, by = unit(data.units[j]), unit(data.units[-1])
            per = f" re 1 {to}/{by}" if to and by else ""
            magnitude.set_ylabel(f"magnitude [dB{per}]")
            phase.set_ylabel("phase [deg]")
        phase.yaxis.set_major_locator(_multiples(90))
        if answer is not None:
            _residuals(panels[2, j], panels[3, j], answer, j, first=j == 0)
        _frequencies(panels[-1, j], data)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: (not labels[i].startswith("measured"), labels[i]))
    drawing.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper right", ncols=4, borderpad=0.2)
    for axes in panels[:, 0]:
        axes.yaxis.set_label_coords(-0.62 / (3.27 if n > 1 else 6.54), 0.5)
    return drawing


def _points(axes: Any, data: FrequencyResponse, used: NDArray[np.bool_], y: Array, bar: Array) -> None:
    style = {"fmt": "o", "color": BLACK, "markersize": 3.2, "capsize": 2, "linewidth": 0.8}
    axes.errorbar(data.omega[used], y[used], bar[used], label="measured", **style)
    if not used.all():
        axes.plot(
            data.omega[~used], y[~used], "o", color=GREY, markersize=4.5, fillstyle="none", label="measured, left out"
        )


def _residuals(upper: Any, lower: Any, answer: FrequencyFit, j: int, *, first: bool) -> None:
    """What each fit leaves of magnitude [%] and phase [deg]; the simplex' own dB are far larger."""
    data = answer.used
    for ((colour, _), _), model, mark in (
        (PAPER, answer.simplex.model, "s"),
        (LEAST, answer.squares.way.model, "o"),
    ):
        off = np.log(data.response[:, j] / model[:, j])
        upper.plot(data.omega, 100 * np.real(off), mark, color=colour, markersize=2.6)
        lower.plot(data.omega, np.degrees(np.imag(off)), mark, color=colour, markersize=2.6)
    for axes, label in ((upper, "magnitude\nleft [%]"), (lower, "phase\nleft [deg]")):
        axes.axhline(0, color=GREY, linewidth=0.6)
        axes.set_yscale("symlog", linthresh=0.1, linscale=1.0)
        axes.set_ylim(*(f * max(0.15, float(np.max(np.abs(axes.get_ylim())))) for f in (-1.6, 1.6)))
        _decades(axes)
        if first:
            axes.set_ylabel(label, fontsize=8.5)


def _decades(axes: Any) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter

    top = float(np.max(np.abs(axes.get_ylim())))
    ticks = [0.0, *(s * v for v in (0.1, 1.0, 10.0, 100.0) if v <= top for s in (-1, 1))]
    axes.yaxis.set_major_locator(FixedLocator(sorted(ticks)))
    axes.yaxis.set_minor_locator(FixedLocator([]))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda v, _: number(float(v), 1)))
    axes.tick_params(axis="y", labelsize=7)


def _multiples(step: float) -> Any:
    from matplotlib.ticker import MultipleLocator

    return MultipleLocator(step)


def _frequencies(axes: Any, data: FrequencyResponse) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

    axes.set_xscale("log")
    low, high = float(data.omega[0]), float(data.omega[-1])
    nice = [m * 10.0**d for d in range(-3, 5) for m in (1, 2, 5)]
    axes.xaxis.set_major_locator(FixedLocator([v for v in nice if 0.9 * low <= v <= 1.1 * high]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("frequency [rad/s]")


def _whole_decades(axes: Any) -> None:
    """Whole powers of ten at either end, which alone are labelled: the labels between are longer than the margin."""
    from matplotlib.ticker import NullFormatter

    axes.set_yscale("log")
    shown = np.concatenate([line.get_ydata() for line in axes.get_lines()])
    shown = shown[shown > 0]
    low, high = math.floor(math.log10(shown.min())), math.ceil(math.log10(shown.max()))
    axes.set_ylim(10.0**low, 10.0 ** max(high, low + 1))
    axes.yaxis.set_minor_formatter(NullFormatter())


@styled
def quality_figure(data: FrequencyResponse) -> Figure:
    """What each point is worth: what is not coherent, harmonics, stated error, and the motion it was measured at."""
    drawing = figure(4.4, margins=(0.72, 0.08, 0.1, 0.45))
    panels: Any = drawing.subplots(2, 2, sharex=True, gridspec_kw={"hspace": 0.1, "wspace": 0.28})
    marks = (("o", BLUE), ("s", VERMILLION), ("^", ORANGE), ("v", SKY))
    amplitude = np.abs(data.response * data.drive[:, None])
    shown = (
        (np.maximum(1 - data.coherence, 1e-9), "1 − coherence"),
        (data.distortion, "harmonics over fundamental"),
        (np.maximum(100 * data.error, 1e-5), "standard error [%]"),
        (amplitude, "amplitude"),
    )
    for axes, (values, label) in zip(panels.ravel(), shown, strict=True):
        for j, name in enumerate(data.outputs):
            mark, colour = marks[j % len(marks)]
            of = f" [{unit(data.units[j])}]" if label == "amplitude" and unit(data.units[j]) else ""
            if values.any():
                axes.plot(data.omega, values[:, j], mark, color=colour, markersize=3.5, label=plain(name) + of)
        axes.set_ylabel(label)
        if values.any():
            _whole_decades(axes)
        else:
            axes.set_yticks([])
            axes.text(0.5, 0.5, "not measured by a sweep", transform=axes.transAxes, ha="center", color=GREY)
    panels[0, 0].legend(loc="best")
    panels[1, 1].plot(data.omega, np.abs(data.drive), "x", color=BLACK, markersize=4,
                      label=f"command [{unit(data.units[-1])}]" if unit(data.units[-1]) else "command")  # fmt: skip
    panels[1, 1].legend(loc="best", fontsize=8.5)
    _whole_decades(panels[1, 1])
    for axes in panels[1]:
        _frequencies(axes, data)
    return drawing
