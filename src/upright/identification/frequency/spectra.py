"""The frequency response that a log holds: sines one after the other, a periodic multisine, or a sweep.

Sines are detected synchronously; of a periodic command whole periods are averaged, and what differs between them is
noise; anything else is cut into overlapping windows whose cross spectra are averaged (Welch), repeats together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, NotIdentifiable
from upright.identification.frequency.detection import Tone, detect, overtones, settled
from upright.identification.frequency.periodic import multisine_response, repetition
from upright.identification.frequency.response import FrequencyResponse, describing
from upright.records import Record

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SAME = 0.02
"""Relative difference of successive periods of one sine."""
WEAK = 0.03
"""Share of the command's largest amplitude spectrum below which a frequency was not asked."""
MOST = 80
"""Frequencies told at most from a sweep."""


def response_of(
    records: Sequence[Record], *, command: str, outputs: Sequence[str], kind: str = "", hold: float | None = None,
    quantum: Sequence[float] = (), band: tuple[float, float] | None = None,
) -> FrequencyResponse:  # fmt: skip
    """Response that one log, or several repeats, hold.

    Parameters
    ----------
    records : sequence of Record
        Evenly sampled, but for gaps between sines.
    command, outputs : str and sequence of str
        Columns, in the units in which the response is told.
    kind : {"", "sines", "multisine", "sweep"}
        How the rig was asked; told from the command when empty.
    hold : float, optional
        Time for which the converter holds a command [s]; one sample when omitted.
    quantum : sequence of float
        Resolution of each output.
    band : (float, float), optional
        Frequencies to keep [rad/s].

    Raises
    ------
    NotIdentifiable
        When the command asks nothing, or holds too little of it.
    """
    if kind not in ("", "sines", "multisine", "sweep"):
        raise BadInput(f"a log holds sines, a multisine or a sweep, not '{kind}'.")
    quanta = np.array(quantum if len(quantum) else [0.0] * len(outputs))
    hold = records[0].period if hold is None else hold
    u = records[0][command]
    if not np.ptp(u) > 0:
        raise NotIdentifiable(f"The command '{command}' never changes, so nothing was asked; name its column.")
    pieces = [piece for r in records for piece in sines_in(r.t, r[command])] if kind in ("", "sines") else []
    covered = sum(b - a for a, b, _ in pieces) / sum(len(r) for r in records)
    if kind == "sines" or (not kind and covered > 0.5):
        found = _sines(records, command, outputs, quanta, hold)
    elif kind == "multisine" or (not kind and len(records) == 1 and repetition(u) is not None):
        found = multisine_response(records[0], command, outputs, quanta, hold)
    else:
        found = _sweep(records, command, outputs, quanta, hold)
    if band is not None:
        kept = (found.omega >= band[0]) & (found.omega <= band[1])
        if not kept.any():
            raise NotIdentifiable(
                f"The log asks {found.omega[0]:.3g} to {found.omega[-1]:.3g} rad/s, nothing between {band[0]:g} and "
                f"{band[1]:g}."
            )
        found = found.only(kept)
    return found


def sines_in(t: Array, u: Array) -> list[tuple[int, int, float]]:
    """Stretches (first, last, omega) of a command that are one sine each, three periods or more."""
    v = u - (u.max() + u.min()) / 2
    at = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0)) + 1
    if at.size < 3:
        return []
    lows, highs = np.minimum.reduceat(v, at), np.maximum.reduceat(v, at)
    whole = np.concatenate([[True], -lows[:-1] > 0.3 * highs[:-1]])  # a ripple about zero is no period
    share = v[at - 1] / (v[at - 1] - v[at])
    up = list(zip(at[whole].tolist(), (t[at - 1] + share * (t[at] - t[at - 1]))[whole].tolist(), strict=True))
    out: list[tuple[int, int, float]] = []
    i = 0
    while i < len(up) - 1:
        j = i + 1
        first = up[j][1] - up[i][1]
        while j + 1 < len(up) and abs(up[j + 1][1] - up[j][1] - first) < SAME * first + 0.5 * (t[1] - t[0]):
            j += 1
        if j - i >= 2:
            omega = 2 * math.pi * (j - i) / (up[j][1] - up[i][1])
            out.append((up[i][0], up[j][0], omega))
        i = j
    return out


def _sines(
    records: Sequence[Record], command: str, outputs: Sequence[str], quanta: Array, hold: float
) -> FrequencyResponse:
    found: list[tuple[float, Tone, Tone]] = []
    notes: list[str] = []
    for r in records:
        y = np.column_stack([r[n] for n in outputs])
        for a, b, omega in sines_in(r.t, r[command]):
            period = 2 * math.pi / omega
            lines = []
            edges = np.searchsorted(r.t, r.t[a] + period * np.arange(math.floor((r.t[b - 1] - r.t[a]) / period) + 1.01))
            for lo, hi in pairwise(edges.tolist()):
                lines.append(detect(r.t[lo:hi], y[lo:hi], omega, blocks=1).lines[0])
            begin = settled(np.array(lines), window=4) if len(lines) > 4 else 0
            if begin is None:
                notes.append(f"Not settled at {omega:.3g} rad/s.")
                begin = len(lines) // 2
            first = edges[min(begin, max(0, len(edges) - 3))]
            part = slice(int(first), int(edges[-1]))
            found.append((
                omega, detect(r.t[part], y[part], omega, quantum=quanta), detect(r.t[part], r[command][part], omega),
            ))  # fmt: skip
    if not found:
        raise NotIdentifiable("The command holds no sine of three periods; try --kind sweep.")
    found.sort(key=lambda f: f[0])
    kept = [found[0]]
    for f in found[1:]:
        if f[0] > kept[-1][0] * (1 + 1e-4):
            kept.append(f)
        elif float(f[1].variance.sum()) < float(kept[-1][1].variance.sum()):
            kept[-1] = f
    return from_tones(
        [x for _, x, _ in kept], [c for _, _, c in kept], outputs=outputs, units=_units(records[0], outputs, command),
        command=command, hold=hold, notes=notes,
    )  # fmt: skip


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


