"""Experiment 2b as a chapter: the encoders, the way up, and what faulty encoders would have done."""

from __future__ import annotations

import math
from typing import Any

from upright.control.sensors import Scales
from upright.control.swing_up import Ascent
from upright.experiments.swing_up_2b.figures import ascent_figure, check_figure, portrait_figure
from upright.experiments.swing_up_2b.run import FAULTS, HELD, TILT, FaultyEncoder, SwingUpRun
from upright.laws import as_values
from upright.report.page import Chapter, KeyNumber, Part, Picture, Points, Step, Table
from upright.report.rig import of_rig
from upright.report.symbols import number, percent
from upright.report.symbols import unit as raised
from upright.rig import Rig
from upright.rig.makes import make_of

QUESTION = (
    "Do the encoders show what is true, and does the drive, within its limit and travel, bring the hanging pendulum "
    "upright and hold it there?"
)


def chapter(result: SwingUpRun, folder: str = "FOLDER") -> Chapter:
    """Sensors, swing-up, lies; as far as the experiment has them. Its numbers lie in swing_up.json in the `folder`."""
    source = "numbers identified hanging" if result.source else "the nominal numbers of the rig model"
    seed = "" if result.truth is result.model else f", seed {result.truth.seed}"
    parts = [_sensor_part(result.model, result.check)]
    if result.ascent is not None:
        parts.append(_swing_part(result, result.ascent))
    if result.faulty:
        parts.append(_faulty_part(result))
    page = Chapter(
        key="2b", title=f"Swing-up and catch: {result.truth.name}{seed}", question=QUESTION,
        verdict=result.verdict,
        detail=f"Law and check were made from {source}; they met a rig with numbers of its own.",
        sound=result.sound, parts=tuple(parts), steps=_steps(result, folder), findings=_findings(result),
        numbers=_numbers(result),
    )  # fmt: skip
    return of_rig(page, result.model, result.performed)


def check_chapter(model: Rig, check: Scales, log: str, source: str = "FIT.json") -> Chapter:
    """What a log of a hanging rig says of its encoders, by itself."""
    again = Step("Mend what is reported above, log the hanging rig again, and check again.")
    onward = Step("The encoders may be trusted: find the gains that hold the rig.",
                  f"upright regulate {source}")  # fmt: skip
    page = Chapter(
        key="2b", title=f"Encoders of {model.name} in {log}", question="Do the encoders show what is true?",
        verdict=check.verdict, sound=check.sound, parts=(_sensor_part(model, check),),
        steps=(onward if check.sound else again,), numbers={"sensors": _scales(check), "verdict": check.verdict},
    )  # fmt: skip
    return of_rig(page, model)


def _scales(check: Scales) -> dict[str, Any]:
    """Scales as plain values."""
    each = zip(check.names, check.value, check.error, check.explained, strict=True)
    return {n: {"scale": v, "stderr": e, "explained": x, "sound": n not in check.wrong} for n, v, e, x in each}


def _sensor_part(model: Rig, check: Scales) -> Part:
    """What the hanging rig says of its encoders."""
    rows = tuple(
        (name, number(v, 5), number(2 * e, 2), percent(100 * x), "to be mended" if name in check.wrong else "sound")
        for name, v, e, x in zip(check.names, check.value, check.error, check.explained, strict=True)
    )
    table = Table(
        caption="What each encoder shows over what is true", rows=rows, numbers=(1, 2, 3),
        headings=("coordinate", "scale", "± (95 %)", "explained", ""),
    )  # fmt: skip
    swings = Picture(
        name="scales", draw=lambda: check_figure(check, tuple(c.unit for c in model.plant.coordinates)),
        caption="Swings of the hanging rig under known commands, then coasting. Wide: shown; dashed: "
        "the model's motion times the scale found.",
        description=check.verdict,
    )  # fmt: skip
    how = (
        "The period of a large swing tells its true amplitude, momentum what the driven body does meanwhile, and "
        "the drive the signs; the model's own numbers may move as far as they are uncertain."
    )
    return Part("Encoders, before a loop is closed", (Points((check.verdict,)), how, table, swings))


