"""A ladder of models as a chapter: how far the model grew, why no further, and what is left over."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from upright.identification.ladder.growth import Ladder, RungResult
from upright.identification.ladder.repeats import Repeats
from upright.report.drawing import BLACK, BLUE, VERMILLION, figure, styled
from upright.report.fit.chapter import data_part
from upright.report.fit.figures import fit_figure
from upright.report.page import Block, Chapter, Facts, Part, Picture, Step, Table
from upright.report.symbols import number, percent, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def chapter(ladder: Ladder, *, title: str, provenance: Mapping[str, object], steps: Iterable[Step] = ()) -> Chapter:
    """What a ladder says; `steps` are those of `ladder_steps`."""
    description = "; ".join(
        f"{s.rung.name}: fitted {percent(s.fit_percent)}, predicted {percent(s.predicted_percent)}"
        for s in ladder.steps
    )
    climb = Picture(
        name="ladder-climb",
        draw=lambda: ladder_figure(ladder),
        caption="Mean fit percent of all signals and runs against the rung: fitted, and predicted "
        f"({ladder.held_out}). Open marks: refused. Dash-dotted: how well one repeat of a run predicts another.",
        description=description,
    )
    refused = f"Refused: {', '.join(_refused(ladder))}. " if ladder.accepted and _refused(ladder) else ""
    return Chapter(
        title=title,
        verdict=_verdict(ladder),
        detail=refused + ladder.stopped,
        sound=not ladder.interrupted,
        question="How rich a model do these data deserve? Each rung adds terms to the model and is kept only if what "
        f"it has not seen is predicted better by more than chance: {ladder.held_out}.",
        parts=(
            Part(title="The ladder", key="ladder", content=(climb, rung_table(ladder))),
            Part(title="Why", key="why", content=(Facts(tuple((s.rung.name, s.reason) for s in ladder.steps)),)),
            Part(title="How well the rig repeats itself", key="ceiling", content=_ceilings(ladder)),
            Part(title="What the chosen rung leaves over", key="rest", content=tuple(_residuals(ladder))),
            data_part(provenance),
        ),
        warnings=ladder.warnings,
        steps=tuple(steps),
    )


def rung_table(ladder: Ladder) -> Table:
    """Every rung in the order tried."""
    rows = tuple(
        (
            s.rung.name, _terms(s), percent(s.fit_percent), percent(s.predicted_percent), number(s.cost, 3),
            f"{s.parameters} + {s.per_run}", f"{s.seconds:.1f}", "kept" if s.accepted else "refused",
        )
        for s in ladder.steps
    )  # fmt: skip
    return Table(
        caption="Mean fit percent over signals and runs; parameters of the rig + those of single runs; predicted: "
        f"{ladder.held_out}",
        headings=("rung", "terms", "fitted", "predicted", "cost", "parameters", "seconds", "decision"),
        rows=rows, numbers=(2, 3, 4, 5, 6), badge=7,
    )  # fmt: skip


def _terms(step: RungResult) -> str:
    """What a rung changes: names it adds, drops, and lets differ from run to run."""
    rung = step.rung
    terms = [", ".join(rung.adds)] if rung.adds else []
    terms += [f"without {', '.join(rung.drops)}"] if rung.drops else []
    terms += [f"{', '.join(rung.unknown)} of each run"] if rung.unknown else []
    return "; ".join(terms)


def _ceilings(ladder: Ladder) -> tuple[Block, ...]:
    """Every group of repeats and signal, beside what the chosen model predicts of the same runs."""
    if not ladder.repeats:
        return ("No run repeats another, so how much is left to explain is not known.",)
    rows = tuple(
        (
            ", ".join(group.labels), plain(signal), percent(group.ceiling[signal]),
            f"{percent(min(values))} to {percent(max(values))}", percent(_reached(ladder, group, signal)),
        )
        for group in ladder.repeats for signal, values in group.percents.items()
    )  # fmt: skip
    return (
        "What one run says about another with the same command, after the offset is taken off: the one at the start, "
        "or the one that suits best where the model, too, may choose it. No model has to do better; one that does "
        "better is spared the scatter of the repeat it is compared with.",
        Table(
            caption="Fit percent of one repeat by another, and of the same runs by the chosen model's predictions",
            headings=("runs", "signal", "median", "range", "model"), rows=rows, numbers=(2, 3, 4),
        ),
    )  # fmt: skip


def _reached(ladder: Ladder, group: Repeats, signal: str) -> float:
    """Mean percent of one signal that the chosen model predicts of a group's runs."""
    values = [ladder.scores[run].fit_percent[signal] for run in group.labels if run in ladder.scores]
    return float(np.mean(values)) if values else math.nan


