"""A minute at a rig as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from upright.basis import DESCRIBED
from upright.experiments.quick.figures import first_motions_figure
from upright.experiments.quick.run import HELD, LANES, QuickRun
from upright.experiments.swing_up_2b.figures import ascent_figure
from upright.laws import as_values
from upright.report.fit.chapter import headline
from upright.report.fit.tables import plain_estimate
from upright.report.page import Chapter, KeyNumber, resting_on
from upright.report.prose import chapter_of

TITLE = "A rig in a minute"
"""Key and title of the experiment."""


def chapter(result: QuickRun) -> Chapter:
    """What a minute at the rig came to."""
    law, model, ascent = result.law, result.model, result.ascent
    gains = () if law is None or model is None else zip(
        model.states, model.state_units, (-law.K).tolist(), strict=True
    )  # fmt: skip
    page = chapter_of(
        __name__, result=result, title=TITLE, held=HELD, lanes=LANES, gains=tuple(gains),
        headline="" if result.fit is None else headline(result.fit),
        causes=[f"{what}: {remedy}" for what, remedy in result.wiring.wrong],
        figures={
            "first_motions": lambda: first_motions_figure(result),
            "ascent": lambda: ascent_figure(ascent) if ascent else None,
        },
    )  # fmt: skip
    page = replace(
        page, key="quick", sound=result.upright, findings=_findings(result), numbers=_numbers(result, page.verdict)
    )
    return resting_on(page, DESCRIBED if model is None else model.basis, result.stand.performed)


def _findings(result: QuickRun) -> tuple[KeyNumber, ...]:
    if result.refused is not None:
        return (KeyNumber(what="wiring" if result.wiring.wrong else "no loop", value=result.refused),)
    return (KeyNumber(what="time at the rig", value=f"{result.seconds:.0f} s"),)


def _numbers(result: QuickRun, verdict: str) -> dict[str, Any]:
    """The same as plain values."""
    w, a, law, model = result.wiring, result.ascent, result.law, result.model
    fit = None if result.fit is None else {
        "trusted": result.fit.trusted, "verdict": result.fit.verdict,
        "parameters": {n: {**plain_estimate(e), "unit": e.unit, "status": e.status}
                       for n, e in result.fit.estimates.items()},
    }  # fmt: skip
    return {
        "verdict": verdict, "upright": result.upright, "refused": result.refused,
        "wrong": [what for what, _ in w.wrong], "weak": w.weak, "seconds": result.seconds, "wiring": vars(w),
        "fit": fit, "share": result.share, "K": None if law is None else law.K,
        "swing_up": None if a is None else {"upright_after": a.up, "peak_command": a.peak, "travel": a.travel,
                                            "ended": result.ended},
        "rule": None if law is None or model is None
        else as_values(law.rule(model, model.plant.state(next(iter(model.plant.equilibria))))),
    }  # fmt: skip
