"""Which terms a motion needs, so that the kernel computes nothing else, and the names and places its parts agree on.

A flavour is what is fixed when a kernel is compiled; everything else (parameters, states, inputs, modes) is data.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from upright.errors import BadInput, nearest
from upright.laws.linear import Law, Structure
from upright.laws.rule import Rule, Written
from upright.physics.actuator import ACTUATOR
from upright.physics.equations import Derived


@dataclass(frozen=True, kw_only=True)
class Flavour:
    """Terms compiled into a kernel; numbers are indices of coordinates.

    Attributes
    ----------
    dry : tuple of int
        Joints that stick and slip, exactly.
    drag : tuple of int
        Joints with quadratic drag.
    stribeck : tuple of int
        Joints whose sliding friction falls from the stiction to the Coulomb level with speed.
    dahl : tuple of int
        Joints that deflect before they slide (Dahl); these do not stick.
    held : tuple of int
        Coordinates whose motion is prescribed.
    dynamic : bool
        The actuator has lag, delay, a torque-speed slope or one of the following.
    gate : bool
        The drive is alive from a start to an end only.
    damping : bool
        The drive brakes while it is alive.
    relaxation : bool
        Its braking builds up and fades.
    curve : bool
        The drive's force falls beyond a speed.
    capped : bool
        What reaches the body has a limit.
    rising : bool
        The drive brakes by how much is asked of it.
    droop : bool
        The gain falls with the command.
    loop : Structure or Written, optional
        What is compiled in of the `Law` or `Rule` that computes the input.
    record : bool
        The motion is returned, not only what it reduces to.
    """

    dry: tuple[int, ...] = ()
    drag: tuple[int, ...] = ()
    stribeck: tuple[int, ...] = ()
    dahl: tuple[int, ...] = ()
    held: tuple[int, ...] = ()
    dynamic: bool = False
    gate: bool = False
    damping: bool = False
    relaxation: bool = False
    curve: bool = False
    capped: bool = False
    rising: bool = False
    droop: bool = False
    loop: Structure | Written | None = None
    record: bool = True


@dataclass(frozen=True, kw_only=True)
class Layout:
    """Names and places that the parts of the generated text agree on."""

    derived: Derived
    flavour: Flavour

    @cached_property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.derived.coordinates)

    @cached_property
    def nu(self) -> int:
        """Number of inputs."""
        return len(self.derived.inputs)

    @cached_property
    def free(self) -> tuple[int, ...]:
        """Coordinates that obey the equations of motion."""
        return tuple(i for i in range(self.n) if i not in self.flavour.held)

    @cached_property
    def velocities(self) -> tuple[str, ...]:
        """Names of the velocities."""
        return tuple(f"{q}_dot" for q in self.derived.coordinates)

    @cached_property
    def drives(self) -> tuple[int, ...]:
        """Coordinate on which each input acts first."""
        column = [[self.derived.gain[i * self.nu + j] != "0" for i in range(self.n)] for j in range(self.nu)]
        return tuple(c.index(True) if True in c else 0 for c in column)

    @cached_property
    def constants(self) -> tuple[str, ...]:
        """Names of what is computed once per lane."""
        f = self.flavour
        joints = sorted({*f.dry, *f.dahl})
        names = [f"k{i}" for i in range(len(self.derived.lumps))]
        names += [f"_Fc{i}" for i in joints] + [f"_Fs{i}" for i in joints]
        names += [f"_cq{i}" for i in f.drag] + [f"_iv{i}" for i in f.stribeck] + [f"_id{i}" for i in f.dahl]
        drive = ["_sl"] * f.dynamic + ["_kn", "_fd"] * f.curve + ["_fl"] * f.capped
        names += [f"{c}{j}" for c in drive for j in range(self.nu)]
        return tuple(names)

    @cached_property
    def numbers(self) -> tuple[str, ...]:
        """Names of a controller's numbers, as its `rows` come."""
        law = self.flavour.loop
        if not isinstance(law, Structure):
            return law.numbers if law else ()
        z, u, w = range(len(law.A)), range(self.nu), range(self.n + law.references)
        names = [f"lA{i}_{j}" for i in z for j in z if law.A[i][j] is None]
        names += [f"lB{i}_{j}" for i in z for j in w if law.B[i][j] is None]
        names += [f"l{c}{i}_{j}" for c, columns in (("C", z), ("D", w)) for i in u for j in columns]
        return (*names, *(f"z{i}" for i in z), *(f"tg{i}" for i in range(self.n)))

    @cached_property
    def rows(self) -> dict[str, int]:
        """Place of each per-lane number in the working array."""
        f, n, nu = self.flavour, range(self.n), range(self.nu)
        names = [f"q{i}" for i in n] + [f"v{i}" for i in n] + [f"y{i}" for i in f.dahl] + [f"s{i}" for i in f.dry]
        names += [f"oq{i}" for i in n] + [f"ov{i}" for i in n] + [f"oy{i}" for i in f.dahl]
        names += [
            f"{c}{j}" for c in ("ua", "um", "ub", "gain", "off", "lim", "ff", "cn", *["gd"] * f.droop) for j in nu
        ]
        if f.dynamic:
            names += [f"{c}{j}" for c in ("co", "fo", "w", "e", "ep", "th", "df") for j in nu] + ["di"]
            more = ["gs", "ge"] * f.gate + ["ona", "onm", "onb"] * (f.gate and f.curve)
            more += ["dc", "ds", "zn", "zo", "dma", "dmm", "dmb"] * f.damping
            more += ["dr", "yn", "yo"] * f.rising
            more += ["csa", "csm", "csb"] * (f.damping and f.curve)
            more += ["bk", "vp", "rt", "re", "rh", "bka", "bkm", "bkb"] * f.relaxation
            names += [f"{c}{j}" for c in more for j in nu]
        names += [*self.numbers, *(f"ref{c}" for c in range(f.loop.references if f.loop else 0))]
        if not f.record:
            names += [f"{c}{i}" for c in ("mx", "er") for i in n] + [f"{c}{j}" for c in ("sat",) for j in nu]
        names += [f"h{c}{i}{s}" for i in f.held for s in "amb" for c in "qva"] + [f"hb{i}" for i in f.held]
        return {name: i for i, name in enumerate([*names, *self.constants, "flag"])}


