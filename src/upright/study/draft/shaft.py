"""Which study would a person write for a log of carts or disks? What every other plant's draft says, said for chains.

Nobody measured how hard the drive pushes: 1 N/V (N m/V) is assumed, and masses, springs and friction follow from the
motion. The report then says everything in volts, seconds and counts too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upright.physics import Plant, find
from upright.readers.suspect_columns import DAC_COUNTS_PER_VOLT
from upright.records import Record
from upright.study.draft.shaft_columns import Sight
from upright.study.draft.shaft_guesses import Starts, starts
from upright.study.rig import per
from upright.study.sensors import Array

COUNTS = {
    "rad": ("counts_per_rev", 16000.0, "ECP 205 has 16000"),
    "m": ("counts_per_m", 226629.0, "ECP 210 has 16000 counts per 7.06 cm"),
}
REACH = 10.0
"""Volts that ECP's converter can put out; its log shows what the program asked for."""

_SI = {"mm": 1e-3, "deg": float(np.pi / 180)}


def chain_parts(record: Record, sight: Sight, file: str, stem: str) -> list[str]:
    """Tables of a study, as text."""
    plant = find(sight.found.plant)
    start = _starts(record, sight, plant)
    return [
        _rig(record, sight, plant, start),
        _parameters(record, sight, plant, start),
        _drive(record, sight, plant, start),
        *(_sensor(record, sight, plant, name) for name in sight.found.columns),
        _runs(record, sight, start, file, stem),
    ]


def _factor(sight: Sight, plant: type[Plant], name: str) -> float:
    """SI per unit of a column."""
    c = sight.found.columns[name]
    unit = next(k.unit for k in plant.coordinates if k.name == name)
    if c.guess == "counts":
        return 2 * np.pi / 16000 if unit == "rad" else 1 / 226629
    return _SI.get(c.guess, 1.0)


def volts(sight: Sight) -> tuple[str, float]:
    """Unit of the command and its factor on the column: a loop's output in counts is the converter's."""
    c = sight.found.drive
    assert c is not None
    if c.guess == "counts" or any("DAC" in lie for lie in c.lies):
        return "V", 1 / DAC_COUNTS_PER_VOLT
    return c.unit or c.guess or "V", 1.0


def _command(record: Record, sight: Sight, rows: NDArray[np.bool_]) -> Array | None:
    if sight.found.drive is None:
        return None
    u = record[sight.found.drive.name][rows] * volts(sight)[1]
    return -u if sight.found.reversed else u


def _starts(record: Record, sight: Sight, plant: type[Plant]) -> Starts:
    a, b = sight.windows[0]
    rows = (record.t >= a) & (record.t <= b)
    names = list(sight.found.columns)
    factors = [_factor(sight, plant, n) for n in names]
    bodies = [
        (record[sight.found.columns[n].name][rows] - sight.found.rest[n]) * f
        for n, f in zip(names, factors, strict=True)
    ]
    free = [n not in (*sight.held, *sight.locked) for n in names]
    quanta = [(sight.found.columns[n].quantum.step or 0.0) * f for n, f in zip(names, factors, strict=True)]
    return starts(
        record.t[rows], _command(record, sight, rows), bodies, free,
        disks=sight.found.plant.startswith("tors"), quanta=quanta, loop=sight.reference is not None,
        reach=REACH if sight.found.drive is not None and volts(sight)[1] != 1.0 else np.inf,
    )  # fmt: skip


def _rig(record: Record, sight: Sight, plant: type[Plant], start: Starts) -> str:
    coordinates = ", ".join(f"{c.name} [{c.unit}] {c.meaning}" for c in plant.coordinates)
    lines = ["[rig]", f'plant = "{sight.found.plant}"   # coordinates: {coordinates}']
    every = int(2 * np.pi / start.fastest / 120 / record.period)
    if not sight.loop and every > 1:
        grid = min(every, 4) * record.period
        lines.append(f'period = "{grid * 1e3:.6g} ms"   # the log has a sample every {record.period * 1e3:.4g} ms')
    return "\n".join(lines) + "\n"


