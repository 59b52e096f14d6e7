"""The paper's tables and misprints as a chapter: what is printed beside what one plant and one Q give."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from upright.gains.factorization import Locus
from upright.gains.requests import written
from upright.paper.reproduce import STUDENTS, Regenerated, Reproduced
from upright.report.drawing import BLUE, GREY, VERMILLION, figure, styled
from upright.report.page import Chapter, Part, Picture, Points, Step, Table
from upright.report.planes import Poles, locus_chart, pole_chart
from upright.report.symbols import number

if TYPE_CHECKING:
    from upright.report.drawing import Figure


def _set_table(table: Regenerated) -> Table:
    """Printed poles, regenerated ones, and their difference in roundings."""
    rows = tuple(
        (
            f"{i + 1}",
            written(printed, 6),
            written(again, 7),
            f"{np.abs(again - printed).max():.1e}",
            f"{max(np.abs(error.real).max(), np.abs(error.imag).max()):.2f}",
        )
        for i, (printed, again, error) in enumerate(zip(table.printed, table.again, table.errors, strict=True))
    )
    return Table(
        caption=f"{table.name} [1/s]",
        headings=("set", "printed", "regenerated", "largest difference", "in roundings"),
        rows=rows,
        numbers=(3, 4),
    )


def _errata_table(result: Reproduced) -> Table:
    """Every erratum with what shows it."""
    rows = [
        (str(e.number), e.where, e.printed, e.right, e.against, _range(e.printed_misses), _range(e.right_misses))
        for e in result.errata
    ]
    means = f"{result.impossible[STUDENTS]} of 26 impossible"
    rows.append(
        ("6", "Tables 3, 4", f"n = {STUDENTS}", "n = 48 or 52", "whole answers (GRIM)", means,
         f"{result.impossible[48]} and {result.impossible[52]} impossible")
    )  # fmt: skip
    return Table(
        caption="Relative error of the form as printed and of the right one, on 20 rigs drawn at random",
        headings=("", "where", "printed", "right", "compared with", "printed misses by", "right misses by"),
        rows=tuple(rows),
    )


def _range(span: tuple[float, float]) -> str:
    if span[1] < 1e-9:
        return f"at most {span[1]:.0e}"
    return f"{number(100 * span[0], 2)} to {number(100 * span[1], 2)} %"


def _facts(result: Reproduced) -> tuple[list[str], list[str], list[str]]:
    """Sentences on Table 1, on Table 2 and on the errata."""
    first, second = result.tables
    omega = float(np.sqrt(-first.locus.a[2]))
    a3, a2, a1 = second.locus.a[1:4]
    roots = np.roots([1.0, a3, a2, a1])
    flexible = roots[np.argmax(roots.imag)]
    one = [
        f"Recovered plant: a(s) = s² (s² − {number(-first.locus.a[2], 6)}), undamped, unstable pole "
        f"{number(omega, 5)} rad/s. N(w)/R of set 1, w = s²: {_polynomial(first.locus)}.",
        "From set to set R falls by the factor " + " and ".join(number(r, 5) for r in first.ratios)
        + " (sets 1 to 3, 2 to 4; from the sets' differences alone): it was halved.",
    ]  # fmt: skip
    if result.weights:
        least, most = min(result.weights), max(result.weights)
        middle = sorted(result.weights)[len(result.weights) // 2]
        q = ", ".join(number(v, 3) for v in result.weights[middle])
        one.append(
            f"A diagonal Q without negative weights makes this N when the hanging rod swings at {least:.2f} to "
            f"{most:.2f} rad/s; at {middle:.2f} its entries over R, times the squared gains of the torque, are {q}."
        )
    two = [
        f"Recovered plant: a(s) = s (s³ + {number(a3, 4)} s² + {number(a2, 5)} s + {number(a1, 5)}); flexible mode "
        f"{number(float(abs(flexible)), 4)} rad/s, damping ratio {number(float(-flexible.real / abs(flexible)), 2)}. "
        f"N(w)/R of set 1: {_polynomial(second.locus)}.",
        "R falls by the factor " + " and ".join(number(r, 4) for r in second.ratios) + ".",
    ]
    wrong, right = result.unstable
    three = [
        f"With eq. (2) as printed the twin's unstable pole would be {number(wrong, 4)} instead of {number(right, 4)} "
        f"1/s, and gains placed with it give {written(result.missed, 4)}, not {written(result.printed_poles, 4)}.",
    ]
    return one, two, three


def _polynomial(locus: Locus) -> str:
    powers = ("w³", "w²", "w", "")
    text = " + ".join(f"{number(v, 6)} {p}".strip() for v, p in zip(locus.N, powers, strict=True))
    return text.replace("+ −", "− ")


def _locus_picture(table: Regenerated, name: str) -> Picture:
    efforts = np.geomspace(1e-4, 64.0, 400)
    tracks = np.array([table.locus.poles(float(c)) for c in efforts])  # effort ever cheaper
    sets = {f"printed, set {i + 1}": poles for i, poles in enumerate(table.printed)}
    open_loop = np.roots(table.locus.a).astype(np.complex128)
    drawn = locus_chart(
        tracks, efforts, sets, open_loop, of="LQR poles as effort gets cheaper", symbol="1/R",
        origin="open loop, recovered",
    )  # fmt: skip
    return drawn.picture(
        name,
        caption=f"{table.name}. All four printed sets lie on the locus of one plant and one Q, with R halved from set "
        "to set.",
        description=f"Printed poles within {table.worst:.2f} roundings of the locus.",
    )


def chapter(result: Reproduced) -> Chapter:
    """The tables again, and the errata."""
    one, two, three = _facts(result)
    kinds = [
        Poles(name="requested, Table 1, set 1", values=result.printed_poles, mark="o", colour="q0"),
        Poles(name="attained, eq. (2) as printed", values=result.missed, mark="x", colour="q1"),
        Poles(name="open loop", values=np.array([result.unstable[1]], dtype=np.complex128), mark="+"),
    ]
    missed = pole_chart(kinds, frame=3).picture(
        "missed",
        caption="Poles of the right model under gains that Ackermann's formula gives for eq. (2) as printed.",
        description=f"Attained: {written(result.missed, 4)}.",
    )  # fmt: skip
    impossible = Picture(
        name="grim", draw=lambda: answers_figure(result.impossible, STUDENTS),
        caption="How many of the 24 means of Table 4 and the two percentages of Table 3's first question cannot be "
        "averages of so many whole answers.",
        description=f"{result.impossible[STUDENTS]} for {STUDENTS} students, 1 for 48 and for 52.",
    )  # fmt: skip
    return Chapter(
        title="The paper's tables and misprints, again",
        verdict=result.verdict,
        sound=max(t.worst for t in result.tables) <= 1 and all(e.shown for e in result.errata),
        question="Do the printed poles follow from one plant and one set of weights each, and which printed formulas "
        "contradict the energies? p(s) p(−s) = a(s) a(−s) + N(s)/R holds for LQR poles.",
        parts=(
            *(
                Part(f"Table {i}", (Points(tuple(facts)), _set_table(t), _locus_picture(t, f"t{i}")))
                for i, facts, t in zip((1, 2), (one, two), result.tables, strict=True)
            ),
            Part("Errata", (Points(tuple(three)), _errata_table(result), missed, impossible)),
        ),
        steps=(
            Step(
                "Use a set of Table 1 on a rig of your own.",
                'upright design OUT/fit.json --at inverted --poles "-4.1484+-1.6341j, -16.8545, -3.222"',
            ),
            Step(
                "Find weights instead of poles: LQR up to the drive's limit.",
                "upright design OUT/fit.json --at inverted --lqr 1,0,1,0 --limit LIMIT",
            ),
        ),
        numbers={
            "verdict": result.verdict,
            "tables": [
                {
                    "name": t.name,
                    "a": t.locus.a,
                    "N_over_R": t.locus.N,
                    "effort_ratios": t.ratios,
                    "worst_in_roundings": t.worst,
                    "sets": [np.asarray(poles, dtype=np.complex128) for poles in t.again],
                }
                for t in result.tables
            ],
            "errata": [
                {
                    "number": e.number, "where": e.where, "printed_misses": e.printed_misses,
                    "right_misses": e.right_misses, "shown": e.shown,
                }
                for e in result.errata
            ],
            "impossible_means": result.impossible,
        },
    )  # fmt: skip


@styled
def answers_figure(impossible: dict[int, int], claimed: int) -> Figure:
    """How many printed means cannot come from n answers, by n; `claimed` is the number that was printed."""
    drawing = figure(2.6)
    ax = drawing.subplots()
    colours = [VERMILLION if n == claimed else BLUE if count <= 1 else GREY for n, count in impossible.items()]
    bars = ax.bar(list(impossible), list(impossible.values()), color=colours)
    ax.bar_label(bars, fontsize=8.5)
    ax.set_xticks(list(impossible))
    ax.set_xlabel("number of students who answered")
    ax.set_ylabel("impossible means")
    ax.text(claimed, impossible[claimed] + 2.0, "as printed", ha="center", fontsize=8.5, color=VERMILLION)
    return drawing
