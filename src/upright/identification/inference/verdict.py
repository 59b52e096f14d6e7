"""The verdict in three answers: does the model predict, which of its numbers can be used, and is it enough for a loop?

None is better than its reasons. What was not tested is reported as not tested.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from upright.basis import NOT_SUPPORTED, in_percent
from upright.identification.inference.assumptions import resting
from upright.identification.inference.ceiling import ENOUGH, Judged
from upright.identification.inference.intervals import VAGUE
from upright.identification.inference.loop import Standing
from upright.identification.inference.ties import Tie
from upright.identification.model.fit import Assumption, Estimate, Judgement, RunScore
from upright.identification.model.grey_box import GreyBox
from upright.quantities import figures

GOOD = 80.0
"""Fit percent below which a run counts as not explained."""

DROP = 15.0
"""Percent by which a predicted signal may fall behind the worst fitted one of the same name."""

STILL = 0.5
"""A signal that moves at most this share of what it moves in a fitted run is missed by a share of that, not of its own
motion: where nothing moves every model misses all of it."""

MOSTLY = 50.0
"""Percent of such a signal that has to lie inside its band: what is far outside was not lost among little motion."""

HALF = 50.0
"""Fit percent below which a prediction says nothing to speak of, however well its band foretold that."""

MARGIN = 2.0
"""Percent by which a model has to beat held speeds for its horizon to tell anything; one step ahead fits anything."""

FEWEST = 70.0
"""Percent of a signal inside its band below which a prediction falls short of 90 %.

What is left over comes in waves, so that of one run fewer than promised lie inside by chance: of twins with physics
that their models lack one signal in eleven had fewer than this (`python -m benchmarks bands`).
"""

VANISHED = 1e-6
"""Share of its guess below which a mass has vanished: no guess of a rig's is a million times too large."""

ESSENTIAL = ("J_", "m_", "k_", "l_", "actuator.gain")
"""Numbers without which a model is none: inertias, stiffnesses, lengths, the drive; friction is often vague."""

NARROW, SOME = 0.1, 0.3
"""Half an interval of the growth rate upright, relative to it, within which a loop can be designed, or perhaps."""

SURE, LIKELY = 0.99, 0.9
"""Shares of the rigs within the intervals that a loop has to hold."""

PREDICTS, USABLE, LOOP = "Does it predict?", "Can its numbers be used?", "Is it good enough for the loop?"

INTERRUPTED = "Not evaluated: interrupted."


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """What a fit came to.

    `unseen` and `conventions` are sentences on what the data cannot see and on signs or zeros that look wrong. The
    residuals are autocorrelated over `memory` seconds, the motion takes `period` seconds for one period. `standing`
    says how a rig within the intervals stands upright, if this plant can, `judged` how far ahead runs count that a
    filter predicts, `driven` whether a command acted in a run.
    Numbers that are `bent` leave their intervals with a dead time of the drive that would explain the runs better.
    Runs that are `lost` run away at the numbers or as soon as one is moved; `nothing` says that the runs are missed by
    more than they vary, `ties` which pairs of numbers cannot be separated, `missing` in sentences what the runs show
    and the model lacks, `alike` in one which other answers explain them as well.
    """

    rig: GreyBox
    runs: Mapping[str, RunScore]
    estimates: Mapping[str, Estimate]
    unseen: Sequence[str]
    conventions: Sequence[str]
    assumptions: Sequence[Assumption]
    converged: bool
    interrupted: bool
    memory: float
    period: float
    standing: Standing | None
    judged: Judged | None = None
    driven: bool = True
    bent: Sequence[str] = ()
    lost: Sequence[str] = ()
    nothing: bool = False
    ties: Sequence[Tie] = ()
    missing: Sequence[str] = ()
    alike: str = ""


