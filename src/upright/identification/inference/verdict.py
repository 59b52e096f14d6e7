"""The verdict: whether the model is to be trusted, and why, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from upright.identification.model.fit import Estimate, RunScore

GOOD = 80.0
"""Fit percent below which a run counts as not explained."""

DROP = 15.0
"""Percent by which a predicted signal may fall behind the worst fitted one of the same name."""


MARGIN = 2.0
"""Percent by which a model has to beat held speeds for its horizon to tell anything; one step ahead fits anything."""


def judge(
    *,
    runs: Mapping[str, RunScore],
    estimates: Mapping[str, Estimate],
    unseen: Sequence[str],
    conventions: Sequence[str],
    converged: bool,
    interrupted: bool,
    memory: float,
    period: float,
) -> tuple[str, bool]:
    """Verdict and whether the model is trusted.

    Parameters
    ----------
    runs, estimates : mapping
        Scores by run, estimates by name.
    unseen, conventions : sequence of str
        Sentences on what the data cannot see and on signs or zeros that look wrong.
    converged, interrupted : bool
        How the search ended.
    memory, period : float
        Seconds that residuals remember and that the motion takes for one period.
    """
    against: list[str] = []
    if interrupted:
        against.append("the search was interrupted, this is the best so far")
    elif not converged:
        against.append("the search had not settled when its evaluations ran out")
    poor = [
        f"{label} {signal} {percent:.1f} %"
        for label, s in runs.items()
        for signal, percent in s.fit_percent.items()
        if s.role == "fit" and percent < GOOD
    ]
    if poor:
        against.append(f"the fitted runs are not explained ({', '.join(poor)}; {GOOD:.0f} % is the least)")
    worse = _worse(runs)
    if worse:
        against.append(f"runs that were not fitted are predicted much worse than fitted ones ({', '.join(worse)})")
    blank = uninformative(runs)
    if blank and len(blank) == sum(len(s.fit_percent) for s in runs.values()):
        against.append("no run is predicted far enough ahead to test the model")
    if unseen:
        against.append("the data cannot see everything that was asked")
    asked = {n: e for n, e in estimates.items() if e.status in ("firm", "weak", "at bound", "unseen")}
    if asked and not unseen and not any(e.status == "firm" for e in asked.values()):
        against.append("none of the numbers asked is seen well, so others would explain the runs as well")
    stuck = [n for n, e in asked.items() if e.status == "at bound" and e.value != 0]
    if stuck:
        against.append(f"the data would push {', '.join(stuck)} past a bound")
    against += [s[0].lower() + s[1:].rstrip(".") for s in conventions]
    said: list[str] = []
    best = _range(runs, "fit")
    if against:
        said.append(f"Not to be trusted as it stands: {'; '.join(against)}.")
    else:
        said.append("The model can be trusted for motions like these.")
    if best:
        said.append(f"It explains {best} of the fitted runs.")
    ahead = _range(runs, "predict")
    if ahead:
        said.append(f"It predicts {ahead} of runs it has not seen.")
    if blank:
        where = ", ".join(f"{label} {signal} at {runs[label].horizon:g} s" for label, signal in blank)
        said.append(
            f"Some horizons tell nothing, because holding the measured speed predicts as well to within {MARGIN:.0f} % "
            f"({where}); predict further ahead."
        )
    said += unseen
    weak = [n for n, e in estimates.items() if e.status == "weak"]
    if weak:
        said.append(f"Weakly seen, with a wide interval: {', '.join(weak)}.")
    bound = [n for n, e in estimates.items() if e.status == "at bound"]
    if bound:
        said.append(f"At a bound: {', '.join(bound)}; the data would go further or need it less.")
    if memory > 0.05 * period and best:
        said.append(
            f"Residuals remember {memory:.2g} s, so something small is still missing from the model; "
            "the standard errors allow for it."
        )
    return " ".join(said), not against


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


def _range(runs: Mapping[str, RunScore], role: str) -> str:
    percents = [p for s in runs.values() if s.role == role for p in s.fit_percent.values()]
    if not percents:
        return ""
    low, high = min(percents), max(percents)
    return f"{low:.1f} %" if high - low < 0.05 else f"{low:.1f} to {high:.1f} %"


def _worse(runs: Mapping[str, RunScore]) -> list[str]:
    least: dict[str, float] = {}
    for s in runs.values():
        if s.role == "fit":
            for signal, percent in s.fit_percent.items():
                least[signal] = min(percent, least.get(signal, 100.0))
    return [
        f"{label} {signal} {percent:.1f} %"
        for label, s in runs.items()
        if s.role == "predict"
        for signal, percent in s.fit_percent.items()
        if percent < least.get(signal, GOOD) - DROP and percent < GOOD
    ]