def _parameters(record: Record, sight: Sight, plant: type[Plant], start: Starts) -> str:
    driven = sight.found.drive is not None
    names = [c.name for c in plant.coordinates]
    stuck = [n in (*sight.held, *sight.locked) for n in names]
    carts = sight.found.plant.startswith("rect")
    lines, rest = ["[parameters]"], list[str]()
    scaled = driven
    for name in plant.names():
        what = plant.quantity(name)
        unit = "" if what.unit == "1" else f" {what.unit}"
        value = start.numbers.get(name)
        body = int(tail[-1]) - 1 if (tail := name.rstrip("cqs"))[-1].isdigit() else -1
        if name[:2] in ("m_", "J_") and stuck[body]:
            lines.append(f'{name} = "{value or 1.0:.3g}{unit}"   # {what.meaning}; held, so it does not matter')
        elif name[:2] in ("m_", "J_") and not scaled:
            scaled = True
            lines.append(
                f'{name} = {{ value = "{value or 1.0:.3g}{unit}", assumed = true }}   # {what.meaning}; MEASURE: a free'
                " swing sees only ratios"
            )
        elif carts and name == "k_12" and driven and len(stuck) == 2 and stuck[1]:
            lines.append(
                f'{name} = "{start.numbers["k_1"] / 2:.3g}{unit}"   # {what.meaning}; MEASURE: with body 2'
                " held, only k_1 + k_12 is seen"
            )
        elif carts and name == "k_1" and stuck[0] and len(stuck) > 1:
            lines.append(f'{name} = "0{unit}"   # {what.meaning}; pulls at the hand')
        elif name.startswith("delta_") and not driven and not stuck[body]:
            lines.append(_presliding(sight, plant, name, unit))
        elif value is not None:
            half = 0.5 if carts and name == "k_1" and len(stuck) == 2 and stuck[1] else 1.0
            lines.append(f'{name} = {{ guess = "{half * value:.3g}{unit}", min = 0 }}   # {what.meaning}')
        else:
            rest.append(f'# {name} = {{ guess = "0{unit}" }}   # {what.meaning}')
    return "\n".join([*lines, "# left at zero until asked for:", *rest]) + "\n"


def _presliding(sight: Sight, plant: type[Plant], name: str, unit: str) -> str:
    """A free swing ends in small reversals, which tell how far a body moves before its friction is whole."""
    coordinate = plant.coordinates[int(name[-1]) - 1].name
    c = sight.found.columns[coordinate]
    factor = _factor(sight, plant, coordinate)
    least = max(3 * (c.quantum.step or 0.0), 1e-4 * (c.high - c.low)) * factor
    meaning = plant.quantity(name).meaning
    return f'{name} = {{ guess = "{5 * least:.2g}{unit}", min = "{least:.2g}{unit}" }}   # {meaning}'


def _drive(record: Record, sight: Sight, plant: type[Plant], start: Starts) -> str:
    c, force = sight.found.drive, plant.inputs[0]
    if c is None:
        return '# [drive]\n# column = "..."   # no column drives: the runs are free\n'
    unit, scale = volts(sight)
    raw = "DAC counts" if scale != 1.0 else unit
    lines = ["[drive]", f'column = "{quoted(c.name)}"   # {c.low:.4g} to {c.high:.4g} {raw}', f'unit = "{unit}"']
    if scale != 1.0:
        lines.append(f"scale = {scale:.6g}   # {DAC_COUNTS_PER_VOLT:g} counts per V")
    lines += ["sign = -1   # the first command moves the column down"] if sight.found.reversed else []
    speed = next(f"{k.unit}/s" for k in plant.coordinates if k.name == force.on)
    damping = per(force.unit, speed)
    lines += [
        "",
        "[actuator]",
        f'gain = {{ value = "1 {per(force.unit, unit)}", assumed = true }}   # {force.meaning} per command: nobody'
        " measured it, so masses, springs and friction are per that",
    ]
    if start.braked:
        lines.append(
            f'damping = {{ guess = "{start.braked:.3g} {damping}", min = 0 }}   # of the drive while commanded'
        )
        lines.append(
            'relaxation = { guess = "30 ms", min = 0, max = "2 s" }   # time in which that builds up and fades'
        )
    else:
        lines.append(f'# damping = {{ guess = "0 {damping}", min = 0 }}   # of the drive while commanded')
    if start.limit:
        lines.append(f'limit = {{ guess = "{start.limit:.3g} {unit}", min = 0 }}   # the bodies feel no more than that')
    hidden = "" if sight.found.plant.startswith("tors") and not sight.loop else "# "
    lines.append(f'{hidden}delay = {{ guess = "2 ms", max = "50 ms" }}')
    return "\n".join(lines) + "\n"


