"""Periodic multisines: their design, and the response at many frequencies at once, averaged over periods.

Phases are random, the best of many draws by crest factor. Only odd multiples of the base are asked, so that what dry
friction and geometry add falls on lines of its own as well as on those asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upright.errors import NotIdentifiable
from upright.identification.frequency.detection import settled
from upright.identification.frequency.response import FrequencyResponse
from upright.records import Record

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

DRAWS = 200


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
    record: Record, command: str, outputs: Sequence[str], quanta: Array, hold: float
) -> FrequencyResponse:
    """Response at the lines of a command that repeats.

    Raises
    ------
    NotIdentifiable
        When it does not repeat often enough.
    """
    u = record[command]
    length = repetition(u)
    if length is None or u.size < 3 * length:
        raise NotIdentifiable("A multisine needs a command that repeats three times at least; try --kind sweep.")
    periods = u.size // length
    y = np.column_stack([record[n] for n in outputs])
    tail = slice(u.size - periods * length, None)
    Y = np.fft.rfft(_level(y[tail].reshape(periods, length, -1)), axis=1) * 2 / length
    U = np.fft.rfft(u[tail].reshape(periods, length), axis=1) * 2 / length
    size = np.abs(U.mean(axis=0))
    lines = np.flatnonzero(size > 1e-2 * size[1:].max())
    lines = lines[lines > 0]
    begin = settled(Y[:, lines].reshape(periods, -1), tolerance=0.01, window=3)
    notes = () if begin is not None else ("The transient had not died away at the end.",)
    begin = min(begin if begin is not None else periods // 2, periods - 2)
    Y, U = Y[begin:], U[begin:]
    count = Y.shape[0]
    mean, drive = Y.mean(axis=0), U.mean(axis=0)[lines]
    scatter = np.sum(np.abs(Y[:, lines] - mean[lines]) ** 2, axis=0) / max(count - 1, 1)
    rounding = 4 * quanta**2 / 12 / length
    cross = np.abs(np.sum(Y[:, lines] * np.conj(U[:, lines, None]), axis=0)) ** 2
    both = np.sum(np.abs(Y[:, lines]) ** 2, axis=0) * np.sum(np.abs(U[:, lines]) ** 2, axis=0)[:, None]
    omega = np.asarray(2 * math.pi * lines / (length * record.period), dtype=np.float64)
    dry, still = _friction(mean, lines, length, record.period)
    return FrequencyResponse(
        omega=omega, response=mean[lines] / drive[:, None], outputs=tuple(outputs),
        units=tuple(record.units.get(n, "") for n in (*outputs, command)), input=command,
        variance=np.maximum(scatter / count, rounding) / np.abs(drive[:, None]) ** 2,
        coherence=cross / np.maximum(both, 1e-300), distortion=_between(mean, lines), drive=drive, dry=dry, still=still,
        together=True, hold=hold, notes=(*notes, f"{count} periods of {length * record.period:.3g} s averaged."),
    )  # fmt: skip


def _level(y: Array) -> Array:
    """Periods without their drift: the step from each period to the next is taken out as a straight line."""
    length = y.shape[1]
    drift = np.diff(y.mean(axis=1), axis=0)
    drift = np.vstack([drift, drift[-1:]])
    return y - drift[:, None, :] * ((np.arange(length) - length / 2) / length)[None, :, None]


def _between(mean: Complex, lines: NDArray[np.int64]) -> Array:
    """What stands on odd lines not asked, as root of its power near each line over the line's own size.

    Dry friction and geometry are odd: as much of them stands on the lines that were asked.
    """
    others = np.arange(mean.shape[0]) % 2 == 1
    others[lines] = False
    where = np.flatnonzero(others)
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
