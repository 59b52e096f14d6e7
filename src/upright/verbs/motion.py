"""Motion of a plant, free, driven or in its loop, as a record: `simulate`."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput, nearest
from upright.laws import Law, Rule, state_feedback
from upright.physics import Plant
from upright.records import Record
from upright.records.record import STRICT_NOTE
from upright.verbs.answer import Answer
from upright.verbs.linear.feedback import Gains
from upright.verbs.linear.matrices import is_linear, linear_model
from upright.verbs.linear.motion import check_bounded, motion_of_linear, read_gains, simulated_origin
from upright.verbs.options import MotionOptions, known_options

if TYPE_CHECKING:
    from upright.rig import Rig
    from upright.systems import LinearForm, StateSpace
    from upright.verbs.forms import LawLike, RigLike

Array = NDArray[np.float64]


def simulate(
    plant: RigLike | LinearForm, law: LawLike | None = None, *, start: Mapping[str, Any] | ArrayLike | None = None,
    seconds: float | str = 5.0, at: str | None = None, u: float | Callable[[float], Any] | ArrayLike | None = None,
    dt: float | str | None = None, **on: Unpack[MotionOptions],
) -> Record:  # fmt: skip
    """Motion of a plant, free, driven, or with its loop closed by gains or a law.

    Parameters
    ----------
    plant : Plant, Rig, fit, study, path of either, or linear model
        Of a rig or a fit its drive, encoders and servo period count as well, where they are known and not given here.
        A linear model in any form, ``(A, B)`` too, runs under gains, a deviation from the point that it holds about.
    law : Gains, array of gains, Law, Rule or what `design` answered, optional
        Gains act on readings sampled every `dt`, less the equilibrium, and on their differences; an array gives the
        plant's force, of a rig or a fit its command.
    start : mapping of state to number or text, or array, shape (states,), optional
        Deviation from the equilibrium at the first instant: ``{"theta": 0.2}``, ``{"theta": "12 deg"}``, ``[0.2, 0]``.
    seconds : float or str
        Length of the motion [s], or as ``"2 s"``.
    at : str, optional
        Equilibrium; the one that gains or law are for, else the plant's first. Gains that are for none, an array too,
        need it of a plant that has several.
    u : float, callable of time, or array, shape (N,) or (N, inputs), optional
        Command, in the unit of the input or of the rig's command; it is added to the law's.
    dt : float or str, optional
        Between samples [s]; the period that gains or law are for, else the rig's, else 1 ms.
    **on
        Of the rig and its loop: limit, counts, memory, actuator, strict; see `MotionOptions`.

    Returns
    -------
    Record
        Coordinates and speeds [SI] and commands.

    Raises
    ------
    BadInput
        When a name, a size or a number does not fit the plant, or gains or law are for another equilibrium or period.
    """
    from upright.physics.actuator import ACTUATOR
    from upright.simulation import simulate as motion
    from upright.verbs.values import si

    on = known_options(MotionOptions, on, "simulate")
    law = getattr(law, "law", law) if isinstance(law, Answer) else law
    limit, counts, memory, actuator = on.get("limit"), on.get("counts"), on.get("memory", 0.0), on.get("actuator")
    strict = on.get("strict", False)
    if is_linear(plant):
        others = {"at": at, "counts": counts, "memory": memory or None, "actuator": actuator, "strict": strict or None}
        for name in [n for n, value in others.items() if value is not None]:
            raise BadInput(f"{name} belongs to a rig, and this is a linear model; leave it out.")
        return _of_linear(linear_model(plant), law, {} if start is None else start, si(seconds, "s"), u, dt, limit)
    rig = _rig(plant)
    plant = _plant(plant if rig is None else rig)
    point = _point(plant, law, at)
    if dt is None and rig is not None:
        dt = getattr(law, "period", None) or rig.hardware.value("servo_period", 0.0) or None
    seconds, dt = si(seconds, "s"), _period(law, None if dt is None else si(dt, "s"))
    names = plant.state_names()
    units = [unit for c in plant.coordinates for unit in (c.unit, f"{c.unit}/s")]
    x0 = _start(names, units, point, {} if start is None else start)
    _check_times(seconds, dt)
    samples = round(seconds / dt) + 1
    t = np.arange(samples, dtype=np.float64) * dt
    if actuator is not None and not isinstance(actuator, Mapping):  # type: ignore[reportUnnecessaryIsInstance]
        raise BadInput(f"actuator has numbers of the drive by name, such as {{'gain': 0.5}}, got {actuator!r:.40}.")
    own_drive = {f"actuator.{name}": si(value, "") for name, value in (actuator or {}).items()}
    drive = ({} if rig is None else dict(rig.drive)) | own_drive
    for name in own_drive:
        if name not in ACTUATOR:
            known = [n.partition(".")[2] for n in ACTUATOR]
            short = name.partition(".")[2]
            raise BadInput(f"the drive has no number '{short}'; {nearest(short, known)} (it has {', '.join(known)})")
    if limit is not None and not (isinstance(limit, float) and limit == math.inf):
        drive["actuator.limit"] = si(limit, (rig and rig.unit) or (plant.inputs[0].unit if plant.inputs else "1"))
    largest = drive.get("actuator.limit", math.inf)
    if not largest > 0:
        raise BadInput(f"simulate needs a limit above 0, got {largest:g}.")
    if counts is None and rig is not None:
        stated = {c.name: f"counts.{c.name}" for c in plant.coordinates}
        counts = {n: rig.hardware.value(key, 0.0) for n, key in stated.items() if key in rig.hardware.entries}
    steps = _steps(plant, counts)
    loop = _loop(plant, law, point, dt, memory, largest, steps)
    if loop is not None:
        _check_named(plant, law, at)
    if rig is not None and isinstance(loop, Law):  # late and rounded as the rig is, once
        loop = replace(loop, delay=0.0, resolution=steps, command_resolution=rig.converter)
    if rig is not None and not isinstance(law, Gains | Law | Rule | None):
        _check_gains(rig, np.atleast_2d(np.asarray(law, dtype=np.float64)), point)
    command = _command(u, t, len(plant.inputs))
    x = motion(plant, drive, x0, command, dt, samples=samples, substeps=2, loop=loop, strict=strict)[:, :, 0]
    check_bounded(t, x[:, : len(names)], names, ", so this loop does not stabilize the plant")
    signals = {name: x[:, i] for i, name in enumerate(names)}
    put_out = x[:, len(names) :] if loop is not None else command
    commands = {}
    for j, i in enumerate(plant.inputs):
        commands[i.name] = np.zeros(samples) if put_out is None else np.clip(put_out[:, j], -largest, largest)
    return Record(
        t=t, signals=signals | commands,
        units=dict(zip(names, units, strict=True)) | {i.name: (rig and rig.unit) or i.unit for i in plant.inputs},
        inputs=tuple(commands), outputs=tuple(c.name for c in plant.coordinates),
        provenance=simulated_origin(type(plant).__name__).note(*[STRICT_NOTE] * strict), plant=plant,
    )  # fmt: skip


def _of_linear(
    model: StateSpace, law: Any, start: Any, seconds: float, u: Any, dt: float | str | None, limit: float | str | None
) -> Record:  # fmt: skip
    """Motion of a linear model, a deviation from its point."""
    from upright.verbs.values import si

    requested = None if dt is None else si(dt, "s")
    if model.dt is not None and requested is not None and not math.isclose(requested, model.dt, rel_tol=1e-9):
        raise BadInput(f"this model is sampled every {1e3 * model.dt:.6g} ms, so leave dt out.")
    every = _period(law, requested or model.dt)
    _check_times(seconds, every)
    if seconds < every:
        raise BadInput(f"simulate needs a sample at least, {1e3 * every:.6g} ms, got {seconds:g} s.")
    largest = math.inf if limit is None else si(limit, model.unit or "1")
    if not largest > 0:
        raise BadInput(f"simulate needs a limit above 0, got {largest:g}.")
    t = np.arange(round(seconds / every) + 1, dtype=np.float64) * every
    x0 = _start(model.states, [model.units.get(n, "1") for n in model.states], {}, start)
    return motion_of_linear(model, law, x0, _command(u, t, len(model.inputs)), t, largest)


def _check_times(seconds: float, dt: float) -> None:
    if not (seconds > 0 and dt > 0 and seconds / dt < 1e8):
        raise BadInput(f"simulate needs seconds and dt above 0, got seconds={seconds:g} and dt={dt:g}.")


def _check_gains(rig: Rig, K: Array, point: Mapping[str, float]) -> None:
    """Refuse an array that stabilises the plant by a force and not the rig by its command."""
    at = min(rig.plant.equilibria, key=lambda name: _apart(rig.plant.equilibrium(name), point))
    by_force, by_command = (
        float(np.linalg.eigvals(m.A - m.B @ K).real.max()) for m in (rig.plant.linear(at), rig.linear(at))
    )
    if by_force < 0 <= by_command:
        force = rig.plant.inputs[0].unit
        raise BadInput(
            f"these gains stabilise the plant by a force [{force}], and not the rig by its command [{rig.unit}]: a "
            f'rig takes gains for its command, such as up.place(rig.linear("{at}"), ...); gains of a force belong to '
            "rig.plant, or divide them by rig.gain."
        )


def _rig(source: Any) -> Rig | None:
    """A rig, or that of a fit; a plant alone has no drive."""
    from upright.rig import Rig
    from upright.study.load import Study
    from upright.verbs.handover import rig_of
    from upright.verbs.model.fit import FitAnswer

    stored = isinstance(source, FitAnswer | Study | str | os.PathLike)
    return source if isinstance(source, Rig) else rig_of(source, "simulate", draws=0) if stored else None


def _plant(source: Any) -> Plant:
    plant = source if isinstance(source, Plant) else getattr(source, "plant", None)
    if isinstance(plant, Plant) and not isinstance(source, Record):  # a motion is of a plant, and none itself
        return plant
    if isinstance(source, type) and issubclass(source, Plant):
        raise BadInput(f"simulate needs a plant with numbers: {source.__name__}({source.names()[0]}=..., ...).")
    raise BadInput(f"simulate needs a plant, such as up.Pendulum(...), or a fit, got {type(source).__name__}.")


def _point(plant: Plant, law: Any, at: str | None) -> dict[str, float]:
    """Coordinates of the equilibrium about which a motion begins: the one named, or the one that the law is for."""
    here, wanted = _own_point(plant, law), plant.equilibrium(at)
    if here is None or (at is None and not isinstance(law, Law)):
        return wanted if here is None else {**wanted, **here}
    nearest_one = min(plant.equilibria, key=lambda name: _apart(plant.equilibrium(name), here))
    if at is None:
        return plant.equilibrium(nearest_one)
    if _apart(wanted, here) > _apart(plant.equilibrium(nearest_one), here):
        where = ", ".join(f"{name} = {value:.4g}" for name, value in here.items())
        kind = "law" if isinstance(law, Law) else "loop of these gains"
        raise BadInput(
            f"the {kind} regulates about {where}, which is {nearest_one}, and the motion is to begin {at}; linearize "
            f'there, .linear("{at}"), or pass the bare array to run it all the same.'
        )
    return wanted


def _check_named(plant: Plant, law: Any, at: str | None) -> None:
    """Refuse gains that say nothing of their equilibrium where nobody names it and there are several."""
    if at is None and len(plant.equilibria) > 1 and not isinstance(law, Law | Rule) and _own_point(plant, law) is None:
        named = " or ".join(f'at="{name}"' for name in plant.equilibria)
        raise BadInput(
            f"these gains do not say about which equilibrium they hold; say {named}. Those that up.place(plant.linear("
            "...), poles) gives know theirs."
        )


def _own_point(plant: Plant, law: Any) -> dict[str, float] | None:
    """Equilibrium that gains or a law are for, None where they do not say."""
    if isinstance(law, Gains):
        return None if law.point is None else {k: v for k, v in law.point.items() if k in plant.equilibrium()}
    names = [c.name for c in plant.coordinates]
    if not isinstance(law, Law) or law.readings != len(names) or np.ndim(law.target) > 1 or np.ndim(law.D) > 2:
        return None
    target = np.broadcast_to(np.asarray(law.target, dtype=np.float64), (len(names),))
    return dict(zip(law.measured or names, target.tolist(), strict=True))


def _apart(one: Mapping[str, float], other: Mapping[str, float]) -> float:
    return sum(abs(one[name] - other[name]) for name in other if name in one)


def _period(law: Any, dt: float | None) -> float:
    """Time between samples: the requested one, or the one that gains or a law are for."""
    own = law.period if isinstance(law, Gains | Law | Rule) else None
    if dt is not None and own is not None and not math.isclose(dt, own, rel_tol=1e-6):
        raise BadInput(
            f"these gains are for a period of {1e3 * own:.6g} ms, and dt is {1e3 * dt:.6g} ms; leave dt out, design "
            "for that period, or pass the bare array K to run it all the same."
        )
    return dt or own or 1e-3


def _start(names: Sequence[str], units: Sequence[str], point: Mapping[str, float], start: Any) -> Array:
    from upright.verbs.values import si

    x = np.zeros(len(names))
    for name, value in point.items():
        x[names.index(name)] = value
    if not isinstance(start, Mapping):
        try:
            aside = np.asarray(start, dtype=np.float64)
        except (TypeError, ValueError):
            aside = np.zeros(0)
        if aside.shape != (len(names),):
            raise BadInput(f"start is a deviation by state, such as {{'{names[0]}': 0.1}}, or {len(names)} numbers: "
                           f"{', '.join(names)}; got {start!r:.40}.")  # fmt: skip
        return x + aside
    deviations: Mapping[str, Any] = start
    for name, value in deviations.items():
        if name not in names:
            raise BadInput(f"start names states, got '{name}'; {nearest(name, names)}")
        i = names.index(name)
        x[i] += si(value, units[i])
    return x


def _steps(plant: Plant, counts: float | Mapping[str, float] | None) -> Array:
    """Step of each encoder [m or rad]; 0 where it is not rounded."""
    names = [c.name for c in plant.coordinates]
    if counts is None:
        return np.zeros(len(names))
    per = counts if isinstance(counts, Mapping) else dict.fromkeys(names, counts)
    for name, number in per.items():
        if name not in names:
            raise BadInput(f"counts names coordinates, got '{name}'; {nearest(name, names)}")
        if not isinstance(number, int | float) or not number > 0:  # type: ignore[reportUnnecessaryIsInstance]
            raise BadInput(f"counts takes numbers above 0, got {number!r:.40} for '{name}'.")
    turn = {c.name: math.tau if c.unit == "rad" else 1.0 for c in plant.coordinates}
    return np.array([turn[n] / per[n] if n in per else 0.0 for n in names])


def _loop(
    plant: Plant, law: Any, point: Mapping[str, float], dt: float, memory: float, limit: float, steps: Array
) -> Law | Rule | None:
    if law is None or isinstance(law, Law | Rule):
        return law
    K = read_gains(
        law, (len(plant.inputs), len(plant.state_names())), type(plant).__name__,
        f"simulate closes the loop by gains, a Law or a Rule, got {type(law).__name__}; up.place makes gains.",
    )  # fmt: skip
    target = np.array([point[c.name] for c in plant.coordinates])
    return state_feedback(K, dt, memory=memory, target=target, limit=limit, resolution=steps)


def _command(u: Any, t: Array, inputs: int) -> Array | None:
    if u is None:
        return None
    try:
        given = np.asarray([u(float(s)) for s in t] if callable(u) else u)
        if np.iscomplexobj(given):
            raise TypeError("complex")
        values = given.astype(np.float64)
    except (TypeError, ValueError):
        raise BadInput(
            f"u is a command, a function of time that gives one, or an array of them, got {u!r:.40}."
        ) from None
    if values.ndim == 0:
        values = np.full(t.size, float(values))
    values = values[:, None] if values.ndim == 1 else values
    if values.shape[1:] != (inputs,) or not 0 < len(values) <= len(t):
        raise BadInput(f"u needs at most {t.size} samples of {inputs} commands, got shape {values.shape}.")
    return np.vstack([values, np.repeat(values[-1:], len(t) - len(values), axis=0)])
