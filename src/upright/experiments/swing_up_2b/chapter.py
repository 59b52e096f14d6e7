"""Experiment 2b as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from upright.basis import SIMULATED
from upright.control.effort import shown
from upright.control.sensors import Scales
from upright.experiments.swing_up_2b.figures import ascent_figure, check_figure, portrait_figure
from upright.experiments.swing_up_2b.run import FAULTS, HELD, TILT, SwingUpRun
from upright.laws import as_values
from upright.report.page import Chapter, KeyNumber
from upright.report.prose import chapter_of
from upright.report.rig import of_rig
from upright.report.symbols import number
from upright.rig import Rig
from upright.rig.makes import make_of


def chapter(result: SwingUpRun, folder: str = "FOLDER") -> Chapter:
    """Swing-up, encoders and faults, as far as it came. Its numbers lie in swing_up.json in the `folder`."""
    model, ascent, rest = result.model, result.ascent, result.rest
    falling = [fault for fault in result.faulty if math.isfinite(fault.fell)]
    figures = {
        "ascent": lambda: ascent_figure(ascent) if ascent else None,
        "portrait": lambda: portrait_figure(ascent) if ascent else None,
        **_scale_figure(model, result.check),
    }
    page = chapter_of(
        __name__, result=result, folder=folder, held=HELD, tilt=TILT, falling=falling, figures=figures,
        in_time=[f for f in falling if f.spoke < f.fell], make="" if result.source else make_of(result.truth.plant).key,
        duration=0.0 if ascent is None else float(ascent.trial.t[-1]), simulated=result.performed == SIMULATED,
        rest="" if rest is None else shown(rest, result.law.limit, model.unit),
    )  # fmt: skip
    page = replace(
        page, key="2b", sound=result.sound, findings=_findings(result), numbers=_numbers(result, page.verdict)
    )
    return of_rig(page, model, result.performed)


def check_chapter(model: Rig, check: Scales, log: str, source: str = "FIT.json") -> Chapter:
    """What a log of a hanging rig says of its encoders, by itself."""
    page = chapter_of(
        __name__, template="check", model=model, check=check, log=log, source=source,
        figures=_scale_figure(model, check),
    )  # fmt: skip
    numbers = {"sensors": _scales(check), "verdict": check.verdict}
    return of_rig(replace(page, key="2b", sound=check.sound, numbers=numbers), model)


def _scale_figure(model: Rig, check: Scales) -> dict[str, Any]:
    return {"scales": lambda: check_figure(check, tuple(c.unit for c in model.plant.coordinates))}


def _scales(check: Scales) -> dict[str, Any]:
    """Scales as plain values."""
    each = zip(check.names, check.value, check.error, check.explained, strict=True)
    return {n: {"scale": v, "stderr": e, "explained": x, "sound": n not in check.wrong} for n, v, e, x in each}


def _findings(result: SwingUpRun) -> tuple[KeyNumber, ...]:
    """Numbers for the cover."""
    run = result.ascent
    if run is None or not result.caught:
        return (KeyNumber(what="swing-up", value="no"),)
    return (
        KeyNumber(what="from hanging to upright", value=f"{number(run.up, 3)} s"),
        KeyNumber(what="largest command of the swing-up", value=f"{number(run.peak, 3)} {result.model.unit}"),
    )


def _numbers(result: SwingUpRun, verdict: str) -> dict[str, Any]:
    """The same as plain values."""
    run, law = result.ascent, result.law
    up = None if run is None else {
        "upright_after": run.up, "held": result.caught, "half_swings": run.swings,
        "handovers": run.handovers, "falls": run.falls, "tripped": run.tripped,
        "peak_command": run.peak, "share_saturated": run.saturated, "travel": run.travel,
        "rest": None if result.rest is None else {"quiet": result.rest.quiet, **vars(result.rest)},
    }  # fmt: skip
    rig = result.model
    return {
        "rig": result.truth.name, "seed": result.truth.seed, "verdict": verdict,
        "sensors": _scales(result.check), "swing_up": up,
        "rule": as_values(law.rule(rig, rig.plant.state(next(iter(rig.plant.equilibria))))),
        "period": rig.period, "limit": law.limit,
        "command_unit": rig.unit, "described": rig.hardware.plain(),
        "readings": [{"name": c.name, "unit": c.unit} for c in rig.plant.coordinates],
        "law": {
            "K": law.K, "P": law.P, "size": law.size, "sure": law.sure, "reach": law.reach,
            "limit": law.limit, "travel": law.travel, "held_for": HELD, "body": vars(law.body),
        },
        "faulty_encoders": [vars(fault) for fault in result.faulty],
        "faults_tried": len(FAULTS) if result.faulty else 0,
    }  # fmt: skip
