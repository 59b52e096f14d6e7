"""How often are a verdict's answers right: against runs, rigs and loops that the fit never saw?

Of each plant 120 rigs of `misfit` are fitted to the first two thirds of a record and predict its last third. One in
four is fitted with too little physics (viscous friction alone, the truth four times as dry), and one in four has a
record of a second and a half. Three answers are checked:

- *Does it predict?* against a whole other record as long, under other commands: 80 % of each signal must be explained
  where the exact motion without the noise would be. Where nothing moves, no model can.
- *Are the numbers right?* A number called usable must lie within its interval or a fifth of the truth. One called
  unusable must not lie within a twentieth.
- *Does it stabilise?* against the plant, upright under the controller that the fit would place.

Of real rigs with three fitted runs or more, all but two runs are fitted, one is predicted, and the last one decides,
where it moves no body that the others held fixed.

Required: a wrong yes in at most 5 of 100 cases, a wrong no in at most 15. "In part" is neither: the model lacks what
its runs show, was not tested by the runs held out, or its own bands allow a larger miss.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, of_each
from benchmarks.misfit import Flaws, moved, read
from benchmarks.real import STUDIES
from benchmarks.rigs import DT, MAKES, Make, asked, command, drawn, logged, publish, sensed
from upright.workers import HERE, Workers

GOOD = 80.0
USEFUL, CLOSE = 0.2, 0.05
"""Shares of the truth within which a number serves, and within which one that was called too poor was not."""

SHORT = 1.5  # s
DRY, DRY_NUMBERS = 4.0, ("b_1c", "b_2c", "f_1c")

Told = list[tuple[str, str, bool]]
"""Question, what was said of it (yes, in part, no), and whether a yes would have been right."""


@dataclass(kw_only=True)
class Case:
    """One rig: its numbers, two records of commands and positions, and what is wrong with the question."""

    make: Make
    truth: dict[str, float]
    records: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list[tuple[np.ndarray, np.ndarray]])
    spoiled: str = ""
    exact: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))


SEED = 450_000
"""Of the first rig. Rules were chosen on 50,000, 150,000, 900,000, 930,000 and what follows these, never on these."""


def cases(make: Make, place: int, count: int) -> list[Case]:
    """Flawed rigs with two records each, `exact` what the second would be without noise."""
    generators = [np.random.default_rng(SEED + 1000 * place + k) for k in range(count)]
    rigs = [drawn(make, g) for g in generators]
    found = [Case(make=make, truth=truth, spoiled=("", "too little asked", "", "short")[k % 4])
             for k, (truth, _) in enumerate(rigs)]  # fmt: skip
    for case in found:
        if case.spoiled == "too little asked":
            case.truth |= {n: DRY * v for n, v in case.truth.items() if n in DRY_NUMBERS}
    flaws = Flaws(count, np.random.default_rng(SEED // 500 + place))
    other = [command(make.force, len(u), g) for (_, u), g in zip(rigs, generators, strict=True)]
    for again, inputs in ((False, [u for _, u in rigs]), (True, other)):
        start = {n: (0.7 if again else 1.0) * v for n, v in make.start.items()}
        u = np.stack([c[:, 0] for c in inputs], axis=1)
        motion = moved(replace(make, start=start), [case.truth for case in found], u, flaws)
        for k, (case, g) in enumerate(zip(found, generators, strict=True)):
            case.exact = read(make, motion[:, :, k], flaws, k)
            y = sensed(make, case.exact, g.uniform(0, 0.95), 0.003, g)
            case.records.append((inputs[k], y))
    return found


def answered(case: Case) -> Told:
    """What was said of one rig, and what came."""
    from upright.identification.estimate import identify, predict
    from upright.identification.inference.loop import driven_plant, placed
    from upright.identification.inference.scoring import fit_percent
    from upright.identification.model.grey_box import base_values

    make = case.make
    (u, y), (u2, y2) = case.records
    length = round(SHORT / DT) if case.spoiled == "short" else len(u)
    cut = 2 * length // 3
    frictionless = DRY_NUMBERS if case.spoiled == "too little asked" else ()
    rig = asked(
        make, {n: 1.3 * v for n, v in case.truth.items() if n not in frictionless},
        {n: 0.0 for n in case.truth if n in frictionless},
    )  # fmt: skip
    fit = identify(rig, [
        logged(make, "seen", "fit", u[:cut], y[:cut]), logged(make, "unseen", "predict", u[cut:length], y[cut:length]),
    ])  # fmt: skip
    predicts, _, loop = fit.answers
    came = predict(fit, rig, [logged(make, "other", "predict", u2[:length], y2[:length])])["other"].fit_percent
    exact = min(fit_percent(y2[:length, k], case.exact[:length, k]) for k in range(y2.shape[1]))
    told: Told = [(predicts.question, predicts.answer, min(came.values()) >= GOOD)] if exact >= GOOD else []
    for n, e in fit.estimates.items():
        if e.status in ("well determined", "poorly determined", "at bound", "unseen"):
            usable = e.status == "well determined" and fit.trusted
            near = abs(e.value / case.truth[n] - 1)
            holds = e.interval[0] <= case.truth[n] <= e.interval[1] or near <= USEFUL
            told.append(("Can its numbers be used?", "yes" if usable else "no", holds if usable else near <= CLOSE))
    if "the fastest pole" in loop.headline:
        at = loop.headline.partition(",")[0].lower()
        values = base_values(rig) | {n: e.value for n, e in fit.estimates.items()}
        A, B = driven_plant(rig, values, at)
        growth = float(np.linalg.eigvals(A).real.max())
        K = placed(A / growth, B[:, 0] / growth, -np.array([1.0, 1.25, 1.5, 1.75]))
        true_A, true_B = driven_plant(rig, base_values(rig) | case.truth | make.known, at)
        stands = K is not None and float(np.linalg.eigvals(true_A - true_B @ K[None, :]).real.max()) < 0
        told.append((loop.question, loop.answer, stands))
    return told


def rehearsed(name: str) -> Told:
    """What was said of a real rig, and what its last run came to."""
    from upright.identification.estimate import identify
    from upright.study.load import load_study

    study = load_study(STUDIES / f"{name}.toml", data=os.environ["UPRIGHT_REAL_DATA"])
    fitted = [run for run in study.runs if run.role == "fit"]
    if len(fitted) < 3:
        return []
    *seen, told, last = fitted
    if not {last.measured[k] for k in last.free} <= {r.measured[k] for r in seen for k in r.free}:
        return []  # a body that no fitted run moves is not promised either
    runs = [*seen, replace(told, role="predict"), replace(last, role="predict", label="what came")]
    fit = identify(study.model, runs[:-1])
    from upright.identification.estimate import predict

    came = predict(fit, study.model, runs[-1:])["what came"]
    worst = min(p for told in (came.fit_percent, *came.ahead.values()) for p in told.values())
    return [("Does it predict? (real rigs)", fit.answers[0].answer, worst >= GOOD)]


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Wrong yes and wrong no by question."""
    every: Told = []

    def lines() -> list[Line]:
        named = [_line(question, [one[1:] for one in every if one[0] == question]) for question in
                 dict.fromkeys(question for question, *_ in every)]  # fmt: skip
        table = [*named, _line("all of them", [one[1:] for one in every])]
        if markdown is not None:  # what is done is kept, should somebody interrupt
            publish(markdown, "verdicts", "Verdicts", __doc__, table, headline(table))
        return table

    for place, make in enumerate(MAKES[: 1 if quick else None]):
        each = 1 if quick else 120
        progress(f"{each} rigs like {make.plant}")
        done, _ = of_each(answered, cases(make, place, each), workers)
        every += [one for told in done for one in told]
        lines()
    if os.environ.get("UPRIGHT_REAL_DATA"):
        from benchmarks.asked import studies

        for name in studies()[: 1 if quick else None]:
            progress(name)
            every += rehearsed(name)
            lines()
    return lines()


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of two questions, their last the line of all."""
    yes, no = (
        {
            line.contender: float(found[1])
            for line in lines
            if (found := re.search(rf"wrong {word} ([\d.]+) %", line.note))
        }
        for word in ("yes", "no")
    )
    predicts, numbers, every = "Does it predict?", "Can its numbers be used?", lines[-1].contender
    parts = [f"{no[q]:.1f} % of *{q}*" for q in (predicts, numbers) if q in no]
    return (
        f'{yes[every]:.1f} % of the answers "yes" were wrong (at most 5 required), and of the answers "no" '
        f"{' and '.join(parts)} (15)."
    )


def _line(question: str, told: list[tuple[str, bool]]) -> Line:
    counts = {
        (said, right): sum(one == (said, right) for one in told)
        for said in ("yes", "in part", "no", "not tested")
        for right in (True, False)
    }
    yes, no = ([right for said, right in told if said == word] for word in ("yes", "no"))
    wrong_yes = 100 * np.mean([not right for right in yes]) if yes else 0.0
    wrong_no = 100 * np.mean(no) if no else 0.0
    said = "; ".join(f'"{word}" {counts[word, True]} right, {counts[word, False]} wrong' for word in ("yes", "in part"))
    note = f'{said}; "no" {counts["no", False]} right, {counts["no", True]} wrong; wrong yes {wrong_yes:.1f} % (5), '
    note += f"wrong no {wrong_no:.1f} % (15)"
    untested = counts["not tested", True] + counts["not tested", False]
    return Line(contender=question, note=note + (f"; not tested {untested}" if untested else ""))
