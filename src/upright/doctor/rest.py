"""What does the rig do when nothing is asked of it? Creeping held bodies, drifting rest, oscillation that grows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from upright.doctor.case import Case
from upright.doctor.effort import HELD
from upright.doctor.findings import Curve, Finding, Panel
from upright.doctor.sensors import whole
from upright.records import Array
from upright.signals.smoothing import dominant_period


def examine_rest(case: Case) -> list[Finding]:
    """Findings about bodies at rest or left alone."""
    return [*_creep(case), *_drift(case), *_grows(case)]


def _creep(case: Case) -> list[Finding]:
    """Bodies that hardly move beside the others, yet do not stay where they are."""
    alike: dict[str, list[str]] = {}
    if not case.chained:
        return []
    for c in case.measured:
        alike.setdefault(c.unit or c.guess, []).append(c.name)
    found: list[Finding] = []
    coordinates = {p.column: n for n, p in case.places.items()}
    for unit, names in alike.items():
        spans = {n: float(np.ptp(case.record[n])) for n in names}
        largest = max(names, key=lambda n: spans[n])
        for n in names:
            step = case.seen.column(n).quantum.step
            if n == largest or not 5 * step < spans[n] < HELD * spans[largest] or spans[n] == 0:
                continue
            who = coordinates.get(n, "COORDINATE")
            found.append(
                Finding(
                    kind="creep",
                    columns=(n,),
                    severity="warning",
                    sentence=f"'{n}' moves {spans[n]:.4g} {unit}, {100 * spans[n] / spans[largest]:.2g} % of the motion"
                    f" of '{largest}': a body that was held, but creeps.".replace("  ", " "),
                    evidence={f"range [{unit or 1}]": spans[n], f"beside [{unit or 1}]": spans[largest]},
                    advice="Feed its measured motion in instead of locking it.",
                    key=f'held = ["{who}"]',
                    panels=whole(case, n, largest),
                )
            )
    return found


def _drift(case: Case) -> list[Finding]:
    """Rest positions that differ from one rest to the next, on a rig that a spring or gravity centres."""
    rests = [span for span in case.seen.rests if span[1] - span[0] > 0.2]
    centred = case.plant is None or not case.plant.__name__.startswith("Torsional")
    if len(rests) < 2 or not centred:
        return []
    t = case.record.t
    found: list[Finding] = []
    for c in case.measured:
        x = case.record[c.name]
        quiet = [s for s in rests if not case.driven or not np.any(case.u[(t >= s[0]) & (t <= s[1])])]
        levels = [float(np.median(x[(t >= a) & (t <= b)])) for a, b in quiet]
        if not case.driven:
            levels = levels[1:]  # before a release it is a hand that holds
        if len(levels) < 2 or any("reference" in lie for c in case.seen.columns for lie in c.lies):
            continue
        off, span = max(levels) - min(levels), float(np.ptp(x))
        if off > max(0.03 * span, 5 * c.quantum.step):
            unit = c.unit or c.guess
            found.append(
                Finding(
                    kind="drift",
                    columns=(c.name,),
                    severity="note",
                    sentence=f"'{c.name}' comes to rest {off:.4g} {unit} apart from where it lay before"
                    f" ({100 * off / span:.2g} % of its range): dry friction holds it off centre, or the zero drifts.",
                    evidence={f"apart [{unit or 1}]": off, "of the range [%]": 100 * off / span},
                    advice="Ask for Coulomb friction, or an offset per run.",
                    key=f'unknown = ["initial", "offset.{_coordinate(case, c.name)}"]',
                    panels=whole(case, c.name),
                    spans=tuple(quiet),
                )
            )
    return found


def _coordinate(case: Case, column: str) -> str:
    return next((n for n, p in case.places.items() if p.column == column), "COORDINATE")


def _grows(case: Case) -> list[Finding]:
    """Oscillation whose amplitude grows although the effort stays as it is."""
    t = case.record.t
    columns = [c for c in case.measured if not c.constant]
    if not columns:
        return []
    spans = {c.name: float(np.ptp(case.record[c.name])) for c in columns}
    top = {
        u: max(spans[c.name] for c in columns if (c.unit or c.guess) == u) for u in {c.unit or c.guess for c in columns}
    }
    free = [c for c in columns if spans[c.name] > HELD * top[c.unit or c.guess]]
    for start, stop in constant_spans(case.u if case.drive else np.zeros(t.size)):
        if t[stop - 1] - t[start] < 0.5 or not np.any(case.u[start:stop]):
            continue
        growth = [(c.name, *grown(t[start:stop], case.record[c.name][start:stop])) for c in free]
        if growth and all(cycles >= 8 and rate > 1.15 for _, rate, cycles, *_ in growth):
            name, rate, cycles, at, size = max(growth, key=lambda g: g[1])
            unit = case.seen.column(name).unit or case.seen.column(name).guess
            envelope = Curve(name="amplitude", t=at, y=size, style="points")
            return [
                Finding(
                    kind="self-excited",
                    columns=(name,),
                    severity="fault",
                    sentence=f"'{name}' oscillates more and more from {t[start]:.4g} to {t[stop - 1]:.4g} s while the"
                    f" effort stays at {case.u[start]:.6g}: the amplitude grows {rate:.3g} times over {cycles} half"
                    " swings. A constant force cannot do that; the drive, or what holds the rig, feeds the motion.",
                    evidence={"growth [1]": rate, "half swings [1]": float(cycles)},
                    advice="Leave this run out of a fit.",
                    key='role = "predict"',
                    panels=(*whole(case, name), Panel(label=f"amplitude [{unit}]", curves=(envelope,))),
                    spans=((float(t[start]), float(t[stop - 1])),),
                )
            ]
    return []


def constant_spans(u: Array) -> list[tuple[int, int]]:
    """First sample of each stretch of constant effort, and the one after its last, longest first."""
    cuts = np.flatnonzero(np.diff(u)) + 1
    edges = np.concatenate(([0], cuts, [u.size]))
    spans = sorted(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True), key=lambda s: s[0] - s[1])
    return spans[:6]


def grown(t: Array, x: Array) -> tuple[float, int, Array, Array]:
    """How many times the half swings of the second half of a stretch exceed those before, and their number.

    Then the middle instants of the half swings and their sizes.
    """
    from scipy.signal import find_peaks

    nothing = 1.0, 0, t[:0], t[:0]
    if t.size < 30:
        return nothing
    dt = float(t[-1] - t[0]) / (t.size - 1)
    period = dominant_period(x, dt)
    prominence = 0.05 * float(np.ptp(x))
    tops: NDArray[np.int64] = find_peaks(x, prominence=prominence, distance=max(1, int(0.2 * period / dt)))[0]
    dips: NDArray[np.int64] = find_peaks(-x, prominence=prominence, distance=max(1, int(0.2 * period / dt)))[0]
    at = np.sort(np.concatenate([tops, dips]))
    if at.size < 7:
        return nothing
    size = np.abs(np.diff(x[at])) / 2
    middle = (t[at][1:] + t[at][:-1]) / 2
    half = size.size // 2
    slope = float(np.polyfit(np.arange(size.size), np.log(size + 1e-300), 1)[0])
    ratio = float(np.median(size[-max(half // 2, 2) :])) / float(np.median(size[: max(half // 2, 2)]) + 1e-300)
    rising = float(np.mean(np.diff(size) > 0))
    return (ratio, size.size, middle, size) if slope > 0 and rising > 0.75 else nothing
