"""Law of a run from its table `loop`, so that plant and controller are simulated together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upright.closed_loop import Channel, ClosedLoop, Filter, joined, recover_law
from upright.closed_loop.structures import memory_before
from upright.errors import nearest
from upright.laws import Law, state_feedback
from upright.physics import Plant
from upright.records import Array, Record
from upright.study import expressions
from upright.study.coordinates import Sensors
from upright.study.keys import names
from upright.study.rig import per
from upright.study.sensors import Drive, Grid, Sensor, read_sign
from upright.study.text import Section, as_written, in_si
from upright.units import in_unit


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What a loop is read against: the run's data, coordinates, drive, the command's unit and its column."""

    plant: type[Plant]
    record: Record
    grid: Grid
    coordinates: Sensors
    drive: Drive
    unit: str
    command: str

    @property
    def sensors(self) -> dict[str, Sensor]:
        """Sensors by coordinate."""
        return {name: sensor for name, (sensor, _) in self.coordinates.by_coordinate.items()}

    @property
    def period(self) -> float:
        """Time between two rows [s]."""
        return float(self.grid.t[1] - self.grid.t[0])


def state_units(plant: type[Plant]) -> dict[str, str]:
    """Unit of each state by name, in the paper's order."""
    return {
        name: unit for c in plant.coordinates for name, unit in ((c.name, c.unit), (f"{c.name}_dot", f"{c.unit}/s"))
    }


def read_loop(run: Section, scene: Scene) -> ClosedLoop | None:
    """Law of one run with its references; None without one."""
    if "loop" not in run:
        return None
    section = run.section("loop")
    section.check(names("loop"))
    _check_sums(section, scene)
    kind = section.values.get("kind", "state")
    if kind not in tuple(KINDS):  # it may be no word at all
        near = nearest(str(kind), KINDS)
        raise section.error("kind", f"kind must be one of {', '.join(KINDS)}, got {as_written(kind)}; {near}")
    return KINDS[kind](section, scene)


def _check_sums(section: Section, scene: Scene) -> None:
    """Refuse a law between columns, or on counts, where a column measures a sum of coordinates."""
    summed = next((sensor.column for sensor in scene.sensors.values() if sensor.of), "")
    key = "kind" if section.values.get("kind") == "recover" else "units" if is_raw(section) else "quantized"
    if summed and (key != "quantized" or section.flag("quantized")):
        raise section.error(
            key, f"'{summed}' measures a sum of coordinates, and this law would read it as it is; write the law in SI"
            " on the coordinates, not quantized, or leave loop out and let the recorded command drive the plant",
        )  # fmt: skip


def _state(section: Section, scene: Scene) -> ClosedLoop:
    """``u = drive + k_pf r - K (y - offset)``."""
    gains = section.section("gains")
    states = state_units(scene.plant)
    gains.check(states, f"state of {scene.plant.__name__} called")
    if not gains.values:
        raise section.error("gains", f"a loop needs gains per state, such as gains = {{ {next(iter(states))} = 2.5 }}")
    values = {name: gain(gains, name, scene.unit, states[name]) for name in gains.values}
    first = next(iter(values))
    k_pf = gain(section, "k_pf", scene.unit, states[first]) if "k_pf" in section else values[first]
    alpha = section.number("alpha", "1", 0.0)
    if not 0 <= alpha < 1:
        raise section.error("alpha", f"alpha must be at least 0 and below 1, got {alpha:g}")
    every = every_of(section, scene)
    measured = [c.name for c in scene.plant.coordinates if c.name in values or f"{c.name}_dot" in values]
    law = state_feedback(
        [values.get(name, 0.0) for c in measured for name in (c, f"{c}_dot")], scene.period / every, memory=alpha,
        k_pf=k_pf, measured=tuple(measured), begin=None,
    )  # fmt: skip
    # the readings before the first are taken to be those of the log's first row, the speeds zero
    initial = np.zeros(len(law.A))
    initial[: len(measured)] = [first_of(scene, name) for name in measured]
    reference = reference_of(section.values.get("reference", 0.0), states[first], section, scene)
    return _closed_loop(section, limited(section, replace(law, initial=initial)), [reference], scene, every)


