"""A survey as a chapter: gains with their intervals, agreement, and which printed numbers cannot be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.questionnaire.sheet import LIKERT, Likert, Means, Ratings, Shares
from upright.questionnaire.statistics import (
    Bound,
    Fits,
    Paired,
    bound,
    can_be_printed,
    compare_ratings,
    counts,
    fitting,
    holm,
    whole_row,
)
from upright.report.drawing import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILLION, figure, styled
from upright.report.page import Block, Chapter, Part, Picture, Points, Step, Table
from upright.report.symbols import number

if TYPE_CHECKING:
    from upright.report.drawing import Figure

_HOW = (
    "Paired t with Student's intervals; Wilcoxon's signed ranks with zeros dropped, middle ranks for ties and the "
    "exact distribution; d is the mean gain over the spread of single gains, its interval from the noncentral t; the "
    "rank effect is the share of rank sums upwards minus downwards; the normalized gain is the gain over what the "
    "scale left to gain; Holm's adjustment for asking several questions. Printed means and percentages are checked "
    "against whole numbers of answers (GRIM); bounds on t hold for every set of whole ratings that has these means."
)


@dataclass(frozen=True, kw_only=True)
class _Evaluated:
    """What one kind of sheet comes to: sentences, the most telling first, pictures with tables, and plain values."""

    sentences: tuple[str, ...]
    shown: tuple[Block, ...]
    numbers: dict[str, Any]
    notes: tuple[str, ...] = ()


def chapter(
    sheet: Ratings | Means | Shares, *, title: str, source: str, answers: int | None = None,
    scale: tuple[int, int] = (1, 4), steps: Sequence[Step] = (),
) -> Chapter:  # fmt: skip
    """What a survey can say.

    Parameters
    ----------
    title, source : str
        Heading of the page, and name of the file.
    answers : int, optional
        On how many answers printed numbers rest.
    scale : (int, int)
        Ends of the scale of ratings.
    """
    n = answers or 0
    if isinstance(sheet, Ratings):
        analysis = _ratings(sheet, scale)
    else:
        analysis = _means(sheet, n, scale) if isinstance(sheet, Means) else _shares(sheet, n)
    verdict, *more = analysis.sentences or ("Nothing was compared.",)
    also = (Points(tuple(more)),) if more else ()
    return Chapter(
        title=title,
        verdict=verdict,
        question="Did the course help, as far as its survey can tell?",
        parts=(
            Part(title="What the survey can say", key="said", content=(f"From {source}.", *also, *analysis.shown)),
            *((Part(title="Notes", key="notes", content=(Points(analysis.notes),)),) if analysis.notes else ()),
            Part(title="How it was found", key="how", content=(_HOW,)),
        ),
        steps=tuple(steps),
        numbers={"sentences": analysis.sentences, "notes": analysis.notes, "found": analysis.numbers},
    )


def _ratings(sheet: Ratings, scale: tuple[int, int]) -> _Evaluated:
    pairs = {i.name: np.isfinite(i.pre) & np.isfinite(i.post) for i in sheet.items}
    few = [i for i in sheet.items if pairs[i.name].sum() < 2]
    compared = [(i.name, compare_ratings(i.pre, i.post, top=scale[1])) for i in sheet.items if i not in few]
    adjusted = holm([p.p for _, p in compared])
    rows = tuple(
        (
            name, str(p.n), number(p.pre, 3), number(p.post, 3), number(p.gain, 3), _span(p.interval),
            number(p.t, 3), _chance(p.p), _chance(q), number(p.signed_rank, 3), _chance(p.p_ranks),
            number(p.effect, 2), _span(p.effect_interval), number(p.ranks_effect, 2), number(p.normalized, 2),
        )
        for (name, p), q in zip(compared, adjusted, strict=True)
    )  # fmt: skip
    sentences = [
        f"{name}: {_moved(p.gain)} ({_span(p.interval)}), "
        + (
            "more than chance explains."
            if q < 0.05
            else "not distinguishable from chance once all questions are counted."
            if not math.isnan(q)
            else "the same for everybody, so there is no spread to test against."
        )
        for (name, p), q in zip(compared, adjusted, strict=True)
    ]
    sentences += [
        f"{i.name}: {_people(int(pairs[i.name].sum()))} answered before and after, and a comparison needs at least 2; "
        "this question is left out."
        for i in few
    ]
    lost = sum(int((~both).sum()) for both in pairs.values())
    if lost:
        sentences.append(
            f"{lost} comparisons miss one of their two answers and are left out, each for its question only."
        )
    shown: list[Block] = []
    if compared:
        gains = Picture(
            name="gains", draw=lambda: gain_figure(compared, scale),
            caption="Mean ratings before and after, and mean gains.", description="; ".join(sentences),
        )  # fmt: skip
        headings = (
            "question", "n", "before", "after", "gain", "95 %", "t", "p", "p, Holm", "Wilcoxon", "p", "d", "95 %",
            "rank effect", "normalized gain",
        )  # fmt: skip
        shown += [gains, _table(f"Ratings of {sheet.people} people before and after", headings, rows)]
    if sheet.likert:
        bars = [(k.name, k.options, [100 * c / max(sum(k.counts), 1) for c in k.counts]) for k in sheet.likert]
        shown += [_agreement_picture(bars), _agreement_table(sheet.likert)]
    return _Evaluated(
        sentences=tuple(sentences), shown=tuple(shown), notes=sheet.notes,
        numbers={name: asdict(p) | {"p_holm": q} for (name, p), q in zip(compared, adjusted, strict=True)}
        | {i.name: {"n": int(pairs[i.name].sum()), "missing": int((~pairs[i.name]).sum())} for i in few},
    )  # fmt: skip


def _moved(gain: float) -> str:
    """What became of a mean rating."""
    return f"{'raised' if gain > 0 else 'lowered'} by {number(abs(gain), 2)}" if gain else "unchanged on average"


def _people(n: int) -> str:
    return {0: "nobody", 1: "1 person"}.get(n, f"{n} people")


def _table(caption: str, headings: Sequence[str], rows: Sequence[tuple[str, ...]]) -> Table:
    """Numbers beside the name of the question."""
    return Table(
        caption=caption, headings=tuple(headings), rows=tuple(rows), numbers=tuple(range(1, len(headings)))
    )  # fmt: skip


def _agreement_table(likert: Sequence[Likert]) -> Table:
    from scipy.stats import binomtest

    rows: list[tuple[str, ...]] = []
    for k in likert:
        n = sum(k.counts)
        agree = sum(c for o, c in zip(k.options, k.counts, strict=True) if o in ("strongly agree", "agree"))
        counted = ", ".join(f"{c} {o}" for o, c in zip(k.options, k.counts, strict=True) if c)
        low, high = binomtest(agree, n).proportion_ci(method="wilson")
        rows.append((k.name, str(n), counted, f"{100 * agree / n:.0f} %", _span((low, high), 100, " %")))
    return Table(
        caption="Agreement; interval by Wilson's score", headings=("statement", "n", "answers", "agree", "95 %"),
        rows=tuple(rows), numbers=(1, 3, 4),
    )  # fmt: skip


def _means(sheet: Means, n: int, scale: tuple[int, int]) -> _Evaluated:
    changes = [(f"{name}, {what.lower()}" if what else name, pre, post, bound(pre, post, n, scale=scale))
             for name, what, pre, post in sheet.rows]  # fmt: skip
    printed = [m for _, pre, post, _ in changes for m in (pre, post)]
    wrong = [m for m in printed if not can_be_printed(m, n)]
    rows = [
        (name, _marked(pre, n), _marked(post, n), number(_gain(pre, post), 3), _span(b.t), b.verdict)
        for name, pre, post, b in changes
    ]
    sure = _verdicts(changes, "significant")
    fits = fitting(printed, [], max(2 * n, 20))
    sentences = [
        f"{sure} of {len(changes)} changes are significant at 5 % however the single answers were paired and spread"
        + (", nearest totals taken where a mean is impossible" if wrong else "")
        + f"; {_rest(changes)}.",
        "The means say nothing about sizes of effect beyond these bounds, about single people, or about what caused"
        " the change: there is no group that did not take the course.",
        _impossible(wrong, printed, n, "means"),
        _better(fits, n),
    ]
    others = [k for k in _best(fits, n)[:4] if 2 <= k != n]
    if wrong and others:
        again = [sum(bound(a, b, k, scale=scale).verdict == "significant" for _, a, b, _ in changes) for k in others]
        sentences.append(
            "Significant whatever the pairing if fewer answered: "
            + ", ".join(f"{sure} of {len(changes)} with {k} answers" for k, sure in zip(others, again, strict=True))
            + "."
        )
    bounds = Picture(
        name="bounds", draw=lambda: bounds_figure([(name, b) for name, _, _, b in changes]),
        caption="Paired t that the printed means allow: its least value has to pass the dashed line.",
        description=sentences[0],
    )  # fmt: skip
    table = _table(
        f"Printed means of {n} answers; * cannot come from {n} whole ratings",
        ("question", "before", "after", "gain", "t between", "at 5 %"), rows,
    )  # fmt: skip
    return _Evaluated(
        sentences=tuple(sentences), shown=(bounds, _fitting_picture(fits, n), table),
        numbers={
            "impossible": wrong, "fits": {f.answers: f.possible for f in fits}, "printed": len(printed),
            "bounds": {
                name: {"gain": _gain(pre, post), "gain_between": b.gain, "t": b.t, "verdict": b.verdict}
                for name, pre, post, b in changes
            },
        },
    )  # fmt: skip


def _gain(pre: str, post: str) -> float:
    """Gain of the means as printed, without what binary fractions add."""
    return float(Fraction(post) - Fraction(pre))


def _verdicts(changes: Sequence[tuple[str, str, str, Bound]], verdict: str) -> int:
    return sum(b.verdict == verdict for *_, b in changes)


def _rest(changes: Sequence[tuple[str, str, str, Bound]]) -> str:
    """How many changes no pairing makes significant, and how many the means leave open."""
    never, open_ones = _verdicts(changes, "not significant"), _verdicts(changes, "open")
    sentences = [f"{never} {'is' if never == 1 else 'are'} not significant, however they were"] if never else []
    if open_ones or not never:
        sentences.append(f"{open_ones} are not decided by the means alone")
    return "; ".join(sentences)


def _shares(sheet: Shares, n: int) -> _Evaluated:
    printed = [s for _, shares in sheet.rows for s in shares]
    wrong = [s for s in printed if not can_be_printed(s, n, of=100)]
    rows = [
        (
            name,
            *(f"{s}{'' if can_be_printed(s, n, of=100) else ' *'}" for s in shares),
            "yes" if whole_row(shares, n) else "no",
        )
        for name, shares in sheet.rows
    ]
    most = max(2 * n, 20)
    fits = fitting([], printed, most)
    whole = [k for k in range(1, most + 1) if all(whole_row(s, k) for _, s in sheet.rows)]
    together = (
        f"All statements together come out as printed, each adding up to all answers, for {_listed(whole)} answers."
        if whole
        else f"No number of answers up to {most} gives all statements as printed with every answer counted."
    )
    bars = [(name, sheet.options, [float(s) for s in shares]) for name, shares in sheet.rows]
    table = _table(
        f"Printed percentages of {n} answers; * cannot come from {n} whole answers",
        ("statement", *sheet.options, f"adds up to {n}"), rows,
    )  # fmt: skip
    return _Evaluated(
        sentences=(_impossible([f"{w} %" for w in wrong], printed, n, "percentages"), _better(fits, n), together),
        shown=(_agreement_picture(bars), _fitting_picture(fits, n), table),
        numbers={
            "impossible": wrong, "fits": {f.answers: f.possible for f in fits}, "printed": len(printed),
            "whole": whole,
        },
    )  # fmt: skip


def _agreement_picture(bars: Sequence[tuple[str, Sequence[str], Sequence[float]]]) -> Picture:
    description = "; ".join(f"{name}: " + ", ".join(f"{s:.0f} % {o}" for o, s in zip(options, shares, strict=True))
                     for name, options, shares in bars)  # fmt: skip
    return Picture(
        name="agreement", draw=lambda: agreement_figure(bars), caption="Agreement with each statement.",
        description=description,
    )  # fmt: skip


def _fitting_picture(fits: Sequence[Fits], n: int) -> Picture:
    return Picture(
        name="fitting", draw=lambda: fitting_figure(fits, n),
        caption="How many of the printed numbers each number of answers makes possible.",
        description=_better(fits, n),
    )  # fmt: skip


def _impossible(wrong: Sequence[str], printed: Sequence[str], n: int, what: str) -> str:
    if not wrong:
        return f"All {len(printed)} {what} can come from {n} answers."
    return (
        f"{len(wrong)} of {len(printed)} {what} cannot come from {n} answers: {', '.join(dict.fromkeys(wrong))}."
        " Either they were misprinted, or fewer people answered."
    )


def _best(fits: Sequence[Fits], n: int) -> list[int]:
    """Numbers of answers up to n that make most of the printed numbers possible."""
    fewer = [f for f in fits if f.answers <= n]
    most = max(f.possible for f in fewer)
    return [f.answers for f in fewer if f.possible == most]


def _better(fits: Sequence[Fits], n: int) -> str:
    best = _best(fits, n)
    most = fits[best[0] - 1].possible
    return (
        f"Of up to {n} answers, {_listed(best)} fit{'s' if len(best) == 1 else ''} most: {most} of {fits[0].printed}."
    )


def _listed(values: Sequence[int]) -> str:
    shown = [str(v) for v in values[:8]]
    return (", ".join(shown[:-1]) + " or " + shown[-1] if len(shown) > 1 else shown[0]) + (
        " …" if len(values) > 8 else ""
    )


def _marked(mean: str, n: int) -> str:
    return mean if counts(mean, n) else f"{mean} *"


def _span(pair: tuple[float, float], factor: float = 1.0, unit: str = "") -> str:
    return f"{number(factor * pair[0], 3)} to {number(factor * pair[1], 3)}{unit}"


def _chance(p: float) -> str:
    return "–" if math.isnan(p) else "< 0.0001" if p < 1e-4 else f"{p:.2g}"


_TONES: dict[str, str] = dict(zip(LIKERT, (BLUE, SKY, "#e4e4e4", ORANGE, VERMILLION, GREY), strict=True))


@styled
def gain_figure(compared: Sequence[tuple[str, Paired]], scale: tuple[int, int]) -> Figure:
    """Means before and after, and the mean gain with its 95 % interval."""
    drawing = figure(1.1 + 0.42 * len(compared), margins=(2.2, 0.2, 0.5, 0.5))
    left, right = drawing.subplots(1, 2, sharey=True)
    for i, (_, p) in enumerate(compared):
        left.plot([p.pre, p.post], [i, i], color=GREY, linewidth=1.5)
        left.plot([p.pre], [i], "o", color=ORANGE, label="before" if i == 0 else "")
        left.plot([p.post], [i], "s", color=BLUE, label="after" if i == 0 else "")
        half = p.interval[1] - p.gain
        right.errorbar([p.gain], [i], xerr=[half], fmt="o", color=BLACK, capsize=3)
    right.axvline(0, color=GREY, linewidth=0.8, linestyle=":")
    left.set_yticks(range(len(compared)), [_short(name) for name, _ in compared])
    left.set_ylim(len(compared) - 0.5, -0.5)
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
    labelled: set[str] = set()
    for i, (_, options, shares) in enumerate(rows):
        start = 0.0
        for option, share in zip(options, shares, strict=True):
            name = option.lower()
            tone = _TONES[name.replace("’", "'")]
            axes.barh([i], [share], left=[start], color=tone, edgecolor="white", label="" if name in labelled else name)
            labelled.add(name)
            if share >= 7:
                dark = tone in (BLUE, VERMILLION, GREY)
                axes.text(start + share / 2, i, f"{share:.0f}", ha="center", va="center",
                          color="white" if dark else "black", fontsize=8.5)  # fmt: skip
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
    critical = rows[0][1].critical
    most = 1.05 * max([2 * critical, *(abs(t) for _, b in rows for t in b.t if math.isfinite(t))])
    for i, (_, b) in enumerate(rows):
        low, high = (min(max(t, -most), most) for t in b.t)
        colour = BLUE if b.verdict == "significant" else ORANGE
        axes.plot([low, high], [i, i], color=colour, linewidth=5, solid_capstyle="butt")
        axes.plot([low], [i], "|", color="black", markersize=9)
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
                  ha="center", va="bottom", color=VERMILLION, fontsize=8.5)  # fmt: skip
    axes.set_xlabel("answers")
    axes.set_ylabel(f"possible, of {fits[0].printed} numbers")
    axes.set_ylim(0, 1.12 * fits[0].printed)
    return drawing


def _short(name: str, most: int = 30) -> str:
    return name.replace("$", r"\$") if len(name) <= most else name[: most - 1].replace("$", r"\$") + "…"
