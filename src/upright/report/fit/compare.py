"""Fits side by side as a chapter: runs that none has seen, predicted by each, and their parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from upright.identification.inference.agreement import ParameterAgreement
from upright.identification.model.fit import Estimate, RunScore
from upright.physics import Plant
from upright.report.drawing import CYCLE, SKY, WIDTH, decimated, figure, hide_inner_times, styled
from upright.report.fit.interactive import score_traces
from upright.report.fit.tables import interval
from upright.report.interactive.traces import ROOM
from upright.report.page import Block, Chapter, Part, Picture, Points, Step, Symbol, Table
from upright.report.symbols import axis, number, percent, plain, unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLACK_BOX = "black box"
"""Name of the baseline among those that predict."""
_COLUMNS = 5  # of a legend


@dataclass(frozen=True, kw_only=True)
class ComparedRun:
    """One run, predicted by every fit and by a black-box (ARX) baseline, over the same samples.

    `fitted_by` names fits to which it was fitted, so that theirs is no prediction.
    """

    scores: Mapping[str, RunScore]
    fitted_by: tuple[str, ...] = ()

    def worst(self, who: str) -> float:
        """Fit percent of the signal that is predicted worst."""
        return min(self.scores[who].fit_percent.values(), default=-1000.0)


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Fits beside each other.

    Attributes
    ----------
    parameters : mapping of str to (mapping of str to Estimate)
        By fit and name.
    agree : mapping of str to (mapping of str to ParameterAgreement)
        How the parameters of every other fit compare with those of the first, by fit and name.
    joint : mapping of str to (float, int, float)
        Wald's test of all of them at once: chi-square, degrees of freedom, probability; by fit.
    related : tuple of str
        Fits that rest on a log of the first one too, so that the test does not hold.
    trusted : mapping of str to bool
        Whether each fit trusts itself.
    """

    plant: type[Plant]
    runs: Mapping[str, ComparedRun]
    parameters: Mapping[str, Mapping[str, Estimate]]
    agree: Mapping[str, Mapping[str, ParameterAgreement]]
    joint: Mapping[str, tuple[float, int, float]] = field(default_factory=dict[str, "tuple[float, int, float]"])
    related: tuple[str, ...] = ()
    trusted: Mapping[str, bool] = field(default_factory=dict[str, bool])

    @property
    def new(self) -> dict[str, ComparedRun]:
        """Runs that no fit has seen."""
        return {label: run for label, run in self.runs.items() if not run.fitted_by}

    @property
    def best(self) -> str:
        """The fit whose worst signal of all unseen runs is predicted best; "" without such runs."""
        reach = {who: min(run.worst(who) for run in self.new.values()) for who in self.parameters if self.new}
        return max(reach, key=lambda who: reach[who], default="")


def chapter(compared: Comparison, *, command: str) -> Chapter:
    """What a comparison says."""
    best, differ = compared.best, _differing(compared)
    beaten = [label for label, run in compared.new.items() if BLACK_BOX in run.scores
              and run.worst(BLACK_BOX) > run.worst(best)]  # fmt: skip
    doubted = [who for who, trusted in compared.trusted.items() if not trusted]
    warnings = [
        *(f"Do not rely on {who} yet: that is its own verdict." for who in doubted),
        *(
            f"'{label}' was fitted by {', '.join(run.fitted_by)}: what these reach there is no prediction."
            for label, run in compared.runs.items()
            if run.fitted_by
        ),
        *(
            f"{who} rests on a log of the first fit too; their errors are not independent, and the test of the "
            "difference does not hold."
            for who in compared.related
        ),
    ]
    return Chapter(
        title=f"{' and '.join(compared.parameters)} compared",
        verdict=f"{_prediction(compared, beaten)} {_parameters_sentence(compared, differ)}".strip(),
        sound=bool(best) and not beaten and best not in doubted,
        parts=tuple(_parts(compared)),
        warnings=tuple(warnings),
        steps=tuple(_steps(compared, beaten, differ, command)),
        numbers=_numbers(compared),
    )


def _prediction(compared: Comparison, beaten: list[str]) -> str:
    """Who predicts best, against the black box."""
    best = compared.best
    if not compared.runs:
        return "No run was compared."
    if not best:
        return "Every run has been seen by one of the fits, so none tests them."
    worst = {who: min(run.worst(who) for run in compared.new.values()) for who in compared.parameters}
    others = ", ".join(f"{who} {percent(v)}" for who, v in worst.items() if who != best)
    base = [run.worst(BLACK_BOX) for run in compared.new.values() if BLACK_BOX in run.scores]
    against = [others] * bool(others) + [f"black box {percent(reached)}" for reached in sorted(base)[:1]]
    head = f"{best} predicts it." if len(worst) == 1 else f"{best} predicts best."
    if worst[best] <= 0:  # no better than its mean
        head = f"{best} does not predict it." if len(worst) == 1 else f"None of them predicts, {best} least badly."
    text = f"{head} It explains {percent(worst[best])} of the worst signal"
    text += f" ({', '.join(against)})." if against else "."
    return f"{text} The black box does better on {', '.join(beaten)}." if beaten else text


