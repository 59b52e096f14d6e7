"""Which numbers can be used? Those that the data determine, alone or per an assumed one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from upright.identification.inference.assumptions import resting
from upright.identification.inference.intervals import VAGUE
from upright.identification.inference.neglected import DELAY, LAG
from upright.identification.inference.verdict.evidence import USABLE, Evidence
from upright.identification.model.fit import Estimate, Judgement
from upright.identification.model.grey_box import GreyBox
from upright.quantities import figures

VANISHED = 1e-6
"""Share of its guess below which a mass has vanished: no guess of a rig's is a million times too large."""

ESSENTIAL = ("J_", "m_", "k_", "l_", "actuator.gain")
"""Numbers without which a model is none: inertias, stiffnesses, lengths, the drive; friction is often vague."""

FELT = 0.1
"""Phase [rad], 6 degrees, that a drive may cost a loop by acting late before it matters."""

IDLE = ("known", "assumed", "left out", "nuisance")
"""Statuses of numbers that nobody asked, or that only describe the noise."""

DETERMINED = ("well determined", "rests on", "tied to")
"""Beginnings of the statuses of numbers that the data determine: alone, per an assumed number, or with another."""


def usable_numbers(evidence: Evidence, *, confirmed: bool, untested: bool) -> Judgement:
    """The answer; whether a prediction `confirmed` the kind of plant, or every run was fitted and it is `untested`."""
    if evidence.lost:
        return Judgement(
            question=USABLE, answer="no",
            headline="None of them: the fit failed, and they are only where its search stopped.",
        )  # fmt: skip
    estimated = {n: e for n, e in evidence.estimates.items() if e.status not in IDLE}
    sure = [n for n, e in estimated.items() if e.status.startswith(DETERMINED)]
    reasons: list[str] = [*evidence.unseen, *filter(None, [evidence.alike])]
    notes: list[str] = []
    negligible: list[str] = []
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
        elif (absent := _negligible(evidence, n, e)) or e.status == "at bound":
            at = f"{n} reached its lower limit, 0" if e.value == 0 else f"{n} is {_shown(e.value, e)} and may be 0"
            remark = f"{at}: these data give no evidence for it (at most {_shown(high, e)})"
            if absent:
                negligible.append(n)
                remark += ", and the other intervals hold what so much of it would change"
            (notes if absent else reasons).append(f"{remark}.")
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
    firm = ("well", "rests")
    open_ = {n for n, e in estimated.items() if n not in negligible and not e.status.startswith(firm)}
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
        answer, headline = "no", "Not all of its numbers are determined."
    elif guessed:
        answer = "in part"
        headline = f"Its numbers can be used only if the rig is the plant that was guessed.{_and(ratios)}"
    elif evidence.bent and not free:
        answer, headline = "no", "No number can be used before the drive's delay is estimated."
    elif reasons:
        answer, headline = "in part", f"These numbers can be used: {known}{_and(ratios)}"
        if not free:
            missing = _missing(evidence, [n for n in sure if n in moving])
            headline = f"No number can be used before {missing} measured.{_and(ratios)}"
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
    if any(e.status in ("poorly determined", "unseen") for n, e in estimated.items() if n not in negligible):
        advice = "Measure one of the others on the bench and give it as known, or add a run that moves it more."
    return Judgement(question=USABLE, answer=answer, headline=headline, advice=advice, reasons=(*reasons, *notes))


def _negligible(evidence: Evidence, name: str, e: Estimate) -> bool:
    """Whether a term that may be absent is none that matters, were it as large as its interval allows.

    The intervals of the others are widened by what it would change. That the data bound it says that it is not felt in
    motions like theirs. A drive that acts late is felt by a loop besides, by the phase that this costs at the rate of
    what the rig does fastest.
    """
    low, high = e.given or e.interval
    lower, upper = evidence.rig.bounds(name) if name in evidence.rig.parameters else (-math.inf, math.inf)
    late, none = name in (DELAY, LAG), e.status == "at bound" and e.value == 0
    absent = none or (late and e.status == "poorly determined" and low <= 0)
    if not absent or lower != 0 or not high < upper or name.startswith(ESSENTIAL):
        return False
    falls = evidence.standing.growth.value if evidence.standing else 0.0
    return not late or high * max(falls, 2 * math.pi / evidence.period) <= FELT


def _missing(evidence: Evidence, names: Sequence[str]) -> str:
    """What has to be measured for the first of these numbers to be usable, with its verb; empty where none rests."""
    needs = dict.fromkeys(tuple(a.name for a in evidence.assumptions if n in resting(a)) for n in names)
    least = [need for need in needs if not any(set(other) < set(need) for other in needs)]
    ways = [" and ".join(filter(None, [", ".join(need[:-1]), need[-1]])) for need in least]
    return f"{' or '.join(ways)} {'are' if len(least[0]) > 1 else 'is'}" if ways else ""


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


def _shown(value: float, e: Estimate) -> str:
    return f"{value:.2g} {e.unit}".removesuffix(" 1").rstrip()
