"""What the log of a chain shows: carts or disks, who is held, what drives it, in which stretches, where is zero."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from upright.errors import BadInput, UprightError
from upright.physics import find
from upright.readers.inspection import Column, Inspection
from upright.records import Array, Record
from upright.records.columns import ANGLES, LENGTHS
from upright.signals.release import free_stretches
from upright.signals.stretches import turning_points
from upright.signals.trips import goes_dead
from upright.study.draft.described import COUNTS, counts_of
from upright.study.draft.recognise import REFERENCE, Recognised, in_dac_counts

RUNS_AWAY = 16_000
"""Counts beyond which a body is a disk: a cart of an ECP 210 has 16000 in 7 cm, and less travel than that."""

STAYS = 0.3
"""Share of its travel from where it began at which a body without ground spring is left lying."""

HELD = 0.2
"""Share of its neighbour's travel below which a body is held by hand."""

STILL = 0.005
"""Share of its travel by which a body that lies still may creep."""

HALVES = 4
"""Half swings that make a free swing: fewer may be a hand."""

SAMPLES = 4
"""Samples of a half swing, at least: what turns faster is noise."""

STEADY = 0.25
"""Share by which the half periods of one free swing may differ; dry friction leaves them equal."""

_NAMES_DISKS = re.compile(r"tors|dis[ck]|shaft|(?<!\d)205", re.IGNORECASE)
_NAMES_CARTS = re.compile(r"rectilinear|(?<!\d)210", re.IGNORECASE)
_GAINS_ZERO = re.compile(r"P_gain = 0\b(?!\.\d).*I_gain = 0\b(?!\.\d).*D_gain = 0\b(?!\.\d)")


@dataclass(frozen=True, kw_only=True)
class ChainLog:
    """What a log of carts or disks shows.

    Attributes
    ----------
    recognised : Recognised
        Plant, columns, rest levels, drive, sign and doubts, as for any plant.
    held : tuple of str
        Coordinates moved by a hand: they creep.
    locked : tuple of str
        Coordinates that do not move at all.
    reference : Column or None
        What a loop was to follow.
    loop : str
        The law that made the command of reference and motion, as a study writes it; "" when it is not recovered.
    windows : tuple of (float, float)
        Stretches that speak about the plant [s].
    still : tuple of str
        Coordinates that lie still before the first command.
    counts : mapping of str to (int, str)
        Encoder counts per turn and metre to begin with, by rad and m, and whose they are.
    """

    recognised: Recognised
    held: tuple[str, ...]
    locked: tuple[str, ...]
    reference: Column | None
    loop: str
    windows: tuple[tuple[float, float], ...]
    still: tuple[str, ...] = ()
    counts: Mapping[str, tuple[int, str]] = field(default_factory=lambda: COUNTS)

    @property
    def fixed(self) -> tuple[str, ...]:
        """Coordinates that do not move freely."""
        return (*self.held, *self.locked)

    @property
    def disks(self) -> bool:
        """Whether these are disks on a shaft, not carts."""
        return self.recognised.plant.startswith("tors")


