"""How is the experiment told? Verdict, pictures and numbers on one page beside the logs it came from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup

from upright.identification.model import Fit
from upright.lab.drift import PUSH, SPRING, TILT
from upright.lab.experiment import Experiment
from upright.lab.free_swing import recovered
from upright.report.advice import Step
from upright.report.certainty import directions_figure
from upright.report.document import Picture, motion, picture, rest_picture, run_pictures, write_page
from upright.report.experiment import Recovered, drift_figure, energy_figure, truth_figure
from upright.report.figures import fit_figure
from upright.report.mathml import symbol
from upright.report.symbols import number, percent, unit
from upright.report.tables import parameter_rows, score_rows


def write(done: Experiment) -> Path:
    """Write ``report.html`` into the experiment's folder."""
    fit = done.answers["free_swing"].fit if "free_swing" in done.answers else None
    found = recovered(done.rig, fit) if fit else ()
    return write_page(
        done.folder,
        "lab.html",
        title="Large free swing of the ECP 205 with the A51 pendulum",
        done=done,
        verdict=verdict(done),
        trusted=bool(fit and fit.trusted and not done.interrupted),
        motion=Markup(motion(fit)) if fit else "",
        pole=number(float(done.rig.truth.linear("inverted").poles()[0].real), 4),
        parameters=parameter_rows(fit) if fit else [],
        scores=score_rows(fit) if fit else [],
        recovered=[_row(f) for f in found],
        pictures=_pictures(done, fit, found),
        wanders=[
            {"name": w.name, "slope": number(math.degrees(w.slope), 2), "end": number(math.degrees(w.end), 2)}
            for w in done.wanders
        ],
        tilted=_tilted(done),
        steps=[Step(sentence=sentence, command=command) for sentence, command in next_steps(done)],
        numbers={"tilt": f"{math.degrees(TILT):g}", "push": f"{PUSH:g}", "spring": f"{SPRING:g}"},
    )


def verdict(done: Experiment) -> str:
    """What the experiment showed, in a few sentences."""
    if "free_swing" not in done.answers:
        return "The experiment was stopped before the first fit."
    fit = done.answers["free_swing"].fit
    found = recovered(done.rig, fit)
    inside = sum(f.inside for f in found)
    said = f"{inside} of {len(found)} numbers of the rig lie in their 95 % interval; {_scores(fit)}."
    if "no_scale" in done.answers:
        unseen = done.answers["no_scale"].fit.unseen
        said += " Without a known inertia the same data fix only ratios" + (", and the fit says so." if unseen else ".")
    if {"level_model", "tilt_model"} <= done.answers.keys():
        level, tilt = (_worst(done.answers[n].fit) for n in ("level_model", "tilt_model"))
        said += (
            f" {math.degrees(TILT):g}° out of level, a level model cannot follow the disk (fit {percent(level)}),"
            f" one that may lean can ({percent(tilt)})."
        )
    if done.wanders:
        free, held = (
            next(w for w in done.wanders if "out of level" in w.name and w.remedy == r) for r in (False, True)
        )
        said += (
            f" That lean drags the free disk away by {math.degrees(abs(free.end)):.0f}°;"
            f" a soft spring keeps it within {math.degrees(abs(held.end)):.0f}°."
        )
    return said


def _scores(fit: Fit) -> str:
    parts = [
        f"{'fit' if score.role == 'fit' else 'prediction of a release it has not seen'} "
        f"{percent(min(score.fit_percent.values()))} or better"
        for score in fit.runs.values()
    ]
    return ", ".join(parts)


def _worst(fit: Fit) -> float:
    return min(v for s in fit.runs.values() if s.role == "fit" for v in s.fit_percent.values())


def _row(f: Recovered) -> dict[str, Any]:
    low, high = f.interval
    return {
        "symbol": Markup(symbol(f.name)),
        "name": f.name,
        "truth": number(f.truth),
        "value": number(f.value),
        "interval": f"{number(low)} to {number(high)}",
        "unit": unit(f.unit),
        "inside": "inside" if f.inside else "outside",
    }


