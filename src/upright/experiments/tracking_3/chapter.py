"""Experiment 3 as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from upright.basis import SIMULATED
from upright.control.effort import QUIET_RMS, of_limit
from upright.experiments.tracking_3.figures import (
    Tradeoff,
    in_reading_unit,
    poles_chart,
    steps_figure,
    tradeoff_figure,
)
from upright.experiments.tracking_3.laws import AT, best_decay, root_locus, sampled
from upright.experiments.tracking_3.pulses import FIT, STUDY
from upright.experiments.tracking_3.run import BEFORE, DWELL, RESERVE, Outcome, StepTrial, Tracking
from upright.gains.requests import written
from upright.identification.model.fit import Fit
from upright.paper.reproduce import TABLE_2
from upright.report.fit.chapter import motion_part
from upright.report.fit.pictures import run_pictures
from upright.report.fit.tables import finding, parameter_table
from upright.report.page import Block, Chapter, KeyNumber, Part, Picture
from upright.report.planes import RootLocus, loci_chart
from upright.report.prose import chapter_of
from upright.report.rig import of_rig
from upright.report.symbols import number, plain


def chapter(result: Tracking) -> Chapter:
    """How the far end follows, and what it takes."""
    near, far = (plain(result.model.plant.coordinates[i].name) for i in (0, -1))
    best, fit, p = _strongest(result), result.fit, result.model.plant.parameters()
    pd, stiff, other_end = result.pd, result.stiff, result.far
    inertia, other = p.get("m_1", p.get("J_1", 1.0)), p.get("m_2", p.get("J_2", 1.0))
    bound = 0.5 * math.sqrt(p["k_12"] / inertia)
    compared = [o for o in (best, result.summed, pd, stiff, other_end) if o is not None]
    reasons: Sequence[Block] = () if pd is None or stiff is None else _reasons(result, pd, stiff, bound)
    page = chapter_of(
        __name__, result=result, near=near, far=far, strongest=best, laws=tried_laws(result), fit=fit,
        compared=compared,
        beyond=[o for o in result.sets if not o.within], untried=[o for o in result.outcomes if not o.tried],
        busy=[o for o in result.sets if o.measured.rest and not o.measured.rest.quiet],
        guessed=[o for o in compared if result.tried and not o.tried], simulated=result.performed == SIMULATED,
        as_predicted=abs(best.measured.effort.peak / best.predicted.effort.peak - 1) < 5e-4, before=BEFORE,
        pairs=0 if result.search is None else result.search.kp.size, bound=bound, softest=p["k_12"] * inertia / other,
        push=abs(result.push), quiet_rms=round(100 * QUIET_RMS), reserve=round(100 * RESERVE),
        open_loop=result.model.linear(AT).poles(), strongest_poles=TABLE_2[-1], at=AT, study=STUDY,
        file=result.folder if fit is None else result.folder / FIT, length=partial(length, result),
        percentage=percentage, milli=milli, of_limit=of_limit, roots=written,
        placed={
            "poles": (_pole_picture(result),), "reasons": reasons,
            **({} if fit is None else _of_fit(result, fit)),
        },
        figures={
            "track-steps": lambda: steps_figure(result, result.sets),
            "track-compared": lambda: steps_figure(result, compared, until=DWELL + 1.4, kick=None),
        },
    )  # fmt: skip
    page = replace(
        page, key="3", best="track-steps", sound=_sound(result), findings=_findings(result), numbers=_numbers(result)
    )
    return of_rig(page, result.model, result.performed if result.tried else SIMULATED)


def _of_fit(result: Tracking, fit: Fit) -> dict[str, Sequence[Block | Part]]:
    """What the pulses say, with the truth that only a twin knows."""
    table = parameter_table(
        fit, truth=result.true.plant.parameters() | {"actuator.gain": result.true.gain},
        caption="Estimates from the pulses, beside the true values of the twin; 95 of 100 intervals should hold them",
    )  # fmt: skip
    return {"motion": (motion_part(fit),), "pulses": run_pictures(fit, "track"), "parameters": (table,)}


def tried_laws(result: Tracking) -> tuple[Outcome, ...]:
    """All laws that were tried, state feedback first."""
    return (*result.sets, *(o for o in (result.summed, result.pd, result.stiff, result.far) if o is not None))


def percentage(value: float, digits: int = 1) -> str:
    """A share as a percentage."""
    if not math.isfinite(value):
        return "–"
    text = f"{round(100 * value, digits) + 0.0:.{digits}f} %"  # + 0.0: no minus before a zero
    return text.replace("-", "−")


def milli(value: float) -> str:
    """Seconds to the millisecond."""
    return f"{value:.3f}" if math.isfinite(value) else "never"


def length(result: Tracking, value: float, digits: int = 3) -> str:
    """A length or an angle as it is read best."""
    factor, unit = in_reading_unit(result.rig.plant.coordinates[-1].unit)
    return f"{number(factor * value, digits)} {unit}"


def _sound(result: Tracking) -> bool:
    """Whether every set stays within the limits, settles, and is quiet at rest."""
    settled = all(o.measured.figures is not None and math.isfinite(o.measured.figures.settling_5) for o in result.sets)
    return settled and all(o.within and o.quiet for o in result.sets)


def _strongest(result: Tracking) -> Outcome:
    """The set with the largest prefilter."""
    return max(result.sets, key=lambda o: o.law.k_pf)


def _findings(result: Tracking) -> tuple[KeyNumber, ...]:
    best, out = _strongest(result), []
    poles = [] if result.fit is None else [p.imag for at in result.fit.poles.values() for p in at]
    swing = max(poles, key=lambda e: e.value, default=None)
    if swing is not None and swing.value > 0:
        out.append(finding("flexible mode [rad/s]", swing, float(max(result.true.linear(AT).poles().imag))))
    f = best.measured.figures
    if f is not None:
        out.append(KeyNumber(what=f"{best.law.name}: arrival within 5 % [s]", value=milli(f.arrival)))
        out.append(KeyNumber(what=f"{best.law.name}: overshoot", value=percentage(f.overshoot)))
    out.append(KeyNumber(what=f"{best.law.name}: effort, of the limit", value=percentage(best.measured.effort.share)))
    return tuple(out)


def _pole_picture(result: Tracking) -> Picture:
    return poles_chart(result).picture(
        "track-poles",
        caption="Poles requested (rings), of the sampled, late loop on the fitted model (+) and the rig (x). "
        "Delay and differences move the fast poles; the flexible mode stays where it was requested.",
        description="Upper half of the s-plane for every set.",
    )  # fmt: skip


def _reasons(result: Tracking, tuned: Outcome, stiff: Outcome, bound: float) -> list[Picture]:
    """Stiffness against decay, and the root loci of both PDs."""
    model, pd = result.model.linear(AT), tuned.law
    p = result.model.plant.parameters()
    of = result.rig.plant.coordinates[-1].unit
    kp = np.geomspace(0.2 * pd.k_pf, 2.5 * _strongest(result).law.k_pf, 40)
    points = {o.law.name: (o.law.stiffness, o.law.decay) for o in (*result.sets, tuned, stiff)}
    bargain = Tradeoff(
        stiffness=kp * result.model.gain, bound=bound, shaft=p["k_12"], points=points,
        decay=best_decay(sampled(result.model), kp, period=result.model.period),
        unit=f"{'N m' if of == 'rad' else 'N'}/{of}",
    )  # fmt: skip
    rate = float(pd.K[1]) / pd.k_pf
    rising = pd.k_pf * np.geomspace(1e-3, 30, 300)
    swing = 1j * math.sqrt(p["k_12"] / p.get("m_2", p.get("J_2", 1.0)))
    loci: list[RootLocus] = []
    for title, body, zeros in (("near encoder", 0, [-1 / rate, swing]), ("far encoder", 1, [-1 / rate])):
        loci.append(
            RootLocus(title=f"{title}: imaginary part", gains=rising, tracks=root_locus(model, body, rate, rising),
                  marked=root_locus(model, body, rate, np.array([pd.k_pf]))[0], zeros=np.array(zeros, dtype=complex))
        )  # fmt: skip
    return [
        Picture(
            name="track-bargain", draw=lambda: tradeoff_figure(bargain),
            caption="Fast against stiff. PD of the near encoder reaches what lies under the curve; state feedback lies "
            "outside of it. All as the loops run; dashed: the most that PD can reach without damping and delay.",
            description="Decay of the slowest pole over static force per error.",
        ),
        loci_chart(loci, model.poles(), of="as kp rises", symbol="kp", marked="kp of the tuned PD").picture(
            "track-loci",
            caption="Poles as kp rises, kd/kp as tuned. Poles and zeros alternate at the near encoder, and every "
            "branch stays left; at the far encoder the flexible mode goes right at once.",
            description="Two root loci, upper half plane.",
        ),
    ]  # fmt: skip


def _numbers(result: Tracking) -> dict[str, Any]:
    """The same as plain values: SI, the command in its unit, null for what never happens."""

    def run(r: StepTrial) -> dict[str, Any]:
        f = r.figures
        names = ("change", "rise", "peak_time", "overshoot", "settling_2", "settling_5", "arrival", "error")
        return {
            **{n: None if f is None else getattr(f, n) for n in names},
            "rest": None if r.rest is None else {"quiet": r.rest.quiet, "rms": r.rest.rms, "peak": r.rest.peak},
            "effort_peak": r.effort.peak, "effort_share": r.effort.share, "saturated": r.effort.saturated,
            "twist": r.twist, "travel": r.travel, "give": r.give, "tripped": r.tripped,
        }  # fmt: skip

    return {
        "rig": result.rig.name,
        "seed": result.rig.seed,
        "step": result.step.size,
        "step_reason": result.step.reason,
        "limit": result.rig.limit,
        "laws": {
            o.law.name: {
                "K": o.law.K, "k_pf": o.law.k_pf, "poles_asked": o.law.requested,
                "poles": o.law.poles, "decay": o.law.decay, "damping": o.law.damping,
                "static_force_per_error": o.law.stiffness, "error_at_most": o.law.play, "foreseen": run(o.predicted),
                "found": run(o.measured) if o.tried else None, "within_limits": o.within,
            } for o in tried_laws(result)
        },
        "seconds": result.seconds,
        "interrupted": result.interrupted,
    }  # fmt: skip
