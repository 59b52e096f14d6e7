"""Fits, a black-box (ARX) baseline and the measured run side by side: `compare`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.handover import SAVED, fitted_of
from upright.verbs.pages import folder_if_given, write_page
from upright.verbs.values import paths

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.identification.model.runs import Run
    from upright.report.fit.compare import ComparedRun, Comparison
    from upright.study.stored_fit import StoredFit
    from upright.verbs.forms import FitLike, StudyLike

LEAD = 0.4
"""Share of a run after which fits may look at it for its start state; from its half on they predict."""


class ComparisonAnswer(Answer["Comparison"]):
    """Fits beside each other."""

    value: Comparison

    @property
    def table(self) -> Any:
        """Fit percents as a `pandas.DataFrame`: a run's signal per row, who predicts per column."""
        import pandas as pd

        rows = {
            (label, signal): {who: score.fit_percent.get(signal) for who, score in run.scores.items()}
            for label, run in self.value.runs.items()
            for signal in next(iter(run.scores.values())).fit_percent
        }
        return pd.DataFrame.from_dict(rows, orient="index")


def _typed(words: dict[str, Any]) -> dict[str, Any]:
    """The last of several paths is the log, unless it is a fit."""
    *fits, last = words["fits"]
    if words.get("log") is None and fits and not _is_fit(Path(last)):
        return {**words, "fits": fits, "log": last}
    return words


def _is_fit(path: Path) -> bool:
    return path.suffix == ".json" or (path.is_dir() and (path / SAVED).exists())


@command(
    "Model",
    metavars={"fits": "FIT... [LOG]", "log": "LOG", "out": "OUT"},
    helps={
        "fits": "fit.json files or their folders; a log or study that comes last is predicted.",
        "out": "Folder for comparison.json and comparison.html.",
    },
    names={"log": "--log"},
    prepare=_typed,
    wrong=lambda answer: not answer.chapter.sound,
    more="""
    upright compare monday-fit friday-fit other_day.csv

    upright compare viscous-fit coulomb-fit OTHER.toml -o compared

    Exit code: 0 a fit predicts unseen runs better than the black-box baseline; 3 none does, or there is no unseen run;
    2 a file is wrong.
    """,
)
@keeps_its_inputs
def compare(
    fits: Sequence[FitLike] | FitLike, log: StudyLike | None = None, *, data: PathLike | None = None,
    out: PathLike | None = None, pdf: bool = False,
) -> ComparisonAnswer:  # fmt: skip
    """Compare fits with each other, with a black-box (ARX) baseline, and on a run that none was fitted to.

    Every fit predicts the second half of each run; a linear difference equation (ARX), fitted to its first half, is
    the baseline that physics must beat. Parameters are listed side by side with their intervals; a two-sided test marks
    those that differ.

    Parameters
    ----------
    fits : sequence of answers of `identify` or paths
        What `identify` answered, fit.json files, or their folders.
    log : path, Study, Record or pandas.DataFrame, optional
        Runs to predict; when omitted, the runs that the fits' studies hold out.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    out : path, optional
        Folder for comparison.json and comparison.html.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    ComparisonAnswer
        ``.table`` (a data frame), ``.agree`` by fit and parameter, ``.plot()``. Its chapter is `sound` when a fit that
        trusts itself predicts an unseen run better than the baseline.

    Raises
    ------
    BadInput
        When a fit or the log cannot be read, or they speak of different plants.
    """
    from upright.files import write_json
    from upright.report.fit.compare import Comparison, chapter
    from upright.report.symbols import typed

    at = folder_if_given(out, pdf)
    sources = paths(fits)
    if not sources or (len(sources) < 2 and log is None):
        raise BadInput(
            "compare takes two fits or more, or one and a log; the call is upright compare OUT/fit.json OTHER/fit.json"
            " LOG"
        )
    names = _names(sources)
    by_name = dict(zip(names, sources, strict=True))
    fitted = {name: fitted_of(source, "compare") for name, source in by_name.items()}
    kinds = {name: f.plant for name, f in fitted.items()}
    if len(set(kinds.values())) > 1:
        named = ", ".join(f"{name} of a '{kind}'" for name, kind in kinds.items())
        raise BadInput(f"compare takes fits of one plant, got {named}; give those of the same plant.")
    runs = _runs(by_name, fitted, log, data)
    parameters = {name: {n: f.estimate(n) for n in f.values} for name, f in fitted.items()}
    compared = Comparison(
        plant=next(iter(fitted.values())).kind,
        runs=runs,
        parameters={name: _compared_names(by, parameters) for name, by in parameters.items()},
        **_agreement(fitted, parameters),
        trusted={name: f.trusted for name, f in fitted.items()},
    )
    typed_paths = [typed(Path(s)) for s in sources if isinstance(s, str | os.PathLike)]
    page = chapter(compared, command=" ".join(["upright compare", *(typed_paths or ["FIT", "FIT"])]))
    if at is None:
        return ComparisonAnswer(compared, page)
    files = [write_json(at / "comparison.json", page.numbers), *write_page(page, at / "comparison.html", pdf)]
    return ComparisonAnswer(compared, page, files)


