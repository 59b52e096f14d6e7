"""Which sensor is dead, frozen, wrapping, losing counts, spiking or at its limit?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from upright.doctor.case import Case, about_time
from upright.doctor.channels import Jumps, clipped, frozen_from, jumps
from upright.doctor.findings import Curve, Finding, Panel
from upright.readers.inspection import Column
from upright.records import Array, Record


def examine_sensors(case: Case) -> tuple[list[Finding], Record | None]:
    """Findings about each sensor, and the record with wraps, jumps and spikes taken out when there are any."""
    found: list[Finding] = [*_dead(case)]
    mended: dict[str, Array] = {}
    for column in case.measured:
        if column.constant:
            continue
        x = case.record[column.name]
        seen = jumps(case.record.t, x, column.quantum.step, case.moduli.get(column.name, ()))
        found += _jumped(case, column, x, seen)
        if seen.wraps.size or seen.steps.size or seen.spikes.size:
            mended[column.name] = mend(x, seen)
        found += _frozen(case, column, mended.get(column.name, x))
        found += _limited(case, column, x)
    record = case.record.replace(signals={**case.record.signals, **mended}) if mended else None
    return found, record


def mend(x: Array, seen: Jumps) -> Array:
    """Column (N,) without wraps, lost counts and spikes."""
    out = x.copy()
    for i, size in zip(seen.steps.tolist(), seen.step_sizes.tolist(), strict=True):
        out[i:] -= size
    for i in seen.wraps.tolist():
        out[i:] -= seen.modulus * np.sign(x[i] - x[i - 1])
    for i in seen.spikes.tolist():
        out[i] = (out[i - 1] + out[min(i + 1, x.size - 1)]) / 2
    return out


def key_of(case: Case, column: str, line: str) -> str:
    """Lines of a study that say something about the sensor on a column."""
    name = next((n for n, p in case.places.items() if p.column == column), "COORDINATE")
    return f"[sensors.{name}]\n{line}"


def around(case: Case, column: Column, i: int, reach: int = 40) -> Panel:
    """The readings of a column near sample `i`."""
    near = slice(max(i - reach, 0), i + reach)
    unit = column.unit or column.guess
    curve = Curve(name=column.name, t=case.record.t[near], y=case.record[column.name][near], style="points")
    return Panel(label=f"{column.name} [{unit}]" if unit else column.name, curves=(curve,))


def whole(case: Case, *names: str) -> tuple[Panel, ...]:
    """Columns over the whole record."""
    panels: list[Panel] = []
    for name in names:
        if name not in case.record.signals:
            continue
        c = case.seen.column(name)
        unit = c.unit or c.guess
        curve = Curve(name=name, t=case.record.t, y=case.record[name], style="steps" if c.stepwise else "line")
        panels.append(Panel(label=f"{name} [{unit}]" if unit else name, curves=(curve,)))
    return tuple(panels)


def _dead(case: Case) -> list[Finding]:
    """Sensors that never move, although the rig was driven or something else moved."""
    others = [c for c in case.measured if not c.constant]
    found: list[Finding] = []
    named = {p.column: n for n, p in case.places.items()}
    for c in case.seen.columns:
        if not c.constant or c.drive or about_time(c) or named.get(c.name, "") in case.locked != ():
            continue
        sure = c.name in named and (case.driven or bool(others))
        if not sure and (not others or c.name not in named):
            continue
        why = "the effort acts" if case.driven else f"'{others[0].name}' moves" if others else ""
        found.append(
            Finding(
                kind="dead",
                columns=(c.name,),
                severity="fault" if sure else "note",
                sentence=f"'{c.name}' reads {c.low:g} from the first to the last sample"
                + (f" although {why}: the sensor is dead, or the body was clamped." if sure else "."),
                evidence={"samples [1]": float(case.seen.time.samples), "value [1]": c.low},
                advice="Check plug and cable; if the body was clamped, say so." if sure else "Leave it out.",
                key=f"locked = [\"{named[c.name]}\"]" if c.name in named else "",
                panels=whole(case, *(o.name for o in others[:1]), c.name),
            )
        )  # fmt: skip
    return found


def _jumped(case: Case, c: Column, x: Array, seen: Jumps) -> list[Finding]:
    t, unit = case.record.t, c.unit or c.guess or "1"
    found: list[Finding] = []
    if seen.wraps.size:
        found.append(
            Finding(
                kind="wrap",
                columns=(c.name,),
                severity="warning",
                sentence=f"'{c.name}' wraps {seen.wraps.size} time{'s' if seen.wraps.size > 1 else ''}: its counter"
                f" jumps by {seen.modulus:.6g} {unit} (first at {t[seen.wraps[0]]:.5g} s) while the body goes on.",
                evidence={f"turn [{unit}]": seen.modulus, "wraps [1]": float(seen.wraps.size)},
                advice="Angles in rad are unwrapped when a study is read; unwrap counts before that.",
                key=key_of(case, c.name, 'unit = "rad"') if unit == "rad" else "",
                panels=(*whole(case, c.name), around(case, c, int(seen.wraps[0]))),
                marks=tuple(float(t[i]) for i in seen.wraps[:20]),
            )
        )
    if seen.steps.size:
        largest = int(np.argmax(np.abs(seen.step_sizes)))
        many = seen.steps.size
        found.append(
            Finding(
                kind="jump",
                columns=(c.name,),
                severity="fault",
                sentence=f"'{c.name}' jumps by {seen.step_sizes[largest]:.5g} {unit} between two samples at"
                f" {t[seen.steps[largest]]:.5g} s and stays there"
                + (f" ({many} such jumps)" if many > 1 else "")
                + ": counts were lost, or the sensor slipped.",
                evidence={f"jump [{unit}]": float(seen.step_sizes[largest]), "jumps [1]": float(many)},
                advice="Use a window that ends before the jump or starts after it.",
                key=f'window = [{t[seen.steps[largest]]:.6g}, "end"]',
                panels=(*whole(case, c.name), around(case, c, int(seen.steps[largest]))),
                marks=tuple(float(t[i]) for i in seen.steps[:20]),
            )
        )
    if seen.spikes.size:
        largest = int(np.argmax(np.abs(seen.spike_sizes)))
        many = seen.spikes.size
        found.append(
            Finding(
                kind="spike",
                columns=(c.name,),
                severity="warning",
                sentence=f"'{c.name}' has {many} isolated outlier{'s' if many > 1 else ''}, the largest of"
                f" {seen.spike_sizes[largest]:.4g} {unit} at {t[seen.spikes[largest]]:.5g} s.",
                evidence={f"largest [{unit}]": float(seen.spike_sizes[largest]), "spikes [1]": float(many)},
                advice="Replace these samples by their neighbours' mean before fitting.",
                panels=(*whole(case, c.name), around(case, c, int(seen.spikes[largest]))),
                marks=tuple(float(t[i]) for i in seen.spikes[:20]),
            )
        )
    return found


def _frozen(case: Case, c: Column, x: Array) -> list[Finding]:
    at, sudden = frozen_from(x, c.quantum.step)
    if at < 0:
        return []
    t = case.record.t
    others = [o.name for o in case.measured if o.name != c.name and np.ptp(case.record[o.name][at:]) > 0]
    return [
        Finding(
            kind="stuck",
            columns=(c.name,),
            severity="fault",
            sentence=f"'{c.name}' freezes at {x[at]:.6g} from {t[at]:.5g} s to the end: it stops within a sample,"
            f" {sudden:.2g} times as abruptly as at any time before.",
            evidence={"from [s]": float(t[at]), "abruptness [1]": sudden},
            advice="Use a window that ends before; check the cable, or whether the body hit a stop.",
            key=f'window = ["start", {t[at]:.6g}]',
            panels=(*whole(case, c.name, *others[:1]), around(case, c, at)),
            marks=(float(t[at]),),
        )
    ]


def _limited(case: Case, c: Column, x: Array) -> list[Finding]:
    low, high, share = clipped(x, c.quantum.step, inertia=True)
    if share < 0.005:
        return []
    ends = " and ".join(f"{v:.5g}" for v in (low, high) if v == v)
    return [
        Finding(
            kind="saturation",
            columns=(c.name,),
            severity="warning",
            sentence=f"'{c.name}' is cut off at {ends} for {100 * share:.2g} % of the samples: the sensor reaches its"
            " limit, or the body a stop.",
            evidence={"share [%]": 100 * share},
            advice="Use a window without these spans.",
            panels=whole(case, c.name),
        )
    ]


def with_record(case: Case, record: Record) -> Case:
    """The same case about a mended record, places left as they are."""
    return replace(case, record=record)
