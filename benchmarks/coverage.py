"""How often does a 95 % interval hold the truth? Fits of one pendulum to records whose noise has a memory.

Inertia and viscous friction of a small swing are sought, first angle and speed with them; the noise, 5 % of the
swing at its beginning, is first-order with the autocorrelation given from sample to sample. Of 200 honest 95 %
intervals 190 hold the truth, give or take 6 (two standard errors).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from benchmarks.measure import Line, of_each
from upright.workers import HERE, Workers

TRUTH = {"m_p": 0.2, "l_cg": 0.3, "J_p": 2e-3, "b_2": 2e-3, "b_2c": 0.0, "b_2q": 0.0}
GUESS = {"J_p": 3e-3, "b_2": 1.5e-3}
ANGLE, PERIOD, LOUD = 0.4, 0.02, 0.02
SECONDS = (2.0, 4.0, 20.0)
MEMORY = (0.0, 0.5, 0.9)


def noise(samples: int, memory: float, generator: np.random.Generator) -> np.ndarray:
    """First-order noise (samples,) of unit variance."""
    white = generator.normal(size=samples)
    out = np.empty(samples)
    out[0] = white[0]
    for i in range(1, samples):
        out[i] = memory * out[i - 1] + math.sqrt(1 - memory**2) * white[i]
    return out


def held(seconds: float, memory: float, seed: int) -> list[bool]:
    """Whether the interval of each unknown held the truth."""
    from upright.identification import GreyBox, Parameter, Run
    from upright.identification.estimate import identify
    from upright.physics import Pendulum
    from upright.simulation import simulate

    n = round(seconds / PERIOD) + 1
    parameters = {
        name: Parameter(name=name, value=GUESS.get(name, value), estimate=name in GUESS)
        for name, value in TRUTH.items()
    }
    rig = GreyBox(plant=Pendulum, parameters=parameters)
    motion = simulate(Pendulum(**TRUTH), {}, [ANGLE, 0.0], None, PERIOD, samples=n)[:, 0, 0]
    y = motion + LOUD * noise(n, memory, np.random.default_rng(seed))
    run = Run(label="swing", role="fit", t=np.arange(n) * PERIOD, u=np.zeros((n, 1)), y=y[:, None],
              measured=("theta",))  # fmt: skip
    fit = identify(rig, [run], method="least-squares")
    intervals = {name: fit.estimates[name].interval for name in GUESS}
    return [low <= TRUTH[name] <= high for name, (low, high) in intervals.items()]


def run(*, quick: bool, progress: Callable[[str], None], workers: Workers = HERE) -> list[Line]:
    """Share of intervals that hold the truth, by length of the record and memory of its noise."""
    lines: list[Line] = []
    seeds = range(4 if quick else 200)
    for seconds in SECONDS:
        for memory in MEMORY:
            name = f"{seconds:g} s, autocorrelation {memory:g}"
            progress(name)
            hits, each = of_each(functools.partial(held, seconds, memory), seeds, workers)
            share = 100 * np.mean(hits, axis=0)
            said = ", ".join(f"{n} {s:.1f} %" for n, s in zip(GUESS, share, strict=True))
            note = f"95 % intervals that hold the truth, {len(seeds)} records: {said}"
            lines.append(Line(contender=name, seconds=each, note=note))
    return lines
