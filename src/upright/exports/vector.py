"""Readings and the commands that the kernel answers them with, for a program elsewhere to replay and compare."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from upright.exports.controller import SampledController
from upright.laws import Law, Rule
from upright.laws.linear import Array
from upright.physics.equations import Derived
from upright.simulation import Held, simulate

SAMPLES = 48
"""Few enough for the 2 kB of a small microcontroller, enough for every memory to be filled and the limit to be met."""
BEYOND = 1.5
"""Largest requested command, in limits, so that some samples are limited and most are not."""
SINGLE = 2.0**-24
"""Unit roundoff of IEEE single precision."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ReplayVector:
    """One replay.

    Attributes
    ----------
    readings : array, shape (N, readings)
    references : array, shape (N, references)
    commands : array, shape (N, inputs)
        Of the kernel, in double precision.
    single : float
        How far single precision may miss them.
    """

    readings: Array
    references: Array
    commands: Array
    single: float


def self_test(made: SampledController) -> ReplayVector:
    """Readings that swing about rest, faster and faster, on the steps of the encoders; a reference that steps.

    The commands are those of the compiled kernel with the readings as prescribed motion: of the one that simulates
    this law on a rig.
    """
    if isinstance(made.law, Rule):
        return _of_rule(made)
    law, k = made.linear, np.arange(SAMPLES)
    n, target = len(made.readings), law.arrays()["target"][0]
    shape = np.column_stack([np.cos(0.006 * (i + 2) * k**1.6 + i) for i in range(n)])
    signal = np.repeat(np.where(k < SAMPLES // 2, 0.0, 0.5)[:, None], len(made.references), axis=1)
    unit = replace(law, references=signal, limit=math.inf, command_resolution=0.0, resolution=0.0, delay=0.0)
    peak = float(np.abs(unit.follow(target + shape)[0]).max(initial=0.0))
    size = BEYOND * law.limit / peak if math.isfinite(law.limit) and peak > 0 else 0.1
    readings = _on_steps(made, target + size * shape)
    references = size * signal
    full = replace(law, references=references, delay=0.0)
    return ReplayVector(
        readings=readings, references=references, commands=kernel_commands(full, readings, len(law.C)),
        single=_single_precision(made, full, readings),
    )  # fmt: skip


def _of_rule(made: SampledController) -> ReplayVector:
    """Readings that swing about zero, further and further, as far as a turn: a function switches nobody knows where.

    How far single precision may then miss nobody knows either.
    """
    k, law = np.arange(SAMPLES), made.law
    size = np.geomspace(1e-3, 2 * math.pi, SAMPLES)[:, None]
    shape = np.column_stack([np.cos(0.02 * (i + 2) * k**1.6 + i) for i in range(len(made.readings))])
    readings = _on_steps(made, size * shape)
    references = np.repeat(np.where(k < SAMPLES // 2, 0.0, 0.5)[:, None], len(made.references), axis=1)
    full = replace(law, references=references, delay=0.0)
    commands = kernel_commands(full, readings, len(made.commands))
    return ReplayVector(readings=readings, references=references, commands=commands, single=0.0)


def _on_steps(made: SampledController, readings: Array) -> Array:
    """As the encoders show them."""
    step = made.encoder
    on_steps = np.floor(readings / np.where(step > 0, step, 1.0) + 0.5) * step
    return np.where(step > 0, on_steps, readings)


def kernel_commands(law: Law | Rule, readings: Array, inputs: int) -> Array:
    """Commands of the kernel, shape (N, inputs), where every coordinate moves as prescribed."""
    n = readings.shape[1]
    names, forces = tuple(f"y{i}" for i in range(n)), tuple(f"u{j}" for j in range(inputs))
    nothing = Derived(
        name="Readings", coordinates=names, inputs=forces, parameters=(), lumps=(), trig=(), steps=(),
        mass=tuple("1.0" if i == j else "0" for i in range(n) for j in range(i, n)), force=("0.0",) * n,
        stiffness=("0",) * n * n, damping=("0",) * n * n, gain=("0",) * n * inputs, kinetic="0", potential="0",
        power_lost="0",
    )  # fmt: skip
    grid = np.repeat(readings, 2, axis=0)[:-1]  # a sample and the middle between it and the next
    still = np.zeros(len(grid))
    held = {name: Held(q=grid[:, i], v=still, a=still) for i, name in enumerate(names)}
    x0 = np.zeros(2 * n)
    x0[::2] = readings[0]
    motion = simulate(nothing, {}, x0, None, law.needed_period, samples=len(readings), loop=law, held=held)
    return motion[:, 2 * n :, 0]


def _single_precision(made: SampledController, law: Law, readings: Array) -> float:
    """Largest error of the commands in single precision, to first order along the replay.

    Readings and their targets are rounded as they are, and the law answers what that moves them by. A sum of m terms
    errs by at most m + 2 roundings of the sum of their sizes, coefficients and products included; what the memory errs
    by comes back through powers of A. A command off its true value may be rounded to the converter's next step, and one
    about the limit may hold a sum or let it run on.
    """
    memory = law.follow(readings)[1]
    target, signal, p = law.arrays()["target"][0], law.signal(), readings.shape[1]
    w = np.hstack([readings - target, np.broadcast_to(signal, (len(readings), signal.shape[1]))])
    A, B, C, D = (np.abs(getattr(law, name)) for name in "ABCD")
    roundings = (A.shape[0] + D.shape[1] + 2) * SINGLE
    free = replace(law, limit=math.inf, command_resolution=0.0, target=0.0, initial=None, delay=0.0, windup="free")
    moved = np.abs(replace(free, references=_rounding(signal)).follow(_rounding(readings) - _rounding(target))[0])
    commands = memory @ law.C.T + w @ law.D.T
    jump = np.abs(memory @ law.A.T + w @ law.B.T - memory) * (law.windup == "hold")
    begin = 0.0 if law.begin is None else np.abs(law.begin) @ np.abs(w[0, :p])
    # what a sample adds to the error of the memory, and what that is later, by the samples in between
    added = [roundings * (begin + np.abs(memory[0]))]
    later = [np.abs(law.C)]
    power, step, worst = np.eye(len(A)), made.converter, np.zeros(len(C))
    for k in range(len(readings)):
        error = moved[k] + roundings * (C @ np.abs(memory[k]) + D @ np.abs(w[k])) + SINGLE * (D @ np.abs(w[k]))
        error = error + sum((m @ e for m, e in zip(reversed(later), added, strict=True)), np.zeros(len(C)))
        worst = np.maximum(worst, error)
        near = bool((np.abs(np.abs(commands[k]) - law.limit) <= error + step).any())
        summed = A @ np.abs(memory[k]) + B @ np.abs(w[k])
        added.append(roundings * summed + SINGLE * (B @ np.abs(w[k])) + near * jump[k])
        power = law.A @ power
        later.append(np.abs(law.C @ power))
    on_steps = np.where(step > 0, step * np.ceil(worst / np.where(step > 0, step, 1.0)), worst)
    return float(on_steps.max(initial=0.0)) + 4 * SINGLE * min(law.limit, float(np.abs(commands).max(initial=0.0)))


def _rounding(values: Array) -> Array:
    """What single precision makes of numbers, less what they are."""
    return values.astype(np.float32).astype(np.float64) - values
