"""A fit as a chapter: the question, how the runs are followed, which numbers came out and what they are worth."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from upright.errors import ImpossiblePhysics
from upright.identification.inference.assumptions import assumption_sentences
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.model.fit import Fit, RunScore
from upright.identification.model.runs import SPREADS
from upright.physics import Plant
from upright.report.fit.equations import equations
from upright.report.fit.figures import (
    autocorrelation,
    autocorrelation_figure,
    correlation_figure,
    directions_figure,
    fit_figure,
    interval_figure,
    path_figure,
)
from upright.report.fit.interactive import path_traces, score_traces, search_path
from upright.report.fit.tables import (
    cross_table,
    finding,
    parameter_table,
    pole_table,
    ratio_table,
    run_table,
    score_table,
)
from upright.report.interactive.traces import ROOM
from upright.report.page import (
    Assessment,
    Block,
    Chapter,
    Facts,
    Formula,
    KeyNumber,
    Part,
    Picture,
    Points,
    Step,
    Symbol,
    Table,
)
from upright.report.planes import fitted_poles_chart
from upright.report.rig import rig_drawing
from upright.report.symbols import percent, plain

_HELD = (
    "Held speed: what holding the measured speed from the same restarts predicts, without any model. Where it is as "
    "good as the fit, the horizon tells nothing about the model."
)


def chapter(
    fit: Fit,
    *,
    title: str = "Identification",
    provenance: Mapping[str, object] | None = None,
    study: str = "STUDY.toml",
    folder: str = "OUT",
    crossed: CrossValidation | None = None,
    windows: Sequence[str] = (),
) -> Chapter:
    """What a fit says.

    Parameters
    ----------
    provenance : mapping, optional
        Where the data came from: file, window, hash by run; texts, lists or further mappings.
    study, folder : str
        Study and folder of the results, as the commands that are proposed name them.
    crossed : CrossValidation, optional
        Every run predicted by the others.
    windows : sequence of str
        How much of each log counts, in sentences.
    """
    used = (Points(tuple(windows)),) if windows else ()
    pictures = run_pictures(fit, "fit")
    return Chapter(
        title=title,
        verdict=headline(fit),
        detail=" ".join([*(a.headline for a in fit.answers), *assumption_sentences(fit.assumptions)]) or fit.verdict,
        sound=fit.trusted,
        question=question(fit),
        assessments=tuple(
            Assessment(question=a.question, state=_STATES[a.answer], why=a.headline) for a in fit.answers
        ),
        drawing=_drawing(fit),
        best=_best(fit, pictures),
        findings=tuple(_findings(fit)),
        parts=(
            *_parameters(fit),
            Part(title="Fit of the runs", key="fit", content=(*used, *_scores(fit, crossed), *pictures)),
            *_verdict(fit),
            _residuals(fit),
            _unseen(fit),
            motion_part(fit),
            *_search(fit),
            data_part(provenance or {}),
        ),
        warnings=fit.warnings,
        steps=tuple(fit_steps(fit, study=study, folder=folder, crossed=crossed is not None)),
    )


_STATES = {"yes": "supported", "in part": "in part", "no": "not supported"} | {
    w: w for w in ("not tested", "not asked")
}


def _drawing(fit: Fit) -> Picture | None:
    """The rig as estimated, where its numbers are those of a rig."""
    if fit.failed:
        return None
    try:
        return rig_drawing(fit.plant)
    except ImpossiblePhysics:
        return None


def _best(fit: Fit, pictures: Sequence[Picture]) -> str:
    """The run that tests the model, where one does: pictures begin with the fitted ones."""
    fitted = sum(s.role == "fit" for s in fit.runs.values())
    return pictures[fitted if fitted < len(pictures) else 0].name if pictures else ""


def _findings(fit: Fit) -> Iterator[KeyNumber]:
    """The pole that a loop has to master, then what was estimated, inertias and lengths before friction."""
    poles = [p.real for p in fit.poles.get("inverted", ()) if p.real.value > 0]
    fastest = max(poles, key=lambda e: e.value, default=None)
    if fastest is not None and not fastest.rests_on:
        yield finding("unstable pole", fastest, meaning="upright")
    about = fit.model.parameters
    estimates = [(n, e) for n, e in fit.estimates.items() if e.status not in ("known", "nuisance", "left out")]
    for name, e in sorted(estimates, key=lambda item: item[0].startswith(("b_", "delta_", "v_"))):
        yield finding(Symbol(name), e, meaning=about[name].meaning if name in about else "")


def headline(fit: Fit) -> str:
    """The verdict in a sentence."""
    if fit.interrupted:
        return "Do not rely on this model yet: the search was interrupted, and this is its best so far."
    if fit.failed:
        return "The fit failed: the simulated motion grows beyond all bounds, so its numbers mean nothing."
    if not fit.trusted:
        return "Do not rely on this model yet."
    answers = [a.answer for a in fit.answers]
    loop = answers[-1] if len(answers) > 1 else "yes"
    if answers[:1] == ["not tested"]:
        return "Not tested: it explains the runs that it was fitted to, and none was held out."
    if loop == "yes":
        return "Rely on this model for prediction and for a loop."
    driven = {"not tested": "; its drive has not been tested", "no": ", not for a loop", "in part": ""}.get(loop, "")
    return f"Rely on this model for prediction{driven}."


def _verdict(fit: Fit) -> Iterator[Part]:
    """The answers with what to do and why."""
    if fit.answers:
        rows = tuple((a.question, a.answer, a.advice, " ".join(a.reasons)) for a in fit.answers)
        headings = ("question", "answer", "what to do", "why")
        table = Table(caption="What the fit is good for", headings=headings, rows=rows, badge=1)
        yield Part(title="What the verdict rests on", key="verdict", content=(table,), folded=True)


def question(fit: Fit) -> str:
    """The question of a fit, in a sentence."""
    fitted = sum(s.role == "fit" for s in fit.runs.values())
    predicted = len(fit.runs) - fitted
    runs = f"{fitted} run{'s' if fitted != 1 else ''}"
    estimated = ", ".join(fit.model.estimated) or "no parameter"
    held = f", and does the model then predict {predicted} more that it has not seen?" if predicted else "?"
    return (
        f"Which values of {estimated} let the equations of motion of '{fit.model.plant.__name__}' follow {runs}{held}"
    )


def data_part(provenance: Mapping[str, object]) -> Part:
    """Where the data came from."""
    origin: Block = Facts(tuple(_origin(provenance))) if provenance else "No origin was stated for these data."
    return Part(title="Where the data come from", key="data", content=(origin,), aside=True)


def _origin(provenance: Mapping[str, object], above: str = "") -> list[tuple[str, str]]:
    """What is known about the origin, nested mappings written out: ``runs / decay / file``."""
    rows: list[tuple[str, str]] = []
    for key, value in provenance.items():
        name = f"{above} / {key}" if above else str(key)
        if isinstance(value, Mapping):
            rows += _origin({str(k): v for k, v in value.items()}, name)
        elif isinstance(value, list | tuple | set | frozenset):
            rows.append((name, "; ".join(str(v) for v in value)))
        elif value is not None and value != "":
            rows.append((name, str(value)))
    return rows


def motion_part(fit: Fit) -> Part:
    """Equations of motion with the terms that this fit used."""
    plant, parameters = fit.model.plant, fit.model.parameters
    zero = {n for n, p in parameters.items() if not p.estimate and p.value == 0}
    for name in set(plant.names()) - parameters.keys():
        q = plant.quantity(name)
        if q.lower <= 0 <= q.upper and not q.open_lower:
            zero.add(name)
    derived = (
        f"Derived from the kinetic and potential energy of {plant.__name__}; terms whose parameter is zero in this fit "
        "are left out."
    )
    return Part(
        title="Equations of motion",
        key="motion",
        content=(derived, Formula(markup=equations(plant, zero=zero))),
        folded=True,
    )


def _scores(fit: Fit, crossed: CrossValidation | None) -> list[Block]:
    blocks: list[Block] = [score_table(fit.runs)] if fit.runs else ["No run was scored."]
    if any(score.naive for score in fit.runs.values()):
        blocks.append(_HELD)
    if crossed is not None:
        blocks.append(cross_table(crossed))
        if crossed.interrupted:
            blocks.append(Points(("Interrupted: runs without a prediction were not reached.",)))
    return blocks


def run_pictures(fit: Fit, prefix: str) -> list[Picture]:
    """Data against model, run by run, fitted runs first."""
    return score_pictures(fit.runs, fit.model.plant, prefix)


def score_pictures(scores: Mapping[str, RunScore], plant: type[Plant], prefix: str) -> list[Picture]:
    """Data against model, run by run, fitted runs first, predicted ones with their bands."""
    pictures: list[Picture] = []
    runs = sorted(scores.items(), key=lambda item: item[1].role != "fit")
    signals = sum(len(score.measured) for _, score in runs)
    buckets = max(100, min(450, 6000 // max(signals, 1)))  # keeps the page below 2 MB whatever the number of runs
    for i, (label, score) in enumerate(runs):
        what = "fitted" if score.role == "fit" else "predicted, not fitted"
        how = "" if score.horizon is None else f", restarted from the measured state every {score.horizon:g} s"
        how = f", every sample predicted {score.horizon:g} s ahead" if score.ahead else how
        how += f", scored from {score.score_from:g} s on" if score.score_from > 0 else ""
        fits = ", ".join(f"{plain(n)} {percent(v)}" for n, v in score.fit_percent.items())
        title = f"{label} ({what})"
        pictures.append(
            Picture(
                name=f"{prefix}-run{i}",
                draw=lambda score=score, title=title: fit_figure(score, plant, title=title, buckets=buckets),
                interactive=lambda score=score, title=title: score_traces(
                    {"model": score}, plant, name=title, room=ROOM // len(runs)
                ),
                caption=f"Run '{label}', {what}{how}. Wide light line: measured; thin line: model; "
                f"below each, their difference.{_banded(score)}",
                description=f"Measured and modelled signals over {score.t[-1] - score.t[0]:.3g} s; fit {fits}.",
            )
        )
    return pictures


def _banded(score: RunScore) -> str:
    if not score.band:
        return ""
    inside = ", ".join(f"{plain(n)} {percent(v)}" for n, v in score.inside.items())
    return f" Grey: the band that should hold 90 % of the samples; inside are {inside}."


def _parameters(fit: Fit) -> list[Part]:
    table = parameter_table(fit)
    parts = [
        Part(title="Parameters", key="parameters", content=(table if table.rows else "No parameter was estimated.",))
    ]
    ratios, own, poles = ratio_table(fit), run_table(fit), pole_table(fit)
    if fit.assumptions:
        content = (Points(tuple(assumption_sentences(fit.assumptions))), *((ratios,) if ratios.rows else ()))
        parts.append(Part(title="What rests on assumed numbers", key="assumed", content=content))
    if own.rows:
        parts.append(Part(title="Runs and groups", key="runs", content=(own,), folded=True))
    if poles.rows:
        about = (
            "Of the linear model at each equilibrium, viscous friction and back-EMF included, dry friction not; what "
            "the runs held is held."
        )
        drawn = fitted_poles_chart(fit.poles).picture(
            "fit-poles",
            caption="Poles in the upper half of the s-plane, with bars for the 95 % intervals of real and imaginary "
            "part. Tinted: unstable.",
            description="The same poles as in the table below.",
        )
        parts.append(Part(title="Poles of the fitted rig", key="poles", content=(about, drawn, poles), folded=True))
    return parts


def _residuals(fit: Fit) -> Part:
    shown: tuple[Block, ...] = tuple(rest_picture(fit, "fit")) or ("There is no run to look at.",)
    return Part(title="Residuals", key="residuals", content=shown, folded=True)


def rest_picture(fit: Fit, prefix: str) -> list[Picture]:
    """Autocorrelation of the residuals of all runs, or nothing when there is no run."""
    if not fit.runs:
        return []
    return [
        Picture(
            name=f"{prefix}-rest",
            draw=lambda: autocorrelation_figure(fit.runs),
            caption="Autocorrelation of the residuals. White noise would stay inside the grey band 95 % of the "
            "time; slow waves outside it are motion that the model does not explain.",
            description="One panel per run and signal; correlation from −1 to 1 against lag in seconds.",
        )
    ]


def _unseen(fit: Fit) -> Part:
    """What the data cannot see, with intervals, correlations and directions as far as the fit states them."""
    blocks: list[Block] = [
        Points(fit.unseen) if fit.unseen else "No combination of the estimated parameters is invisible in these runs."
    ]
    if any(e.status != "known" and e.value != 0 for e in fit.estimates.values()):
        blocks.append(
            Picture(
                name="fit-intervals",
                draw=lambda: interval_figure(fit.estimates),
                caption="Interval of every estimate relative to its value. Solid with a disk: well determined. Dashed "
                "with a square: anything else, such as poorly determined or at a bound; an arrow leaves the picture.",
                description="The same intervals as in the table above.",
            )
        )
    n = len(fit.names)
    if 1 < n <= 24 and fit.correlation.shape == (n, n):
        blocks.append(
            Picture(
                name="fit-correlation",
                draw=lambda: correlation_figure(fit),
                caption="Correlation of the estimates. Close to ±1 (bold): the data fix a combination of the two "
                "better than either.",
                description=_strongest(fit),
            )
        )
    if n and n <= 24 and fit.singular_values.size and fit.directions.shape == (fit.singular_values.size, n):
        blocks.append(
            Picture(
                name="fit-directions",
                draw=lambda: directions_figure(fit),
                caption="Singular values of the scaled Jacobian, each with its combination of relative changes in the "
                "parameters. What stands near or left of the dotted line, the data cannot see.",
                description="; ".join(fit.unseen) or "No combination of the parameters is unseen.",
            )
        )
    return Part(title="What the data cannot see", key="unseen", content=tuple(blocks), folded=True)


def _strongest(fit: Fit) -> str:
    off = np.nan_to_num(np.abs(fit.correlation - np.diag(np.diag(fit.correlation))))
    i, j = np.unravel_index(int(np.argmax(off)), off.shape)
    return f"The strongest correlation is {fit.correlation[i, j]:.3f}, between {fit.names[i]} and {fit.names[j]}."


def _search(fit: Fit) -> list[Part]:
    """How the numbers were found."""
    how = f"{fit.method}; {fit.evaluations} evaluations in {fit.seconds:.3g} s; final cost {fit.cost:.6g}."
    content: tuple[Block, ...] = (Points((how,)), *_path_picture(fit))
    parts = [Part(title="How the numbers were found", key="how", content=content, folded=True)]
    if fit.history:
        stages = tuple((stage, f"{cost:.6g}", str(evaluations)) for stage, cost, evaluations in fit.history)
        table = Table(
            caption="What each stage came to", headings=("stage", "cost", "evaluations"), rows=stages, numbers=(1, 2)
        )
        parts.append(Part(title="Stages of the search", key="stages", content=(table,), aside=True))
    return parts


def _path_picture(fit: Fit) -> list[Picture]:
    if len(fit.path) < 3:
        return []
    return [
        Picture(
            name="fit-search",
            draw=lambda: path_figure(*search_path(fit)),
            interactive=lambda: path_traces(fit),
            caption="How the search went: the mean squared residual over the horizon of each stage (1 is how the "
            "signals vary), and every parameter relative to its estimate, after each accepted step. The cost rises "
            "where the horizon grows or another start is tried.",
            description=f"{len(fit.path)} accepted steps; the mean squared residual ends at {fit.path[-1][0]:.3g}.",
        )
    ]


FOLLOWED = 80.0
"""Fit percent below which a free run counts as lost."""


def fit_steps(fit: Fit, *, study: str = "STUDY.toml", folder: str = "OUT", crossed: bool = False) -> Iterator[Step]:
    """Steps in order of weight: what would make the model wrong first, what would make it better last.

    `crossed` says that every run was predicted by the others already.
    """
    if fit.failed:
        yield Step(
            "Nothing else is known before the simulated motion stays finite: check the plant and the signs and "
            "units of drive and sensors, and fit from measured states, a short time ahead.",
            '[[runs]]\nhorizon = "0.5 s"',
        )
        return
    loop = fit.answers[-1] if fit.answers else None
    if loop and fit.trusted and loop.answer == "not tested" and loop.advice:
        yield Step(loop.advice)
    yield from (*_broken(fit), *_blind(fit), *_nuisances(fit), *_friction(fit, study, folder), *_stopped(fit))
    untested = "Every run was fitted, so nothing tests the model yet; "
    if not (crossed or fit.interrupted) and all(s.role == "fit" for s in fit.runs.values()):
        if len(fit.runs) > 1:
            each = f"upright identify {study} -o {folder} --hold-out each"
            yield Step(f"{untested}predict each from a fit of the others.", each)
        else:
            yield Step(f"{untested}keep one run or one tail back.", '[[runs]]\nlabel = "tail"\nrole = "predict"')
    yield Step(
        "See whether the model predicts a run it has not met: name that run in a study of its own.",
        f"upright predict {folder}/fit.json OTHER.toml",
    )


def _broken(fit: Fit) -> Iterator[Step]:
    if fit.interrupted:
        yield Step("The search was stopped; these are its best values so far. Run it to its end.")
    for name in dict.fromkeys(n for s in fit.runs.values() for n in s.fit_percent):
        missed = {label: s.fit_percent[name] for label, s in fit.runs.items() if s.fit_percent.get(name, 0.0) < 0}
        if missed:
            runs = ", ".join(f"'{label}' {percent(value)}" for label, value in missed.items())
            yield Step(f"{plain(name)} is explained worse than by its mean ({runs}){_so_far_off(missed.values())}",
                       f"[sensors.{name}]\nsign = -1")  # fmt: skip
    lost = [
        label
        for label, s in fit.runs.items()
        if s.role == "fit" and s.horizon is None and any(v < FOLLOWED for v in s.fit_percent.values())
    ]
    if lost:
        yield Step(
            f"The simulation of run {', '.join(map(repr, lost))} loses the measurement. If the figure shows that it "
            "followed at first, end the window there, or restart it from measured states.",
            '[[runs]]\nhorizon = "0.5 s"',
        )


REVERSED = (-160.0, -40.0)
"""Fit percents about -100: of a signal that is the measured one with the other sign, somewhat off."""


def _so_far_off(missed: Collection[float]) -> str:
    """What may be wrong with a signal that is explained worse than by its mean."""
    if all(REVERSED[0] < value < REVERSED[1] for value in missed):
        return ", as by a reversed sign. Where the study says sign = -1 already, take that out."
    return ": look at the plant and at the units of its columns first, then at the sign."


def _stopped(fit: Fit) -> Iterator[Step]:
    stopped = [n for n, e in fit.estimates.items() if e.status == "at bound"]
    none = [n for n in stopped if fit.estimates[n].value == 0]
    if none:
        yield Step(f"These runs need no {', '.join(none)}: the estimate ended at zero; leave it out.")
    for name in stopped:
        if name not in none:
            yield Step(f"{name} stopped at its bound; widen the bound or give its value as known.")


def _blind(fit: Fit) -> Iterator[Step]:
    yield from map(Step, fit.unseen)
    weak = [n for n, e in fit.estimates.items() if e.status in ("poorly determined", "unseen")]
    if weak and not fit.unseen:
        yield Step(
            f"The data hardly see {', '.join(weak)}: measure one of them on the bench and give it as known, or add a "
            "run that moves it more.",
            f'{weak[0]} = {{ value = "…", uncertainty = "…" }}',
        )


def _nuisances(fit: Fit) -> Iterator[Step]:
    """What differs from run to run: useless factors, and predictions that chose their own."""
    homes = {f"group {group}": own for group, own in fit.groups.items()} | dict(fit.per_run)
    idle = [f"{n} of {home}" for home, own in homes.items() for n, e in own.items() if e.status == "unseen"]
    if idle:
        yield Step(f"The runs say nothing about {', '.join(idle)}: leave it out of unknown or shared.")
    for label, score in fit.runs.items():
        chosen = [n for n in score.adapted if n.partition(".")[0] in SPREADS]
        if chosen and score.role != "fit":
            yield Step(
                f"The prediction of run '{label}' chose its own {' and '.join(chosen)}, so it proves less; let the run "
                "share that with runs that are fitted.",
                f'[[runs]]\nlabel = "{label}"\nshared = {{ {chosen[0]} = "that day" }}',
            )
            break  # one example is enough
    for label, score in fit.runs.items():
        if score.offer is not None:
            own = ", ".join(f'"{n}"' for n in dict.fromkeys([*score.adapted, score.offer.name]))
            yield Step(
                score.offer.sentence(label, score.fit_percent), f'[[runs]]\nlabel = "{label}"\nunknown = [{own}]'
            )


def _friction(fit: Fit, study: str, folder: str) -> Iterator[Step]:
    """Autocorrelated residuals: is there a friction term that was left out?"""
    coloured: list[str] = []
    for label, score in fit.runs.items():
        for j, name in enumerate(score.measured):
            rest = score.y[:, j] - score.simulated[:, j]
            rest = rest[np.isfinite(rest)]
            lags = max(1, rest.size // 10)
            if rest.size < 20 or score.role != "fit":
                continue
            r = autocorrelation(rest, lags)[1:]
            if np.mean(np.abs(r) > 1.96 / math.sqrt(rest.size)) > 0.3:
                coloured.append(f"{plain(name)} of '{label}'")
    fixed = {
        name: f"{term} of {joint.on} ({name})"
        for joint in fit.model.plant.joints
        for term, name in (("Coulomb friction", joint.coulomb), ("quadratic drag", joint.quadratic))
        if name and name not in fit.model.estimated and joint.on not in _prescribed(fit)
    }
    if coloured and fixed:
        others = " and others" if coloured[3:] else ""
        yield Step(
            f"What is left over is not noise ({', '.join(coloured[:3])}{others}). Not estimated so far: "
            f"{'; '.join(fixed.values())}. Give them guesses; the ladder keeps those with which held-out data are "
            "predicted better.",
            f'[parameters]\n{next(iter(fixed))} = {{ guess = "…", min = 0 }}\n\nupright ladder {study} -o {folder}',
        )


def _prescribed(fit: Fit) -> set[str]:
    """Coordinates whose motion every fitted run was given: whatever rubs there, these logs do not show it."""
    fitted = [s for s in fit.runs.values() if s.role == "fit"]
    return set[str]().union(*(s.measured for s in fitted)) - {n for s in fitted for n in s.fit_percent}