def _units(record: Record, outputs: Sequence[str], command: str) -> tuple[str, ...]:
    return tuple(record.units.get(n, "") for n in (*outputs, command))


def _sweep(
    records: Sequence[Record], command: str, outputs: Sequence[str], quanta: Array, hold: float
) -> FrequencyResponse:
    """H1: cross spectrum over spectrum of the command, of whole repeats, or of Hann windows half overlapped.

    Repeats are tapered at their end alone, where the motion may not have died away: elsewhere a taper would weigh the
    answer, which lingers, less or more than the sweep it answers.
    """
    shortest = min(len(r) for r in records)
    whole = len(records) >= 4
    length = shortest if whole else max(64, 2 * (shortest // 9))
    k = (np.arange(length) + 0.5) / length
    taper = (
        np.where(k < 0.85, 1.0, 0.5 + 0.5 * np.cos(math.pi * (k - 0.85) / 0.15)) if whole else np.sin(math.pi * k) ** 2
    )
    inputs: list[Complex] = []
    answers: list[Complex] = []
    levels: list[float] = []
    for r in records:
        for a in range(0, len(r) - length + 1, max(1, length // 2)):
            part = slice(a, a + length)
            u = r[command][part] - (r[command][0] if whole else np.mean(r[command][part]))
            y = np.column_stack(
                [r[n][part] - r[n][part][0] if whole else _detrended(r.t[part], r[n][part]) for n in outputs]
            )
            inputs.append(np.fft.rfft(taper * u))
            answers.append(np.fft.rfft(taper[:, None] * y, axis=0))
            levels.append(float(np.sqrt(2 * np.mean(u**2))))
    U, Y = np.array(inputs), np.array(answers)
    omega = np.asarray(2 * math.pi * np.fft.rfftfreq(length, records[0].period), dtype=np.float64)
    power = np.sum(np.abs(U) ** 2, axis=0)
    asked = (np.sqrt(power) > WEAK * np.sqrt(power.max())) & (omega > 1.5 * omega[1])
    if U.shape[0] < 3 or asked.sum() < 3:
        raise NotIdentifiable(
            f"A sweep needs three windows or repeats and three frequencies, got {U.shape[0]} and {int(asked.sum())}; "
            "give the repeats together, or a longer log."
        )
    cross = np.sum(Y * np.conj(U)[:, :, None], axis=0)
    total = np.sum(np.abs(Y) ** 2, axis=0)
    coherence = np.abs(cross) ** 2 / np.maximum(power[:, None] * total, 1e-300)
    # windows that hardly hold a frequency do not count as averages of it; neighbours overlap by half
    count = power**2 / np.maximum(np.sum(np.abs(U) ** 4, axis=0), 1e-300)
    if not whole:
        count = np.maximum(count * 0.7, 1.0)
    G = cross / np.maximum(power[:, None], 1e-300)
    unexplained = np.clip(1 - coherence, 0, None) / np.maximum(coherence, 1e-12)
    variance = np.abs(G) ** 2 * unexplained / np.maximum(count - 1, 0.5)[:, None]
    at = _thinned(np.flatnonzero(asked), omega)
    drive = np.array([levels[int(np.argmax(np.abs(U[:, k])))] for k in at])
    variance = variance[at] + quanta**2 / 3 / length / drive[:, None] ** 2
    return FrequencyResponse(
        omega=omega[at], response=G[at], outputs=tuple(outputs), units=_units(records[0], outputs, command),
        input=command, variance=variance, coherence=coherence[at], drive=drive.astype(np.complex128),
        dry=describing(omega[at], np.abs(G[at]) * drive[:, None]), hold=hold,
        notes=(f"{U.shape[0]} windows of {length * records[0].period:.3g} s.",),
    )  # fmt: skip


def _detrended(t: Array, y: Array) -> Array:
    x = t - t.mean()
    return y - y.mean() - x * (x @ y) / (x @ x)


def _thinned(indices: NDArray[np.int64], omega: Array) -> NDArray[np.int64]:
    """Indices about evenly spaced in log frequency, `MOST` at most."""
    if indices.size <= MOST:
        return indices
    wanted = np.geomspace(omega[indices[0]], omega[indices[-1]], MOST)
    return np.unique(indices[np.abs(np.log(omega[indices])[None, :] - np.log(wanted)[:, None]).argmin(axis=1)])
