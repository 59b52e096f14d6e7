"""Sines that a log holds one after the other: where each stands in the command, and what the outputs answer to it.

Nothing but the command says where a sine begins. Its upward crossings of zero lie evenly as long as the frequency
stays; where two of them in a row leave that line, another sine has begun. Of each sine the periods of full amplitude
whose transient has decayed are measured. What may be left of it then is a part of the error that is stated. Sines of
two periods between rests (`rested`) settle in their rests instead.
"""

from __future__ import annotations

import heapq
import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upright.errors import NotIdentifiable
from upright.identification.frequency.detection import PER_PERIOD, Tone, detect, overtones, settled
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.frequency.rested import RestedLog, rested_answer, rested_sines
from upright.records import Record
from upright.signals.steps import smallest_step

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SAME = 0.05
"""Relative difference of successive periods of one sine, noise on the command included."""
EVEN = 5.0
"""Standard errors by which a crossing of one sine may lie off the line of those before it."""
RIPPLE = 0.3
"""Share of its neighbour's height and duration below which a half-wave is noise about zero."""
FULL = 0.03
"""Relative difference of a command's amplitude within which a sine neither grows nor dies away."""
DRIFTS = 0.5
"""Share of the step to the next frequency by which a period changes within a stretch of a sweep; 0 in a sine."""
UNSETTLED = 0.02
"""Share of a line that its transient may still be before the response says so."""
FEW, SURELY = 30, 0.95
"""Samples of which noise looks like a sine now and then, and the share that one has to explain of so few."""
LEAST = 12
"""Samples in the least part of a sine that is looked at by itself: one period, or several of a fast one."""
ALIKE = 0.6
"""Share of a command's power that a sine of its frequency explains at least; 0.81 of a square wave."""
LINGERS = 0.98
"""Largest share of a transient that is taken to remain after a period."""


@dataclass(frozen=True, kw_only=True)
class HeldSine:
    """Whole periods of one sine: crossings [s] from `first` to `last` sample, the frequency [rad/s] by the command."""

    first: int
    last: int
    omega: float
    crossings: Array

    @property
    def period(self) -> float:
        """Mean [s]."""
        return float(self.crossings[-1] - self.crossings[0]) / (self.crossings.size - 1)

    @property
    def samples(self) -> float:
        """Of a period, in the mean."""
        return (self.last - self.first) / (self.crossings.size - 1)


def sines_in(t: Array, u: Array) -> list[HeldSine]:
    """Sines of a command, three periods or more of each, from its first upward crossing to its last.

    By its crossings without those that are noise, or by all if they explain clearly more of it: a small and fast sine
    that follows a large and slow one passes for noise. A sine that follows a pause loses its first period.
    """
    merged, every = (_between(t, u, *_crossings(t, u, merged)) for merged in (True, False))
    return every if _lasts(every) > 1.1 * _lasts(merged) else merged


def covered(t: Array, u: Array) -> float:
    """Share of the time in which the command moves that sines hold; a pause counts as one period at most.

    0 for a sweep whose frequency grows within each stretch as much as from one to the next.
    """
    short = rested_sines(t, u)
    held = [s for s in sines_in(t, u) if not any(s.first < r.last and r.first < s.last for r in short)]
    if _swept(held):
        held = []
    stretches = sorted([*held, *short], key=lambda s: s.first)
    if not stretches:
        return 0.0
    ends = np.array([0, *(k for s in stretches for k in (s.first, s.last)), t.size])
    gaps = (ends[1::2] - ends[0::2]).astype(np.float64)
    inside = float(t.size - gaps.sum())
    periods = np.array([s.samples for s in stretches])
    near = np.maximum([periods[0], *periods], [*periods, periods[-1]])
    moves = np.array([_moves(u[a:b], float(np.ptp(u))) for a, b in zip(ends[0::2], ends[1::2], strict=True)])
    return inside / (inside + float(np.where(moves, gaps, np.minimum(gaps, near)).sum()))


def _moves(u: Array, whole: float) -> bool:
    """Whether a command does something for much of a time: it is no pause with the first period of what follows."""
    return u.size > 8 and float(np.mean(np.abs(u - np.median(u)) > 0.02 * whole)) > 0.4


