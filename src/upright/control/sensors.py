"""Does every encoder show what is true? Asked of the hanging rig, before a loop is closed that would act on a lie.

A command that swings the model to about 100 degrees is put out blindly, then the rig coasts. What the encoders show is
compared with the motion of the model, whose numbers may move as far as they are known: s of ``reading = s motion`` is
what an encoder shows over what is true. Nothing but physics can fix it: the period of a large swing tells its true
amplitude (a pendulum at 90 degrees is 18 % slower than at 10), momentum what the driven body does for that swing, and
the sign of the drive that of both.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from upright.control.ascent import swing_up
from upright.control.rig import Rig
from upright.control.swing_up import SwingUp
from upright.control.trial import SUBSTEPS, logged
from upright.physics import Plant
from upright.records import Record
from upright.simulation import simulate

Array = NDArray[np.float64]

SWING = math.radians(100)
"""Angle to which the model is swung [rad]."""
COAST = 4.0
"""How long the rig is watched coasting [s]."""
TOLERATED = 0.05
"""Error of a scale that is not spoken of; a loop bears a gain wrong by as much."""
SURE = 4.0
"""Standard errors by which a scale must be off as well."""
KNOWN = {"m": 0.02, "l": 0.02, "r": 0.02, "J": 0.03, "b": 0.2}
"""How well a plant's numbers are known where no fit says so, by their first letter; relative standard errors."""
GAIN_KNOWN = 0.03
_EVERY = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class Scales:
    """What each encoder shows over what is true.

    Attributes
    ----------
    names : tuple of str
        Coordinates.
    value, error : array, shape (coordinates,)
        Scales with their standard errors.
    explained : array, shape (coordinates,)
        Share of each signal that the model with these scales explains, 1 for all.
    shown, motion : array, shape (N, coordinates)
        Readings, and the model's motion times the scales; t, shape (N,), is their time [s].
    """

    names: tuple[str, ...]
    value: Array
    error: Array
    explained: Array
    t: Array
    shown: Array
    motion: Array

    @property
    def wrong(self) -> tuple[str, ...]:
        """Coordinates whose encoder is not to be trusted."""
        off = np.abs(self.value - 1.0)
        bad = ((off > TOLERATED) & (off > SURE * self.error)) | (self.explained < 0.8)
        return tuple(n for n, b in zip(self.names, bad, strict=True) if b)

    @property
    def sound(self) -> bool:
        """Whether the loop may be closed."""
        return not self.wrong

    @property
    def verdict(self) -> str:
        """What the encoders are worth, in a sentence or two."""
        rows = dict(zip(self.names, zip(self.value, self.error, self.explained, strict=True), strict=True))
        if self.sound:
            figures = ", ".join(f"{n} {v:.3f} ± {2 * e:.3f}" for n, (v, e, _) in rows.items())
            return f"The encoders show what is true ({figures} of it, 95 %)."
        return " ".join(sentence(n, *rows[n]) for n in self.wrong)


def sentence(name: str, value: float, error: float, explained: float) -> str:
    """What is wrong with one encoder, and how to mend it."""
    if explained < 0.8:
        return (
            f"The motion of {name} is not that of the model ({100 * explained:.0f} % explained), whatever its scale: "
            "look for a slipping encoder, a cable or a number of the model that is far off; do not close the loop."
        )
    turned = ", the wrong way round" if value < 0 else ""
    return (
        f"The encoder of {name} shows {abs(value):.3g} (± {2 * error:.2g}) times what is true{turned}: multiply its "
        f"counts per unit by {value:.4g}, or mend its wiring, before the loop is closed."
    )


def probe(model: Rig, law: SwingUp) -> Array:
    """Commands, shape (N,), that swing the model to `SWING`, then nothing for `COAST`."""
    run = swing_up(model, law, seconds=6.0)
    there = np.flatnonzero(run.energy > -law.body.weight * (1.0 + math.cos(SWING)))
    pumped = int(there[0]) if there.size else run.energy.size // 2
    return np.concatenate([run.trial.u[:pumped], np.zeros(round(COAST / model.period))])


def put_out(rig: Rig, command: Array) -> Record:
    """What the encoders of a hanging rig show under commands put out blindly."""
    x = simulate(
        rig.plant, rig.drive, rig.plant.state("hanging"), command, rig.period, samples=command.size + 1,
        substeps=SUBSTEPS,
    )[:, :, 0]  # fmt: skip
    u = np.append(command, 0.0)
    return logged(rig, np.arange(u.size, dtype=np.float64) * rig.period, x, u)