def _swing_part(result: SwingUpRun, run: Ascent) -> Part:
    """The way up."""
    law = result.law
    unit = raised(result.model.plant.coordinates[0].unit)
    rows = (
        ("upright for good after", number(run.up, 3) if math.isfinite(run.up) else "never", "s"),
        ("half swings before the first handover", str(run.swings), ""),
        ("handovers, falls", f"{len(run.handovers)}, {len(run.falls)}", ""),
        ("largest command, of its limit", f"{run.peak:.3g} of {law.limit:.3g}", result.model.unit),
        ("share of the time at the limit", percent(100 * run.saturated), ""),
        *(() if result.rest is None else (("command at rest, rms, of the limit", percent(100 * result.rest.rms), ""),)),
        ("farthest from the middle, of the travel", f"{run.travel:.3g} of {law.travel:.3g}", unit),
        ("ellipsoid of the catch, of what the linear model allows", percent(100 * law.size / law.sure), ""),
    )
    return Part(
        "Swing-up and catch",
        (
            result.verdict,
            "The pivot is accelerated along with the swing, by less as the energy comes near that of upright; a spring "
            "and a damper keep it in the middle. The feedback takes over inside an ellipsoid x'Px from which a "
            "least-cost loop returns although the command saturates.",
            Table(caption="The way up", headings=("", "value", "unit"), rows=rows, numbers=(1,)),
            Picture(
                name="ascent", draw=lambda: ascent_figure(run),
                caption="Angle, energy about the hinge, command and driven body as logged. Shaded: the feedback "
                "holds.",
                description=result.verdict,
            ),
            Picture(
                name="portrait", draw=lambda: portrait_figure(run),
                caption="Speed over angle. The pump spirals outwards to the energy of upright at rest, the feedback "
                "takes over at the ring.",
                description=f"{run.swings} half swings, {len(run.handovers)} handovers.",
            ),
        ),
    )  # fmt: skip


def _faulty_part(result: SwingUpRun) -> Part:
    """Faulty encoders, tried one by one."""
    rows = tuple(_row(fault) for fault in result.faulty)
    caught = sum(fault.refused for fault in result.faulty)
    falling = [fault for fault in result.faulty if math.isfinite(fault.fell)]
    in_time = sum(fault.spoke < fault.fell for fault in falling)
    table = Table(
        caption="Encoders that show a multiple of what is true", rows=rows, numbers=(1, 2, 3, 4, 6),
        headings=("coordinate", "lie", "found hanging", "watch speaks [ms]", "at [°]", "and says", "fall [ms]"),
    )  # fmt: skip
    sentence = (
        f"Hanging, {caught} of {len(result.faulty)} lies are found before a loop is closed. "
        f"A loop started {math.degrees(TILT):.0f} degrees from upright falls with {len(falling)} of them; a watch "
        f"beside it switches off before the fall in {in_time} cases."
    )
    return Part("If an encoder were faulty", (Points((sentence,)), table))


def _row(fault: FaultyEncoder) -> tuple[str, ...]:
    spoke = math.isfinite(fault.spoke)
    return (
        fault.name, f"{fault.factor:g}".replace("-", "−"), number(fault.estimate, 4),
        f"{1e3 * fault.spoke:.0f}" if spoke else "–",
        number(math.degrees(fault.tilt), 2) if spoke else "–", fault.suspicion or "–",
        f"{1e3 * fault.fell:.0f}" if math.isfinite(fault.fell) else "stands",
    )  # fmt: skip


def _findings(result: SwingUpRun) -> tuple[KeyNumber, ...]:
    """Numbers for the cover."""
    run = result.ascent
    if run is None or not result.caught:
        return (KeyNumber(what="swing-up", value="no"),)
    return (
        KeyNumber(what="from hanging to upright", value=f"{number(run.up, 3)} s"),
        KeyNumber(what="largest command of the swing-up", value=f"{number(run.peak, 3)} {result.model.unit}"),
    )


def _steps(result: SwingUpRun, folder: str) -> tuple[Step, ...]:
    """What to do next."""
    base = f"upright swing-up {result.source or f'--rig {make_of(result.truth.plant).key}'} --seed {result.truth.seed}"
    if not result.check.sound:
        return (Step("Mend the encoder, then try again.", base),)
    out = [Step("See what happens when an encoder lies.", f'{base} --lie "theta=2"')]
    if not result.caught:
        out.append(Step("Allow more travel.", f"{base} --travel {2 * result.law.travel:g}"))
    else:
        out.append(Step("Take the law to the computer that closes the loop, in C, for Arduino or in Python.",
                        f"upright export {folder}/swing_up.json --to c"))  # fmt: skip
    if not result.source:
        out.append(Step("Design from an identification instead of the data sheet.",
                        f"upright swing-up FIT.json --seed {result.truth.seed}"))  # fmt: skip
    return tuple(out)


def _numbers(result: SwingUpRun) -> dict[str, Any]:
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
        "rig": result.truth.name, "seed": result.truth.seed, "verdict": result.verdict,
        "sensors": _scales(result.check), "swing_up": up,
        "rule": as_values(law.rule(rig, rig.plant.state(next(iter(rig.plant.equilibria))))),
        "period": rig.period, "limit": law.limit,
        "command_unit": rig.unit, "described": rig.hardware.plain(),
        "readings": [{"name": c.name, "unit": c.unit} for c in rig.plant.coordinates],
        "law": {
            "K": law.K, "P": law.P, "size": law.size, "sure": law.sure, "reach": law.reach,
            "limit": law.limit, "travel": law.travel, "held_for": HELD, "body": vars(law.body),
        },
        "lies": [vars(fault) for fault in result.faulty],
        "lies_tried": len(FAULTS) if result.faulty else 0,
    }  # fmt: skip
