"""Tables of experiment 3: fit, gains, poles, step figures, and what friction leaves."""

from __future__ import annotations

import math

from upright.experiments.tracking_3.figures import in_reading_unit
from upright.experiments.tracking_3.laws import AT
from upright.experiments.tracking_3.run import Outcome, StepTrial, Tracking
from upright.gains.requests import written
from upright.report.page import Table
from upright.report.symbols import number, plain
from upright.report.symbols import unit as raised


def tried_laws(result: Tracking) -> tuple[Outcome, ...]:
    """All laws that were tried, state feedback first."""
    return (*result.sets, *(o for o in (result.summed, result.pd, result.stiff, result.far) if o is not None))


def percentage(value: float, digits: int = 1) -> str:
    """A share as a percentage."""
    if not math.isfinite(value):
        return "–"
    text = f"{round(100 * value, digits) + 0.0:.{digits}f} %"  # + 0.0: no minus before a zero
    return text.replace("-", "−")


def milli(value: float) -> str:
    """Seconds to the millisecond."""
    return f"{value:.3f}" if math.isfinite(value) else "never"


def length(result: Tracking, value: float, digits: int = 3) -> str:
    """A length or an angle as it is read best."""
    factor, unit = in_reading_unit(result.rig.plant.coordinates[-1].unit)
    return f"{number(factor * value, digits)} {unit}"


def gain_table(result: Tracking) -> Table:
    """Gains, prefilter, and what the loop is by them."""
    of, command = result.rig.plant.coordinates[-1].unit, result.rig.unit
    names = [plain(n) for n in result.rig.plant.state_names()]
    rows = tuple(
        (o.law.name, *(number(k, 4) for k in o.law.K), number(o.law.k_pf, 4), number(o.law.stiffness, 4),
         number(o.law.decay, 3), number(o.law.damping, 2))
        for o in tried_laws(result)
    )  # fmt: skip
    force = f"{'N m' if of == 'rad' else 'N'}/{of}"
    return Table(
        caption=f"Gains of u = k_pf r − K x on positions [{command}/{of}] and speeds [{command} s/{of}]; static force "
        f"per error [{raised(force)}]; decay of the slowest pole [1/s] and least damping ratio of the loop as it runs",
        headings=("law", *(f"K {n}" for n in names), "k_pf", "static force", "decay", "damping"), rows=rows,
        numbers=tuple(range(1, len(names) + 5)),
    )  # fmt: skip


def shaft_pole_table(result: Tracking) -> Table:
    """Requested poles, and those of the loop as it runs on the fitted rig."""
    rows = [("open loop", "", written(result.model.linear(AT).poles(), 4))]
    rows += [
        (o.law.name, written(o.law.requested, 5) if o.law.requested.size else "–", written(o.law.poles, 4))
        for o in tried_laws(result)
    ]
    return Table(
        caption="Poles [1/s]: requested, and of the loop with held, late commands and filtered differences, "
        "those left out that die within three samples",
        headings=("law", "requested", "as it runs, on the fitted model"), rows=tuple(rows),
    )  # fmt: skip


def step_table(result: Tracking) -> Table:
    """Step figures, predicted on the fitted model and measured on the rig."""
    rows: list[tuple[str, ...]] = []
    for o in tried_laws(result):
        both = (("predicted", o.predicted), ("measured", o.measured))[: 1 + result.tried]
        rows += [(o.law.name if what == both[0][0] else "", what, *_figures(run)) for what, run in both]
    return Table(
        caption=f"A step of {length(result, result.step.size)} of the far body: rise 10 to 90 %, overshoot, time of "
        "the peak, settling about its own rest, arrival within 5 % of the reference [s]; largest command and share of "
        "the samples at the limit",
        headings=("law", "", "rise", "overshoot", "peak", "5 %", "2 %", "arrival", "effort", "of the limit",
                  "saturated"), rows=tuple(rows), numbers=tuple(range(2, 11)),
    )  # fmt: skip


def _figures(run: StepTrial) -> tuple[str, ...]:
    effort = (number(run.effort.peak, 3), percentage(run.effort.share), percentage(run.effort.saturated, 2))
    f = run.figures
    if f is None:
        text = f"trips at {run.tripped:.2f} s" if math.isfinite(run.tripped) else "does not move"
        return (text, *("–",) * 5, *effort)
    return (
        milli(f.rise), percentage(f.overshoot), milli(f.peak_time), milli(f.settling_5), milli(f.settling_2),
        milli(f.arrival), *effort,
    )  # fmt: skip


def friction_table(result: Tracking) -> Table:
    """What dry friction leaves at rest, and how far a steady push moves the far body."""
    size = result.step.size
    columns = ("predicted", "measured")[: 1 + result.tried]
    rows: list[tuple[str, ...]] = []
    for o in tried_laws(result):
        runs = (o.predicted, o.measured)[: len(columns)]
        if any(r.figures is None for r in runs):
            continue
        bound, steady = (
            ("0 (sum)", "0 (sum)") if o.law.play == 0
            else (percentage(o.law.play / size), percentage(abs(result.push) / o.law.k_pf / size))
        )  # fmt: skip
        left, moved = [_left(r, size) for r in runs], [percentage(r.give / size) for r in runs]
        rows.append((o.law.name, bound, *left, steady, *moved))
    return Table(
        caption="Left at rest by dry friction, and moved by a steady push of the drive "
        f"({number(abs(result.push), 2)} {result.rig.unit}), in shares of the step, beside the bound and the value "
        "without friction",
        headings=("law", "error, at most", *columns, "push, no friction", *columns), rows=tuple(rows),
        numbers=tuple(range(1, 3 + 2 * len(columns))),
    )  # fmt: skip


def _left(run: StepTrial, size: float) -> str:
    if run.figures is None or not math.isfinite(run.figures.settling_2):
        return "still swings"
    return percentage(run.figures.error / size)