def _residuals(ladder: Ladder) -> list[Picture]:
    """What the chosen model leaves over where it predicts."""
    buckets = max(100, 3000 // max(len(ladder.scores), 1))
    return [
        Picture(
            name=f"ladder-run{i}",
            draw=lambda score=score, label=label: fit_figure(
                score, ladder.rig.plant, title=f"{label} (predicted)", buckets=buckets
            ),
            caption=f"Run '{label}', {ladder.held_out}. Wide light line: measured; thin dashed line: model; below, "
            "what the chosen rung leaves over.",
            description=", ".join(f"{plain(n)} {percent(v)}" for n, v in score.fit_percent.items()),
        )
        for i, (label, score) in enumerate(ladder.scores.items())
    ]


@styled
def ladder_figure(ladder: Ladder) -> Figure:
    """Fit and prediction against the rung, one curve per signal's mean, the ceiling as a line; parameters below."""
    steps, x = ladder.steps, np.arange(len(ladder.steps))
    drawing = figure(3.9, margins=(0.62, 1.75, 0.15, 1.2))
    ax = drawing.add_subplot()
    predicted = np.array([s.predicted_percent for s in steps])
    fitted = np.array([s.fit_percent for s in steps])
    accepted = np.array([s.accepted for s in steps])
    ax.plot(x[accepted], fitted[accepted], color=BLUE, linestyle="--", linewidth=1)
    ax.plot(x[accepted], predicted[accepted], color=VERMILLION, linestyle="-", linewidth=1.4)
    for values, colour, mark, label in ((fitted, BLUE, "s", "fitted"), (predicted, VERMILLION, "o", "predicted")):
        ax.plot(x[accepted], values[accepted], mark, color=colour, markersize=6, label=label)
        ax.plot(x[~accepted], values[~accepted], mark, color=colour, markersize=6, markerfacecolor="white",
                label=f"{label}, refused" if not accepted.all() else None)  # fmt: skip
    ceiling = _ceiling(ladder)
    if math.isfinite(ceiling):
        ax.axhline(ceiling, color=BLACK, linestyle=(0, (6, 2, 1, 2)), linewidth=1.1, label="a repeat by another")
    shown = np.concatenate([fitted, predicted, [ceiling] if math.isfinite(ceiling) else []])
    low = max(float(np.nanmin(shown)), 0.0)
    ax.set_ylim(low - 0.08 * (100 - low), 100 + 0.04 * (100 - low))
    for i, value in enumerate(predicted):
        if value < low:
            ax.annotate(f"{percent(value)} ↓", (i, low), ha="center", va="bottom", fontsize=8.5, color=VERMILLION)
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
    lines = wrap(step.rung.name, 13, break_long_words=False)
    return "\n".join([*lines, f"{step.parameters} + {step.per_run}", "" if step.accepted else "(refused)"]).rstrip()


def ladder_steps(ladder: Ladder, *, study: str, folder: str, data: str, trimmed: bool) -> Iterator[Step]:
    """What to do with the ladder."""
    if ladder.interrupted:
        yield Step("The climb was stopped; run it to its end.")
    file = f"{folder}/study.toml" if trimmed else study
    if ladder.left_out and not trimmed:
        yield Step(f"Take {', '.join(ladder.left_out)} out of the study: they were refused.")
    own = [n for s in ladder.accepted for n in s.rung.unknown]
    if own:
        lines = f"[[runs]]\nunknown = {list(ladder.runs[0].unknown)}".replace("'", '"')
        yield Step(f"Add {', '.join(own)} to what each run has unknown.", lines)
    yield Step(
        "Fit the chosen model, with its intervals and what the data cannot see.",
        f"upright identify {file}{f' --data {data}' if data else ''} -o {folder}/fit",
    )
    if not ladder.repeats:
        yield Step(
            "Repeat one run with the same command: how well one repeat predicts the other is the ceiling of what any "
            "model can explain."
        )
    if refused := _refused(ladder):
        yield Step(
            f"If you believe in {', '.join(refused)} all the same, record a run in which it matters more: these runs "
            "do not ask for it."
        )


def _refused(ladder: Ladder) -> list[str]:
    """Names of the rungs that were refused and not kept later."""
    accepted = [s.rung for s in ladder.accepted]
    return list(dict.fromkeys(s.rung.name for s in ladder.steps if s.rung not in accepted))


def _verdict(ladder: Ladder) -> str:
    """What the ladder chose."""
    if not ladder.accepted:
        return "No rung was finished."
    last = ladder.accepted[-1]
    names = " + ".join(s.rung.name for s in ladder.accepted)
    scores = f"{percent(last.predicted_percent)} predicted on average, {percent(last.fit_percent)} fitted"
    if last.predicted_percent <= 0:  # no better than the mean of what was held out
        return f"No rung predicts what was held out. The best is {names}: {scores}."
    return f"The data ask for {names}: {scores}."
