"""A design as a chapter: the numbers and charts that its words in `chapter.md` print, and what programs read."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from upright.basis import NOT_TRUSTED
from upright.control.effort import shown
from upright.designing.run import Designed, Holding
from upright.gains.loop import response
from upright.gains.lqr import locus
from upright.gains.requests import Roots, written
from upright.laws import as_values
from upright.records import Array
from upright.report.interactive.charts import Chart, ChartLine, ChartPanel
from upright.report.page import Chapter, resting_on
from upright.report.planes import Poles, locus_chart, loop_chart, pole_chart
from upright.report.prose import chapter_of
from upright.report.rig import rig_drawing, rig_table
from upright.report.symbols import plain
from upright.report.symbols import unit as raised
from upright.rig.completion import doubts
from upright.systems import StateSpace, to_s


def chapter(design: Designed, *, source: str = "OUT/fit.json", folder: str = ".") -> Chapter:
    """What a design says; fit or study and the folder of its files are named as they were typed."""
    matrices, kinds, on = isinstance(design.rig, StateSpace), _kinds(design), design.request.on
    page = chapter_of(
        __name__, design=design, source=source, folder=folder, matrices=matrices, kinds=kinds,
        discrete=design.model.dt is not None, not_trusted=design.basis.level == NOT_TRUSTED,
        delay_from=_delay_from(design), poles=written, lasting=_lasting, per=_per, rest=_at_rest_in_words(design),
        dead_zone=0.0 if on is None else on.more.get("actuator.dead_zone", 0.0), tau=math.tau,
        figures={
            "poles": pole_chart(kinds, design.cloud, cloud_of="loop, rigs that the fit allows"),
            "locus": _locus(design), "loop": _loop(design), "swing": _recovery(design),
        },
        placed={"rig": (rig_table(on),) if on else ()},
    )  # fmt: skip
    page = replace(
        page, sound=design.chosen.margins is not None and "reservations" not in page.verdict,
        warnings=_doubts(design), numbers=_numbers(design),
        drawing=None if isinstance(design.rig, StateSpace) else rig_drawing(design.rig.plant),
    )  # fmt: skip
    return resting_on(page, design.basis)


def _delay_from(design: Designed) -> str:
    """Who says how late a command acts."""
    if design.request.delay is not None:
        return "as requested"
    if isinstance(design.rig, StateSpace):
        return "besides what the matrices hold" if design.rig.dt else "assumed"
    return "as the file says" if design.rig.delay else "assumed"


def _doubts(design: Designed) -> tuple[str, ...]:
    """What the rig's description leaves out, and which number stands for it."""
    if isinstance(design.rig, StateSpace):
        left = "dry friction, steps of encoders" + (
            "" if design.request.limit else ", the largest command of the drive"
        )
        return (f"Plain matrices say nothing of a rig: {left} are in none of these numbers.",)
    stated = doubts(design.rig, design.request.on) if design.request.on else ()
    if design.request.limit is not None:
        return stated
    return (
        *stated,
        "The drive's limit is not specified, so saturation is not predicted: --limit 10, or "
        '[actuator] limit = "10 V" in the study.',
    )


def _drawn(design: Designed, poles: Roots) -> Roots:
    """Poles that a picture has room for: of sampled matrices those whose motion outlasts a few samples."""
    return poles[poles.real > -3.0 / design.request.period] if design.model.dt is not None else poles


def _lasting(design: Designed, poles: Roots, digits: int) -> str:
    """Poles, of a loop or of samples those whose motion outlasts a few samples, and how many die out at once."""
    slow = poles[poles.real > -3.0 / design.request.period]
    beyond = poles.size - slow.size
    return ", and ".join(filter(None, (written(slow, digits), f"{beyond} faster" if beyond else "")))


def _per(command: str, unit: str) -> str:
    if unit == "1":
        return command
    command = f"({command})" if "/" in command else command
    below = f"({unit})" if "/" in unit else unit
    return raised(f"{command} s/{unit.removesuffix('/s')}" if unit.endswith("/s") else f"{command}/{below}")


