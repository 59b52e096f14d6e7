"""How often do 95 % intervals contain the truth on rigs whose physics the model does not have?

The rigs are those of `rigs`, 40 of each plant. They move by equations with more effects than are fitted, each as large
as logs of real rigs show it:

- dry friction that is larger close to rest: Stribeck, up to 50 %
- torque that ripples with the drive's angle: up to 1 % of the command
- play of the encoders: up to 0.06 degrees or 50 um
- encoders off centre: up to 0.1 degrees
- a frame out of level: up to 0.3 degrees
- commands that arrive 0 to 2 ms late
- a belt through which a tenth of the driven inertia is driven, resonant at 30 to 60 Hz
- 0.3 % of coloured noise

Fits start 20 to 40 % off and know nothing of this. Required: 90 to 99 % of all intervals, and at least 85 % for each
kind of parameter.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Line, Spread, of_each, shares
from benchmarks.rigs import DT, MAKES, Make, Outcome, drawn, judged, publish, sensed, told
from upright.workers import HERE, Workers

GRAVITY = 9.81
FINE = 10
"""Steps of the integration per sample."""

SPEED = {"pendulum": 5.0, "torsional-2": 5.0, "rectilinear-2": 0.3, "cart-pendulum": 0.5, "furuta": 5.0}
"""Typical speed of what rubs; friction has its Stribeck excess below a few percent of it, and creeps far below."""

STRIBECK, CREEP = 0.05, 3e-4
TURN = {"rad": 2 * math.pi, "m": 0.08}
"""Motion per turn of the encoder's shaft, by unit of the coordinate."""

PLAY = {"rad": 1e-3, "m": 5e-5}
"""Most play of an encoder."""

DRIVEN = {"torsional-2": "J_1", "rectilinear-2": "m_1", "cart-pendulum": "m_c", "furuta": "J_d"}
BEHIND, DAMPED = 0.1, 0.05
"""Share of the driven inertia that sits behind the belt, and damping ratio of their resonance."""


ALL, KIND = (90, 99), 85
"""Percent of all intervals and of those of one kind that are required."""
SEED = 310_000
"""Of the first rig; what intervals hold was never chosen on these."""


class Flaws:
    """What a fit does not know of each rig, arrays (rigs,)."""

    def __init__(self, count: int, generator: np.random.Generator) -> None:
        uniform = functools.partial(generator.uniform, size=count)
        self.excess = uniform(0.1, 0.5)
        self.ripple, self.ripples = uniform(0.0, 0.01), generator.integers(6, 24, count)
        self.play = uniform(0.0, 1.0)
        self.tilt = np.radians(uniform(-0.3, 0.3))
        self.late = generator.integers(0, 5, count)
        self.resonance = 2 * math.pi * uniform(30.0, 60.0)
        self.off_centre = uniform(0.0, np.radians(0.1))
        self.phase = generator.uniform(0.0, 2 * math.pi, (2, count))


def moved(make: Make, truths: list[dict[str, float]], u: np.ndarray, flaws: Flaws) -> np.ndarray:
    """Motion (samples, coordinates, rigs) of flawed rigs under commands `u` (samples, rigs), by Runge and Kutta."""
    from upright.physics import find
    from upright.physics.equations import mass_and_force

    plant = find(make.plant)
    derived = plant.derived()
    names, units = derived.coordinates, [c.unit for c in plant.coordinates]
    p: dict[str, Any] = {n: np.array([t[n] for t in truths]) for n in truths[0]} | make.known
    p = plant(**dict.fromkeys(p, 1.0)).parameters() | p
    driven = names.index(plant.inputs[0].on) if make.force else 0
    speed, whole, motor, belt = SPEED[make.plant], p, np.ones(len(truths)), np.zeros(len(truths))
    if make.force:
        motor = BEHIND * p[DRIVEN[make.plant]]
        p = p | {DRIVEN[make.plant]: p[DRIVEN[make.plant]] - motor}
        belt = motor * (1 - BEHIND) * flaws.resonance**2  # of two inertias on one spring

    def slope(q: np.ndarray, v: np.ndarray, command: np.ndarray) -> np.ndarray:
        """Accelerations of the coordinates and, last, of the motor behind the belt."""
        q, v, ahead, faster = q[:-1], v[:-1], q[-1] - q[driven], v[-1] - v[driven]
        scope = p | dict(zip(names, q, strict=True)) | {f"{n}_dot": w for n, w in zip(names, v, strict=True)}
        angle = 2 * math.pi * q[driven] / TURN[units[driven]]
        torque = command + flaws.ripple * make.force * np.sin(flaws.ripples * angle)
        pull = belt * (ahead + 2 * DAMPED / flaws.resonance * faster)
        scope |= {source.name: pull for source in plant.inputs}
        M, f = mass_and_force(derived, scope)
        f = f + out_of_level(make.plant, whole, q, flaws)
        for joint in derived.joints:
            along = np.array(joint.direction)[:, None]
            w = (along * v).sum(axis=0)
            level = p[joint.coulomb] * (1 + flaws.excess * np.exp(-((w / (STRIBECK * speed)) ** 2)))
            f -= (along * level * np.tanh(w / (CREEP * speed))).T
        a = np.linalg.solve(M, f[..., None])[..., 0].T
        return np.vstack([a, (torque - pull) / motor])

    count, h = len(truths), DT / FINE
    q, v = np.zeros((len(names) + 1, count)), np.zeros((len(names) + 1, count))
    for state, value in make.start.items():
        q[names.index(state)] = value
    out = np.empty((len(u), len(names), count))
    fine = np.repeat(u, FINE, axis=0)
    for k in range(len(u)):
        out[k] = q[:-1]
        for i in range(FINE):
            command = fine[np.maximum(k * FINE + i - flaws.late, 0), np.arange(count)]
            a1 = slope(q, v, command)
            a2 = slope(q + h / 2 * v, v + h / 2 * a1, command)
            a3 = slope(q + h / 2 * v + h * h / 4 * a1, v + h / 2 * a2, command)
            a4 = slope(q + h * v + h * h / 2 * a2, v + h * a3, command)
            q, v = q + h * v + h * h / 6 * (a1 + a2 + a3), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return out


