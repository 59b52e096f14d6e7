"""Every key of a study, with its form and meaning; the check and docs/reference/study.md both come from here."""

from __future__ import annotations

import math
from typing import NamedTuple

from upright.identification.model.runs import FOR_GROUPS, PER_RUN
from upright.physics.actuator import ACTUATOR
from upright.readers.reader import READERS


class Key(NamedTuple):
    """One key of a study: name, how its value is written, what it means."""

    name: str
    form: str
    meaning: str


_SENSOR = (
    Key("column", '"theta"', "column of the log that measures this coordinate; the coordinate's own name if omitted"),
    Key(
        "expression",
        '"theta_2 - theta_1"',
        "sum of coordinates that the column measures, in the unit of this one; the coordinate itself if omitted",
    ),
    Key("unit", '"counts"', "unit of the column (rad, deg, rev, m, mm, counts, ...); as the log states it if omitted"),
    Key("counts_per_rev", "14400", "encoder counts per turn: scale of a column in counts, else its resolution only"),
    Key("counts_per_m", "226629", "the same for a coordinate in m"),
    Key("scale", "1.02", 'factor; on a column of another kind SI per unit, as in "35 deg/V"'),
    Key("sign", "-1", "+1 or -1: -1 when the column counts against the coordinate"),
    Key("offset", '"180 deg"', "reading at which the coordinate is zero; a plain number is in the column's unit"),
    Key("resolution", '"0.1 deg"', "smallest step of the sensor, when no counts are given"),
)
_DRIVE = (
    Key("column", '"v"', "column of the log that commands the actuator"),
    Key("expression", '"2.5*(0.2 - z)"', "or arithmetic on columns and the time t; see Expressions"),
    Key("unit", '"V"', "unit of the command; read off the gain's unit if omitted"),
    Key("scale", "0.001", "factor on the command"),
    Key("sign", "-1", "+1 or -1: -1 when a positive command drives backwards, as the rig's laws then know"),
)
_SHARED = (
    Key("window", "[1.0, 9.0]", 'seconds of the log that count; "start" and "end" are allowed'),
    Key("role", '"fit"', '"fit" (the default) or "predict": scored, never seen by the estimator'),
    Key("drive", '"v", 0 or a table', "replaces [drive] for this run; 0 is a free run"),
    Key("inputs", "table", "replaces [inputs.NAME] for this run"),
    Key("sensors", "table", "changes keys of [sensors.COORDINATE] for this run"),
    Key("measured", '["theta"]', "coordinates compared with the model; every sensor if omitted"),
    Key("locked", "{ x = 0.0 }", "coordinates that could not move, and where they were; a list of names means at zero"),
    Key("held", '["x"]', "coordinates moved from outside: their measured motion is prescribed"),
    Key("known", '{ a_1 = "0.5 kg" }', "parameters that differ in this run and are known"),
    Key(
        "unknown",
        '["initial"]',
        f"what is estimated for this run alone, of {', '.join(PER_RUN)}, offset.COORDINATE, scale.COORDINATE",
    ),
    Key(
        "shared",
        '{ friction = "28 Jan" }',
        f"what is estimated once for all runs that give the same label, of {', '.join(FOR_GROUPS)}, offset.COORDINATE,"
        " scale.COORDINATE",
    ),
    Key(
        "spread",
        "{ friction = 0.15 }",
        "by how much friction, gain or scale.COORDINATE may reasonably differ from 1 in this run, one sigma of the"
        " logarithm; 0.3, 1 and 1 if omitted",
    ),
    Key("initial", '{ theta = "1 rad" }', "states known at the first sample; these are not estimated"),
    Key(
        "horizon",
        '"0.5 s" or ["50 ms", "200 ms"]',
        "predict this far ahead, again and again, from measured states; free run if omitted. A list is explained "
        'together, from the states of a Kalman filter: restart = "kalman"',
    ),
    Key(
        "restart",
        '"kalman"',
        '"smooth" (the default for one horizon): predict from smoothed measurements; "kalman": from a filter that '
        "knows the past alone, exactly so far ahead, for a plant that its loop keeps at an equilibrium",
    ),
    Key("repeats", '"step 0.5 V"', "runs with the same label here repeat one another; the same command needs no label"),
    Key("score_from", '"30 s"', "seconds after the window's start before which nothing is scored"),
    Key("loop", "table", "law that closed the loop, simulated with the plant"),
    Key("period", '"2 ms"', "sample period to resample to; the log's own if omitted"),
    Key("reader", '"table"', f"reader of the file ({', '.join(READERS.own)}), when it is not recognised"),
    Key("time", '"stamp"', "column that holds the time [s], when the reader took another one"),
    Key("time_unit", '"ms"', "unit of the time column, when its name states none; seconds if omitted"),
)