def judge(evidence: Evidence) -> tuple[Judgement, ...]:
    """The three answers."""
    predicts = _predicts(evidence)
    untested = predicts.answer == "not tested"
    others = (
        _usable(evidence, confirmed=predicts.answer == "yes", untested=untested),
        _loop(evidence, supported=predicts.answer != "no"),
    )
    if evidence.interrupted:
        return predicts, *map(_not_evaluated, others)
    if predicts.answer != "no":
        return predicts, *others
    return predicts, *(_no_better(a) for a in others)


def _not_evaluated(a: Judgement) -> Judgement:
    """An answer that an interrupted search did not come to; what speaks against the numbers already stays."""
    if a.question == USABLE and a.answer == "no":
        return replace(a, reasons=(f"{INTERRUPTED} This is from the best so far.", *a.reasons))
    return Judgement(question=a.question, answer="not tested", headline=INTERRUPTED)


def _no_better(a: Judgement) -> Judgement:
    """An answer that rests on a model which does not predict."""
    reason = (
        "They are numbers of a model that does not predict." if a.question == USABLE else "The model does not predict."
    )
    return replace(a, answer="in part", reasons=(reason, *a.reasons)) if a.answer == "yes" else a


def trusted(answers: Sequence[Judgement]) -> bool:
    """Whether nothing speaks against the model or its numbers; what was not tested does not."""
    return not any(a.answer == "no" for a in answers if a.question != LOOP)


def _predicts(evidence: Evidence) -> Judgement:
    against: list[str] = []
    if evidence.lost:
        against.append(_failure(evidence.lost))
    if evidence.interrupted:
        against.append("The search was interrupted; this is its best so far.")
    elif not evidence.converged and not evidence.lost:
        against.append("The search had not settled when its evaluations ran out.")
    fitted, predicted = (_percents(evidence.runs, role) for role in ("fit", "predict"))
    poor = [f"{what} {p:.1f} %" for what, p in fitted.items() if p < GOOD]
    if poor:
        against.append(f"The fitted runs are not explained ({', '.join(poor)}; {GOOD:.0f} % is the least).")
    still = _nearly_still(evidence.runs)
    spared = {*still, *_foretold(evidence.runs)}
    worse = [f"{what} {p:.1f} %" for what, p in _worse(evidence.runs).items() if what not in spared]
    if worse:
        against.append(f"Runs that were not fitted are predicted much worse than fitted ones ({', '.join(worse)}).")
    bad = [f"{what} {p:.1f} %" for what, p in predicted.items() if p < GOOD and what not in spared]
    if bad and not worse:
        against.append(f"Runs that were not fitted are not predicted ({', '.join(bad)}; {GOOD:.0f} % is the least).")
    against += [s[0].upper() + s[1:] for s in evidence.conventions]
    blank = uninformative(evidence.runs)
    explains = f"It explains {_ranges(evidence.runs, 'fit')} of the fitted runs. " if fitted else ""
    if blank and len(blank) == sum(len(s.fit_percent) for s in evidence.runs.values()):
        against.append("No run is predicted far enough ahead to test the model.")
    notes: list[str] = list(evidence.missing)
    notes += [] if evidence.judged is None else _horizon(evidence.judged, evidence.runs)
    if blank:
        where = ", ".join(f"{label} {signal} at {evidence.runs[label].horizon:g} s" for label, signal in blank)
        notes.append(
            f"Some horizons tell nothing: holding the measured speed predicts as well to within {MARGIN:.0f} % "
            f"({where}); predict further ahead."
        )
    if evidence.memory > 0.05 * evidence.period and fitted:
        notes.append(
            f"The residuals are autocorrelated over about {evidence.memory:.2g} s, so a small effect is unmodelled. "
            "The intervals include this correlation and the spread between parts of the runs, but not a wrong "
            "structure of the model."
        )
    if against:
        return Judgement(
            question=PREDICTS, answer="no", headline=f"{explains}Do not rely on this model yet.",
            reasons=(*against, *notes),
        )  # fmt: skip
    if not predicted:
        return Judgement(
            question=PREDICTS, answer="not tested", headline=f"{explains}Every run was fitted.",
            advice="Hold a run or a tail out (role = \"predict\", or --hold-out).", reasons=tuple(notes),
        )  # fmt: skip
    outside = [label for label, s in evidence.runs.items() if s.role == "predict" and s.beyond]
    notes += [sentence for label in outside for sentence in evidence.runs[label].beyond]
    narrow = _too_narrow(evidence.runs)
    if narrow:
        notes.append(
            f"Its 90 % bands were too narrow: they hold only {', '.join(narrow)} of the samples ({FEWEST:.0f} % is the "
            "least), so expect to be further off than the fit says."
        )
    vague = [f"{what} {p:.0f} %" for what, p in _expected(evidence.runs).items() if p < GOOD]
    if vague and not still:
        notes.append(
            f"The numbers are so uncertain that no more can be expected of such runs ({', '.join(vague)}; {GOOD:.0f} % "
            "is the least), however well these were met: fit longer ones, or with more in them."
        )
    if still:
        notes.append(
            f"Too little moved to test the model: {', '.join(still)} went at most {STILL:g} times as far as in the "
            f"fitted runs, and was missed by less than {100 - GOOD:.0f} % of that. Hold a run out that moves more."
        )
    part = "in part" if blank or narrow or vague or still or evidence.missing else "yes"
    far = f" Outside what the fit has seen: {', '.join(outside)}." if outside else ""
    headline = (
        f"{explains}It predicts {_ranges(evidence.runs, 'predict', still)} of runs it has not seen"
        f"{_beside(evidence.runs)}.{far}"
    )
    beaten = _beaten(evidence.runs)
    if beaten:
        notes.append(
            f"A black-box (ARX) baseline, fitted to the same runs, predicts better ({', '.join(beaten)}), so the "
            "model misses something that these data show."
        )
    return Judgement(question=PREDICTS, answer=part, headline=headline, reasons=tuple(notes))


