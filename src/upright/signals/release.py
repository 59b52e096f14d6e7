"""When do pendulums and chains move freely, accelerated by gravity, springs, friction and hinge, and by no hand?"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from upright.signals.regression import LeastSquares
from upright.signals.smoothing import Motion, gaussian_noise_gain, noise_gain, savitzky_golay, white_noise
from upright.signals.stretches import stretches

Array = NDArray[np.float64]

HAND = 0.25
"""Share of gravity's largest pull, not explained by it, by friction or by the hinge, from which a hand is detected."""

SURE = 5.0
"""Standard deviations of what noise makes of an acceleration that a hand has to exceed."""

LASTS = 0.1
"""Share of a period that a hand holds at least."""

FAR = 0.5
"""Share of its largest swing from which a pendulum still swings once a hand that lifted it has let go."""

WIDTHS = 1 / 12, 1 / 2
"""Shares of a period over which accelerations are smoothed: as few as noise allows. A polynomial of order 4 over half a
period bends a sine's acceleration by 1 %."""

STILL = 0.02
"""Share of its largest speed below which a pendulum stands still, rather than turns."""

LEFT = 0.1
"""Share of the motion that a free swing has at least: where less is left, what was taken for a hand was none."""

WHOLE = 0.8
"""Share of the later energy that a swing has from its beginning on when it only loses energy; noise hides the rest."""