def stepped_response(
    records: Sequence[Record], command: str, outputs: Sequence[str], quanta: Array, hold: float
) -> FrequencyResponse:
    """Response at the frequency of every sine of the logs.

    Raises
    ------
    NotIdentifiable
        When no log holds three periods of a sine or two between rests, or all are logged too slowly.
    """
    points: list[_Measured] = []
    fast: list[float] = []
    for r in records:
        y, u = np.column_stack([r[n] for n in outputs]), r[command]
        step = smallest_step(u)
        if short_ones := rested_sines(r.t, u):
            log = RestedLog.of(r.t, y, u, quanta)
            for answer, drive, late in (rested_answer(log, short) for short in short_ones):
                points.append(_Measured(y=answer, u=drive, late=late, lasting=math.inf, rested=True))
        for stretch in sines_in(r.t, u):
            if any(x.first < stretch.last and stretch.first < x.last and x.periods < 2.6 for x in short_ones):
                continue  # noise about zero makes a third crossing of two periods
            if stretch.samples < PER_PERIOD + 0.5:
                fast.append(stretch.omega)
            else:
                points.append(_point(r.t, y, u, stretch, quanta, step))
    if not points:
        raise NotIdentifiable(_nothing(fast, command))
    points.sort(key=lambda p: p.y.omega)
    distinct = points[:1]
    for p in points[1:]:
        if p.y.omega > distinct[-1].y.omega * (1 + 1e-4):
            distinct.append(p)
        elif float(p.y.variance.sum()) < float(distinct[-1].y.variance.sum()):
            distinct[-1] = p
    return from_tones(
        [p.y for p in distinct], [p.u for p in distinct], outputs=outputs,
        units=units_of(records[0], outputs, command), command=command, hold=hold,
        notes=_notes(distinct, fast),
    )  # fmt: skip


def units_of(record: Record, outputs: Sequence[str], command: str) -> tuple[str, ...]:
    """Units of the outputs, then of the command; empty where the log has none."""
    return tuple(record.units.get(n, "") for n in (*outputs, command))


