"""Which model fits a rig: does it predict, how rich may it be, and what do sines and added masses say of it?"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest
from upright.files import check_output, keeps_its_inputs
from upright.progress import Progress, silent
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.pages import folder, folder_if_given, page_folder, pdf_has_folder, write_page, written_where_named
from upright.verbs.study import folder_beside, read_study
from upright.verbs.values import open_log, pairs, paths, si, texts

if TYPE_CHECKING:
    from upright.experiments.frequency_1b.run import FrequencyRun, LoggedResponse
    from upright.identification.inference.scoring import RunScore
    from upright.identification.ladder.growth import Ladder
    from upright.identification.loadings import Loadings, Plan
    from upright.study.fitted import FittedModel
    from upright.study.load import Study
    from upright.verbs.values import Log

KINDS = ("sines", "multisine", "sweep")


@command(
    "Model",
    metavars={"model": "OUT/fit.json", "study": "STUDY.toml", "out": "OUT"},
    helps={
        "model": "Model that `upright identify` wrote.",
        "study": "Runs to score, a study whose guesses are not used, or a log.",
    },
    wrong=lambda scored: not scored.chapter.sound,
    more="""
    The study is written as for `upright identify`; [parameters] and [actuator]
    may be left out, since every number comes from the fit.

    upright predict swing-fit/fit.json other_day.toml

    Exit code: 0 predicted as well as the fit promises, 3 worse, 2 the model, the
    study or a log is wrong.
    """,
)
@keeps_its_inputs
def predict(
    model: Any, study: Any, *, data: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None, pdf: bool = False,
) -> Answer[dict[str, RunScore]]:  # fmt: skip
    """Score other runs with a model that was fitted before.

    Every run is scored, whatever its role. What a run lists under ``unknown`` (its initial state, unless it says
    otherwise) is estimated for that run alone; nothing else is. Around each prediction lies a band that should hold 90
    % of the samples, as the fit promises; a run that goes beyond what was fitted is named, and by how much.

    Parameters
    ----------
    model : fit or path
        What `identify` answered, or the fit.json that it wrote, or its folder.
    study : path, Study, Record or pandas.DataFrame
        Runs to score: a study, whose guesses are not used, or a log, whose columns are recognised.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    out : path, optional
        Folder for prediction.json and prediction.html.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of the scores by run. Its chapter is `sound` when they are predicted as well as the fit promises.

    Raises
    ------
    BadInput
        When model or study cannot be read, or speak of different plants.
    """
    from upright.files import write_json
    from upright.identification.inference.promise import promise
    from upright.identification.inference.scoring import predict as score
    from upright.report.fit.chapter import score_pictures
    from upright.report.fit.tables import score_table
    from upright.report.page import Chapter, Part
    from upright.verbs.handover import called, fitted_of

    pdf_has_folder(out, pdf)
    for given, what in ((model, "the model"), (study, "the study")):
        if isinstance(given, str | os.PathLike) and not Path(given).exists():
            raise BadInput(f"{what} {given} does not exist; the call is upright predict OUT/fit.json STUDY.toml")
    fitted, of = fitted_of(model, "predict"), Path(called(model)).name
    asked, on = _runs_to_predict(fitted, model, study, data)
    missing = [n for n in fitted.values if n not in asked.model.parameters]
    if missing:
        raise BadInput(
            f"{on}: the plant '{asked.plant}' has no parameter {missing[0]}, and {of} is a '{fitted.plant}';"
            " both must be the same plant"
        )
    rig = replace(asked.model, substeps=fitted.substeps)
    runs = [replace(run, role="predict") for run in asked.runs]
    scores = score(fitted.values, rig, runs, groups=fitted.groups, bands=fitted.bands)
    found = promise(scores, fitted.bands, fitted.scores)
    said = ("role", "fit_percent", "horizon", "adapted", "offer", "inside", "beyond")
    numbers: dict[str, Any] = {
        "model": of,
        "study": on,
        "verdict": found.sentence,
        "as_promised": found.kept,
        "runs": {label: {name: getattr(s, name) for name in said} for label, s in scores.items()},
    }
    offers = [s.offer.sentence(label, s.fit_percent) for label, s in scores.items() if s.offer is not None]
    told = Chapter(
        title=f"{of} on {on}", verdict=found.sentence, sound=found.kept, numbers=numbers,
        parts=(
            Part(
                "How much of each signal is explained",
                (score_table(scores), *score_pictures(scores, rig.plant, "prediction")),
            ),
        ),
        warnings=(
            *(() if fitted.trusted else (f"The model's own verdict was: {fitted.verdict}",)),
            *fitted.hardware.unlike(asked.hardware), *(s for run in scores.values() for s in run.beyond), *offers,
        ),
    )  # fmt: skip
    if out is None:
        return Answer(scores, told)
    at = folder(out)
    return Answer(
        scores, told, [write_json(at / "prediction.json", numbers), *write_page(told, at / "prediction.html", pdf)]
    )


def _study(given: Any, verb: str) -> Study:
    from upright.study.load import Study

    if not isinstance(given, Study):
        raise BadInput(f"{verb} takes a study: its file (TOML), or the .study of a fit, got {type(given).__name__}.")
    return given


def _runs_to_predict(
    fitted: FittedModel, model: Any, given: Any, data: str | os.PathLike[str] | None
) -> tuple[Study, str]:  # fmt: skip
    """Study of the runs to score, and what it is called."""
    from upright.physics import find
    from upright.study.draft.from_record import study_of_record
    from upright.study.load import Study, load_study
    from upright.verbs.fitting import FitAnswer

    if isinstance(given, Study):
        return given, given.path.name
    if isinstance(given, str | os.PathLike) and Path(given).suffix.lower() in (".toml", ""):
        study = load_study(Path(given), data=None if data is None else Path(data), fixed=fitted.values)
        return study, Path(given).name
    if isinstance(model, FitAnswer):
        kind = model.value.model.plant
    else:
        kind = find(fitted.plant, Path(model).parent) if isinstance(model, str | os.PathLike) else find(fitted.plant)
    record, path = open_log(given)
    known = {n: v for n, v in fitted.values.items() if n in kind.names()}
    whole = (float(record.t[0]), float(record.t[-1]))
    study = study_of_record(record, kind, known=known, ask=[], window=whole)
    drive = {n: replace(p, value=fitted.values.get(n, p.value)) for n, p in study.model.parameters.items()}
    return replace(study, model=replace(study.model, parameters=drive)), path.name


@command(
    "Model",
    metavars={"study": "STUDY.toml", "out": "OUT"},
    helps={
        "study": "Rig, runs and everything one might ask.",
        "out": "Folder for results; STUDY-ladder if left out.",
    },
    given=lambda typed: {**typed, "out": typed["out"] or folder_beside(typed["study"], "ladder")},
    more="""
    Rungs of your own, in the study:

        [[ladder]]
        name = "Coulomb friction"
        adds = ["b_1c", "b_2c"]      # held at zero below this rung
        [[ladder]]
        name = "torque that falls with speed"
        adds = ["actuator.knee", "actuator.fade"]
        [[ladder]]
        name = "friction of each run"
        unknown = ["friction"]

    Writes OUT/ladder.json, OUT/ladder.html and OUT/study.toml, the study of the
    chosen model. Ctrl-C keeps the rungs so far.
    Exit code: 0 a ladder was written, 2 the study or a log is wrong, 130
    stopped by Ctrl-C.
    """,
)
@keeps_its_inputs
def ladder(
    study: str | os.PathLike[str] | Study, *, out: str | os.PathLike[str] | None = None,
    data: str | os.PathLike[str] | None = None, report: bool = True, pdf: bool = False, workers: int = 1,
    cluster: str = "", progress: Progress = silent,
) -> Answer[Ladder]:  # fmt: skip
    """Grow a model only while it predicts better what it has not seen.

    Give guesses of everything the rig might have. Rung after rung is fitted: viscous friction, Coulomb friction, drag,
    stiction, presliding, then the drive's terms, then friction that differs from run to run. Each run is predicted from
    a fit of the others (of a single run, the last third), and a rung is kept only if that prediction improves by more
    than it scatters. Where runs repeat one another, how well one predicts the other is the ceiling: a model that
    reaches it has nothing left to explain.

    Parameters
    ----------
    study : path or Study
        Rig, runs, guesses of everything the rig might have, and rungs of one's own where wanted.
    out : path, optional
        Folder for ladder.json, ladder.html and study.toml, the study of the chosen model.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    report : bool
        Write ladder.html as well.
    pdf : bool
        Write the page as PDF too.
    workers, cluster
        Who predicts each run from a fit of the others: processes of this machine, or the address of a Dask scheduler.
    progress : callable, optional
        Told the step at work and the share done.

    Returns
    -------
    Answer
        Of a `Ladder`; Ctrl-C keeps the rungs so far, and `interrupted` says so.

    Raises
    ------
    BadInput
        When the study or a log is wrong, or nothing is asked.
    KeyboardInterrupt
        When Ctrl-C came before the first rung stood.
    """
    from upright.files import replace_file, write_json
    from upright.identification.ladder.growth import climb
    from upright.report.ladder import chapter, next_steps
    from upright.report.symbols import typed
    from upright.study.results import can_be_trimmed, chosen_study, ladder_content
    from upright.workers import Workers

    shared = Workers(number=workers, cluster=cluster)
    pdf_has_folder(out, pdf)
    if isinstance(study, str | os.PathLike):
        study = Path(study)
        at = folder_beside(study, "ladder") if out is None else Path(out)
        asked = read_study(study, at, None if data is None else Path(data))
    else:
        asked, study = _study(study, "ladder"), study.path
        at = folder_beside(study, "ladder") if out is None else Path(out)
    if out is not None:
        for name in ("ladder.json", "study.toml", "ladder.html"):
            check_output(at / name)
    if not asked.model.estimated:
        raise BadInput(f'{study}: nothing is asked; give a parameter a guess, such as b_2c = {{ guess = "1e-4 N m" }}')
    climbed = climb(asked.model, asked.runs, asked.ladder or None, progress=progress, workers=shared)
    if not climbed.steps:
        raise KeyboardInterrupt
    trimmed = study.is_file() and can_be_trimmed(asked, climbed)
    files: list[Path] = []
    numbers = ladder_content(climbed, asked)
    if out is not None:
        files.append(write_json(at / "ladder.json", numbers))
        if trimmed:
            files.append(replace_file(at / "study.toml", chosen_study(asked, climbed).encode()))
    where = typed(Path(data) if data is not None else study.parent)
    told = chapter(
        climbed, title=f"Ladder: {asked.title or asked.path.stem.replace('_', ' ')}", provenance=asked.provenance,
        steps=next_steps(climbed, study=typed(study), folder=typed(at), data=where, trimmed=trimmed),
    )  # fmt: skip
    if out is not None and (report or pdf):
        files += write_page(told, at / "ladder.html", pdf)
    return Answer(climbed, replace(told, numbers=numbers), files)


@command(
    "Model",
    defaults={"out": "frequency"},
    names={"low": "--from", "high": "--to"},
    metavars={
        "sources": "[LOG...]", "rig": "KIND", "ask": "HOW", "kind": "HOW", "signal": "NAME=COLUMN", "counts": "NAME=N",
        "known": "NAME=VALUE", "hold": "TIME", "low": "W", "high": "W",
    },
    helps={
        "signal": "Column of a coordinate, as in theta=enc2.",
        "counts": "Counts per rad or m; negative if reversed.",
        "known": 'As in "m_p=135 g +- 0.2 %"; fixes the scale.',
        "low": "Least frequency, in rad/s.",
        "high": "Greatest frequency, in rad/s.",
    },
    given=lambda typed: {**typed, "progress": silent} if typed["sources"] else typed,
    more="""
    A log without --rig gives the response alone; fit.json goes to upright design.

    upright frequency --rig furuta --seed 3 -o out
    upright frequency sweep.csv --rig linear --known "m_p=135 g +- 0.2 %" -o out
    upright frequency one.txt two.txt --command v --signal theta=theta
    """,
)  # fmt: skip
@written_where_named
@keeps_its_inputs
def frequency(
    sources: Sequence[str | os.PathLike[str]] | str | os.PathLike[str] = (), *, rig: str = "", seed: int = 0,
    ask: str = "sines", kind: str = "", command: str = "", signal: Mapping[str, str] | Sequence[str] = (),
    counts: Mapping[str, float | str] | Sequence[str] = (),
    known: Mapping[str, float | str | tuple[float, float]] | Sequence[str] = (), hold: float | str = "",
    low: float | None = None, high: float | None = None, data: str | os.PathLike[str] | None = None,
    out: str | os.PathLike[str] | None = None, pdf: bool = False, progress: Progress = silent,
) -> Answer[FrequencyRun | LoggedResponse]:  # fmt: skip
    """Measure a frequency response, or read one from logs, and fit the rig to it.

    Fits by the paper's simplex on squared dB and by least squares with phase, weights and dry friction, side by side
    (experiment 1b).

    Parameters
    ----------
    sources : path or sequence of paths, optional
        Logs (repeats together), a frequency.csv, or a study; a twin is asked when omitted.
    rig : str
        Twin, or make of the logged rig: furuta, linear, rectilinear, torsional.
    seed : int
        Which twin of the make; 0 is the one as designed.
    ask : str
        Ask the twin by sines, multisine or sweep.
    kind : str, optional
        What a log holds of these, when it is not told rightly.
    command : str, optional
        Column that drives.
    signal : mapping of str to str, optional
        Column by coordinate, or texts NAME=COLUMN.
    counts : mapping of str to float, optional
        Counts per rad or m by coordinate, negative if reversed, or texts NAME=N.
    known : mapping, optional
        What is known of the rig by parameter [SI]: a number, a number with its standard uncertainty, or a text such as
        ``"135 g +- 0.2 %"``; or texts NAME=VALUE.
    hold : float or str, optional
        How long a command is held [s]; one sample when omitted.
    low, high : float, optional
        Least and greatest frequency [rad/s].
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    progress : callable, optional
        Told the step at work and the share done.

    Returns
    -------
    Answer
        Of a `FrequencyRun` on a twin, of a `LoggedResponse` from sources.

    Raises
    ------
    BadInput
        When there is no such rig or way, or a log cannot be used.
    """
    from upright.rig.makes import MAKES

    at = page_folder(out, pdf)
    for value, option in ((ask, "--ask"), (kind or "sines", "--kind")):
        if value not in KINDS:
            raise BadInput(f"{option} is one of {', '.join(KINDS)}, got '{value}'.")
    limits = _band(low, high)
    files = [at / "frequency.csv"]
    if logs := [Path(source) for source in paths(sources)]:
        from upright.experiments.frequency_1b.chapter import log_chapter
        from upright.experiments.frequency_1b.run import LogRequest, response_of_logs
        from upright.verbs.values import si_if_given

        said = pairs(signal, "--signal"), pairs(counts, "--counts"), pairs(known, "--known")
        wish = LogRequest(
            make=rig, command=command, signals=said[0], kind=kind, seed=seed, hold=si_if_given(hold, "s"),
            counts={n: _count(n, v) for n, v in said[1].items()},
            band=limits,
            known={n: _known(n, v, rig) for n, v in said[2].items()},
        )  # fmt: skip
        found = response_of_logs(logs, wish, at, data=None if data is None else Path(data))
        files += [at / "fit.json"] if found.answer else []
        told = log_chapter(found)
    else:
        said = {"--signal": signal, "--counts": counts, "--known": known, "--command": command, "--hold": hold}
        said |= {"--kind": kind, "--from": low is not None, "--to": high is not None, "--data": data is not None}
        for option, value in said.items():
            if value:
                raise BadInput(f"{option} belongs to a log, and none was named; name one, or leave the option out.")
        if not rig:
            raise BadInput(
                "frequency needs a log, a frequency.csv or a study to read, or a twin to sweep: --rig "
                f"{', '.join(MAKES)}."
            )
        from upright.experiments.frequency_1b.chapter import chapter
        from upright.experiments.frequency_1b.run import run_frequency
        from upright.report.page import simulated
        from upright.rig.makes import make_named

        make_named(rig)
        found = run_frequency(rig, seed, at, progress, kind=ask)
        files += [at / "sweep.csv", at / "fit.json"]
        told = simulated(chapter(found))
    files += write_page(told, at / "report.html", pdf)
    numbers = {"verdict": told.verdict, "sound": told.sound, **told.numbers, "files": [str(f) for f in files]}
    return Answer(found, replace(told, numbers=numbers), files)


def _band(low: float | None, high: float | None) -> tuple[float, float] | None:
    """Least and greatest frequency [rad/s] of those that were said."""
    for value, option in ((low, "--from"), (high, "--to")):
        if value is not None and not 0 < value < math.inf:
            raise BadInput(f"{option} needs a frequency above 0 rad/s, got {value:g}; leave it out to take all.")
    band = (low or 0.0, high or math.inf)
    if not band[0] < band[1]:
        raise BadInput(f"--from must lie below --to, got {band[0]:g} and {band[1]:g} rad/s; exchange them.")
    return None if low is None and high is None else band


def _count(name: str, text: float | str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if value == 0 or not math.isfinite(value):
        raise BadInput(f"--counts {name} needs a finite number that is not 0, got '{text}'.")
    return value


def _known(name: str, value: float | str | tuple[float, float], make: str) -> tuple[float, float]:
    """Value and standard uncertainty [SI]."""
    from upright.rig.makes import MAKES

    if make not in MAKES:
        raise BadInput("--known belongs to a fit; name the rig with --rig too.")
    if isinstance(value, tuple):
        return si(value[0], ""), si(value[1], "")
    if not isinstance(value, str):
        return si(value, ""), 0.0
    from upright.units import measured

    plant = MAKES[make].plant
    if name in plant.names():
        return measured(value, plant.quantity(name).unit)
    return measured(value, "s" if name in ("actuator.delay", "actuator.lag") else "")


@command(
    "Model",
    metavars={"added": "INERTIA", "signal": "COLUMN", "twin": "KIND"},
    helps={"added": "What was added, log by log: '1.5 kg', '4e-3 kg m^2', or '2 at 6.5 cm' (500 g each)."},
    defaults={"out": "loadings"},
    more="""
    upright loadings --twin rectilinear -o out
    upright loadings bare.csv one.csv two.csv --added "0 kg" --added "0.5 kg" --added "1 kg" --signal x --command u
    """,
)
@keeps_its_inputs
def loadings(
    logs: Sequence[Log] | Log = (), *, added: Sequence[str] | str = (), signal: str = "", command: str = "",
    tolerance: float | str = "0 %", free: bool = False, twin: str = "", seed: int = 0,
    out: str | os.PathLike[str] | None = None, pdf: bool = False,
) -> Answer[Loadings]:  # fmt: skip
    """Find stiffness and bare inertia from step responses with known added masses.

    This is experiment 1a. Each swing gives a damped period, and its extremes viscous and dry friction; 1/omega_n^2 over
    the added inertia is a line whose slope is 1/k.

    Parameters
    ----------
    logs : path, Record, pandas.DataFrame, or a list of them
        One log of steps for each loading; repeats welcome.
    added : sequence of str
        What was added, log by log: ``"1.5 kg"``, ``"4e-3 kg m^2"``, or ``"2 at 6.5 cm"`` (500 g each).
    signal : str, optional
        Column of the position, in any unit.
    command : str, optional
        Column of the command that steps.
    tolerance : float or str
        Standard uncertainty of one added piece, as a share.
    free : bool
        Count swings at zero command only, with the drive silent.
    twin : str, optional
        No logs: step a twin, rectilinear or torsional.
    seed : int
        Which twin of the make; 0 is the one as designed.
    out : path, optional
        Folder for the page, and for the logs of a twin.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of `Loadings`.

    Raises
    ------
    BadInput
        When logs and loadings do not match, or a column is not told.
    NotIdentifiable
        When too few swings can be seen.
    """
    from upright.experiments.weighing_1a.from_logs import weigh_logs, weigh_twin
    from upright.report.page import simulated

    at = folder_if_given(out, pdf)
    given = paths(logs)
    if twin:
        if given or added:
            raise BadInput("--twin steps a simulated rig and takes no logs; leave out either.")
        found, told = weigh_twin(twin, seed, at)
        told = simulated(told)
    else:
        if not given or len(texts(added)) != len(given):
            raise BadInput(
                f"Every log needs its --added, in the same order: {len(given)} logs came with {len(texts(added))};"
                ' write --added "0 kg" for the bare one, or try --twin rectilinear.'
            )
        records = [(record, path.name) for record, path in map(open_log, given)]
        found, told = weigh_logs(
            records, texts(added), signal=signal, command=command, tolerance=si(tolerance, "1"), free=free
        )
    files = [] if at is None else write_page(told, at / "report.html", pdf)
    numbers = {**told.numbers, "report": str(files[0]) if files else ""}
    return Answer(found, replace(told, numbers=numbers), files)


@command(
    "Model",
    metavars={"rig": "KIND", "radius": "LENGTH", "out": "FILE"},
    helps={"radius": "Bolt circle of a disk, once for each; 2 to 9 cm."},
    ranges={"runs": (2, 16), "levels": (2, 5)},
    more='upright plan-inertias --rig torsional --error "0.3 %" --radius "4 cm" --radius "9 cm"',
)
@keeps_its_inputs
def plan_inertias(
    *, rig: str = "rectilinear", bare: float | str = "", error: float | str = "0.2 %", tolerance: float | str = "0.2 %",
    runs: int = 10, levels: int = 3, radius: Sequence[float | str] | float | str = (), target: float | str = "",
    out: str | os.PathLike[str] | None = None,
) -> Answer[dict[int, tuple[Plan, Plan]]]:  # fmt: skip
    """Say which masses, where and how often, give the tightest stiffness for the fewest runs.

    The runs are those of experiment 1a. Carts take 0, 0.5, 1, 1.5 or 2 kg; disks take none, two or four masses of 500 g
    on any bolt circle, so that they stay balanced. Every design is compared on the line 1/omega_n^2 = (m_0 + a)/k.

    Parameters
    ----------
    rig : str
        rectilinear (carts) or torsional (disks).
    bare : float or str, optional
        Bare inertia, roughly [kg or kg m^2]; 0.77 kg or 3e-3 kg m^2 when omitted.
    error : float or str
        Standard error of a frequency from one run, as it was measured; a share.
    tolerance : float or str
        Standard uncertainty of one added mass or inertia; a share.
    runs : int
        Most runs to be planned, 2 to 16.
    levels : int
        Different loadings at least, 2 to 5.
    radius : float, str or a sequence of them, optional
        Bolt circles of a disk [m]; 2 to 9 cm when omitted.
    target : float or str, optional
        Standard error of the stiffness that would do; a share.
    out : path, optional
        Picture to draw (SVG, PNG).

    Returns
    -------
    Answer
        Of the best plans by number of runs: for the stiffness, and for stiffness and bare inertia together.

    Raises
    ------
    BadInput
        When there is no such rig or picture, or numbers contradict each other.
    """
    from upright.experiments.weighing_1a.plan import chapter, choices, choose
    from upright.identification.loadings import plan_loadings
    from upright.report.drawing import picture_format
    from upright.rig.makes import OSCILLATORS
    from upright.verbs.values import si_if_given

    if out is not None:
        picture_format(Path(out))  # before the work begins
    if rig not in OSCILLATORS:
        raise BadInput(f"--rig is {' or '.join(OSCILLATORS)}, got '{rig}'; {nearest(rig, OSCILLATORS)}")
    for value, option, most in ((runs, "--runs", 16), (levels, "--levels", 5)):
        if not 2 <= value <= most:
            raise BadInput(f"{option} needs a whole number from 2 to {most}, got {value}.")
    body = OSCILLATORS[rig]
    choice = choices(rig, [si(r, "m") for r in paths(radius) if r != ""])
    given = si_if_given(bare, body.unit)
    m_0 = body.plant.parameters()[body.inertia] if given is None else given
    piece = min(w.added for w in choice if w.added > 0)
    piece = piece / 2 if rig == "torsional" else piece
    e, g = _share(error, "--error"), _share(tolerance, "--tolerance")
    if runs < levels:
        raise BadInput(f"--runs needs at least as many as --levels, got {runs} for {levels}; plan more runs.")
    plans = {
        n: plan_loadings(choice, n, bare=m_0, error=e, tolerance=g, piece=piece, levels=levels)
        for n in range(levels, runs + 1)
    }
    wanted = _share(target, "--target") if target != "" else None
    chosen = choose({n: p[0].k for n, p in plans.items()}, wanted)
    if out is not None:
        from upright.experiments.weighing_1a.figures import plan_figure
        from upright.report.drawing import save

        save(plan_figure(plans, chosen), Path(out))
    return Answer(plans, chapter(plans, chosen, wanted, body.unit), [] if out is None else [Path(out)])


def _share(given: float | str, option: str) -> float:
    value = si(given, "1")
    if not 0 <= value < 0.5:
        raise BadInput(f"{option} needs a share between 0 and 50 %, got '{given}'; write it as '0.2 %'.")
    return value