def _differing(compared: Comparison) -> list[tuple[str, str]]:
    """Fit and name of every parameter that differs from that of the first fit."""
    return [(who, n) for who, by in compared.agree.items() for n, a in by.items() if a.word.startswith("differ")]


def _parameters_sentence(compared: Comparison, differ: list[tuple[str, str]]) -> str:
    if len(compared.parameters) < 2:
        return ""
    tested = sum(a.word in ("agree", "differ") for by in compared.agree.values() for a in by.values())
    if not tested:
        return "No parameter is known to both, so none can be compared."
    if differ:
        text = [f"{plain(n)} of {who} by {compared.agree[who][n].amount}" for who, n in differ[:3]]
        return f"Parameters differ: {'; '.join(text)}{' and others' if differ[3:] else ''}."
    apart = [who for who, (_, _, p) in compared.joint.items() if p < 0.05]
    if apart:
        return f"Each parameter agrees by itself, but together those of {', '.join(apart)} differ."
    return "All parameters that both know agree." if tested > 1 else "The parameter that both know agrees."


def _parts(compared: Comparison) -> list[Part]:
    parts: list[Part] = []
    if compared.runs:
        content: list[Block] = [_score_table(compared)]
        for i, (label, run) in enumerate(compared.runs.items()):
            content.append(_picture(compared, f"run{i}", label, run))
        content.append(
            "Fits predict the second half of each run; of the run itself they see what their start state needs, the "
            "tenth before it. The black box is a linear difference equation (ARX) fitted to the first half of the same "
            "run: it has seen this rig on this day, the fits have not."
        )
        parts.append(Part(title="Predicted side by side", key="runs", content=tuple(content)))
    if compared.parameters:
        joint = tuple(
            f"{who} and {next(iter(compared.parameters))}, all at once: "
            f"{'differ' if p < 0.05 else 'agree'} (chi-square {number(x, 3)} with {n} degrees of freedom, "
            f"p {_chance(p)})."
            for who, (x, n, p) in compared.joint.items()
        )
        table = _parameter_table(compared)
        parts.append(Part(title="Parameters", key="parameters", content=(table, Points(joint)) if joint else (table,)))
    return parts


def _chance(p: float) -> str:
    return f"= {p:.2g}" if p > 1e-9 else "below 10⁻⁹"


def _score_table(compared: Comparison) -> Table:
    who = list(dict.fromkeys(w for run in compared.runs.values() for w in run.scores))
    rows: list[tuple[str, ...]] = []
    for label, run in compared.runs.items():
        for signal in next(iter(run.scores.values())).fit_percent:
            cells = [run.scores[w].fit_percent.get(signal) if w in run.scores else None for w in who]
            shown = tuple(
                "–" if v is None else percent(v) + (" (seen)" if w in run.fitted_by else "")
                for w, v in zip(who, cells, strict=True)
            )
            rows.append((label, plain(signal), *shown))
    return Table(
        caption="Fit percent, 100 (1 − |y − ŷ| / |y − mean y|), of the second half of each run",
        headings=("run", "signal", *who), rows=tuple(rows), numbers=tuple(range(2, 2 + len(who))),
    )  # fmt: skip


def _parameter_table(compared: Comparison) -> Table:
    fits = compared.parameters
    first, *others = fits
    names = dict.fromkeys(n for by in compared.agree.values() for n in by) or dict.fromkeys(fits[first])
    rows: list[tuple[str, ...]] = []
    for name in names:
        cells = tuple(_cell(fits[who].get(name)) for who in fits)
        of = next((fits[w][name].unit for w in fits if name in fits[w]), "")
        text = tuple(compared.agree[who][name].sentence() if name in compared.agree[who] else "–" for who in others)
        rows.append((Symbol(name), *cells, unit(of), *text))
    against = tuple(f"{who} against {first}" if others[1:] else "do they agree?" for who in others)
    return Table(
        caption="Estimates with 95 % intervals; a two-sided test on each difference, at most 5 % of all tables with a "
        "false “differ” (Holm)",
        headings=("symbol", *fits, "unit", *against), rows=tuple(rows), numbers=tuple(range(1, 1 + len(fits))),
    )  # fmt: skip


def _cell(e: Estimate | None) -> str:
    if e is None:
        return "–"
    return number(e.value) if e.stderr == 0 and e.zero_wide else f"{number(e.value)} ({interval(e)})"


