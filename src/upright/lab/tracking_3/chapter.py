"""What did experiment 3 find? The chapter: data, fit, gains, closed loop, and why state feedback."""

from __future__ import annotations

import math

from upright.lab.tracking_3 import parts as parts_of
from upright.lab.tracking_3 import tables
from upright.lab.tracking_3.laws import AT
from upright.lab.tracking_3.parts import strongest
from upright.lab.tracking_3.pulses import FIT, STUDY
from upright.lab.tracking_3.run import Outcome, Tracking
from upright.lab.tracking_3.tables import length, milli, share
from upright.lab.tracking_3.why import why
from upright.paper.tables import TABLE_2
from upright.report.advice import Step
from upright.report.chapter import Chapter, Finding
from upright.report.symbols import figures, number, plain, typed

KEY = "3"


def verdict(done: Tracking) -> str:
    """What was learned, in a few sentences."""
    best, bad, size = strongest(done), [o for o in done.sets if not o.within], done.step.size
    who = best.law.name if len(done.sets) == 1 else f"all {len(done.sets)} sets of poles"
    head = f"A step of {length(done, size)} is followed by {who} within effort, travel and twist"
    if bad:
        head = f"A step of {length(done, size)} is too much for {', '.join(map(_beyond, bad))}"
    got, effort = best.found.figures, share(best.found.effort.share, 0)
    if got is None:
        return f"{head}."
    head += f"; {best.law.name} takes {effort} of the drive's limit and {_arrives(got.arrival)}."
    if done.pd is None or done.stiff is None or done.pd.found.figures is None:
        return head
    pd, stiff = done.pd.found, done.stiff.found.figures
    swings = stiff is None or not math.isfinite(stiff.settling_5)
    slow = "does not settle" if stiff is None or swings else f"swings for {stiff.settling_5:.2g} s"
    return (
        f"{head} A tuned PD of the near encoder {_arrives(done.pd.found.figures.arrival)}, with "
        f"{share(pd.effort.share, 0)} of the limit, but a push of the drive moves it by {share(pd.give / size, 0)} of "
        f"the step, {best.law.name} by {share(best.found.give / size, 0)}; made as stiff, the PD {slow}."
    )


def _beyond(o: Outcome) -> str:
    run = o.found
    if math.isfinite(run.tripped):
        return f"{o.law.name} (leaves travel or twist after {run.tripped:.2g} s)"
    return f"{o.law.name} (at the drive's limit in {share(run.effort.saturated, 1)} of the samples)"


def _arrives(arrival: float) -> str:
    return f"arrives in {milli(arrival)} s" if math.isfinite(arrival) else "never comes to stay within 5 %"


def sound(done: Tracking) -> bool:
    """Whether the fit is trusted and every set stays within the limits and settles."""
    trusted = done.fit is None or done.fit.trusted
    settled = all(o.found.figures is not None and math.isfinite(o.found.figures.settling_5) for o in done.sets)
    return trusted and settled and all(o.within for o in done.sets)


def chapter(done: Tracking) -> Chapter:
    """The experiment in the frame that all share."""
    names = done.model.plant.coordinates
    near, far = (plain(c.name) for c in (names[0], names[-1]))
    parts = [*parts_of.data(done), parts_of.gains(done, far), parts_of.loop(done, near, far)]
    if done.pd is not None:
        parts.append(parts_of.friction(done, near, far))
    if done.pd is not None and done.stiff is not None and done.far is not None:
        parts.append(why(done, near, far))
    told = " It was interrupted; what was finished is told." if done.interrupted else ""
    detail = "Seen on the twin: no rig was touched." if done.simulated else (
        "Foreseen on the fitted numbers; no rig was touched.")  # fmt: skip
    return Chapter(
        key=KEY, title="Tracking through a flexible shaft",
        question=f"Can the drive at one end of a flexible shaft make the other end, {far}, follow a step, within its "
        "effort and the shaft's travel, and what does it take beyond PD control of its own end?",
        verdict=verdict(done), detail=detail + told, sound=sound(done), parts=tuple(parts), steps=_steps(done),
        findings=_findings(done), numbers=tables.as_json(done),
    )  # fmt: skip


def _findings(done: Tracking) -> tuple[Finding, ...]:
    best, out = strongest(done), []
    if done.fit is not None:
        swing = max((p for at in done.fit.poles.values() for p in at), key=lambda p: p.imag.value, default=None)
        if swing is not None and swing.imag.value > 0:
            low, high = swing.imag.interval
            digits = figures(swing.imag.value, swing.imag.stderr)
            true = float(max(done.true.linear(AT).poles().imag))
            out.append(
                Finding(what="flexible mode [rad/s]", value=number(swing.imag.value, digits),
                        interval=f"{number(low, digits)} to {number(high, digits)}", truth=number(true, digits))
            )  # fmt: skip
    f = best.found.figures
    if f is not None:
        out.append(Finding(what=f"{best.law.name}: arrival within 5 % [s]", value=milli(f.arrival)))
        out.append(Finding(what=f"{best.law.name}: overshoot", value=share(f.overshoot)))
    out.append(Finding(what=f"{best.law.name}: effort, of the limit", value=share(best.found.effort.share)))
    return tuple(out)


def _steps(done: Tracking) -> tuple[Step, ...]:
    fit = typed(done.folder if done.fit is None else done.folder / FIT)
    own = Step(sentence="Ask for poles of your own.", command=f'upright track {fit} --poles "-10+-20j, -25+-10j"')
    if done.fit is None:
        return (own,)
    model = done.rig.plant.coordinates
    counts = "" if model[0].unit == "rad" else f" --counts {done.rig.counts[0]:.6g}"
    return (
        Step(
            sentence="Repeat the fit from its files.",
            command=f"upright identify {typed(done.folder / STUDY)} -o {typed(done.folder / 'again')}",
        ),
        own,
        Step(
            sentence="See margins and noise of one set.",
            command=f"upright design {fit} --at {AT} --track {model[-1].name} --period "
            f'"{1e3 * done.rig.period:g} ms"{counts} --poles "{TABLE_2[-1]}"',
        ),
    )
