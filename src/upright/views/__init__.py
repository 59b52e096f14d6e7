"""How a value looks at a prompt, in a notebook and as a picture: records, plants, linear models and gains."""

from __future__ import annotations

from dataclasses import MISSING, fields, replace
from functools import singledispatch
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput, nearest
from upright.physics import Plant
from upright.records import Record
from upright.report.drawing import (
    BLUE,
    CYCLE,
    GREY,
    VERMILLION,
    decimated,
    figure,
    hide_inner_times,
    roots,
    s_plane,
    styled,
)
from upright.report.html import fragment
from upright.report.page import Chapter, Part, Picture, Symbol, Table
from upright.report.rig import rig_table
from upright.report.symbols import number, unit
from upright.rig import Rig
from upright.systems import StateSpace
from upright.verbs.answer import as_text as chapter_text
from upright.verbs.linear.feedback import Gains

MOST_ROWS, MOST_PANELS = 24, 6


@singledispatch
def summary(value: Any) -> Chapter:
    """A value as a headline, a table and, where one helps, a picture."""
    raise TypeError(f"{type(value).__name__} has no view")


def text(value: Any) -> str:
    """What a prompt shows."""
    page = summary(value)
    headline = " ".join(filter(None, (f"{page.title}.", page.verdict, page.detail)))
    return chapter_text(replace(page, title=headline, verdict="", detail=""))


def html(value: Any) -> str:
    """What a notebook shows."""
    return fragment(summary(value))


def plot(value: Any, *names: str) -> Any:
    """Matplotlib figure of a value; `names` choose the columns of a record.

    Raises
    ------
    BadInput
        When a name is no column.
    """
    if isinstance(value, Record):
        return draw_record(value, *names)
    return draw_poles(value)


@summary.register
def _(record: Record) -> Chapter:
    t = record.t
    role = dict.fromkeys(record.inputs, "drives") | dict.fromkeys(record.outputs, "measured")
    rows = tuple(
        (name, unit(record.units[name]) or ("–" if record.units[name] else "not specified"), role.get(name, ""),
         number(float(values.min())), number(float(values.max())))
        for name, values in list(record.signals.items())[:MOST_ROWS]
    )  # fmt: skip
    left = len(record.signals) - len(rows)
    table = Table(
        caption="Columns" + (f" (the first {len(rows)} of {len(record.signals)})" if left else ""),
        headings=("column", "unit", "role", "least", "greatest"), rows=rows, numbers=(3, 4),
    )  # fmt: skip
    drawn = Picture(name="columns", draw=lambda: draw_record(record, buckets=100), caption="The columns over time.",
                    description=f"{len(record.signals)} columns over {t[-1] - t[0]:.4g} s.")  # fmt: skip
    source = record.provenance.file or record.provenance.rig or "no file"
    headline = f"{len(record)} samples from {t[0]:.4g} to {t[-1]:.4g} s, one every {1e3 * record.period:.4g} ms."
    return Chapter(title=f"Record ({source})", verdict=headline, parts=(Part("", (table, drawn)),))


@summary.register
def _(plant: Plant) -> Chapter:
    needed = {f.name for f in fields(plant) if f.default is MISSING}  # type: ignore[arg-type]
    rows = tuple(
        (Symbol(name), number(value, 6), unit(plant.quantity(name).unit), plant.quantity(name).meaning)
        for name, value in plant.parameters().items()
        if value != 0 or name in needed
    )
    table = Table(
        caption="Parameters; those not listed are zero", headings=("symbol", "value", "unit", "meaning"), rows=rows,
        numbers=(1,),
    )  # fmt: skip
    moves = ", ".join(f"{c.name} [{c.unit}]" for c in plant.coordinates)
    driven = ", ".join(f"{i.name} [{i.unit}]" for i in plant.inputs) or "nothing"
    return Chapter(
        title=type(plant).__name__, parts=(Part("", (table,)),),
        verdict=f"Moves in {moves}; driven by {driven}; equilibria: {', '.join(plant.equilibria)}.",
    )  # fmt: skip


@summary.register
def _(rig: Rig) -> Chapter:
    plant = summary(rig.plant)
    force = rig.plant.inputs[0].unit if rig.plant.inputs else ""
    per = force if rig.unit == "1" else f"{force}/{rig.unit}" if force and rig.unit else ""
    allowed = f"; {len(rig.draws)} rigs drawn from its covariance" if rig.draws else ""
    return Chapter(
        title=rig.name, parts=(*plant.parts, Part("", (rig_table(rig),))),
        verdict=f"{type(rig.plant).__name__} behind a drive of {number(rig.gain)} {unit(per)}".rstrip() + f"{allowed}.",
        detail=rig.basis.sentence,
    )  # fmt: skip


