"""Parameters of a rig from its logs, and what a fit says of other runs: `identify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.progress import Progress, silent
from upright.verbs.answer import Answer
from upright.verbs.command import Flag, command
from upright.verbs.study import folder_beside, read_study
from upright.verbs.values import open_log

if TYPE_CHECKING:
    from upright.identification import Fit, RunScore
    from upright.identification.ladder.cross_validation import CrossValidation
    from upright.identification.model.bands import Bands
    from upright.physics import Plant
    from upright.records import Record
    from upright.report.page import Chapter
    from upright.rig import Rig
    from upright.study.fitted import FittedModel
    from upright.study.load import Study

METHODS = ("auto", "simplex", "least-squares")


class FitAnswer(Answer["Fit"]):
    """A fit, with the study that asked for it.

    Attributes
    ----------
    study : Study
    crossed : CrossValidation or None
    """

    def __init__(
        self, fit: Fit, chapter: Chapter, files: Sequence[Path], study: Study, crossed: CrossValidation | None
    ) -> None:
        super().__init__(fit, chapter, files)
        self.study, self.crossed = study, crossed

    def brief(self) -> Chapter:
        """Verdict, estimates and scores; the whole chapter is what `report` writes."""
        from upright.report.fit.tables import parameter_table, score_table
        from upright.report.page import Part, Picture, Points
        from upright.study.windows import windows

        asked = {n: p for n, p in self.value.model.parameters.items() if p.estimate}
        fit = replace(self.value, model=replace(self.value.model, parameters=asked))
        drawn = Picture(
            name="fit", draw=lambda: self._drawn(80), caption="Data and model.", description="See the table of scores."
        )  # fmt: skip
        parts = (
            Part("Parameters", (parameter_table(fit, caption="Estimates"),)),
            Part("Fit of the runs", (Points(windows(self.study.runs)), score_table(fit.runs), drawn)),
        )
        return replace(self.chapter, parts=parts, steps=())

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the fit, or the fits of the others."""
        return self.value.interrupted or (self.crossed is not None and self.crossed.interrupted)

    @property
    def fit(self) -> Fit:
        """The fit itself."""
        return self.value

    def __getitem__(self, name: str) -> Any:
        """The `Estimate` of a parameter, or the value of one that was known: ``fit["l_cg"].value``."""
        rig, found = self.value.model, self.value.estimates
        if name in found:
            return found[name]
        if name not in rig.parameters:
            raise BadInput(f"this fit has no parameter '{name}'; {nearest(name, [*found, *rig.parameters])}")
        return rig.parameters[name]

    @property
    def parameters(self) -> Any:
        """Estimates as a `pandas.DataFrame`: value, stderr, low, high, unit, status; a parameter per row."""
        return self.to_pandas()

    def to_pandas(self) -> Any:
        """See `parameters`."""
        import pandas as pd

        rows = {name: (e.value, e.stderr, *e.interval, e.unit, e.qualified) for name, e in self.value.estimates.items()}
        columns = ["value", "stderr", "low", "high", "unit", "status"]
        return pd.DataFrame.from_dict(rows, orient="index", columns=columns)

    @property
    def residuals(self) -> Mapping[str, Record]:
        """Measured less simulated signals of every run, by its label, as records."""
        from upright.records import Record
        from upright.records.record import Provenance

        unit = {c.name: c.unit for c in self.value.model.plant.coordinates}
        return {
            label: Record(
                t=run.t, signals={s: run.y[:, k] - run.simulated[:, k] for k, s in enumerate(run.measured)},
                units={s: unit[s] for s in run.measured if s in unit}, outputs=run.measured,
                provenance=Provenance(reader="fit", notes=(f"Residuals of {label}: measured less simulated.",)),
            )
            for label, run in self.value.runs.items()
        }  # fmt: skip

    @property
    def rig(self) -> Rig:
        """The rig as identified: plant, drive and sensors with where each number is from, and rigs that the fit allows.

        Every verb takes it, and tells how far the fit can be trusted.
        """
        from upright.study.stored_rig import rig_of_fit

        return rig_of_fit(self.fitted, self.value.model.plant)

    @property
    def fitted(self) -> FittedModel:
        """What `save` writes, as it is read again."""
        from upright.study.fitted import fitted_model
        from upright.study.results import fit_content

        return fitted_model(fit_content(self.value, self.study, self.crossed))

    @property
    def plant(self) -> Plant:
        """The plant with the numbers found and given."""
        rig, found = self.value.model, self.value.estimates
        values = {n: found[n].value if n in found else rig.parameters[n].value for n in rig.plant.names()}
        return rig.plant(**values)

    def plot(self, name: str = "") -> Any:
        """Data against the model for the first run, or the picture called `name`; see `pictures`."""
        if name:
            return super().plot(name)
        return self._drawn(450)

    def _drawn(self, buckets: int) -> Any:
        from upright.report.fit.figures import fit_figure

        label, score = next(iter(self.value.runs.items()))
        return fit_figure(score, self.value.model.plant, title=label, buckets=buckets)

    def save(self, path: str | Path = "fit.json") -> Path:
        """Write the fit for `predict`, `design`, `regulate` and other programs, and give back where."""
        from upright.study.results import write_fit

        path = Path(path)
        write_fit(self.value, self.study, path, self.crossed)
        return path

    def predict(self, other: Any, *, columns: Mapping[str, str] | None = None, units: Mapping[str, str] | None = None,
                window: tuple[float, float] | None = None) -> Prediction:  # fmt: skip
        """How well the fit explains another log: a record, a data frame, a log's file, or a study.

        Of the other log only what the study lists under `unknown` is estimated (its initial state); nothing else is.
        """
        from upright.identification.inference.scoring import predict as score
        from upright.study.load import load_study

        rig = self.value.model
        values = {n: p.value for n, p in rig.parameters.items()} | {
            n: e.value for n, e in self.value.estimates.items() if n in rig.parameters
        }
        if isinstance(other, str | Path) and Path(other).suffix == ".toml":
            study = load_study(other, fixed=values)
        else:
            from upright.study.draft.from_record import study_of_record

            record = open_log(other)[0]
            given = {n: v for n, v in values.items() if n in rig.plant.names()}
            study = study_of_record(
                record, rig.plant, known=given, ask=[], columns=columns, units=units,
                window=window or (float(record.t[0]), float(record.t[-1])),
            )  # fmt: skip
        runs = [replace(run, role="predict") for run in study.runs]
        fixed = replace(
            rig, parameters={n: replace(p, value=values[n], estimate=False) for n, p in rig.parameters.items()}
        )
        bands = self.value.bands if self.crossed is None else self.crossed.bands
        return prediction(score(values, fixed, runs, bands=bands), rig.plant, bands)


