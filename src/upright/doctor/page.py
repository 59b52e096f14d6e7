"""What looks wrong with a log, each finding with its picture, on one page that stands by itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.doctor.findings import KINDS, Diagnosis, Finding
from upright.report.document import Picture, picture, render
from upright.report.drawing import CYCLE, GREY, ORANGE, decimated, figure, hide_inner_times, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
        label = ax.set_ylabel(panel.label, rotation=0, ha="right", va="center", fontsize=8.5)
        label.set_parse_math(False)
        if len(panel.curves) > 1:
            legend = ax.legend(loc="best", fontsize=7.5)
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


def pictures(diagnosis: Diagnosis) -> list[tuple[Finding, Picture | None]]:
    """Every finding with its picture, None when it has nothing to draw."""
    out: list[tuple[Finding, Picture | None]] = []
    for i, finding in enumerate(diagnosis.findings):
        drawn = None
        if finding.panels:
            drawn = picture(
                finding_figure(finding), f"finding-{i + 1}", caption=_caption(finding), description=finding.sentence
            )
        out.append((finding, drawn))
    return out


def _caption(finding: Finding) -> str:
    what = ", ".join(f"{name.partition(' [')[0]} {value:.4g}{_unit(name)}" for name, value in finding.evidence.items())
    return f"Evidence: {what}." if what else "The columns it is about."


def _unit(name: str) -> str:
    unit = name.rpartition("[")[2].rstrip("]")
    return "" if unit in ("1", "") else f" {unit}"


def write_diagnosis(diagnosis: Diagnosis, path: Path) -> Path:
    """Write the page; one that exists is replaced at once or not at all."""
    text = render(
        "doctor.html",
        title=f"What looks wrong with {Path(diagnosis.file).name}",
        diagnosis=diagnosis,
        findings=pictures(diagnosis),
        checked=[KINDS[k] for k in diagnosis.checked],
        unchecked=[(KINDS[k], why) for k, why in diagnosis.unchecked.items()],
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    half = path.with_name(f".{path.name}.part")
    half.write_text(text, encoding="utf-8", errors="replace")
    half.replace(path)
    return path