@summary.register
def _(model: StateSpace) -> Chapter:
    rows = tuple(
        (f"{state}'" if model.dt is None else f"{state}[k+1]", *(number(x, 5) for x in (*a, *b)))
        for state, a, b in zip(model.states, model.A.tolist(), model.B.tolist(), strict=True)
    )
    headings = ("", *model.states, *model.inputs)
    form = "x' = A x + B u" if model.dt is None else "x[k+1] = A x[k] + B u[k]"
    table = Table(caption=form, headings=headings, rows=rows, numbers=tuple(range(1, len(headings))))
    point = ", ".join(f"{name} = {value:.4g}" for name, value in (model.point or {}).items())
    kind = "Linear model" if model.dt is None else f"Linear model sampled every {1e3 * model.dt:.4g} ms"
    return Chapter(
        title=f"{kind} about {point}" if point else kind,
        verdict=f"Poles [{'1/s' if model.dt is None else 'z'}]: {_poles(model.poles())}.", parts=(Part("", (table,)),),
    )  # fmt: skip


@summary.register
def _(gains: Gains) -> Chapter:
    rows = tuple((name, *(number(k, 6) for k in row)) for name, row in zip(gains.inputs, gains.K.tolist(), strict=True))
    table = Table(
        caption="u = -K x", headings=("K", *gains.states), rows=rows, numbers=tuple(range(1, 1 + len(gains.states)))
    )  # fmt: skip
    of = "z" if gains.period else "1/s"
    return Chapter(
        title="State feedback", verdict=f"Poles of the loop [{of}]: {_poles(gains.poles)}.", detail=gains.sentence,
        parts=(Part("", (table,)),),
    )  # fmt: skip


def _poles(poles: Any) -> str:
    shown: list[str] = []
    for p in np.asarray(poles, dtype=np.complex128).tolist():
        if abs(p.imag) < 1e-9 * max(abs(p), 1e-300):
            shown.append(number(p.real))
        elif p.imag > 0:
            shown.append(f"{number(p.real)} ± {number(p.imag)}j")
    return ", ".join(shown)


def animate(record: Record, *, plant: Any, speed: float, frames: int) -> Any:
    """The rig as it moved; see `Record.animate`."""
    from upright.views.animation import animated as drawn

    return drawn(record, plant=plant, speed=speed, frames=frames)


def moving_page(record: Record, rig: Any, out: Any) -> Any:
    """A page in which the rig moves as it did; see `Record.play`."""
    from upright.basis import SIMULATED
    from upright.verbs.control.moving import played_record
    from upright.verbs.handover import rig_of

    if rig is None and record.plant is None:
        raise BadInput("play needs what moved, with its numbers: run.play(rig), where rig is a plant, a rig or a fit.")
    plant = record.plant if rig is None else rig_of(rig, "play", draws=0).plant
    source = record.provenance
    label = Path(source.file).stem if source.file else source.rig or "run"
    return played_record(record, plant, label, SIMULATED if source.simulated else "", out)


@styled
def draw_record(record: Record, *names: str, buckets: int = 800) -> Any:
    """One panel per column over time; without names the measured ones and what drives, as far as they are known."""
    for name in names:
        if name not in record.signals:
            raise BadInput(f"the record has no column '{name}'; {nearest(name, record.signals)}")
    chosen = names or (*record.outputs, *record.inputs) or record.names
    chosen = tuple(n for n in chosen if names or np.ptp(record[n]) > 0)[:MOST_PANELS] or chosen[:1]
    drawing = figure(0.7 + 1.2 * len(chosen))
    panels: list[Any] = drawing.subplots(len(chosen), 1, sharex=True, squeeze=False)[:, 0].tolist()
    for i, (axes, name) in enumerate(zip(panels, chosen, strict=True)):
        t, y = decimated(record.t, record[name], buckets=buckets)
        axes.plot(t, y, color=CYCLE[i % len(CYCLE)][0], linewidth=1.0)
        axes.set_ylabel(f"{name} [{record.units[name] or '?'}]", parse_math=False)
    hide_inner_times(panels)
    drawing.align_ylabels(panels)
    return drawing


@styled
def draw_poles(value: Any) -> Any:
    """Poles of a linear model, of a loop, or of a plant at each of its equilibria."""
    if isinstance(value, Plant | Rig):
        points = value.equilibria if isinstance(value, Plant) else value.plant.equilibria
        drawn = {f"about {at}": value.linear(at).poles() for at in points}
    else:
        drawn = {"poles": value.poles() if isinstance(value, StateSpace) else value.poles}
    drawing = figure(2.6)
    axes = drawing.subplots()
    if (isinstance(value, StateSpace) and value.dt) or (isinstance(value, Gains) and value.period):
        turn = np.linspace(0.0, 2 * np.pi, 181)
        axes.plot(np.cos(turn), np.sin(turn), color=GREY, linewidth=0.8)  # inside it motions decay
        axes.set_aspect("equal")
        axes.set_xlabel("real part of z")
        axes.set_ylabel("imaginary part of z")
    else:
        most = max(float(p.real.max()) for p in drawn.values())
        s_plane(axes, unstable=max(0.0, 1.2 * most))
        axes.set_ylabel("imaginary part [1/s]")
    for (name, poles), (mark, colour) in zip(
        drawn.items(), (("x", BLUE), ("o", VERMILLION), ("s", BLUE)), strict=False
    ):
        roots(axes, poles, mark, colour, name)
    if len(drawn) > 1:  # the mark in the legend of one series would look like a pole
        axes.legend()
    return drawing
