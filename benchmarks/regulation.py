"""Do controllers stabilise as often as predicted? 500 random twins, each identified, predicted and then run.

- **Rigs.** Every twin is another pendulum on a cart or Furuta pendulum, its parameters some percent off the design.
- **Identification.** Half a volt up and down for 2 s while it hangs, both encoders logged every 8 ms with noise of
  0.05 to 2 degrees. Gauss-Newton on the nonlinear model with dry friction estimates six parameters and the drive's
  gain. The covariance is what the noise leaves, with the rig model's spread of friction as prior. Noise is the only
  error here, so the covariance is honest; twins identified by frequency response, as in experiment 1b, are listed
  apart.
- **Controller.** Poles are one of Table 1's sets. Velocities come from plain or filtered differences or a Kalman
  filter. The limit is 2 to 5 V and the command up to 4 ms late.
- **Start.** Tilt and tap in some proportion, about the edge of what the identified model recovers from.
- **Prediction.** The share that is stabilised of 200 rigs drawn from the covariance, each with its own day-to-day
  friction and its own error of the hand. The controller then runs once on the true rig, with the friction of its day
  and one hand.

Twins of a third kind have physics that the model lacks (`upright.experiments.nonideal`: friction larger close to rest,
ripple, latency, a frame out of level, encoders with play and off centre). Their fits leave many times their errors
unexplained. Where a twin is identified as in 1b, the probability is that of `upright regulate`: over the fit's
covariance, friction close to rest and day-to-day variation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.measure import Line, of_each, page
from upright.report.drawing import BLACK, BLUE, GREY, SKY, figure, save, styled
from upright.workers import HERE, Workers

if TYPE_CHECKING:
    from upright.rig import Rig

IMAGE = Path("docs/images/regulation_reliability.png")
Array = NDArray[np.float64]
GAIN = "actuator.gain"
EVERY, SECONDS = 9, 2.0
STEP = 3e-3  # of differences; finer ones see the moments at which joints stick jump from sample to sample
LANES = 200
OFF = 0.05
"""Relative spread of the numbers sought, on top of that of the make."""
BINS = 10


@dataclass(frozen=True)
class Twin:
    """One twin: the probability predicted, and whether the law held it."""

    predicted: float
    held: bool


def identify(truth: Rig, seed: int) -> tuple[Rig, tuple[str, ...], Array] | None:
    """Best numbers and their covariance, in logarithms, from a log of the hanging rig; None when the search strays."""
    from upright.rig.makes import make_of, make_rig
    from upright.simulation import simulate

    rng = np.random.default_rng([seed, 61])
    make = make_of(truth.plant)
    names = (*make.sought, GAIN)
    rows = round(SECONDS / truth.period / EVERY) + 1
    size = 0.5 if make.key == "furuta" else 0.8
    u = size * np.sign(np.sin(2 * np.pi * np.arange(rows * EVERY) * truth.period / 0.35))
    x0 = np.zeros(4)

    def shown(rig: Rig, parameters: Mapping[str, Array], count: int) -> Array:
        x = simulate(rig.plant, {**rig.drive, **parameters}, x0, u, rig.period, samples=count, every=EVERY)
        return x[:, 0::2]

    noise = math.radians(0.05 * 40 ** rng.random())
    spread = np.array([noise if c.unit == "rad" else 0.2 * noise for c in truth.plant.coordinates])
    step = truth.resolution
    log = np.round(shown(truth, {}, rows)[:, :, 0] / step) * step + rng.normal(size=(rows, 2)) * spread
    error = np.hypot(spread, step / math.sqrt(12))
    model = make_rig(make.key)
    model = model.replace(period=truth.period, delay=truth.delay, lag=truth.lag, limit=truth.limit)
    known = {n: getattr(truth.plant, n) for n in ("m_p", "l_cg", "r") if n in truth.plant.names()}  # from the bench
    model = model.changed(**known)
    start = {n: model.gain if n == GAIN else getattr(model.plant, n) for n in names}
    # the make is known: friction differs by a seventh from rig to rig, and by what `setting` adds
    prior = np.array([1 / math.hypot(0.14, OFF) if n.startswith("b_") else 1.0 for n in names])
    p, cost, residual, J = np.zeros(len(names)), np.inf, np.zeros(1), np.eye(len(names))
    for horizon in (rows // 4, rows // 2, rows):  # the whole at once has false valleys
        damp, cost, tried = 1e-3, np.inf, p
        for _ in range(40):
            lanes = np.vstack([tried, tried + STEP * np.eye(p.size), tried - STEP * np.eye(p.size)])
            values = {n: start[n] * np.exp(lanes[:, i]) for i, n in enumerate(names)}
            y = shown(model, values, horizon) / error[:, None]
            off = np.concatenate([(log[:horizon] / error - y[:, :, 0]).ravel(), -prior * tried])
            now = float(off @ off)
            if now <= cost:
                gained, p, cost, damp, residual = cost - now, tried, now, damp / 5, off
                slope = (y[:, :, 1 : p.size + 1] - y[:, :, p.size + 1 :]) / (2 * STEP)
                J = np.vstack([slope.reshape(-1, p.size), np.diag(prior)])
                if gained < 1e-2:  # of a chi square
                    break
            else:
                damp *= 10
            H = J.T @ J
            tried = p + np.clip(np.linalg.solve(H + damp * np.diag(np.diag(H)), J.T @ residual), -0.5, 0.5)
    if not cost / residual.size < 1.3:
        return None
    covariance = np.linalg.inv(J.T @ J)
    best = {n: start[n] * math.exp(v) for n, v in zip(names, p, strict=True)}
    gain = best.pop(GAIN)
    return replace(model, plant=model.plant.replace(**best), gain=gain), names, covariance


def drawn(
    rig: Rig, names: tuple[str, ...], covariance: Array, rng: np.random.Generator, lanes: int
) -> dict[str, Array]:  # fmt: skip
    """Parameters of rigs that an identification allows, in logarithms Gaussian."""
    moves = rng.multivariate_normal(np.zeros(len(names)), covariance, size=lanes)
    value = {n: rig.gain if n == GAIN else getattr(rig.plant, n) for n in names}
    return {n: value[n] * np.exp(moves[:, i]) for i, n in enumerate(names)}


def setting(make: str, seed: int) -> tuple[Rig, np.random.Generator]:
    """The true rig, with its drive of this seed, and what is drawn besides."""
    from upright.rig.makes import MAKES, make_rig

    rng = np.random.default_rng([seed, 60])
    truth = make_rig(make, seed)
    off = {n: getattr(truth.plant, n) * math.exp(rng.normal(0, OFF)) for n in MAKES[make].sought}
    truth = truth.changed(**off)
    limit, delay = rng.uniform(2.0, 5.0), truth.delay + rng.choice([0.0, 1e-3, 2e-3, 3e-3])
    return truth.replace(limit=float(limit), delay=float(delay)), rng


def hands(start: Array, rng: np.random.Generator, lanes: int) -> Array:
    """Starts as a hand gives them."""
    from upright.experiments.regulation_2.run import HAND

    return start + rng.normal(size=(lanes, 4)) * np.array([0, 0, *HAND])


def one(make: str, seed: int, *, swept: Path | None = None, flawed: bool = False) -> Twin | None:
    """One twin from identification to outcome; `swept` is a folder for one identified as in experiment 1b."""
    from upright import gains
    from upright.control.score import outcomes
    from upright.designing.run import SPEEDS, velocities
    from upright.experiments.frequency_1b.run import run_frequency
    from upright.experiments.nonideal import nonideal
    from upright.experiments.regulation_2.run import SETS
    from upright.gains.requests import read_poles
    from upright.rig.completion import completed
    from upright.rig.makes import make_rig
    from upright.rig.variation import allowed, of_the_day
    from upright.study.stored_rig import read_stored_rig

    truth, rng = setting(make, seed)
    if swept is None:
        found = identify(truth, seed)
        if found is None:
            return None
        rig, names, covariance = found
        others = of_the_day(rig.plant, drawn(rig, names, covariance, rng, LANES), rng, LANES)
    else:
        limit, truth = truth.limit, make_rig(make, seed)
        truth = nonideal(truth, seed) if flawed else truth
        run_frequency(truth, seed, swept)
        known = read_stored_rig(swept / "fit.json", seed=seed, draws=LANES)
        truth, rig = truth.replace(limit=limit), completed(known).replace(limit=limit)
        others = allowed(rig, LANES, seed)
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    poles = read_poles(SETS[f"set {rng.integers(1, 5)}"])
    way = velocities(model, sampled, SPEEDS[rng.integers(3)], 0.5, rig.limit, rig.resolution)
    law = gains.feedback(way, gains.place(model.A, model.B, poles).K)
    angle = rng.uniform(0, math.pi / 2)
    outwards = np.array([0, 0, 0.7 * math.cos(angle), 6.0 * math.sin(angle)])
    steps = np.linspace(0, 1.0, 129)[1:]
    held = outcomes(rig, law, at="inverted", starts=steps[:, None] * outwards, seconds=2.0).held
    edge = steps[-1] if held.all() else steps[int(np.argmin(held))]
    start = outwards * edge * math.exp(rng.normal(-0.01, 0.045))
    run = partial(outcomes, law=law, at="inverted", seconds=3.0)
    predicted = run(rig, starts=hands(start, rng, LANES), parameters=others)
    measured = run(truth, starts=hands(start, rng, 1), parameters=of_the_day(truth.plant, {}, rng, 1))
    return Twin(float(np.mean(predicted.held)), bool(measured.held[0]))


def _twin(swept: bool, flawed: bool, twin: tuple[str, int]) -> Twin | None:
    with TemporaryDirectory() as folder:
        return one(*twin, swept=Path(folder) if swept else None, flawed=flawed)


KINDS = {
    "identified by steps": (500, 15, False, False),
    "identified as in 1b": (40, 2, True, False),
    "with physics that the model lacks, identified as in 1b": (120, 2, True, True),
}
"""Twins by what they are: how many, how many at a glance, whether swept, whether flawed."""


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Brier score and Murphy's parts of it (1973), over bins of equal width.

    brier = reliability - resolution + uncertainty, but for what varies inside a bin; `expected` is the score of
    probabilities that are right, `z` is Spiegelhalter's (1986), standard normal then, like `z_of_all` of the sum.
    """

    brier: float
    expected: float
    reliability: float
    resolution: float
    uncertainty: float
    z: float
    z_of_all: float

    @property
    def skill(self) -> float | None:
        """Share of the uncertainty that predictions remove; None where all outcomes were the same: there is none."""
        return 1 - self.brier / self.uncertainty if self.uncertainty else None


