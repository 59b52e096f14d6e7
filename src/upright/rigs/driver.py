"""How a rig is reached: what a driver declares of itself, and every driver there is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from upright.declared import Declaration, Declared, declared_in
from upright.rig import Rig
from upright.rigs.protocol import Capabilities, LiveRig, Mode

FULL_SCALE = 10.0
"""Of converters of boards, where [board] does not say [V]."""


@dataclass(frozen=True, kw_only=True)
class Connection:
    """What a driver is to open, as RIG.toml says.

    Attributes
    ----------
    kind, name : str
        As RIG.toml calls driver and rig.
    zero : str
        Equilibrium at which the encoders are zeroed.
    board : mapping of str to any
        What [board] says; all that the other keys of RIG.toml do not.
    reversed : set of str
        Coordinates whose encoders count the other way round.
    model, truth : Rig
        The rig as it is known, and what a simulated one of it truly is.
    """

    kind: str
    model: Rig
    truth: Rig
    name: str | None = None
    port: str | None = None
    record: Path | None = None
    zero: str | None = None
    board: Mapping[str, Any] = field(default_factory=dict[str, Any])
    reversed: frozenset[str] = frozenset()

    @property
    def coordinates(self) -> tuple[str, ...]:
        """What each encoder measures."""
        return tuple(c.name for c in self.model.plant.coordinates)

    def capabilities(self) -> tuple[Capabilities, dict[str, Any]]:
        """Those of a board with this rig at it, and what else [board] says."""
        rest = dict(self.board)
        sense = [-1.0 if name in self.reversed else 1.0 for name in self.coordinates]
        about = Capabilities(
            name=self.name or self.kind, coordinates=self.coordinates,
            counts=tuple(way * n for way, n in zip(sense, self.model.per_unit, strict=True)),
            command_unit=self.model.unit, full_scale=float(rest.pop("full_scale", FULL_SCALE)),
            steps=int(rest.pop("steps", 1 << 15)), period=self.model.period, modes=frozenset({Mode.HOST}),
        )  # fmt: skip
        return about, rest


@dataclass(frozen=True, kw_only=True)
class Driver(Declaration):
    """One way to reach a rig; an object of a module of this room, or the entry point of a package.

    Its `name` is the ``kind`` of a RIG.toml.

    Attributes
    ----------
    open : callable
        The rig of a connection, not opened yet: a `LiveRig`, such as a `Board` of a `Port`.
    needs : mapping of str to str
        Which of the keys ``port`` and ``record`` RIG.toml has to have, each with an example.
    performed : str
        That no rig is driven, `basis.SIMULATED` or `basis.REPLAYED`; empty for hardware, which has to have limits.
    """

    open: Callable[[Connection], LiveRig]
    needs: Mapping[str, str] = field(default_factory=dict[str, str])
    performed: str = ""


DRIVERS = Declared(
    "kind of rig", "upright.rigs", declared_in(Driver, "upright.rigs", "upright.rigs.vendor"),
    lambda value: isinstance(value, Driver),
)  # fmt: skip
"""Every driver by the ``kind`` of a RIG.toml."""
