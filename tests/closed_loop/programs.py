"""Loops closed by programs as students write them, line by line; nothing here knows the code under test."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from upright.records import Record

T = 2e-3


class Pid:
    """PID with memory in variables, as on a microcontroller."""

    def __init__(
        self, kp=0.0, ki=0.0, kd=0.0, *, tau=0.0, second=0.0, on="error", period=T, limit=math.inf, hold=False
    ):
        self.kp, self.ki, self.kd, self.on = kp, ki, kd, on
        self.tau, self.second, self.period, self.limit, self.hold = tau, second, period, limit, hold
        self.sum = self.filtered = self.quotient = 0.0
        self.last: float | None = None

    def __call__(self, y: float, r: float) -> float:
        e = r - y
        x = e if self.on == "error" else -y
        if self.last is None:
            self.last = x
        quotient = (x - self.last) / self.period
        mixed = (1 - self.second) * quotient + self.second * self.quotient
        self.quotient, self.last = quotient, x
        self.filtered += self.period / (self.period + self.tau) * (mixed - self.filtered)
        u = self.kp * e + self.ki * (self.sum + e * self.period) + self.kd * self.filtered
        if not (self.hold and abs(u) > self.limit):
            self.sum += e * self.period
        return max(-self.limit, min(self.limit, u))


def closed_loop(
    law: Callable[[float, float], float],
    *,
    rows: int = 4000,
    every: int = 1,
    hold: int = 1,
    late: bool = False,
    count: float = 0.0,
    step: float = 0.0,
    seed: int = 1,
) -> Record:
    """A cart that a program drives after a reference that steps; `y` in counts, `u` rounded, as the log has them.

    `every` samples of the program make a row; `hold` rows pass before the program answers again.
    """
    generator = np.random.default_rng(seed)
    dt = T / every
    y = v = u = held = 0.0
    out = []
    for k in range(rows * every):
        r = [0.0, 1.0, -0.5, 0.7][(k // (900 * every)) % 4]
        seen = math.floor(y / count + 0.5) * count if count else y
        if k % hold == 0:
            fresh = law(seen, r)
            fresh = math.floor(fresh / step + 0.5) * step if step else fresh
            u, held = (held, fresh) if late else (fresh, fresh)
        if k % every == 0:
            out.append((seen, r, u))
        # 20 u pulls a unit mass with damping 3; a rough table shakes it
        a = 20 * u - 3 * v + 30 * generator.normal()
        v += a * dt
        y += v * dt
    table = np.array(out)
    return Record(t=np.arange(rows) * T, signals=dict(zip(("y", "r", "u"), table.T, strict=True)))
