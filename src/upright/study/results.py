"""What a fit or a ladder found, for programs and for the next fit: `fit.json`, `ladder.json`, the study of the choice.

JSON has no infinity: ``null`` stands for "no bound" (an interval without end, a standard error nobody can state,
an actuator without limit).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from upright.files import plain_values, write_json
from upright.identification import Estimate, Fit
from upright.identification.frequency.answer import FrequencyFit
from upright.identification.inference.assumptions import resting
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.ladder.growth import Ladder, RungResult
from upright.identification.ladder.rungs import neutral
from upright.physics.actuator import ACTUATOR
from upright.rig.hardware import Hardware
from upright.study.load import Study
from upright.study.rig import plant_relative_to
from upright.study.stored_fit import FORMAT
from upright.study.text import StudyText


def write_fit(fit: Fit, study: Study, path: Path, crossed: CrossValidation | None = None) -> dict[str, Any]:
    """Write `fit.json` and return what it holds; see `fit_content`."""
    content = fit_content(fit, study, crossed)
    content["plant"] = plant_relative_to(path.parent, study.plant, study.path.parent)
    write_json(path, content)
    return content


def fit_content(fit: Fit, study: Study, crossed: CrossValidation | None = None) -> dict[str, Any]:
    """What `fit.json` holds, as plain values; `crossed` adds what each run's prediction by the others scored."""
    ranges = {a.name: a.range for a in fit.assumptions}
    known = {
        name: Estimate(
            value=p.value,
            stderr=p.uncertainty,
            interval=ranges.get(name, (p.value - 1.96 * p.uncertainty, p.value + 1.96 * p.uncertainty)),
            unit=p.unit,
            status="assumed" if p.assumed else "known",
        )
        for name, p in fit.model.parameters.items()
    }
    meanings = {name: p.meaning for name, p in fit.model.parameters.items()}
    bands = fit.bands if crossed is None else crossed.bands
    content: dict[str, Any] = {
        "format": FORMAT,
        "title": study.title,
        "plant": study.plant,
        "rig": _estimated(study.hardware, fit.estimates).plain(),
        "substeps": fit.model.substeps,
        **_fields(fit, "verdict trusted answers method evaluations"),
        "seconds": round(fit.seconds, 4),
        **_fields(fit, "cost interrupted failed not_evaluated"),
        "parameters": {n: {**vars(e), "meaning": meanings.get(n, "")} for n, e in {**known, **fit.estimates}.items()},
        "assumed": [
            {
                "name": a.name,
                "value": a.value,
                "unit": a.unit,
                "size": a.size,
                "percent_per_percent": {n: round(e, 6) for n, e in a.follows.items()},
                "rests": resting(a),
                "range": a.range,
                "ratios": a.ratios,
            }
            for a in fit.assumptions
        ],
        **_fields(fit, "per_run groups"),
        "runs": {
            label: {
                **_fields(score, "role fit_percent horizon score_from naive black_box adapted offer inside beyond"),
                "ahead": [
                    {"horizon": h, "fit_percent": percents, "ceiling": score.ceiling.get(h, {})}
                    for h, percents in score.ahead.items()
                ],
            }
            for label, score in fit.runs.items()
        },
        **_fields(fit, "poles unseen warnings"),
        "estimated": fit.names,
        **_fields(fit, "correlation singular_values directions"),
        "history": [{"stage": s, "cost": c, "evaluations": n} for s, c, n in fit.history],
        "bands": None if bands is None else vars(bands),
        "provenance": provenance(study),
    }
    if crossed is not None:
        content["cross_validation"] = {
            label: {"fit_percent": s.fit_percent, "blind": crossed.blind[label]}
            for label, s in crossed.predicted.items()
        }
    return plain_values(content)


def _estimated(hardware: Hardware, estimates: Mapping[str, Estimate]) -> Hardware:
    """The description with the drive's numbers as they were estimated."""
    entries = {n: e for n, e in hardware.entries.items() if f"actuator.{n}" in estimates}
    return hardware.with_entries({n: replace(e, value=estimates[f"actuator.{n}"].value) for n, e in entries.items()})


def _fields(of: object, names: str) -> dict[str, Any]:
    """Attributes that a file holds by their own names."""
    return {name: getattr(of, name) for name in names.split()}


def provenance(study: Study) -> dict[str, Any]:
    """Which program, study and logs a result came from."""
    from upright._version import __version__

    return {
        "upright": __version__,
        "study": study.path.name,
        "study_sha256": study.sha256,
        "source": study.source,
        "runs": {run.label: run.source for run in study.runs},
    }


