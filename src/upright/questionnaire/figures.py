"""How do gains, agreement, bounds and numbers of answers look?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from upright.questionnaire import Bound, Fits, Paired
from upright.questionnaire.sheet import LIKERT
from upright.report.drawing import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION, figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TONES: dict[str, str] = dict(zip(LIKERT, (BLUE, SKY, "#e4e4e4", ORANGE, VERMILLION, GREY), strict=True))


@styled
def gain_figure(found: Sequence[tuple[str, Paired]], scale: tuple[int, int]) -> Figure:
    """Means before and after, and the mean gain with its 95 % interval."""
    drawing = figure(1.1 + 0.42 * len(found), margins=(2.2, 0.2, 0.5, 0.5))
    left, right = drawing.subplots(1, 2, sharey=True)
    for i, (_, p) in enumerate(found):
        left.plot([p.pre, p.post], [i, i], color=GREY, linewidth=1.5)
        left.plot([p.pre], [i], "o", color=ORANGE, label="before" if i == 0 else "")
        left.plot([p.post], [i], "s", color=BLUE, label="after" if i == 0 else "")
        half = p.interval[1] - p.gain
        right.errorbar([p.gain], [i], xerr=[half], fmt="o", color=BLACK, capsize=3)
    right.axvline(0, color=GREY, linewidth=0.8, linestyle=":")
    left.set_yticks(range(len(found)), [_short(name) for name, _ in found])
    left.set_ylim(len(found) - 0.5, -0.5)
    left.set_xlim(scale[0] - 0.1, scale[1] + 0.1)
    left.set_xlabel("mean rating")
    right.set_xlabel("mean gain, 95 % interval")
    left.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.1)
    return drawing


@styled
def agreement_figure(rows: Sequence[tuple[str, Sequence[str], Sequence[float]]]) -> Figure:
    """Share of every answer, one bar per statement."""
    drawing = figure(1.1 + 0.42 * len(rows), margins=(2.4, 0.2, 0.6, 0.45))
    axes = drawing.subplots()
    seen: set[str] = set()
    for i, (_, options, shares) in enumerate(rows):
        start = 0.0
        for option, share in zip(options, shares, strict=True):
            name = option.lower()
            tone = _TONES[name.replace("’", "'")]
            axes.barh([i], [share], left=[start], color=tone, edgecolor="white", label="" if name in seen else name)
            seen.add(name)
            if share >= 7:
                dark = tone in (BLUE, VERMILLION, GREY)
                axes.text(start + share / 2, i, f"{share:.0f}", ha="center", va="center",
                          color="white" if dark else "black", fontsize=8)  # fmt: skip
            start += share
    axes.set_yticks(range(len(rows)), [_short(name) for name, _, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("share of the answers [%]")
    axes.grid(visible=False)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.3, 1), ncols=5, borderaxespad=0.1, columnspacing=1.0)
    return drawing


@styled
def bounds_figure(rows: Sequence[tuple[str, Bound]]) -> Figure:
    """Range of the paired t that the printed means allow, beside the value it has to pass."""
    drawing = figure(0.9 + 0.34 * len(rows), margins=(2.9, 0.2, 0.3, 0.5))
    axes = drawing.subplots()
    most = max([b.t[1] for _, b in rows if math.isfinite(b.t[1])], default=10.0) * 1.05
    for i, (_, b) in enumerate(rows):
        low, high = max(b.t[0], -most), min(b.t[1], most)
        colour = BLUE if b.verdict == "significant" else ORANGE
        axes.plot([low, high], [i, i], color=colour, linewidth=5, solid_capstyle="butt")
        axes.plot([low], [i], "|", color="black", markersize=9)
    critical = rows[0][1].critical
    axes.axvline(critical, color=VERMILLION, linestyle="--", label=f"5 % level, {critical:.2f}")
    axes.axvline(-critical, color=VERMILLION, linestyle="--")
    axes.set_yticks(range(len(rows)), [_short(name, 40) for name, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("paired t that the means allow")
    axes.legend(loc="upper right")
    return drawing


@styled
def fitting_figure(fits: Sequence[Fits], claimed: int) -> Figure:
    """How many of the printed numbers each number of answers makes possible."""
    drawing = figure(2.7)
    axes = drawing.subplots()
    n = np.array([f.answers for f in fits])
    share = np.array([f.possible for f in fits])
    axes.vlines(n, 0, share, color=[VERMILLION if k == claimed else SKY for k in n], linewidth=3)
    axes.plot(n, share, "o", color=BLUE, markersize=2.5)
    axes.axhline(fits[0].printed, color=GREEN, linestyle="--", linewidth=0.9)
    axes.annotate(f"claimed: {claimed}", (claimed, 1.01 * fits[0].printed), (0, 4), textcoords="offset points",
                  ha="center", va="bottom", color=VERMILLION, fontsize=8)  # fmt: skip
    axes.set_xlabel("answers")
    axes.set_ylabel(f"possible, of {fits[0].printed} numbers")
    axes.set_ylim(0, 1.12 * fits[0].printed)
    return drawing


@styled
def answers_figure(impossible: dict[int, int], claimed: int) -> Figure:
    """How many printed means cannot come from n answers, by n; `claimed` is the number that was printed."""
    drawing = figure(2.6)
    ax = drawing.subplots()
    colours = [VERMILLION if n == claimed else BLUE if count <= 1 else GREY for n, count in impossible.items()]
    bars = ax.bar(list(impossible), list(impossible.values()), color=colours)
    ax.bar_label(bars, fontsize=7.5)
    ax.set_xticks(list(impossible))
    ax.set_xlabel("number of students who answered")
    ax.set_ylabel("impossible means")
    ax.text(claimed, impossible[claimed] + 2.0, "as printed", ha="center", fontsize=8, color=VERMILLION)
    return drawing


def _short(name: str, most: int = 30) -> str:
    return name.replace("$", r"\$") if len(name) <= most else name[: most - 1].replace("$", r"\$") + "…"
