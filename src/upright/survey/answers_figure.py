"""From how many answers can the printed means come?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from upright.report.drawing import BLUE, GREY, VERMILLION, figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def answers_figure(impossible: dict[int, int], claimed: int) -> Figure:
    """How many printed means cannot come from n answers, by n; `claimed` is the number that was printed."""
    drawing = figure(2.6)
    ax: Any = drawing.subplots()
    colours = [VERMILLION if n == claimed else BLUE if count <= 1 else GREY for n, count in impossible.items()]
    bars = ax.bar(list(impossible), list(impossible.values()), color=colours)
    ax.bar_label(bars, fontsize=7.5)
    ax.set_xticks(list(impossible))
    ax.set_xlabel("number of students who answered")
    ax.set_ylabel("impossible means")
    ax.text(claimed, impossible[claimed] + 2.0, "as printed", ha="center", fontsize=8, color=VERMILLION)
    return drawing
