"""What does a rig do while its command rests, and what would it still do after? A constant and decaying modes.

How fast the modes of a linear rig swing and decay is the same in every rest; only how much of each there is differs.
Their rates are those whose sum misses all rests least (variable projection, Golub and Pereyra 1973), one mode after the
other as long as the samples tell it from noise. After the end of a rest, the Fourier sum of a mode is a geometric
series.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LEAD = 0.1
"""Share of a rest that is left out at its beginning: a drive that acts late has not stopped."""
MODES = 3
"""Most modes, a swing or a decay each."""
TELLS = 12.0
"""By how much a mode lowers minus twice the log likelihood, for each number that it adds."""
EXACT = 1e-9
"""Share of how a signal varies below which nothing is left to explain."""
SAMPLES, EACH = 400, 4.0
"""Samples of a rest on which rates are sought, and in a radian of the fastest swing, if these are more."""
STEPS = 12
"""Of a search for rates, before the best one is continued."""
SHIFTED = (60, 240)
"""Samples of a rest by whose shift modes are first looked for."""
DECAYS = (0.5, 3.0)
"""Decays of a mode in a rest with which its search begins."""
ABOUT = np.array([0.7, 1.0, 1.4])
"""Frequencies at which noise is looked at, over the one that is asked for."""


@dataclass(frozen=True, kw_only=True)
class FreeMotion:
    """One output in the rests of the command.

    Attributes
    ----------
    period : float
        Of a sample [s].
    parts : tuple of slice
        Samples of the rests, their beginnings left out.
    y : tuple of (N,) array
        The output there.
    rates : (K,) complex array
        Of the modes [1/s]: a swing's has an imaginary part above zero, a decay's has none.
    slopes : tuple of (N, P) array
        Of what the modes leave, by the numbers of the rates.
    """

    period: float
    parts: tuple[slice, ...]
    y: tuple[Array, ...]
    rates: Complex
    slopes: tuple[Array, ...]

    def density(self, omega: float) -> float:
        """Power of noise about a frequency, as the variance of white noise that has as much there.

        By Fourier sums there and about it, or from the lowest frequency that a rest holds. What the modes took of
        them is made up for.
        """
        power = expected = 0.0
        for y in self.y:
            Q = np.linalg.qr(_columns(self.rates, y.size, self.period))[0]
            lowest = max(omega, 2 * math.pi / (self.period * y.size))
            waves = np.exp(-1j * np.outer(lowest * ABOUT, self.period * np.arange(y.size))) * np.hanning(y.size)
            waves -= (waves @ Q) @ Q.T
            power += float(np.sum(np.abs(waves @ y) ** 2))
            expected += float(np.sum(np.abs(waves) ** 2))
        return power / expected

    @property
    def widening(self) -> float:
        """Factor on a variance by that density which its own scatter asks for, at 95 %.

        Sums at frequencies so close are worth two independent ones in a rest.
        """
        from scipy.stats import f

        return float(f.ppf(0.95, 2, 4 * len(self.y))) / (-math.log(0.05))

    def onward(self, rest: int, omega: float, *, swings: bool = False, rates: Complex | None = None) -> Complex:
        """Weights (N,) of a rest's samples, whose sum is the Fourier sum of the motion from the end of the rest on.

        Phases count from that end. Of what swings and decays alone, or of the constant too; by other rates if given.
        """
        rates = self.rates if rates is None else rates
        count = self.y[rest].size
        turn = np.exp(-1j * omega * self.period)
        poles = np.exp(rates * self.period)
        up, down = (p**count / (1 - p * turn) for p in (poles, np.conj(poles)))
        sums: list[complex] = [0.0 if swings else complex(1 / (1 - turn))]
        for r, a, b in zip(rates, up, down, strict=True):
            sums += [(a + b) / 2, (a - b) / 2j] if r.imag else [a]
        weights = np.array(sums, dtype=np.complex128) @ np.linalg.pinv(_columns(rates, count, self.period))
        return np.asarray(weights, dtype=np.complex128)

    def by_rates(self, omega: float, ends: Sequence[tuple[int, complex]]) -> list[Complex]:
        """Weights of every rest's samples by which they move a sum of onward sums through the rates.

        The sum is of a rest each, with a factor.
        """
        x = _numbers(self.rates)

        def total(x: Array) -> complex:
            rates = _rates(x, self.rates)
            return sum(f * complex(self.onward(rest, omega, rates=rates) @ self.y[rest]) for rest, f in ends)

        steps = 1e-5 * np.diag(np.maximum(np.abs(x), 1e-3 / self.period))
        slope = np.array([(total(x + d) - total(x - d)) / (2 * d.sum()) for d in steps], dtype=np.complex128)
        J = np.concatenate(self.slopes)
        return [-(slope @ np.linalg.pinv(J.T @ J) @ part.T) for part in self.slopes]

    @property
    def fastest(self) -> float:
        """Frequency of the fastest swing [rad/s], 0 without one."""
        return float(self.rates.imag.max(initial=0.0))


def motionless(x: Array, rests: Sequence[slice], period: float) -> FreeMotion:
    """A signal (N,) that does not move in the rests."""
    parts = tuple(rests)
    none = np.zeros(0, dtype=np.complex128)
    each = tuple(x[part] for part in parts)
    return FreeMotion(period=period, parts=parts, y=each, rates=none, slopes=tuple(np.zeros((z.size, 0)) for z in each))


def free_motion(y: Array, rests: Sequence[slice], period: float) -> FreeMotion:
    """Modes of an output (N,) in the rests of its command."""
    parts = tuple(slice(q.start + max(2, math.ceil(LEAD * (q.stop - q.start))), q.stop) for q in rests)
    each = tuple(y[part] for part in parts)
    rates = _best([np.zeros(0, dtype=np.complex128), *_by_shifts(each, period)], each, period)
    for _ in range(MODES):
        more = _best([rates, *_with_one_more(rates, each, period)], each, period)
        if more.size == rates.size:
            break
        rates = more
    return FreeMotion(period=period, parts=parts, y=each, rates=rates, slopes=_slopes(rates, each, period))


def _best(starts: Sequence[Complex], each: Sequence[Array], period: float) -> Complex:
    """Of rates that miss least from each start, the most likely ones, every number of them paid for."""
    count = sum(y.size for y in each)
    floor = max(count * (EXACT * max(float(np.ptp(y)) for y in each)) ** 2, 1e-300)
    ends = [_refined(start, each, period, STEPS) for start in starts]
    costs = [max(_cost(rates, each, period), floor) for rates in ends]
    least = int(np.argmin(costs))
    worth = count if costs[least] == floor else count / _alike(ends[least], each, period)
    numbers = [(1 + len(each)) * (rates.size + np.count_nonzero(rates.imag)) for rates in ends]
    lost = [worth * math.log(cost) + TELLS * n for cost, n in zip(costs, numbers, strict=True)]
    return _refined(ends[int(np.argmin(lost))], each, period, 10 * STEPS)


def _by_shifts(each: Sequence[Array], period: float) -> list[Complex]:
    """Modes as the shift of successive differences tells them, of one pole and more (Kung 1978)."""
    out: list[Complex] = []
    longest = max(y.size for y in each)
    for samples in SHIFTED:
        times = max(1, longest // samples)
        few = [np.diff(y[: y.size // times * times].reshape(-1, times).mean(axis=1)) for y in each]
        rows = min(samples // 2, *(z.size // 2 for z in few))
        if rows < 4:
            continue
        hankel = np.concatenate([np.lib.stride_tricks.sliding_window_view(z, rows) for z in few]).T
        U = np.linalg.svd(hankel @ hankel.T)[0]
        for order in range(1, min(2 * MODES, rows - 2) + 1):
            poles = np.linalg.eigvals(np.linalg.lstsq(U[:-1, :order], U[1:, :order], rcond=None)[0])
            rates = np.log(np.where(np.abs(poles) > 0, poles, 1e-9).astype(np.complex128)) / (period * times)
            rates = rates[(rates.imag >= 0) & (rates.imag < 2.5 / (period * times))]
            out += [np.where(np.abs(rates.imag) > 0, rates, rates.real)] if rates.size else []
    return out


def _alike(rates: Complex, each: Sequence[Array], period: float) -> float:
    """How many samples of what modes leave are worth one: 1 of white noise, more where each is like the last."""
    left = [_left(rates, y, period) for y in each]
    power = sum(float(z @ z) for z in left)
    like = sum(float(z[1:] @ z[:-1]) for z in left) / max(power, 1e-300)
    return (1 + like) / (1 - like) if 0 < like < 1 else 1.0


def _columns(rates: Complex, count: int, period: float) -> Array:
    """A constant, and real and imaginary part of every mode (count, 1 + P)."""
    modes: Complex = np.exp(np.outer(period * np.arange(count), rates))
    columns = [np.ones(count)]
    for k, r in enumerate(rates):
        columns += [modes[:, k].real, modes[:, k].imag] if r.imag else [modes[:, k].real]
    return np.column_stack(columns)


def _left(rates: Complex, y: Array, period: float) -> Array:
    Q = np.linalg.qr(_columns(rates, y.size, period))[0]
    return y - Q @ (Q.T @ y)


def _cost(rates: Complex, each: Sequence[Array], period: float) -> float:
    return sum(float(z @ z) for z in (_left(rates, y, period) for y in each))


def _numbers(rates: Complex) -> Array:
    """Decays, and frequencies of the swings [1/s]."""
    return np.array([x for r in rates for x in ((-r.real, r.imag) if r.imag else (-r.real,))])


def _rates(x: Array, like: Complex) -> Complex:
    values, out = iter(x), []
    for r in like:
        out.append(complex(-next(values), next(values) if r.imag else 0.0))
    return np.array(out, dtype=np.complex128)


def _with_one_more(rates: Complex, each: Sequence[Array], period: float) -> list[Complex]:
    """The modes so far and one more: a swing where what is left has most power, or a decay."""
    longest = max(y.size for y in each)
    grid = 2 * math.pi * np.fft.rfftfreq(4 * longest, period)
    left = [_left(rates, y, period) for y in each]
    power = np.sum([np.abs(np.fft.rfft(z * np.hanning(z.size), 4 * longest)) ** 2 for z in left], axis=0)
    power[grid < 4 * math.pi / (longest * period)] = 0.0
    top = float(grid[int(np.argmax(power))])
    decays = [d / (longest * period) for d in DECAYS]
    more = [*(complex(-d, top) for d in decays if top > 0), *(complex(-d, 0.0) for d in decays)]
    return [np.append(rates, r) for r in more]


def _thinned(rates: Complex, each: Sequence[Array], period: float) -> tuple[list[Array], int]:
    """Means of so many samples each: modes keep their rates."""
    longest = max(y.size for y in each)
    fastest = float(np.abs(rates).max(initial=1e-300))
    times = max(1, min(longest // SAMPLES, int(1 / (EACH * fastest * period)), min(y.size for y in each) // 12))
    return [y[: y.size // times * times].reshape(-1, times).mean(axis=1) for y in each], times


def _refined(rates: Complex, each: Sequence[Array], period: float, steps: int) -> Complex:
    """Rates that miss least, from a start, in so many steps at most."""
    from scipy.optimize import least_squares

    if not rates.size:
        return rates
    few, times = _thinned(rates, each, period)
    x = _numbers(rates)
    slow = 0.05 / (period * max(y.size for y in each))

    def residual(x: Array) -> Array:
        return np.concatenate([_left(_rates(x, rates), y, period * times) for y in few])

    low = np.where([part for r in rates for part in ((False, True) if r.imag else (False,))], 4 * slow, slow)
    high = np.full(x.size, math.pi / (period * times))
    best = least_squares(
        residual, np.clip(x, 1.01 * low, 0.99 * high), bounds=(low, high), x_scale=np.maximum(x, slow),
        xtol=1e-12, ftol=1e-12, gtol=1e-15, max_nfev=steps,
    )  # fmt: skip
    return _rates(np.asarray(best.x, dtype=np.float64), rates)


def _slopes(rates: Complex, each: Sequence[Array], period: float) -> tuple[Array, ...]:
    """Of what is left, by the rates' numbers, rest by rest (N, P)."""
    x = _numbers(rates)
    steps = 1e-5 * np.diag(np.maximum(np.abs(x), 1e-3 / period))

    def slope(y: Array, d: Array) -> Array:
        up, down = (_left(_rates(x + s, rates), y, period) for s in (d, -d))
        return (up - down) / (2 * d.sum())

    return tuple(np.array([slope(y, d) for d in steps]).reshape(x.size, y.size).T for y in each)
