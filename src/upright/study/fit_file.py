"""What a fit found, written to `fit.json` and read back by `upright predict` and `upright design`.

JSON has no infinity: ``null`` stands for "no bound" (an interval without end, a standard error nobody can state,
an actuator without limit).
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.files import plain_values, write_json
from upright.identification import Estimate, Fit
from upright.identification.frequency.answer import Answer
from upright.identification.ladder.cross_validation import CrossValidation
from upright.physics.actuator import ACTUATOR
from upright.study.load import Study

FORMAT = 1


@dataclass(frozen=True, kw_only=True)
class FittedModel:
    """What is read of a `fit.json`: the plant's name, every parameter [SI], what groups share, and all content."""

    plant: str
    values: Mapping[str, float]
    substeps: int
    verdict: str
    trusted: bool
    groups: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])
    content: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def unit(self, name: str) -> str:
        """Unit of a parameter, "" where the file does not tell."""
        return str((self.content["parameters"].get(name) or {}).get("unit") or "")

    def covariance(self, among: Collection[str]) -> tuple[list[str], NDArray[np.float64]]:
        """Those of the estimates that are `among` the names, and their covariance; zeros where the file has none."""
        estimated = [str(n) for n in self.content.get("estimated", [])]
        kept = [i for i, n in enumerate(estimated) if n in among]
        names = [estimated[i] for i in kept]
        entries = [self.content["parameters"].get(n) or {} for n in names]
        errors = np.array([float(e.get("stderr") or 0.0) for e in entries])
        correlation = np.array([[float(v or 0.0) for v in row] for row in self.content.get("correlation") or []])
        if correlation.shape != (len(estimated), len(estimated)):
            correlation = np.zeros((len(estimated), len(estimated)))
        return names, correlation[np.ix_(kept, kept)] * np.outer(errors, errors)


def write_fit(fit: Fit, study: Study, path: Path, crossed: CrossValidation | None = None) -> dict[str, Any]:
    """Write `fit.json` and return what it holds; `crossed` adds what each run's prediction by the others scored."""
    known = {
        name: Estimate(
            value=p.value,
            stderr=p.uncertainty,
            interval=(p.value - 1.96 * p.uncertainty, p.value + 1.96 * p.uncertainty),
            unit=p.unit,
            status="known",
        )
        for name, p in fit.rig.parameters.items()
    }
    meanings = {name: p.meaning for name, p in fit.rig.parameters.items()}
    content: dict[str, Any] = {
        "format": FORMAT,
        "title": study.title,
        "plant": study.plant,
        "substeps": fit.rig.substeps,
        "verdict": fit.verdict,
        "trusted": fit.trusted,
        "method": fit.method,
        "evaluations": fit.evaluations,
        "seconds": round(fit.seconds, 4),
        "cost": fit.cost,
        "interrupted": fit.interrupted,
        "parameters": {n: {**vars(e), "meaning": meanings.get(n, "")} for n, e in {**known, **fit.estimates}.items()},
        "assumed": [
            {
                "name": a.name,
                "value": a.value,
                "unit": a.unit,
                "percent_per_percent": {n: round(e, 6) for n, e in a.follows.items()},
                "without_it": a.without,
            }
            for a in fit.assumptions
        ],
        "per_run": fit.per_run,
        "groups": fit.groups,
        "runs": {
            label: {
                "role": score.role,
                "fit_percent": score.fit_percent,
                "horizon": score.horizon,
                "score_from": score.score_from,
                "naive": score.naive,
                "adapted": score.adapted,
                "ahead": [{"horizon": h, "fit_percent": percents} for h, percents in score.ahead.items()],
            }
            for label, score in fit.runs.items()
        },
        "poles": fit.poles,
        "unseen": fit.unseen,
        "warnings": fit.warnings,
        "estimated": fit.names,
        "correlation": fit.correlation,
        "singular_values": fit.singular_values,
        "directions": fit.directions,
        "history": [{"stage": s, "cost": c, "evaluations": n} for s, c, n in fit.history],
        "provenance": provenance(study),
    }
    if crossed is not None:
        content["cross_validation"] = {
            label: {"fit_percent": s.fit_percent, "blind": crossed.blind[label]}
            for label, s in crossed.predicted.items()
        }
    write_json(path, content)
    return plain_values(content)


def provenance(study: Study) -> dict[str, Any]:
    """Which program, study and logs a result came from."""
    from upright import __version__

    return {
        "upright": __version__,
        "study": study.path.name,
        "study_sha256": study.sha256,
        "source": study.source,
        "runs": {run.label: run.source for run in study.runs},
    }


def read_fit(path: Path) -> FittedModel:
    """Model of a `fit.json`.

    Raises
    ------
    BadInput
        When the file is no JSON, was not written by `upright identify`, or a value is no number.
    """
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, ValueError):
        raise BadInput(f"{path} is no fit.json; the first argument is the file that `upright identify` wrote") from None
    wanted = ("plant", "parameters", "verdict")
    if not isinstance(content, dict) or any(key not in content for key in wanted):
        raise BadInput(f"{path} lacks the keys {', '.join(wanted)} of a fit.json; write it with `upright identify`")
    if content.get("format") != FORMAT:
        raise BadInput(f"{path} has format {content.get('format')}, this version reads {FORMAT}; identify again")
    values: dict[str, float] = {}
    parameters: Any = content["parameters"]
    for name, entry in parameters.items() if isinstance(parameters, dict) else ():
        value: Any = entry.get("value") if isinstance(entry, dict) else entry
        if value is None and name in ACTUATOR and math.isinf(ACTUATOR[name].default):
            value = ACTUATOR[name].default
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise BadInput(f"{path}: parameters.{name}.value must be a number, got {value!r}; identify again")
        values[name] = float(value)
    if not values:
        raise BadInput(f"{path} holds no parameters; identify again")
    return FittedModel(
        plant=str(content["plant"]),
        values=values,
        substeps=int(content.get("substeps", 1)),
        verdict=str(content["verdict"]),
        trusted=bool(content.get("trusted", False)),
        groups=_groups(path, content.get("groups", {})),
        content=content,
    )


def _groups(path: Path, content: Any) -> dict[str, dict[str, float]]:
    """Values by group and name."""
    try:
        return {label: {n: float(e["value"]) for n, e in group.items()} for label, group in content.items()}
    except (AttributeError, KeyError, TypeError, ValueError):
        raise BadInput(f"{path}: groups must hold estimates by group and name; identify again") from None


def write_response_fit(answer: Answer, folder: Path, plant: str, title: str, source: str = "") -> None:
    """Write `frequency.csv` and `fit.json`, which `upright design` reads."""
    folder.mkdir(parents=True, exist_ok=True)
    answer.data.to_csv(folder / "frequency.csv")
    study = Study(path=folder / "frequency.csv", plant=plant, rig=answer.rig, runs=(), title=title, source=source)
    write_fit(answer.fit, study, folder / "fit.json")
