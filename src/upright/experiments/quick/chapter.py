"""A minute at a rig as a chapter: how it is wired, what it is, and whether it came upright."""

from __future__ import annotations

from typing import Any

from upright.basis import DESCRIBED
from upright.experiments.quick.figures import first_motions_figure
from upright.experiments.quick.run import HELD, LANES, QuickRun
from upright.experiments.swing_up_2b.figures import ascent_figure
from upright.laws import as_values
from upright.report.fit.tables import plain_estimate
from upright.report.page import Block, Chapter, KeyNumber, Part, Picture, Points, Step, Table, resting_on
from upright.report.symbols import number, typed
from upright.report.symbols import unit as raised

TITLE = "A rig in a minute"
"""Key and title of the experiment."""


def chapter(result: QuickRun) -> Chapter:
    """What a minute at the rig came to."""
    parts = [_wiring_part(result)]
    if result.fit is not None:
        parts.append(_fit_part(result))
    if result.law is not None:
        parts.append(_gains_part(result))
    page = Chapter(
        key="quick", title=TITLE,
        question="Is the rig wired as it is described, and does it come upright and stay there?",
        verdict=_verdict(result), detail=_detail(result), sound=result.upright, parts=tuple(parts),
        steps=_steps(result), findings=_findings(result), numbers=_numbers(result),
    )  # fmt: skip
    return resting_on(page, DESCRIBED if result.model is None else result.model.basis, result.stand.performed)


def _verdict(result: QuickRun) -> str:
    """What came of it, in a sentence or two."""
    weak = f" {_sentence(result.wiring.weak)}" if result.wiring.weak else ""
    if result.refused:
        return f"No loop was closed: {result.refused}.{weak}"
    a = result.ascent
    assert a is not None  # as nothing refused it
    if result.ended:
        return f"The swing-up was stopped after {a.trial.t[-1]:.2g} s: {result.ended}{weak}"
    if not result.upright:
        return f"It did not stand for the last {HELD:g} s, with at most {a.peak:.2g} {result.stand.rig.unit}.{weak}"
    return f"Upright {a.up:.2g} s after it was let swing, {result.seconds:.0f} s after the first motion.{weak}"


def _sentence(clause: str) -> str:
    return f"{clause[0].upper()}{clause[1:]}."


def _detail(result: QuickRun) -> str:
    if result.wiring.wrong:
        return " ".join(_sentence(f"{what}: {remedy}") for what, remedy in result.wiring.wrong)
    if result.share is None:
        return ""
    return f"Of {LANES} rigs that the fit allows, {result.share:.0%} were caught in simulation beforehand."


def _wiring_part(result: QuickRun) -> Part:
    w, unit = result.wiring, result.stand.rig.unit
    rows: list[tuple[str, str, str, str]] = []
    if w.moves and w.swings:
        for name, scale, error in zip(w.names, w.scale, w.error, strict=True):
            rows.append((f"{name}, shown over true", number(scale, 4), number(2 * error, 2), ""))
    for what, value, error, of in (
        ("force of the drive over its description", w.drive, w.drive_error, ""),
        ("command lost to either side (dead zone)", w.dead_zone, w.dead_error, unit),
    ):
        if value is not None and error is not None:
            rows.append((what, number(value, 3), number(2 * error, 2), of))
    if w.delay is not None:
        rows.append(("delay and lag of the drive", number(1e3 * w.delay, 2), "", "ms"))
    rows += [(f"command at which {w.names[0]} broke away, {side}", number(u, 3), "", unit)
             for side, u in zip(("up", "down"), w.broke_away, strict=True)]  # fmt: skip
    wrong = tuple(_sentence(f"{what}: {remedy}") for what, remedy in w.wrong) or (
        "Drive and encoders turn the same way, and the encoders count as described.",
    )
    content: tuple[Block, ...] = (
        Points((*wrong, *((_sentence(w.weak),) if w.weak else ()))),
        Table(caption="What the first motions tell", headings=("", "value", "± (95 %)", "unit"), rows=tuple(rows),
              numbers=(1, 2)),
        Picture(
            name="first_motions", draw=lambda: first_motions_figure(result),
            caption="Command and readings: ramps to where it breaks away, kicks, a swing, coasting, calming.",
            description=wrong[0],
        ),
    )  # fmt: skip
    return Part("How it is wired", content)


