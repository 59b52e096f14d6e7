"""How far did the model grow, and why no further? The ladder as a table, a picture and a page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from upright.identification.ladder.growth import Ladder, RungResult
from upright.identification.ladder.repeats import Repeats
from upright.report.advice import Step as Advice
from upright.report.document import Picture, picture, render
from upright.report.drawing import BLACK, BLUE, VERMILLION, figure, styled
from upright.report.figures import fit_figure
from upright.report.symbols import number, percent, plain
from upright.report.tables import provenance_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class LadderRow:
    """One rung as text."""

    name: str
    terms: str
    fit: str
    predicted: str
    cost: str
    parameters: str
    seconds: str
    kept: bool
    reason: str


@dataclass(frozen=True, kw_only=True)
class CeilingRow:
    """How well runs of one group predict one another, one signal, as text."""

    runs: str
    signal: str
    median: str
    range: str
    reached: str


def ladder_rows(ladder: Ladder) -> list[LadderRow]:
    """Every rung in the order tried."""
    return [
        LadderRow(
            name=s.rung.name,
            terms=terms(s),
            fit=percent(s.fit_percent),
            predicted=percent(s.predicted_percent),
            cost=number(s.cost, 3),
            parameters=f"{s.parameters} + {s.own}",
            seconds=f"{s.seconds:.1f}",
            kept=s.kept,
            reason=s.reason,
        )
        for s in ladder.steps
    ]


def terms(step: RungResult) -> str:
    """What a rung changes: names it adds, drops, and lets differ from run to run."""
    rung = step.rung
    said = [", ".join(rung.adds)] if rung.adds else []
    said += [f"without {', '.join(rung.drops)}"] if rung.drops else []
    said += [f"{', '.join(rung.unknown)} of each run"] if rung.unknown else []
    return "; ".join(said)


def ceiling_rows(ladder: Ladder) -> list[CeilingRow]:
    """Every group of repeats and signal, beside what the chosen model predicts of the same runs."""
    return [
        CeilingRow(
            runs=", ".join(group.labels),
            signal=plain(signal),
            median=percent(group.ceiling[signal]),
            range=f"{percent(min(values))} to {percent(max(values))}",
            reached=percent(reached(ladder, group, signal)),
        )
        for group in ladder.repeats
        for signal, values in group.percents.items()
    ]


def reached(ladder: Ladder, group: Repeats, signal: str) -> float:
    """Mean percent of one signal that the chosen model predicts of a group's runs."""
    values = [ladder.scores[run].fit_percent[signal] for run in group.labels if run in ladder.scores]
    return float(np.mean(values)) if values else math.nan


@styled
def ladder_figure(ladder: Ladder) -> Figure:
    """Fit and prediction against the rung, one curve per signal's mean, the ceiling as a line; parameters below."""
    steps, x = ladder.steps, np.arange(len(ladder.steps))
    drawing = figure(3.9, margins=(0.62, 1.75, 0.15, 1.2))
    ax = drawing.add_subplot()
    predicted = np.array([s.predicted_percent for s in steps])
    fitted = np.array([s.fit_percent for s in steps])
    kept = np.array([s.kept for s in steps])
    ax.plot(x[kept], fitted[kept], color=BLUE, linestyle="--", linewidth=1)
    ax.plot(x[kept], predicted[kept], color=VERMILLION, linestyle="-", linewidth=1.4)
    for values, colour, mark, label in ((fitted, BLUE, "s", "fitted"), (predicted, VERMILLION, "o", "predicted")):
        ax.plot(x[kept], values[kept], mark, color=colour, markersize=6, label=label)
        ax.plot(x[~kept], values[~kept], mark, color=colour, markersize=6, markerfacecolor="white",
                label=f"{label}, refused" if not kept.all() else None)  # fmt: skip
    ceiling = _ceiling(ladder)
    if math.isfinite(ceiling):
        ax.axhline(ceiling, color=BLACK, linestyle=(0, (6, 2, 1, 2)), linewidth=1.1, label="a repeat by another")
    shown = np.concatenate([fitted, predicted, [ceiling] if math.isfinite(ceiling) else []])
    low = max(float(np.nanmin(shown)), 0.0)
    ax.set_ylim(low - 0.08 * (100 - low), 100 + 0.04 * (100 - low))
    for i, value in enumerate(predicted):
        if value < low:
            ax.annotate(f"{percent(value)} ↓", (i, low), ha="center", va="bottom", fontsize=8, color=VERMILLION)
    ax.set_xlim(-0.4, len(steps) - 0.6)
    ax.set_xticks(x, [_label(s) for s in steps])
    ax.set_ylabel("mean fit [%]")
    ax.set_xlabel("rung, with its number of parameters (+ those of single runs)")
    ax.legend(loc="center left", bbox_to_anchor=(1.01, 0.5))
    return drawing


