"""Which study would a person write for this log? A commented TOML file with what could be recognised filled in."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from upright.physics import Plant, find
from upright.readers.inspection import Column, Inspection
from upright.readers.suspect_columns import DAC_COUNTS_PER_VOLT
from upright.records import Record
from upright.study.draft.pendulum_upright import (
    Standing,
    standing,
    upright_defaults,
    upright_recognised,
    upright_starts,
)
from upright.study.draft.recognise import Recognised, in_dac_counts, recognise
from upright.study.draft.shaft import chain_parts, names, quoted
from upright.study.draft.shaft_columns import look
from upright.study.rig import per

_G = 9.81
_MANY = 40_000  # samples beyond which a coarser grid is proposed


def draft(record: Record, seen: Inspection, log: Path, study: Path, *, plant: str = "") -> str:
    """Text of a study of one log.

    Parameters
    ----------
    record, seen : Record, Inspection
        The log.
    log, study : Path
        Its file, and where the study will be written: the file is named relative to that.
    plant : str, optional
        Overrides the plant that the columns suggest.
    """
    found = recognise(record, seen, plant)
    file = os.path.relpath(log.resolve(), study.resolve().parent).replace(os.sep, "/")
    if found.plant.startswith(("rectilinear", "torsional")):
        where = "/".join(log.resolve().parts[-3:])
        sight = look(record, seen, found, named=bool(plant), path=where)
        return "\n".join([_head(log, sight.found), *chain_parts(record, sight, file, log.stem)])
    kind = find(found.plant)
    how = standing(record, found)
    found = upright_recognised(found, how) if how else found
    parts = [
        _head(log, found),
        _rig(record, found, kind),
        _parameters(record, found, kind, how),
        _drive(record, found, kind, how),
        *(_sensor(record, seen, found, kind, name) for name in found.columns),
        _runs(found, kind, file, log.stem, how),
    ]
    return "\n".join(part for part in parts if part)


def _head(log: Path, found: Recognised) -> str:
    lines = [
        f"# Study of {log.name}, drafted by `upright init`. Check it, then: upright identify THIS_FILE -o OUT",
        "# A number in quotes wears its unit; { guess = ... } asks for it; a plain text or number is known.",
        "# Lines marked MEASURE hold placeholders. All keys: `upright identify --keys`.",
        *(f"# GUESSED: {doubt}" for doubt in found.doubts),
        f'title = "{quoted(log.stem)}"',
    ]
    return "\n".join(lines) + "\n"


def _rig(record: Record, found: Recognised, plant: type[Plant]) -> str:
    lines = ["[rig]", f'plant = "{found.plant}"   # {_doc(plant)}']
    count = (found.window[1] - found.window[0]) / record.period
    if count > _MANY and found.frequency:
        coarse = max(1, int(2 * np.pi / found.frequency / 200 / record.period)) * record.period
        lines.append(f'period = "{coarse * 1e3:.6g} ms"   # the log has a sample every {record.period * 1e3:.4g} ms')
    return "\n".join(lines) + "\n"


def _doc(plant: type[Plant]) -> str:
    coordinates = ", ".join(f"{c.name} [{c.unit}] {c.meaning}" for c in plant.coordinates)
    return f"coordinates: {coordinates}"


def _parameters(record: Record, found: Recognised, plant: type[Plant], how: Standing | None) -> str:
    known, asked, about = upright_starts(how, found.plant) if how else (*_starts(record, found, plant), {})
    lines = ["[parameters]"]
    rest: list[str] = []
    for name in plant.names():
        what = plant.quantity(name)
        unit = "" if what.unit == "1" else f" {what.unit}"
        if name in known:
            value, why = known[name]
            lines.append(f'{name} = "{value:.4g}{unit}"   # {what.meaning}; {why}')
        elif name in about:
            value, doubt = about[name]
            lines.append(
                f'{name} = {{ value = "{value:.3g}{unit}", uncertainty = "{doubt}" }}   # {what.meaning}; MEASURE'
            )
        elif name in asked:
            lines.append(f'{name} = {{ guess = "{asked[name]:.3g}{unit}" }}   # {what.meaning}')
        elif name != "g":
            rest.append(f'# {name} = {{ guess = "0{unit}" }}   # {what.meaning}')
    return "\n".join([*lines, "# left at zero until asked for:", *rest]) + "\n" if rest else "\n".join(lines) + "\n"


def _starts(
    record: Record, found: Recognised, plant: type[Plant]
) -> tuple[dict[str, tuple[float, str]], dict[str, float]]:
    """What is taken as known, and why; what is asked, and where the search starts."""
    w = found.frequency or 6.0
    length = _G / w**2
    scale = "MEASURE: sets the scale of all forces; a swing alone sees only ratios"
    if found.plant == "pendulum":
        return (
            {"m_p": (1.0, scale), "J_p": (0.0, "with 0, l_cg is the length of the simple pendulum of equal period")},
            {"l_cg": length, "b_2": 0.002 * w * length**2, "b_2c": 0.002 * _G * length, "b_2q": 0.002 * length**2},
        )
    if found.plant in ("cart-pendulum", "furuta"):
        m, wanted = 0.1, {"l_cg": length, "b_2": 0.002 * w * 0.1 * length**2, "b_2c": 0.001 * _G * 0.1 * length}
        known = {"m_p": (m, scale), "J_p": (0.0, "with 0, l_cg is the length of the simple pendulum of equal period")}
        first = plant.coordinates[0].name
        if found.plant == "cart-pendulum":
            known["m_c"] = (1.0, "MEASURE")
            inertia = 1.1
        else:
            known["r"] = (0.1, "MEASURE")
            inertia = 2e-3
            wanted |= {"J_d": 1e-3} if found.drive and first in found.columns else {}
            known |= {} if "J_d" in wanted else {"J_d": (1e-3, "MEASURE; not seen while the arm is held or locked")}
        if found.drive and first in found.columns:
            wanted |= {"b_1": inertia * 1.0, "b_1c": inertia * 0.1}
        return known, wanted
    from dataclasses import MISSING, fields

    required = [f.name for f in fields(plant) if f.default is MISSING]  # type: ignore[arg-type]
    return dict.fromkeys(required[:1], (1.0, "MEASURE")), dict.fromkeys(required[1:], 1.0)


def _swing(record: Record, found: Recognised) -> float:
    """Amplitude of the first coordinate in SI, roughly."""
    c = next(iter(found.columns.values()))
    per = {"counts": 4e-6 if found.plant.startswith("rect") else 4e-4, "mm": 1e-3, "deg": 0.017}.get(c.guess, 1.0)
    return (c.high - c.low) / 2 * per


def _drive(record: Record, found: Recognised, plant: type[Plant], how: Standing | None) -> str:
    if found.drive is None or not plant.inputs:
        return '# [drive]\n# column = "..."   # no column drives: the runs are free\n' if plant.inputs else ""
    c, force = found.drive, plant.inputs[0]
    unit = "V" if in_dac_counts(c) else c.unit or c.guess
    gain_unit = per(force.unit, unit) if unit else force.unit
    low, high = c.low, c.high
    lines = ["[drive]", f'column = "{quoted(c.name)}"   # {low:.4g} to {high:.4g} {unit}'.rstrip()]
    lines += [f'unit = "{unit}"'] if unit else ['# unit = "V"']
    if in_dac_counts(c):
        lines[1] = lines[1].removesuffix(" V") + " DAC counts"
        lines.append(f"scale = {1 / DAC_COUNTS_PER_VOLT:.6g}   # {DAC_COUNTS_PER_VOLT:g} counts per V")
    lines += ["sign = -1   # the first command moves the column down"] if found.reversed else []
    driven = next(iter(found.columns))
    guess = how.gain(found.plant) if how else _gain(record, found)
    speed = next(f"{k.unit}/s" for k in plant.coordinates if k.name == force.on)
    lines += [
        "",
        "[actuator]",
        f'gain = {{ guess = "{guess:.3g} {gain_unit}", min = 0 }}   # {force.meaning} per command; moves {driven} up',
        f'# slope = {{ guess = "0 {per(force.unit, speed)}" }}   # force lost per speed',
        '# lag = { guess = "5 ms", max = "0.1 s" }',
        f'{"" if how else "# "}delay = {{ guess = "1 ms", max = "10 ms" }}',
    ]
    return "\n".join(lines) + "\n"


def _gain(record: Record, found: Recognised) -> float:
    """Force per command of the right size: what the start inertia needs to swing as far as was seen."""
    assert found.drive is not None
    inertia = {"furuta": 2e-3, "cart-pendulum": 1.1}.get(found.plant, 1.0)
    u = max(abs(found.drive.low), abs(found.drive.high)) or 1.0
    u /= DAC_COUNTS_PER_VOLT if in_dac_counts(found.drive) else 1.0
    w = found.frequency or 6.0
    return max(inertia * _swing(record, found) * w**2 / u, 1e-9)


def _sensor(record: Record, seen: Inspection, found: Recognised, plant: type[Plant], name: str) -> str:
    c: Column = found.columns[name]
    coordinate = next(k for k in plant.coordinates if k.name == name)
    lines = [f"[sensors.{name}]", f'column = "{quoted(c.name)}"   # {c.low:.6g} to {c.high:.6g} {c.guess}'.rstrip()]
    if c.guess:
        lines.append(f'unit = "{c.guess}"' + ("" if c.unit else "   # guessed; the log does not say"))
    if c.guess == "counts":
        ecp = seen.reader == "ecp" or any(word in c.name.lower() for word in ("enc", "pos"))
        if coordinate.unit == "rad":
            counts, why = (16000, "ECP rigs have 16000") if ecp else (4096, "see the encoder")
            lines.append(f"counts_per_rev = {counts}   # MEASURE: {why}")
        else:
            lines.append("counts_per_m = 226629   # MEASURE: ECP 210 has 16000 counts per 7.06 cm")
    elif c.quantum.counts_per_rev and coordinate.unit == "rad":
        lines.append(f"counts_per_rev = {c.quantum.counts_per_rev}   # from the column's steps")
    elif c.quantum.step and c.guess in ("rad", "m"):
        lines.append(f'resolution = "{c.quantum.step:.4g} {c.guess}"   # from the column\'s steps')
    zero = found.rest[name]
    lines.append(f"offset = {zero:.6g}   # reading at which {name} is zero, here where it {_how(found)}")
    if found.mirrored and name == plant.coordinates[-1].name:
        lines.append("sign = -1   # it is thrown the other way than the plant's angle")
    else:
        lines.append("# sign = -1   # when the column counts the other way")
    return "\n".join(lines) + "\n"


def _how(found: Recognised) -> str:
    return "lay before the first command" if found.drive is not None else "comes to rest"


def _runs(found: Recognised, plant: type[Plant], file: str, stem: str, how: Standing | None) -> str:
    start, stop = found.window
    missing = [c.name for c in plant.coordinates if c.name not in found.columns]
    shared: list[str] = []
    if missing:
        shared.append(f"locked = {names(missing)}   # no column was found; give them a sensor if they move")
    first = plant.coordinates[0].name
    if found.drive is None and not missing and found.plant in ("cart-pendulum", "furuta"):
        shared.append(f'held = ["{first}"]   # its measured motion is prescribed, since no column says what drove it')
    unknown = ["initial", "offset"] if found.drive is None else ["initial"]
    shared.append(upright_defaults(plant) if how else f"unknown = {names(unknown)}   # estimated for each run alone")
    swings = found.frequency * (stop - start) / (2 * np.pi)
    split = start + 0.6 * (stop - start)
    runs = [(stem, start, stop, "fit")]
    if found.drive is None and swings > 12:
        runs = [(f"{stem} start", start, split, "fit"), (f"{stem} tail", split, stop, "predict")]
    parts = ["[defaults]\n" + "\n".join(shared) + "\n"]
    for label, a, b, role in runs:
        note = "fitted" if role == "fit" else "scored, never seen by the estimator"
        parts.append(
            f'[[runs]]\nlabel = "{quoted(label)}"\nfile = "{quoted(file)}"\n'
            f'window = [{a:.5g}, {b:.5g}]   # s\nrole = "{role}"   # {note}\n'
        )
    return "\n".join(parts)
