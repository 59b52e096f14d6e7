"""Which law closed the loop during a run? `loop` of a run, so that plant and controller are simulated together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop import Channel, Feedback, SampledLaw, joined, recover, state_feedback
from upright.closed_loop.structures import memory
from upright.errors import nearest
from upright.physics import Plant
from upright.study.keys import names
from upright.study.loop_parts import (
    Scene,
    columns_of,
    every_of,
    filter_of,
    first_of,
    gain,
    gain_unit,
    is_raw,
    limited,
    matching,
    reference_of,
    several,
)
from upright.study.sensors import read_sign
from upright.study.text import Section, show

Array = NDArray[np.float64]
KINDS = ("state", "pid", "general", "recover")


def state_units(plant: type[Plant]) -> dict[str, str]:
    """Unit of each state by name, in the paper's order."""
    return {
        name: unit for c in plant.coordinates for name, unit in ((c.name, c.unit), (f"{c.name}_dot", f"{c.unit}/s"))
    }


def read_loop(run: Section, scene: Scene) -> Feedback | None:
    """Law of one run with its references; None without one."""
    if "loop" not in run:
        return None
    section = run.section("loop")
    section.check(names("loop"))
    kind = section.values.get("kind", "state")
    if kind not in KINDS:
        raise section.error("kind", f"kind must be one of {', '.join(KINDS)}, got {show(kind)}; {_near(kind)}")
    if kind == "recover":
        with section.text.at(section.place("kind")):
            return _recovered(section, scene)
    return {"state": _state, "pid": _pid, "general": _general}[kind](section, scene)


def _near(kind: Any) -> str:
    return nearest(str(kind), KINDS)


def _state(section: Section, scene: Scene) -> Feedback:
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
    pairs = {
        c.name: (values.get(c.name, 0.0), values.get(f"{c.name}_dot", 0.0))
        for c in scene.plant.coordinates
        if c.name in values or f"{c.name}_dot" in values
    }
    law = state_feedback(pairs, period=scene.period / every, k_pf=k_pf, pole=alpha)
    start = {name: first_of(scene, name) for name in law.measured}
    channels = [Channel(measured=name, kd=pair[1]) for name, pair in pairs.items()]
    law = limited(section, replace(law, initial=memory(channels, start)))
    return _feedback(
        section, law, [reference_of(section.values.get("reference", 0.0), states[first], section, scene)], scene, every
    )


def _pid(section: Section, scene: Scene) -> Feedback:
    """Sum of PID laws, in SI or on the log's own columns."""
    coordinates = {c.name: c.unit for c in scene.plant.coordinates}
    measured = section.names("measured", coordinates, (next(iter(coordinates)),))
    raw = is_raw(section)
    every = every_of(section, scene)
    on = section.values.get("on", "error")
    if on not in ("error", "measurement"):
        raise section.error("on", f'on must be "error" or "measurement", got {show(on)}')
    gains = {
        key: several(
            section,
            key,
            len(measured),
            [("" if raw else gain_unit(scene.unit, coordinates[n], time)) for n in measured],
        )
        for key, time in (("kp", ""), ("ki", "s"), ("kd", "/s"))
    }
    if not any(any(values) for values in gains.values()):
        raise section.error("kp", "a PID law needs kp, ki or kd, such as kp = 0.8")
    period = scene.period / every
    smooth = filter_of(section, period)
    given: Any = section.values.get("reference", [])
    given = given if isinstance(given, list) else [given]
    if len(given) > len(measured):
        raise section.error(
            "reference", f"{len(measured)} measured coordinates take as many references, got {len(given)}"
        )
    references = [
        reference_of(r, "1" if raw else coordinates[n], section, scene) for r, n in zip(given, measured, strict=False)
    ]
    channels = [
        Channel(measured=n, reference=f"reference {i + 1}" if i < len(given) else "", kp=gains["kp"][i],
                ki=gains["ki"][i], kd=gains["kd"][i], on=on, filter=smooth)
        for i, n in enumerate(measured)
    ]  # fmt: skip
    start = {n: first_of(scene, n, raw=raw) for n in measured}
    start |= {f"reference {i + 1}": float(r[0]) for i, r in enumerate(references)}
    law = replace(joined(channels, period=period), initial=memory(channels, start))
    return _feedback(section, limited(section, law), references, scene, every, raw=raw)


