"""What a ladder found, for programs and for the next fit: `ladder.json`, and the study of the chosen model."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from upright.files import plain_values, write_json
from upright.identification.ladder.growth import Ladder, RungResult
from upright.identification.ladder.rungs import neutral
from upright.physics.actuator import ACTUATOR
from upright.study.fit_file import provenance
from upright.study.load import Study
from upright.study.text import StudyText

FORMAT = 1


def write_ladder(ladder: Ladder, study: Study, path: Path) -> dict[str, Any]:
    """Write `ladder.json` and return what it holds."""
    content = {
        "format": FORMAT,
        "title": study.title,
        "plant": study.plant,
        "held_out": ladder.held_out,
        "chosen": [s.rung.name for s in ladder.accepted],
        "left_out": ladder.left_out,
        "stopped": ladder.stopped,
        "interrupted": ladder.interrupted,
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
        "warnings": ladder.warnings,
        "provenance": provenance(study),
    }
    write_json(path, content)
    return plain_values(content)


def _step(s: RungResult) -> dict[str, Any]:
    c = s.comparison
    return {
        **vars(s.rung),
        "kept": s.accepted,
        "reason": s.reason,
        "fit_percent": s.fit_percent,
        "predicted_percent": s.predicted_percent,
        "fitted": s.fitted,
        "predicted": s.predicted,
        "gain": None if c is None else c.gain,
        "scatter": None if c is None else c.scatter,
        "cost": s.cost,
        "parameters": s.parameters,
        "per_run": s.per_run,
        "values": s.values,
        "seconds": round(s.seconds, 3),
    }


def chosen_study(study: Study, ladder: Ladder) -> str:
    """Text of the study with the terms that the ladder refused known to do nothing, and without its rungs.

    What kept rungs estimate run by run is written beside the runs, as a line to add.
    """
    text = StudyText(study.path)
    lines = text.text.splitlines()
    cut = _lines_of_ladder(lines)
    told = {_line(text, n) for n in ladder.left_out}
    out = [f"# {study.path.name} as far as the ladder kept it; files are where the study's own are: use --data."]
    for number, line in enumerate(lines, start=1):
        if number in cut:
            continue
        if number in told:
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
    found = next(n for n in names if _line(text, n) == number)
    plant = study.rig.plant
    if found in ACTUATOR or _has_default(study, found):
        return []
    return [f"{found} = {neutral(plant, found):g}"]


def _has_default(study: Study, name: str) -> bool:
    from dataclasses import MISSING, fields

    return any(f.name == name and f.default is not MISSING for f in fields(study.rig.plant))  # type: ignore[arg-type]


def _lines_of_ladder(lines: Sequence[str]) -> set[int]:
    """Numbers of the lines of [[ladder]] tables, up to the next table."""
    inside, found = False, set[int]()
    for number, line in enumerate(lines, start=1):
        if line.lstrip().startswith("["):
            inside = line.replace(" ", "").startswith("[[ladder]]")
        if inside:
            found.add(number)
    return found


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
