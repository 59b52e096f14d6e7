"""Experiment 2 as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

from upright.basis import in_percent
from upright.control import Score
from upright.control.effort import FELT, RestEffort, of_limit, shown
from upright.control.preflight import BUSY, SATURATED, STABILISED, word
from upright.control.score import effort_at_rest
from upright.designing.run import Designed, DesignRequest, design_for
from upright.experiments.regulation_2.figures import chances_figure, runs_figure, ways_figure
from upright.experiments.regulation_2.run import DRAWS, SETS, Attempt, Regulation
from upright.gains.requests import written
from upright.quantities import two_figures
from upright.report.page import Chapter, KeyNumber
from upright.report.prose import chapter_of
from upright.report.rig import of_rig, rig_table
from upright.rig import Rig

SURE = 0.8
"""Lower end of the probability's 95 % interval from which a recommendation stands: 16 rigs of 16 reach it."""
SHOWN = 2.5
"""Seconds of the runs that are drawn."""


def chapter(result: Regulation) -> Chapter:
    """What holding the rig upright came to."""
    best, ran = result.best, result.ran
    pictures = {
        f"regulation-runs{i // 4}": lambda four=result.attempts[i : i + 4]: runs_figure(four, SHOWN)
        for i in range(0, len(result.attempts), 4)
    }
    page = chapter_of(
        __name__, result=result, best=best, ran=ran,
        agreed=[a for a in ran if a.word == a.before.word], excess=_excess(result, best), chance=_probability,
        shown=partial(_shown, result.rig), still=lambda s: s.final[0] <= 2 * result.rig.resolution[0],
        rest_of=lambda a: effort_at_rest(a.after), word=word, of_limit=of_limit, two_figures=two_figures,
        roots=written, sure=SURE, felt=FELT,
        more_draws=DRAWS, sets=SETS, placed={"rig": (rig_table(result.rig),)},
        figures={
            "regulation-chances": lambda: chances_figure(
                {a.name: a.before.words for a in result.attempts}, {a.name: a.word for a in result.attempts}
            ),
            "regulation-ways": lambda: ways_figure({w.name: w.run for w in result.ways}),
            **pictures,
        },
    )  # fmt: skip
    findings = tuple(
        KeyNumber(
            what=f"most likely result of {a.name}",
            value=f"{a.before.word} ({_probability(a, a.before.words[a.before.word])})"
            + (f"; measured: {a.word}" if a.word and result.truth is None else ""),
            truth="" if result.truth is None else a.word,
        )
        for a in result.attempts
    )
    page = replace(
        page, key="2", best="regulation-runs0", sound=_sound(result), findings=findings, numbers=_numbers(result)
    )
    return of_rig(page, result.rig, result.performed)


def design_of_best(result: Regulation) -> Designed | None:
    """The recommended set as a design, of the loop that was predicted; None where no set is recommended."""
    best, rig, request = result.best, result.rig, result.request
    if not best.before.basis.supports or best.before.words[STABILISED] < 0.5:
        return None
    return design_for(rig, DesignRequest(
        at=result.task.at, poles=best.placement.requested, period=rig.period, delay=rig.delay / rig.period,
        speed=request.speed, memory=request.memory, resolution=tuple(rig.resolution.tolist()),
        limit=rig.saturation if math.isfinite(rig.saturation) else None, start=result.task.start, on=rig,
    ))  # fmt: skip


def _excess(result: Regulation, a: Attempt) -> str:
    """What is too much about the command at rest, as a clause after it; empty where nothing is."""
    if a.word == BUSY and a.after is not None:
        effort = effort_at_rest(a.after)
    elif a.before.word == BUSY:
        effort = a.before.rest
    else:
        return ""
    # quiet may be the rig as identified, unlike most rigs allowed
    return "" if effort.quiet else shown(effort, result.rig.saturation, result.rig.unit)


def _sound(result: Regulation) -> bool:
    """Whether the set to use is sure and quiet beforehand, and was so where it was run."""
    best = result.best
    ran_well = best.score is None or best.word in (STABILISED, SATURATED)
    enough = best.before.interval[0] >= SURE
    return not result.interrupted and ran_well and enough and best.before.words[STABILISED] > 0.9


def _probability(a: Attempt, share: float) -> str:
    """A share of the simulated rigs as the probability that it stands for."""
    return str(a.before.basis.supported(in_percent(share)))


def _shown(rig: Rig, i: int, value: float) -> str:
    """A coordinate's deviation in degrees or centimetres."""
    if rig.plant.coordinates[i].unit == "rad":
        return f"{math.degrees(value):.2g}°" if math.degrees(value) < 99.5 else f"{math.degrees(value):.0f}°"
    return f"{100 * value:.2g} cm"


def _numbers(result: Regulation) -> dict[str, Any]:
    """The same for another program: SI, finite."""
    return {
        "rig": result.rig.name,
        "seed": None if result.truth is None else result.truth.seed,
        "start": dict(zip(result.rig.plant.state_names(), result.task.start, strict=True)),
        "limit": result.rig.limit,
        "described": result.rig.hardware.plain(),
        "command_unit": result.rig.unit,
        "recommended": result.best.name,
        "as_told": sum(a.word == a.before.word for a in result.ran) if result.ran else None,
        "sets": {a.name: _set(a) for a in result.attempts},
        "velocities": {
            w.name: {"noise": w.noise, "change_per_sample": w.restless, **_scored(w.score)} for w in result.ways
        },
    }


def _set(a: Attempt) -> dict[str, Any]:
    b = a.before
    measured = a.measured
    return {
        "poles": a.placement.requested,
        "K": a.placement.K[0],
        "before": {
            "word": b.word, "words": dict(b.words), "chance": b.basis.supported(b.share),
            "interval": b.basis.supported(b.interval), "tilt": b.tilt, "push": b.push,
            "command_noise": b.noise, "rest_rms_95": b.rest_rms,
            "margins": b.margins, "rest": _rest(b.rest),
            **_scored(b.score),
        },
        "after": None if measured is None else {
            "word": a.word, "ended": measured.ended, "rest": _rest(effort_at_rest(measured.trial)),
            **_scored(measured.score),
        },
    }  # fmt: skip


def _rest(effort: RestEffort) -> dict[str, Any]:
    return {
        "quiet": effort.quiet,
        "rms": effort.rms,
        "peak": effort.peak,
        "command": effort.command,
        "body": effort.body,
    }


def _scored(s: Score) -> dict[str, Any]:
    return {**vars(s), "held": s.held}
