"""Does a recovered law put out what the log holds? The command recorded and reproduced, close up, and what is left."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.closed_loop import Recovery
from upright.records import Array, Record
from upright.report.drawing import BLUE, GREY, VERMILLION, decimated, figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS_CLOSE_UP = 120


@styled
def draw_law(record: Record, found: Recovery) -> Figure:
    """Whole log, the rows where the command moves most, and the residual with the step of the command's column."""
    t, u, law = record.t[found.rows][3:], found.recorded[3:], found.reproduced[3:]
    drawing = figure(6.4)
    whole, close, left = drawing.subplots(3, 1, gridspec_kw={"height_ratios": [3, 3, 2]})
    unit = f" [{found.unit}]" if found.unit else ""
    _both(whole, *decimated(t, u, buckets=800), *decimated(t, law, buckets=800), points=False)
    part = _busiest(u)
    _both(close, t[part], u[part], t[part], law[part], points=True)
    close.set_title("close up, where it moves most")
    if found.quantum:
        left.axhspan(-found.quantum / 2, found.quantum / 2, color="#eeeeee", label="half a step of the column")
    left.plot(*decimated(t, found.residual[3:], buckets=800), color=GREY, linewidth=0.8, label="recorded − law")
    for axes in (whole, close):
        label = axes.set_ylabel(f"{found.command[:24]}{unit}")
        label.set_parse_math(False)
    left.set_ylabel(f"residual{unit}").set_parse_math(False)
    left.set_xlabel("time [s]")
    for axes in (whole, left):
        axes.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0)
    title = whole.set_title(_wrapped(f"{found.structure}; explains {found.explained:.4g} %"))
    title.set_parse_math(False)
    return drawing


def _both(axes: Any, t: Array, u: Array, t_law: Array, law: Array, *, points: bool) -> None:
    marks: dict[str, Any] = {"marker": "o", "markersize": 2.5} if points else {}
    axes.plot(t, u, color=BLUE, linewidth=1.6, drawstyle="steps-post", label="recorded", **marks)
    axes.plot(t_law, law, color=VERMILLION, linewidth=0.9, linestyle="--", drawstyle="steps-post", label="law")


def _busiest(u: Array) -> slice:
    """The rows among which the command moves most, at most `ROWS_CLOSE_UP`."""
    n = min(ROWS_CLOSE_UP, u.size)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(u)))])
    moved = travel[n - 1 :] - travel[: travel.size - n + 1]
    first = int(np.argmax(moved))
    return slice(first, first + n)


def _wrapped(text: str) -> str:
    return "\n".join(wrap(text, 62))


@styled
def save_law(record: Record, found: Recovery, path: Path) -> None:
    """Write the figure as SVG, PNG or PDF, by the suffix of `path`."""
    drawing = draw_law(record, found)
    drawing.savefig(path, dpi=130, metadata={"Date": None} if path.suffix == ".svg" else None)