def _horizon(judged: Judged, runs: Mapping[str, RunScore]) -> list[str]:
    """Why runs are judged so far ahead, and what the start state alone leaves further on."""
    allowed: dict[float, list[float]] = {}
    reached: dict[float, list[float]] = {}
    for s in runs.values():
        for horizon, percents in s.ceiling.items():
            allowed.setdefault(horizon, []).extend(percents.values())
            reached.setdefault(horizon, []).extend(s.ahead[horizon].values())
    if not allowed:
        return []
    least = min(allowed[judged.seconds], default=ENOUGH)
    ms = _seconds(judged.seconds)
    falls = "" if not judged.growth else f": the plant falls by e in {1e3 / judged.growth:.2g} ms"
    if least < ENOUGH:
        return [
            f"No horizon tests this model{falls}, and already {ms} ahead the start state, known no better than the "
            f"sensors allow, limits any model to {least:.0f} %. Let it move more, or measure it finer."
        ]
    further = [h for h in allowed if h > judged.seconds * (1 + 1e-9)]
    if not further:
        return []
    h = max(further)
    return [
        f"It is judged {ms} ahead{falls}, and further on any model misses by what its start state is unknown: at "
        f"{_seconds(h)} that allows {min(allowed[h]):.0f} %, and {min(reached[h]):.0f} % are reached."
    ]


def _too_narrow(runs: Mapping[str, RunScore]) -> list[str]:
    """Predicted signals of which too few samples lie inside their bands, with the percents that do."""
    return [
        f"{label} {signal} {p:.0f} %"
        for label, s in runs.items()
        if s.role == "predict"
        for signal, p in s.inside.items()
        if p < FEWEST
    ]


def _failure(lost: Sequence[str]) -> str:
    """What happened where a motion runs away, and what to try."""
    named = ", ".join(f"'{label}'" for label in lost)
    which = f"run{'s' if len(lost) > 1 else ''} {named}"
    return (
        f"The fit failed: at the last numbers of the search, or as soon as one of them changes a little, the simulated "
        f"motion of {which} grows beyond all bounds, so no uncertainty can be computed. Check the plant and the signs "
        "and units of drive and sensors, start from guesses nearer to the truth, or fit a shorter window or one that "
        "is restarted (horizon)."
    )


