"""A recovered law as a chapter: its gains, what it leaves unexplained, and the command recorded and reproduced."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.closed_loop import Recovery
from upright.closed_loop.recovery import TriedStructure, loop_recovered, loop_written
from upright.quantities import two_figures
from upright.records import Array, Record
from upright.report.drawing import BLUE, GREY, PALE, VERMILLION, decimated, figure, styled
from upright.report.page import Chapter, Part, Picture, Points, Step, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS_CLOSE_UP = 120


def chapter(record: Record, recovery: Recovery, log: str) -> Chapter:
    """Which law closed the loop of a log, named as it is shown."""
    left = Picture(
        name="law",
        draw=lambda: draw_law(record, recovery),
        caption="The command recorded and reproduced: the whole log, the rows where it moves most, and the residual "
        "beside the step of the command's column.",
        description=recovery.sentence,
    )
    return Chapter(
        title=f"{recovery.command} of {log}",
        verdict=f"{recovery.structure}.",
        detail=recovery.sentence,
        sound=recovery.quality != "poor",
        question="Which law closed the loop: its structure, its gains, its limit, and what does it leave unexplained?",
        parts=(
            Part("Gains", (_gain_table(recovery), Points(tuple(_circumstances(record, recovery))))),
            Part("Recorded and reproduced", (left,)),
            Part("Structures tried", (_tried_table(recovery),)),
        ),
        steps=tuple(_next_steps(recovery, log)),
    )


def _gain_table(recovery: Recovery) -> Table:
    rows = tuple(
        (name, f"{g.value:.7g}", *(f"{end:.7g}" for end in g.interval), g.meaning) for name, g in recovery.gains.items()
    )
    return Table(
        caption=recovery.structure, headings=("", "value", "at least", "at most", "acts"), rows=rows, numbers=(1, 2, 3)
    )


def _circumstances(record: Record, recovery: Recovery) -> list[str]:
    """How often the law was evaluated, how late, and where it was limited."""
    law, rows = recovery.law, record.t.size / recovery.rows.size
    unit = f" {recovery.unit}" if recovery.unit else ""
    rate = f"every {law.needed_period * 1e3:.5g} ms"
    rate += f", {recovery.every} times per row" if recovery.every > 1 else ", once per row" if rows < 1.5 else ""
    sentences = [f"Evaluated {rate}; {'a sample late' if law.delay else 'answers at the same sample'}."]
    if recovery.saturated:
        sums = " (its sum stands still meanwhile)" if law.windup == "hold" else ""
        sentences.append(
            f"Limited to {law.limit:.6g}{unit} in {two_figures(100 * recovery.saturated)} % of the rows{sums}."
        )
    return sentences


def _tried_table(recovery: Recovery) -> Table:
    """The best of every structure."""
    best: dict[str, TriedStructure] = {}
    for c in recovery.candidates:  # sorted by what they missed
        best.setdefault(c.name, c)
    unit = f" {recovery.unit}" if recovery.unit else ""
    return Table(
        caption="Tried", headings=("structure", "numbers", f"missed on rows held out{unit}"), numbers=(1, 2),
        rows=tuple((c.name, str(c.parameters), f"{c.missed:.3g}") for c in list(best.values())[:8]),
    )  # fmt: skip


def _next_steps(recovery: Recovery, log: str) -> list[Step]:
    if recovery.quality == "poor":
        return [
            Step(
                "Name the columns that the law reads, with --measured and --reference, or try --every N.",
                f"upright show {log}",
            )
        ]
    lines = "\n".join(line for line in (loop_recovered(recovery), loop_written(recovery)) if line)
    return [Step("Simulate the loop with the plant: put one of these into the run of a study.", lines)]


@styled
def draw_law(record: Record, recovery: Recovery) -> Figure:
    """Whole log, the rows where the command moves most, and the residual with the step of the command's column."""
    t, u, law = record.t[recovery.rows][3:], recovery.recorded[3:], recovery.reproduced[3:]
    drawing = figure(6.4)
    whole, close, left = drawing.subplots(3, 1, gridspec_kw={"height_ratios": [3, 3, 2]})
    unit = f" [{recovery.unit}]" if recovery.unit else ""
    _both(whole, *decimated(t, u, buckets=800), *decimated(t, law, buckets=800), points=False)
    part = _busiest(u)
    _both(close, t[part], u[part], t[part], law[part], points=True)
    close.set_title("close up, where it moves most")
    if recovery.resolution:
        left.axhspan(-recovery.resolution / 2, recovery.resolution / 2, color=PALE, label="half a step of the column")
    left.plot(*decimated(t, recovery.residual[3:], buckets=800), color=GREY, linewidth=0.8, label="recorded − law")
    for axes in (whole, close):
        axes.set_ylabel(f"{recovery.command[:24]}{unit}", parse_math=False)
    left.set_ylabel(f"residual{unit}", parse_math=False)
    left.set_xlabel("time [s]")
    for axes in (whole, left):
        axes.legend(loc="lower right", ncols=2, bbox_to_anchor=(1.0, 0.98), borderaxespad=0.0)
    whole.set_title("\n".join(wrap(f"{recovery.structure}; explains {recovery.explained:.4g} %", 62)), parse_math=False)
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
