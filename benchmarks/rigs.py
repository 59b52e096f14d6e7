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
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.coverage import noise
from benchmarks.measure import Line, Spread, of_each, page, shares
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
    resolution: tuple[float, ...]


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


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Of one fit: by parameter whether its interval held the truth, how wide it is beside the truth, and its status."""

    held: dict[str, bool]
    width: dict[str, float]
    status: dict[str, str]
    trusted: bool
    explained: float


def drawn(make: Make, generator: np.random.Generator) -> tuple[dict[str, float], np.ndarray]:
    """Numbers of one rig of a make, and the commands (samples, inputs) that it is given."""
    truth = {n: v * 2 ** generator.uniform(-0.7, 0.7) for n, v in make.sought.items()}
    if make.plant in ("pendulum", "cart-pendulum", "furuta"):  # a body is no lighter than its own mass makes it
        truth["J_p"] = max(truth["J_p"], 0.3 * make.known["m_p"] * make.known["l_cg"] ** 2)
    return truth, command(make.force, round(SECONDS / DT) + 1, generator)


def outcome(make: Make, seed: int) -> Outcome:
    """What a fit says of one rig whose motion has coloured noise on it."""
    from upright.physics import find
    from upright.simulation import simulate

    generator = np.random.default_rng(seed)
    plant = find(make.plant)
    truth, u = drawn(make, generator)
    samples, states = len(u), plant.state_names()
    x0 = [make.start.get(n, 0.0) for n in states]
    x = simulate(plant(**truth, **make.known), {}, x0, u if plant.inputs else None, DT, samples=samples, substeps=2)
    memory, loud = generator.uniform(0, 0.95), generator.uniform(0.005, 0.03)
    return judged(make, truth, u, sensed(make, x[:, ::2, 0], memory, loud, generator), generator)


def sensed(make: Make, clean: np.ndarray, memory: float, loud: float, generator: np.random.Generator) -> np.ndarray:
    """Motion (samples, coordinates) with noise, a share `loud` of each principal component, and rounded by encoders."""
    samples = len(clean)
    _, size, axes = np.linalg.svd(clean - clean.mean(axis=0), full_matrices=False)
    white = np.stack([noise(samples, memory, generator) for _ in make.resolution], axis=1)
    rough = (loud * white * size / math.sqrt(samples)) @ axes
    return np.round((clean + rough) / make.resolution) * np.array(make.resolution)


def logged(make: Make, label: str, role: Any, u: np.ndarray, y: np.ndarray) -> Any:
    """A run of commands and positions."""
    from upright.identification import Run
    from upright.physics import find

    measured = tuple(c.name for c in find(make.plant).coordinates)
    t = np.arange(float(len(u))) * DT
    return Run(label=label, role=role, t=t, u=u, y=y, measured=measured, resolution=make.resolution)


def asked(make: Make, guesses: dict[str, float], known: dict[str, float] | None = None) -> Any:
    """A rig whose numbers are asked from guesses, besides what is known of its make and more."""
    from upright.identification import GreyBox, Parameter
    from upright.physics import find

    parameters = {n: Parameter(name=n, value=v) for n, v in {**make.known, **(known or {})}.items()}
    parameters |= {n: Parameter(name=n, value=v, estimate=True, lower=0.0) for n, v in guesses.items()}
    return GreyBox(plant=find(make.plant), parameters=parameters, substeps=2)


def judged(
    make: Make, truth: dict[str, float], u: np.ndarray, y: np.ndarray, generator: np.random.Generator
) -> Outcome:
    """What a fit of commands and positions says, beside the truth."""
    from upright.identification.estimate import identify

    guesses = {n: v * (1 + generator.choice([-1, 1]) * generator.uniform(0.2, 0.4)) for n, v in truth.items()}
    fit = identify(asked(make, guesses), [logged(make, "run", "fit", u, y)])
    said = {n: fit.estimates[n] for n in truth}
    return Outcome(
        held={n: e.interval[0] <= truth[n] <= e.interval[1] for n, e in said.items()},
        width={n: (e.interval[1] - e.interval[0]) / truth[n] for n, e in said.items()},
        status={n: e.status for n, e in said.items()},
        trusted=fit.trusted,
        explained=min(fit.runs["run"].fit_percent.values()),
    )


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Share of intervals that hold the truth by plant and kind of number."""
    each = 2 if quick else 40
    done: dict[str, tuple[list[Outcome], Spread]] = {}
    for place, make in enumerate(MAKES):
        progress(f"{each} rigs like {make.plant}")
        seeds = range(1000 * place, 1000 * place + each)
        done[make.plant] = of_each(functools.partial(outcome, make), seeds, workers)
    lines = told(done)
    if markdown is not None:
        publish(markdown, "rigs", "Coverage", __doc__, lines, headline(lines))
    return lines


def publish(file: Path, name: str, title: str, about: str | None, lines: list[Line], result: str) -> None:
    """Write the lines as a page."""
    body = ["", "| | |", "|---|---|", *(f"| {line.contender} | {line.note} |" for line in lines)]
    file.write_text(page(name, title, about, body, result), encoding="utf-8")


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of all and of each kind of number."""
    held = shares(lines)
    least = min(held, key=lambda name: held[name])
    (note,) = (line.note for line in lines if line.contender == "all")
    return f"{note.partition(',')[0]}; of one kind at least {held[least]:.1f} % do ({least})."


def told(done: dict[str, tuple[list[Outcome], Spread]]) -> list[Line]:
    """Lines of each plant, of each kind of number and of all."""
    lines: list[Line] = []
    every: dict[str, list[tuple[bool, float]]] = {}
    for plant, (outcomes, seconds) in done.items():
        tally: dict[str, list[tuple[bool, float]]] = {}
        for o in outcomes:
            for n, hit in o.held.items():
                tally.setdefault(kind(n), []).append((hit, o.width[n]))
        lines += [_line(f"{plant}: {what}", hits, seconds) for what, hits in tally.items()]
        for what, hits in tally.items():
            every.setdefault(what, []).extend(hits)
        firm = [s == "well determined" for o in outcomes for s in o.status.values()]
        trusted = [o for o in outcomes if o.trusted]
        hits = [hit for o in trusted for hit in o.held.values()]
        note = f"{len(trusted)} of {len(outcomes)} fits trusted, {sum(firm)} of {len(firm)} numbers firm; "
        note += f"{100 * float(np.mean(hits)):.1f} % of the intervals of trusted fits hold the truth; " if hits else ""
        note += f"median fit {np.median([o.explained for o in outcomes]):.1f} %"
        lines.append(Line(contender=f"{plant}: fits", seconds=seconds, note=note))
    lines += [_line(f"all: {what}", hits, None) for what, hits in every.items()]
    lines.append(_line("all", [hit for hits in every.values() for hit in hits], None))
    return lines


def _line(name: str, hits: list[tuple[bool, float]], seconds: Spread | None) -> Line:
    share, n = 100 * float(np.mean([hit for hit, _ in hits])), len(hits)
    give = 196 * math.sqrt(0.95 * 0.05 / n)
    note = f"{share:.1f} % of {n} intervals hold the truth (95 +- {give:.1f} if honest)"
    note += f", median width {100 * float(np.median([width for _, width in hits])):.3g} % of it"
    return Line(contender=name, seconds=seconds, note=note)