def _usable(evidence: Evidence, *, confirmed: bool, untested: bool) -> Judgement:
    if evidence.lost:
        return Judgement(
            question=USABLE, answer="no",
            headline="None of them: the fit failed, and they are only where its search stopped.",
        )  # fmt: skip
    estimated = {n: e for n, e in evidence.estimates.items() if e.status not in IDLE}
    sure = [n for n, e in estimated.items() if e.status.startswith(DETERMINED)]
    reasons: list[str] = [*evidence.unseen, *filter(None, [evidence.alike])]
    no = bool(evidence.unseen)
    if estimated and evidence.nothing:
        no = True
        reasons.append(
            "The model misses the fitted runs by more than these vary, so none of its numbers is determined, however "
            "narrow its interval."
        )
    elif estimated and not sure and not evidence.unseen:
        no = True
        reasons.append("No estimated number is determined well, so others would explain the runs as well.")
    for n, e in estimated.items():
        low, high = e.given or e.interval
        limit = evidence.rig.bounds(n) if n in evidence.rig.parameters else (-math.inf, math.inf)
        if _vanished(evidence.rig, n, e):
            no = True
            reasons.append(
                f"{n} went to nothing, {e.value:.1g} {e.unit}, from a guess of {evidence.rig.parameters[n].value:.2g}: "
                "a degenerate optimum, so the other numbers are not the rig's either. Measure it or the drive's gain "
                "and give that as known, and look at the drive's sign."
            )
        elif e.status == "at bound" and e.value != 0:
            no = True
            reasons.append(
                f"{n} reached its {'lower' if e.value <= limit[0] else 'upper'} limit, {_shown(e.value, e)}: the data "
                f"would push {n} past a bound that was set for it. Widen it, or give the value as known."
            )
        elif e.status == "at bound":
            reasons.append(
                f"{n} reached its lower limit, 0: these data give no evidence for it (at most {_shown(high, e)})."
            )
        elif e.status == "poorly determined" and low > 0 and high > VAGUE * low:
            no = no or n.startswith(ESSENTIAL)
            reasons.append(f"{n} lies anywhere from {low:.2g} to {_shown(high, e)}: it is not determined.")
        elif e.status == "unseen" and not any(n in sentence for sentence in evidence.unseen):
            no = True
            reasons.append(
                f"{n} has no interval: its standard error came out as zero, as where a motion depends on it without "
                "bound. Start nearer to the truth, or fit a shorter window."
            )
        elif e.status == "poorly determined" and not evidence.nothing:
            reasons.append(f"{n} is known poorly, {low:.2g} to {_shown(high, e)}.")
    open_ = {n for n, e in estimated.items() if not e.status.startswith("well") and not e.status.startswith("rests")}
    reasons += [tie.sentence for tie in evidence.ties if {tie.first, tie.second} & open_]
    for a in evidence.assumptions:
        moved = resting(a)
        if moved:
            verb = "rests" if len(moved) == 1 else "rest"
            reasons.append(f"{', '.join(moved)} {verb} on {a.name} (assumed).")
    reasons += _lumped(evidence.rig)
    guessed = evidence.rig.guessed and not confirmed
    if guessed:
        reasons.append(
            "That the rig is of this kind was guessed from its columns, and no prediction of a run that was not fitted "
            "confirms it: name the plant, or hold a run out."
        )
    if evidence.bent:
        reasons.append(
            f"{', '.join(evidence.bent)}: outside their intervals once the drive may act late, which explains the runs "
            "better; ask for its delay."
        )
    moving = {n: a for a in evidence.assumptions for n in resting(a)}
    free = [n for n in sure if n not in moving and n not in evidence.bent and estimated[n].status == "well determined"]
    widest = max((estimated[n].half for n in free), default=math.inf)
    narrow = f" {'Each' if free[1:] else 'It'} is known to {_share(widest)} or better." if widest < 1 else ""
    known = f"{', '.join(free)}.{narrow}"
    ratios = _ratios(evidence)
    if no:
        answer, headline = "no", "Not all of them are determined."
    elif guessed:
        answer, headline = "in part", f"Only if the rig is the plant that was guessed.{_and(ratios)}"
    elif evidence.bent and not free:
        answer, headline = "no", "No number can be used before the drive's delay is estimated."
    elif reasons:
        answer, headline = "in part", f"These numbers can be used: {known}{_and(ratios)}"
        if not free:
            missing = " and ".join(dict.fromkeys(a.name for n, a in moving.items() if n in sure))
            headline = f"No number can be used before {missing} is measured.{_and(ratios)}"
            if not missing:
                headline = "No number alone, only sums."
    else:
        answer, headline = "yes", f"All numbers can be used: {known}" if sure else "Nothing was estimated."
    if answer == "yes" and sure and untested:
        answer = "in part"
        reasons.append(
            "They rest on no run that was held out: a term that the model lacks would be in one of them, unnoticed."
        )
    advice = ""
    if any(e.status in ("poorly determined", "unseen") for e in estimated.values()):
        advice = "Measure one of the others on the bench and give it as known, or add a run that moves it more."
    return Judgement(question=USABLE, answer=answer, headline=headline, advice=advice, reasons=tuple(reasons))