def from_tones(
    tones: Sequence[Tone], commands: Sequence[Tone], *, outputs: Sequence[str], units: Sequence[str],
    command: str = "u", hold: float, notes: Sequence[str] = (),
) -> FrequencyResponse:  # fmt: skip
    """Response of sines measured one after the other, each detected in the outputs and in the command."""
    drive = np.array([c.lines[0, 0] for c in commands])
    return FrequencyResponse(
        omega=np.array([x.omega for x in tones]),
        response=np.asarray([x.lines[0] for x in tones], dtype=np.complex128) / drive[:, None],
        outputs=tuple(outputs), units=tuple(units), input=command,
        variance=np.array([x.variance for x in tones]) / np.abs(drive[:, None]) ** 2,
        coherence=np.array([x.coherence for x in tones]),
        distortion=np.array([x.distortion for x in tones]), drive=drive,
        dry=np.array([x.dry for x in tones]), still=np.array([x.still for x in tones]),
        overtones=overtones(tones), hold=hold, notes=tuple(notes),
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _Measured:
    """One frequency; `late` says that its transient had not decayed, `lasting` in which time [s] it falls to 1/e.

    Where it is `rested`, the transient decays in the rest after it.
    """

    y: Tone
    u: Tone
    late: bool
    lasting: float
    rested: bool = False


def _point(t: Array, y: Array, u: Array, stretch: HeldSine, quanta: Array, step: float) -> _Measured:
    """What one sine shows once its amplitude is full and its transient has decayed."""
    omega, count = stretch.omega, stretch.crossings.size - 1
    several = math.ceil(LEAST * count / (stretch.last - stretch.first))
    count, period = max(1, count // several), several * 2 * math.pi / omega
    edges = np.searchsorted(t, stretch.crossings[0] + period * np.arange(count + 1) - 1e-9 * period)
    edges[-1] = min(int(edges[-1]), stretch.last)
    each = [_line(t[a:b], np.column_stack([y[a:b], u[a:b]]), omega) for a, b in pairwise(edges.tolist())]
    lines, errors = (np.array(part) for part in zip(*each, strict=True))
    a, b = _steady(np.abs(lines[:, -1]))
    lines, edges = lines[a:b, :-1], edges[a : b + 1]
    noise = np.sqrt(np.median(errors[a:b, :-1], axis=0) + 4 * quanta**2 / 12 * len(lines) / (edges[-1] - edges[0]))
    begin = settled(lines, noise=noise, window=4) if len(lines) > 4 else 0
    late = begin is None
    begin = len(lines) // 2 if begin is None else begin
    begin = min(begin, max(0, len(lines) - 2))
    part = slice(int(edges[begin]), int(edges[-1]))
    remains, factor = _remainder(lines[begin:], noise)
    late |= bool(np.any(remains > np.maximum(UNSETTLED * np.abs(lines[-1]), 3 * noise)))
    answer = detect(t[part], y[part], omega, resolution=quanta)
    drive = detect(t[part], u[part], omega)
    # the command's own rounding drives the rig too; what else differs from a sine was measured with an error
    unsure = max(0.0, float(drive.variance[0]) - 4 * step**2 / 12 / t[part].size)
    gain = np.abs(answer.lines[0]) ** 2 / max(float(np.abs(drive.lines[0, 0]) ** 2), 1e-300)
    tone = Tone(
        omega=omega, lines=answer.lines, variance=answer.variance + remains**2 + gain * unsure, noise=answer.noise,
        t=answer.t, y=answer.y,
    )  # fmt: skip
    return _Measured(y=tone, u=drive, late=late, lasting=period / -math.log(factor) if factor < 1 else math.inf)


def _line(t: Array, y: Array, omega: float) -> tuple[Complex, Array]:
    """First line of one period, a drift aside, and the mean square of its error by what no harmonic explains."""
    x = t - t.mean()
    columns = np.column_stack([np.cos(omega * t), np.sin(omega * t), np.ones_like(x), x])
    solve = np.linalg.pinv(columns)[:2]
    a, b = solve @ y
    return a - 1j * b, detect(t, y, omega, blocks=1).noise * float(np.sum(solve**2))


def _steady(amplitude: Array) -> tuple[int, int]:
    """The longest run of periods whose command has full amplitude: all but those in which it grows or dies away."""
    full = float(np.median(np.sort(amplitude)[amplitude.size // 2 :]))
    # noise on the command makes periods differ as well
    near = max(FULL * full, 3 * float(np.median(np.abs(amplitude - np.median(amplitude)))))
    runs, begin = [(0, 0)], 0
    for k, good in enumerate([*(np.abs(amplitude - full) <= near).tolist(), False]):
        if not good:
            runs.append((begin, k))
            begin = k + 1
    a, b = max(runs, key=lambda run: run[1] - run[0])
    return (a, b) if b - a > 1 else (0, amplitude.size)


def _remainder(lines: Complex, noise: Array) -> tuple[Array, float]:
    """What is left of the transient in the mean of these periods' lines, and what share of it one period leaves.

    A free swing falls by a common factor rho from one period to the next, so that ``z_k = z + c rho^k``. Noise of each
    line alone moves the last from the first by ``sqrt(6)`` of it in one of twenty cases.
    """
    steps = np.diff(lines, axis=0)
    moved = np.sqrt(np.maximum(0.0, np.abs(lines[-1] - lines[0]) ** 2 - 6 * noise**2))
    if len(steps) < 2:
        return moved, 1.0
    power = np.maximum(np.sum(np.abs(steps[:-1]) ** 2, axis=0), 1e-300)
    rho = np.sum(steps[1:] * np.conj(steps[:-1]), axis=0) / power
    rho *= np.minimum(1.0, LINGERS / np.maximum(np.abs(rho), 1e-300))
    return moved / len(steps) / np.abs(1 - rho), float(np.clip(np.abs(rho).max(), 1e-3, LINGERS))


def _notes(points: Sequence[_Measured], fast: Sequence[float]) -> list[str]:
    notes: list[str] = []
    if late := [p for p in points if p.late and not p.rested]:
        names = _listed([p.y.omega for p in late])
        lasting = [p.lasting for p in late if math.isfinite(p.lasting)]
        longer = f"some {float(f'{4 * statistics.median(lasting):.1g}'):g} s longer" if lasting else "longer"
        notes.append(
            f"Not settled at {names} rad/s: what is left of the transient counts as error there. Hold each sine "
            f"{longer}, or let it grow slowly."
        )
    if rested := [p.y.omega for p in points if p.late and p.rested]:
        notes.append(
            f"Not settled at {_listed(rested)} rad/s: what still swings at the end of a rest is continued "
            "there as it decayed before. Rest longer between the sines, or hold each for more periods."
        )
    if fast:
        notes.append(f"Left out {_listed(sorted(fast))} rad/s: fewer than {PER_PERIOD} samples per period.")
    return notes


def _listed(omega: Sequence[float]) -> str:
    names = list(dict.fromkeys(f"{w:.3g}" for w in omega))
    return ", ".join(names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _nothing(fast: Sequence[float], command: str) -> str:
    if fast:
        return (
            f"The sines of '{command}' ({min(fast):.3g} rad/s and faster) have fewer than {PER_PERIOD} samples per "
            "period; log faster."
        )
    return (
        f"A response from sines needs three periods of each in the command, or two between rests, and '{command}' "
        "holds no such sine; name the column that drives with --command, hold each sine longer, or try --kind sweep."
    )


def _crossings(t: Array, u: Array, merged: bool) -> tuple[NDArray[np.int64], Array]:
    """Samples after which a command crosses its middle upwards, and when [s]; noise about it aside if `merged`."""
    v = u - (u.max() + u.min()) / 2
    above = v >= 0
    edges = np.concatenate([[0], np.flatnonzero(above[1:] != above[:-1]) + 1, [v.size]])
    at = (_merged(edges, np.abs(v)) if merged else edges)[1:-1]
    at = at[(v[at] >= 0) & (v[at - 1] < 0)]
    return at, t[at - 1] + v[at - 1] / (v[at - 1] - v[at]) * (t[at] - t[at - 1])


def _merged(edges: NDArray[np.int64], size: Array) -> NDArray[np.int64]:
    """Edges of half-waves without those that are noise: low and short beside a neighbour, the lowest first.

    A half-wave that took in others keeps the height and the duration of its largest part, so that it takes in no
    smaller sine that follows.
    """
    n = edges.size - 1
    if n < 3:
        return edges
    height, long = np.maximum.reduceat(size, edges[:-1]).tolist(), np.diff(edges).tolist()
    before, after = list(range(-1, n - 1)), [*range(1, n), -1]
    kept, queue = [True] * n, [(h, k) for k, h in enumerate(height)]
    heapq.heapify(queue)

    def beside(k: int) -> list[int]:
        return [j for j in (before[k], after[k]) if j >= 0]

    while queue:
        h, k = heapq.heappop(queue)
        near = beside(k)
        if not kept[k] or h != height[k] or not near:
            continue
        if not any(h < RIPPLE * height[j] and long[k] < RIPPLE * long[j] for j in near):
            continue
        # with both neighbours it becomes one half-wave, which the first of the three stands for
        whole = [before[k]] * (before[k] >= 0) + [k] + [after[k]] * (after[k] >= 0)
        first, top = whole[0], max(whole, key=lambda j: height[j])
        height[first], long[first] = height[top], long[top]
        for j in whole[1:]:
            kept[j] = False
        after[first] = after[whole[-1]]
        if after[first] >= 0:
            before[after[first]] = first
        for j in (first, *beside(first)):
            heapq.heappush(queue, (height[j], j))
    return np.concatenate([edges[:-1][np.array(kept)], edges[-1:]])


def _lasts(stretches: Sequence[HeldSine]) -> float:
    return sum(float(s.crossings[-1] - s.crossings[0]) for s in stretches)


def _between(t: Array, u: Array, at: NDArray[np.int64], times: Array) -> list[HeldSine]:
    out: list[HeldSine] = []
    tick, step = float(t[1] - t[0]), smallest_step(u)
    i = 0
    while i < times.size - 2:
        j = i + 1
        first = times[j] - times[i]
        while j + 1 < times.size and abs(times[j + 1] - times[j] - first) < SAME * first + 0.5 * tick:
            j += 1
        rounds = step * first / math.pi / max(float(np.ptp(u[at[i] : at[j]])), 1e-300)
        for a, b in _even(times[i : j + 1], tick, rounds):
            a, b = i + a, i + b
            part = slice(int(at[a]), int(at[b]))
            omega, explained = _sine(t[part], u[part], 2 * math.pi * (b - a) / (times[b] - times[a]))
            count = part.stop - part.start
            if count >= LEAST and explained > (ALIKE if count > FEW else SURELY):
                out.append(HeldSine(first=part.start, last=part.stop, omega=omega, crossings=times[a : b + 1]))
        i = j
    return out


def _even(times: Array, tick: float, rounds: float) -> list[tuple[int, int]]:
    """Parts (first, last) of crossings [s] that lie evenly, three or more in each; a rounded command `rounds` them."""
    if times.size < 3:
        return []
    # of a straight line's second differences the variance is six times that of a crossing
    scatter = float(np.median(np.abs(np.diff(times, 2)))) / (0.6745 * math.sqrt(6))
    out: list[tuple[int, int]] = []
    i = 0
    while i < times.size - 2:
        j = i + 1
        while j + 1 < times.size:
            most = min(EVEN * scatter + 0.02 * tick + rounds, 0.02 * float(times[j] - times[i]) / (j - i) + 0.5 * tick)
            off = [_beyond(times[i : j + 1], times[k], k - j) for k in (j + 1, j + 2) if k < times.size]
            if all(abs(x) > most for x in off):
                break
            j += 1
        if j - i >= 2:
            out.append((i, j))
        i = j if j - i >= 2 else i + 1
    return out


def _beyond(times: Array, then: float, ahead: int) -> float:
    """How far a crossing that comes `ahead` of the last lies off the line of these, in standard errors of one."""
    n = times.size
    k = np.arange(n) - (n - 1) / 2
    square = float(k @ k)
    rate = float(k @ times) / square
    reach = (n - 1) / 2 + ahead
    return (then - float(times.mean()) - rate * reach) / math.sqrt(1 + 1 / n + reach**2 / square)


def _sine(t: Array, u: Array, omega: float) -> tuple[float, float]:
    """Frequency [rad/s] of a sine of unknown amplitude, phase and mean, from a guess, and the share it explains."""
    x = t - t.mean()

    def waves(w: float) -> Array:
        return np.column_stack([np.cos(w * x), np.sin(w * x), np.ones_like(x)])

    at = omega
    for _ in range(4):
        columns = waves(at)
        a, b, _ = np.linalg.lstsq(columns, u, rcond=None)[0]
        slope = x * (b * columns[:, 0] - a * columns[:, 1])
        change = float(np.linalg.lstsq(np.column_stack([columns, slope]), u, rcond=None)[0][3])
        if not abs(change) < 0.01 * omega:  # no sine: its crossings are all that is known
            at = omega
            break
        at += change
        if abs(change) < 1e-10 * omega:
            break
    columns = waves(at)
    rest = u - columns @ np.linalg.lstsq(columns, u, rcond=None)[0]
    return at, 1 - float(rest @ rest) / max(float(np.sum((u - u.mean()) ** 2)), 1e-300)


def _swept(stretches: Sequence[HeldSine]) -> bool:
    """Whether the period changes within most stretches as much as from each to the next."""
    shares: list[float] = []
    for a, b in pairwise(stretches):
        count = a.crossings.size
        own = 2 * (count - 1) * float(np.polyfit(np.arange(count), a.crossings, 2)[0])
        if (step := b.period - a.period) and b.crossings[0] - a.crossings[-1] < 1.5 * max(a.period, b.period):
            shares.append(own / step)
    return len(shares) > 1 and len(shares) > len(stretches) / 3 and float(np.median(shares)) > DRIFTS