def _sensor(record: Record, sight: Sight, plant: type[Plant], name: str) -> str:
    c = sight.found.columns[name]
    unit = next(k.unit for k in plant.coordinates if k.name == name)
    lines = [f"[sensors.{name}]", f'column = "{quoted(c.name)}"   # {c.low:.6g} to {c.high:.6g} {c.guess}'.rstrip()]
    if c.guess:
        lines.append(f'unit = "{c.guess}"' + ("" if c.unit else "   # guessed; the log does not say"))
    if c.guess == "counts":
        key, counts, why = COUNTS[unit]
        lines.append(f"{key} = {counts:g}   # MEASURE: {why}; what is said in V, s and counts does not depend on it")
    elif c.quantum.step and c.guess in ("rad", "m"):
        lines.append(f'resolution = "{c.quantum.step:.4g} {c.guess}"   # from the column\'s steps')
    where = "lay before the first command" if sight.found.drive is not None else "comes to rest"
    lines.append(f"offset = {sight.found.rest[name]:.6g}   # reading at which {name} is zero, here where it {where}")
    lines.append("# sign = -1   # when the column counts the other way")
    return "\n".join(lines) + "\n"


def _runs(record: Record, sight: Sight, start: Starts, file: str, stem: str) -> str:
    lines: list[str] = []
    if sight.held:
        lines.append(f"held = {names(sight.held)}   # their measured motion is prescribed")
    if sight.locked:
        lines.append(f"locked = {names(sight.locked)}")
    still = [n for n in sight.waiting if n not in (*sight.held, *sight.locked)]
    if still:
        speeds = ", ".join(f"{n}_dot = 0" for n in still)
        lines.append(f"initial = {{ {speeds} }}   # they wait for the first command")
    unknown = ["initial"]
    tied = sight.found.plant.startswith("rect") or sight.held or sight.locked
    if "ki =" in sight.loop:
        unknown.append("input_offset")  # what the loop had summed up before the window
    elif tied:
        unknown.append("offset")
    unknown += ["friction"] if len(sight.windows) > 2 else []
    unknown += ["input_end"] if start.trips else []
    lines.append(f"unknown = {names(unknown)}   # estimated for each run alone")
    lines += [sight.loop + "   # read off the log"] if sight.loop else []
    parts = ["[defaults]\n" + "\n".join(lines) + "\n"]
    several = len(sight.windows) > 1
    for i, (a, b) in enumerate(sight.windows):
        label = f"{stem} {i + 1}" if several else stem
        parts.append(
            f'[[runs]]\nlabel = "{quoted(label)}"\nfile = "{quoted(file)}"\n'
            f'window = [{a:.5g}, {b:.5g}]   # s\nrole = "fit"   # fitted\n'
        )
    return "\n".join(parts)


def names(items: list[str] | tuple[str, ...]) -> str:
    """A list of texts in TOML."""
    return "[" + ", ".join(f'"{n}"' for n in items) + "]"


def quoted(text: str) -> str:
    """A text between quotes in TOML."""
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