def read_chain(
    record: Record, inspection: Inspection, recognised: Recognised, *, named: bool, path: str = ""
) -> ChainLog:
    """What a log shows of a chain.

    `named`: the plant was given and is not to be changed; `path` of the log may say what the rig is.
    """
    columns = _bodies(record, inspection, recognised)
    reference = _reference(inspection)
    drive, doubts = _drive(record, recognised, reference)
    t = record.t
    first = record[columns[0].name]
    plant = recognised.plant
    stated = list(recognised.doubts)
    u = record[drive.name] if drive is not None else np.zeros(t.size)
    signal = record[reference.name] if reference is not None else u
    at = int(np.argmax(signal != 0)) if signal[0] == 0 else 0
    reversed_ = drive is not None and not follows(t, u, first, at)
    counted = not {c.guess for c in columns} & (ANGLES | LENGTHS).keys()  # which does not distinguish carts from disks
    if counted and not named:
        kind, why = chain_kind(record, columns, drive, reversed_, path)
        plant = f"{kind}-{len(columns)}"
        other = "torsional" if kind == "rectilinear" else "rectilinear"
        stated = [stated[0].partition(";")[0].replace("rectilinear", kind).replace("torsional", kind)] if stated else []
        stated = [d.removesuffix(".") + f", since {why}; otherwise --plant {other}-{len(columns)}." for d in stated]
    names = [c.name for c in find(plant).coordinates]
    if len(names) != len(columns):
        raise BadInput(
            f"{plant} has {len(names)} bodies, and {len(columns)} column{'s' * (len(columns) != 1)} of this log may"
            f" measure one ({', '.join(c.name for c in columns)}); choose another --plant, or write the study by hand"
        )
    windows, loop = [_driven(record, inspection, at, disks=plant.startswith("tors"))], ""
    if drive is None:
        places = [record[c.name] for c in columns]
        windows = free_stretches(t, places) or releases(t, widest(record, columns)) or [recognised.window]
    elif reference is not None:
        loop, about_law = _law(record, drive, reference, columns[0], names[0])
        doubts.append(about_law)
        back, begin = int(np.flatnonzero(np.diff(signal))[-1]) + 1, max(at - int(1.0 / record.period), 0)
        if back > at and goes_dead(t[begin:], u[begin:], first[begin:], back - begin):
            windows = [(windows[0][0], float(t[back - 1]))]
            doubts.append(
                f"After {t[back]:.4g} s the command no longer moves the bodies: the drive is off then, and the window"
                " ends there."
            )
    held, locked = held_bodies(record, columns, names, windows)
    for name in held:
        doubts.append(f"{name} hardly moves: it was taken for held by hand, and its measured motion is prescribed.")
    for name in locked:
        doubts.append(f"{name} does not move: it was taken for locked.")
    rest = {
        n: zero_at(record, c, windows[0], at, driven=drive is not None) for n, c in zip(names, columns, strict=True)
    }
    recognised = replace(
        recognised, plant=plant, columns=dict(zip(names, columns, strict=True)), rest=rest, drive=drive,
        reversed=reversed_, throw=0.0, window=windows[0], doubts=(*stated, *doubts),
    )  # fmt: skip
    return ChainLog(
        recognised=recognised, held=held, locked=locked, reference=reference, loop=loop, windows=tuple(windows),
        still=still_bodies(record, recognised.columns, at) if drive is not None else (),
        counts={unit: counts_of(inspection, unit) for unit in COUNTS},
    )  # fmt: skip


def _bodies(record: Record, inspection: Inspection, recognised: Recognised) -> list[Column]:
    """Columns of the bodies in the order of the log, those that do not move included."""
    bodies = {c.name: c for c in recognised.columns.values()}
    kinds = {c.guess for c in bodies.values()}
    unit = next(iter(kinds))
    still = {
        c.name: replace(c, guess=unit)
        for c in inspection.columns
        if c.name not in bodies and not c.drive and (c.guess in kinds or (c.constant and not c.guess))
        and not any(remark.startswith("the same as") for remark in c.remarks)
        and not (c.constant and c.low == 0 and len(bodies) > 1)  # a board has more inputs than the rig has encoders
        and re.search(r"enc|pos|dis[ck]|cart|^(x|theta)_?\d", c.name, re.IGNORECASE)
    }  # fmt: skip
    both = {**bodies, **still}
    return [both[c.name] for c in inspection.columns if c.name in both][:9]


def widest(record: Record, columns: list[Column]) -> Array:
    """Readings (N,) of the body that moves most."""
    return max((record[c.name] for c in columns), key=lambda x: float(np.ptp(x)))