def scales(model: Rig, log: Record, known: Mapping[str, float] | None = None) -> Scales:
    """Scales of the encoders from a log of a hanging rig under known commands.

    The model's numbers move within what is known of them (least squares with that as a prior), since an error of theirs
    would pass for one of the encoders. Errors of fits are correlated over a swing, so every quarter of one counts once.

    Parameters
    ----------
    model : Rig
    log : Record
        Readings by coordinate and ``u``, from rest, at the servo's samples.
    known : mapping of str to float, optional
        Relative standard error of a parameter, or of ``"gain"``; `KNOWN` where omitted.
    """
    names = tuple(c.name for c in model.plant.coordinates)
    shown = np.column_stack([log[n] for n in names])[::_EVERY]
    told = _known(model.plant, known or {})
    moving, size = tuple(told), np.array(list(told.values()))
    command = log["u"]
    z = np.zeros(size.size)
    at = _motion(model, command, moving, z[None])[:, :, 0]
    s = _projected(shown, at)
    quarters = max(8.0, 2.0 * float(np.sum(np.diff(np.sign(at[:, 1])) != 0)))
    step = 0.3
    cost = math.inf
    for _ in range(8):
        trials = np.vstack([z, z + step * np.eye(size.size)]) * size
        y = _motion(model, command, moving, trials)
        at, slopes = y[:, :, 0], (y[:, :, 1:] - y[:, :, :1]) / step
        left = shown - s * at
        sigma = np.maximum(np.sqrt(np.mean(left**2, axis=0)), model.quantum) * math.sqrt(len(shown) / quarters)
        J = [np.zeros((len(shown), len(names) + size.size)) for _ in names]
        for i, block in enumerate(J):
            block[:, i], block[:, len(names) :] = at[:, i] / sigma[i], s[i] * slopes[:, i] / sigma[i]
        whole = np.vstack([*J, np.eye(len(names) + size.size)[len(names) :]])
        rest = np.concatenate([*(left / sigma).T, -z])
        move = np.linalg.lstsq(whole, rest, rcond=None)[0]
        s, z = s + move[: len(names)], np.clip(z + move[len(names) :], -4.0, 4.0)
        before, cost = cost, float(np.abs(move[len(names) :]).max())
        if cost < 1e-2 or (cost > 0.9 * before > 0 and cost < 0.1):
            break
    at = _motion(model, command, moving, (z * size)[None])[:, :, 0]
    s = _projected(shown, at)
    covariance = np.linalg.inv(whole.T @ whole)
    spread = np.maximum(np.mean((shown - shown.mean(axis=0)) ** 2, axis=0), model.quantum**2)
    return Scales(
        names=names, value=s, error=np.sqrt(np.diag(covariance)[: len(names)]),
        explained=1.0 - np.mean((shown - s * at) ** 2, axis=0) / spread, t=log.t[::_EVERY], shown=shown, motion=s * at,
    )  # fmt: skip


def _known(plant: Plant, known: Mapping[str, float]) -> dict[str, float]:
    out = {"gain": known.get("gain", GAIN_KNOWN)}
    for name, value in plant.parameters().items():
        if value != 0.0 and name != "g" and (size := known.get(name, KNOWN.get(name[0], 0.0))) > 0.0:
            out[name] = size
    return out


def _projected(shown: Array, motion: Array) -> Array:
    return np.sum(shown * motion, axis=0) / np.maximum(np.sum(motion**2, axis=0), 1e-300)


def _motion(model: Rig, command: Array, names: Sequence[str], logs: Array) -> Array:
    """Coordinates of the model, shape (N, coordinates, lanes), for logarithms of factors, shape (lanes, names)."""
    values = model.plant.parameters() | {"gain": model.gain}
    params = {n: values[n] * np.exp(logs[:, i]) for i, n in enumerate(names)}
    drive = {**model.drive, "actuator.gain": params.pop("gain")}
    rows = -(-command.size // _EVERY)
    start = np.tile(model.plant.state("hanging"), (max(2, len(logs)), 1))  # two, so that one kernel serves all
    doubled = {n: np.resize(v, len(start)) for n, v in (params | {"actuator.gain": drive["actuator.gain"]}).items()}
    x = simulate(
        model.plant, {**drive, **doubled}, start, command, model.period, samples=rows, every=_EVERY, substeps=SUBSTEPS
    )
    return x[:, 0::2, : len(logs)]


def lifted(rig: Rig, shown: float) -> str:
    """What a hand that lifted the pendulum upright learns from its reading [rad]; "" when it is half a turn.

    The encoder was zeroed where the pendulum hangs. A sign cannot be told, since half a turn either way is upright.
    """
    off = abs(abs(shown) - math.pi)
    if off <= math.radians(10):
        return ""
    return (
        f"The encoder of theta shows {math.degrees(shown):.0f} degrees for half a turn, {abs(shown) / math.pi:.3g} times "
        "what is true; the loop stays open. Correct its counts per turn, or zero it where the pendulum hangs."
    )
