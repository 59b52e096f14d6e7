"""Experiment 4 as a chapter: what the swing shows, what it cannot know, and why disk or cart wander."""

from __future__ import annotations

import math
from typing import Any

from upright.experiments.free_swing_4.figures import drift_figure, energy_figure
from upright.experiments.free_swing_4.release import TILT
from upright.experiments.free_swing_4.run import EnergyBalance, FreeSwing, recovered
from upright.identification.model.fit import Fit
from upright.report.fit.chapter import motion_part, rest_picture, run_pictures
from upright.report.fit.figures import directions_figure, fit_figure, interval_figure
from upright.report.fit.tables import finding, parameter_table, score_table
from upright.report.page import Block, Chapter, Part, Picture, Step, Symbol, Table
from upright.report.rig import rig_drawing
from upright.report.symbols import number, percent, typed, unit

QUESTION = (
    "Lift the pendulum to horizontal, let go, log both encoders. Which masses, inertias and frictions make the "
    "equations of motion follow the swing, can they be trusted on a swing they have not seen, and why does the {body} "
    "wander while the pendulum swings?"
)


_TILTED = ("level_model", "tilt_model", "spring")


def chapter(result: FreeSwing) -> Chapter:
    """The experiment, however far it came."""
    fit = result.answers["free_swing"].fit if "free_swing" in result.answers else None
    estimates = recovered(result.rig, fit) if fit else ()
    parts = [Part("Data: the releases", _data(result))]
    if fit:
        followed = (score_table(fit.runs), *run_pictures(fit, "swing"))
        parts += [motion_part(fit), Part("Fit: large free swing", followed), _parameters(result, fit)]
    if "no_scale" in result.answers:
        parts.append(_blind_part(result.answers["no_scale"].fit))
    if result.balance:
        parts.append(_energy_part(result.balance))
    if result.drifts:
        parts.append(_drift_part(result))
    if result.answers.keys() & set(_TILTED):
        parts.append(_level_part(result))
    return Chapter(
        key="4",
        title="Large free swing",
        drawing=rig_drawing(result.rig.plant),
        question=QUESTION.format(body=result.body),
        verdict=_verdict(result),
        detail=_detail(result),
        sound=bool(fit and fit.trusted and not result.interrupted),
        parts=tuple(parts),
        steps=_steps(result),
        findings=tuple(
            finding(Symbol(f"{f.name} [{unit(f.unit)}]"), fit.estimates[f.name], f.truth) for f in estimates
        ) if fit else (),
        numbers=_numbers(result),
    )  # fmt: skip


def _verdict(result: FreeSwing) -> str:
    """What the fit showed, in a sentence."""
    if "free_swing" not in result.answers:
        return "The experiment was stopped before the first fit."
    fit = result.answers["free_swing"].fit
    estimates = recovered(result.rig, fit)
    inside = sum(f.inside for f in estimates)
    return f"{inside} of {len(estimates)} numbers of the rig lie in their 95 % interval; {_followed(fit)}."


def _detail(result: FreeSwing) -> str:
    """What else the experiment showed, as far as it came."""
    text = "Interrupted: this is what was there by then." if result.interrupted else ""
    if "no_scale" in result.answers:
        unseen = result.answers["no_scale"].fit.unseen
        text += " Without a known inertia the same data fix only ratios" + (", and the fit says so." if unseen else ".")
    if {"level_model", "tilt_model"} <= result.answers.keys():
        level, tilt = (_worst_fitted(result.answers[n].fit) for n in ("level_model", "tilt_model"))
        text += (
            f" {math.degrees(TILT):g}° out of level, a level model cannot follow the disk (fit {percent(level)}),"
            f" one that may lean can ({percent(tilt)})."
        )
    if result.drifts and result.body == "disk":
        free, held = (
            next(w for w in result.drifts if "out of level" in w.name and w.remedy == r) for r in (False, True)
        )
        text += (
            f" That lean drags the free disk away by {math.degrees(abs(free.end)):.0f}°;"
            f" a soft spring keeps it within {math.degrees(abs(held.end)):.0f}°."
        )
    elif result.drifts:
        free, held = (next(w for w in result.drifts if "pushed" in w.name and w.remedy == r) for r in (False, True))
        text += (
            f" A push of {result.make.push:g} m/s at the release leaves the cart {100 * abs(free.end):.1f} cm away,"
            f" where dry friction holds it; a soft spring brings it back to {100 * abs(held.end):.1f} cm."
        )
    return text.strip()