IDLE = ("known", "assumed", "left out", "nuisance")
"""Statuses of numbers that nobody asked, or that only describe the noise."""

DETERMINED = ("well determined", "rests on", "tied to")
"""Beginnings of the statuses of numbers that the data determine: alone, per an assumed number, or with another."""


def _ratios(evidence: Evidence) -> dict[str, Estimate]:
    """What is known whatever the assumed numbers are, of what the data determine.

    Nothing in SI that rests on a number whose effect nobody evaluated; what is in its own counts does not.
    """
    unevaluated = {a.name for a in evidence.assumptions if any(map(math.isnan, a.follows.values()))}
    return {
        name: e for a in evidence.assumptions for name, e in a.ratios.items()
        if e.status.startswith(DETERMINED) and e.half < 1
        and (name.partition("/")[0] in a.without or unevaluated.isdisjoint(e.rests_on))
    }  # fmt: skip


def _and(ratios: Mapping[str, Estimate]) -> str:
    """A sentence of the ratios that are known, each with its interval."""
    if not ratios:
        return ""
    return f" Known all the same: {'; '.join(f'{n} = {_with_interval(e)}' for n, e in ratios.items())}."


def _with_interval(e: Estimate) -> str:
    digits = figures(e.value, e.half * abs(e.value) / 2)
    value, low, high = (f"{v:.{digits}g}" for v in (e.value, *e.interval))
    return f"{value} ({low} to {high}) {e.unit}".removesuffix(" 1").rstrip()


def _share(half: float) -> str:
    """Half an interval relative to its value, rounded up to two figures."""
    percent = 100 * half
    step = 10.0 ** (math.floor(math.log10(percent)) - 1) if percent > 0 else 1.0
    return f"{math.ceil(percent / step - 1e-9) * step:.2g} %"


def _vanished(rig: GreyBox, name: str, e: Estimate) -> bool:
    """Whether a mass, inertia, length or gain that cannot be zero was driven there."""
    guess = rig.parameters[name].value if name in rig.parameters else 0.0
    return name.startswith(("m_", "J_", "l_", "actuator.gain")) and 0 < abs(e.value) < VANISHED * abs(guess)


def _lumped(rig: GreyBox) -> list[str]:
    """Numbers that stand for something else than their name, because another was set to zero."""
    p = rig.parameters
    if {"l_cg", "J_p"} <= p.keys() and p["l_cg"].estimate and not p["J_p"].estimate and p["J_p"].value == 0:
        return ["l_cg is the length of the equivalent point pendulum, J_A/(m_p l_cg), because J_p was set to 0."]
    return []