def _general(section: Section, scene: Scene) -> Feedback:
    """``z+ = A z + B w, u = C z + D w`` with the measured coordinates, then the references, in w."""
    coordinates = {c.name: c.unit for c in scene.plant.coordinates}
    measured = section.names("measured", coordinates, (next(iter(coordinates)),))
    raw, every = is_raw(section), every_of(section, scene)
    given: Any = section.values.get("reference", [])
    given = given if isinstance(given, list) else [given]
    units = [coordinates[measured[min(i, len(measured) - 1)]] for i in range(len(given))]
    references = [reference_of(r, "1" if raw else u, section, scene) for r, u in zip(given, units, strict=True)]
    matrices: dict[str, Array] = {}
    for key in ("A", "B", "C", "D"):
        try:
            matrices[key] = np.array(section.values.get(key, []), dtype=np.float64)
        except (ValueError, TypeError):
            raise section.error(key, f"{key} must be rows of numbers, such as {key} = [[1.0, 0.0]]") from None
    with section.text.at(section.place("D")):
        law = SampledLaw(
            A=matrices["A"], B=matrices["B"], C=matrices["C"].ravel(), D=matrices["D"].ravel(), measured=measured,
            references=tuple(f"reference {i + 1}" for i in range(len(given))), period=scene.period / every,
        )  # fmt: skip
    return _feedback(section, limited(section, law), references, scene, every, raw=raw)


def _recovered(section: Section, scene: Scene) -> Feedback:
    """The law that the log itself shows."""
    coordinates = {c.name: c.unit for c in scene.plant.coordinates}
    measured = section.names("measured", coordinates, tuple(scene.sensors))
    command = section.text_of("command", "duty") if "command" in section else scene.command
    if not command:
        raise section.error("kind", 'a law is recovered from the column it put out; add command = "duty"')
    columns = columns_of(section, "reference")
    found = recover(
        scene.record, measured=[scene.sensors[n].column for n in measured], references=columns, command=command,
        feedforward=columns_of(section, "feedforward"),
    )  # fmt: skip
    if found.quality == "poor":
        raise section.error(
            "kind", f"no law could be recovered from '{command}': {found.sentence} Write the law as kind = \"pid\","
            " or leave loop out and let the recorded command drive the plant",
        )  # fmt: skip
    law = found.law
    every = matching(section, scene.period / law.period)
    factors = tuple(found.feedforward)
    law = replace(
        law, B=np.column_stack([law.B, np.zeros((law.C.size, len(factors)))]),
        D=np.concatenate([law.D, [found.feedforward[f] for f in factors]]), references=(*law.references, *factors),
    )  # fmt: skip
    references = [scene.grid.commands(scene.record[name]) for name in law.references]
    names_of = {scene.sensors[n].column: n for n in measured}
    law = replace(law, measured=tuple(names_of[c] for c in law.measured))
    feedback = _feedback(section, law, references, scene, every, raw=True)
    return replace(feedback, told=f"loop recovered from the log: {found.structure}. {found.sentence}")


def _feedback(
    section: Section, law: SampledLaw, references: Sequence[Array], scene: Scene, every: int, *, raw: bool = False
) -> Feedback:
    """A law and its references; `raw` ones are between columns of the log."""
    factor = read_sign(section) if "sign" in section or not raw else scene.drive.sign
    if raw:
        lines = [scene.sensors[n].line(scene.record) for n in law.measured]
        zero = [float(offset) for _, offset in lines]
        law = law.on([1 / slope for slope, _ in lines], zero, factor * scene.drive.scale, law.measured)
    elif factor < 0:
        law = law.on(np.ones(len(law.measured)), np.zeros(len(law.measured)), factor, law.measured)
    rows = max((r.size for r in references), default=1)
    table = [np.broadcast_to(r, rows) for r in references]
    table += [np.ones(rows)] * (len(law.references) - len(table))
    stacked = np.column_stack(table) if table else np.zeros((1, 0))
    if every > 1 and rows > 1:
        stacked = np.repeat(stacked, every, axis=0)[: (rows - 1) * every + 1]
    quantized = section.values.get("quantized", False)
    if not isinstance(quantized, bool):
        raise section.error("quantized", f"quantized must be true or false, got {show(quantized)}")
    return Feedback(law=law, references=stacked, every=every, quantized=quantized)