def _fit_part(result: QuickRun) -> Part:
    assert result.fit is not None
    rows = tuple(
        (n, number(e.value, 4), number(2 * e.stderr, 2) if e.stderr else "", raised(e.unit), e.status)
        for n, e in result.fit.estimates.items() if e.status != "known" and n in result.fit.model.parameters
    )  # fmt: skip
    table = Table(caption="Identified from the same motions", headings=("", "value", "± (95 %)", "unit", ""), rows=rows,
                  numbers=(1, 2), badge=4)  # fmt: skip
    return Part("What it is", (result.fit.verdict, table))


def _gains_part(result: QuickRun) -> Part:
    law, model = result.law, result.model
    assert law is not None and model is not None
    units = [f"({unit})" if "/" in unit else unit for unit in model.state_units]
    states = zip(model.states, units, law.K.tolist(), strict=True)
    rows = tuple((name, number(-k, 4), raised(f"{model.unit}/{unit}")) for name, unit, k in states)
    content: tuple[Block, ...] = (
        Table(caption="State feedback about upright: the command for a unit of each state",
              headings=("state", "gain", "unit"), rows=rows, numbers=(1,)),
    )  # fmt: skip
    if result.ascent is not None:
        ascent = result.ascent
        picture = Picture(
            name="ascent", draw=lambda: ascent_figure(ascent), description=_verdict(result),
            caption="Angle, energy, command and driven body as logged. Shaded: the feedback holds.",
        )  # fmt: skip
        content = (*content, picture)
    return Part("Gains, swing-up and catch", content)


def _steps(result: QuickRun) -> tuple[Step, ...]:
    again = f"upright lab --rig {typed(result.stand.file.path)} --quick"
    if result.wiring.wrong:
        return tuple(Step(_sentence(remedy), again if i == 0 else "")
                     for i, (_, remedy) in enumerate(result.wiring.wrong))  # fmt: skip
    if not result.upright:
        return (Step("Identify it at more length, with a person beside it.", again.removesuffix(" --quick")),)
    return (Step("Identify it at more length, and compare pole sets.", again.removesuffix(" --quick")),)


def _findings(result: QuickRun) -> tuple[KeyNumber, ...]:
    if result.refused is not None:
        return (KeyNumber(what="wiring" if result.wiring.wrong else "no loop", value=result.refused),)
    return (KeyNumber(what="time at the rig", value=f"{result.seconds:.0f} s"),)


def _numbers(result: QuickRun) -> dict[str, Any]:
    """The same as plain values."""
    w, a, law, model = result.wiring, result.ascent, result.law, result.model
    fit = None if result.fit is None else {
        "trusted": result.fit.trusted, "verdict": result.fit.verdict,
        "parameters": {n: {**plain_estimate(e), "unit": e.unit, "status": e.status}
                       for n, e in result.fit.estimates.items()},
    }  # fmt: skip
    return {
        "verdict": _verdict(result), "upright": result.upright, "refused": result.refused,
        "wrong": [what for what, _ in w.wrong], "weak": w.weak, "seconds": result.seconds, "wiring": vars(w),
        "fit": fit, "share": result.share, "K": None if law is None else law.K,
        "swing_up": None if a is None else {"upright_after": a.up, "peak_command": a.peak, "travel": a.travel,
                                            "ended": result.ended},
        "rule": None if law is None or model is None
        else as_values(law.rule(model, model.plant.state(next(iter(model.plant.equilibria))))),
    }  # fmt: skip