def _loop(evidence: Evidence, *, supported: bool) -> Judgement:
    s = evidence.standing
    if evidence.lost:
        return Judgement(question=LOOP, answer="not tested", headline="Not evaluated: the fit failed.")
    if s is None and evidence.unseen:
        return Judgement(
            question=LOOP, answer="not tested",
            headline="Not evaluated: the poles rest on numbers that these data cannot see.",
        )  # fmt: skip
    if s is None:
        return Judgement(
            question=LOOP, answer="not asked",
            headline="No equilibrium of this plant is unstable, or no drive acts on it.",
        )  # fmt: skip
    if s.growth.rests_on:
        on = s.growth.rests_on
        return Judgement(
            question=LOOP, answer="not tested",
            headline=f"{s.at.capitalize()}, the fastest pole is not known: it rests on {', '.join(on)} (assumed).",
            advice=f"Measure {'it' if len(on) == 1 else 'them'} before a loop is designed.", rests_on=on,
        )  # fmt: skip
    grows, digits = s.growth, figures(s.growth.value, s.growth.stderr)
    value, low, high = (f"{v:#.{digits}g}".rstrip(".") for v in (grows.value, *grows.interval))
    where = f"{s.at}, the fastest pole is {value} 1/s ({low} to {high})"
    if not evidence.driven:
        return Judgement(
            question=LOOP, answer="not tested",
            headline=f"{where[0].upper()}{where[1:]}; no fitted run was driven, so what the drive does is not known.",
            advice="Add a run in which the drive acts, and identify again.",
        )  # fmt: skip
    half = (s.growth.interval[1] - s.growth.interval[0]) / 2 / s.growth.value
    held = f"a loop with poles as fast as that stabilises {in_percent(s.share)} of the rigs within the intervals"
    if not supported:
        held = (
            f"how many of the rigs within the intervals a loop with poles as fast as that stabilises is {NOT_SUPPORTED}"
        )
    answer = "no"
    if half <= NARROW and s.share >= SURE:
        answer = "yes"
    elif half <= SOME and s.share >= LIKELY:
        answer = "in part"
    doubted = any(not a for a in (evidence.converged, not evidence.interrupted))
    return Judgement(
        question=LOOP, answer="no" if doubted else answer,
        headline=f"{where[0].upper()}{where[1:]}; {held}.",
        advice="" if answer == "yes" else "Narrow the numbers above before a loop is closed.",
        reasons=("To first order, and without friction that differs by the day: `upright regulate` runs such rigs.",),
    )  # fmt: skip


def _shown(value: float, e: Estimate) -> str:
    return f"{value:.2g} {e.unit}".removesuffix(" 1").rstrip()


def _percents(runs: Mapping[str, RunScore], role: str) -> dict[str, float]:
    """Fit percent by run and signal, of what a filter predicts as far ahead as it is judged."""
    return {
        f"{label} {signal}": percent
        for label, s in runs.items()
        if s.role == role
        for signal, percent in s.fit_percent.items()
    }


def _beside(runs: Mapping[str, RunScore]) -> str:
    """What holding the measured speed and a black box reach of the runs that are predicted."""
    parts: list[str] = []
    for what, reached in (
        ("holding the measured speed", lambda s: s.naive),
        ("black-box (ARX) baseline", lambda s: s.black_box),
    ):
        percents = {
            f"{label} {n}": p for label, s in runs.items() if s.role == "predict" for n, p in reached(s).items()
        }
        if percents:
            parts.append(f"{what}: {_range({n: max(p, 0.0) for n, p in percents.items()})}")
    return f" ({'; '.join(parts)})" if parts else ""


def _beaten(runs: Mapping[str, RunScore]) -> list[str]:
    """Predicted signals that the black box predicts clearly better."""
    return [
        f"{label} {signal} {percent:.1f} %"
        for label, s in runs.items()
        for signal, percent in s.black_box.items()
        if percent > s.fit_percent[signal] + MARGIN
    ]


