"""Which terms a motion needs, so that the kernel computes nothing else, and the names and places its parts agree on.

A flavour is what is fixed when a kernel is compiled; everything else (parameters, states, inputs, modes) is data.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, nearest
from upright.laws.linear import Law, Structure
from upright.laws.rule import Rule, Written
from upright.physics.actuator import ACTUATOR
from upright.physics.combination import spelled
from upright.physics.equations import Derived

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Flavour:
    """Terms compiled into a kernel; numbers are indices of coordinates, a joint's that of its pivot (`pivots`).

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
        The drive brakes in proportion to its command.
    droop : bool
        The gain falls with the command.
    dead : bool
        Some of the command is lost to either side.
    loop : Structure or Written, optional
        What is compiled in of the `Law` or `Rule` that computes the input.
    record : bool
        The motion is returned, not only what it reduces to.
    carried : bool
        What joints and braking remember goes in and comes out behind the states, so that a motion can be taken up where
        another ended.
    strict : bool
        Every operation is rounded by itself, in the order of the text: the same numbers, to the last bit, on every
        processor and in a page; a third slower.
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
    dead: bool = False
    loop: Structure | Written | None = None
    record: bool = True
    carried: bool = False
    strict: bool = False


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
    def pivots(self) -> tuple[int | None, ...]:
        """Coordinate whose place each joint takes, as `pivots` finds it."""
        return pivots(self.derived, self.flavour.held)

    @cached_property
    def joints(self) -> dict[int, Array]:
        """Direction of each joint that can move, by its pivot."""
        pairs = zip(self.pivots, self.derived.joints, strict=True)
        return {i: np.array(j.direction) for i, j in pairs if i is not None}

    @cached_property
    def to_joints(self) -> Array:
        """Matrix T of ``z = T q``: free coordinates into some of which each joint is one, if any has friction."""
        f = self.flavour
        known = self.joints if f.dry or f.dahl or f.drag else {}
        rows = [known.get(i, np.eye(self.n)[i]) for i in self.free]
        return np.array(rows).reshape(len(self.free), self.n)[:, list(self.free)]

    @cached_property
    def from_joints(self) -> Array:
        """Matrix S of ``q = S z``, so that mass matrix and forces are ``S' M S`` and ``S' f`` there."""
        return np.asarray(np.linalg.inv(self.to_joints), dtype=np.float64) + 0.0  # no -0

    @cached_property
    def slanted(self) -> bool:
        """Whether a joint with friction acts on several coordinates."""
        return not np.array_equal(self.to_joints, np.eye(len(self.free)))

    def along(self, i: int, name: Callable[[int], str]) -> str:
        """Motion of the joint with pivot `i`, where the free coordinates' has these names."""
        return spelled(self.joints[i][list(self.free)], [name(k) for k in self.free])

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
    def settings(self) -> tuple[str, ...]:
        """Names of `rows` that stay as they are while a motion lasts: numbers of plant, drive and controller."""
        f = self.flavour
        drive = ("gain", "off", "lim", *["gd"] * f.droop, *["dz"] * f.dead, *["e", "ep", "th", "df"] * f.dynamic)
        names = {f"{c}{j}" for c in drive for j in range(self.nu)} | {"di"} | set(self.constants)
        law = self.flavour.loop
        memory = {f"z{i}" for i in range(len(law.A))} if isinstance(law, Structure) else set[str]()
        return tuple(n for n in self.rows if n in names or (n in self.numbers and n not in memory))

    @cached_property
    def carried(self) -> tuple[str, ...]:
        """Numbers that go in and out behind the states: deflections of joints, braking as it has built up."""
        f = self.flavour
        braking = ["bk", "vp", "dmm", *["csm"] * f.curve] if f.relaxation else []
        return (*(f"y{i}" for i in f.dahl), *(f"{c}{j}" for c in braking for j in range(self.nu))) if f.carried else ()

    @cached_property
    def rows(self) -> dict[str, int]:
        """Place of each per-lane number in the working array."""
        f, n, nu = self.flavour, range(self.n), range(self.nu)
        names = [f"q{i}" for i in n] + [f"v{i}" for i in n] + [f"y{i}" for i in f.dahl] + [f"s{i}" for i in f.dry]
        names += [f"oq{i}" for i in n] + [f"ov{i}" for i in n] + [f"oy{i}" for i in f.dahl]
        names += [
            f"{c}{j}"
            for c in ("ua", "um", "ub", "gain", "off", "lim", "ff", "cn", *["gd"] * f.droop, *["dz"] * f.dead)
            for j in nu
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
def pivots(derived: Derived, held: tuple[int, ...]) -> tuple[int | None, ...]:
    """Coordinate whose place each joint can take, each another, by elimination; None for a joint that is held.

    Raises
    ------
    BadInput
        When joints that move independently do so no longer, with these coordinates held.
    """
    rows = np.array([j.direction for j in derived.joints]).reshape(len(derived.joints), len(derived.coordinates))
    rows[:, list(held)] = 0.0
    columns: list[int | None] = [None] * len(rows)
    reduced: dict[int, Array] = {}
    for k in sorted((k for k, row in enumerate(rows) if row.any()), key=lambda k: np.count_nonzero(rows[k])):
        left = rows[k].copy()
        for earlier, row in reduced.items():
            left = left - left[columns[earlier]] / row[columns[earlier]] * row
        if np.abs(left).max() <= 1e-9 * np.abs(rows[k]).max():
            names = ", ".join(derived.coordinates[i] for i in held)
            raise BadInput(f"{derived.name}: with {names} held, two joints are one; let it move or merge them.")
        i = int(np.argmax(np.abs(left)))
        reduced[k], columns[k] = left, i
    return tuple(columns)


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
    strict: bool = False,
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
    strict : bool
        Same numbers on every processor, see `Flavour`.

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

    still = tuple(i for i, c in enumerate(derived.coordinates) if c in held)
    moving = [(i, j) for i, j in zip(pivots(derived, still), derived.joints, strict=True) if i is not None]
    gate, damping, curve, dynamic = (
        any(on(f"actuator.{a}") for a in names)
        for names in (("start", "end"), ("damping", "standby", "damping_rise"), ("fade",), ("lag", "delay", "slope"))
    )
    curve = (curve or damping) and on("actuator.knee")
    relaxation = damping and on("actuator.relaxation")
    capped = on("actuator.force_limit")
    rough = [(i, j) for i, j in moving if on(j.coulomb) or on(j.stiction)]
    return Flavour(
        dry=tuple(i for i, j in rough if not on(j.presliding)),
        dahl=tuple(i for i, j in rough if on(j.presliding)),
        stribeck=tuple(i for i, j in rough if on(j.stribeck_speed)),
        drag=tuple(i for i, j in moving if on(j.quadratic)),
        held=still,
        dynamic=dynamic or gate or damping or curve or capped or (loop is not None and loop.delay > 0.0),
        gate=gate,
        damping=damping,
        relaxation=relaxation,
        curve=curve,
        capped=capped,
        rising=on("actuator.damping_rise"),
        droop=on("actuator.droop"),
        dead=on("actuator.dead_zone"),
        loop=None if loop is None else loop.compiled_in,
        record=record,
        strict=strict,
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