def _picture(compared: Comparison, name: str, label: str, run: ComparedRun) -> Picture:
    more = (
        " Grey, on a screen: bands that should hold 90 % of the samples."
        if any(s.band for s in run.scores.values())
        else ""
    )
    more += f" Fitted by {', '.join(run.fitted_by)}." if run.fitted_by else ""
    worst = ", ".join(f"{who} {percent(run.worst(who))}" for who in run.scores)
    return Picture(
        name=name,
        draw=lambda: compared_figure(run.scores, compared.plant, title=label),
        interactive=lambda: score_traces(
            run.scores, compared.plant, name=label, room=ROOM // max(len(compared.runs), 1)
        ),
        caption=f"Run '{label}'. Wide light line: measured; others: predictions; below each signal, what is left over."
        f"{more}",
        description=f"Measured and predicted signals; of the worst signal are predicted: {worst}.",
    )


@styled
def compared_figure(scores: Mapping[str, RunScore], plant: type[Plant], *, title: str) -> Figure:
    """One run as measured and as several predict it, with what each leaves over."""
    units = {c.name: c.unit for c in plant.coordinates}
    first = next(iter(scores.values()))
    n = len(first.measured)
    named = 0.26 * math.ceil((1 + len(scores)) / _COLUMNS)  # inches of the legend, below the time
    drawing = figure(0.64 + 2.6 * n + named, margins=(0.85, 0.1, 0.5, 0.46 + named))
    grid = drawing.add_gridspec(2 * n, 1, height_ratios=[2.4, 1] * n, hspace=0.3)
    panels: list[Axes] = []
    for j, signal in enumerate(first.measured):
        upper = drawing.add_subplot(grid[2 * j], sharex=panels[0] if panels else None)
        lower = drawing.add_subplot(grid[2 * j + 1], sharex=upper)
        panels += [upper, lower]
        y = first.y[:, j]
        upper.plot(*decimated(first.t, y), color=SKY, linewidth=3, label="measured")
        for (who, score), (colour, style) in zip(scores.items(), CYCLE * 2, strict=False):
            upper.plot(
                *decimated(first.t, score.simulated[:, j]), color=colour, linestyle=style, linewidth=1, label=who
            )
            lower.plot(*decimated(first.t, y - score.simulated[:, j]), color=colour, linestyle=style, linewidth=0.8)
        room = 0.5 * float(np.ptp(y)) or 1.0
        upper.set_ylim(float(y.min()) - room, float(y.max()) + room)  # a model that ran away must not flatten the data
        upper.set_ylabel(axis(plain(signal), units.get(signal, "")))
        lower.set_ylabel("residual", fontsize=8)
        reach = min(2 * room, float(np.abs(lower.get_ylim()).max()))
        lower.set_ylim(-reach, reach)
    panels[0].set_title(title, parse_math=False)
    hide_inner_times(panels)
    drawing.legend(
        *panels[0].get_legend_handles_labels(), loc="lower left", bbox_to_anchor=(0.85 / WIDTH, 0), ncols=_COLUMNS
    )
    return drawing


def _steps(compared: Comparison, beaten: list[str], differ: list[tuple[str, str]], command: str) -> list[Step]:
    if not compared.best:
        return [Step("Compare on a log that none of the fits has seen.", f"{command} OTHER.csv")]
    if beaten:
        return [
            Step(
                f"Physics is missing where the black-box baseline does better: see what the residuals of "
                f"{', '.join(beaten)} look like, and climb the ladder.",
                "upright ladder STUDY.toml -o OUT",
            )
        ]
    if differ:
        names = ", ".join(plain(n) for n in dict.fromkeys(n for _, n in differ))
        return [
            Step(
                f"Find out what changed between the logs: {names}. "
                "Friction changes from day to day; masses and lengths do not.",
                "upright doctor OTHER.csv --rig FIT",
            )
        ]
    return [Step(f"Design with {compared.best}.", "upright design OUT/fit.json")]


def _numbers(compared: Comparison) -> dict[str, object]:
    return {
        "best": compared.best,
        "runs": {
            label: {
                "seen_by": list(run.fitted_by),
                "fit_percent": {who: dict(score.fit_percent) for who, score in run.scores.items()},
            }
            for label, run in compared.runs.items()
        },
        "parameters": {
            who: {n: {"value": e.value, "interval": list(e.interval), "unit": e.unit, "status": e.status}
                  for n, e in by.items()}
            for who, by in compared.parameters.items()
        },
        "agreement": {who: {n: vars(a) for n, a in by.items()} for who, by in compared.agree.items()},
        "joint": {who: {"chi_square": x, "degrees": n, "p": p} for who, (x, n, p) in compared.joint.items()},
        "trusted": dict(compared.trusted),
    }  # fmt: skip
