"""How is a survey told: gains with their intervals, agreement, and which printed numbers cannot be?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from upright.report.document import Picture, picture, write_page
from upright.report.symbols import number
from upright.survey import (
    Fits,
    Likert,
    Means,
    Ratings,
    Shares,
    bound,
    compare,
    counts,
    fitting,
    holm,
    possible,
    whole_row,
)
from upright.survey.figures import agreement_figure, bounds_figure, fitting_figure, gain_figure


def told(sheet: Ratings | Means | Shares, *, answers: int | None, scale: tuple[int, int]) -> dict[str, Any]:
    """Tables, sentences and pictures of a survey, for a page, a terminal or JSON."""
    if isinstance(sheet, Ratings):
        return _ratings(sheet, scale)
    n = answers or 0
    return _means(sheet, n, scale) if isinstance(sheet, Means) else _shares(sheet, n)


def _ratings(sheet: Ratings, scale: tuple[int, int]) -> dict[str, Any]:
    found = [(i.name, compare(i.pre, i.post, top=scale[1])) for i in sheet.items]
    adjusted = holm([p.p for _, p in found])
    rows = [
        [
            name, str(p.n), number(p.pre, 3), number(p.post, 3), number(p.gain, 3), _span(p.interval),
            number(p.t, 3), _chance(p.p), _chance(q), number(p.signed_rank, 3), _chance(p.p_ranks),
            number(p.effect, 2), _span(p.effect_interval), number(p.ranks_effect, 2), number(p.normalized, 2),
        ]
        for (name, p), q in zip(found, adjusted, strict=True)
    ]  # fmt: skip
    sentences = [
        f"{name}: {'raised' if p.gain > 0 else 'lowered'} by {number(abs(p.gain), 2)} ({_span(p.interval)}), "
        + (
            "more than chance explains."
            if q < 0.05
            else "not to be told from chance once all questions asked are counted."
            if not math.isnan(q)
            else "the same for everybody, so there is no spread to test against."
        )
        for (name, p), q in zip(found, adjusted, strict=True)
    ]
    lost = sum(p.missing for _, p in found)
    if lost:
        sentences.append(
            f"{lost} comparisons miss one of their two answers and are left out, each for its question only."
        )
    pictures: list[Picture] = []
    if found:
        pictures.append(
            picture(gain_figure(found, scale), "gains", caption="Mean ratings before and after, and mean gains.",
                    description="; ".join(sentences))
        )  # fmt: skip
    bars = [(k.name, k.options, [100 * c / max(sum(k.counts), 1) for c in k.counts]) for k in sheet.likert]
    if bars:
        pictures.append(_agreed(bars))
    headings = ["question", "n", "before", "after", "gain", "95 %", "t", "p", "p, Holm", "Wilcoxon", "p", "d",
                "95 %", "rank effect", "normalized gain"]  # fmt: skip
    tables: list[dict[str, Any]] = []
    if rows:
        tables.append({"caption": f"Ratings of {sheet.people} people before and after", "head": headings, "rows": rows})
    if sheet.likert:
        tables.append(_likert_table(sheet.likert))
    return {
        "sentences": sentences, "tables": tables, "pictures": pictures, "notes": list(sheet.notes),
        "data": {name: {f: getattr(p, f) for f in p.__dataclass_fields__} | {"p_holm": q}
                 for (name, p), q in zip(found, adjusted, strict=True)},
    }  # fmt: skip


def _likert_table(likert: Sequence[Likert]) -> dict[str, Any]:
    rows: list[list[str]] = []
    for k in likert:
        n = sum(k.counts)
        agree = sum(c for o, c in zip(k.options, k.counts, strict=True) if o in ("strongly agree", "agree"))
        counted = ", ".join(f"{c} {o}" for o, c in zip(k.options, k.counts, strict=True) if c)
        rows.append([k.name, str(n), counted, f"{100 * agree / n:.0f} %", _span(wilson(agree, n), 100, " %")])
    return {"caption": "Agreement; interval by Wilson's score", "rows": rows,
            "head": ["statement", "n", "answers", "agree", "95 %"]}  # fmt: skip


def wilson(k: int, n: int) -> tuple[float, float]:
    """95 % interval of a share, from the score test."""
    z = 1.959963984540054
    middle, half = (k + z * z / 2) / (n + z * z), z / (n + z * z) * math.sqrt(k * (n - k) / n + z * z / 4)
    return max(0.0, middle - half), min(1.0, middle + half)


def _means(sheet: Means, n: int, scale: tuple[int, int]) -> dict[str, Any]:
    found = [(f"{name}, {what.lower()}" if what else name, pre, post, bound(pre, post, n, scale=scale))
             for name, what, pre, post in sheet.rows]  # fmt: skip
    printed = [m for _, pre, post, _ in found for m in (pre, post)]
    wrong = [m for m in printed if not possible(m, n)]
    rows = [
        [name, _marked(pre, n), _marked(post, n), number(float(post) - float(pre), 3), _span(b.t), b.verdict]
        for name, pre, post, b in found
    ]
    sure = sum(b.verdict == "significant" for *_, b in found)
    sentences = [
        f"{sure} of {len(found)} changes are significant at 5 % however the single answers were paired and spread"
        + (", nearest totals taken where a mean is impossible" if wrong else "")
        + f"; {len(found) - sure} cannot be told from the means alone.",
        "The means say nothing about sizes of effect beyond these bounds, about single people, or about what caused"
        " the change: there is no group that did not take the course.",
        _impossible(wrong, printed, n, "means"),
    ]
    fits = fitting(printed, [], max(2 * n, 20))
    sentences.append(_better(fits, n))
    others = [k for k in _best(fits, n)[:4] if 2 <= k != n]
    if wrong and others:
        again = [sum(bound(a, b, k, scale=scale).verdict == "significant" for _, a, b, _ in found) for k in others]
        sentences.append(
            "Significant whatever the pairing if fewer answered: "
            + ", ".join(f"{sure} of {len(found)} with {k} answers" for k, sure in zip(others, again, strict=True))
            + "."
        )
    return {
        "sentences": sentences, "notes": [],
        "tables": [{"caption": f"Printed means of {n} answers; * cannot come from {n} whole ratings", "rows": rows,
                    "head": ["question", "before", "after", "gain", "t between", "at 5 %"]}],
        "pictures": [
            picture(bounds_figure([(name, b) for name, _, _, b in found]), "bounds",
                    caption="Paired t that the printed means allow: its least value has to pass the dashed line.",
                    description=sentences[0]),
            _fitting(fits, n),
        ],
        "data": {"impossible": wrong, "fits": {f.answers: f.possible for f in fits}, "printed": len(printed),
                 "bounds": {name: {"t": b.t, "verdict": b.verdict} for name, _, _, b in found}},
    }  # fmt: skip


def _shares(sheet: Shares, n: int) -> dict[str, Any]:
    printed = [s for _, shares in sheet.rows for s in shares]
    wrong = [s for s in printed if not possible(s, n, of=100)]
    rows: list[list[str]] = []
    for name, shares in sheet.rows:
        marked = [f"{s}{'' if possible(s, n, of=100) else ' *'}" for s in shares]
        rows.append([name, *marked, "yes" if whole_row(shares, n) else "no"])
    fits = fitting([], printed, max(2 * n, 20))
    whole = [k for k in range(1, max(2 * n, 20) + 1) if all(whole_row(s, k) for _, s in sheet.rows)]
    sentences = [_impossible([f"{w} %" for w in wrong], printed, n, "percentages"), _better(fits, n)]
    sentences.append(
        f"All statements together come out as printed, each adding up to all answers, for {_listed(whole)} answers."
        if whole
        else f"No number of answers up to {max(2 * n, 20)} gives all statements as printed with every answer counted."
    )
    bars = [(name, sheet.options, [float(s) for s in shares]) for name, shares in sheet.rows]
    return {
        "sentences": sentences, "notes": [],
        "tables": [{"caption": f"Printed percentages of {n} answers; * cannot come from {n} whole answers",
                    "rows": rows, "head": ["statement", *sheet.options, f"adds up to {n}"]}],
        "pictures": [_agreed(bars), _fitting(fits, n)],
        "data": {"impossible": wrong, "fits": {f.answers: f.possible for f in fits}, "printed": len(printed),
                 "whole": whole},
    }  # fmt: skip


def _agreed(bars: Sequence[tuple[str, Sequence[str], Sequence[float]]]) -> Picture:
    said = "; ".join(f"{name}: " + ", ".join(f"{s:.0f} % {o}" for o, s in zip(options, shares, strict=True))
                     for name, options, shares in bars)  # fmt: skip
    return picture(agreement_figure(bars), "agreement", caption="Agreement with each statement.", description=said)


def _fitting(fits: Sequence[Fits], n: int) -> Picture:
    return picture(fitting_figure(fits, n), "fitting",
                   caption="How many of the printed numbers each number of answers makes possible.",
                   description=_better(fits, n))  # fmt: skip


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


def write_survey(content: dict[str, Any], folder: Path, *, title: str, source: str) -> Path:
    """Write what `told` said as one self-contained page, `folder`/report.html."""
    return write_page(folder, "survey.html", title=title, source=source, **content)
