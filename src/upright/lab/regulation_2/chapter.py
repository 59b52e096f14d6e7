"""How is experiment 2 told: gains, what was expected of them, what came, and was it expected?"""

from __future__ import annotations

import math
from typing import Any

from upright.control import Score
from upright.control.preflight import word
from upright.design.requests import written
from upright.lab.regulation_2.figures import Panel, chances_figure, runs_figure, ways_figure
from upright.lab.regulation_2.run import SETS, Regulation, VelocityRun
from upright.lab.regulation_2.sentences import detail, numbers, sentence, shown, verdict
from upright.report.advice import Step
from upright.report.chapter import Chapter, Finding
from upright.report.document import Picture, picture
from upright.report.sections import Part, Table
from upright.report.symbols import number, plain

SHOWN = 2.5
"""Seconds of the runs that are drawn."""


def chapter(done: Regulation) -> Chapter:
    """Experiment 2 as a chapter."""
    return Chapter(
        key="2",
        title="Holding it upright",
        question="Which of the pole sets hold the rig upright within its drive's limit, and can that be told before "
        "anything moves, from the numbers identified while it hung?",
        verdict=verdict(done),
        detail=detail(done),
        sound=not done.interrupted and done.best.before.words["regulates"] > 0.9,
        parts=tuple(_parts(done)),
        steps=tuple(_steps(done)),
        findings=_findings(done),
        numbers=numbers(done),
    )


def gain_table(done: Regulation) -> Table:
    """Poles asked, the gains they take, and the margins of the loop as it runs."""
    rows: list[tuple[str, ...]] = []
    for a in done.attempts:
        m = a.before.margins
        worth = ("falls", "–", "–") if m is None else (
            f"{number(m.least_gain, 2)} to {number(m.most_gain, 3)}", number(1e3 * m.delay, 3), number(m.modulus, 2)
        )  # fmt: skip
        gains = ", ".join(number(k, 3) for k in a.placement.K[0])
        rows.append((a.name, written(a.placement.asked), gains, *worth))
    states = ", ".join(plain(n) for n in done.rig.plant.state_names())
    return Table(
        caption=f"Gains of u = −K x for {states} [{done.rig.unit} per SI unit], and the sampled loop's margins: "
        "factors on the command, more delay, distance to −1",
        headings=("", "poles [1/s]", "K", "gain", "delay [ms]", "distance"),
        rows=tuple(rows),
        numbers=(4, 5),
    )


def told_table(done: Regulation) -> Table:
    """What was told and what came, set by set."""
    rows: list[tuple[str, ...]] = []
    for a in done.attempts:
        b = a.before
        noise = "–" if b.noise is None else number(b.noise, 2)
        rows.append(
            (a.name, b.word, f"{100 * b.chance:.0f} %", f"{math.degrees(b.tilt):.0f}", f"{b.push:.1f}", noise,
             *_figures(done, b.score))
        )  # fmt: skip
        if a.score is not None:
            rows.append(
                ("", f"came: {a.word}", "held" if a.score.held else "lost", "", "", "", *_figures(done, a.score))
            )
    driven = done.rig.plant.coordinates[0]
    return Table(
        caption="Told before (first lines) and come after; tilt and tap are the largest recovered, each alone; noise "
        "is that of the command from the encoders' counts",
        headings=(
            "", "verdict", "chance", "tilt [deg]", "tap [rad/s]", f"noise [{done.rig.unit}]", "settled [s]",
            f"peak [{done.rig.unit}]", "at limit", f"{plain(driven.name)} peak", f"{plain(driven.name)} rest",
        ),
        rows=tuple(rows), numbers=tuple(range(2, 11)),
    )  # fmt: skip


def _figures(done: Regulation, s: Score) -> tuple[str, ...]:
    settled = number(s.settled, 3) if math.isfinite(s.settled) else "never"
    still = "still" if s.final[0] <= 2 * done.rig.quantum[0] else f"±{shown(done.rig, 0, s.final[0])}"
    rest = still if s.held else "–"
    return (
        settled, number(s.effort_peak, 3), f"{100 * s.saturated:.1f} %", shown(done.rig, 0, s.peaks[0]), rest,
    )  # fmt: skip