def _tilted(done: Experiment) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for name in ("level_model", "tilt_model", "spring"):
        if name in done.answers:
            a = done.answers[name]
            lean = a.fit.estimates.get("tilt_y")
            rows.append(
                {
                    "title": a.question.title,
                    "scores": [percent(v) for s in a.fit.runs.values() for v in s.fit_percent.values()],
                    "lean": f"{math.degrees(math.asin(lean.value)):.4f}°" if lean else "",
                    "verdict": a.fit.verdict,
                    "trusted": a.fit.trusted,
                }
            )
    return rows


def _pictures(done: Experiment, fit: Fit | None, found: tuple[Recovered, ...]) -> Mapping[str, list[Picture]]:
    shown: dict[str, list[Picture]] = {n: [] for n in ("runs", "rest", "truth", "scale", "energy", "drift", "tilted")}
    if fit:
        shown["runs"] = run_pictures(fit, "swing")
        shown["rest"] = rest_picture(fit, "swing")
    if found:
        caption = "Every estimate with its interval, measured from the truth, which only a twin can tell."
        shown["truth"] = [picture(truth_figure(found), "truth", caption=caption, description="As in the table above.")]
    if "no_scale" in done.answers and done.answers["no_scale"].fit.directions.size:
        blind = done.answers["no_scale"].fit
        caption = "Singular values when no inertia is known: the last one vanishes, and its row mixes every mass, "
        caption += "inertia and friction in equal measure. They can all be scaled together."
        drawing = directions_figure(blind)
        shown["scale"] = [picture(drawing, "scale", caption=caption, description="; ".join(blind.unseen))]
    if done.balance:
        b = done.balance
        caption = "Where the energy of the release went, as the fitted model tells it."
        ends = ", ".join(f"{name} {1e3 * e[-1]:.1f} mJ" for name, e in b.taken.items())
        drawing = energy_figure(b.t, b.stored, b.taken)
        shown["energy"] = [picture(drawing, "energy", caption=caption, description=f"At the end: {ends}.")]
    if done.wanders:
        caption = "Path of the disk after the same release (thin) and the line about which it swings (bold)."
        ends = ", ".join(f"{w.name} {math.degrees(w.end):.1f}°" for w in done.wanders)
        shown["drift"] = [
            picture(drift_figure(done.wanders), "drift", caption=caption, description=f"At the end: {ends}.")
        ]
    for name in ("level_model", "tilt_model", "spring"):
        if name in done.answers:
            a = done.answers[name]
            label, score = next((n, s) for n, s in a.fit.runs.items() if s.role == "fit")
            drawing = fit_figure(score, a.fit.rig.plant, title=label)
            fits = ", ".join(f"{n} {percent(v)}" for n, v in score.fit_percent.items())
            shown["tilted"].append(picture(drawing, name, caption=f"{a.question.title}.", description=f"Fit {fits}."))
    return shown


def next_steps(done: Experiment) -> list[tuple[str, str]]:
    """Sentences and commands."""
    folder = done.folder
    return [
        ("Repeat a fit from its files, change a guess or a bound, and see what moves:",
         f"upright identify {folder / 'tilt_model.toml'} -o {folder / 'again'}"),
        ("Let the model of the level rig predict the rig out of level:",
         f"upright predict {folder / 'fit.json'} {folder / 'level_model.toml'}"),
        ("Look at a log as the encoders wrote it:", f"upright show {folder / 'release_90.csv'}"),
        ("Take another rig of the same make:", f"upright lab --seed {done.rig.seed + 1}"),
        ("Start on a log of your own:", "upright init LOG"),
    ]  # fmt: skip


def summary(done: Experiment, report: Path) -> dict[str, Any]:
    """The experiment as plain values for another program: SI, angles of the drift in degrees."""
    answers = done.answers
    return {
        "seed": done.rig.seed,
        "report": str(report),
        "interrupted": done.interrupted,
        "seconds": done.seconds,
        "verdict": verdict(done),
        "parameters": {
            f.name: {
                "truth": f.truth,
                "value": f.value,
                "interval": [_finite(x) for x in f.interval],
                "inside": f.inside,
            }
            for f in (recovered(done.rig, answers["free_swing"].fit) if "free_swing" in answers else ())
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
        "drift": {
            w.name: {"slope_deg_per_s": math.degrees(w.slope), "end_deg": math.degrees(w.end)} for w in done.wanders
        },
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