def _followed(fit: Fit) -> str:
    parts = [
        f"{'fit' if score.role == 'fit' else 'prediction of a release it has not seen'} "
        f"{percent(min(score.fit_percent.values()))} or better"
        for score in fit.runs.values()
    ]
    return ", ".join(parts)


def _worst_fitted(fit: Fit) -> float:
    return min(v for s in fit.runs.values() if s.role == "fit" for v in s.fit_percent.values())


def _data(result: FreeSwing) -> tuple[str, ...]:
    rig = result.rig
    pole = number(float(rig.plant.linear("inverted").poles().real.max()), 4)
    drive = (
        "drive belt off, so that the disk turns on its own bearings"
        if result.body == "disk"
        else "motor silent, pulled along by the cart"
    )
    body = (
        f"the {result.body}'s inertia from experiment 1a" if result.weighed else f"the {result.body}'s inertia to 1 %"
    )
    return (
        f"A digital twin of {rig.name}, seed {rig.seed}: no rig was touched. Nothing is published about the A51, so "
        f"its rod and weight are plausible brass parts; {drive}. Encoders of 16 000 counts per turn, logged every "
        f"7.072 ms; dry and viscous friction in both joints. Upright it would fall so at {pole} rad/s.",
        f"Known before the release, each to its uncertainty: {body}, the lengths from a ruler. Everything else starts "
        "30 % off.",
    )


def _parameters(result: FreeSwing, fit: Fit) -> Part:
    """Numbers of the rig beside the truth of the twin."""
    truth = result.rig.plant.parameters()
    table = parameter_table(
        fit, truth=truth,
        caption="Estimated and given numbers of the rig, beside the truth of the twin",
    )  # fmt: skip
    shown = Picture(
        name="truth", draw=lambda: interval_figure(fit.estimates, truth=truth),
        caption="Every estimate with its interval, measured from the truth, which only a twin can tell.",
        description="As in the table above.",
    )  # fmt: skip
    return Part("Parameters", (table, shown, *rest_picture(fit, "swing")))


def _blind_part(blind: Fit) -> Part:
    """What the same swing cannot tell without a known inertia."""
    blocks: list[Block] = [
        "Multiply every mass, inertia and friction by the same factor and nothing moves differently: gravity pulls "
        "more, inertia resists more. A free swing sees ratios only. With no inertia given, the fit says:",
        *(blind.unseen or (blind.verdict,)),
    ]
    if blind.directions.size:
        blocks.append(
            Picture(
                name="scale", draw=lambda: directions_figure(blind),
                caption="Singular values when no inertia is known: the last one vanishes, and its row mixes every "
                "mass, inertia and friction in equal measure. They can all be scaled together.",
                description="; ".join(blind.unseen),
            )
        )  # fmt: skip
    return Part("What the data cannot see", tuple(blocks), folded=True)


def _energy_part(b: EnergyBalance) -> Part:
    """Which friction took the energy of the release."""
    ends = ", ".join(f"{name} {1e3 * e[-1]:.1f} mJ" for name, e in b.dissipated.items())
    shown = Picture(
        name="energy", draw=lambda: energy_figure(b.t, b.stored, b.dissipated), description=f"At the end: {ends}.",
        caption="Where the energy of the release went, as the fitted model tells it.",
    )  # fmt: skip
    return Part("Where the energy went", (shown,), folded=True)