def _numbers(design: Designed) -> dict[str, Any]:
    """Content of `design.json`: numbers in SI and the command's unit."""
    request, way = design.request, design.chosen
    return {
        "plant": design.rig.name,
        "at": request.at,
        "states": list(design.model.states),
        "command_unit": design.rig.unit,
        "limit": request.limit,
        "described": None if request.on is None else request.on.hardware.plain(),
        "period": request.period,
        "delay_samples": design.sampled.delay,
        "delay_from": _delay_from(design),
        "K": design.K[0],
        "K_sampled": None if design.sampled_gains is None else design.sampled_gains[0],
        "k_pf": design.k_pf,
        "effort_weight": design.R,
        "poles": {
            "open_loop": design.open_loop,
            "asked": None if design.placement is None else design.placement.requested,
            "attained": None if design.placement is None else design.placement.attained,
            "sampled_loop": design.poles,
        },
        "worst_miss": None if design.placement is None else design.placement.miss,
        "condition": None if design.placement is None else design.placement.condition,
        "margins": way.margins,
        "lag": design.sampled.lag,
        "peak_command": design.peak,
        "peak_command_sampled": design.peak_sampled,
        "chance_over_the_fit": None if design.chance is None else design.basis.supported(design.chance),
        "at_rest": None if design.holding is None else _at_rest(design.holding),
        "readings": _readings(design),
        "states_from": design.chosen.name,
        "command": design.rig.inputs[0] if isinstance(design.rig, StateSpace) else "u",
        "converter": 0.0 if request.on is None else request.on.converter,
        "law": as_values(design.law),
        "verdict": design.verdict,
    }


def _at_rest(held: Holding) -> dict[str, Any]:
    """Command at rest, as shares of the limit; a limit cycle in SI."""
    effort = held.effort
    return {"quiet": effort.quiet, "rms": effort.rms, "peak": effort.peak, "cycle": effort.command, "lost": held.lost}


def _readings(design: Designed) -> list[dict[str, Any]]:
    """What the law reads, one by one: encoder's step and sign as described."""
    rig, on = design.rig, design.request.on
    steps = dict(zip(rig.outputs, design.request.resolution or (), strict=False))
    return [
        {
            "name": name,
            "unit": unit,
            "step": steps.get(name, 0.0),
            "sign": 1.0 if on is None else on.hardware.value(f"sign.{name}", 1.0),
        }
        for name, unit in zip(rig.outputs, rig.output_units, strict=True)
    ]


def _at_rest_in_words(design: Designed) -> str:
    """The simulated command at rest; nothing where none was simulated, or where the rig was lost."""
    holding = design.holding
    if holding is None or math.isfinite(holding.lost):
        return ""
    return shown(holding.effort, design.request.limit or math.inf, design.rig.unit)


def _kinds(design: Designed) -> list[Poles]:
    """Poles as the s-plane marks them."""
    aim = "requested" if design.placement else "LQR"
    return [
        Poles(name="model, open loop", values=_drawn(design, design.open_loop), mark="x"),
        Poles(name=aim, values=_drawn(design, design.wanted), mark="o", colour="q0"),
        Poles(name="loop as it runs", values=_drawn(design, design.poles), mark="+", colour="q1"),
    ]


def _locus(design: Designed) -> Chart | None:
    """The LQR locus as the effort's weight varies, a hundredfold either way."""
    if design.R is None:
        return None
    weights = design.request.weights or (1.0,) * design.model.A.shape[0]
    discrete = design.model.dt is not None
    cheaper = design.R * np.geomspace(100, 0.01, 300)
    tracks = locus(design.model.A, design.model.B, weights, cheaper, sampled=discrete)
    tracks = to_s(tracks, design.request.period) if discrete else tracks
    chosen = {"chosen": _drawn(design, design.wanted)}
    return locus_chart(
        tracks, cheaper, chosen, _drawn(design, design.open_loop), of="LQR poles as effort gets cheaper", symbol="R"
    )


def _loop(design: Designed) -> Chart | None:
    """The loop gain with its margins; nothing where the loop falls."""
    m = design.chosen.margins
    return None if m is None else loop_chart(response(design.sampled, design.law), m, design.sampled.period)


def _recovery(design: Designed) -> Chart:
    t, y, u = design.swing
    limit = design.request.limit
    reach = 1.25 * max(limit or 0.0, float(np.abs(u).max()))
    panels = [
        _over(t, y[:, i], plain(name), unit, f"q{i % 4}")
        for i, (name, unit) in enumerate(zip(design.rig.outputs, design.rig.output_units, strict=True))
    ]
    command = replace(
        _over(t, u[:, 0], "command", design.rig.unit, "effort"),
        limits=None if limit is None else (-reach, reach),
        levels=() if limit is None else ((limit, "limit"), (-limit, "")),
    )
    return Chart(x="time", unit="s", panels=(*panels, command))


def _over(t: Array, values: Array, title: str, unit: str, colour: str) -> ChartPanel:
    return ChartPanel(title=title, unit=unit, height=100.0, lines=(ChartLine(name="", x=t, y=values, colour=colour),))
