"""What of an identified rig goes into its unit: the kernel chosen for it, its numbers, and what a tool can set."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from upright.errors import BadInput
from upright.exports.steps import substeps
from upright.rig import Rig
from upright.rig.drive import GAIN
from upright.simulation import Simulator, choose

STEP = 1e-3
"""Between two samples of the unit's inner kernel [s]; a tool's step is a whole number of these."""
LARGEST = 100_000
"""Most commands that a slow drive may make the unit remember."""


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One number of the unit; `row` is its place among the kernel's parameters, the inputs or the states."""

    name: str
    unit: str
    meaning: str
    causality: str
    value: float
    row: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Unit:
    """A rig and the kernel that moves it; `remarks` are the differences from the fit, in sentences."""

    rig: Rig
    simulator: Simulator
    values: dict[str, float]
    remarks: tuple[str, ...]

    @property
    def remembered(self) -> int:
        """Commands that delay and lag of the drive still hold: a lag has forgotten after 40 time constants."""
        late, lag = (self.values[f"actuator.{n}"] / STEP for n in ("delay", "lag"))
        return math.ceil(late) + math.ceil(40 * lag) + 3

    @cached_property
    def inputs(self) -> list[Variable]:
        """Commands, each of one force."""
        forces = self.rig.plant.inputs
        names = ["u"] if len(forces) == 1 else [f"u_{f.name}" for f in forces]
        return [
            Variable(name=n, unit=self.rig.unit, meaning=f.meaning, causality="input", value=0.0, row=i)
            for i, (n, f) in enumerate(zip(names, forces, strict=True))
        ]

    @cached_property
    def states(self) -> list[Variable]:
        """Coordinates, each followed by its speed."""
        rows: list[tuple[str, str, str]] = []
        for c in self.rig.plant.coordinates:
            rows += [(c.name, c.unit, c.meaning), (f"{c.name}_dot", f"{c.unit}/s", f"speed of {c.name}")]
        return [
            Variable(name=name, unit=unit, meaning=meaning, causality="output", value=0.0, row=i)
            for i, (name, unit, meaning) in enumerate(rows)
        ]

    @cached_property
    def starts(self) -> list[Variable]:
        """Where it begins."""
        return [
            Variable(name=f"{v.name}_start", unit=v.unit, meaning=f"{v.name} at the start", causality="parameter",
                     value=0.0, row=v.row) for v in self.states
        ]  # fmt: skip

    @cached_property
    def parameters(self) -> list[Variable]:
        """Numbers that the kernel was chosen for: the plant's that are not zero by default, and the drive's."""
        plant, names = self.rig.plant, self.simulator.names
        out = [
            Variable(name=n, unit=plant.quantity(n).unit, meaning=plant.quantity(n).meaning, causality="parameter",
                     value=self.values[n], row=names.index(n)) for n in plant.names() if self.values[n]
        ]  # fmt: skip
        force = plant.inputs[0].unit if plant.inputs else "1"
        if len(plant.inputs) == 1:
            drive = ((GAIN, f"{force}/{self.rig.unit}", "force per unit of command"),
                     ("actuator.offset", self.rig.unit, "added to the command"))  # fmt: skip
            out += [
                Variable(name=n.replace(".", "_"), unit=u, meaning=m, causality="parameter", value=self.values[n],
                         row=names.index(n)) for n, u, m in drive
            ]  # fmt: skip
        return out


def unit_of(rig: Rig) -> Unit:
    """The unit of a rig.

    Raises
    ------
    BadInput
        When the drive remembers what a unit does not, or more than it can.
    """
    hardware, plant = rig.hardware, rig.plant
    if hardware.value("relaxation", 0.0):
        raise BadInput(
            "a unit cannot simulate braking that builds up (actuator.relaxation), since it starts anew at every step; "
            "identify without it, or set it to 0 in the fit."
        )
    presliding = {j.presliding for j in plant.joints}
    values = {n: 0.0 if n in presliding else v for n, v in plant.parameters().items()}
    drive = {f"actuator.{n}": hardware.value(n, 0.0) for n in ("delay", "lag", "offset")}
    values = {**values, **rig.more, **drive, GAIN: rig.gain, "actuator.limit": hardware.value("limit", math.inf)}
    derived = plant.derived_for(values)
    simulator = Simulator(
        derived=derived, flavour=choose(derived, values), dt=STEP, substeps=substeps(rig, STEP)
    )  # fmt: skip
    remarks = (
        f"Joint {j.on} slides at once; its deflection before sliding is left out."
        for j in plant.joints if plant.parameters().get(j.presliding)
    )  # fmt: skip
    made = Unit(rig=rig, simulator=simulator, values=values, remarks=tuple(remarks))
    if made.remembered > LARGEST:
        raise BadInput(
            f"for the drive's delay and lag the unit would have to remember {made.remembered} commands, more than "
            f"{LARGEST}; are they in seconds?"
        )
    return made
