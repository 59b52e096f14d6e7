"""Assumed numbers: what rests on each, and what the data say without it.

A log in volts and counts fixes inertia per gain, not inertia. Take the gain as 1 and say so
(``gain = { value = "1 N m/V", assumed = true }``): what is proportional to it is reported in volts, seconds and counts
as well, and what does not feel it (frequencies, damping ratios, speeds) is known. A number without a source has a
range: what rests on it is no better known than that, its ratio to it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from upright.identification.inference.covariance import Optimum
from upright.identification.model.fit import Assumption, Estimate
from upright.identification.model.grey_box import NOISE, Parameter
from upright.identification.problem.normal_equations import pseudo_inverse
from upright.identification.problem.residuals import Problem
from upright.identification.problem.unknowns import shared_unknowns
from upright.units import denominator

Array = NDArray[np.float64]

NEGLIGIBLE = 0.02
"""Percent per percent below which a number does not rest on an assumed one; a whole number is met as closely."""


RANGE = 10.0
"""A number that nobody measured may be so many times larger or smaller: drafts write its order of magnitude."""

STANDS_FOR = {"J_p": {"l_cg": "J_A/(m_p l_cg)"}}
"""What an estimate is worth beside a number assumed to be zero: l_cg is the length of the simple pendulum then."""


def assumptions(best: Optimum, estimates: Mapping[str, Estimate], *, evaluate: bool = True) -> tuple[Assumption, ...]:
    """How every estimate would follow each assumed number, and its value without it.

    The optimum moves by ``d theta/d g = -(J'J)^-1 J'J_g`` when g does (implicit function theorem); nothing is fitted
    again. Unless that is to be evaluated, or where the model runs away beside the optimum, nobody knows what follows;
    nor what follows the scale of a column in counts.
    """
    problem, value = best.problem, best.values
    assumed = [p for p in problem.rig.parameters.values() if p.assumed]
    unevaluated = {u.name: math.nan for u in problem.unknowns if u.shared and u.estimated}
    scales = [
        Assumption(
            name=name, value=counts, unit="1" if name.endswith("rev") else "1/m", follows=unevaluated, without={},
            size=counts, range=(counts / RANGE, counts * RANGE),
        )
        for name, counts in problem.rig.assumed_scales.items()
    ]  # fmt: skip
    if not assumed:
        return tuple(scales)
    places = [
        i for i, u in enumerate(problem.unknowns) if u.shared and u.estimated and not best.pinned[i] and value[i] != 0
    ]
    unknowns = [problem.unknowns[i] for i in places]
    moves, sizes = _moves(best, assumed, places) if evaluate else (None, None)
    out: list[Assumption] = []
    for k, p in enumerate(assumed):
        shifts = [math.nan] * len(places) if moves is None else moves[:, k].tolist()
        size = abs(p.value) if sizes is None else float(sizes[k])
        follows = {u.name: float(m) for u, m in zip(unknowns, shifts, strict=True)}
        out.append(
            Assumption(
                name=p.name, value=p.value, unit=p.unit, follows=follows, size=size,
                without=_without(p, follows, estimates, problem), range=_range(p, size),
            )
        )  # fmt: skip
    out += scales
    return tuple(replace(a, ratios=_ratios(a, out, estimates)) for a in out)


def _range(p: Parameter, size: float) -> tuple[float, float]:
    """Where an assumed number may lie: between the bounds it was given, or about as large as it stands there.

    One assumed to be zero may be so large that it matters as much as any estimate does.
    """
    low, high = (-size, size) if p.value == 0 else sorted((p.value / RANGE, p.value * RANGE))
    if p.value == 0 and p.unit in POSITIVE:
        low = 0.0
    return (p.lower if math.isfinite(p.lower) else low), (p.upper if math.isfinite(p.upper) else high)


SMALL = 1e-12
"""Share of an assumed number that stands for none of it."""

POSITIVE = ("kg", "kg m^2", "m")
"""Units of what is never negative."""


def _factors(a: Assumption, name: str) -> tuple[float, float]:
    """Least and largest factor on an estimate as an assumed number goes through its range, by the power it follows."""
    power = a.follows.get(name, 0.0)
    if math.isnan(power):  # not evaluated
        return 1.0, 1.0
    ends = [end / a.value if a.value else math.exp(end / a.size) if a.size else 1.0 for end in a.range]
    most = -math.log(SMALL)  # what follows by a high power is anything
    steps = [min(max(power * math.log(max(end, SMALL)), -most), most) for end in ends]
    return math.exp(min(0.0, *steps)), math.exp(max(0.0, *steps))


def _over_ranges(interval: tuple[float, float], name: str, rested: Sequence[Assumption]) -> tuple[float, float]:
    """An interval that holds what the ranges of all the assumed numbers in `rested` make of it."""
    for a in rested:
        ends = [end * factor if end else 0.0 for end, factor in product(interval, _factors(a, name))]
        interval = min(ends), max(ends)
    return interval


def _ratios(a: Assumption, rested: Sequence[Assumption], estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """What is known whatever one assumed number is; each holds what the other assumed ones may be."""
    others = [b for b in rested if b.name != a.name]
    growing = [n for n in proportional(a) if not n.startswith(NOISE)]
    per = {n: f"{n}/{a.name.removeprefix('actuator.')}" for n in growing}
    lumped = {n: name for n, name in STANDS_FOR.get(a.name, {}).items() if a.value == 0 and n in a.follows}
    out: dict[str, Estimate] = {}
    for n, name in {**per, **lumped}.items():
        e = a.without.get(n, estimates[n])
        scaled = n in per and n not in a.without
        beside = _beside(n, a, others, estimates) if scaled else None
        if beside is not None:
            name, e = f"{n}/({a.name} {beside})", _quotient(e, estimates[beside])
            out[name] = replace(
                e, value=e.value / a.value, stderr=e.stderr / abs(a.value),
                interval=(e.interval[0] / a.value, e.interval[1] / a.value), rests_on=(),
                unit=_per(estimates[n].unit, f"{a.unit} {estimates[beside].unit}"),
            )  # fmt: skip
            continue
        scale = 1 / a.value if scaled else 1.0
        rest = [b for b in others if n in resting(b)]
        low, high = _over_ranges(e.interval, n, rest)
        out[name] = replace(
            e, value=e.value * scale, stderr=e.stderr * abs(scale), interval=(low * scale, high * scale),
            unit=_per(e.unit, a.unit) if scaled else e.unit, rests_on=tuple(b.name for b in rest),
            status=_resting(e, [b.name for b in rest]),
        )  # fmt: skip
    return out


def _beside(n: str, a: Assumption, others: Sequence[Assumption], estimates: Mapping[str, Estimate]) -> str | None:
    """An estimate that follows all other assumed numbers as `n` does, and not `a`; None where `n` follows none.

    The equation of a pendulum about its hinge, divided by m_p l_cg, is known whatever J_p is.
    """
    rest = [b for b in others if n in resting(b)]
    if not rest or a.value <= 0:
        return None
    feeling = {m for b in others for m in resting(b) if b not in rest} | set(resting(a))
    alike = (
        m for m in rest[0].follows
        if m != n and m not in feeling and estimates[m].interval[0] > 0
        and all(abs(b.follows[m] - b.follows[n]) < NEGLIGIBLE for b in rest)
    )  # fmt: skip
    return min(alike, key=lambda m: estimates[m].stderr / estimates[m].value, default=None)


def _quotient(above: Estimate, below: Estimate) -> Estimate:
    """One estimate per another, as wide as both intervals together make it."""
    ends = [x / y for x, y in product(above.interval, below.interval)]
    value = above.value / below.value
    stderr = above.stderr / below.value + abs(value) * below.stderr / below.value
    return replace(above, value=value, stderr=stderr, interval=(min(ends), max(ends)))


def _per(above: str, below: str) -> str:
    if below in ("", "1"):
        return above
    return f"{above} per {below}"


def _moves(best: Optimum, assumed: Sequence[Parameter], places: Sequence[int]) -> tuple[Array | None, Array]:
    """Relative change (estimated, assumed) of each estimate per relative change of an assumed number, and sizes."""
    problem, x, value = best.problem, best.x, best.values
    names = {p.name for p in assumed}
    loose = {
        n: replace(p, uncertainty=abs(p.value) or 1.0) if n in names else replace(p, uncertainty=0.0, estimate=False)
        for n, p in problem.rig.parameters.items()
    }
    extra = shared_unknowns(replace(problem.rig, parameters=loose))
    steps = np.array([1e-6 * u.scale for u in extra])
    wider = replace(problem, unknowns=[*problem.unknowns, *extra], steps=np.concatenate([problem.steps, steps]))
    z = np.concatenate([x, [u.coordinate(u.value) for u in extra]])
    wider.settle_steps(z)
    normal = wider.normal(z)  # at the steps that were chosen, not near them: exponents distinguish ties
    sizes = np.array([abs(p.value) for p in assumed])
    if not math.isfinite(normal.cost):
        return None, sizes
    A = normal.matrix
    free = np.flatnonzero(~best.pinned)
    slopes = np.zeros((x.size, len(extra)))
    slopes[free] = -pseudo_inverse(A[np.ix_(free, free)]) @ A[np.ix_(free, np.arange(x.size, z.size))]
    per_relative = np.array([1.0 if problem.unknowns[i].log else float(value[i]) for i in places])
    effects = np.sqrt(np.maximum(np.diag(A), 0.0))
    most = float(np.max(effects[list(places)] * np.abs(per_relative), initial=0.0))
    zero = sizes == 0
    sizes[zero] = most / np.maximum(effects[x.size :][zero], 1e-300)
    change = np.array([1.0 if u.log else size * math.copysign(1.0, u.value)
                       for u, size in zip(extra, sizes, strict=True)])  # fmt: skip
    return slopes[list(places)] * change / per_relative[:, None], sizes


def proportional(a: Assumption) -> list[str]:
    """Names that grow as the assumed number does."""
    return [n for n, e in a.follows.items() if abs(e - 1) < NEGLIGIBLE and a.value != 0]


def untouched(a: Assumption) -> list[str]:
    """Names that do not feel the assumed number."""
    return [n for n, e in a.follows.items() if abs(e) < NEGLIGIBLE]


def resting(a: Assumption) -> list[str]:
    """Names that would move with the assumed number, or may."""
    free = untouched(a)
    return [n for n in a.follows if n not in free]


def with_assumptions(estimates: Mapping[str, Estimate], rested: Sequence[Assumption]) -> dict[str, Estimate]:
    """The estimates, each with the assumed numbers that it rests on, as wide as their ranges make it."""
    out: dict[str, Estimate] = {}
    for n, e in estimates.items():
        rests = [a for a in rested if n in resting(a)]
        out[n] = e
        if rests:
            names = tuple(a.name for a in rests)
            status = _resting(e, names)
            wide = _over_ranges(e.interval, n, rests)
            out[n] = replace(e, rests_on=names, status=status, given=e.interval, interval=wide)
    return out


def _resting(e: Estimate, names: Sequence[str]) -> str:
    return f"rests on {', '.join(names)}" if names and e.status == "well determined" else e.status


def assumption_sentences(rested: Sequence[Assumption]) -> tuple[str, ...]:
    """What rests on which assumed number, and what would make it known."""
    sentences: list[str] = []
    for a in rested:
        along, free, moved = proportional(a), untouched(a), resting(a)
        unit = "" if a.unit in ("", "1") else f" {a.unit}"
        low, high = a.range
        within = (
            f", anything from {low:.2g} to {high:.2g}" if moved and math.isfinite(high - low) and low < high else ""
        )
        parts = [f"{a.name} = {a.value:g}{unit} is assumed, not known{within}"]
        if any(math.isnan(e) for e in a.follows.values()):
            parts.append("what rests on it was not evaluated, so every estimate may")
        else:
            other = {n: e for n, e in a.follows.items() if n in moved and n not in along}
            if along:
                verb = "is" if len(along) == 1 else "are"
                parts.append(f"{', '.join(along)} {verb} proportional to it, so their ratios are known")
            if other and a.value != 0:
                shifts = ", ".join(f"{n} by {e:+.2g} %" for n, e in other.items())
                parts.append(f"for every percent of it {shifts} would follow")
            elif other:
                parts.append(f"{', '.join(other)} would move with it")
            if a.value == 0 and a.ratios:
                verb = "does" if len(a.ratios) == 1 else "do"
                parts.append(f"{', '.join(a.ratios)} {verb} not")
            if free:
                parts.append(f"{', '.join(free)} {'does' if len(free) == 1 else 'do'} not depend on it")
        sentences.append("; ".join(parts) + "." + (f" {remedy(a)}" if moved else ""))
    return tuple(sentences)


def remedy(a: Assumption) -> str:
    """What frees the numbers that rest on an assumed one."""
    table, _, key = a.name.rpartition(".")
    if table.startswith("sensors."):
        one = "one full turn" if key == "counts_per_rev" else "one metre"
        return f"Move it by {one}, see how much its column changes, and write that: {key} = ... under [{table}]."
    unit = "" if a.unit in ("", "1") else f" {a.unit}"
    table = "[actuator]" if a.name.startswith("actuator.") else "[parameters]"
    return f'Measure {a.name} and give it as known, {key} = "...{unit}" under {table}.'


def _without(
    assumed: Parameter, follows: Mapping[str, float], estimates: Mapping[str, Estimate], problem: Problem
) -> dict[str, Estimate]:
    """Estimates per assumed gain, in units of the command, seconds, and counts if all encoders have one resolution."""
    if assumed.name != "actuator.gain":
        return {}
    force, command = assumed.unit.partition("/")[0], denominator(assumed.unit)
    quanta = {q for track in problem.tracks for q in track.run.resolution}
    resolution = quanta.pop() if len(quanta) == 1 else 0.0
    out: dict[str, Estimate] = {}
    for n, share in follows.items():
        power = per_length(problem.rig.parameters[n].unit, force) if abs(share - 1) < NEGLIGIBLE else None
        if power is None:
            continue
        time, length = power
        factor = resolution**-length / assumed.value if resolution > 0 else 1.0 / assumed.value
        e = estimates[n]
        out[n] = replace(
            e,
            value=e.value * factor,
            stderr=e.stderr * factor,
            interval=(e.interval[0] * factor, e.interval[1] * factor),
            unit=_written(command or "1", time, length, "count" if resolution > 0 else force_length(force)),
        )
    return out


def force_length(force: str) -> str:
    """What a force of this unit moves along: metres, or radians for a torque."""
    return "rad" if force == "N m" else "m"


def per_length(unit: str, force: str) -> tuple[int, int] | None:
    """Powers of seconds and of lengths (metres, or radians for a torque) left when a unit is divided by a force.

    None when the unit is not a force times such powers: an inertia of 1 kg m^2 is 1 N m s^2/rad.
    """
    unit = {"kg": "N s^2/m", "kg m^2": "N m s^2/rad", "kg/m": "N s^2/m^2"}.get(unit, unit)
    along = force_length(force)
    above, _, below = unit.partition("/")
    if above != force and not above.startswith(f"{force} "):
        return None
    powers = {"s": 0, along: 0}
    for text, sign in ((above.removeprefix(force), 1), (below.strip("()"), -1)):
        for token in text.split():
            base, _, power = token.partition("^")
            if base not in powers:
                return None
            powers[base] += sign * int(power or 1)
    return powers["s"], powers[along]


def _written(command: str, time: int, length: int, along: str) -> str:
    """Unit of a ratio: V s^2/count."""
    top = [command, *(f"s^{time}" if time > 1 else "s" for _ in range(time > 0))]
    below = [f"{along}^{-length}" if length < -1 else along for _ in range(length < 0)]
    return " ".join(top) + (f"/{below[0]}" if below else "")