def _pid(section: Section, scene: Scene) -> ClosedLoop:
    """Sum of PID laws, in SI or on the log's own columns."""
    coordinates = {c.name: c.unit for c in scene.plant.coordinates}
    measured = section.names("measured", coordinates, (next(iter(coordinates)),))
    raw, every = is_raw(section), every_of(section, scene)
    on: Any = section.choice("on", ("error", "measurement"), "error")
    gains = {
        key: several(section, key, ["" if raw else gain_unit(scene.unit, coordinates[n], time) for n in measured])
        for key, time in (("kp", ""), ("ki", "s"), ("kd", "/s"))
    }
    if not any(any(values) for values in gains.values()):
        raise section.error("kp", "a PID law needs kp, ki or kd, such as kp = 0.8")
    period = scene.period / every
    smooth = filter_of(section, period)
    entries = section.entries("reference")
    if len(entries) > len(measured):
        raise section.error(
            "reference", f"{len(measured)} measured coordinates take as many references, got {len(entries)}"
        )
    references = [
        reference_of(r, "1" if raw else coordinates[n], section, scene) for r, n in zip(entries, measured, strict=False)
    ]
    channels = [
        Channel(measured=n, reference=f"reference {i + 1}" if i < len(entries) else None, kp=gains["kp"][i],
                ki=gains["ki"][i], kd=gains["kd"][i], on=on, filter=smooth)
        for i, n in enumerate(measured)
    ]  # fmt: skip
    start = {n: first_of(scene, n, raw=raw) for n in measured}
    start |= {f"reference {i + 1}": float(r[0]) for i, r in enumerate(references)}
    law = replace(joined(channels, period=period), initial=memory_before(channels, start))
    return _closed_loop(section, limited(section, law), references, scene, every, raw=raw)


def _general(section: Section, scene: Scene) -> ClosedLoop:
    """``z+ = A z + B w, u = C z + D w`` with the measured coordinates, then the references, in w."""
    coordinates = {c.name: c.unit for c in scene.plant.coordinates}
    measured = section.names("measured", coordinates, (next(iter(coordinates)),))
    raw, every = is_raw(section), every_of(section, scene)
    entries = section.entries("reference")
    units = [coordinates[measured[min(i, len(measured) - 1)]] for i in range(len(entries))]
    references = [reference_of(r, "1" if raw else u, section, scene) for r, u in zip(entries, units, strict=True)]
    matrices: dict[str, Array] = {}
    for key in ("A", "B", "C", "D"):
        try:
            matrices[key] = np.array(section.values.get(key, []), dtype=np.float64)
        except (ValueError, TypeError):
            raise section.error(key, f"{key} must be rows of numbers, such as {key} = [[1.0, 0.0]]") from None
    A, B, C, D = (matrices[key] for key in "ABCD")
    C, D = C.reshape(1, -1), D.reshape(1, -1)
    with section.at("D"):
        law = Law(
            A.reshape(C.size, C.size) if A.size == C.size**2 else np.atleast_2d(A),
            B.reshape(C.size, D.size) if B.size == C.size * D.size else np.atleast_2d(B), C, D, measured=measured,
            reference_names=tuple(f"reference {i + 1}" for i in range(len(entries))), period=scene.period / every,
        )  # fmt: skip
    return _closed_loop(section, limited(section, law), references, scene, every, raw=raw)


def _recovered(section: Section, scene: Scene) -> ClosedLoop:
    """The law that the log itself shows."""
    measured = section.names("measured", [c.name for c in scene.plant.coordinates], tuple(scene.sensors))
    command = section.text_of("command", "duty") if "command" in section else scene.command
    if not command:
        raise section.error("kind", 'a law is recovered from the column it put out; add command = "duty"')
    columns = columns_of(section, "reference")
    with section.at("kind"):
        recovery = recover_law(
            scene.record, measured=[scene.sensors[n].column for n in measured], references=columns, command=command,
            feedforward=columns_of(section, "feedforward"),
        )  # fmt: skip
    if recovery.quality == "poor":
        raise section.error(
            "kind", f"no law could be recovered from '{command}': {recovery.sentence} Write the law as kind = \"pid\","
            " or leave loop out and let the recorded command drive the plant",
        )  # fmt: skip
    law = recovery.law
    every = matching(section, scene.period / law.needed_period)
    factors = recovery.feedforward
    law = replace(
        law, B=np.column_stack([law.B, np.zeros((len(law.A), len(factors)))]),
        D=np.hstack([law.D, [list(factors.values())]]), reference_names=(*law.reference_names, *factors),
    )  # fmt: skip
    references = [scene.grid.references(scene.record[name]) for name in law.reference_names]
    names_of = {scene.sensors[n].column: n for n in measured}
    law = replace(law, measured=tuple(names_of[c] for c in law.measured))
    loop = _closed_loop(section, law, references, scene, every, raw=True)
    return replace(loop, note=f"loop recovered from the log: {recovery.structure}. {recovery.sentence}")


KINDS = {"state": _state, "pid": _pid, "general": _general, "recover": _recovered}


