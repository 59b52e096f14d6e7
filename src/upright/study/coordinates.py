"""What do the sensors of a run tell of each coordinate, where a column measures a sum of several?

Relative encoders on a plant stated in absolute angles measure ``theta_1`` and ``theta_2 - theta_1``: with ``z = S q``
for what is measured and S square, ``q = S^-1 z`` is all there is to know, found once, where the record is read.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from upright.physics.combination import spelled
from upright.records import Array, Record
from upright.study.sensors import Sensor
from upright.study.text import Section

ALIKE = 1e9
"""Condition of S from which on two sensors count as measuring the same."""

NOTHING = 1e-12
"""Share of a sensor, of the largest in a coordinate, that is rounding of S^-1."""


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Sensors of one run, and the coordinates that they tell together; `locked` ones are known and need none.

    `by_coordinate` has each with where it is written.
    """

    by_coordinate: Mapping[str, tuple[Sensor, Section]]
    locked: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def summed(self) -> bool:
        """Whether a column measures a sum of coordinates."""
        return any(sensor.of for name, (sensor, _) in self.by_coordinate.items() if name not in self.locked)

    @cached_property
    def shares(self) -> dict[str, dict[str, float]]:
        """Factor by which each sensor counts in each coordinate, rows of ``S^-1``; locked coordinates left out.

        Raises
        ------
        BadInput
            When a sum names a coordinate that nothing tells, or several sensors measure the same.
        """
        names = [name for name in self.by_coordinate if name not in self.locked]
        if not self.summed:
            return {name: {name: 1.0} for name in names}
        S = np.zeros((len(names), len(names)))
        for row, name in zip(S, names, strict=True):
            for other, factor in self._sum(name).items():
                if other in names:
                    row[names.index(other)] = factor
                elif other not in self.locked:
                    raise self._untold(name, other)
        if np.linalg.cond(S) > ALIKE:
            last = next(name for name in reversed(names) if self.by_coordinate[name][0].of)
            raise self.by_coordinate[last][1].error(
                "expression", f"the sensors of {', '.join(names)} do not determine these coordinates: one measures"
                " what others do already; give each its own column and sum, or state the plant in what is measured",
            )  # fmt: skip
        inverse = np.linalg.inv(S)
        return {
            name: {other: float(f) for other, f in zip(names, row, strict=True) if abs(f) > NOTHING * np.abs(row).max()}
            for name, row in zip(names, inverse, strict=True)
        }

    def read(self, record: Record, name: str) -> tuple[Array, float, tuple[str, ...]]:
        """Coordinate (N,) [SI] at the record's own instants, its resolution [SI], and what was noticed.

        Steps of several encoders add up as the variances of their rounding do.
        """
        total, variance, noticed = np.zeros(record.t.size), 0.0, list[str]()
        shares = self.shares[name]
        for other, share in shares.items():
            sensor, place = self.by_coordinate[other]
            with place.at("column"):
                values, step, notes = sensor.read(record)
            if shares == {name: 1.0} and not sensor.of:
                return values, step, notes
            fixed = sum(f * self.locked[c] for c, f in sensor.of.items() if c in self.locked)
            total += share * (values - fixed)
            variance += (share * step) ** 2
            noticed += notes
        columns = [f"`{self.by_coordinate[other][0].column}`" for other in shares]
        noticed.append(f"{name} read as {spelled(shares.values(), columns).strip('()')}")
        return total, math.sqrt(variance), tuple(noticed)

    def one_sensor(self, kind: str, name: str) -> bool:
        """Whether the ``"offset"``, or ``"scale"``, of a sensor is that of its coordinate and of no other."""
        if not self.summed or name not in self.shares:
            return True
        elsewhere = any(name in shares for of, shares in self.shares.items() if of != name)
        return not elsewhere and (kind == "offset" or not self.by_coordinate[name][0].of)

    def _sum(self, name: str) -> Mapping[str, float]:
        return self.by_coordinate[name][0].of or {name: 1.0}

    def _untold(self, name: str, other: str) -> Exception:
        sensor, place = self.by_coordinate[name]
        return place.error(
            "expression", f"'{sensor.column}' measures {place.values['expression']}, no sensor determines {other}: add"
            f" [sensors.{other}], lock {other} in this run, or state the plant in what is measured",
        )  # fmt: skip
