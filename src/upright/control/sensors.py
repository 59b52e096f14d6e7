"""Scales of encoders, from the hanging rig before a loop is closed; `watch` monitors a running one.

A command that swings the model to about 100 degrees is put out blindly, then the rig coasts. What the encoders show is
compared with the motion of the model, whose numbers may move as far as they are known: s of ``reading = s motion`` is
what an encoder shows over what is true. Nothing but physics can fix it: the period of a large swing tells its true
amplitude (a pendulum at 90 degrees is 18 % slower than at 10), momentum what the driven body does for that swing, and
the sign of the drive that of both. How the driven body drifts meanwhile says nothing: a rig out of level, a command's
offset and dry friction all make it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from upright.control.swing_up import SwingUp
from upright.control.trial import logged, steps_in_period, trial
from upright.records import Array, Record
from upright.rig import Rig
from upright.simulation import simulate

SWING = math.radians(100)
"""Angle to which the model is swung [rad]."""
PUMP, COAST = 2.5, 4.0
"""How long the rig may be driven blindly, and is watched coasting [s]."""
TOLERATED = 0.05
"""Error of a scale that is not spoken of; a loop bears a gain wrong by as much."""
SURE = 4.0
"""Standard errors by which a scale must be off as well."""
KNOWN = {"m": 0.02, "l": 0.02, "r": 0.02, "J": 0.03, "b": 0.2}
"""How well a plant's numbers are known where no fit says so, by their first letter; relative standard errors."""
GAIN_KNOWN, LAG_KNOWN = 0.03, 0.5
_SAMPLED = 7e-3  # s between the samples that are looked at


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
            figures = ", ".join(f"{n} {v:.4f} ± {2 * e:.1g}" for n, (v, e, _) in rows.items())
            return f"The encoders show what is true ({figures} of it, 95 %)."
        return " ".join(encoder_sentence(n, *rows[n]) for n in self.wrong)


def encoder_sentence(name: str, value: float, error: float, explained: float) -> str:
    """What is wrong with one encoder, and how to mend it."""
    if explained < 0.8:
        return (
            f"The motion of {name} is not that of the model ({100 * explained:.0f} % explained), whatever its scale: "
            "look for a slipping encoder, a cable or a number of the model that is far off; do not close the loop."
        )
    size = f"{abs(value):.4g} (± {2 * error:.1g}) times what is true"
    if value > 0:
        what, remedy = f"shows {size}", f"multiply its counts per unit by {value:.4g}"
    elif abs(value + 1.0) <= TOLERATED:
        what, remedy = "counts the wrong way round", "swap its two channels"
    else:
        what, remedy = f"counts the wrong way round, {size}", f"multiply its counts per unit by {value:.4g}"
    return f"The encoder of {name} {what}: {remedy} before the loop is closed."


def probe(model: Rig, law: SwingUp) -> Array:
    """Commands, shape (N,), that swing the model to `SWING`, as far as that takes no longer than `PUMP`; then none."""
    x0 = model.plant.state("hanging")
    rule = law.rule(model, x0)
    run = trial(model, rule, at="inverted", start=x0 - model.plant.state("inverted"), seconds=PUMP)
    energy = law.body.energy(run.x[:, 2], run.x[:, 3])
    there = np.flatnonzero(energy > -law.body.weight * (1.0 + math.cos(SWING)))
    pumped = int(there[0]) if there.size else run.u.size
    name = model.plant.coordinates[0].name
    while True:  # coasting, the driven body goes on; on the model it stays within the travel
        command = np.concatenate([run.u[:pumped], np.zeros(round(COAST / model.period))])
        if pumped < 100 or np.abs(shown_by_encoders(model, command)[name]).max() < 0.9 * law.travel:
            return command
        pumped = round(0.85 * pumped)


def shown_by_encoders(rig: Rig, command: Array) -> Record:
    """What the encoders of a hanging rig show under commands put out blindly."""
    x = simulate(
        rig.plant, rig.drive, rig.plant.state("hanging"), command, rig.period, samples=command.size + 1,
        substeps=steps_in_period(rig),
    )[:, :, 0]  # fmt: skip
    u = np.append(command, 0.0)
    return logged(rig, np.arange(u.size, dtype=np.float64) * rig.period, x, u)


