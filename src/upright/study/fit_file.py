"""What was found, so that another program, or `upright predict`, can use it: `fit.json`.

JSON has no infinity: ``null`` stands for "no bound" (an interval without end, a standard error nobody can state,
an actuator without limit).
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from upright.errors import BadInput
from upright.identification.frequency.answer import Answer
from upright.identification.ladder.crossval import CrossValidation
from upright.identification.model.model import Estimate, Fit
from upright.physics.actuator import ACTUATOR
from upright.study.load import Study

FORMAT = 1


@dataclass(frozen=True, kw_only=True)
class FittedModel:
    """What `upright predict` takes from a `fit.json`: the plant's name, every parameter [SI], and what groups share."""

    plant: str
    values: Mapping[str, float]
    substeps: int
    verdict: str
    trusted: bool
    groups: Mapping[str, Mapping[str, float]] = field(default_factory=dict[str, Mapping[str, float]])


def write_fit(fit: Fit, study: Study, path: Path, crossed: CrossValidation | None = None) -> dict[str, Any]:
    """Write `fit.json` and return what it holds; `crossed` adds what each run's prediction by the others scored."""
    content = as_json(fit, study)
    if crossed is not None:
        content["cross_validation"] = {
            label: {
                "fit_percent": {n: _finite(v) for n, v in s.fit_percent.items()},
                "blind": list(crossed.blind[label]),
            }
            for label, s in crossed.predicted.items()
        }
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")  # a reader never meets half a file
    part.write_text(json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False) + "\n", encoding="utf-8")
    os.replace(part, path)
    return content


def as_json(fit: Fit, study: Study) -> dict[str, Any]:
    """Content of `fit.json`: plain dicts, lists, text and finite numbers."""
    from upright import __version__

    known = {
        name: Estimate(
            value=p.value,
            stderr=p.uncertainty,
            interval=_known_interval(p.value, p.uncertainty),
            unit=p.unit,
            status="known",
        )
        for name, p in fit.rig.parameters.items()
    }
    estimates = {**known, **fit.estimates}
    meanings = {name: p.meaning for name, p in fit.rig.parameters.items()}
    return {
        "format": FORMAT,
        "title": study.title,
        "plant": study.plant,
        "substeps": fit.rig.substeps,
        "verdict": fit.verdict,
        "trusted": fit.trusted,
        "method": fit.method,
        "evaluations": fit.evaluations,
        "seconds": round(fit.seconds, 4),
        "cost": _finite(fit.cost),
        "interrupted": fit.interrupted,
        "parameters": {n: {**_estimate(e), "meaning": meanings.get(n, "")} for n, e in estimates.items()},
        "assumed": [
            {
                "name": a.name,
                "value": a.value,
                "unit": a.unit,
                "percent_per_percent": {n: round(e, 6) for n, e in a.follows.items()},
                "without_it": {n: _estimate(e) for n, e in a.without.items()},
            }
            for a in fit.assumptions
        ],
        "per_run": {label: {n: _estimate(e) for n, e in own.items()} for label, own in fit.per_run.items()},
        "groups": {label: {n: _estimate(e) for n, e in own.items()} for label, own in fit.groups.items()},
        "runs": {
            label: {
                "role": score.role,
                "fit_percent": {n: _finite(v) for n, v in score.fit_percent.items()},
                "horizon": score.horizon,
                "score_from": score.score_from,
                "naive": {n: _finite(v) for n, v in score.naive.items()},
                "adapted": list(score.adapted),
                "ahead": [
                    {"horizon": h, "fit_percent": {n: _finite(v) for n, v in percents.items()}}
                    for h, percents in score.ahead.items()
                ],
            }
            for label, score in fit.runs.items()
        },
        "poles": {
            at: [{"real": _estimate(p.real), "imag": _estimate(p.imag)} for p in found]
            for at, found in fit.poles.items()
        },
        "unseen": list(fit.unseen),
        "warnings": list(fit.warnings),
        "estimated": list(fit.names),
        "correlation": [[_finite(v) for v in row] for row in fit.correlation.tolist()],
        "singular_values": [_finite(v) for v in fit.singular_values.tolist()],
        "directions": [[_finite(v) for v in row] for row in fit.directions.tolist()],
        "history": [{"stage": s, "cost": _finite(c), "evaluations": n} for s, c, n in fit.history],
        "provenance": {
            "upright": __version__,
            "study": study.path.name,
            "study_sha256": study.sha256,
            "source": study.source,
            "runs": {run.label: run.source for run in study.runs},
        },
    }


def _known_interval(value: float, uncertainty: float) -> tuple[float, float]:
    return value - 1.96 * uncertainty, value + 1.96 * uncertainty


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _estimate(e: Estimate) -> dict[str, Any]:
    return {
        "value": _finite(e.value),
        "stderr": _finite(e.stderr),
        "interval": [_finite(e.interval[0]), _finite(e.interval[1])],
        "unit": e.unit,
        "status": e.status,
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
