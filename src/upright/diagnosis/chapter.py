"""What looks wrong with a log as a chapter: each finding with its evidence, its picture and what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.diagnosis.findings import KINDS, Diagnosis, Finding
from upright.report.drawing import CYCLE, GREY, ORANGE, decimated, figure, hide_inner_times, styled
from upright.report.page import Block, Chapter, Code, Facts, Part, Picture
from upright.report.prose import chapter_of

if TYPE_CHECKING:
    from upright.report.drawing import Figure


def chapter(diagnosis: Diagnosis, *, log: Path, rig: str = "", page: bool = True) -> Chapter:
    """What was found in a log.

    Parameters
    ----------
    log : Path
        As it was typed.
    rig : str
        The rig, study or fit that was named.
    page : bool
        Whether a page with the pictures is written anyhow, so that none need be proposed.
    """
    unchecked = tuple((KINDS[k], why) for k, why in diagnosis.unchecked.items())
    written = chapter_of(
        __name__, diagnosis=diagnosis, log=log, rig=rig, page=page, kinds=KINDS, file=Path(diagnosis.file).name,
        placed={
            "findings": [_part(f, f"finding-{i}") for i, f in enumerate(diagnosis.findings, start=1)],
            "unchecked": (Facts(unchecked),),
        },
    )  # fmt: skip
    return replace(written, sound=not diagnosis.wrong)


def _part(finding: Finding, key: str) -> Part:
    facts = [("Finding", finding.sentence)]
    if finding.evidence:
        evidence = (f"{name.rpartition(' [')[0]} {value:.4g}{_unit(name)}" for name, value in finding.evidence.items())
        facts.append(("Evidence", f"{', '.join(evidence)}."))
    if finding.advice:
        facts.append(("What to do", finding.advice))
    content: list[Block] = [Facts(tuple(facts))]
    if finding.key:
        content.append(Code(finding.key))
    if finding.panels:
        content.append(
            Picture(
                name=key,
                draw=lambda: finding_figure(finding),
                caption="Dashed lines point at instants, shaded spans are what it speaks of."
                if finding.marks or finding.spans
                else "The columns it is about.",
                description=finding.sentence,
            )
        )
    return Part(title=f"{finding.severity}: {finding.kind}", key=key, content=tuple(content))


def _unit(name: str) -> str:
    unit = name.rpartition("[")[2].rstrip("]")
    return "" if unit in ("1", "") else f" {unit}"


@styled
def finding_figure(finding: Finding) -> Figure:
    """Panels of one finding over time [s]; dashed lines point at instants, shaded spans are what it speaks of."""
    count = len(finding.panels)
    drawing = figure(0.55 + 1.45 * count)
    axes: list[Any] = drawing.subplots(count, 1, squeeze=False)[:, 0].tolist()
    spans = [(float(p.curves[0].t.min()), float(p.curves[0].t.max())) for p in finding.panels]
    for ax, panel, (low, high) in zip(axes, finding.panels, spans, strict=True):
        for start, stop in finding.spans:
            ax.axvspan(max(start, low), min(stop, high), color=ORANGE, alpha=0.18, linewidth=0)
        for at in finding.marks:
            if low <= at <= high:
                ax.axvline(at, color=GREY, linewidth=0.9, linestyle="--")
        for k, curve in enumerate(panel.curves):
            colour, line = CYCLE[k % len(CYCLE)]
            few = curve.t.size <= 120
            t, y = decimated(curve.t, curve.y)
            if curve.style == "points":
                ax.plot(t, y, ".", markersize=4 if few else 2, color=colour, label=curve.name)
            else:
                step = "steps-post" if curve.style == "steps" else "default"
                ax.plot(t, y, color=colour, linestyle=line, drawstyle=step, label=curve.name)
        ax.set_ylabel(panel.label, rotation=0, ha="right", va="center", fontsize=8.5, parse_math=False)
        if len(panel.curves) > 1:
            legend = ax.legend(loc="best", fontsize=8.5)
            for text in legend.get_texts():
                text.set_parse_math(False)
        ax.margins(x=0.01)
    same = all(np.allclose(span, spans[0]) for span in spans)
    if same:
        hide_inner_times(axes)
    else:
        axes[-1].set_xlabel("time [s]")
    drawing.align_ylabels(axes)
    return drawing