def scales(model: Rig, log: Record, known: Mapping[str, float] | None = None) -> Scales:
    """Scales of the encoders from a log of a hanging rig under known commands.

    The model's numbers move within what is known of them (least squares with that as a prior), since an error of theirs
    would pass for one of the encoders. Errors of fits are correlated over a swing, so every quarter of one counts once.

    Parameters
    ----------
    log : Record
        Readings by coordinate [m or rad] and ``u``, from rest, evenly sampled.
    known : mapping of str to float, optional
        Relative standard error of a parameter, or of ``"gain"``. Where omitted, 2 % of a mass or length, 3 % of an
        inertia, 20 % of friction, 3 % of the gain.
    """
    names = tuple(c.name for c in model.plant.coordinates)
    model = model.replace(period=log.period)
    every = max(1, round(_SAMPLED / model.period))
    shown = np.column_stack([log[n] for n in names])[::every]
    known_sizes = _known(model, known or {})
    moving, size = tuple(known_sizes), np.array(list(known_sizes.values()))
    p, m, command = len(names), size.size, log["u"]
    drift = np.linspace(0.0, 1.0, len(shown))[:, None] ** np.arange(1, 4)
    z, step, J = np.zeros(m), 0.3, np.zeros((0, 0))
    s, wander, at, sigma = np.ones(p), np.zeros(3), shown, np.full(p, np.inf)
    part = math.ceil(0.4 * len(shown))
    for turn in range(12):  # first the beginning, then all: errors of the model grow with time
        y = _motion(model, command, every, moving, np.vstack([z, z + step * np.eye(m)]) * size)
        at, slopes = y[:, :, 0], (y[:, :, 1:] - y[:, :, :1]) / step
        if turn == 0:
            s, wander = _projected(shown[:part], at[:part], drift[:part])
        left = shown - s * at
        left[:, 0] -= drift @ wander
        left[part:] = 0.0
        quarters = max(8.0, 2.0 * float(np.sum(np.diff(np.sign(at[:, 1])) != 0)))
        before = sigma
        sigma = np.maximum(np.sqrt(np.mean(left[:part] ** 2, axis=0)), model.resolution) * math.sqrt(
            len(shown) / quarters
        )
        # unknown: scales, drift of the driven body, numbers of the model in units of what is known of them
        J = np.zeros((p * len(shown) + m, p + 3 + m))
        for i in range(p):
            rows = slice(i * len(shown), i * len(shown) + part)
            J[rows, i], J[rows, p + 3 :] = at[:part, i] / sigma[i], s[i] * slopes[:part, i] / sigma[i]
            if i == 0:
                J[rows, p : p + 3] = drift[:part] / sigma[i]
        J[p * len(shown) :, p + 3 :] = np.eye(m)
        move = np.linalg.lstsq(J, np.concatenate([*(left / sigma).T, -z]), rcond=None)[0]
        s, wander, z = s + move[:p], wander + move[p : p + 3], np.clip(z + move[p + 3 :], -4.0, 4.0)
        if part == len(shown) and np.abs(move[p + 3 :]).max() < 1e-2 and np.abs(sigma / before - 1.0).max() < 0.05:
            break
        if turn >= 4 or np.abs(move[p + 3 :]).max() < 0.1:
            part = len(shown)
    at = _motion(model, command, every, moving, (z * size)[None])[:, :, 0]
    s, wander = _projected(shown, at, drift)
    motion = s * at
    motion[:, 0] += drift @ wander
    spread = np.maximum(np.mean((shown - shown.mean(axis=0)) ** 2, axis=0), model.resolution**2)
    return Scales(
        names=names, value=s, error=np.sqrt(np.diag(np.linalg.inv(J.T @ J))[:p]),
        explained=1.0 - np.mean((shown - motion) ** 2, axis=0) / spread, t=log.t[::every], shown=shown, motion=motion,
    )  # fmt: skip


def _known(model: Rig, known: Mapping[str, float]) -> dict[str, float]:
    """Relative standard errors of the numbers that may move."""
    out = {"gain": known.get("gain", GAIN_KNOWN)} | ({"lag": LAG_KNOWN} if model.lag else {})
    for name, value in model.plant.parameters().items():
        if value != 0.0 and name != "g" and (size := known.get(name, KNOWN.get(name[0], 0.0))) > 0.0:
            out[name] = size
    return out


def _projected(shown: Array, motion: Array, drift: Array) -> tuple[Array, Array]:
    """Scales that bring the motion nearest to what is shown, and the drift of the driven body."""
    first = np.linalg.lstsq(np.column_stack([motion[:, 0], drift]), shown[:, 0], rcond=None)[0]
    rest = np.sum(shown[:, 1:] * motion[:, 1:], axis=0) / np.maximum(np.sum(motion[:, 1:] ** 2, axis=0), 1e-300)
    return np.array([first[0], *rest], dtype=np.float64), np.asarray(first[1:], dtype=np.float64)


def _motion(model: Rig, command: Array, every: int, names: Sequence[str], logs: Array) -> Array:
    """Coordinates of the model, shape (N, coordinates, lanes), for logarithms of factors, shape (lanes, names)."""
    values = model.plant.parameters() | {"gain": model.gain, "lag": model.lag}
    lanes = max(2, len(logs))  # two, so that one kernel serves all
    params = {n: np.resize(values[n] * np.exp(logs[:, i]), lanes) for i, n in enumerate(names)}
    drive = dict(model.drive) | {f"actuator.{n}": params.pop(n) for n in ("gain", "lag") if n in params}
    rows = -(-command.size // every)
    start = np.tile(model.plant.state("hanging"), (lanes, 1))
    x = simulate(
        model.plant, drive | params, start, command, model.period, samples=rows, every=every,
        substeps=steps_in_period(model),
    )  # fmt: skip
    return x[:, 0::2, : len(logs)]


def lifted(rig: Rig, shown: float) -> str:
    """What a hand that lifted the pendulum upright learns from its reading [rad]; "" when it is half a turn.

    The encoder was zeroed where the pendulum hangs. A sign cannot be determined, since half a turn either way is
    upright.
    """
    off = abs(abs(shown) - math.pi)
    if off <= math.radians(10):
        return ""
    return (
        f"The encoder of theta shows {math.degrees(shown):.0f} degrees for half a turn, {abs(shown) / math.pi:.3g} "
        "times what is true; the loop stays open. Correct its counts per turn, or zero it where the pendulum hangs."
    )