def _drift_part(result: FreeSwing) -> Part:
    """Where disk or cart go, and what keeps them."""
    body, push, anchor = result.body, result.make.push, result.make.anchor
    factor, angle = (180 / math.pi, "°") if body == "disk" else (100.0, "cm")
    reason = (
        f"Only friction acts about the axis of a level, free disk. Released at rest, its momentum about that axis "
        f"stays zero: the disk swings about a fixed line and creeps home as friction takes hold. A push of "
        f"{push:g} rad/s at the release gives it momentum; an axis {math.degrees(TILT):g}° out of level gives "
        f"gravity a lever, and the arm goes looking for its lowest place. A spring of {anchor:g} N m/rad, the "
        "remedy the paper proposes, gives it a home."
        if body == "disk"
        else "Only friction acts along a level rail. Released at rest, the momentum along it stays zero but for what "
        f"friction rubs away: the cart swings about a line that creeps. A push of {push:g} m/s at the release "
        f"carries it off, and dry friction keeps it there. A spring of {anchor:g} N/m gives it a home."
    )
    ends = ", ".join(f"{w.name} {factor * w.end:.1f} {angle}" for w in result.drifts)
    shown = Picture(
        name="drift", draw=lambda: drift_figure(result.drifts, body), description=f"At the end: {ends}.",
        caption=f"Path of the {body} after the same release (thin) and the line about which it swings (bold).",
    )  # fmt: skip
    table = Table(
        caption=f"Drift of the {body} over 24 s after a release from horizontal",
        headings=("rig", f"slope [{angle}/s]", f"place at the end, from the release [{angle}]"),
        rows=tuple((w.name, number(factor * w.slope, 2), number(factor * w.end, 2)) for w in result.drifts),
        numbers=(1, 2),
    )
    return Part(f"Why the {body} wanders", (reason, table, shown))


def _level_part(result: FreeSwing) -> Part:
    """Fits of the disk out of level."""
    rows: list[tuple[str, ...]] = []
    pictures: list[Picture] = []
    answers = [result.answers[n] for n in _TILTED if n in result.answers]
    for a in answers:
        lean = a.fit.estimates.get("tilt_y")
        scores = [percent(_worst(a.fit, role, name)) for role in ("fit", "predict") for name in ("psi", "theta")]
        rows.append((a.question.title, *scores, f"{math.degrees(math.asin(lean.value)):.4f}°" if lean else ""))
        label, score = next((n, s) for n, s in a.fit.runs.items() if s.role == "fit")
        fits = ", ".join(f"{n} {percent(v)}" for n, v in score.fit_percent.items())
        pictures.append(
            Picture(
                name=a.question.name,
                draw=lambda score=score, a=a, label=label: fit_figure(score, a.fit.model.plant, title=label),
                caption=f"{a.question.title}.", description=f"Fit {fits}.",
            )
        )  # fmt: skip
    table = Table(
        caption="Fit percent of ψ and θ, fitted run and predicted run",
        headings=("model", "ψ fitted", "θ fitted", "ψ predicted", "θ predicted", "lean found"),
        rows=tuple(rows), numbers=(1, 2, 3, 4, 5),
    )  # fmt: skip
    reason = (
        "The same fit on logs of the rig out of level: with a model that takes it for level, with one that may lean, "
        "and with the spring on."
    )
    verdicts = (f"{a.question.title}: {a.fit.verdict}" for a in answers)
    return Part("Is the rig level?", (reason, *verdicts, table, *pictures), folded=True)


def _worst(fit: Fit, role: str, name: str) -> float:
    """Fit percent of a signal; what an outlier has cut into several runs counts by the worst."""
    return min(score.fit_percent[name] for score in fit.runs.values() if score.role == role)


def _steps(result: FreeSwing) -> tuple[Step, ...]:
    folder = result.folder
    again, other = ("tilt_model", "level_model") if result.body == "disk" else ("no_scale", "no_scale")
    predicted = "the rig out of level" if result.body == "disk" else "the study without an inertia"
    return (
        Step("Repeat a fit from its files, change a guess or a bound, and see what moves:",
             f"upright identify {typed(folder / f'{again}.toml')} -o {typed(folder / 'again')}"),
        Step(f"Let the model of the level rig predict {predicted}:",
             f"upright predict {typed(folder / 'fit.json')} {typed(folder / f'{other}.toml')}"),
        Step("Look at a log as the encoders wrote it:",
             f"upright show {typed(folder / 'release_90.csv')}"),
    )  # fmt: skip


def _numbers(result: FreeSwing) -> dict[str, Any]:
    answers = result.answers
    estimates = recovered(result.rig, answers["free_swing"].fit) if "free_swing" in answers else ()
    return {
        "parameters": {
            f.name: {"truth": f.truth, "value": f.value, "interval": f.interval, "inside": f.inside} for f in estimates
        },
        "fits": {
            name: {
                "trusted": a.fit.trusted,
                "fit_percent": {label: dict(score.fit_percent) for label, score in a.fit.runs.items()},
                "unseen": a.fit.unseen,
                "seconds": a.fit.seconds,
            }
            for name, a in answers.items()
        },
        "drift": {w.name: {"slope": w.slope, "end": w.end} for w in result.drifts},
        "seconds": result.seconds,
    }
