"""What does the rig do without a command? Creeping held bodies, drifting rest, oscillation that grows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import MISSING, fields

import numpy as np

from upright.diagnosis.case import HELD, Case, column_unit, tells_speed
from upright.diagnosis.findings import Curve, Finding, Panel
from upright.physics.equations import small_motions
from upright.quantities import two_figures
from upright.records import Array
from upright.signals.stretches import pieces, turning_points


def examine_rest(case: Case) -> list[Finding]:
    """Findings about bodies at rest or left alone."""
    return [*_creep(case), *_drift(case), *_grows(case)]


def _creep(case: Case) -> Iterator[Finding]:
    """Bodies that hardly move beside the others, yet do not stay where they are."""
    for c in case.measured if case.chained else ():
        unit, span = column_unit(c), case.span(c)
        largest = case.widest(unit)
        beside = case.span(largest)
        if not 5 * c.resolution.step < span < HELD * beside:
            continue
        yield Finding(
            kind="creep",
            columns=(c.name,),
            severity="warning",
            sentence=f"'{c.name}' moves {span:.4g} {unit}, {two_figures(100 * span / beside)} % of the motion"
            f" of '{largest.name}': a body that was held, but creeps.".replace("  ", " "),
            evidence={f"range [{unit or 1}]": span, f"beside [{unit or 1}]": beside},
            advice="Feed its measured motion in instead of locking it.",
            key=f'held = ["{case.coordinate(c.name)}"]',
            panels=case.over_time(c.name, largest.name),
        )


def _drift(case: Case) -> Iterator[Finding]:
    """Rest positions that differ from one rest to the next, of what springs or gravity centre."""
    rests = [span for span in case.inspection.rests if span[1] - span[0] > 0.2]
    if len(rests) < 2:
        return
    t, free = case.record.t, _turning_free(case)
    for c in case.measured:
        if tells_speed(c) or case.coordinate(c.name) in free:
            continue
        x = case.record[c.name]
        quiet = [s for s in rests if not case.driven or not np.any(case.u[(t >= s[0]) & (t <= s[1])])]
        levels = [float(np.median(x[(t >= a) & (t <= b)])) for a, b in quiet]
        if not case.driven:
            levels = levels[1:]  # before a release it is a hand that holds
        if len(levels) < 2 or any("reference" in remark for c in case.inspection.columns for remark in c.remarks):
            continue
        off, span = max(levels) - min(levels), float(np.ptp(x))
        if off > max(0.03 * span, 5 * c.resolution.step):
            unit = column_unit(c)
            yield Finding(
                kind="drift",
                columns=(c.name,),
                severity="note",
                sentence=f"'{c.name}' comes to rest {off:.4g} {unit} apart from where it lay before"
                f" ({two_figures(100 * off / span)} % of its range): dry friction holds it off centre,"
                " or the zero drifts.",
                evidence={f"apart [{unit or 1}]": off, "of the range [%]": 100 * off / span},
                advice="Ask for Coulomb friction, or an offset per run.",
                key=f'unknown = ["initial", "offset.{case.coordinate(c.name)}"]',
                panels=case.over_time(c.name),
                spans=tuple(quiet),
            )


def _turning_free(case: Case) -> frozenset[str]:
    """Angles that no spring and no gravity pulls back; where no number is known, springs that may be missing are."""
    plant = case.plant
    if plant is None:
        return frozenset()
    values = {f.name: 1.0 if f.default is MISSING else f.default for f in fields(plant)}  # type: ignore[arg-type]
    values |= {} if case.rig is None else case.rig.plant.parameters()
    at = next(iter(plant.equilibria.values()))
    stiffness = small_motions(plant.derived_for(values), {**values, **at})[2]
    _, s, ways = np.linalg.svd(stiffness)
    free = np.abs(ways[s <= 1e-9 * s.max()]).max(axis=0, initial=0.0)
    return frozenset(c.name for c, x in zip(plant.coordinates, free, strict=True) if c.unit == "rad" and x > 1e-6)


def _grows(case: Case) -> Iterator[Finding]:
    """Oscillation whose amplitude grows although the effort stays as it is."""
    t = case.record.t
    columns = [c for c in case.measured if not c.constant]
    if not columns:
        return
    free = [c for c in columns if case.beside(c) > HELD]
    for start, stop in pieces(np.diff(case.u) != 0)[:6]:  # of constant effort
        if t[stop - 1] - t[start] < 0.5 or not np.any(case.u[start:stop]):
            continue
        growth = [(c.name, *_growth(t[start:stop], case.record[c.name][start:stop])) for c in free]
        if growth and all(cycles >= 8 and rate > 1.15 for _, rate, cycles, *_ in growth):
            name, rate, cycles, at, size = max(growth, key=lambda g: g[1])
            unit = column_unit(case.inspection.column(name))
            envelope = Curve(name="amplitude", t=at, y=size, style="points")
            yield Finding(
                kind="self-excited",
                columns=(name,),
                severity="fault",
                sentence=f"'{name}' oscillates more and more from {t[start]:.4g} to {t[stop - 1]:.4g} s while the"
                f" effort stays at {case.u[start]:.6g}: the amplitude grows {rate:.3g} times over {cycles} half"
                " swings. A constant force cannot do that; the drive, or what holds the rig, feeds the motion.",
                evidence={"growth [1]": rate, "half swings [1]": float(cycles)},
                advice="Leave this run out of a fit.",
                key='role = "predict"',
                panels=(*case.over_time(name), Panel(label=f"amplitude [{unit}]", curves=(envelope,))),
                spans=((float(t[start]), float(t[stop - 1])),),
            )
            return


def _growth(t: Array, x: Array) -> tuple[float, int, Array, Array]:
    """How many times the half swings of the second half of a stretch exceed those before, and their number.

    Then the middle instants of the half swings and their sizes.
    """
    nothing = 1.0, 0, t[:0], t[:0]
    if t.size < 30:
        return nothing
    at = turning_points(x, 0.05 * float(np.ptp(x)))
    if at.size < 7:
        return nothing
    size = np.abs(np.diff(x[at])) / 2
    middle = (t[at][1:] + t[at][:-1]) / 2
    half = size.size // 2
    slope = float(np.polyfit(np.arange(size.size), np.log(size + 1e-300), 1)[0])
    ratio = float(np.median(size[-max(half // 2, 2) :])) / float(np.median(size[: max(half // 2, 2)]) + 1e-300)
    rising = float(np.mean(np.diff(size) > 0))
    return (ratio, size.size, middle, size) if slope > 0 and rising > 0.75 else nothing
