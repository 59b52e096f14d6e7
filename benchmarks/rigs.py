"""How often do 95 % intervals hold the truth on rigs drawn at random? Residuals have a memory.

Five plants, 40 rigs each, every number drawn within a factor of 1.6 about a typical one, dry friction included;
encoders round, and on top lies first-order noise whose autocorrelation from sample to sample lies from 0 to 0.95 and
whose size is 0.5 to 3 % of the spread of each principal component of the motion (two disks on one shaft err together,
their twist errs by a share of the twist). Fits start 20 to 40 % off. Of n honest intervals 95 % hold the truth, give or
take ``1.96 sqrt(0.95 * 0.05 / n)``.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.coverage import noise
from benchmarks.measure import Line, Spread, of_each, page
from upright.workers import HERE, Workers

SECONDS, DT = 8.0, 5e-3


@dataclass(frozen=True)
class Make:
    """A make of rig: plant, typical numbers to be found, known ones, and how it is moved."""

    plant: str
    sought: dict[str, float]
    known: dict[str, float]
    force: float
    start: dict[str, float]
    quantum: tuple[float, ...]


MAKES = (
    Make("pendulum", {"J_p": 4e-3, "b_2": 2e-3, "b_2c": 2e-3}, {"m_p": 0.2, "l_cg": 0.3}, 0.0,
         {"theta": 1.5}, (2 * math.pi / 4096,)),
    Make("torsional-2", {"J_1": 2e-3, "J_2": 2e-3, "k_12": 2.0, "c_1": 5e-3, "c_2": 3e-3, "f_1c": 5e-3}, {}, 0.1,
         {}, (2 * math.pi / 16000,) * 2),
    Make("rectilinear-2", {"m_1": 1.0, "m_2": 1.0, "k_1": 300.0, "k_12": 400.0, "c_1": 4.0, "c_2": 2.0, "f_1c": 0.2},
         {}, 6.0, {}, (4.4e-6,) * 2),
    Make("cart-pendulum", {"m_c": 0.6, "b_1": 2.0, "b_1c": 0.15, "J_p": 2e-3, "b_2": 5e-4},
         {"m_p": 0.2, "l_cg": 0.2}, 2.0, {"theta": 0.5}, (2e-5, 2 * math.pi / 4096)),
    Make("furuta", {"J_d": 4e-3, "J_p": 4e-4, "b_1": 4e-3, "b_1c": 3e-3, "b_2": 2e-4},
         {"m_p": 0.1, "l_cg": 0.12, "r": 0.15}, 0.05, {"theta": 0.8}, (2 * math.pi / 4096,) * 2),
)  # fmt: skip
KINDS = {"J": "inertia or mass", "m": "inertia or mass", "k": "stiffness", "b": "viscous", "c": "viscous"}


def kind(name: str) -> str:
    """What sort of number a parameter is."""
    return "Coulomb friction" if name.endswith("c") and len(name) > 3 else KINDS[name[0]]


def command(force: float, samples: int, generator: np.random.Generator) -> np.ndarray:
    """Steps of random height and length, (samples, 1)."""
    u = np.zeros(samples)
    k = 0
    while k < samples:
        n = int(generator.uniform(0.3, 1.5) / DT)
        u[k : k + n] = generator.choice([0.0, 1.0, -1.0, 0.6, -0.6]) * force
        k += n
    return u[:, None]


def outcome(make: Make, seed: int) -> tuple[dict[str, bool], dict[str, str], bool]:
    """Whether each interval held the truth, its status, and whether the fit is trusted, of one rig."""
    from upright.identification import Parameter, Rig, Run
    from upright.identification.estimate import identify
    from upright.physics import find
    from upright.simulation import simulate

    generator = np.random.default_rng(seed)
    plant = find(make.plant)
    truth = {n: v * 2 ** generator.uniform(-0.7, 0.7) for n, v in make.sought.items()}
    if make.plant in ("pendulum", "cart-pendulum", "furuta"):  # a body is no lighter than its own mass makes it
        truth["J_p"] = max(truth["J_p"], 0.3 * make.known["m_p"] * make.known["l_cg"] ** 2)
    samples = round(SECONDS / DT) + 1
    u = command(make.force, samples, generator) if plant.inputs else np.zeros((samples, 0))
    states = plant.state_names()
    x0 = [make.start.get(n, 0.0) for n in states]
    x = simulate(plant(**truth, **make.known), {}, x0, u if plant.inputs else None, DT, samples=samples, substeps=2)
    measured = tuple(c.name for c in plant.coordinates)
    clean = x[:, ::2, 0]
    memory, loud = generator.uniform(0, 0.95), generator.uniform(0.005, 0.03)
    _, size, axes = np.linalg.svd(clean - clean.mean(axis=0), full_matrices=False)
    white = np.stack([noise(samples, memory, generator) for _ in measured], axis=1)
    rough = (loud * white * size / math.sqrt(samples)) @ axes
    y = np.round((clean + rough) / make.quantum) * np.array(make.quantum)
    run = Run(label="run", role="fit", t=np.arange(samples) * DT, u=u if u.size else np.zeros((samples, 1)), y=y,
              measured=measured, quantum=make.quantum)  # fmt: skip
    parameters: dict[str, Any] = {n: Parameter(name=n, value=v) for n, v in make.known.items()}
    for n, v in truth.items():
        off = 1 + generator.choice([-1, 1]) * generator.uniform(0.2, 0.4)
        lower = 0.0
        parameters[n] = Parameter(name=n, value=v * off, estimate=True, lower=lower)
    fit = identify(Rig(plant=plant, parameters=parameters, substeps=2), [run])
    held, status = {}, {}
    for n, v in truth.items():
        e = fit.estimates[n]
        held[n], status[n] = e.interval[0] <= v <= e.interval[1], e.status
    return held, status, fit.trusted


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Share of intervals that hold the truth by plant and kind of number."""
    each = 8 if quick else 40
    every: list[bool] = []
    lines: list[Line] = []
    for place, make in enumerate(MAKES):
        progress(f"{each} rigs like {make.plant}")
        seeds = range(1000 * place, 1000 * place + each)
        done, seconds = of_each(functools.partial(outcome, make), seeds, workers)
        tally: dict[str, list[bool]] = {}
        for held, _, _ in done:
            for n, hit in held.items():
                tally.setdefault(kind(n), []).append(hit)
        lines += [_line(f"{make.plant}: {what}", hits, seconds) for what, hits in tally.items()]
        every += [hit for hits in tally.values() for hit in hits]
        firm = [s == "firm" for _, status, _ in done for s in status.values()]
        trusted = sum(good for *_, good in done)
        note = f"{trusted} of {each} fits trusted, {sum(firm)} of {len(firm)} numbers firm"
        lines.append(Line(contender=f"{make.plant}: fits", seconds=seconds, note=note))
    lines.append(_line("all", every, None))
    if markdown is not None:
        rows = [f"| {line.contender} | {line.note} |" for line in lines]
        body = ["", f"| of {each * len(MAKES)} rigs | |", "|---|---|", *rows]
        markdown.write_text(page("rigs", "Coverage", __doc__, body), encoding="utf-8")
    return lines


def _line(name: str, hits: list[bool], seconds: Spread | None) -> Line:
    share, n = 100 * float(np.mean(hits)), len(hits)
    give = 196 * math.sqrt(0.95 * 0.05 / n)
    note = f"{share:.1f} % of {n} intervals hold the truth (95 +- {give:.1f} if honest)"
    return Line(contender=name, seconds=seconds, note=note)