def write_response_fit(
    answer: FrequencyFit, folder: Path, plant: str, title: str, source: str = "", known_hardware: Hardware | None = None
) -> None:
    """Write `frequency.csv` and `fit.json`, which `upright design` reads; `known_hardware` is the rig's."""
    folder.mkdir(parents=True, exist_ok=True)
    answer.data.to_csv(folder / "frequency.csv")
    study = Study(
        path=folder / "frequency.csv", plant=plant, model=answer.rig, runs=(), title=title, source=source,
        hardware=known_hardware or Hardware(),
    )  # fmt: skip
    write_fit(answer.fit, study, folder / "fit.json")


def ladder_content(ladder: Ladder, study: Study) -> dict[str, Any]:
    """What `ladder.json` holds, as plain values."""
    content = {
        "format": FORMAT,
        "title": study.title,
        "plant": study.plant,
        "chosen": [s.rung.name for s in ladder.accepted],
        **_fields(ladder, "held_out left_out stopped interrupted warnings"),
        "seconds": round(ladder.seconds, 3),
        "steps": [_step(s) for s in ladder.steps],
        "repeats": [
            {
                "runs": group.labels,
                "ceiling": group.ceiling,
                "range": {n: [min(v), max(v)] for n, v in group.percents.items()},
            }
            for group in ladder.repeats
        ],
        "provenance": provenance(study),
    }
    return plain_values(content)


def _step(s: RungResult) -> dict[str, Any]:
    c = s.comparison
    return {
        **vars(s.rung),
        "kept": s.accepted,
        **_fields(s, "reason fit_percent predicted_percent fitted predicted cost parameters values"),
        "gain": None if c is None else c.gain,
        "scatter": None if c is None else c.scatter,
        "per_run": s.per_run,
        "seconds": round(s.seconds, 3),
    }


def chosen_study(study: Study, ladder: Ladder) -> str:
    """Text of the study with the terms that the ladder refused known to do nothing, and without its rungs.

    What kept rungs estimate run by run is written beside the runs, as a line to add.
    """
    text = StudyText(study.path)
    lines = text.text.splitlines()
    cut = _lines_of_ladder(lines)
    left_lines = {_line(text, n) for n in ladder.left_out}
    out = [f"# {study.path.name} as far as the ladder kept it; files are where the study's own are: use --data."]
    for number, line in enumerate(lines, start=1):
        if number in cut:
            continue
        if number in left_lines:
            out += [f"# not kept: {line.strip()}", *_nothing(study, ladder.left_out, text, number)]
        else:
            out.append(line)
    own = tuple(n for s in ladder.accepted for n in s.rung.unknown)
    if own:
        out.append(f"# The ladder kept, run by run: add {', '.join(own)} to unknown of each of [[runs]].")
    return "\n".join(out).rstrip() + "\n"


def _place(name: str) -> tuple[str, str]:
    return ("actuator", name.partition(".")[2]) if name in ACTUATOR else ("parameters", name)


def _line(text: StudyText, name: str) -> int:
    return text.line(_place(name))


def _nothing(study: Study, names: Collection[str], text: StudyText, number: int) -> list[str]:
    """A line for a parameter that must have a value, though it does nothing."""
    name = next(n for n in names if _line(text, n) == number)
    plant = study.model.plant
    if name in ACTUATOR or _has_default(study, name):
        return []
    return [f"{name} = {neutral(plant, name):g}"]


def _has_default(study: Study, name: str) -> bool:
    from dataclasses import MISSING, fields

    return any(f.name == name and f.default is not MISSING for f in fields(study.model.plant))  # type: ignore[arg-type]


def _lines_of_ladder(lines: Sequence[str]) -> set[int]:
    """Numbers of the lines of [[ladder]] tables, up to the next table."""
    inside, numbers = False, set[int]()
    for number, line in enumerate(lines, start=1):
        if line.lstrip().startswith("["):
            inside = line.replace(" ", "").startswith("[[ladder]]")
        if inside:
            numbers.add(number)
    return numbers


def can_be_trimmed(study: Study, ladder: Ladder) -> bool:
    """Whether the text can say what the ladder chose: every refused term stands on a line of its own.

    A plant that is found beside the study would not be found beside its copy.
    """
    text = StudyText(study.path)
    places = [_line(text, n) for n in ladder.left_out]
    lines = text.text.splitlines()
    alone = all(
        lines[number - 1].lstrip().split("=")[0].strip().strip("\"'") == _place(name)[1]
        for number, name in zip(places, ladder.left_out, strict=True)
    )
    return alone and len(set(places)) == len(places) and ":" not in study.plant