@lru_cache(maxsize=64)
def _known(derived: Derived) -> frozenset[str]:
    return frozenset({*derived.parameters, *ACTUATOR})


@lru_cache(maxsize=64)
def lay_out(derived: Derived, flavour: Flavour) -> Layout:
    """Layout of a kernel, worked out once."""
    return Layout(derived=derived, flavour=flavour)


def choose(
    derived: Derived,
    params: Mapping[str, Any],
    *,
    free: Collection[str] = (),
    held: Collection[str] = (),
    loop: Law | Rule | None = None,
    record: bool = True,
) -> Flavour:
    """Smallest flavour that computes what `params` ask for.

    Parameters
    ----------
    derived : Derived
        Equations of the plant.
    params : mapping of str to float or array
        Values by name; a term is left out when its parameters are zero or missing in every lane.
    free : collection of str
        Parameters that will be varied later, so that their terms stay in although they are zero now.
    held : collection of str
        Coordinates whose motion is prescribed.
    loop : Law or Rule, optional
        Controller that computes the input.
    record : bool
        The motion is returned.

    Raises
    ------
    BadInput
        When a held coordinate or a named parameter does not exist.
    """
    known = _known(derived)
    for name in (*params, *free):
        if name not in known:
            raise BadInput(f"{derived.name} has no parameter '{name}'; {nearest(name, known)}")
    for name in held:
        if name not in derived.coordinates:
            raise BadInput(f"{derived.name} has no coordinate '{name}' to hold; {nearest(name, derived.coordinates)}")

    def on(name: str) -> bool:
        if not name or name in free:
            return bool(name)
        idle = ACTUATOR[name].default if name in ACTUATOR else 0.0
        value = params.get(name, idle)
        return value != idle if isinstance(value, float) else bool(np.any(np.asarray(value) != idle))

    moving = [j for j in derived.joints if derived.coordinates[j.coordinate] not in held]
    gate, damping, curve, dynamic = (
        any(on(f"actuator.{a}") for a in names)
        for names in (("start", "end"), ("damping", "standby", "damping_rise"), ("fade",), ("lag", "delay", "slope"))
    )
    curve = (curve or damping) and on("actuator.knee")
    relaxation = damping and on("actuator.relaxation")
    capped = on("actuator.force_limit")
    rough = [j for j in moving if on(j.coulomb) or on(j.stiction)]
    return Flavour(
        dry=tuple(j.coordinate for j in rough if not on(j.presliding)),
        dahl=tuple(j.coordinate for j in rough if on(j.presliding)),
        stribeck=tuple(j.coordinate for j in rough if on(j.stribeck_speed)),
        drag=tuple(j.coordinate for j in moving if on(j.quadratic)),
        held=tuple(i for i, c in enumerate(derived.coordinates) if c in held),
        dynamic=dynamic or gate or damping or curve or capped or (loop is not None and loop.delay > 0.0),
        gate=gate,
        damping=damping,
        relaxation=relaxation,
        curve=curve,
        capped=capped,
        rising=on("actuator.damping_rise"),
        droop=on("actuator.droop"),
        loop=None if loop is None else loop.compiled_in,
        record=record,
    )


class Writer:
    """Lines of one function, with the working array's places filled in."""

    def __init__(self, layout: Layout, width: int) -> None:
        self.p, self.width, self.lines, self.depth = layout, width, [], 1

    def at(self, name: str) -> str:
        """Place of a per-lane number in the working array."""
        return f"W[{self.p.rows[name] * self.width} + _i]"

    def add(self, *lines: str) -> None:
        """Write lines; ``{name}`` in braces becomes that number's place."""
        for line in lines:
            text = re.sub(r"\{(\w+)\}", lambda m: self.at(m[1]), line)
            self.lines.append("    " * self.depth + text)

    def lanes(self) -> None:
        """Open a loop over the lanes of the block."""
        self.add(f"for _i in range({self.width}):")
        self.depth += 1