def _names(sources: Sequence[Any]) -> list[str]:
    """What the fits are called: by their folder, or by their place."""
    names: list[str] = []
    for i, source in enumerate(sources, start=1):
        path = Path(source) if isinstance(source, str | os.PathLike) else None
        named = (path.parent.name if path.name == SAVED else path.stem) if path is not None else ""
        name = named or f"fit {i}"
        names.append(name if name not in names else f"{name} ({i})")
    return names


def _compared_names(by: Mapping[str, Any], every: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Parameters that some fit estimates, or that are given differently."""
    from upright.physics.actuator import ACTUATOR

    out: dict[str, Any] = {}
    for name, e in by.items():
        others = [other[name] for other in every.values() if name in other]
        idle = all(o.value == (ACTUATOR[name].default if name in ACTUATOR else 0.0) for o in others)
        if any(o.status not in ("known", "assumed") for o in others) or (
            not idle and len({o.value for o in others}) > 1
        ):
            out[name] = e
    return out


def _agreement(fitted: Mapping[str, StoredFit], parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Every other fit against the first one."""
    import numpy as np

    from upright.identification.inference.agreement import agreements, together

    (first, one), *rest = fitted.items()
    agree: dict[str, Any] = {}
    joint: dict[str, Any] = {}
    related: list[str] = []
    for name, other in rest:
        beside = [_compared_names(parameters[who], parameters) for who in (first, name)]
        agree[name] = agreements(*beside)
        common = [n for n, a in agree[name].items() if a.word in ("agree", "differ")]
        spread = [_covariance(f, parameters[who], common) for who, f in ((first, one), (name, other))]
        difference = np.array([agree[name][n].difference for n in common])
        if common and (test := together(difference, *spread)) is not None:
            joint[name] = test
        if _logs(one) & _logs(other):
            related.append(name)
    return {"agree": agree, "joint": joint, "related": tuple(related)}


def _covariance(fit: StoredFit, estimates: Mapping[str, Any], common: Sequence[str]) -> Any:
    """Covariance of the common numbers, as wide as their intervals; a given one adds its own variance."""
    import numpy as np

    from upright.identification.inference.agreement import TWO_SIDED
    from upright.identification.problem.normal_equations import correlation

    names, C = fit.covariance(common)
    places, R = [common.index(n) for n in names], np.eye(len(common))
    R[np.ix_(places, places)] = correlation(C)
    ends = ((estimates[n].stderr, estimates[n].interval) for n in common)
    wide = np.array([max(stderr, (high - low) / 2 / TWO_SIDED) for stderr, (low, high) in ends])
    return R * np.outer(wide, wide)


def _logs(fit: StoredFit) -> set[str]:
    """Logs that a fit rests on, by their hashes."""
    import re

    origins: Any = (fit.content.get("provenance") or {}).get("runs") or {}
    return {log for origin in origins.values() for log in re.findall(r"\(sha256 (\w+)\)", str(origin))}


def _runs(
    sources: Mapping[str, Any], fitted: Mapping[str, StoredFit], log: Any, data: PathLike | None
) -> dict[str, ComparedRun]:  # fmt: skip
    """Every run as all predict it."""
    from upright.verbs.model.predict import runs_to_predict

    logs = [log] if log is not None else [s.study for s in sources.values() if hasattr(s, "study")]
    out: dict[str, ComparedRun] = {}
    for each in logs:
        if isinstance(each, str | os.PathLike) and not Path(each).exists():
            raise BadInput(f"the log {each} does not exist; the call is upright compare FIT... LOG")
        models = {name: runs_to_predict(f, each, data)[0] for name, f in fitted.items()}
        first = next(iter(models.values()))
        for place, run in enumerate(first.runs):
            if log is None and run.role != "predict":
                continue
            fitted_by = tuple(
                name for name, f in fitted.items() if f.fitted_run(run.source) or _in_memory(sources[name], run)
            )
            if log is None and fitted_by:
                continue
            label = run.label if run.label not in out else f"{run.label} ({len(out) + 1})"
            out[label] = _compared(models, fitted, place, fitted_by)
    return out


def _compared(
    models: Mapping[str, Any], fitted: Mapping[str, StoredFit], place: int, fitted_by: tuple[str, ...]
) -> ComparedRun:
    """One run, its second half predicted by every fit, and by an equation fitted to its first half."""
    from upright.identification.inference.black_box import black_box_run
    from upright.identification.inference.scoring import predict
    from upright.identification.problem.residuals import formulate
    from upright.report.fit.compare import BLACK_BOX, ComparedRun

    scores: dict[str, Any] = {}
    test = first = None
    for name, study in models.items():
        whole = replace(study.runs[place], role="predict", refit=False)
        first, test = _halves(whole)
        rig = replace(study.model, substeps=fitted[name].substeps)
        f = fitted[name]
        score = predict(f.values, rig, [test], groups=f.groups, bands=f.bands)[test.label]
        scores[name] = _only_scored(score, test)
        if first is not None and BLACK_BOX not in scores:
            period = min(t.period for t in formulate(rig, [whole]).tracks)
            base = black_box_run(first, test, period)
            scores |= {} if base is None else {BLACK_BOX: base}
    if BLACK_BOX in scores:
        others = {n: s for n, s in scores.items() if n != BLACK_BOX}
        scores = others | {BLACK_BOX: _at(scores[BLACK_BOX], next(iter(others.values())))}
    return ComparedRun(scores=scores, fitted_by=fitted_by)


def _halves(run: Run) -> tuple[Run | None, Run]:
    """What the equation may see of a run, and what is predicted; a run that begins at a moment sought stays whole."""
    from upright.identification.model.runs import LEAST_RUN

    if run.t.size < LEAST_RUN or run.loop is not None or {"input_start", "input_end"} & set(run.unknown):
        return None, run
    half, lead = run.t.size // 2, round(LEAD * run.t.size)
    rest = replace(
        run.samples(slice(lead, None)), initial={}, score_from=float(run.t[half] - run.t[lead]),
        unknown=tuple(dict.fromkeys(("initial", *run.unknown))),
    )  # fmt: skip
    return run.samples(slice(0, half)), rest


def _only_scored(score: Any, run: Run) -> Any:
    """The samples that count."""
    kept = score.t >= run.t[0] + run.score_from - 1e-9
    band = {n: half[kept] for n, half in score.band.items()}
    return replace(score, t=score.t[kept], y=score.y[kept], simulated=score.simulated[kept], band=band, score_from=0.0)


def _at(base: Any, score: Any) -> Any:
    """The baseline at the samples of a fit's prediction, between its own steps by cubic splines."""
    import numpy as np
    from scipy.interpolate import CubicSpline

    order = np.argsort(base.t, kind="stable")
    t, rows = np.unique(base.t[order], return_index=True)
    known = base.simulated[order][rows]
    simulated = np.full_like(score.y, np.nan)
    inside = (score.t >= t[0]) & (score.t <= t[-1])
    for k, name in enumerate(score.measured):
        if name in base.measured and np.isfinite(known).all() and t.size > 3:
            simulated[inside, k] = CubicSpline(t, known[:, base.measured.index(name)])(score.t[inside])
    return replace(base, t=score.t, y=score.y, simulated=simulated, measured=score.measured)


def _in_memory(source: Any, run: Run) -> bool:
    """Whether a fit in memory was fitted to samples of a run that has no file."""
    import numpy as np

    for other in (getattr(source, "study", None) and source.study.runs) or ():
        if other.role != "fit" or other.measured != run.measured or "sha256" in run.source:
            continue
        _, mine, its = np.intersect1d(np.round(run.t, 9), np.round(other.t, 9), return_indices=True)
        if mine.size > 10 and np.array_equal(run.y[mine], other.y[its]):
            return True
    return False
