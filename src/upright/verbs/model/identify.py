"""Parameters of a rig from its logs: `identify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.progress import Progress, silent
from upright.renamed import CLUSTER, renamed
from upright.verbs.command import Flag, command
from upright.verbs.values import open_log, texts

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.physics import Plant
    from upright.rig import Rig
    from upright.study.load import Study
    from upright.verbs.forms import PlantLike, StudyLike
    from upright.verbs.values import Workforce

from upright.verbs.model.fit import FitAnswer
from upright.verbs.options import known_options

METHODS = ("auto", "simplex", "least-squares")


class LogOptions(TypedDict, total=False):
    """What a log does not say of itself, see `upright.study.draft.from_record.study_of_record`.

    Parameters
    ----------
    known : mapping, optional
        Numbers that are given [SI], or with unit and, perhaps, uncertainty: ``{"m_p": "223.5 g"}``.
    ask : sequence of names, or mapping of name to guess, optional
        What to estimate, and nothing else; without it what the draft asks and `known` leaves.
    columns : mapping of coordinate (or drive) to column, optional
        Where the columns are called otherwise.
    units : mapping of coordinate or column to unit, optional
        Where the log does not say.
    window : (start, stop), optional
        Part to fit [s]; the rest is left out.
    """

    known: Mapping[str, float | str] | None
    ask: Sequence[str] | Mapping[str, float | str] | None
    columns: Mapping[str, str] | None
    units: Mapping[str, str] | None
    window: tuple[float, float] | None


def _read_first(typed: dict[str, Any]) -> dict[str, Any]:
    """What was typed, with the study read: a command takes no log, and has its folder beside the study."""
    folder = typed["out"] if typed["out"] is not None else folder_beside(typed["study"], "fit")
    return {**typed, "study": _read_study(typed["study"], folder, typed["data"]), "out": folder}


def _keys() -> str:
    from upright.study.keys import reference

    return reference()


@command(
    "Model",
    metavars={"study": "STUDY.toml", "out": "OUT", "hold_out": "LABEL", "method": "METHOD"},
    helps={
        "study": "Rig and runs; `upright init LOG` writes one.",
        "out": "Folder for results; STUDY-fit if left out.",
        "hold_out": "Predict this run instead of fitting it; 'each': all in turn.",
    },
    hidden=("plant", "known", "ask", "columns", "units", "window"),
    flags={
        "keys": Flag(help="Print every key a study may have.", prints=_keys),
        "strict": Flag(help="Exit with 3 when the verdict is not to trust it."),
    },
    prepare=_read_first,
    wrong=lambda answer, keys, strict: strict and not answer.fit.trusted,
    more="""
    A study describes a rig and its runs:

        [rig]
        plant = "pendulum"      # cart-pendulum, furuta, torsional-2, my.py:MyRig
        [parameters]
        m_p  = "0.107 kg"                                     # known
        l_cg = { value = "0.23 m", uncertainty = "2 mm" }     # known about
        J_p  = { guess = "1.6e-3 kg m^2", min = 0 }           # to estimate
        b_2c = { guess = "1e-4 N m" }
        [sensors.theta]
        column = "theta"        # as `upright show LOG` lists them
        unit = "counts"
        counts_per_rev = 14400
        sign = -1
        [[runs]]
        file = "swing.csv"
        window = [1.0, 30.0]
        [[runs]]
        file = "swing.csv"
        label = "tail"
        window = [30.0, 60.0]
        role = "predict"        # scored, and not fitted

    A driven rig adds, for instance,
        [drive]
        column = "v"            # or expression = "2.5*(0.2 - z)"
        unit = "V"
        [actuator]
        gain = { guess = "2 N/V" }

    All keys: `upright identify --keys`, or docs/reference/study.md.
    Writes OUT/fit.json and OUT/report.html (and OUT/report.pdf with --pdf).
    Ctrl-C keeps the best so far and writes it.
    --hold-out each predicts every run from a fit of the others as well; --workers
    shares those fits among processes.
    Exit code: 0 a fit was written (3 with --strict when its verdict is not to
    trust it), 2 the study or a log is wrong, 130 stopped by Ctrl-C.
    """,
)
@renamed(CLUSTER)
@keeps_its_inputs
def identify(
    study: StudyLike, plant: PlantLike | None = None, *, data: PathLike | None = None,
    hold_out: Sequence[str] | str | None = None, method: str = "auto", out: PathLike | None = None,
    report: bool = True, pdf: bool = False, workers: Workforce = 1, progress: Progress = silent,
    **of_log: Unpack[LogOptions],
) -> FitAnswer:  # fmt: skip
    """Fit a rig's parameters to its logs as a study file says; write estimates and report.

    Parameters
    ----------
    study : Record, DataFrame, path of a log or of a study (TOML), or Study
    plant : class of a plant or its name, Rig, FitAnswer, Study, path of either, or Plant, optional
        For a log: ``up.Pendulum``, ``"furuta"``; recognised from the columns when omitted. Of a rig or a fit, numbers
        that were given or measured are known, those that were identified or guessed are estimated from where they are,
        and assumed ones stay so.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    hold_out : sequence of str, optional
        Runs to predict instead of fitting; "each": all in turn.
    method : str
        How to search: auto, simplex, least-squares.
    out : path, optional
        Folder for fit.json and report.html.
    report : bool
        Write report.html as well.
    pdf : bool
        Write the page as PDF too.
    workers : int, str or executor
        Who computes the refits of ``hold_out="each"``: processes of this machine, the address of a Dask scheduler, or
        an executor of `concurrent.futures`.
    progress : callable, optional
        Called with the current step and the share completed.
    **of_log
        For a log: known, ask, columns, units, window; see `LogOptions`.

    Returns
    -------
    FitAnswer
        ``.parameters`` (a data frame), ``.plant``, ``.plot()``, ``.predict(other)``, ``.save()``, ``.report(path)``.

    Raises
    ------
    BadInput
        When study, log or a name cannot be used as it is.
    """
    from upright.identification.estimate import identify as estimate
    from upright.identification.ladder.cross_validation import cross_validate
    from upright.report.fit.chapter import chapter
    from upright.report.symbols import typed
    from upright.study.results import fit_content, write_fit
    from upright.study.windows import windows
    from upright.verbs.control.moving import live_part
    from upright.verbs.pages import folder_if_given, write_page
    from upright.workers import Workers

    folder, shared = folder_if_given(out, pdf), Workers.of(workers)
    if method not in METHODS:
        raise BadInput(f"--method is how to search, and there is no '{method}'; {nearest(method, METHODS)}")
    options = known_options(LogOptions, of_log, "identify")
    requested = requested_study(study, plant, verb="identify", data=data, **options)
    label = requested.path
    held = list(texts(hold_out))
    each = "each" in held and all(run.label != "each" for run in requested.runs)
    requested = requested.hold_out(*(name for name in held if not (each and name == "each")))
    fitted = sum(run.role == "fit" for run in requested.runs)
    if each and fitted < 2:
        raise BadInput(f"{label}: --hold-out each takes two runs to fit or more, got {fitted}; add a run or a window")
    if not requested.model.estimated:
        raise BadInput(
            f'{label}: nothing to estimate; give one a guess, such as J_p = {{ guess = "1e-3 kg m^2" }}'
            f' or ask=["{requested.model.plant.names()[0]}"], or score the runs with a model fitted before: upright'
            " predict OUT/fit.json STUDY.toml"
        )
    if not fitted:
        raise BadInput(f'{label}: every run has role = "predict"; at least one needs role = "fit"')
    fit = estimate(requested.model, requested.runs, method=method, progress=progress)
    if each and fit.interrupted:
        options = "Not evaluated: interrupted. No run was predicted by a fit of the others (--hold-out each)."
        fit = replace(fit, warnings=(*fit.warnings, options), not_evaluated=(*fit.not_evaluated, "cross-validation"))
    written: list[Path] = []
    crossed = None
    if folder is not None:
        written.append(folder / "fit.json")
        write_fit(fit, requested, written[0])
    if each and not fit.interrupted:
        crossed = cross_validate(fit, requested.runs, progress=progress, workers=shared)
        if folder is not None:
            write_fit(fit, requested, written[0], crossed)
    page = chapter(
        fit, title=requested.title or requested.path.stem.replace("_", " "), provenance=requested.provenance,
        crossed=crossed, study=typed(label) + (f" --data {typed(Path(data))}" if data is not None else ""),
        folder=typed(folder) if folder is not None else "OUT", windows=windows(requested.runs),
    )  # fmt: skip
    page = replace(page, numbers=fit_content(fit, requested, crossed))
    answer = FitAnswer(fit, page, written, requested, crossed)
    if folder is not None and (report or pdf):
        moves = live_part(requested.title or "rig", lambda: answer.play().page)
        label = next((n for n, run in fit.runs.items() if run.role == "predict"), next(iter(fit.runs)))
        moves += live_part(f"run '{label}'", lambda: answer.play(label).page, title="Watch it", short=True)
        written += write_page(replace(page, parts=(*page.parts, *moves)), folder / "report.html", pdf)
    return FitAnswer(fit, page, written, requested, crossed)


def requested_study(
    source: Any, plant: Any = None, *, verb: str, folder: Path | None = None, data: PathLike | None = None,
    **options: Any,
) -> Study:  # fmt: skip
    """The study that was handed in, or the one that a log and what is known of its rig make."""
    from upright.physics import Plant
    from upright.rig import Rig
    from upright.study.load import Study

    of_log = {name: value for name, value in options.items() if value is not None}
    source = source.study if isinstance(source, FitAnswer) else source
    if isinstance(source, Study) or (isinstance(source, str | Path) and _is_study(Path(source))):
        if of_log or plant is not None:
            name = next(iter(of_log), "plant")
            raise BadInput(f"{name} belongs to a log; the study says it itself, so change it there.")
        if isinstance(source, Study):
            return source
        return _read_study(Path(source), folder or Path(), None if data is None else Path(data))
    from upright.study.draft.from_record import study_of_record

    known: Any = options.get("known")
    if known is not None and not isinstance(known, Mapping):
        raise BadInput(f"known has numbers by name, such as {{'m_p': '223.5 g'}}, got {known!r:.40}.")
    what = _what_moves(plant, verb)
    if isinstance(source, Rig | Plant):
        raise BadInput(f"a rig has no runs; {verb} takes a log of it first, then the rig: up.{verb}(log, rig).")
    log: Any = source
    return study_of_record(open_log(log)[0], what, **options)


def _what_moves(plant: Any, verb: str) -> type[Plant] | Rig | None:
    """The rig or the kind of plant that a log is of."""
    from upright.physics import Plant, find
    from upright.rig import Rig
    from upright.study.load import Study
    from upright.study.stored_rig import read_stored_rig

    if plant is None or isinstance(plant, Rig):
        return plant
    if isinstance(plant, FitAnswer | Study):
        return plant.rig
    if isinstance(plant, Plant):
        return Rig(plant=plant)
    if isinstance(plant, str | Path):
        path = Path(plant)
        return read_stored_rig(path) if path.suffix in (".json", ".toml", ".xml") or path.is_dir() else find(str(plant))
    if not (isinstance(plant, type) and issubclass(plant, Plant)):
        raise BadInput(
            f"{verb} takes a plant such as up.Pendulum, its name, or a rig or fit, got {type(plant).__name__}."
        )
    return plant


def _is_study(path: Path) -> bool:
    return path.suffix.lower() in (".toml", "")


def _read_study(study: Path, folder: Path, data: Path | None) -> Study:
    """A study, once study and folder of the results are what they should be."""
    from upright.readers.source import neighbour
    from upright.report.symbols import typed
    from upright.study.load import load_study

    if not study.exists():
        raise BadInput(
            f"There is no study '{study}';{neighbour(study)} "
            f"`upright init LOG -o {typed(study.name)}` writes one from a log"
        )
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"results need a folder, but {folder} is a file; name another with -o")
    return load_study(study, data=data)


def folder_beside(study: Path, what: str) -> Path:
    """Folder of results beside a study and called after it, ``crane-fit``.

    Raises
    ------
    BadInput
        When the study is a folder.
    """
    if study.is_dir():
        raise BadInput(f"'{study}' is a folder, and a study is a TOML file; name the file inside it.")
    return study.with_name(f"{study.stem}-{what}")