@dataclass(frozen=True, kw_only=True)
class PredictedRuns:
    """Scores of runs that were predicted, by their labels."""

    runs: Mapping[str, RunScore]
    plant: type[Plant]


class Prediction(Answer[PredictedRuns]):
    """Scores of runs that a fit has not seen."""

    def plot(self, name: str = "") -> Any:
        """Data against the prediction of the first run, or of the run called `name`."""
        from upright.report.fit.figures import fit_figure

        runs = self.value.runs
        label = name or next(iter(runs))
        if label not in runs:
            raise BadInput(f"no run is called '{label}'; {nearest(label, runs)}")
        return fit_figure(runs[label], self.value.plant, title=label)


def prediction(runs: Mapping[str, RunScore], plant: type[Plant], bands: Bands | None) -> Prediction:
    """Scores as an answer."""
    from upright.identification.inference.promise import promise
    from upright.report.fit.tables import score_table
    from upright.report.page import Chapter, Part

    worst = min((v for s in runs.values() for v in s.fit_percent.values()), default=float("nan"))
    found = promise(runs, bands)
    part = Part("How much of each signal is explained", (score_table(runs),))
    chapter = Chapter(
        title="Prediction", verdict=f"The worst signal is explained to {worst:.1f} %. {found.sentence}", parts=(part,),
        sound=found.kept, warnings=tuple(said for s in runs.values() for said in s.beyond),
        numbers={
            label: {"fit_percent": dict(s.fit_percent), "horizon": s.horizon, "inside": s.inside}
            for label, s in runs.items()
        },
    )  # fmt: skip
    return Prediction(PredictedRuns(runs=runs, plant=plant), chapter)


