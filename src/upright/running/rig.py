"""From a RIG.toml to a rig with its supervisor and, for a twin, the hand that brings it where it is to be held."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from upright.basis import DESCRIBED, SIMULATED, Basis, of_plain
from upright.errors import BadInput, nearest
from upright.files import read_text
from upright.laws import Law, Rule, of_values
from upright.realtime.session import Stage
from upright.records import Array
from upright.rig import Rig
from upright.rig.completion import completed, twin_of
from upright.rig.hardware import Entry, counts_unit
from upright.rig.makes import make_named, make_rig
from upright.rigs import Board, Limits, LiveRig, TwinPort
from upright.rigs.driver import DRIVERS, Connection
from upright.rigs.rigfile import RigFile, read_rig_file
from upright.rigs.supervisor import Duty, Supervisor
from upright.study.stored_rig import read_stored_rig

LEAN, NEAR = math.radians(30), math.radians(10)
"""How far a pendulum may lean in a run and at its start, where RIG.toml does not say."""


def model_and_truth(file: RigFile) -> tuple[Rig, Rig]:
    """The rig as it is known, and the one that a twin of it truly is."""
    if file.known is None:
        make = make_named(file.make, option="make")
        model, truth = make_rig(make.key), make_rig(make.key, file.seed)
        return (replace(model, name=file.name), truth) if file.name else (model, truth)
    known = read_stored_rig(file.known, seed=file.seed)
    stated = {} if file.vendor or known.hardware.vendor else _stated(file, known)
    model = _corrected(completed(known, stated, vendor=file.vendor, who="a run on a rig", options=False), file)
    truth = model
    if file.performed == SIMULATED and file.make:
        truth = make_rig(make_named(file.make, option="make").key, file.seed)
    elif file.performed == SIMULATED and file.seed:
        truth = twin_of(model, file.seed)
    return (replace(model, name=file.name), truth) if file.name else (model, truth)


def _stated(file: RigFile, known: Rig) -> dict[str, Entry]:
    """What the file says of numbers that the description lacks: counts, and the largest command, which is a limit."""
    here = f"stated in {file.path.name}"
    units = {c.name: c.unit for c in known.plant.coordinates}
    entries = {
        f"counts.{name}": Entry(value=abs(n), unit=counts_unit(units[name]), source=here)
        for name, n in file.counts.items()
        if name in units
    }
    if (most := file.command(known.unit)) is not None:
        entries["limit"] = Entry(value=most, unit=known.unit, source=here)
    return {name: entry for name, entry in entries.items() if name not in known.hardware.entries}


def _corrected(model: Rig, file: RigFile) -> Rig:
    """The rig with the counts and the dead zone that its file says."""
    names = [c.name for c in model.plant.coordinates]
    if unknown := sorted(file.counts.keys() - set(names)):
        raise BadInput(f"{file.path}: [counts] has no coordinate '{unknown[0]}'; {nearest(unknown[0], names)}")
    if file.counts:
        model = model.replace(
            counts=[abs(file.counts.get(name, n)) for name, n in zip(names, model.counts, strict=True)]
        )  # fmt: skip
    known = model.more.get("actuator.dead_zone", 0.0)
    dead_zone = file.dead_zone(model.unit, known)
    return model if dead_zone == known else model.replace(more={**model.more, "actuator.dead_zone": dead_zone})


def live_rig(file: RigFile, model: Rig, truth: Rig) -> LiveRig:
    """The rig itself; a twin or a replay has its port as `port`.

    Raises
    ------
    BadInput
        When what it takes is not installed, or RIG.toml leaves out what it needs.
    """
    to = Connection(
        kind=file.kind, name=file.name, port=file.port, record=file.record, zero=file.zero, board=file.board,
        model=model, truth=truth, reversed=frozenset(name for name, n in file.counts.items() if n < 0),
    )  # fmt: skip
    try:
        return DRIVERS[file.kind].open(to)
    except TypeError as error:
        if not file.board:
            raise
        raise BadInput(f'{file.path}: [board] does not fit kind = "{file.kind}" ({error}).') from None


def usual_limits(rig: Rig) -> Limits:
    """Limits of a twin, from what is known of the rig; nothing real may go by these."""
    names = [c.name for c in rig.plant.coordinates]
    free = [math.inf] * len(names)
    driven = names.index(rig.plant.inputs[0].on)
    travel, speed = free.copy(), free.copy()
    travel[driven], speed[driven] = rig.travel, rig.speed_limit
    return Limits(
        travel=tuple(travel), speed=tuple(speed), start=tuple(travel), command=rig.limit,
        watchdog=max(0.02, 10 * rig.period),
    )  # fmt: skip


def stage_of(path: Path, *, balance: bool = True, tilt: float = 0.0, watch: bool = True,
             from_rest: bool = False, bolted: float = 0.0) -> Stage:  # fmt: skip
    """Rig, supervisor and hands of a RIG.toml.

    Parameters
    ----------
    balance : bool
        Whether an equilibrium is held that nothing holds by itself; else the rig stays where its encoders are zeroed.
    tilt : float
        Of the last coordinate when the hand of a twin lets go [rad or m].
    watch : bool
        Whether encoders and drive are doubted beside the loop.
    from_rest : bool
        Whether a run begins where the rig rests, and may lean as it will: a swing-up.
    bolted : float
        Inertia that the hands of a twin have added to its first body [kg or kg m^2].

    Raises
    ------
    BadInput
        When RIG.toml does not say what is needed.
    """
    file = read_rig_file(path)
    model, truth = model_and_truth(file)
    if bolted:
        truth = truth.changed(a_1=truth.plant.parameters()["a_1"] + bolted)
    kinds = model.plant.equilibria
    zero = file.zero if file.zero in kinds else next(iter(kinds))
    at = file.at if balance else zero
    at = at if at in kinds or file.at != "inverted" else zero
    if at not in kinds:
        raise BadInput(f"{path}: {model.name} has no equilibrium '{at}'; {nearest(at, kinds)}")
    units = {c.name: c.unit for c in model.plant.coordinates}
    upright = at != zero
    last = list(units.values())[-1]
    held = upright and not from_rest
    lean = file.lean(last, LEAN if last == "rad" else math.inf) if held else math.inf
    duty = Duty(
        limits=file.limits(units, model.unit, usual_limits(model)), model=model, at=at, zero=zero, lean=lean,
        near=min(NEAR, lean) if held else math.inf, watch=watch and not from_rest,
    )  # fmt: skip
    rig = live_rig(file, model, truth)
    bring, let_go, advice = _nothing, _nothing, ""
    tap = rig.port.push if isinstance(rig, Board) and isinstance(rig.port, TwinPort) else _unfelt
    if isinstance(rig, Board) and isinstance(rig.port, TwinPort):
        if abs(tilt) > duty.near:
            size, unit = (math.degrees(1.0), "deg") if last == "rad" else (1.0, last)
            raise BadInput(
                f"--start is {size * tilt:.3g} {unit} from '{at}', and a run starts within "
                f"{size * duty.near:.3g} {unit}; start closer."
            )
        away = np.zeros(2 * len(units))
        away[-2] = tilt
        bring, let_go = partial(rig.port.hold, at, away), rig.port.let_go
        if from_rest or (not upright and not tilt):
            bring = _nothing
    elif held:
        *others, swings = units
        middle = "".join(f", {name} in the middle of its travel," for name in others)
        advice = f"bring {swings} to '{at}'{middle} and hold still; let go when it is held"
    return Stage(
        supervisor=Supervisor(rig, duty), bring=bring, let_go=let_go, units=tuple(units.values()), advice=advice,
        tap=tap,
    )  # fmt: skip


def _nothing() -> None:
    """What a person does."""


def _unfelt(_speeds: Sequence[float]) -> None:
    """A tap on a rig that only a person can tap."""


def read_law(path: Path) -> tuple[Law | Rule, Basis]:
    """Law of a design.json, or of a file that `upright.laws.as_values` filled, and its basis.

    Raises
    ------
    BadInput
        When it is neither.
    """
    try:
        content: Any = json.loads(read_text(path))
    except (ValueError, RecursionError):
        raise BadInput(f"{path} is not JSON; name the design.json of `upright design`.") from None
    values = law_values(content)
    if values is None:
        raise BadInput(f"{path} holds no law that can run; design again: upright design FIT -o FOLDER.")
    law = of_values(values)
    basis = DESCRIBED if values is content else of_plain(content.get("basis"), "this design")
    return law, basis


def about_what_is_held(law: Law | Rule, model: Rig, at: str, zero: str) -> Law | Rule:
    """A law of deviations about an equilibrium, for encoders that are zeroed at another one."""
    if isinstance(law, Rule):
        return law
    held, from_zero = model.plant.equilibrium(at), model.plant.equilibrium(zero)
    return replace(law, target=np.array([held[c.name] - from_zero[c.name] for c in model.plant.coordinates]))


def law_values(content: Any) -> dict[str, Any] | None:
    """Values of the law that a file holds as its `law` (`as_run` before), or is; None where it holds none."""
    held = [content.get("law"), content.get("as_run"), content] if isinstance(content, dict) else []
    return next((v for v in held if isinstance(v, dict) and "kind" in v), None)


SHAPES = ("free", "step", "square", "sine", "sweep")


def signal(text: str, unit: str, period: float, seconds: float) -> list[float]:
    """Samples of a signal that a command line says.

    ``free``; ``step SIZE``; ``square SIZE PERIOD``; ``sine SIZE FREQUENCY``; ``sweep SIZE FROM TO``; each number with
    its unit in quotes or in SI: ``"sweep 0.5 0.5 10"``, in `unit`, Hz and s.

    Raises
    ------
    BadInput
        When it says none of these.
    """
    kind, *words = text.split() or [""]
    wanted = dict(zip(SHAPES, (0, 1, 2, 2, 3), strict=True))
    try:
        numbers = [float(w) for w in words]
    except ValueError:
        numbers = []
    if kind not in wanted or len(numbers) != wanted[kind] or not all(math.isfinite(n) for n in numbers):
        raise BadInput(
            "a signal is free, step SIZE, square SIZE PERIOD, sine SIZE FREQUENCY or sweep SIZE FROM TO, with sizes in "
            f"{unit}, s and Hz, got '{text}'."
        )
    if any(n <= 0 for n in numbers[1:]):
        raise BadInput(f"periods and frequencies are above zero, got '{text}'.")
    t: Array = np.arange(math.ceil(seconds / period) + 1, dtype=np.float64) * period
    return _shape(kind, numbers, t, seconds).tolist()


def _shape(kind: str, numbers: Sequence[float], t: Array, seconds: float) -> Array:
    if kind == "free":
        return np.zeros_like(t)
    size, rest = numbers[0], numbers[1:]
    if kind == "step":
        return np.full_like(t, size)
    if kind == "square":
        return np.where(np.floor(2 * t / rest[0]) % 2 == 0, size, -size)
    if kind == "sine":
        return size * np.sin(2 * math.pi * rest[0] * t)
    growth = math.log(rest[1] / rest[0]) / seconds
    cycles = rest[0] * t if growth == 0 else rest[0] * np.expm1(growth * t) / growth
    return size * np.sin(2 * math.pi * cycles)


def excitation_law(samples: Sequence[float], coordinates: int, period: float) -> Law:
    """A law that looks at nothing and puts a signal out."""
    return Law(
        np.zeros((0, 0)), np.zeros((0, coordinates + 1)), np.zeros((1, 0)), np.eye(1, coordinates + 1, coordinates),
        references=np.asarray(samples, dtype=np.float64), reference_names=("excitation",), period=period,
    )  # fmt: skip
