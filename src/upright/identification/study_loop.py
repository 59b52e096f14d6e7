"""Which law closed the loop during a run? `loop` of a run, so that plant and controller are simulated together."""

from __future__ import annotations

from typing import Any

import numpy as np

from upright.identification import expressions
from upright.identification.columns import Grid, in_unit
from upright.identification.model import Feedback
from upright.identification.study_keys import names
from upright.identification.study_rig import per
from upright.identification.study_text import Section, show
from upright.physics import Plant
from upright.records import Record


def state_units(plant: type[Plant]) -> dict[str, str]:
    """Unit of each state by name, in the paper's order."""
    return {
        name: unit for c in plant.coordinates for name, unit in ((c.name, c.unit), (f"{c.name}_dot", f"{c.unit}/s"))
    }


def read_loop(run: Section, plant: type[Plant], record: Record, grid: Grid, unit: str) -> Feedback | None:
    """Law of one run, its reference on the run's grid; `unit` is the command's."""
    if "loop" not in run:
        return None
    section = run.section("loop")
    section.check(names("loop"))
    gains = section.section("gains")
    states = state_units(plant)
    gains.check(states, f"state of {plant.__name__} called")
    if not gains.values:
        raise section.error("gains", f"a loop needs gains per state, such as gains = {{ {next(iter(states))} = 2.5 }}")
    values = {name: _gain(gains, name, unit, states[name]) for name in gains.values}
    first = next(iter(values))
    k_pf = _gain(section, "k_pf", unit, states[first]) if "k_pf" in section else values[first]
    alpha = section.number("alpha", "1", 0.0)
    if not 0 <= alpha < 1:
        raise section.error("alpha", f"alpha must be at least 0 and below 1, got {alpha:g}")
    return Feedback(
        gains=tuple(values.get(name, 0.0) for name in states),
        k_pf=k_pf,
        reference=_reference(section, states[first], record, grid),
        alpha=alpha,
    )


def _gain(section: Section, key: str, above: str, below: str) -> float:
    value: Any = section.values[key]
    with section.text.at(section.place(key)):
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise section.error(key, f"{key} must be a number or text with a unit, got {show(value)}")
        return in_unit(value, per(above, below)) if above else section.number(key, "")


def _reference(section: Section, unit: str, record: Record, grid: Grid) -> float | Any:
    """A constant in SI, or (N,) from a column or an expression in SI."""
    value: Any = section.values.get("reference", 0.0)
    if isinstance(value, str) and not value[:1].isdigit() and value[:1] not in "+-.":
        with section.text.at(section.place("reference")):
            return np.asarray(grid.commands(expressions.evaluate(value, record.signals, record.t)), dtype=np.float64)
    return section.number("reference", unit, 0.0)