def out_of_level(plant: str, p: dict[str, Any], q: np.ndarray, flaws: Flaws) -> np.ndarray:
    """Generalized forces (rigs, coordinates) of a frame that is tilted a little."""
    f = np.zeros((q.shape[1], len(q)))
    side = GRAVITY * flaws.tilt
    if plant == "rectilinear-2":
        f[:, 0], f[:, 1] = -p["m_1"] * side, -p["m_2"] * side
    elif plant == "cart-pendulum":
        f[:, 0] = -(p["m_c"] + p["m_p"]) * side
    elif plant == "furuta":  # the hanging mass sits at r (cos, sin) psi + l sin(theta) (-sin, cos) psi
        psi, theta = q[0] - flaws.phase[0], q[1]
        f[:, 0] = p["m_p"] * side * (p["r"] * np.sin(psi) + p["l_cg"] * np.sin(theta) * np.cos(psi))
        f[:, 1] = p["m_p"] * side * p["l_cg"] * np.cos(theta) * np.sin(psi)
    if plant in ("pendulum", "cart-pendulum"):
        f[:, -1] -= p["m_p"] * p["l_cg"] * GRAVITY * (np.sin(q[-1] + flaws.tilt) - np.sin(q[-1]))
    return f


def read(make: Make, motion: np.ndarray, flaws: Flaws, rig: int) -> np.ndarray:
    """What encoders that are coupled and mounted as they are make of one rig's motion (samples, coordinates)."""
    from upright.physics import find

    y = motion.copy()
    for i, c in enumerate(find(make.plant).coordinates):
        q, turn = motion[:, i], TURN[c.unit]
        half = flaws.play[rig] * PLAY[c.unit] / 2
        felt = q.copy()
        for k in range(1, len(felt)):
            felt[k] = min(max(felt[k - 1], q[k] - half), q[k] + half)
        off = flaws.off_centre[rig] * turn / (2 * math.pi)
        y[:, i] = felt + off * np.sin(2 * math.pi * q / turn + flaws.phase[i, rig])
    return y


def records(make: Make, place: int, count: int) -> list[tuple[dict[str, float], np.ndarray, np.ndarray, int]]:
    """Numbers, commands (samples, inputs) and positions read (samples, coordinates) of flawed rigs, and a seed."""
    generators = [np.random.default_rng(SEED + 1000 * place + k) for k in range(count)]
    rigs = [drawn(make, g) for g in generators]
    flaws = Flaws(count, np.random.default_rng(SEED + place))
    u = np.stack([command[:, 0] for _, command in rigs], axis=1)
    motion = moved(make, [truth for truth, _ in rigs], u, flaws)
    out: list[tuple[dict[str, float], np.ndarray, np.ndarray, int]] = []
    for k, ((truth, command), generator) in enumerate(zip(rigs, generators, strict=True)):
        y = read(make, motion[:, :, k], flaws, k)
        noisy = sensed(make, y, generator.uniform(0, 0.95), 0.003, generator)
        out.append((truth, command, noisy, int(generator.integers(2**31))))
    return out


def one(make: Make, record: tuple[dict[str, float], np.ndarray, np.ndarray, int]) -> Outcome:
    """What a fit says of one record."""
    truth, u, y, seed = record
    return judged(make, truth, u, y, np.random.default_rng(seed))


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of all and of each kind of number."""
    held = shares(lines)
    few = [f"{name} {share:.1f} %" for name, share in held.items() if share < KIND]
    rest = f"fewer than {KIND} % do of {', '.join(few)}" if few else f"of each kind {KIND} % or more do"
    return f"{held['all']:.1f} % of all intervals contain the truth ({ALL[0]} to {ALL[1]} required); {rest}."


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Share of intervals that hold the truth by plant and kind of number."""
    done: dict[str, tuple[list[Outcome], Spread]] = {}
    for place, make in enumerate(MAKES[: 1 if quick else None]):
        each = 1 if quick else 40
        progress(f"{each} flawed rigs like {make.plant}")
        done[make.plant] = of_each(functools.partial(one, make), records(make, place, each), workers)
    lines = told(done)
    if markdown is not None:
        publish(markdown, "misfit", "Coverage under wrong models", __doc__, lines, headline(lines))
    return lines