def _read_first(typed: dict[str, Any]) -> dict[str, Any]:
    """What was typed, with the study read: a command takes no log, and has its folder beside the study."""
    folder = typed["out"] if typed["out"] is not None else folder_beside(typed["study"], "fit")
    return {**typed, "study": read_study(typed["study"], folder, typed["data"]), "out": folder}


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
    given=_read_first,
    wrong=lambda answer, keys, strict: strict and not answer.fit.trusted,
    more="""
    A study names a rig and the runs that speak about it:

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
        role = "predict"        # scored, never fitted

    A driven rig adds, for instance,
        [drive]
        column = "v"            # or expression = "2.5*(0.2 - z)"
        unit = "V"
        [actuator]
        gain = { guess = "2 N/V" }

    All keys: `upright identify --keys`, or docs/study.md.
    Writes OUT/fit.json and OUT/report.html (and OUT/report.pdf with --pdf).
    Ctrl-C keeps the best so far and writes it.
    --hold-out each predicts every run from a fit of the others as well; --workers
    shares those fits among processes.
    Exit code: 0 a fit was written (3 with --strict when its verdict is not to
    trust it), 2 the study or a log is wrong, 130 stopped by Ctrl-C.
    """,
)
@keeps_its_inputs
def identify(
    study: Any, plant: Any = None, *, known: Mapping[str, float | str] | None = None,
    ask: Sequence[str] | Mapping[str, float | str] | None = None, columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None, window: tuple[float, float] | None = None,
    data: str | Path | None = None, hold_out: Sequence[str] | str = (), method: str = "auto",
    out: str | Path | None = None, report: bool = True, pdf: bool = False, workers: int = 1, cluster: str = "",
    progress: Progress = silent,
) -> FitAnswer:  # fmt: skip
    """Fit a rig's parameters to its logs as a study file says; write estimates and report.

    Parameters
    ----------
    study : Record, DataFrame, path of a log or of a study (TOML), or Study
    plant : class of a plant or its name, optional
        For a log: ``up.Pendulum``, ``"furuta"``; recognised from the columns when omitted.
    known, ask, columns, units, window
        For a log: what is given, what to estimate (as names, or names with guesses), which column is which coordinate,
        in which unit, and the part to fit [s]; see `upright.study.draft.from_record.study_of_record`.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    hold_out : sequence of str
        Runs to predict instead of fitting; "each": all in turn.
    method : str
        How to search: auto, simplex, least-squares.
    out : path, optional
        Folder for fit.json and report.html.
    report : bool
        Write report.html as well.
    pdf : bool
        Write the page as PDF too.
    workers, cluster
        Who computes the refits of ``hold_out="each"``: processes of this machine, or the address of a Dask scheduler.
    progress : callable, optional
        Told the step at work and the share done.

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
    from upright.verbs.pages import folder_if_given, write_page
    from upright.workers import Workers

    folder, shared = folder_if_given(out, pdf), Workers(number=workers, cluster=cluster)
    if method not in METHODS:
        raise BadInput(f"--method must be one of {', '.join(METHODS)}, got '{method}'; {nearest(method, METHODS)}")
    asked = asked_study(study, plant, known=known, ask=ask, columns=columns, units=units, window=window, data=data)
    label = asked.path
    held = [hold_out] if isinstance(hold_out, str) else list(hold_out)
    each = "each" in held and all(run.label != "each" for run in asked.runs)
    asked = asked.hold_out(*(name for name in held if not (each and name == "each")))
    fitted = sum(run.role == "fit" for run in asked.runs)
    if each and fitted < 2:
        raise BadInput(f"{label}: --hold-out each takes two runs to fit or more, got {fitted}; add a run or a window")
    if not asked.model.estimated:
        raise BadInput(
            f'{label}: nothing is asked; give a parameter a guess, such as J_p = {{ guess = "1e-3 kg m^2" }}, or score'
            " the runs with a model fitted before: upright predict OUT/fit.json STUDY.toml"
        )
    if not fitted:
        raise BadInput(f'{label}: every run has role = "predict"; at least one needs role = "fit"')
    fit = estimate(asked.model, asked.runs, method=method, progress=progress)
    if each and fit.interrupted:
        said = "Not evaluated: interrupted. No run was predicted by a fit of the others (--hold-out each)."
        fit = replace(fit, warnings=(*fit.warnings, said), not_evaluated=(*fit.not_evaluated, "cross-validation"))
    written: list[Path] = []
    crossed = None
    if folder is not None:
        written.append(folder / "fit.json")
        write_fit(fit, asked, written[0])
    if each and not fit.interrupted:
        crossed = cross_validate(fit, asked.runs, progress=progress, workers=shared)
        if folder is not None:
            write_fit(fit, asked, written[0], crossed)
    told = chapter(
        fit, title=asked.title or asked.path.stem.replace("_", " "), provenance=asked.provenance, crossed=crossed,
        study=typed(label) + (f" --data {typed(data)}" if data is not None else ""),
        folder=typed(folder) if folder is not None else "OUT", windows=windows(asked.runs),
    )  # fmt: skip
    if folder is not None and (report or pdf):
        written += write_page(told, folder / "report.html", pdf)
    return FitAnswer(fit, replace(told, numbers=fit_content(fit, asked, crossed)), written, asked, crossed)


def asked_study(given: Any, plant: Any = None, *, data: str | Path | None = None, **options: Any) -> Study:
    """The study that was handed in, or the one that a log and what is known of it make."""
    from upright.physics import Plant, find
    from upright.study.load import Study

    of_log = {name: value for name, value in options.items() if value is not None}
    is_study = isinstance(given, Study) or (isinstance(given, str | Path) and _is_study(Path(given)))
    if is_study:
        if of_log or plant is not None:
            name = next(iter(of_log), "plant")
            raise BadInput(f"{name} belongs to a log; the study says it itself, so change it there.")
        if isinstance(given, Study):
            return given
        return read_study(Path(given), Path(), None if data is None else Path(data))
    if isinstance(plant, str):
        plant = find(plant)
    if isinstance(plant, Plant):
        raise BadInput(f"identify takes the class, up.{type(plant).__name__}, and what is known in known={{...}}.")
    if plant is not None and not (isinstance(plant, type) and issubclass(plant, Plant)):
        raise BadInput(f"identify takes a plant such as up.Pendulum, or its name, got {type(plant).__name__}.")
    from upright.study.draft.from_record import study_of_record

    log: Any = given
    return study_of_record(open_log(log)[0], plant, **options)


def _is_study(path: Path) -> bool:
    return path.suffix.lower() in (".toml", "")
