"""A fit as `identify` answers it, and what it says of other runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest
from upright.verbs.answer import Answer
from upright.verbs.in_python import worded_for_python
from upright.verbs.values import open_log

if TYPE_CHECKING:
    from upright.identification import Estimate, Fit, RunScore
    from upright.identification.ladder.cross_validation import CrossValidation
    from upright.identification.model.bands import Bands
    from upright.physics import Plant
    from upright.records import Record
    from upright.report.page import Chapter
    from upright.rig import Rig
    from upright.study.load import Study
    from upright.study.stored_fit import StoredFit
    from upright.verbs.control.moving import Played


class FitAnswer(Answer["Fit"]):
    """A fit: ``fit["l_cg"]`` is the estimate of a parameter, with its ``value``, ``stderr`` and ``interval``.

    Attributes
    ----------
    verdict : str
        Whether its numbers can be relied on, and for what.
    trusted : bool
    warnings : tuple of str
    estimates : mapping of str to Estimate
        All of them; `parameters` has them as a table.
    runs : mapping of str to RunScore
        How well each run is explained, with its measured and simulated signals.
    chapter : Chapter
        The whole report; `report` writes it.
    files : tuple of Path
        What was written.
    study : Study
        Runs and model that it was made of.
    value, fit : Fit
        All that the search and the inference found.
    crossed : CrossValidation or None
        Predictions of each run by a fit of the others, with ``hold_out="each"``.
    """

    def __init__(
        self, fit: Fit, chapter: Chapter, files: Sequence[Path], study: Study, crossed: CrossValidation | None
    ) -> None:
        super().__init__(fit, chapter, files)
        self.study, self.crossed = study, crossed

    def __dir__(self) -> list[str]:
        own = {n for n in vars(FitAnswer) | vars(Answer) | vars(self) if not n.startswith("_")}
        return sorted({*own, "verdict", "trusted", "warnings", "estimates", "runs"} - {"brief", "fitted", "crossed"})

    def brief(self) -> Chapter:
        """Verdict, estimates and scores; the whole chapter is what `report` writes."""
        from upright.report.fit.tables import parameter_table, score_table
        from upright.report.page import Part, Picture, Points
        from upright.study.windows import windows

        estimated = {n: p for n, p in self.value.model.parameters.items() if p.estimate}
        fit = replace(self.value, model=replace(self.value.model, parameters=estimated))
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
        rig, estimates = self.value.model, self.value.estimates
        if name in estimates:
            return estimates[name]
        if name not in rig.parameters:
            raise BadInput(f"this fit has no parameter '{name}'; {nearest(name, [*estimates, *rig.parameters])}")
        return rig.parameters[name]

    @property
    def ratios(self) -> Mapping[str, Estimate]:
        """What is known of numbers that rest on assumed ones, per these: ``fit.ratios["b_2/m_p"]``."""
        return {n: e for a in self.value.assumptions for n, e in a.ratios.items()}

    @worded_for_python
    def play(self, run: str = "", **options: Any) -> Played:
        """The identified rig, moving in a page, options as for `up.play`; or one of the `runs`, measured and simulated.

        A run's page has a slider of time; of `options` it takes ``out``.
        """
        from upright.verbs.control.moving import played, played_run

        if run:
            return played_run(_named(self.value.runs, run), self.plant, run, **options)
        return played(self.fitted.rig(seed=options.get("seed", 0), draws=options.get("draws", 200)), **options)

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
        return self.fitted.rig()

    @property
    def fitted(self) -> StoredFit:
        """What `save` writes, as it is read again."""
        from upright.study.results import fit_content
        from upright.study.stored_fit import stored_fit

        return stored_fit(fit_content(self.value, self.study, self.crossed), self.value.model.plant)

    @property
    def plant(self) -> Plant:
        """The plant with the numbers estimated and given."""
        return self.value.plant

    def plot(self, name: str | None = None) -> Any:
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

    @worded_for_python
    def predict(self, other: Any, *, columns: Mapping[str, str] | None = None, units: Mapping[str, str] | None = None,
                window: tuple[float, float] | None = None) -> Prediction:  # fmt: skip
        """How well the fit explains another log: a record, a data frame, a log's file, or a study.

        Of the other log only what the study lists under `unknown` is estimated (its initial state); nothing else is.
        """
        from upright.identification.inference.scoring import predict as score
        from upright.study.load import Study, load_study

        rig = self.value.model
        values = {n: p.value for n, p in rig.parameters.items()} | {
            n: e.value for n, e in self.value.estimates.items() if n in rig.parameters
        }
        if isinstance(other, Study):
            study = other
        elif isinstance(other, str | Path) and Path(other).suffix == ".toml":
            study = load_study(other, fixed=values)
        else:
            from upright.study.draft.from_record import study_of_record

            record = open_log(other)[0]
            known = {n: v for n, v in values.items() if n in rig.plant.names()}
            study = study_of_record(
                record, rig.plant, known=known, ask=[], columns=columns, units=units,
                window=window or (float(record.t[0]), float(record.t[-1])),
            )  # fmt: skip
        runs = [replace(run, role="predict") for run in study.runs]
        fixed = replace(
            rig, parameters={n: replace(p, value=values[n], estimate=False) for n, p in rig.parameters.items()}
        )
        bands = self.value.bands if self.crossed is None else self.crossed.bands
        return prediction(score(values, fixed, runs, bands=bands), self.plant, bands)


@dataclass(frozen=True, kw_only=True)
class PredictedRuns:
    """Scores of runs that were predicted, by their labels."""

    runs: Mapping[str, RunScore]
    plant: Plant


class Prediction(Answer[PredictedRuns]):
    """Scores of runs that a fit has not seen."""

    def plot(self, name: str | None = None) -> Any:
        """Data against the prediction of the first run, or of the run called `name`."""
        from upright.report.fit.figures import fit_figure

        label = name or next(iter(self.value.runs))
        return fit_figure(_named(self.value.runs, label), type(self.value.plant), title=label)

    @worded_for_python
    def play(self, run: str = "", *, out: str | Path | None = None) -> Played:
        """The first run, or the one called `run`, measured and simulated in a page with a slider of time."""
        from upright.verbs.control.moving import played_run

        label = run or next(iter(self.value.runs))
        return played_run(_named(self.value.runs, label), self.value.plant, label, out)


def _named(runs: Mapping[str, RunScore], label: str) -> RunScore:
    if label not in runs:
        raise BadInput(f"no run is called '{label}'; {nearest(label, runs)}")
    return runs[label]


def prediction(runs: Mapping[str, RunScore], plant: Plant, bands: Bands | None) -> Prediction:
    """Scores as an answer."""
    from upright.identification.inference.unseen.promise import promise
    from upright.report.fit.tables import score_table
    from upright.report.page import Chapter, Part

    worst = min((v for s in runs.values() for v in s.fit_percent.values()), default=float("nan"))
    promised = promise(runs, bands)
    part = Part("How much of each signal is explained", (score_table(runs),))
    chapter = Chapter(
        title="Prediction", verdict=f"{promised.sentence} The worst signal is explained to {worst:.1f} %.",
        parts=(part,), sound=promised.holds, warnings=tuple(sentence for s in runs.values() for sentence in s.beyond),
        numbers={
            label: {
                "fit_percent": dict(s.fit_percent), "horizon": s.horizon, "inside": s.inside, "beyond": list(s.beyond),
            }
            for label, s in runs.items()
        },
    )  # fmt: skip
    return Prediction(PredictedRuns(runs=runs, plant=plant), chapter)