def chain_kind(
    record: Record, columns: list[Column], drive: Column | None, against: bool, path: str
) -> tuple[str, str]:
    """Whether these are carts or disks, and why.

    `against`: the columns count against the command; `path` of the log may say what the rig is.
    """
    most = widest(record, columns)
    last = float(record[drive.name][-1]) if drive is not None else 0.0
    pushed = last * float(most[-1] - most[0]) * (-1 if against else 1) > 0
    released = drive is not None and not pushed  # driven, and nothing holds them at the end
    units = {c.guess for c in columns}
    if units & ANGLES.keys():
        return "torsional", "they are angles"
    if units & LENGTHS.keys():
        return "rectilinear", "they are lengths"
    if float(np.ptp(most)) > RUNS_AWAY:
        return "torsional", f"{np.ptp(most):.0f} counts are more than a cart can travel"
    named = " ".join(c.name for c in columns)
    if _NAMES_DISKS.search(named):
        return "torsional", "the columns are called so"
    late = most[-max(most.size // 20, 2) :]
    if (
        released
        and units == {"counts"}
        and np.ptp(late) < 0.02 * np.ptp(most)
        and (abs(most[-1] - most[0]) > STAYS * float(np.ptp(most)))
    ):
        return "torsional", "they come to rest elsewhere, where springs would pull carts back"
    if _NAMES_DISKS.search(path) and not _NAMES_CARTS.search(path):
        return "torsional", "the file or its folder is called so"
    return "rectilinear", "they return to where they began"


def _reference(inspection: Inspection) -> Column | None:
    """What a loop was to follow: a stepping column that is called so or is seen to be one."""
    for c in inspection.columns:
        remarks = " ".join(c.remarks)
        steps_ = c.drive and c.stepwise and not c.constant and not re.search("follows|DAC|same as", remarks)
        if steps_ and ("the reference" in remarks or REFERENCE.search(c.name)):
            return c
    return None


def _drive(record: Record, recognised: Recognised, reference: Column | None) -> tuple[Column | None, list[str]]:
    """What drove the bodies, and what was doubtful about it."""
    drive = recognised.drive
    if drive is None or in_dac_counts(drive):
        if reference is not None and drive is None:
            return None, [
                f"Column '{reference.name}' is what a loop was to follow, and no column holds the command that came of"
                " it: only free motion can be explained. Take a log that has the command."
            ]
        return drive, []
    if reference is not None and drive.name == reference.name:
        return None, []
    asleep = any(_GAINS_ZERO.search(note) for note in record.provenance.notes)
    if reference is None and asleep:
        return None, [f"Column '{drive.name}' was left out: the gains of its loop are zero, so nothing was commanded."]
    return drive, []


def _driven(record: Record, inspection: Inspection, at: int, *, disks: bool) -> tuple[float, float]:
    """From just before the first command to where everything lies still at the end."""
    t = record.t
    start = float(t[max(at - int(0.05 / record.period) - 1, 0)])
    end = float(t[-1])
    last = next((s for s in reversed(inspection.rests) if s[1] >= end - 0.05 * (end - float(t[0]))), None)
    # where springs leave a cart tells its friction, so its rest stays in; where a disk stopped says no more
    if disks and last is not None and last[0] > start + 0.1 * (end - float(t[0])):
        return start, min(end, last[0] + 0.5)
    return start, end


def _law(record: Record, drive: Column, reference: Column, body: Column, coordinate: str) -> tuple[str, str]:
    """The law that made the command, as a study writes it ("" for none), and the sentence that says so."""
    from upright.closed_loop import recover_law
    from upright.closed_loop.recovery import loop_written

    try:
        law = recover_law(record, measured=[body.name], references=[reference.name], command=drive.name)
    except UprightError as error:
        return "", f"No law was found in '{drive.name}' ({error}); the command as recorded drives the bodies."
    text = loop_written(law).replace(f"COORDINATE OF {body.name}", coordinate)
    if law.quality not in ("exact", "rounding") or not text:
        return "", (
            f"'{drive.name}' follows from '{reference.name}' and '{body.name}' only to {law.explained:.0f} %: the"
            " command as recorded drives the bodies. If you know the law, write it as loop."
        )
    return text, f"A loop was closed: '{drive.name}' is {law.structure}; it is simulated with the bodies."


def held_bodies(
    record: Record, columns: list[Column], names: list[str], windows: list[tuple[float, float]]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Coordinates held by hand, and locked ones."""
    inside = np.zeros(record.t.size, dtype=bool)
    for a, b in windows:
        inside |= (record.t >= a) & (record.t <= b)
    travel = [float(np.ptp(record[c.name][inside])) for c in columns]
    step = [max(c.resolution.step or 0.0, 1e-9 * max(travel)) for c in columns]
    still, locked = list[str](), list[str]()
    for name, far, least in zip(names, travel, step, strict=True):
        if far <= 2 * least:
            locked.append(name)
        elif far < HELD * max(travel):
            still.append(name)
    return tuple(still), tuple(locked)


def still_bodies(record: Record, columns: dict[str, Column], at: int) -> tuple[str, ...]:
    """Coordinates that lie still for 0.2 s before the first command; a log that begins with it began at rest."""
    before = slice(max(at - int(0.2 / record.period), 0), at + 1)
    return tuple(
        name
        for name, c in columns.items()
        if float(np.ptp(record[c.name][before])) <= max(3 * (c.resolution.step or 0.0), STILL * (c.high - c.low))
    )


def zero_at(record: Record, c: Column, window: tuple[float, float], at: int, *, driven: bool) -> float:
    """Reading at which a coordinate is zero: before the first command, else where the first stretch ends."""
    x, t = record[c.name], record.t
    if driven:
        return float(np.median(x[max(0, at - 50) : at])) if at >= 5 else float(x[0])
    late = (t <= window[1]) & (t >= window[1] - 0.3 * (window[1] - window[0]))
    return (float(x[late].max()) + float(x[late].min())) / 2


def releases(t: Array, x: Array) -> list[tuple[float, float]]:
    """Stretches (start, stop) [s] in which a body swings freely and only loses amplitude.

    A hand pulls, holds and lets go; what follows are half swings of equal length, each smaller than the one before.
    A stretch begins where the body has left the hand by a quarter of the first half swing.
    """
    turns = turning_points(x, 0.03 * float(np.ptp(x)), ends=True).tolist()
    if len(turns) < HALVES:
        return []
    at = [_leaves(x, a, b) for a, b in pairwise(turns)]
    length = np.array([t[b] - t[a] for a, b in zip(at, turns[1:], strict=True)])
    size = np.array([abs(x[b] - x[a]) for a, b in pairwise(turns)])
    out: list[tuple[float, float]] = []
    i = 0
    while i < size.size - HALVES + 1:
        j = i
        while j + 1 < size.size and size[j + 1] < 1.02 * size[j] and _steady(length[i : j + 2]):
            j += 1
        half = float(np.median(length[i : j + 1]))
        if j - i + 1 >= HALVES and half >= SAMPLES * float(t[-1] - t[0]) / (t.size - 1):
            follows = float(t[at[j + 1]]) if j + 1 < size.size else float(t[-1])
            last = float(t[turns[j + 1]])
            out.append((float(t[at[i]]) + 0.25 * half, min(last + half, follows, float(t[-1]))))
            i = j + 1
        else:
            i += 1
    longest = max(out, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
    # the body swings with one period; what is much faster is a hand that shakes
    return [span for span in out if span[1] - span[0] > 0.3 * (longest[1] - longest[0])]


def _leaves(x: Array, a: int, b: int) -> int:
    """Last sample near the turning point a before the way to b: a held body leaves late."""
    near = np.flatnonzero(np.abs(x[a : b + 1] - x[a]) < 0.02 * abs(x[b] - x[a]))
    return a + int(near[-1])


def _steady(lengths: Array) -> bool:
    """Whether half periods are equal but for the first, which a hand may have lengthened."""
    middle = float(np.median(lengths))
    return bool(np.all(np.abs(lengths - middle) < STEADY * middle))


def follows(t: Array, u: Array, x: Array, at: int) -> bool:
    """Whether a body goes up when the command goes up, judged by the first motion after sample `at`."""
    stop = min(at + max(int(2.0 / float(np.median(np.diff(t)))), 5), t.size)
    moved = x[at:stop] - x[at]
    far = np.flatnonzero(np.abs(moved) > 0.03 * np.ptp(x))
    if not far.size:
        return True
    before = float(u[at - 2]) if at > 2 else 0.0
    push = float(np.mean(u[at + 1 : at + 1 + max(int(far[0]), 1)])) - before
    return bool(moved[far[0]] * push >= 0)