def free_from(t: Array, theta: Array, w: float, swings: float, hinge: Array | None = None) -> float:
    """Instant [s] from which a pendulum moves freely.

    ``theta'' = c cos(theta) x'' - w^2 sin(theta) - d theta'`` is regressed on the later half of its swings, and
    compared with the earlier ones: a pendulum that hangs in a hand is not accelerated as gravity would. Noise may not
    pass for a hand, so accelerations are smoothed until it is small, and a hand has to exceed what is left of it.

    Parameters
    ----------
    t : (N,) array
        Time [s].
    theta : (N,) array
        Angle from where it hangs [rad].
    w : float
        Angular frequency of its small swings [rad/s].
    swings : float
        Instant [s] from which it surely swings, as far as amplitudes show: the answer where accelerations do not.
    hinge : (N,) array, optional
        Coordinate that moves its hinge.
    """
    step = max(float(np.median(np.diff(t))), float(t[-1] - t[0]) / 20_000)
    grid = np.arange(t[0], t[-1], step)
    angle = np.interp(grid, t, theta)
    if w <= 0:
        return swings
    motion, width = _smoothed(angle, step, w)
    edge = width // 2
    if grid.size < 10 * width:
        return swings
    columns = [-np.sin(motion.q), -motion.v]
    if hinge is not None:
        columns.append(np.cos(motion.q) * savitzky_golay(np.interp(grid, t, hinge), step, width).a)
    table = np.column_stack(columns)
    size = np.abs(motion.q)
    moving = np.flatnonzero(size[:-width] > 0.05 * float(size.max()))
    late = moving[moving.size // 2 :]
    slopes = LeastSquares.of(table[late], motion.a[late]).slopes
    if slopes[0] <= 0:
        return swings
    pull = float(slopes[0]) * float(np.abs(np.sin(motion.q)).max())
    unexplained = np.abs(motion.a - table @ slopes)
    noise = float(np.median(unexplained[late])) / 0.6745
    unexplained[:edge] = unexplained[-edge:] = 0.0  # one-sided polynomials amplify noise tenfold
    other = stretches(unexplained > max(HAND * pull, SURE * noise))
    least = LASTS * 2 * math.pi / w / step
    hands = [(a, b) for a, b in other if b - a > least and _swings_after(size, b)]
    speed = np.abs(motion.v)
    still = [
        (a, b) for a, b in stretches(speed < STILL * float(speed.max())) if b - a > least
    ]  # upright no hand is felt
    turning = speed > 0.05 * float(speed.max())
    hands = [(a, b) for a, b in hands if np.count_nonzero(turning[b:]) >= LEFT * np.count_nonzero(turning)]
    let_go = min(hands[-1][1] + edge, grid.size - 1) if hands else 0
    if hinge is not None or grid[let_go] >= swings:
        return float(grid[let_go]) if hands else swings
    before = [b for _, b in still if grid[b] < swings] + [b + edge for _, b in other if grid[b] < swings]
    first = max([let_go, *before])
    energy = 2 * (1 - np.cos(motion.q)) * float(slopes[0]) + motion.v**2
    inside = energy[first + edge : energy.size - edge]
    return float(grid[first]) if inside.size and inside[0] >= WHOLE * float(inside.max()) else swings


def _smoothed(angle: Array, step: float, w: float) -> tuple[Motion, int]:
    """Motion smoothed as little as its noise allows, and over how many samples."""
    period = 2 * math.pi / w / step
    noise = white_noise(angle)
    width, most = (max(7, int(share * period) | 1) for share in WIDTHS)
    pull = w**2 * float(np.abs(np.sin(angle)).max())
    while width < most and SURE * noise * noise_gain(width) / step**2 > HAND * pull:
        width = min(most, int(1.3 * width) | 1)
    return savitzky_golay(angle, step, width), width


def _swings_after(size: Array, last: int) -> bool:
    """Whether a pendulum still swings far after a sample."""
    after = size[last + 1 :]
    return bool(after.size and after.max() > FAR * size.max())


CYCLES = 1.0
"""Periods that a free stretch of a chain lasts at least: what is shorter tells no period."""

GAUSSIANS = 1 / 20, 1 / 5
"""Standard deviations of what smooths a chain's accelerations, in periods, at least and at most as noise demands."""

MOST = 20_000
"""Samples of a log of a chain that are looked at; of more, every second or third."""

ROUNDS = 20
"""Of weighted least squares that come to least absolute errors."""

FEWEST = 2.5
"""Periods that a record needs for that."""

LARGE = 0.2
"""Share of the largest acceleration from which a body of a chain is surely not held."""

DEAD, DIED = 0.002, 0.01
"""Share of its range by which a body still goes through more in a period than it will, and in all, once its swing has
died away."""

HOLDS = 0.2
"""Share of a period that a hand is on a body of a chain, or on a pendulum that is let go again, at least."""

GOES = 0.5
"""Share of its widest swing that a body goes through in a period from where a free stretch begins."""

LASTING = 0.25
"""Seconds within which it does, where a period is shorter, and that a hand lasts, where a period is longer."""

AT_LEAST, TRAVELS = 0.2, 0.2
"""Share of the widest swing that a free stretch has at least, and of the widest travel that a body has that counts."""

LEFT_OVER = 0.2
"""Share of the variance of an acceleration that may stay unexplained where bodies move freely."""


def free_stretches(t: Array, bodies: Sequence[Array]) -> list[tuple[float, float]]:
    """Stretches (start, stop) [s] in which no hand is on any body of a chain, from release to where the swing has died.

    Springs and friction accelerate a body: its acceleration is linear in its speed, the places of all bodies and the
    sign of its speed. A hand that pulls or holds it does not follow that. All terms go through the same Gaussian, so
    that they stay in proportion however wide it is; it is as narrow as noise allows.

    Parameters
    ----------
    t : (N,) array
        Time [s].
    bodies : sequence of (N,) arrays
        Their places in any unit, those that a hand holds included.

    Returns
    -------
    list of (float, float)
        Empty where springs and friction do not explain the accelerations, or nothing swings.
    """
    every = math.ceil(t.size / MOST)
    bodies = [x[::every] for x in bodies]
    widest = max(float(np.ptp(x)) for x in bodies)
    return _unheld(t[::every], [x for x in bodies if float(np.ptp(x)) > TRAVELS * widest], bodies)


def free_swings(t: Array, theta: Array, hinge: Array | None = None) -> list[tuple[float, float]]:
    """Stretches (start, stop) [s] in which no hand is on a pendulum, as `free_stretches` tells those of a chain.

    Parameters
    ----------
    t : (N,) array
        Time [s].
    theta : (N,) array
        Angle from where it hangs [rad].
    hinge : (N,) array, optional
        Coordinate that moves its hinge.
    """
    every = math.ceil(t.size / MOST)
    theta = theta[::every]
    return _unheld(t[::every], [theta], [np.sin(theta)], hinge[::every] if hinge is not None else None)


def _unheld(
    t: Array, moving: Sequence[Array], pulls: Sequence[Array], hinge: Array | None = None
) -> list[tuple[float, float]]:
    """Stretches in which `pulls`, friction and what the `hinge` does accelerate what moves, and nothing else."""
    dt = float(t[-1] - t[0]) / (t.size - 1)
    period = max(_period(x, dt) for x in moving)
    if t.size < FEWEST * period / dt:
        return []
    sigma = max(_width(x, period / dt) for x in moving)
    hand = np.zeros(t.size, bool)
    for x in moving:
        by = _by_hand(x, pulls, sigma, hinge)
        if by is None:
            return []
        for a, b in stretches(by, gap=round(period / 2 / dt)):  # a body that sticks for a moment is in no hand
            hand[a : b + 1] |= b - a > min(HOLDS * period, LASTING) / dt
    width = min(max(round(max(period, LASTING) / dt), 3), t.size)
    reach = np.max([_reach(x, width) / float(np.ptp(x)) for x in moving], axis=0)
    edge, least = math.ceil(sigma), CYCLES * period / dt
    out: list[tuple[float, float]] = []
    for a, b in stretches(~hand):
        first, last = (a if a == 0 else a + edge), (b if b + 1 == t.size else b - edge)
        inside = reach[first : last + 2 - width]
        if last - first < least or not inside.size:
            continue
        begins = int(np.argmax(inside >= GOES * float(inside.max())))  # no hand is felt at rest, or upright
        if begins:
            begins = min(begins + min(_leaves(x[first + begins :]) for x in moving), inside.size - 1)
        inside = inside[begins:]
        least_left = np.flatnonzero(inside <= float(inside.min()) + DEAD)  # a hand that pulls slowly is noticed late
        dead = int(least_left[0] if inside.min() < DIED else least_left[-1])
        if b + 1 < t.size or inside.min() < DIED:  # else it swings on to the end of the log, and no hand follows
            last = min(last, first + begins + dead + width)
        first += begins
        if last - first >= least and inside[: dead + 1].max() >= AT_LEAST * float(reach.max()):
            out.append((float(t[first]), float(t[last])))
    return out


def _leaves(x: Array) -> int:
    """First sample at which a body is no longer where it began."""
    return int(np.argmax(np.abs(x - x[0]) > max(STILL * float(np.ptp(x)), SURE * white_noise(x))))


def _width(x: Array, period: float) -> float:
    """Standard deviation [samples] of the narrowest Gaussian that leaves little of the noise of an acceleration."""
    from scipy.ndimage import gaussian_filter1d

    noise, (low, high) = white_noise(x), (max(period * share, 1.0) for share in GAUSSIANS)
    sigma = low
    while sigma < high:
        pull = float(np.quantile(np.abs(gaussian_filter1d(x, sigma, order=2, mode="nearest")), 0.99))
        if SURE * noise * gaussian_noise_gain(sigma) < HAND * pull:
            break
        sigma *= 1.2
    return min(sigma, high)


def _period(x: Array, dt: float) -> float:
    """Period [s] in which a body's acceleration has most of its power."""
    shape = np.hanning(x.size)
    f = np.fft.rfftfreq(x.size, dt)
    power = np.abs(np.fft.rfft((x - x.mean()) * shape)) ** 2
    power[(f > 1 / (8 * dt)) | (power < SURE**2 * white_noise(x) ** 2 * float(np.sum(shape**2)))] = 0.0
    return float(1 / f[max(int(np.argmax(power * f**4)), 1)])


def _by_hand(x: Array, pulls: Sequence[Array], sigma: float, hinge: Array | None) -> NDArray[np.bool_] | None:
    """Samples (N,) at which something else accelerates a body; None where its motion is not explained at all."""
    from scipy.ndimage import gaussian_filter1d

    a, v = (gaussian_filter1d(x, sigma, order=k, mode="nearest") for k in (2, 1))
    turns = gaussian_filter1d(np.sign(v) * (np.abs(v) > STILL * float(np.abs(v).max())), sigma, mode="nearest")
    columns = [v, turns, *(gaussian_filter1d(y - np.median(y), sigma, mode="nearest") for y in pulls), np.ones_like(x)]
    if hinge is not None:
        thrown = gaussian_filter1d(hinge, sigma, order=2, mode="nearest")
        columns.append(np.cos(gaussian_filter1d(x, sigma, mode="nearest")) * thrown)
    table = np.column_stack(columns)
    edge = round(3 * sigma)
    pull = float(np.quantile(np.abs(a[edge:-edge]), 0.99))
    large = np.abs(a) > LARGE * pull  # a body that is held still, or pulled slowly, tells nothing of its springs
    large[:edge] = large[-edge:] = False
    if not large.any():
        return None
    weight = np.ones_like(a)
    left = np.zeros_like(a)
    for _ in range(ROUNDS):  # least absolute errors, which a hand that jerks or lets go pulls at little
        root = np.sqrt(weight[large])
        slopes = LeastSquares.of(table[large] * root[:, None], a[large] * root).slopes
        left = a - table @ slopes
        weight = 1 / np.maximum(np.abs(left), 1e-3 * pull)
    noise = float(np.median(np.abs(left[large]))) / 0.6745
    left[:edge] = left[-edge:] = 0.0
    hand = np.abs(left) > max(HAND * pull, SURE * noise)
    rows = large & ~hand
    unexplained = float(np.sum(left[rows] ** 2)) / max(float(np.sum(a[rows] ** 2)), 1e-300)
    return hand if unexplained < LEFT_OVER and 2 * np.count_nonzero(rows) > np.count_nonzero(large) else None


def _reach(x: Array, width: int) -> Array:
    """What a body (N,), its noise smoothed, goes through within as many samples from each on, (N - width + 1,)."""
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

    smooth = gaussian_filter1d(x, width / 10, mode="nearest")
    centred = np.asarray(maximum_filter1d(smooth, width) - minimum_filter1d(smooth, width), dtype=np.float64)
    return centred[width // 2 : width // 2 + x.size - width + 1]