SECTIONS: dict[str, tuple[str, tuple[Key, ...]]] = {
    "": (
        "The study",
        (
            Key("title", '"Crane, three gains"', "heading of the report"),
            Key("source", '"https://..."', "where the data come from; text for the report"),
            Key("rig", "table", "the plant, and what its servo keeps to"),
            Key("parameters", "table", "every number of the plant: known or estimated"),
            Key("actuator", "table", "what stands between command and force"),
            Key("sensors", "table", "how a column becomes a coordinate"),
            Key("drive", "table", "what commands the (first) input; a run without it is free"),
            Key("inputs", "table", "the same by name of the input, for plants with several"),
            Key("defaults", "table", "keys of [[runs]] that all runs share"),
            Key("runs", "list of tables", "stretches of data"),
            Key("ladder", "list of tables", "rungs for `upright ladder`; friction, then drive, if omitted"),
        ),
    ),
    "rig": (
        "[rig]",
        (
            Key("plant", '"cart-pendulum"', 'built-in plant, or "my_plant.py:MyRig" beside the study'),
            Key(
                "guessed",
                "true",
                "the plant is a guess: its numbers count as one until a run that was not fitted is predicted",
            ),
            Key("substeps", "2", "integration steps per sample"),
            Key("period", '"2 ms"', "sample period that all runs are resampled to; each log's own if omitted"),
            Key("name", '"bench 3"', "what its owner calls the rig; a fit that meets another rig says so"),
            Key(
                "vendor",
                '"ECP 205"',
                "whose data sheet says what is left out of drive, encoders and servo (ECP 205, ECP 210); without it"
                " nothing is filled in: what a verb needs, it asks for",
            ),
            Key("servo_period", '"2 ms"', "time between two commands of the controller; a value as below"),
            Key("travel", '"0.2 m"', "how far the driven body may go either way; a value as below"),
            Key("speed_limit", '"1.5 m/s"', "speed of the driven body at which the drive trips; a value as below"),
            Key("twist", '"20 deg"', "how far the ends of a flexible shaft may go apart; a value as below"),
        ),
    ),
    "value": (
        "Values of [parameters], [actuator], servo and encoder counts",
        (
            Key("value", '"0.23 m"', "a known number"),
            Key("uncertainty", '"2 mm" or "1 %"', "its standard uncertainty"),
            Key(
                "assumed",
                "true",
                "a number that was not measured: no estimate that rests on it can be used",
            ),
            Key("measured", "true", "a known number that somebody measured on this rig, as one with an uncertainty is"),
            Key("guess", '"1.6e-3 kg m^2"', "a number to estimate, and where to start"),
            Key(
                "min",
                "0",
                "lower bound of the estimate, else the plant's own; least that an assumed number may be, else a tenth",
            ),
            Key(
                "max",
                '"5e-3 kg m^2"',
                "upper bound of the estimate; most that an assumed number may be, else ten times it",
            ),
        ),
    ),
    "actuator": (
        "[actuator]",
        (
            *(
                Key(
                    name.partition(".")[2],
                    '"2 N/V" or a table as above' if name.endswith("gain") else "value",
                    f"{what.meaning}; {'none' if math.isinf(what.default) else f'{what.default:g}'} if omitted",
                )
                for name, what in ACTUATOR.items()
            ),
            Key("converter", '"0.3 mV"', "smallest step of the command, for simulations; not rounded if omitted"),
            Key("bits", "12", "of the converter instead of its step, together with"),
            Key("range", '"10 V"', "its largest command to either side: the step is 2 range/2^bits"),
        ),
    ),
    "sensors": ("[sensors.COORDINATE]", _SENSOR),
    "drive": ("[drive], [inputs.NAME]", _DRIVE),
    "runs": (
        "[[runs]]",
        (
            Key("label", '"kP 10"', "name in the report; the file's name if omitted"),
            Key("file", '"logs/run_03.mat"', "log, relative to the study or to --data"),
            *_SHARED,
        ),
    ),
    "defaults": ("[defaults]", _SHARED),
    "ladder": (
        "[[ladder]]",
        (
            Key("name", '"Coulomb friction"', "name of the rung"),
            Key(
                "adds", '["b_1c", "actuator.knee"]', "parameters estimated from this rung on; below it they do nothing"
            ),
            Key("drops", '["b_1"]', "parameters of rungs below that this one does without"),
            Key("unknown", '["friction"]', "what is estimated run by run from this rung on, as in [[runs]]"),
        ),
    ),
    "loop": (
        "runs.loop",
        (
            Key("kind", '"pid"', '"state" (the default), "pid", "general", or "recover": found in the log itself'),
            Key("gains", '{ x = "2.5 V/m" }', "state: gain per state; u = drive + k_pf r - K (y - offset)"),
            Key("k_pf", '"2.5 V/m"', "state: gain of the reference; the first gain if omitted"),
            Key("alpha", "0.9", "state: pole of the differentiator's filter (0: plain difference)"),
            Key("measured", '"psi_1"', "coordinates the law reads, one or a list; the first one, or every sensor"),
            Key("reference", '"0.2 m", a column or an expression', "what the loop follows, in SI; a list for several"),
            Key("kp", '"2 V/rad"', "pid: gain of the error; a list for several coordinates"),
            Key("ki", '"5 V/(rad s)"', "pid: gain of its sum"),
            Key("kd", '"0.1 V s/rad"', "pid: gain of its difference"),
            Key("tau", '"20 ms"', "pid: time constant of the difference's low pass"),
            Key("taps", "[0.2, 0.8]", "pid: weights of this difference and the one before"),
            Key("on", '"measurement"', 'pid: what is differenced, "error" (the default) or "measurement"'),
            Key("A", "[[1.0]]", "general: z+ = A z + B w, u = C z + D w, w = measured, then references; B, C, D alike"),
            Key("B", "[[-0.001, 0.001]]", "general: see A"),
            Key("C", "[5.0]", "general: see A"),
            Key("D", "[-2.0, 2.0]", "general: see A"),
            Key("command", '"duty"', "recover: column that the law put out; that of [drive] if omitted"),
            Key("feedforward", '"ff"', "recover: columns that were added to the law's output"),
            Key("units", '"log"', 'gains between the columns of the log as its program had them; "SI" if omitted'),
            Key("sign", "-1", "of the law's output in the drive's; that of the drive if omitted, 1 in SI"),
            Key("limit", "5", "largest output of the law, in its own unit"),
            Key("windup", '"hold"', 'whether sums stand still at the limit; "free" if omitted'),
            Key("delay", "1", "samples by which the command comes late"),
            Key("period", '"0.885 ms"', "sample period of the law, a whole part of the run's; the run's if omitted"),
            Key("quantized", "true", "simulate encoder counts and rounded commands; best where nothing is fitted"),
        ),
    ),
}
"""Sections by their short name: heading and keys."""


def names(section: str) -> tuple[str, ...]:
    """Names of the keys of one section."""
    return tuple(key.name for key in SECTIONS[section][1])


def reference() -> str:
    """Markdown tables of all keys."""
    parts: list[str] = []
    for section, (heading, keys) in SECTIONS.items():
        if section == "defaults":
            parts.append("### `[defaults]`\n\nEvery key of `[[runs]]` except `label` and `file`.")
            continue
        title = heading if " " in heading and not heading.startswith("[") else f"`{heading}`"
        rows = "\n".join(f"| `{key.name}` | `{key.form}` | {key.meaning} |" for key in keys)
        parts.append(f"### {title}\n\n| key | for example | meaning |\n|---|---|---|\n{rows}")
    return "\n\n".join(parts) + "\n"


def write_reference(page: str) -> str:
    """A page whose part after the mark is replaced by the tables."""
    head, mark, _ = page.partition("<!-- keys")
    note = "<!-- keys: written by python -m upright.study.keys -->"
    return f"{head}{note if mark else ''}\n\n{reference()}"


if __name__ == "__main__":
    import sys
    from pathlib import Path

    file = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/reference/study.md")
    file.write_text(write_reference(file.read_text(encoding="utf-8")), encoding="utf-8")
