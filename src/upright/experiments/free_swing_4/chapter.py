"""Experiment 4 as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

from upright.experiments.free_swing_4.figures import drift_figure, energy_figure
from upright.experiments.free_swing_4.release import TILT
from upright.experiments.free_swing_4.run import FreeSwing, recovered
from upright.identification.model.fit import Fit, RunScore
from upright.report.fit.chapter import motion_part
from upright.report.fit.figures import directions_figure, fit_figure, interval_figure
from upright.report.fit.pictures import rest_picture, run_pictures
from upright.report.fit.tables import finding, parameter_table, score_table
from upright.report.page import Chapter, Symbol, simulated
from upright.report.prose import Placed, chapter_of
from upright.report.rig import rig_drawing
from upright.report.symbols import unit
from upright.rig.makes import MOTOR_AND_BELT

_TILTED = ("level_model", "tilt_model", "spring")


def chapter(result: FreeSwing) -> Chapter:
    """The experiment, however far it came."""
    fits = {name: answer.fit for name, answer in result.answers.items()}
    fit, blind, balance = fits.get("free_swing"), fits.get("no_scale"), result.balance
    tilted = [result.answers[n] for n in _TILTED if n in fits]
    both = {"level_model", "tilt_model"} <= fits.keys()
    case = "out of level" if result.body == "disk" else "pushed"
    ends = {w.remedy: w for w in reversed(result.drifts) if case in w.name}
    estimates = recovered(result.rig, fit) if fit else ()
    truth = result.rig.plant.parameters()
    page = chapter_of(
        __name__, result=result, fit=fit, blind=blind, tilted=tilted, estimates=estimates, pi=math.pi,
        tilt=math.degrees(TILT), free=ends.get(False), kept=ends.get(True), worst=_worst, fitted=_fitted,
        level=_worst_fitted(fits["level_model"]) if both else None,
        leaning=_worst_fitted(fits["tilt_model"]) if both else None,
        pole=float(result.rig.plant.linear("inverted").poles().real.max()),
        lean_of=lambda sine: math.degrees(math.asin(sine)), belt=MOTOR_AND_BELT,
        placed=_placed(fit, truth) if fit else {},
        figures={
            "truth": lambda: interval_figure(fit.estimates if fit else {}, truth=truth),
            "scale": lambda: directions_figure(blind or fits["no_scale"]),
            "energy": lambda: energy_figure(balance.t, balance.stored, balance.dissipated) if balance else None,
            "drift": lambda: drift_figure(result.drifts, result.body),
            **{a.question.name: partial(_fit_figure, a.fit) for a in tilted},
        },
    )  # fmt: skip
    page = replace(
        page, key="4", drawing=rig_drawing(result.rig.plant),
        sound=bool(fit and fit.trusted and not result.interrupted), numbers=_numbers(result),
        findings=tuple(
            finding(Symbol(f"{f.name} [{unit(f.unit)}]"), fit.estimates[f.name], f.truth) for f in estimates
        ) if fit else (),
    )  # fmt: skip
    return simulated(page)


def _placed(fit: Fit, truth: dict[str, float]) -> Placed:
    caption = "Estimated and given parameters of the rig, beside the true values of the twin"
    return {
        "motion": (motion_part(fit),),
        "followed": (score_table(fit.runs), *run_pictures(fit, "swing")),
        "parameters": (parameter_table(fit, truth=truth, caption=caption),),
        "rest": rest_picture(fit, "swing"),
    }


def _fitted(fit: Fit) -> tuple[str, RunScore]:
    return next((n, s) for n, s in fit.runs.items() if s.role == "fit")


def _fit_figure(fit: Fit) -> Any:
    label, score = _fitted(fit)
    return fit_figure(score, fit.model.plant, title=label)


def _worst_fitted(fit: Fit) -> float:
    return min(v for s in fit.runs.values() if s.role == "fit" for v in s.fit_percent.values())


def _worst(fit: Fit, role: str, name: str) -> float:
    """Fit percent of a signal; what an outlier has cut into several runs counts by the worst."""
    return min(score.fit_percent[name] for score in fit.runs.values() if score.role == role)


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
