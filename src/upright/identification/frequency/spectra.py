"""The frequency response that a log holds, and commands that ask for it: sines, a periodic multisine, or a sweep.

Sines are detected synchronously; of a periodic command whole periods are averaged, and what differs between them is
noise; anything else is cut into overlapping windows whose cross spectra are averaged (Welch), repeats together.

Of a multisine phases are random, the best of many draws by crest factor. Only odd multiples of the base are excited, so
that what dry friction and geometry add falls on lines of its own as well as on those excited.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput, NotIdentifiable
from upright.identification.frequency.detection import settled
from upright.identification.frequency.response import FrequencyResponse, describing
from upright.identification.frequency.stepped import covered, stepped_response, units_of
from upright.records import Record

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

WEAK = 0.03
"""Share of the command's largest amplitude spectrum below which a frequency was not excited."""
DRAWS = 200
"""Sets of random phases from which a multisine is chosen."""
MOST = 80
"""Frequencies taken at most from a sweep."""


def response_of(
    records: Sequence[Record], *, command: str, outputs: Sequence[str], kind: str | None = None,
    hold: float | None = None, resolution: Sequence[float] = (), band: tuple[float, float] | None = None,
) -> FrequencyResponse:  # fmt: skip
    """Response that one log, or several repeats, hold.

    Parameters
    ----------
    records : sequence of Record
        Evenly sampled, but for gaps between sines.
    command, outputs : str and sequence of str
        Columns, in the units of the response.
    kind : {"sines", "multisine", "sweep"}, optional
        Excitation; recognised from the command when omitted.
    hold : float, optional
        Time for which the converter holds a command [s]; one sample when omitted.
    resolution : sequence of float
        Resolution of each output.
    band : (float, float), optional
        Frequencies to keep [rad/s].

    Raises
    ------
    NotIdentifiable
        When the command asks nothing, or holds too little of it.
    """
    if kind not in (None, "sines", "multisine", "sweep"):
        raise BadInput(f"a log holds sines, a multisine or a sweep, not '{kind}'.")
    quanta = np.array(resolution if len(resolution) else [0.0] * len(outputs))
    hold = records[0].period if hold is None else hold
    u = records[0][command]
    if not np.ptp(u) > 0:
        raise NotIdentifiable(f"The command '{command}' never changes, so nothing was excited; name its column.")
    if kind == "sines" or (not kind and np.mean([covered(r.t, r[command]) for r in records]) > 0.5):
        response = stepped_response(records, command, outputs, quanta, hold)
    elif kind == "multisine" or (not kind and all(repetition(r[command]) is not None for r in records)):
        response = multisine_response(records, command, outputs, quanta, hold)
    else:
        response = _sweep(records, command, outputs, quanta, hold)
    if band is not None:
        inside = (response.omega >= band[0]) & (response.omega <= band[1])
        if not inside.any():
            raise NotIdentifiable(
                f"The log asks {response.omega[0]:.3g} to {response.omega[-1]:.3g} rad/s, nothing between {band[0]:g} "
                f"and {band[1]:g}."
            )
        response = response.only(inside)
    return response


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
    excited = (np.sqrt(power) > WEAK * np.sqrt(power.max())) & (omega > 1.5 * omega[1])
    if U.shape[0] < 3 or excited.sum() < 3:
        raise NotIdentifiable(
            f"A sweep needs three windows or repeats and three frequencies, got {U.shape[0]} and {int(excited.sum())}; "
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
    at = _thinned(np.flatnonzero(excited), omega)
    drive = np.array([levels[int(np.argmax(np.abs(U[:, k])))] for k in at])
    variance = variance[at] + quanta**2 / 3 / length / drive[:, None] ** 2
    return FrequencyResponse(
        omega=omega[at], response=G[at], outputs=tuple(outputs), units=units_of(records[0], outputs, command),
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


def odd_lines(low: float, high: float, count: int, base: float) -> NDArray[np.int64]:
    """Odd multiples of `base` [rad/s], about evenly spaced on a log scale; every fourth is left silent, to be heard."""
    wanted = np.geomspace(low, high, count) / base
    lines = np.unique(2 * np.floor(wanted / 2).astype(np.int64) + 1)
    return lines[np.arange(lines.size) % 4 != 2]


def multisine(lines: NDArray[np.int64], amplitude: Array, length: int, *, seed: int = 0) -> Array:
    """One period (length,) of cosines at these lines, phases chosen for a low crest among random ones."""
    rng = np.random.default_rng([seed, 61])
    spectrum = np.zeros((DRAWS, length // 2 + 1), dtype=np.complex128)
    spectrum[:, lines] = amplitude * length / 2 * np.exp(2j * math.pi * rng.random((DRAWS, lines.size)))
    waves = np.fft.irfft(spectrum, length, axis=1)
    return waves[int(np.argmin(np.abs(waves).max(axis=1)))]


def chirp(low: float, high: float, seconds: float, period: float) -> Array:
    """Sine of unit amplitude whose frequency grows evenly on a log scale from `low` to `high` [rad/s]."""
    t = np.arange(round(seconds / period)) * period
    rate = math.log(high / low) / seconds
    return np.sin(low / rate * np.expm1(rate * t))


def repetition(u: Array) -> int | None:
    """Samples in one period of a command that repeats at least twice; None when it does not."""
    v = u - u.mean()
    size = float(v @ v)
    if size <= 0:
        return None
    n = v.size
    spectrum = np.fft.rfft(v, 2 * n)
    alike = np.fft.irfft(np.abs(spectrum) ** 2)[: n // 2 + 1]
    energy = np.cumsum(v**2)
    lags = np.arange(1, n // 2 + 1)
    both = np.sqrt((energy[-1] - energy[lags - 1]) * energy[n - lags - 1])
    share = alike[1:] / np.maximum(both, 1e-300)
    good = np.flatnonzero(share > 0.999)
    good = good[good > 8]
    if good.size == 0:
        return None
    first = int(good[0])
    while first + 1 < share.size and share[first + 1] > share[first]:
        first += 1
    return first + 1


def multisine_response(
    records: Sequence[Record], command: str, outputs: Sequence[str], quanta: Array, hold: float
) -> FrequencyResponse:
    """Response at the lines of a command that repeats, over the periods of all logs.

    Raises
    ------
    NotIdentifiable
        When it does not repeat often enough, or the logs hold different commands.
    """
    first, period = records[0], records[0].period
    each = [_periods(record, command, outputs) for record in records]
    u, length = each[0][1].mean(axis=0), each[0][1].shape[1]
    notes: list[str] = []
    heard: list[Complex] = []
    driven: list[Complex] = []
    for record, (y, v) in zip(records, each, strict=True):
        if v.shape[1] != length or abs(record.period / period - 1) > 1e-6:
            raise NotIdentifiable(
                f"The logs of a multisine need one period, and hold {length * period:.4g} and "
                f"{v.shape[1] * record.period:.4g} s; give those of another period by themselves."
            )
        # a log may begin anywhere in the period
        match = np.fft.irfft(np.fft.rfft(u) * np.conj(np.fft.rfft(v.mean(axis=0))), length)
        y, v = (np.roll(x, int(np.argmax(match)), axis=1) for x in (y, v))
        Y, U = (np.fft.rfft(x, axis=1) * 2 / length for x in (y, v))
        lines = _lines(U)
        begin = settled(Y[:, lines].reshape(len(Y), -1), tolerance=0.01, window=3)
        if begin is None:
            notes.append("The transient had not died away at the end.")
        begin = min(begin if begin is not None else len(Y) // 2, len(Y) - 2)
        heard.append(Y[begin:])
        driven.append(U[begin:])
    Y, U = np.concatenate(heard), np.concatenate(driven)
    lines = _lines(U)
    count = Y.shape[0]
    mean, drive = Y.mean(axis=0), U.mean(axis=0)[lines]
    scatter = np.sum(np.abs(Y[:, lines] - mean[lines]) ** 2, axis=0) / max(count - 1, 1)
    rounding = 4 * quanta**2 / 12 / length
    cross = np.abs(np.sum(Y[:, lines] * np.conj(U[:, lines, None]), axis=0)) ** 2
    both = np.sum(np.abs(Y[:, lines]) ** 2, axis=0) * np.sum(np.abs(U[:, lines]) ** 2, axis=0)[:, None]
    omega = np.asarray(2 * math.pi * lines / (length * period), dtype=np.float64)
    dry, still = _friction(mean, lines, length, period)
    return FrequencyResponse(
        omega=omega, response=mean[lines] / drive[:, None], outputs=tuple(outputs),
        units=units_of(first, outputs, command), input=command,
        variance=np.maximum(scatter / count, rounding) / np.abs(drive[:, None]) ** 2,
        coherence=cross / np.maximum(both, 1e-300), distortion=_between(mean, lines), drive=drive, dry=dry, still=still,
        together=True, hold=hold,
        notes=(*dict.fromkeys(notes), f"{count} periods of {length * period:.3g} s averaged."),
    )  # fmt: skip


def _lines(U: Complex) -> NDArray[np.int64]:
    """Those at which a command asks: of more than a hundredth of its largest one's size."""
    size = np.abs(U.mean(axis=0))
    size[0] = 0.0
    return np.flatnonzero(size > 1e-2 * size.max())


def _periods(record: Record, command: str, outputs: Sequence[str]) -> tuple[Array, Array]:
    """Whole periods of outputs, without their drift, and of the command: (periods, samples, n) and (periods, samples).

    The last samples of the log are the last of a period.
    """
    u = record[command]
    length = repetition(u)
    if length is None or u.size < 3 * length:
        raise NotIdentifiable("A multisine needs a command that repeats three times at least; try --kind sweep.")
    periods = u.size // length
    tail = slice(u.size - periods * length, None)
    y = np.column_stack([record[n] for n in outputs])[tail].reshape(periods, length, -1)
    return _level(y), u[tail].reshape(periods, length)


def _level(y: Array) -> Array:
    """Periods without their drift: the step from each period to the next is taken out as a straight line."""
    length = y.shape[1]
    drift = np.diff(y.mean(axis=1), axis=0)
    drift = np.vstack([drift, drift[-1:]])
    return y - drift[:, None, :] * ((np.arange(length) - length / 2) / length)[None, :, None]


def _between(mean: Complex, lines: NDArray[np.int64]) -> Array:
    """What stands on odd lines not excited, as root of its power near each line over the line's own size.

    Dry friction and geometry are odd: as much of them stands on the lines that were excited. Where every odd line was,
    none of it shows.
    """
    where = np.setdiff1d(np.arange(1, mean.shape[0], 2), lines)
    if not where.size:
        return np.zeros((lines.size, mean.shape[1]))
    power = np.abs(mean) ** 2
    near = np.array([power[where[np.argsort(np.abs(where - k))[:4]]].mean(axis=0) for k in lines])
    return np.sqrt(near) / np.maximum(np.abs(mean[lines]), 1e-300)


def _friction(mean: Complex, lines: NDArray[np.int64], length: int, period: float) -> tuple[Complex, Array]:
    """Viscous equivalent of unit Coulomb friction at each line, and shares of time nearly at rest."""
    k = np.arange(mean.shape[0])
    speed_lines = 2j * math.pi * k[:, None] / (length * period) * mean
    speed_lines[min(3 * int(lines[-1]), k.size) :] = 0.0  # beyond, rounding weighs more than motion
    fine = max(4 * length, 4096)
    padded = np.zeros((fine // 2 + 1, mean.shape[1]), dtype=np.complex128)
    top = min(k.size, padded.shape[0])
    padded[:top] = speed_lines[:top]
    speed = np.fft.irfft(padded * fine / 2, fine, axis=0)
    sign = np.fft.rfft(np.sign(speed), axis=0) * 2 / fine
    still = np.mean(np.abs(speed) <= 0.02 * np.abs(speed).max(axis=0), axis=0)
    return sign[lines] / speed_lines[lines], np.broadcast_to(still, (lines.size, still.size)).copy()