def _closed_loop(
    section: Section, law: Law, references: Sequence[Array], scene: Scene, every: int, *, raw: bool = False
) -> ClosedLoop:
    """A law and its references; `raw` ones are between columns of the log."""
    factor = read_sign(section) if "sign" in section or not raw else scene.drive.sign
    for name in law.measured if raw else ():
        if name not in scene.sensors:
            raise section.error(
                "kind", f'the law reads {name}, which has no sensor; add [sensors.{name}] with column = "..."'
            )
    if raw:
        lines = [scene.sensors[n].line(scene.record) for n in law.measured]
        zero = [float(offset) for _, offset in lines]
        law = law.in_units([1 / slope for slope, _ in lines], zero, factor * scene.drive.scale)
    elif factor < 0:
        law = law.in_units(np.ones(law.readings), np.zeros(law.readings), factor)
    rows = max((r.size for r in references), default=1)
    held = [np.repeat(np.broadcast_to(r, rows), every)[: (rows - 1) * every + 1] for r in references]
    law = replace(law, references=np.column_stack(held) if held else None)
    return ClosedLoop(law=law, every=every, quantized=section.flag("quantized"))


def limited(section: Section, law: Law) -> Law:
    """The law with what the study says about its limit, what its sums do there, and its delay."""
    windup: Any = section.choice("windup", ("free", "hold"), "free")
    limit = section.positive("limit", "", 1.0) if "limit" in section else np.inf
    return replace(law, limit=limit, windup=windup, delay=section.number("delay", "1", 0.0))


def is_raw(section: Section) -> bool:
    """Whether gains are between the log's own columns."""
    return section.choice("units", ("SI", "log"), "SI") == "log"


def filter_of(section: Section, period: float) -> Filter:
    """How differences are smoothed."""
    taps: Any = section.values.get("taps", [1, 0])
    two = isinstance(taps, list) and len(taps) == 2 and all(type(v) in (int, float) and abs(v) < 1e6 for v in taps)
    if not two or abs(sum(taps) - 1) > 1e-6:
        raise section.error(
            "taps", f"taps must be two numbers that sum to 1, such as [0.2, 0.8], got {as_written(taps)}"
        )
    tau = section.number("tau", "s", 0.0)
    return Filter(pole=Filter.of(tau, period).pole, second=float(taps[1]))


def every_of(section: Section, scene: Scene) -> int:
    """Samples of the law per row."""
    return matching(section, scene.period / section.positive("period", "s", 1.0)) if "period" in section else 1


def matching(section: Section, ratio: float) -> int:
    """Whole samples of the law per row."""
    every = round(ratio)
    if every < 1 or abs(ratio - every) > 0.02 * every:
        raise section.error(
            "period", f"the law is evaluated {ratio:.4g} times per row; it must be a whole number of times, so set the"
            " run's own period to that of the law, or to a multiple",
        )  # fmt: skip
    return every


def columns_of(section: Section, key: str) -> tuple[str, ...]:
    """Names of columns under `key`."""
    items = section.entries(key)
    if not all(isinstance(item, str) for item in items):
        raise section.error(key, f"{key} of a law to recover must name columns, got {as_written(section.values[key])}")
    return tuple(items)


def several(section: Section, key: str, units: Sequence[str]) -> list[float]:
    """A gain per measured coordinate, in its unit if it has one; a single number stands for the first, 0 for others."""
    items = section.entries(key)
    if len(items) > len(units):
        raise section.error(key, f"{key} has {len(items)} values for {len(units)} measured coordinates")
    items += [0.0] * (len(units) - len(items))
    with section.at(key):
        return [
            in_unit(item, unit) if unit and isinstance(item, str) else in_si(item, "1", key)
            for item, unit in zip(items, units, strict=True)
        ]


def gain_unit(unit: str, coordinate: str, time: str) -> str:
    """Unit of a gain: of the command over that of the coordinate, of its sum or of its rate."""
    if not unit:
        return ""
    return {"": per(unit, coordinate), "s": per(unit, f"{coordinate} s"), "/s": per(unit, f"{coordinate}/s")}[time]


def first_of(scene: Scene, name: str, *, raw: bool = False) -> float:
    """First reading of a coordinate, as the law sees it."""
    if name not in scene.sensors:
        return 0.0
    if raw:
        return float(scene.record[scene.sensors[name].column][0])
    if name in scene.coordinates.locked:
        return scene.coordinates.locked[name]
    return float(scene.coordinates.read(scene.record, name)[0][0])


def gain(section: Section, key: str, above: str, below: str) -> float:
    """A gain in the command's unit per SI of what it multiplies."""
    return section.number(key, per(above, below) if above else "")


def reference_of(value: Any, unit: str, section: Section, scene: Scene) -> Array:
    """One number (1,), or (N,) from a column or an expression."""
    with section.at("reference"):
        if isinstance(value, str) and not value[:1].isdigit() and value[:1] not in "+-.":
            return scene.grid.references(expressions.evaluate(value, scene.record.signals, scene.record.t))
        return np.array([in_si(value, unit, "reference")])