def calibration(predicted: Array, held: NDArray[np.bool_]) -> Calibration:
    """How good predicted probabilities were, given which twins held."""
    base = float(held.mean())
    place = np.clip((predicted * BINS + 1e-9).astype(int), 0, BINS - 1)
    reliability = resolution = 0.0
    for b in range(BINS):
        inside = place == b
        if inside.any():
            share = float(held[inside].mean())
            reliability += inside.mean() * (predicted[inside].mean() - share) ** 2
            resolution += inside.mean() * (share - base) ** 2
    sure = np.sum(predicted * (1 - predicted))
    spread = np.sum((1 - 2 * predicted) ** 2 * predicted * (1 - predicted))
    return Calibration(
        brier=float(np.mean((predicted - held) ** 2)), expected=float(np.mean(predicted * (1 - predicted))),
        reliability=float(reliability), resolution=float(resolution), uncertainty=base * (1 - base),
        z=float(np.sum((held - predicted) * (1 - 2 * predicted)) / math.sqrt(spread)) if spread else 0.0,
        z_of_all=float(np.sum(held - predicted) / math.sqrt(sure)) if sure else 0.0,
    )  # fmt: skip


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Brier score and its parts, for the twins and for those identified as in experiment 1b."""
    lines: list[Line] = []
    rows: list[str] = []
    main: tuple[int, float, float, float, float] | tuple[()] = ()
    for what, (all_, few, swept, flawed) in KINDS.items():
        count = few if quick else all_
        progress(f"{count} twins {what}")
        twins = [(("furuta", "linear")[i % 2], 1 + i // 2) for i in range(count)]
        outcome, each = of_each(partial(_twin, swept, flawed), twins, workers)
        kept = [t for t in outcome if t is not None]
        predicted, held = np.array([t.predicted for t in kept]), np.array([t.held for t in kept])
        if not kept:
            lines.append(Line(contender=what, seconds=each, note=f"none of {count} identifications succeeded"))
            continue
        found = calibration(predicted, held)
        skill = "not defined, all ended alike" if found.skill is None else f"{found.skill:.2f}"
        lines.append(
            Line(
                contender=what, seconds=each, error=found.brier,
                note=f"Brier {found.brier:.3f}, {found.expected:.3f} if calibrated; skill {skill}; "
                f"Spiegelhalter z {found.z:+.2f}; {100 * held.mean():.0f} % of {len(kept)} held, "
                f"predicted {100 * predicted.mean():.0f} %",
            )
        )  # fmt: skip
        rows += table(what, found, predicted, held, count - len(kept))
        if not main:
            main = (held.size, float(held.mean()), float(predicted.mean()), found.brier, found.expected)
        if markdown is not None and what == "identified by steps":
            save(reliability_figure(predicted, held, bins=BINS), IMAGE)
    if markdown is not None:
        picture = ["", f"![Share of twins that held, against the probability predicted](../{IMAGE.as_posix()})"]
        result = headline(*main)
        markdown.write_text(page("regulation", "Calibration", __doc__, [*picture, *rows], result), encoding="utf-8")
    return lines


def headline(twins: int, held: float, predicted: float, brier: float, expected: float) -> str:
    """The result in a sentence, of shares that were stabilised and predicted, and of Brier scores."""
    return (
        f"Of {twins} twins {100 * held:.1f} % were stabilised, and {100 * predicted:.1f} % were predicted to be; the "
        f"Brier score is {brier:.4f}, and {expected:.4f} is expected of right probabilities."
    )


@styled
def reliability_figure(predicted: Array, held: NDArray[np.bool_], *, bins: int = 10) -> Any:
    """Share that held by the probability predicted, with 95 % Wilson intervals, and how often each was predicted."""
    from scipy.stats import binomtest

    drawing = figure(4.6, width=5.0)
    grid: Any = drawing.add_gridspec(2, 1, height_ratios=(4, 1))
    ax: Any = drawing.add_subplot(grid[0])
    below: Any = drawing.add_subplot(grid[1], sharex=ax)
    ax.plot([0, 100], [0, 100], color=GREY, linewidth=0.8, label="as predicted")
    edges = np.linspace(0, 1, bins + 1)
    place = np.clip((predicted * bins + 1e-9).astype(int), 0, bins - 1)
    for b in range(bins):
        inside = place == b
        if not inside.any():
            continue
        low, high = binomtest(int(held[inside].sum()), int(inside.sum())).proportion_ci(method="wilson")
        mean, share = 100 * float(predicted[inside].mean()), 100 * float(held[inside].mean())
        ax.errorbar(
            mean, share, yerr=[[share - 100 * low], [100 * high - share]], fmt="o", color=BLUE, capsize=2.5,
            markersize=5, label="held, with 95 % interval" if b == place.min() else None,
        )  # fmt: skip
    below.bar(
        100 * edges[:-1], np.bincount(place, minlength=bins), 100 / bins, align="edge", color=SKY, edgecolor=BLACK
    )
    ax.set_ylabel("held [%]")
    ax.set_xlim(0, 100)
    ax.set_ylim(-3, 103)
    ax.tick_params(labelbottom=False)
    below.set_ylabel("twins")
    below.set_xlabel("probability predicted before the run [%]")
    ax.legend(loc="upper left")
    return drawing


def table(what: str, found: Calibration, predicted: Array, held: NDArray[np.bool_], strayed: int) -> list[str]:
    """Two tables of one kind of twins."""
    place = np.clip((predicted * BINS + 1e-9).astype(int), 0, BINS - 1)
    skill = "not defined, all ended alike" if found.skill is None else f"{100 * found.skill:.1f} %"
    lost = f"; for {strayed} more the identification said that it had failed" if strayed else ""
    out = [
        "", f"## {predicted.size} twins {what}{lost}", "", "| | |", "|---|---|",
        f"| Brier score | {found.brier:.4f} |", f"| the same if the probabilities are right | {found.expected:.4f} |",
        f"| reliability (0 is best) | {found.reliability:.4f} |", f"| resolution | {found.resolution:.4f} |",
        f"| uncertainty: the score of always predicting {100 * held.mean():.1f} % | {found.uncertainty:.4f} |",
        f"| skill over that | {skill} |",
        f"| Spiegelhalter's z (within ±1.96 for 95 % of right probabilities) | {found.z:+.2f} |",
        f"| z of how many held, of {predicted.sum():.1f} predicted (within ±1.96 likewise) | {found.z_of_all:+.2f} |",
        "", "| probability predicted | twins | mean predicted | held |", "|---|---|---|---|",
    ]  # fmt: skip
    for b in range(BINS):
        inside = place == b
        if inside.any():
            mean, share = 100 * predicted[inside].mean(), 100 * held[inside].mean()
            bounds = f"{100 * b // BINS} to {100 * (b + 1) // BINS} %"
            out.append(f"| {bounds} | {inside.sum()} | {mean:.1f} % | {share:.1f} % |")
    return out