def uninformative(runs: Mapping[str, RunScore]) -> list[tuple[str, str]]:
    """Runs and signals whose horizon is so short that a held speed predicts them as well as the model.

    A model that explains nothing is no proof of a short horizon.
    """
    return [
        (label, signal)
        for label, s in runs.items()
        for signal, percent in s.naive.items()
        if percent >= GOOD and percent >= s.fit_percent[signal] - MARGIN
    ]


def _range(percents: Mapping[str, float]) -> str:
    low, high = (f"{p:.1f}" for p in (min(percents.values()), max(percents.values())))
    return f"{low} %" if low == high else f"{low} to {high} %"


def _ranges(runs: Mapping[str, RunScore], role: str, without: Collection[str] = ()) -> str:
    """Ranges of the fit percents of runs with a role, those of free runs and of every horizon by themselves.

    `without` some signals, unless these are all.
    """
    kinds: dict[float, dict[str, float]] = {}
    for label, s in runs.items():
        if s.role == role:
            every = {f"{label} {signal}": p for signal, p in s.fit_percent.items()}
            percents = {what: p for what, p in every.items() if what not in without} or every
            kinds.setdefault(s.horizon or 0.0, {}).update(percents)
    free = "" if len(kinds) == 1 else " in free runs"
    return " and ".join(
        f"{_range(percents)}{f' {_seconds(horizon)} ahead' if horizon else free}"
        for horizon, percents in sorted(kinds.items()) if percents
    )  # fmt: skip


def _seconds(horizon: float) -> str:
    return f"{1e3 * horizon:.3g} ms" if horizon < 0.3 else f"{horizon:.3g} s"


def _worse(runs: Mapping[str, RunScore]) -> dict[str, float]:
    """Fit percents of predicted signals far behind the worst fitted one that was simulated as far ahead."""
    least: dict[tuple[str, float | None], float] = {}
    for s in runs.values():
        if s.role == "fit":
            for signal, percent in s.fit_percent.items():
                key = signal, s.horizon
                least[key] = min(percent, least.get(key, 100.0))
    return {
        f"{label} {signal}": percent
        for label, s in runs.items()
        if s.role == "predict"
        for signal, percent in s.fit_percent.items()
        if percent < least.get((signal, s.horizon), GOOD) - DROP and percent < GOOD
    }


def _nearly_still(runs: Mapping[str, RunScore]) -> list[str]:
    """Predicted signals that move little beside the fitted ones, and are missed by little beside these."""
    most: dict[str, float] = {}
    for s in runs.values():
        if s.role == "fit":
            most |= {signal: max(moved, most.get(signal, 0.0)) for signal, moved in s.moved.items()}
    out: list[str] = []
    for label, s in runs.items():
        for signal, percent in s.fit_percent.items() if s.role == "predict" else ():
            share = s.moved.get(signal, 0.0) / most.get(signal, math.inf) if most.get(signal) else math.inf
            small = share <= STILL and (100 - percent) * share <= 100 - GOOD
            if percent < GOOD and small and s.inside.get(signal, 100.0) >= MOSTLY:
                out.append(f"{label} {signal}")
    return out


def _foretold(runs: Mapping[str, RunScore]) -> list[str]:
    """Predicted signals that fall short as far as their bands said: uncertain, and not refuted."""
    expected = _expected(runs)
    return [
        f"{label} {signal}"
        for label, s in runs.items()
        if s.role == "predict"
        for signal, inside in s.inside.items()
        if HALF <= s.fit_percent[signal] < GOOD and inside >= FEWEST and expected.get(f"{label} {signal}", GOOD) < GOOD
    ]


def _expected(runs: Mapping[str, RunScore]) -> dict[str, float]:
    """Fit percents that the bands of predicted signals lead to expect."""
    return {
        f"{label} {signal}": p for label, s in runs.items() if s.role == "predict" for signal, p in s.expected.items()
    }
