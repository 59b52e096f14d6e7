"""What does the log of a chain show: carts or disks, who is held, what drives it, in which stretches?"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from upright.errors import UprightError
from upright.physics import find
from upright.readers.inspection import Column, Inspection
from upright.records import Record
from upright.study.columns import Array
from upright.study.draft.recognise import REFERENCE, Recognised, in_dac_counts
from upright.study.draft.shaft_events import follows, goes_dead, releases, steps
from upright.study.draft.shaft_rest import held_bodies, waiting, zero_at

RUNS_AWAY = 16_000
"""Counts beyond which a body is a disk: a cart of an ECP 210 has 16000 in 7 cm, and less travel than that."""

STAYS = 0.3
"""Share of its travel from where it began at which a body without ground spring is left lying."""

_NAMES_DISKS = re.compile(r"tors|dis[ck]|shaft|(?<!\d)205", re.IGNORECASE)
_NAMES_CARTS = re.compile(r"rectilinear|(?<!\d)210", re.IGNORECASE)
_GAINS_ZERO = re.compile(r"P_gain = 0\b(?!\.).*I_gain = 0\b(?!\.).*D_gain = 0\b(?!\.)")


@dataclass(frozen=True, kw_only=True)
class Sight:
    """What a log of carts or disks shows.

    Attributes
    ----------
    found : Recognised
        Plant, columns, rest levels, drive, sign and doubts, as for any plant.
    held : tuple of str
        Coordinates moved by a hand: they creep.
    locked : tuple of str
        Coordinates that do not move at all.
    reference : Column or None
        What a loop was to follow.
    loop : str
        The law that made the command of reference and motion, as a study writes it; "" when it could not be told.
    windows : tuple of (float, float)
        Stretches that speak about the plant [s].
    waiting : tuple of str
        Coordinates that lie still before the first command.
    """

    found: Recognised
    held: tuple[str, ...]
    locked: tuple[str, ...]
    reference: Column | None
    loop: str
    windows: tuple[tuple[float, float], ...]
    waiting: tuple[str, ...] = ()


def look(record: Record, seen: Inspection, found: Recognised, *, named: bool, path: str = "") -> Sight:
    """What a log shows of a chain.

    `named`: the plant was given and is not to be changed; `path` of the log may say what the rig is.
    """
    columns = _bodies(record, seen, found)
    reference = _reference(seen)
    drive, doubts = _drive(record, found, reference)
    t = record.t
    first = record[columns[0].name]
    most = max((record[c.name] for c in columns), key=lambda x: float(np.ptp(x)))
    plant = found.plant
    told = list(found.doubts)
    u = record[drive.name] if drive is not None else np.zeros(t.size)
    asked = record[reference.name] if reference is not None else u
    at = int(np.argmax(asked != 0)) if asked[0] == 0 else 0
    reversed_ = drive is not None and not follows(t, u, first, at)
    if not named:
        moved = float(most[-1] - most[0])
        pushed = drive is not None and float(u[-1]) * moved * (-1 if reversed_ else 1) > 0
        kind, why = _kind(columns, most, drive is not None and not pushed, path)
        plant = f"{kind}-{len(columns)}"
        other = "torsional" if kind == "rectilinear" else "rectilinear"
        told = [told[0].partition(";")[0].replace("rectilinear", kind).replace("torsional", kind)] if told else []
        told = [d.removesuffix(".") + f", since {why}; otherwise --plant {other}-{len(columns)}." for d in told]
    names = [c.name for c in find(plant).coordinates]
    windows, loop = [_driven(record, seen, at, disks=plant.startswith("tors"))], ""
    if drive is None:
        windows = releases(t, most) or [found.window]
    elif reference is not None:
        loop, about_law = _law(record, drive, reference, columns[0], names[0])
        doubts.append(about_law)
        back, begin = steps(asked)[-1], max(at - int(1.0 / record.period), 0)
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
    found = replace(
        found, plant=plant, columns=dict(zip(names, columns, strict=True)), rest=rest, drive=drive,
        reversed=reversed_, mirrored=False, window=windows[0], doubts=(*told, *doubts),
    )  # fmt: skip
    return Sight(
        found=found, held=held, locked=locked, reference=reference, loop=loop, windows=tuple(windows),
        waiting=waiting(record, found.columns, at) if drive is not None else (),
    )  # fmt: skip


def _bodies(record: Record, seen: Inspection, found: Recognised) -> list[Column]:
    """Columns of the bodies in the order of the log, those that do not move included."""
    taken = {c.name: c for c in found.columns.values()}
    kinds = {c.guess for c in taken.values()}
    unit = next(iter(kinds))
    still = {
        c.name: replace(c, guess=unit)
        for c in seen.columns
        if c.name not in taken and not c.drive and (c.guess in kinds or (c.constant and not c.guess))
        and not any(lie.startswith("the same as") for lie in c.lies)
        and not (c.constant and c.low == 0 and len(taken) > 1)  # a board has more inputs than the rig has encoders
        and re.search(r"enc|pos|dis[ck]|cart|^(x|theta)_?\d", c.name, re.IGNORECASE)
    }  # fmt: skip
    both = {**taken, **still}
    return [both[c.name] for c in seen.columns if c.name in both][:9]


def _kind(columns: list[Column], most: Array, released: bool, path: str) -> tuple[str, str]:
    """Whether these are carts or disks, and why; `released`: they were driven, and nothing holds them at the end."""
    units = {c.guess for c in columns}
    if units & {"rad", "deg"}:
        return "torsional", "they are angles"
    if units & {"m", "mm"}:
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


def _reference(seen: Inspection) -> Column | None:
    """What a loop was to follow: a stepping column that is called so or is seen to be one."""
    for c in seen.columns:
        lies = " ".join(c.lies)
        steps_ = c.drive and c.stepwise and not c.constant and not re.search("follows|DAC|same as", lies)
        if steps_ and ("the reference" in lies or REFERENCE.search(c.name)):
            return c
    return None


def _drive(record: Record, found: Recognised, reference: Column | None) -> tuple[Column | None, list[str]]:
    """What drove the bodies, and what was doubtful about it."""
    drive = found.drive
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


def _driven(record: Record, seen: Inspection, at: int, *, disks: bool) -> tuple[float, float]:
    """From just before the first command to where everything lies still at the end."""
    t = record.t
    start = float(t[max(at - int(0.05 / record.period) - 1, 0)])
    end = float(t[-1])
    last = next((s for s in reversed(seen.rests) if s[1] >= end - 0.05 * (end - float(t[0]))), None)
    # where springs leave a cart tells its friction, so its rest stays in; where a disk stopped says no more
    if disks and last is not None and last[0] > start + 0.1 * (end - float(t[0])):
        return start, min(end, last[0] + 0.5)
    return start, end


def _law(record: Record, drive: Column, reference: Column, body: Column, coordinate: str) -> tuple[str, str]:
    """The law that made the command, as a study writes it ("" for none), and the sentence that says so."""
    from upright.closed_loop import recover
    from upright.closed_loop.recovery import loop_written

    try:
        law = recover(record, measured=[body.name], references=[reference.name], command=drive.name)
    except UprightError as error:
        return "", f"No law was found in '{drive.name}' ({error}); the command as recorded drives the bodies."
    text = loop_written(law).replace(f"COORDINATE OF {body.name}", coordinate)
    if law.quality not in ("exact", "rounding") or not text:
        return "", (
            f"'{drive.name}' follows from '{reference.name}' and '{body.name}' only to {law.explained:.0f} %: the"
            " command as recorded drives the bodies. If you know the law, write it as loop."
        )
    return text, f"A loop was closed: '{drive.name}' is {law.structure}; it is simulated with the bodies."
