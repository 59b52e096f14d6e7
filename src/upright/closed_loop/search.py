"""Recovery of the law that put out the commands of a log: which structure was it, with which numbers?

Structures are tried on the recorded signals, and the simplest that predicts rows it has not seen is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.closed_loop.intervals import averaged, gains_with_intervals, sharpen
from upright.closed_loop.recovery import Recovery, TriedStructure
from upright.closed_loop.regression import TERMS, Family, Regression, Signals, Term, channels_of, fit, law_of, structure
from upright.closed_loop.structures import finer
from upright.errors import BadInput, NotIdentifiable
from upright.readers.resolution import resolution_of
from upright.records import Record

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

ALIKE = 1.003
"""Structures whose rows left out miss by no more than this factor more than the best are as good; the simplest wins."""

FLOOR = 1e-12
"""Share of the command's size below which a miss is rounding of the arithmetic."""

ROUNDED = 0.35
"""Steps of the column that rows may miss by, root mean square, when the law is right: rounding alone makes 0.289,
and a clock that jitters a little more."""

ROWS = 20_000
"""Most rows a comparison of structures looks at; the last fit takes all."""

SERVO_SAMPLES = 1_000_000
"""Most samples of a servo that a spline is drawn through; the regression holds some 50 columns of them."""

_JUNK = 3  # first rows, which some front ends fill with whatever their memory held
_LONGEST_HOLD = 50
_LEAST_CHANGES = 20


def recover_law(
    record: Record, *, measured: Sequence[str], command: str, references: Sequence[str] = (),
    feedforward: Sequence[str] = (), every: int | None = None,
) -> Recovery:  # fmt: skip
    """The law between columns of a log, with what it leaves unexplained.

    P, PI, PD and PID of each measured signal's error are tried, with plain, two-tap and low-passed differences (the
    low pass by exact search), on the error or on the measurement, at once or a sample late. Rows where the command
    rests at its limit are left out and show whether the memory stood still meanwhile. A command that changes every
    m-th row only is a law at that rate; rows that miss samples of a faster servo are recognised by a better fit of a
    spline at `every` times the rate.

    Parameters
    ----------
    measured, references : sequence of str
        Columns that the law reads; the first reference belongs to the first measured column and so on. A measured
        column without one is compared with zero.
    command : str
        Column that the law put out.
    feedforward : sequence of str
        Columns that were added to the law's output.
    every : int, optional
        Samples of the servo per row, when it is known; else 1, 2, 5 and 10 are tried where 1 leaves something.

    Raises
    ------
    BadInput
        When a column is missing, or there are more references than measured columns.
    NotIdentifiable
        When the command is constant, or does not depend on what is measured.
    """
    if not measured:
        raise BadInput('a law needs at least one measured column, such as measured = ["theta"].')
    if len(references) > len(measured):
        raise BadInput(f"{len(measured)} measured columns take as many references at most, got {len(references)}.")
    u = record[command]
    hold, first = held_for(u)
    rows = np.arange(first, u.size, hold)
    if rows.size < 60:
        raise NotIdentifiable(f"{rows.size} commands are too few to tell a law from; at least 60 are needed.")
    u = u[rows]
    if np.ptp(u[_JUNK:]) == 0:
        raise NotIdentifiable(f"the command '{command}' stays at {u[-1]:g}: nothing closed a loop here.")
    y = [record[name][rows] for name in measured]
    r = [record[name][rows] for name in references]
    extra = tuple((name, record[name][rows]) for name in feedforward)
    if every is not None and every > 1 and rows.size * every > SERVO_SAMPLES:
        raise BadInput(
            f"{rows.size} rows of {every} samples each are {rows.size * every:.3g} samples of the servo, and"
            f" {SERVO_SAMPLES:.0e} are the most; is that the number of samples within a row? Else take fewer rows."
        )
    period = float(record.t[-1] - record.t[0]) / (record.t.size - 1) * hold
    tried: list[tuple[Search, Regression]] = []
    tries = [n for n in (1, 2, 5, 10) if n == 1 or rows.size * n <= SERVO_SAMPLES]
    for n in tries if every is None else (every,):
        search = Search(tuple(measured), tuple(references), y, r, extra, u, period / n, n)
        best = search.best()
        tried.append((search, best))
        if n == 1 and (best.missed <= search.bar(0.0) or hold > 1):
            break
    # a faster servo has to be plainly better: a spline can only guess what lies between rows
    search, best = min(tried, key=lambda pair: pair[1].missed * (1.0 if pair[0].every == 1 else 1.1))
    return search.recovery(best, record, command, rows)


