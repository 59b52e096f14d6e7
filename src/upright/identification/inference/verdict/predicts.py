"""Does the model predict? Runs that were fitted, and those that it has not seen, by how far they are met."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

from upright.identification.inference.ceiling import ENOUGH, Judged
from upright.identification.inference.verdict.evidence import PREDICTS, Evidence
from upright.identification.model.fit import Judgement, RunScore

GOOD = 80.0
"""Fit percent below which a run counts as not explained."""

OWN = math.sqrt((100 - GOOD) ** 2 - (100 - ENOUGH) ** 2)
"""Percent of a signal that a model may miss by itself where the start state allows `ENOUGH`: `GOOD` is then reached."""

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
that their models lack one signal in eighteen had fewer than this (`python -m benchmarks bands`).
"""


def predicts(evidence: Evidence) -> Judgement:
    """The answer, with what speaks against the model first."""
    against: list[str] = []
    if evidence.lost:
        against.append(_failure(evidence.lost))
    if evidence.interrupted:
        against.append("The search was interrupted; this is its best so far.")
    elif not evidence.converged and not evidence.lost:
        against.append("The search had not settled when its evaluations ran out.")
    fitted, predicted = (_percents(evidence.runs, role) for role in ("fit", "predict"))
    least = _least(evidence.runs)
    poor = {what: p for what, p in fitted.items() if p < least[what]}
    if poor:
        against.append(f"The fitted runs are not explained ({_below(poor, least)}).")
    still = _nearly_still(evidence.runs)
    spared = {*still, *_foretold(evidence.runs)}
    worse = [f"{what} {p:.1f} %" for what, p in _worse(evidence.runs).items() if what not in spared]
    if worse:
        against.append(f"Runs that were not fitted are predicted much worse than fitted ones ({', '.join(worse)}).")
    bad = {what: p for what, p in predicted.items() if p < least[what] and what not in spared}
    if bad and not worse:
        against.append(f"Runs that were not fitted are not predicted ({_below(bad, least)}).")
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
    if evidence.refitted:
        notes.append(
            f"Fitted too, once a fit of the other runs had predicted this: {', '.join(evidence.refitted)}. The other "
            "runs left a number undetermined; the numbers are now those of all runs."
        )
    if evidence.memory > 0.05 * evidence.period and fitted:
        notes.append(
            f"The residuals are autocorrelated over about {evidence.memory:.2g} s, so a small effect is unmodelled. "
            "The intervals include this correlation and the spread between parts of the runs, but not a wrong "
            "structure of the model."
        )
    if against:
        return Judgement(
            question=PREDICTS, answer="no", headline=f"{explains}It is not shown to predict.",
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
    vague = {what: p for what, p in _expected(evidence.runs).items() if p < least.get(what, GOOD)}
    if vague and not still:
        notes.append(
            f"The numbers are so uncertain that no more can be expected of such runs ({_below(vague, least)}), however "
            "well these were met: fit longer ones, or with more in them."
        )
    if still:
        notes.append(
            f"Too little moved to test the model: {', '.join(still)} went at most {STILL:g} times as far as in the "
            f"fitted runs, and was missed by less than {100 - GOOD:.0f} % of that. Hold a run out that moves more."
        )
    near = evidence.judged is not None and not _tested(evidence.judged, evidence.runs)
    part = "in part" if blank or narrow or vague or still or near or evidence.missing else "yes"
    far = f" Outside what the fit has seen: {', '.join(outside)}." if outside else ""
    also = " These were then fitted too." if evidence.refitted else ""
    headline = (
        f"{explains}It predicts {_ranges(evidence.runs, 'predict', still)} of runs it has not seen"
        f"{_beside(evidence.runs)}.{far}{also}"
    )
    beaten = _beaten(evidence.runs)
    if beaten:
        notes.append(
            f"A black-box (ARX) baseline, fitted to the same runs, predicts better ({', '.join(beaten)}), so the "
            "model misses something that these data show."
        )
    return Judgement(question=PREDICTS, answer=part, headline=headline, reasons=tuple(notes))


def _least(runs: Mapping[str, RunScore]) -> dict[str, float]:
    """Fit percents that count as explained: less than `GOOD` by what a start state costs beyond what `ENOUGH` allows.

    What the model misses by itself and what the start state leaves unknown have nothing to do with one another, so
    their variances add up.
    """
    return {
        f"{label} {signal}": GOOD if allowed >= ENOUGH else max(HALF, 100 - math.hypot(OWN, 100 - allowed))
        for label, s in runs.items()
        for signal in s.fit_percent
        for allowed in [_allowed(s).get(signal, 100.0)]
    }


def _allowed(s: RunScore) -> Mapping[str, float]:
    """Fit percents that the start state allows as far ahead as a run is judged."""
    return {} if s.horizon is None else s.ceiling.get(s.horizon, {})


def _below(percents: Mapping[str, float], least: Mapping[str, float]) -> str:
    """What falls short, and of what."""
    kinds: dict[str, list[str]] = {}
    for what, p in percents.items():
        kinds.setdefault(f"{least.get(what, GOOD):.0f}", []).append(f"{what} {p:.1f} %")
    return "; ".join(f"{', '.join(those)}; {of} % is the least" for of, those in kinds.items())


def _tested(judged: Judged, runs: Mapping[str, RunScore]) -> bool:
    """Whether the start state allows enough of every fitted signal as far ahead as it is judged."""
    return all(
        p >= ENOUGH for s in runs.values() if s.role == "fit" for p in s.ceiling.get(judged.seconds, {}).values()
    )


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
    ms = _seconds(judged.seconds)
    falls = "" if not judged.growth else f": the plant falls by e in {1e3 / judged.growth:.2g} ms"
    if not _tested(judged, runs):
        return [
            f"No horizon tests this model{falls}, and already {ms} ahead the start state, known no better than the "
            f"sensors allow, limits any model to {min(allowed[judged.seconds]):.0f} %. Let it move more, or measure it "
            "finer."
        ]
    little = ", ".join(
        f"{label} {signal} {p:.0f} %"
        for label, s in runs.items()
        for signal, p in _allowed(s).items()
        if p < ENOUGH and s.role == "predict"
    )
    notes: list[str] = []
    if little:
        notes.append(
            f"Less moved in runs that were not fitted, and {ms} ahead the start state, known no better than the "
            f"sensors allow, limits any model there ({little}): they are judged by what is missed beyond."
        )
    further = [h for h in allowed if h > judged.seconds * (1 + 1e-9)]
    if further:
        h = max(further)
        notes.append(
            f"It is judged {ms} ahead{falls}, and further on any model misses by what its start state is unknown: at "
            f"{_seconds(h)} that allows {min(allowed[h]):.0f} %, and {min(reached[h]):.0f} % are reached."
        )
    return notes


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
    enough = _least(runs)
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
        if percent < least.get((signal, s.horizon), GOOD) - DROP and percent < enough[f"{label} {signal}"]
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
