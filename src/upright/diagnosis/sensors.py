"""Sensors that are dead, frozen, wrapping, losing counts, spiking or at their limit.

A body with inertia cannot jump, and it cannot stop within a sample.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from upright.diagnosis.case import Case, column_unit, tells_speed, tells_time
from upright.diagnosis.findings import Finding
from upright.quantities import two_figures
from upright.readers.inspection import Column
from upright.records import Array, Record
from upright.signals.spikes import REACH, Jumps, jumps
from upright.signals.stretches import stretches


def examine_sensors(case: Case) -> tuple[list[Finding], Record | None]:
    """Findings about each sensor, and the record with wraps, jumps and spikes taken out when there are any."""
    findings: list[Finding] = [*_dead(case)]
    mended: dict[str, Array] = {}
    for column in case.measured:
        if column.constant:
            continue
        x = case.record[column.name]
        jumped = jumps(case.record.t, x, column.resolution.step, case.moduli.get(column.name, ()))
        if tells_speed(column):
            jumped = replace(jumped, steps=jumped.steps[:0], step_sizes=jumped.step_sizes[:0])
        findings += _jumped(case, column, x, jumped)
        if jumped:
            mended[column.name] = jumped.mended(x)
        findings += _frozen(case, column, mended.get(column.name, x))
        findings += _limited(case, column, x)
    record = case.record.replace(signals={**case.record.signals, **mended}) if mended else None
    return findings, record


def _dead(case: Case) -> Iterator[Finding]:
    """Sensors that never move, although the rig was driven or something else moved."""
    others = [c for c in case.measured if not c.constant]
    named = {p.column: n for n, p in case.places.items()}
    for c in case.inspection.columns:
        if not c.constant or c.drive or tells_time(c) or named.get(c.name, "") in case.locked != ():
            continue
        sure = c.name in named and (case.driven or bool(others))
        if not sure and (not others or c.name not in named):
            continue
        why = "the effort acts" if case.driven else f"'{others[0].name}' moves" if others else ""
        yield Finding(
            kind="dead",
            columns=(c.name,),
            severity="fault" if sure else "note",
            sentence=f"'{c.name}' reads {c.low:g} from the first to the last sample"
            + (f" although {why}: the sensor is dead, or the body was clamped." if sure else "."),
            evidence={
                "samples [1]": float(case.inspection.time.samples),
                f"value [{column_unit(c) or '1'}]": c.low,
            },
            advice="Check plug and cable; if the body was clamped, say so." if sure else "Leave it out.",
            key=f"locked = [\"{named[c.name]}\"]" if c.name in named else "",
            panels=case.over_time(*(o.name for o in others[:1]), c.name),
        )  # fmt: skip


def _jumped(case: Case, c: Column, x: Array, jumped: Jumps) -> Iterator[Finding]:
    t, unit = case.record.t, column_unit(c) or "1"
    if jumped.wraps.size:
        yield Finding(
            kind="wrap",
            columns=(c.name,),
            severity="warning",
            sentence=f"'{c.name}' wraps {jumped.wraps.size} time{'s' if jumped.wraps.size > 1 else ''}: its counter"
            f" jumps by {jumped.modulus:.6g} {unit} (first at {t[jumped.wraps[0]]:.5g} s) while the body goes on.",
            evidence={f"turn [{unit}]": jumped.modulus, "wraps [1]": float(jumped.wraps.size)},
            advice="Counters of 8, 16 or 32 bits are counted on when a log is read, angles in rad when a study is; "
            "unwrap other columns before that.",
            key=f'[sensors.{case.coordinate(c.name)}]\nunit = "rad"' if unit == "rad" else "",
            panels=(*case.over_time(c.name), case.near(c.name, int(jumped.wraps[0]))),
            marks=tuple(float(t[i]) for i in jumped.wraps[:20]),
        )
    if jumped.steps.size:
        largest = int(np.argmax(np.abs(jumped.step_sizes)))
        many = jumped.steps.size
        yield Finding(
            kind="jump",
            columns=(c.name,),
            severity="fault",
            sentence=f"'{c.name}' jumps by {jumped.step_sizes[largest]:.5g} {unit} between two samples at"
            f" {t[jumped.steps[largest]]:.5g} s and stays there"
            + (f" ({many} such jumps)" if many > 1 else "")
            + ": counts were lost, or the sensor slipped.",
            evidence={f"jump [{unit}]": float(jumped.step_sizes[largest]), "jumps [1]": float(many)},
            advice="Use a window that ends before the jump or starts after it.",
            key=f'window = [{t[jumped.steps[largest]]:.6g}, "end"]',
            panels=(*case.over_time(c.name), case.near(c.name, int(jumped.steps[largest]))),
            marks=tuple(float(t[i]) for i in jumped.steps[:20]),
        )
    if jumped.spikes.size:
        largest = int(np.argmax(np.abs(jumped.spike_sizes)))
        many = jumped.spikes.size
        yield Finding(
            kind="spike",
            columns=(c.name,),
            severity="warning",
            sentence=f"'{c.name}' has {many} isolated outlier{'s' if many > 1 else ''}, the largest of"
            f" {jumped.spike_sizes[largest]:.4g} {unit} at {t[jumped.spikes[largest]]:.5g} s.",
            evidence={f"largest [{unit}]": float(jumped.spike_sizes[largest]), "spikes [1]": float(many)},
            advice="Replace these samples by their neighbours' mean before fitting.",
            panels=(*case.over_time(c.name), case.near(c.name, int(jumped.spikes[largest]))),
            marks=tuple(float(t[i]) for i in jumped.spikes[:20]),
        )


def _frozen(case: Case, c: Column, x: Array) -> Iterator[Finding]:
    at, sudden = frozen_from(x, c.resolution.step)
    if at < 0:
        return
    t = case.record.t
    others = [o.name for o in case.measured if o.name != c.name and np.ptp(case.record[o.name][at:]) > 0]
    yield Finding(
        kind="stuck",
        columns=(c.name,),
        severity="fault",
        sentence=f"'{c.name}' freezes at {x[at]:.6g} from {t[at]:.5g} s to the end: it stops within a sample,"
        f" {sudden:.2g} times as abruptly as at any time before.",
        evidence={"from [s]": float(t[at]), "abruptness [1]": sudden},
        advice="Use a window that ends before; check the cable, or whether the body hit a stop.",
        key=f'window = ["start", {t[at]:.6g}]',
        panels=(*case.over_time(c.name, *others[:1]), case.near(c.name, at)),
        marks=(float(t[at]),),
    )


FEW = 50
"""Steps of a sensor: a body that moves by fewer is held, and has reached no limit."""


def _limited(case: Case, c: Column, x: Array) -> Iterator[Finding]:
    if float(np.ptp(x)) < FEW * c.resolution.step or case.held(c):
        return
    low, high, share = clipped(x, c.resolution.step, inertia=True)
    if share < 0.005:
        return
    ends = " and ".join(f"{v:.5g}" for v in (low, high) if v == v)
    yield Finding(
        kind="saturation",
        columns=(c.name,),
        severity="warning",
        sentence=f"'{c.name}' is cut off at {ends} for {two_figures(100 * share)} % of the samples: the sensor reaches"
        " its limit, or the body a stop.",
        evidence={"share [%]": 100 * share},
        advice="Use a window without these spans.",
        panels=case.over_time(c.name),
    )


def frozen_from(x: Array, resolution: float) -> tuple[int, float]:
    """Sample from which a column never changes again after it stopped dead in full motion, and how sudden that was.

    The second number is the speed lost at once, beside the largest change of speed within as short a time before;
    the sample is -1 when the column does not end so.
    """
    changes = np.flatnonzero(np.diff(x))
    if changes.size < 4 * REACH:
        return -1, 0.0
    last = int(changes[-1]) + 1
    if x.size - last < max(8, 0.02 * x.size):
        return -1, 0.0
    w = 5
    slope = (x[w : last + 1] - x[: last + 1 - w]) / w
    before = float(np.abs(np.diff(x[last - w : last + 1])).mean())
    changed = np.abs(slope[w:] - slope[:-w])
    usual = max(float(np.percentile(changed, 99.5)), 0.5 * resolution) if changed.size else 0.0
    noise = float(np.median(np.abs(np.diff(x[: last + 1], n=2)))) / w
    sudden = abs(float(slope[-1])) / max(usual, noise, 1e-300)
    moving = before > 1.2 * resolution
    return (last, sudden) if moving and sudden > 0.9 else (-1, sudden)


def clipped(x: Array, resolution: float, *, inertia: bool) -> tuple[float, float, float]:
    """Lowest and highest value of a column if it is cut off there, else nan, and the share of samples cut off.

    A signal that turns by itself slows down before its extreme and leaves it slowly; one that is cut off comes or
    leaves at the pace it has before or after, and what has `inertia` does both.
    """
    share, ends = 0.0, [math.nan, math.nan]
    if np.unique(x[:: max(x.size // 5000, 1)]).size < 12:
        return ends[0], ends[1], share
    for k, level in enumerate((float(x.min()), float(x.max()))):
        if not inertia and abs(level) < 0.8 * float(np.abs(x).max()):
            continue  # a drive's limits are alike; this one only paused there
        at = x == level
        first, after = np.array(stretches(at)).T + np.array([[0], [1]])
        inside = (first > 6) & (after < x.size - 7)
        if not inertia:  # an effort may begin or end at its limit
            inside |= (first == 0) | (after == x.size)
        long = (after - first >= 3) & inside
        if not long.any():
            continue
        first, after = first[long], after[long]
        entered, left = _abrupt(x, first, -1, resolution), _abrupt(x, after - 1, 1, resolution)
        hard = entered & left if inertia else entered | left
        if hard.any():
            ends[k] = level
            share += float((after - first)[hard].sum()) / x.size
    return ends[0], ends[1], share


def _abrupt(x: Array, at: NDArray[np.int64], way: int, resolution: float) -> NDArray[np.bool_]:
    """Whether a column leaves its value at samples `at`, going `way`, at the pace it has a few samples on."""
    place = np.clip(at, 6, None) if way < 0 else np.clip(at, None, x.size - 7)
    near = np.abs(x[place + 2 * way] - x[place]) / 2
    far = np.abs(x[place + 6 * way] - x[place + 4 * way]) / 2
    return (at == place) & (near > 1.25 * resolution) & (near > 0.5 * far) & (near < 3 * far)