def held_for(u: Array) -> tuple[int, int]:
    """Rows for which each command is held, and the first row at which one is new; (1, 0) when each row has its own."""
    changes = np.flatnonzero(np.diff(u)) + 1
    changes = changes[changes > 3]  # the first rows of a log may be junk
    if changes.size < _LEAST_CHANGES:
        return 1, 0
    rows = int(np.gcd.reduce(changes - changes[0]))
    return (rows, int(changes[0] % rows)) if 1 < rows <= _LONGEST_HOLD else (1, 0)


def extremes(u: Array) -> tuple[Rows, Rows]:
    """Rows at the highest and at the lowest command, where the command stays there for three rows or more."""
    rows: list[Rows] = []
    for level in (u.max(), u.min()):
        at = np.abs(u - level) <= 1e-9 * max(1.0, abs(float(level)))
        stays = at[2:] & at[1:-1] & at[:-2]
        rows.append(at if stays.any() and level != 0 else np.zeros_like(at))
    return rows[0], rows[1]


def stepped(values: Array, every: int) -> Array:
    """Samples of a reference (N,) at `every` times its rate: it steps, and does so right after the row before."""
    if every == 1:
        return values
    k = np.arange((values.size - 1) * every + 1)
    return values[-(-k // every)]


class Search:
    """Signals of one log, and the structures tried on them."""

    def __init__(
        self, measured: tuple[str, ...], references: tuple[str, ...], y: list[Array], r: list[Array],
        extra: tuple[tuple[str, Array], ...], u: Array, period: float, every: int,
    ) -> None:  # fmt: skip
        self.measured, self.references, self.y, self.r, self.u, self.every = measured, references, y, r, u, every
        self.high, self.low = extremes(u)
        self.extreme = self.high | self.low
        self.resolution = resolution_of(u[_JUNK:]).step
        pairs = tuple(
            (finer(values, every), stepped(r[i], every) if i < len(r) else None) for i, values in enumerate(y)
        )
        self.signals = Signals(
            names=measured, pairs=pairs, feedforward=extra, period=period, every=every,
            moving=np.repeat(~self.extreme, every)[: pairs[0][0].size].astype(np.float64),
        )  # fmt: skip
        self.tried: list[tuple[str, Regression]] = []
        self.used = np.ones(u.size, dtype=bool)

    def families(self) -> list[Family]:
        """Every family worth trying on this log."""
        steps = any(r is not None and np.ptp(r) > 0 for _, r in self.signals.pairs)
        limited = bool(self.extreme.any())
        families = [
            Family(on=on, smoothing=smoothing, delay=delay, hold=hold)
            for smoothing in (("difference", "two taps", "filter") if self.every == 1 else ("difference", "filter"))
            for on in (("error", "measurement") if steps else ("error",))
            for delay in (0, 1)
            for hold in ((False, True) if limited else (False,))
        ]
        return sorted(families, key=lambda f: f.extras)

    def best(self) -> Regression:
        """The simplest structure that predicts as well as any."""
        best = self.search()
        limited = self.limited(best)
        if (limited != self.extreme).any():  # the command rests there because nothing moves, not at a limit
            self.extreme = limited
            best = self.search()
        self.used = (np.arange(self.u.size) >= _JUNK) & ~self.extreme
        return fit(self.signals, best.family, self.u, self.used, self.dropped(best))

    def search(self) -> Regression:
        """Family first, then the terms it needs, on at most `ROWS` rows."""
        self.used = (np.arange(self.u.size) >= _JUNK) & ~self.extreme
        self.used[ROWS // self.every :] = False
        if self.used.sum() < 40:
            raise NotIdentifiable(
                f"the command is at its limit in all but {int(self.used.sum())} rows; a law shows only below it."
            )
        fits: list[Regression] = []
        for family in self.families():
            made = fit(self.signals, family, self.u, self.used)
            if not fits or made.averages:
                fits.append(made)
            if fits[-1].missed <= self.bar(0.0):
                break  # what comes later is less simple
        return self.prune(self.simplest(fits))

    def bar(self, least: float) -> float:
        """What counts as missing no more than `least`: nothing is nearer than the arithmetic and the column's steps."""
        return max(ALIKE * least, ROUNDED * self.resolution, FLOOR * float(np.abs(self.u[_JUNK:]).max()))

    def simplest(self, fits: Sequence[Regression]) -> Regression:
        """Fewest numbers among those that predict as well as the best."""
        bar = self.bar(min(f.missed for f in fits))
        for f in fits:
            self.tried.append((structure(f, self.measured), f))
        return min((f for f in fits if f.missed <= bar), key=lambda f: (f.parameters, f.missed))

    def dropped(self, retained: Regression) -> frozenset[Term]:
        """Terms that a regression goes without."""
        full = {(kind, i) for kind in TERMS for i in range(len(self.measured))}
        return frozenset(full - set(retained.columns.terms))

    def prune(self, best: Regression) -> Regression:
        """Leave out one term after the other while rows held out are predicted as well."""
        while True:
            drop = self.dropped(best)
            terms = [t for t in best.columns.terms if t[0] in TERMS]
            if len(terms) == 1:
                return best
            fewer = [fit(self.signals, best.family, self.u, self.used, drop | {term}) for term in terms]
            for f in fewer:
                self.tried.append((structure(f, self.measured), f))
            good = min(fewer, key=lambda f: f.missed)
            if good.missed > self.bar(best.missed):
                return best
            best = good
            if not any(t[0] == "kd" for t in best.columns.terms) and best.family.smoothing != "difference":
                plain = replace(best.family, on="error", smoothing="difference")
                best = fit(self.signals, plain, self.u, self.used, self.dropped(best))

    def limited(self, best: Regression) -> Rows:
        """Rows where the law is saturated: beyond the command's largest or smallest value."""
        slack = 3 * best.missed + 1e-9 * float(np.ptp(self.u[_JUNK:]))
        out = np.zeros(self.u.size, dtype=bool)
        for at, side in ((self.high, 1.0), (self.low, -1.0)):
            over = side * (best.predicted - self.u) > -slack
            far = side * (best.predicted - self.u) > slack
            if at.any() and over[at].mean() > 0.9 and far[at].mean() > 0.2:
                out |= at
        return out

    def recovery(self, best: Regression, record: Record, command: str, rows: NDArray[np.int64]) -> Recovery:
        """Everything about the structure kept."""
        rounded = self.every == 1 and FLOOR * float(np.abs(self.u).max()) < best.missed < 0.5 * self.resolution
        if rounded:
            best, covered = sharpen(best, self.u, self.used, self.resolution)
            named = gains_with_intervals(best, self.signals, covered)
        else:
            named = gains_with_intervals(best, self.signals, averaged(best, self.u, self.used))
        if not any(abs(g.value) > 2 * g.stderr for name, g in named.items() if name[:2] in TERMS):
            raise NotIdentifiable(
                f"'{command}' does not depend on {', '.join(self.measured)}: the loop is open, or the law reads other"
                " columns."
            )
        channels = channels_of(best, self.measured, self.references)
        limited = self.limited(best)
        limit = float(np.abs(self.u[limited]).max()) if limited.any() else np.inf
        law = law_of(best, channels, self.signals, limit)
        extra = {name: best.by_term[("ff", j)] for j, (name, _) in enumerate(self.signals.feedforward)}
        if self.every == 1:
            known = dict(zip((*self.measured, *self.references), (*self.y, *self.r), strict=True))
            y = np.column_stack([known[name] for name in law.measured])
            r = np.column_stack([known[name] for name in law.reference_names]) if law.reference_names else None
            fed = sum((extra[name] * values for name, values in self.signals.feedforward), np.zeros(self.u.size))
            reproduced = replace(law, references=r).follow(y, fed)[0][:, 0]
        else:
            reproduced = np.clip(best.predicted, -limit, limit)
        return Recovery(
            law=replace(law, command_resolution=self.resolution) if rounded else law, command=command,
            feedforward=extra, channels=channels, gains=named, structure=structure(best, self.measured),
            rows=rows, recorded=self.u, reproduced=reproduced, used=self.used, resolution=self.resolution,
            saturated=float(limited.mean()), every=self.every,
            candidates=tuple(
                TriedStructure(name=name, parameters=f.parameters, missed=f.missed)
                for name, f in sorted(self.tried, key=lambda pair: pair[1].missed)
            ),
            unit=record.units.get(command, ""),
        )  # fmt: skip