def _ceiling(ladder: Ladder) -> float:
    values = [v for group in ladder.repeats for v in group.ceiling.values()]
    return float(np.mean(values)) if values else math.nan


def _label(step: RungResult) -> str:
    lines = [""]
    for word in step.rung.name.split():
        if lines[-1] and len(lines[-1]) + len(word) > 12:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join([*lines, f"{step.parameters} + {step.own}", "" if step.kept else "(refused)"]).rstrip()


def next_rungs(ladder: Ladder, *, study: str, folder: str, data: str, trimmed: bool) -> list[Advice]:
    """What to do with the ladder."""
    steps: list[Advice] = []
    if ladder.interrupted:
        steps.append(Advice(sentence="The climb was stopped; run it to its end."))
    file = f"{folder}/study.toml" if trimmed else study
    if ladder.left_out and not trimmed:
        steps.append(Advice(sentence=f"Take {', '.join(ladder.left_out)} out of the study: they were refused."))
    own = [n for s in ladder.kept for n in s.rung.unknown]
    if own:
        lines = f"[[runs]]\nunknown = {list(ladder.runs[0].unknown)}".replace("'", '"')
        steps.append(Advice(sentence=f"Add {', '.join(own)} to what each run has unknown.", command=lines))
    steps.append(
        Advice(
            sentence="Fit the chosen model, with its intervals and what the data cannot see.",
            command=f"upright identify {file}{f' --data {data}' if data else ''} -o {folder}/fit",
        )
    )
    if not ladder.repeats:
        steps.append(
            Advice(
                sentence="Repeat one run with the same command: how well one repeat predicts the other is the ceiling "
                "of what any model can explain."
            )
        )
    refused = still_refused(ladder)
    if refused:
        steps.append(
            Advice(
                sentence=f"If you believe in {', '.join(refused)} all the same, record a run in which "
                "it matters more: these runs do not ask for it."
            )
        )
    return steps


def ladder_content(
    ladder: Ladder, *, title: str, provenance: Mapping[str, object], steps: Sequence[Advice]
) -> dict[str, object]:
    """What the template needs to know."""
    return {
        "title": title,
        "ladder": ladder,
        "verdict": verdict(ladder),
        "rows": ladder_rows(ladder),
        "ceilings": ceiling_rows(ladder),
        "climb": picture(
            ladder_figure(ladder),
            "ladder-climb",
            caption="Mean fit percent of all signals and runs against the rung: fitted, and predicted "
            f"({ladder.held_out}). Open marks: refused. Dash-dotted: how well one repeat of a run predicts another.",
            description="; ".join(f"{r.name}: fitted {r.fit}, predicted {r.predicted}" for r in ladder_rows(ladder)),
        ),
        "left": residuals(ladder),
        "provenance": provenance_rows(provenance),
        "steps": list(steps),
    }


def still_refused(ladder: Ladder) -> list[str]:
    """Names of the rungs that were refused and not kept later."""
    kept = [s.rung for s in ladder.kept]
    return list(dict.fromkeys(s.rung.name for s in ladder.steps if s.rung not in kept))


def verdict(ladder: Ladder) -> str:
    """What the ladder chose, in two sentences."""
    last = ladder.kept[-1] if ladder.kept else None
    if last is None:
        return f"No rung was finished. {ladder.stopped}"
    refused = still_refused(ladder)
    names = " + ".join(s.rung.name for s in ladder.kept)
    scores = f"{percent(last.predicted_percent)} predicted on average, {percent(last.fit_percent)} fitted"
    said = f"The data ask for {names}: {scores}."
    if refused:
        said += f" Refused: {', '.join(refused)}."
    return f"{said} {ladder.stopped}"


def residuals(ladder: Ladder) -> list[Picture]:
    """What the chosen model leaves over where it predicts."""
    return [
        picture(
            fit_figure(
                score, ladder.rig.plant, title=f"{label} (predicted)", buckets=max(100, 3000 // len(ladder.scores))
            ),
            f"ladder-run{i}",
            caption=f"Run '{label}', {ladder.held_out}. Wide light line: measured; thin dashed line: model; below, "
            "what the chosen rung leaves over.",
            description=", ".join(f"{plain(n)} {percent(v)}" for n, v in score.fit_percent.items()),
        )
        for i, (label, score) in enumerate(ladder.scores.items())
    ]


def write_ladder_report(
    ladder: Ladder, folder: Path, *, title: str, provenance: Mapping[str, object], steps: Sequence[Advice]
) -> Path:
    """Write the ladder as one self-contained page, ``folder / "ladder.html"``."""
    text = render("ladder.html", **ladder_content(ladder, title=title, provenance=provenance, steps=steps))
    folder.mkdir(parents=True, exist_ok=True)
    path, half = folder / "ladder.html", folder / ".ladder.html.part"
    half.write_text(text, encoding="utf-8", errors="replace")
    half.replace(path)
    return path
