"""Experiment 3 as a chapter: data, fit, gains, closed loop, what friction leaves, and why state feedback."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from upright.basis import SIMULATED
from upright.control.effort import QUIET_RMS, of_limit
from upright.experiments.tracking_3 import tables
from upright.experiments.tracking_3.figures import Tradeoff, poles_chart, steps_figure, tradeoff_figure
from upright.experiments.tracking_3.laws import AT, best_decay, root_locus, sampled
from upright.experiments.tracking_3.pulses import FIT, STUDY
from upright.experiments.tracking_3.run import BEFORE, DWELL, RESERVE, Outcome, StepTrial, Tracking
from upright.experiments.tracking_3.tables import length, milli, percentage
from upright.identification.model.fit import Fit
from upright.paper.reproduce import TABLE_2
from upright.report.fit.chapter import motion_part, run_pictures
from upright.report.fit.tables import finding, parameter_table
from upright.report.page import Chapter, KeyNumber, Part, Picture, Step, Table
from upright.report.planes import RootLocus, loci_chart
from upright.report.rig import of_rig
from upright.report.symbols import number, plain, typed


def chapter(result: Tracking) -> Chapter:
    """How the far end follows, and what it takes."""
    near, far = (plain(result.model.plant.coordinates[i].name) for i in (0, -1))
    parts = [*_data(result), _gains(result, far), _loop(result, near, far)]
    if result.pd is not None:
        parts.append(_friction(result, far))
    if result.pd is not None and result.stiff is not None and result.far is not None:
        parts.append(_why(result, result.pd, result.stiff, result.far, near, far))
    ended = " It was interrupted; what was finished is reported." if result.interrupted else ""
    detail = "Predicted with the fitted numbers; no rig was touched."
    if result.tried:
        left = [o.law.name for o in result.outcomes if not o.tried]
        detail = "Seen on the twin: no rig was touched." if result.simulated else "Tried on the rig."
        if left:
            detail = f"Tried on the rig, but for what is predicted to leave the bounds: {', '.join(left)}."
    page = Chapter(
        key="3", best="track-steps", title="Tracking through a flexible shaft",
        question=f"Can the drive at one end of a flexible shaft make the other end, {far}, follow a step, within its "
        "effort and the shaft's travel, and what does it take beyond PD control of its own end?",
        verdict=_verdict(result), detail=detail + ended, sound=_sound(result), parts=tuple(parts), steps=_steps(result),
        findings=_findings(result), numbers=_numbers(result),
    )  # fmt: skip
    return of_rig(page, result.model, result.performed if result.tried else SIMULATED)


def _verdict(result: Tracking) -> str:
    """What was learned, in a few sentences."""
    best, bad, size = _strongest(result), [o for o in result.sets if not o.within], result.step.size
    who = best.law.name if len(result.sets) == 1 else f"all {len(result.sets)} sets of poles"
    head = f"A step of {length(result, size)} is followed by {who} within effort, travel and twist"
    if bad:
        head = f"A step of {length(result, size)} is too much for {', '.join(map(_beyond, bad))}"
    got, effort = best.measured.figures, percentage(best.measured.effort.share, 0)
    if got is None:
        return f"{head}.{_busy(result)}"
    head += f"; {best.law.name} takes {effort} of the drive's limit and {_arrives(got.arrival)}.{_busy(result)}"
    if result.pd is None or result.stiff is None or result.pd.measured.figures is None:
        return head
    pd, stiff = result.pd.measured, result.stiff.measured.figures
    swings = stiff is None or not math.isfinite(stiff.settling_5)
    slow = "does not settle" if stiff is None or swings else f"swings for {stiff.settling_5:.2g} s"
    return (
        f"{head} A tuned PD of the near encoder {_arrives(result.pd.measured.figures.arrival)}, with "
        f"{percentage(pd.effort.share, 0)} of the limit, but a push of the drive moves it by "
        f"{percentage(pd.give / size, 0)} of the step, {best.law.name} by "
        f"{percentage(best.measured.give / size, 0)}; made as stiff, the PD {slow}."
    )


def _busy(result: Tracking) -> str:
    """Sets whose command is excessive at rest, as a sentence after others."""
    busy = [(o.law.name, o.measured.rest) for o in result.sets if o.measured.rest and not o.measured.rest.quiet]
    if not busy:
        return ""
    rms = ", ".join(f"{of_limit(rest.rms)} with {name}" for name, rest in busy)
    return f" At rest the effort is excessive: the command's rms is {rms} ({100 * QUIET_RMS:.0f} % is quiet)."


def _beyond(o: Outcome) -> str:
    run = o.measured
    if math.isfinite(run.tripped):
        return f"{o.law.name} (leaves travel or twist after {run.tripped:.2g} s)"
    return f"{o.law.name} (at the drive's limit in {percentage(run.effort.saturated, 1)} of the samples)"


def _arrives(arrival: float) -> str:
    return f"arrives in {milli(arrival)} s" if math.isfinite(arrival) else "never comes to stay within 5 %"


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


def _steps(result: Tracking) -> tuple[Step, ...]:
    fit = typed(result.folder if result.fit is None else result.folder / FIT)
    own = Step("Ask for poles of your own.", f'upright track {fit} --poles "-10+-20j, -25+-10j"')
    if result.fit is None:
        return (own,)
    model = result.rig.plant.coordinates
    counts = "" if model[0].unit == "rad" else f" --counts {result.rig.per_unit[0]:.6g}"
    return (
        Step(
            "Repeat the fit from its files.",
            f"upright identify {typed(result.folder / STUDY)} -o {typed(result.folder / 'again')}",
        ),
        own,
        Step(
            "See margins and noise of one set.",
            f"upright design {fit} --at {AT} --track {model[-1].name} --period "
            f'"{1e3 * result.rig.period:g} ms"{counts} --poles "{TABLE_2[-1]}"',
        ),
    )


def _data(result: Tracking) -> list[Part]:
    """The log, and the model found in it; nothing where only a fit was given."""
    fit = result.fit
    if fit is None:
        return []
    scores = ", ".join(f"{plain(n)} {v:.2f} %" for s in fit.runs.values() if s.role != "fit"
                       for n, v in s.fit_percent.items())  # fmt: skip
    pulses = (
        "The drive pulses forth, twice back and forth again, so that two inertias without a spring to ground "
        "end about where they began; pauses let dry friction show. Encoders count, the log is every fifth "
        "servo sample. Other pulses, never fitted, test the model."
    )
    sentence = f"{fit.verdict} Other pulses are predicted: {scores}."
    scale = _scale(fit.model.parameters["actuator.gain"].estimate)
    return [
        Part("Data", (pulses, *run_pictures(fit, "track")), folded=True),
        motion_part(fit),
        Part("Fit", (sentence, scale, _fit_table(result, fit))),
    ]


def _fit_table(result: Tracking, fit: Fit) -> Table:
    """Numbers of the shaft, with the truth that only a twin can tell."""
    return parameter_table(
        fit, truth=result.true.plant.parameters() | {"actuator.gain": result.true.gain},
        caption="What the pulses say, beside the truth of the twin; the interval holds the truth in 95 of 100 rigs",
    )  # fmt: skip


def _scale(weighed: bool) -> str:
    whence = "The drive's gain is taken from its maker, to 2 %"
    if weighed:
        whence = "What experiment 1a weighed fixes the scale, and the drive's gain follows from it"
    return (
        f"{whence}: masses, springs, friction and gain go up and down together, poles, gains in volts and everything "
        "below stay."
    )


def _gains(result: Tracking, far: str) -> Part:
    """Gains, poles, and the size of the step."""
    return Part(
        "Gains",
        (
            "Ackermann's formula on the fitted model puts the poles where Table 2 of the paper has them; "
            f"k_pf = 1/(C (B K − A)⁻¹ B) gives unit static gain from the reference to {far}.",
            f"The step is {length(result, result.step.size)}, {_sized(result)}. The largest command is the first: "
            "speeds are zero and errors the whole step, so that it is k_pf times the step, whatever the rig.",
            tables.gain_table(result),
            tables.shaft_pole_table(result),
            poles_chart(result).picture(
                "track-poles",
                caption="Poles requested (rings), of the sampled, late loop on the fitted model (+) and the rig (x). "
                "Delay and differences move the fast poles; the flexible mode stays where it was requested.",
                description="Upper half of the s-plane for every set.",
            ),
        ),
    )  # fmt: skip


def _sized(result: Tracking) -> str:
    step = result.step
    others = {
        "effort": (f"{100 * RESERVE:.0f} % of the drive's limit", step.by_effort),
        "twist": ("60 % of the twist that trips the shaft", step.by_twist),
        "travel": ("60 % of the travel", step.by_travel),
    }
    allowed = ", ".join(f"{what} {length(result, v)}" for what, v in others.values() if math.isfinite(v))
    return f"{step.reason}; what each bound allows: {allowed}"


def _loop(result: Tracking, near: str, far: str) -> Part:
    """Step figures and pictures of the sets."""
    shares = ", ".join(f"{o.law.name} {percentage(o.measured.effort.share, 0)}" for o in result.sets)
    best = _strongest(result)
    off = abs(best.measured.effort.peak / best.predicted.effort.peak - 1)
    sentence = f"Largest command, of the drive's limit: {shares}."
    if result.tried:
        sentence += (
            f" Predicted for {best.law.name}: "
            f"{best.predicted.effort.peak:.3g} {result.rig.unit} ({percentage(best.predicted.effort.share)}); found "
            + ("the same." if off < 5e-4 else f"{best.measured.effort.peak:.3g} {result.rig.unit}.")
        )
    steps = Picture(
        name="track-steps", draw=lambda: steps_figure(result, result.sets),
        caption=f"Reference (dotted), {near} of the driven body, {far} of the far one, and the first 0.1 s of "
        "the command with the drive's limit, set by set.",
        description=_described(result),
    )  # fmt: skip
    return Part("Closed loop", (sentence, tables.step_table(result), steps))


def _described(result: Tracking) -> str:
    """The picture of the steps, for who cannot see it."""
    return "; ".join(
        f"{o.law.name}: overshoot {percentage(o.measured.figures.overshoot)}, settled to 5 % after "
        f"{milli(o.measured.figures.settling_5)} s"
        for o in result.sets
        if o.measured.figures is not None
    )


def _friction(result: Tracking, far: str) -> Part:
    """What dry friction leaves, why, and the cure."""
    cure = ""
    if result.summed is not None and result.summed.measured.figures is not None:
        left = abs(result.summed.measured.figures.error) / result.step.size
        cure = (
            f" The sum of the error, with a fifth pole at −5 1/s, is the cure: it leaves {percentage(left)} of the "
            "step, and the push is made up for. Its zero cancels that pole on the reference's way, so that the step "
            "itself is followed as before."
        )
    return Part(
        "What friction leaves",
        (
            f"At rest the spring may hold the far body off by f_2/k, and the drive need not move the near one before "
            f"its pull exceeds f_1: {far} stays wrong by up to (f_1 + f_2)/(gain k_pf) + (K_1/k_pf) f_2/k. The first "
            f"part shrinks as the loop gets stiffer, the second does not.{cure}",
            tables.friction_table(result),
        ),
    )


def _why(result: Tracking, pd: Outcome, stiff: Outcome, other_end: Outcome, near: str, far: str) -> Part:
    """PD control beside state feedback, and what its one damper cannot do."""
    best = _strongest(result)
    p = result.model.plant.parameters()
    inertia = p.get("m_1", p.get("J_1", 1.0))
    other = p.get("m_2", p.get("J_2", 1.0))
    force = "N m/rad" if result.rig.plant.coordinates[-1].unit == "rad" else "N/m"
    bound = 0.5 * math.sqrt(p["k_12"] / inertia)
    compared = [best, *((result.summed,) if result.summed else ()), pd, stiff, other_end]
    trips = other_end.measured.tripped
    end = f"trips the rig {trips - BEFORE:.2g} s after the step" if math.isfinite(trips) else "does not trip the rig"
    if result.tried and not other_end.tried:
        end = f"was not tried; it is predicted that it {end}"
    guessed = [o.law.name for o in compared if result.tried and not o.tried]
    predicted = f" Predicted, not tried: {', '.join(guessed)}." if guessed else ""
    tried = 0 if result.search is None else result.search.kp.size
    return Part(
        "Why state feedback",
        (
            f"PD control of the driven body, kp and kd the best of {tried} pairs tried on the fitted rig under the "
            f"same limit, brings {far} to the reference about as soon, at "
            f"{percentage(pd.measured.effort.share, 0)} of the limit. For a step alone it would do.",
            "But it has one damper for two modes. Without natural damping no kp and kd let every pole decay faster "
            f"than half the root of k/inertia 1, {number(bound, 3)} 1/s here, and it gets there only at kp·gain = k "
            f"(inertia 1)/(inertia 2), {number(p['k_12'] * inertia / other, 3)} {force}, where {best.law.name} has "
            f"{number(best.law.stiffness, 3)}. Stiffer, {near} is held fast and {far} swings on its spring: as stiff "
            f"as {best.law.name}, the slowest pole decays with {number(stiff.law.decay, 2)} 1/s at a damping ratio of "
            f"{number(stiff.law.damping, 2)}, against {number(best.law.decay, 3)} 1/s and "
            f"{number(best.law.damping, 2)}. State feedback is fast and stiff at once: it alone uses the far encoder.",
            f"PD control of the far encoder with the same gains {end}: between drive and far body lies no zero, the "
            "phase of the flexible mode is turned by half a turn, and kd drives what it should damp (without natural "
            "damping for any kp and kd: the polynomial lacks s³).",
            Picture(
                name="track-compared",
                draw=lambda: steps_figure(result, compared, until=DWELL + 1.4, kick=None),
                caption="The same step, then a steady push of the drive, which the command shown contains. A cross: "
                "the rig has tripped." + predicted,
                description=f"State feedback beside PD control: {_described(result)}",
            ),
            *_reasons(result, pd, stiff, bound),
        ),
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
            caption="Fast against stiff. PD of the near encoder has what lies under the curve; state feedback stands "
            "outside of it. All as the loops run; dashed: the most that PD can have without natural damping and delay.",
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
            } for o in tables.tried_laws(result)
        },
        "seconds": result.seconds,
        "interrupted": result.interrupted,
    }  # fmt: skip
