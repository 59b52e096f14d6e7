"""The parts of experiment 3's chapter, from the log to why state feedback."""

from __future__ import annotations

import math

from markupsafe import Markup

from upright.lab.tracking_3 import tables
from upright.lab.tracking_3.figures import Frame, Panel, Trace, poles_figure, steps_figure
from upright.lab.tracking_3.laws import AT, loop_poles
from upright.lab.tracking_3.run import BEFORE, DWELL, RESERVE, Outcome, Tracking
from upright.lab.tracking_3.tables import length, milli, share
from upright.report.document import motion, picture, run_pictures
from upright.report.sections import Part
from upright.report.symbols import plain


def strongest(done: Tracking) -> Outcome:
    """The set with the largest prefilter."""
    return max(done.sets, key=lambda o: o.law.k_pf)


def data(done: Tracking) -> list[Part]:
    """The log, and the model found in it; nothing where only a fit was given."""
    if done.fit is None:
        return []
    pictures = tuple(run_pictures(done.fit, "track"))
    fit = done.fit
    scores = ", ".join(f"{plain(n)} {v:.2f} %" for s in fit.runs.values() if s.role != "fit"
                       for n, v in s.fit_percent.items())  # fmt: skip
    return [
        Part(
            title="Data",
            sentences=(
                "The drive pulses forth, twice back and forth again, so that two inertias without a spring to ground "
                "end about where they began; pauses let dry friction show. Encoders count, the log is every fifth "
                "servo sample. Other pulses, never fitted, test the model.",
            ),
            pictures=pictures,
        ),
        Part(
            title="Fit",
            sentences=(
                f"{fit.verdict} Other pulses are predicted: {scores}.",
                _scale(done.fit.rig.parameters["actuator.gain"].estimate),
            ),
            formulas=(Markup(motion(fit)),),
            tables=(tables.fit_table(done),),
        ),
    ]


def _scale(weighed: bool) -> str:
    whence = "The drive's gain is taken from its maker, to 2 %"
    if weighed:
        whence = "What experiment 1a weighed fixes the scale, and the drive's gain follows from it"
    return (
        f"{whence}: masses, springs, friction and gain go up and down together, poles, gains in volts and everything "
        "below stay."
    )


def gains(done: Tracking, far: str) -> Part:
    """Gains, poles, and the size of the step."""
    panels = [
        Panel(name=o.law.name, asked=o.law.asked, model=o.law.poles, rig=loop_poles(done.rig, o.law.law))
        for o in done.sets
    ]
    pole_picture = picture(
        poles_figure(panels, done.model.linear(AT).poles()), "track-poles",
        caption="Poles asked (rings), of the sampled, late loop on the fitted model (+) and on the rig (x). Delay and "
        "differences move the fast poles; the flexible mode stays where it was asked.",
        description="Upper half of the s-plane for every set.",
    )  # fmt: skip
    return Part(
        title="Gains",
        sentences=(
            "Ackermann's formula on the fitted model puts the poles where Table 2 of the paper has them; "
            f"k_pf = 1/(C (B K − A)⁻¹ B) gives unit static gain from the reference to {far}.",
            f"The step is {length(done, done.step.size)}, {_sized(done)}. The largest command is the first: speeds are "
            "zero and errors the whole step, so that it is k_pf times the step, whatever the rig.",
        ),
        tables=(tables.gain_table(done), tables.pole_table(done)),
        pictures=(pole_picture,),
    )


def _sized(done: Tracking) -> str:
    step = done.step
    others = {
        "effort": (f"{100 * RESERVE:.0f} % of the drive's limit", step.by_effort),
        "twist": ("60 % of the twist that trips the shaft", step.by_twist),
        "travel": ("60 % of the travel", step.by_travel),
    }
    allowed = ", ".join(f"{what} {length(done, v)}" for what, v in others.values() if math.isfinite(v))
    return f"{step.reason}; what each bound allows: {allowed}"


def frame(done: Tracking) -> Frame:
    """What the pictures of all runs share."""
    names = done.rig.plant.coordinates
    return Frame(
        near=names[0].name, far=names[-1].name, of=names[-1].unit, step=done.step.size, limit=done.rig.limit,
        command=done.rig.unit, push=DWELL,
    )  # fmt: skip


def trace(o: Outcome) -> Trace:
    """What encoders and command showed, up to a trip."""
    run = o.found
    record = run.trial.record
    kept = record.t <= run.tripped
    near, far = record.outputs[0], record.outputs[-1]
    return Trace(
        name=o.law.name, t=record.t[kept] - BEFORE, near=record[near][kept], far=record[far][kept], u=record["u"][kept]
    )


def loop(done: Tracking, near: str, far: str) -> Part:
    """Step figures and pictures of the sets."""
    shares = ", ".join(f"{o.law.name} {share(o.found.effort.share, 0)}" for o in done.sets)
    best = strongest(done)
    off = abs(best.found.effort.peak / best.foreseen.effort.peak - 1)
    return Part(
        title="Closed loop",
        sentences=(
            f"Largest command, of the drive's limit: {shares}. Foreseen for {best.law.name}: "
            f"{best.foreseen.effort.peak:.3g} {done.rig.unit} ({share(best.foreseen.effort.share)}); found "
            + ("the same." if off < 5e-4 else f"{best.found.effort.peak:.3g} {done.rig.unit}."),
        ) if done.simulated else (f"Largest command, of the drive's limit: {shares}.",),
        tables=(tables.step_table(done),),
        pictures=(
            picture(
                steps_figure([trace(o) for o in done.sets], frame(done)), "track-steps",
                caption=f"Reference (dotted), {near} of the driven body, {far} of the far one, and the first 0.1 s of "
                "the command with the drive's limit, set by set.",
                description=described(done),
            ),
        ),
    )  # fmt: skip


def described(done: Tracking) -> str:
    """The picture of the steps, for who cannot see it."""
    return "; ".join(
        f"{o.law.name}: overshoot {share(o.found.figures.overshoot)}, settled to 5 % after "
        f"{milli(o.found.figures.settling_5)} s"
        for o in done.sets
        if o.found.figures is not None
    )


def friction(done: Tracking, near: str, far: str) -> Part:
    """What dry friction leaves, why, and the cure."""
    cure = ""
    if done.summed is not None and done.summed.found.figures is not None:
        left = abs(done.summed.found.figures.error) / done.step.size
        cure = (
            f" The sum of the error, with a fifth pole at −5 1/s, is the cure: it leaves {share(left)} of the step, "
            "and the push is made up for. Its zero cancels that pole on the reference's way, so that the step itself "
            "is followed as before."
        )
    return Part(
        title="What friction leaves",
        sentences=(
            f"At rest the spring may hold the far body off by f_2/k, and the drive need not move the near one before "
            f"its pull exceeds f_1: {far} stays wrong by up to (f_1 + f_2)/(gain k_pf) + (K_1/k_pf) f_2/k. The first "
            f"part shrinks as the loop gets stiffer, the second does not.{cure}",
        ),
        tables=(tables.friction_table(done),),
    )
