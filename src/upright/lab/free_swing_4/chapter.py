"""How is the large free swing told? What was found, what it cannot know, and why disk or cart wander."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from markupsafe import Markup

from upright.identification.model.fit import Fit
from upright.lab.free_swing_4.drift import TILT
from upright.lab.free_swing_4.figures import truth_figure
from upright.lab.free_swing_4.parts import blind_part, drift_part, energy_part, level_part
from upright.lab.free_swing_4.run import FreeSwing
from upright.lab.free_swing_4.studies import Recovered, recovered
from upright.report.advice import Step
from upright.report.chapter import Chapter, Finding
from upright.report.document import motion, picture, rest_picture, run_pictures
from upright.report.sections import Part, Table
from upright.report.symbols import number, percent, typed, unit
from upright.report.tables import parameter_rows, score_rows

QUESTION = (
    "Lift the pendulum to horizontal, let go, log both encoders. Which masses, inertias and frictions make the "
    "equations of motion follow the swing, can they be trusted on a swing they have not seen, and why does the {body} "
    "wander while the pendulum swings?"
)


def chapter(done: FreeSwing) -> Chapter:
    """Experiment 4 as a chapter, however far it came."""
    fit = done.answers["free_swing"].fit if "free_swing" in done.answers else None
    found = recovered(done.rig, fit) if fit else ()
    parts = [Part(title="Data: the releases", sentences=_data(done))]
    if fit:
        parts.append(Part(title="Equations of motion", formulas=(Markup(motion(fit)),)))
        parts.append(Part(title="Fit: large free swing", tables=(_scores(fit),),
                          pictures=tuple(run_pictures(fit, "swing"))))  # fmt: skip
        parts.append(_parameters(fit, found))
    parts += [*blind_part(done), *energy_part(done), *drift_part(done), *level_part(done)]
    return Chapter(
        key="4",
        title="Large free swing",
        question=QUESTION.format(body=done.body),
        verdict=verdict(done),
        detail=detail(done),
        sound=_sound(done, fit),
        parts=tuple(parts),
        steps=_steps(done),
        findings=tuple(
            Finding(
                what=f"{f.name} [{unit(f.unit)}]", value=number(f.value), truth=number(f.truth),
                interval=f"{number(f.interval[0])} to {number(f.interval[1])}",
            )
            for f in found
        ),
        numbers=_numbers(done),
    )  # fmt: skip


def _sound(done: FreeSwing, fit: Fit | None) -> bool:
    return bool(fit and fit.trusted and not done.interrupted)


def verdict(done: FreeSwing) -> str:
    """What the fit showed, in a sentence."""
    if "free_swing" not in done.answers:
        return "The experiment was stopped before the first fit."
    fit = done.answers["free_swing"].fit
    found = recovered(done.rig, fit)
    inside = sum(f.inside for f in found)
    return f"{inside} of {len(found)} numbers of the rig lie in their 95 % interval; {_followed(fit)}."


def detail(done: FreeSwing) -> str:
    """What else the experiment showed, as far as it came."""
    said = "Interrupted: this is what was there by then." if done.interrupted else ""
    if "no_scale" in done.answers:
        unseen = done.answers["no_scale"].fit.unseen
        said += " Without a known inertia the same data fix only ratios" + (", and the fit says so." if unseen else ".")
    if {"level_model", "tilt_model"} <= done.answers.keys():
        level, tilt = (_worst(done.answers[n].fit) for n in ("level_model", "tilt_model"))
        said += (
            f" {math.degrees(TILT):g}° out of level, a level model cannot follow the disk (fit {percent(level)}),"
            f" one that may lean can ({percent(tilt)})."
        )
    if done.drifts and done.body == "disk":
        free, held = (next(w for w in done.drifts if "out of level" in w.name and w.remedy == r) for r in (False, True))
        said += (
            f" That lean drags the free disk away by {math.degrees(abs(free.end)):.0f}°;"
            f" a soft spring keeps it within {math.degrees(abs(held.end)):.0f}°."
        )
    elif done.drifts:
        free, held = (next(w for w in done.drifts if "pushed" in w.name and w.remedy == r) for r in (False, True))
        said += (
            f" A push of {done.make.push:g} m/s at the release leaves the cart {100 * abs(free.end):.1f} cm away,"
            f" where dry friction holds it; a soft spring brings it back to {100 * abs(held.end):.1f} cm."
        )
    return said.strip()


def _followed(fit: Fit) -> str:
    parts = [
        f"{'fit' if score.role == 'fit' else 'prediction of a release it has not seen'} "
        f"{percent(min(score.fit_percent.values()))} or better"
        for score in fit.runs.values()
    ]
    return ", ".join(parts)


def _worst(fit: Fit) -> float:
    return min(v for s in fit.runs.values() if s.role == "fit" for v in s.fit_percent.values())


def _data(done: FreeSwing) -> tuple[str, ...]:
    rig = done.rig
    pole = number(float(rig.plant.linear("inverted").poles().real.max()), 4)
    drive = (
        "drive belt off, so that the disk turns on its own bearings"
        if done.body == "disk"
        else "motor silent, pulled along by the cart"
    )
    body = f"the {done.body}'s inertia from experiment 1a" if done.weighed else f"the {done.body}'s inertia to 1 %"
    return (
        f"A digital twin of {rig.name}, seed {rig.seed}: no rig was touched. Nothing is published about the A51, so "
        f"its rod and weight are plausible brass parts; {drive}. Encoders of 16 000 counts per turn, logged every "
        f"7.072 ms; dry and viscous friction in both joints. Upright it would fall so at {pole} rad/s.",
        f"Known before the release, each to its uncertainty: {body}, the lengths from a ruler. Everything else starts "
        "30 % off.",
    )


def _scores(fit: Fit) -> Table:
    return Table(
        caption="Fit percent, 100 (1 − |y − ŷ| / |y − mean y|), of every signal",
        headings=("run", "role", "signal", "fit", "simulated"),
        rows=tuple((r.run, r.role, r.signal, r.fit, r.horizon) for r in score_rows(fit)),
        numbers=(3,),
    )


def _parameters(fit: Fit, found: tuple[Recovered, ...]) -> Part:
    truth = {f.name: f for f in found}
    rows: list[tuple[str, ...]] = []
    for r in parameter_rows(fit):
        f = truth.get(r.name)
        true = (number(f.truth), "inside" if f.inside else "outside") if f else ("", "")
        rows.append((r.symbol, true[0], r.value, r.stderr, r.interval, r.unit, r.status, true[1]))
    caption = "Every estimate with its interval, measured from the truth, which only a twin can tell."
    return Part(
        title="Parameters",
        tables=(
            Table(
                caption="Estimated and given numbers of the rig, beside the truth of the twin",
                headings=("symbol", "truth", "value", "std. error", "95 % interval", "unit", "status", "truth is"),
                rows=tuple(rows),
                numbers=(1, 2, 3, 4),
            ),
        ),
        pictures=(
            picture(truth_figure(found), "truth", caption=caption, description="As in the table above."),
            *rest_picture(fit, "swing"),
        ),
    )


def _steps(done: FreeSwing) -> tuple[Step, ...]:
    folder: Path = done.folder
    again, other = ("tilt_model", "level_model") if done.body == "disk" else ("no_scale", "no_scale")
    predicted = "the rig out of level" if done.body == "disk" else "the study without an inertia"
    return (
        Step(sentence="Repeat a fit from its files, change a guess or a bound, and see what moves:",
             command=f"upright identify {typed(folder / f'{again}.toml')} -o {typed(folder / 'again')}"),
        Step(sentence=f"Let the model of the level rig predict {predicted}:",
             command=f"upright predict {typed(folder / 'fit.json')} {typed(folder / f'{other}.toml')}"),
        Step(sentence="Look at a log as the encoders wrote it:",
             command=f"upright show {typed(folder / 'release_90.csv')}"),
    )  # fmt: skip


def _numbers(done: FreeSwing) -> dict[str, Any]:
    answers = done.answers
    found = recovered(done.rig, answers["free_swing"].fit) if "free_swing" in answers else ()
    return {
        "parameters": {
            f.name: {"truth": f.truth, "value": f.value, "interval": list(f.interval), "inside": f.inside}
            for f in found
        },
        "fits": {
            name: {
                "trusted": a.fit.trusted,
                "fit_percent": {label: dict(score.fit_percent) for label, score in a.fit.runs.items()},
                "unseen": list(a.fit.unseen),
                "seconds": a.fit.seconds,
            }
            for name, a in answers.items()
        },
        "drift": {w.name: {"slope": w.slope, "end": w.end} for w in done.drifts},
        "seconds": done.seconds,
    }