def way_table(done: Regulation) -> Table:
    """Plain and filtered differences and the Kalman filter, with the same gains from the same start."""

    def row(w: VelocityRun) -> tuple[str, ...]:
        return (
            w.name, "falls" if w.noise is None else number(w.noise, 2), number(w.restless, 2),
            "–" if w.margins is None else number(1e3 * w.margins.delay, 3),
            "–" if w.margins is None else number(w.margins.modulus, 2), word(w.score),
            number(w.score.settled, 3) if math.isfinite(w.score.settled) else "never",
            number(w.score.effort_peak, 3),
        )  # fmt: skip

    unit = done.rig.unit
    return Table(
        caption=f"Ways to the velocities, all with the gains of {done.best.name}: noise of the command told from "
        "the counts, its change from sample to sample as it came in the first second, delay borne and distance to −1",
        headings=("from", f"noise [{unit}]", f"change [{unit}]", "delay [ms]", "distance", "came", "settled [s]",
                  f"peak [{unit}]"),
        rows=tuple(row(w) for w in done.ways), numbers=(1, 2, 3, 4, 6, 7),
    )  # fmt: skip


def _parts(done: Regulation) -> list[Part]:
    tilt, push = math.degrees(done.task.start[2]), done.task.start[3]
    rig = done.rig
    given = (
        f"{rig.name}, sampled every {1e3 * rig.period:.3g} ms; the command has a limit of {rig.limit:g} {rig.unit}, "
        f"steps of {1e3 * rig.converter:.2g} m{rig.unit}, and acts {1e3 * rig.delay:.2g} ms late with a lag of "
        f"{1e3 * rig.lag:.2g} ms. Positions come in counts; velocities are made of them.",
        f"The pendulum is let go {tilt:.0f}° from upright, moving away at {push:.2g} rad/s, by a hand that errs by "
        f"{math.degrees(done.task.hand[2]):.1f}° and {done.task.hand[3]:.1g} rad/s.",
    )
    panels = [
        Panel(name=f"{a.name}: {a.word or a.before.word}", told=a.before.run, came=a.after) for a in done.attempts
    ]
    told = {a.name: a.before.words for a in done.attempts}
    came = {a.name: a.word for a in done.attempts}
    parts = [
        Part(title="Gains", sentences=given, tables=(gain_table(done),)),
        Part(
            title="Told before, come after",
            sentences=tuple(sentence(done, a) for a in done.attempts),
            tables=(told_table(done),),
            pictures=(_chances(told, came), *_runs(panels)),
        ),
    ]
    if done.ways:
        shown = picture(
            ways_figure({w.name: w.run for w in done.ways}), "regulation-ways",
            caption="The command on its way back: the same gains on velocities made in three ways.",
            description="Changes of the command from sample to sample: "
            + ", ".join(f"{w.name} {number(w.restless, 2)} {rig.unit}" for w in done.ways) + ".",
        )  # fmt: skip
        parts.append(Part(title="Velocities", tables=(way_table(done),), pictures=(shown,)))
    return parts


def _chances(told: Any, came: Any) -> Picture:
    return picture(
        chances_figure(told, came), "regulation-chances",
        caption="What the rigs that the identification allows come to with each pole set, and what the rig did.",
        description="; ".join(
            f"{n}: " + ", ".join(f"{w} {100 * s:.0f} %" for w, s in words.items() if s > 0) for n, words in told.items()
        ),
    )  # fmt: skip


def _runs(panels: list[Panel]) -> tuple[Picture, ...]:
    """Four sets at a time."""
    return tuple(
        picture(
            runs_figure(panels[i : i + 4], SHOWN), f"regulation-runs{i // 4}",
            caption="Deviation from upright and command. Dashed: as told by the identified model; solid: as it came; a "
            "cross ends a run that was lost.",
            description="; ".join(p.name for p in panels[i : i + 4]),
        )
        for i in range(0, len(panels), 4)
    )  # fmt: skip


def _findings(done: Regulation) -> tuple[Finding, ...]:
    return tuple(
        Finding(
            what=f"chance that {a.name} holds", value=f"{100 * a.before.chance:.0f} %",
            truth="" if a.score is None else a.word,
        )
        for a in done.attempts
    )  # fmt: skip


def _steps(done: Regulation) -> list[Step]:
    seed = f" --seed {done.truth.seed}" if done.truth is not None else ""
    base = f"upright regulate {done.source}{seed}"
    first = [] if done.truth is not None else [
        Step(sentence="Run the laws on a twin of this make.", command=f"upright regulate {done.source} --seed 0")
    ]  # fmt: skip
    own = f'--poles "{written(done.best.placement.asked).replace("±", "+-")}"'
    best = f"--set {done.best.name[4:]}" if done.best.name in SETS else own
    return [
        *first,
        Step(sentence="See how hard a start the recommended set bears.",
             command=f'{base} {best} --tilt "25 deg" --push "3 rad/s"'),
        Step(sentence="Let an observer make the velocities.", command=f"{base} --speed kalman"),
        Step(sentence="Try poles of your own.", command=f'{base} --poles "-5+-3j, -25, -4"'),
    ]  # fmt: skip
