"""A design as a chapter: gains, poles, the loop as it runs, and what they are worth."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from upright.basis import NOT_TRUSTED, in_percent
from upright.control.effort import shown
from upright.designing.run import Designed, Holding, VelocityLoop
from upright.gains.loop import response
from upright.gains.lqr import locus
from upright.gains.requests import Roots, written
from upright.laws import as_values
from upright.records import Array
from upright.report.interactive.charts import Chart, ChartLine, ChartPanel
from upright.report.page import Block, Chapter, Part, Picture, Points, Step, Table, resting_on
from upright.report.planes import Poles, locus_chart, loop_chart, pole_chart
from upright.report.rig import rig_drawing, rig_table
from upright.report.symbols import number, plain
from upright.report.symbols import unit as raised
from upright.rig import Rig
from upright.rig.completion import doubts
from upright.systems import StateSpace, to_s


def chapter(design: Designed, *, source: str = "OUT/fit.json", folder: str = ".") -> Chapter:
    """What a design says; fit or study and the folder of its files are named as they were typed."""
    poles = "with poles " if design.request.proposed is None else "with proposed poles "
    aim = poles + written(design.request.poles) if design.request.poles is not None else "by LQR"
    gains: list[str] = []
    if design.request.proposed is not None:
        gains.append(
            f"No poles were requested. These are proposed: {design.request.proposed:g} times as fast as the model "
            "falls or swings by itself, the quietest of those with nearly the largest modulus margin. Ask "
            "for others with --poles or --lqr."
        )
    if design.placement is not None:
        gains.append(f"Largest miss of a requested pole: {design.placement.miss:.1g} 1/s. {design.placement.sentence}")
    if design.R is not None:
        gains.append(f"Weight of the effort: {number(design.R)}.")
    sure: list[Block] = []
    if design.chance is not None:
        stable = design.basis.supported(in_percent(design.chance))
        what = "Share of the rigs sampled from the fit's covariance that these gains stabilise"
        sure.append(Points((f"{what}: {stable}.",)))
    plain_matrices = isinstance(design.rig, StateSpace)
    loop = (
        f"Period {1e3 * design.request.period:.4g} ms, command {design.sampled.delay:.3g} samples late "
        f"({_delay_from(design)}), drive's lag {1e3 * design.sampled.lag:.3g} ms, "
        f"{f'states by {design.chosen.name}' if plain_matrices else 'velocities made from rounded encoders'}."
        f"{_effort(design)}{_dead_zone(design)}"
    )
    what = f"{design.rig.name}, {design.request.at}".removesuffix(", ")
    held = "the model" if plain_matrices else f"the rig at '{design.request.at}'"
    trial = "sampling, delay and " + ("their way to the states" if plain_matrices else "differenced encoders")
    page = Chapter(
        title=f"Gains for {what}",
        verdict=design.verdict,
        sound=design.chosen.margins is not None and "reservations" not in design.verdict,
        question=f"Which gains hold {held} {aim}, and do they survive {trial}?",
        parts=(
            Part("Gains", (Points(tuple(gains)), _gain_table(design), _pole_table(design))),
            Part("Poles", (*sure, *_pole_pictures(design))),
            Part("The loop as it runs", (loop, *_loop_picture(design), _way_table(design))),
            Part("Coming back", (_swing_picture(design),)),
            *((Part("The rig", (rig_table(design.request.on),)),) if design.request.on else ()),
        ),
        steps=tuple(_next_steps(design, source, folder)),
        warnings=_doubts(design),
        numbers=_numbers(design),
    )
    page = resting_on(page, design.basis)
    return page if isinstance(design.rig, StateSpace) else replace(page, drawing=rig_drawing(design.rig.plant))


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


def _gain_table(design: Designed) -> Table:
    """The gains in force, and those that meet the poles in the sampled loop."""
    command = design.rig.unit or "1"
    sampled = design.sampled_gains
    rows = tuple(
        (plain(name), number(k, 5), *((number(sampled[0, i], 5),) if sampled is not None else ()), _per(command, unit))
        for i, (name, k, unit) in enumerate(
            zip(design.model.states, design.continuous[0], design.rig.state_units, strict=True)
        )
    )  # fmt: skip
    marks = ("", " (used)") if design.request.sampled else (" (used)", "")
    second = ("K, sampled" + marks[1],) if sampled is not None else ()
    headings = ("state", f"K, {_of_model(design)}" + marks[0], *second, "unit")
    caption = "Gains of u = −K x" + (f", prefilter k_pf = {number(design.k_pf)}" if design.k_pf is not None else "")
    return Table(caption=caption, headings=headings, rows=rows, numbers=tuple(range(1, len(headings) - 1)))


def _pole_table(design: Designed) -> Table:
    """Requested poles, those attained by the gains on the continuous model, and of the loop as it runs."""
    discrete = design.model.dt is not None
    rows = [("model, open loop", _outlasting(design, design.open_loop, 5) if discrete else written(design.open_loop))]
    if design.placement is not None:
        rows.append(("requested", written(design.placement.requested)))
        rows.append((f"attained, {_of_model(design)}", written(design.placement.attained)))
    else:
        least = _outlasting(design, design.wanted, 5) if discrete else written(design.wanted)
        rows.append((f"LQR, {_of_model(design)}", least))
    rows.append(("loop as it runs", _outlasting(design, design.poles, 4)))
    return Table(caption="Poles [1/s]", headings=("", "poles"), rows=tuple(rows))


def _of_model(design: Designed) -> str:
    """Which model gains or poles belong to, before its loop."""
    return "at the samples" if design.model.dt is not None else "continuous"


def _drawn(design: Designed, poles: Roots) -> Roots:
    """Poles that a picture has room for: of sampled matrices those whose motion outlasts a few samples."""
    return poles[poles.real > -3.0 / design.request.period] if design.model.dt is not None else poles


def _outlasting(design: Designed, poles: Roots, digits: int) -> str:
    """Poles whose motion outlasts a few samples, and how many die out at once (z close to 0)."""
    slow = poles[poles.real > -3.0 / design.request.period]
    beyond = poles.size - slow.size
    return written(slow, digits) + (f", and {beyond} faster" if beyond else "")


def _way_table(design: Designed) -> Table:
    """Velocities by difference, filtered difference and Kalman filter, side by side."""
    rows = tuple((way.name + (" (chosen)" if way is design.chosen else ""), *_worth(way)) for way in design.ways)
    margins = ("gain between", "phase [deg]", "delay [ms]", "modulus margin")
    caption = "factors on the command, phase, more delay, distance of the loop gain to −1; all with the same gains"
    if design.chosen.speed_noise is None:
        return Table(caption=f"Margins: {caption}", headings=("states from", *margins), rows=rows, numbers=(2, 3, 4))
    speeds = ", ".join(design.rig.state_units[1::2])
    noise = (f"speed noise [{speeds}]", f"command noise [{design.rig.unit}]")
    return Table(
        caption=f"Noise from rounding encoders, and margins: {caption}", headings=("velocities from", *noise, *margins),
        rows=rows, numbers=(2, 4, 5, 6),
    )  # fmt: skip


def _worth(way: VelocityLoop) -> tuple[str, ...]:
    noise: tuple[str, ...] = ()
    if way.speed_noise is not None:
        command = "falls" if way.command_noise is None else number(way.command_noise, 2)
        noise = (", ".join(number(v, 2) for v in way.speed_noise), command)
    if way.margins is None:
        return (*noise, "–" if noise else "falls", "–", "–", "–")
    m = way.margins
    return (
        *noise, f"{number(m.least_gain, 2)} and {number(m.most_gain, 3)}", number(math.degrees(m.phase), 3),
        number(1e3 * m.delay, 3), number(m.modulus, 2),
    )  # fmt: skip


def _per(command: str, unit: str) -> str:
    if unit == "1":
        return command
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


def _effort(design: Designed) -> str:
    if not math.isfinite(design.peak_sampled):
        return ""
    rest = ""
    if design.holding is not None and math.isinf(design.holding.lost):
        rest = (
            " Simulated with counts and dry friction, the command at rest "
            f"{shown(design.holding.effort, design.request.limit or math.inf, design.rig.unit)}."
        )
    return rest + (
        f" The requested start takes {number(design.peak_sampled, 3)} {design.rig.unit} at most, "
        f"{number(design.peak, 3)} {design.rig.unit} by the continuous model."
    )


def _dead_zone(design: Designed) -> str:
    """The cycle that the drive's dead zone keeps up: by its describing function, and simulated."""
    lost = 0.0 if design.request.on is None else design.request.on.more.get("actuator.dead_zone", 0.0)
    if not lost or design.chosen.margins is None:
        return ""
    unit, held = design.rig.unit, design.holding
    size, frequency = design.chosen.margins.dead_zone_cycle(lost)
    swallows = f" The drive swallows {number(lost, 3)} {unit} to either side"
    expected = f": by its first harmonic the loop cycles by ±{number(size, 2)} {unit} at {number(frequency, 2)} rad/s"
    if not size:
        expected = ", which by its first harmonic keeps no cycle up"
    if held is None or math.isfinite(held.lost):
        return f"{swallows}{expected}."
    cycle = held.effort.command
    if cycle is None:
        return f"{swallows}{expected}; simulated with counts and dry friction it keeps no regular one."
    return (
        f"{swallows}{expected}; simulated with counts and dry friction by ±{number(cycle.size, 2)} {unit} at "
        f"{number(2 * math.pi / cycle.period, 2)} rad/s."
    )


def _next_steps(design: Designed, source: str, folder: str) -> list[Step]:
    """What to try after this design."""
    steps: list[Step] = []
    if design.basis.level == NOT_TRUSTED:
        steps.append(
            Step("Mend the model first: do what its own verdict asks for, and identify again.",
                 "upright identify STUDY.toml -o OUT")
        )  # fmt: skip
    plain_matrices = isinstance(design.rig, StateSpace)
    base = f"upright design {source}" + ("" if plain_matrices else f" --at {design.request.at}")
    if design.sampled_gains is not None and (design.chosen.margins is None or design.chosen.margins.modulus < 0.4):
        steps.append(
            Step("Make up for delay and differences: gains that meet the poles in the sampled loop.",
                 f'{base} --poles "{written(design.wanted)}" --sampled'.replace("±", "+-"))
        )  # fmt: skip
    if design.request.poles is not None and not design.model.dt is not None:
        limit = " --limit LIMIT" if design.request.limit is None else ""
        steps.append(
            Step("Use LQR, its effort weight chosen by the drive's limit for this start.",
                 f"{base} --lqr {','.join('1' for _ in design.model.states)}{limit}")
        )  # fmt: skip
    if isinstance(design.rig, Rig) and not design.rig.draws:
        steps.append(
            Step("See what the uncertainty of the numbers does to the poles: design from a fit.json.",
                 "upright identify STUDY.toml -o OUT && upright design OUT/fit.json")
        )  # fmt: skip
    if design.chosen.margins is not None:
        steps.append(
            Step("Take the law to the computer that closes the loop, in C or another form: upright export --help.",
                 f"upright export {folder}/design.json --to c")
        )  # fmt: skip
    steps.append(
        Step(f"Simulate it: `upright.laws.of_values` reads the law from {folder}/design.json.")
    )  # fmt: skip
    if not plain_matrices:
        steps.append(Step("Run it on the rig, or on its twin (RIG.toml: docs/howto/rigs.md).",
                          f"upright run --rig RIG.toml --law {folder}/design.json"))  # fmt: skip
    return steps


def _pole_pictures(design: Designed) -> list[Picture]:
    """Poles in the s-plane, and the LQR locus as the effort's weight varies, a hundredfold either way."""
    aim = "requested" if design.placement else "LQR"
    kinds = [
        Poles(name="model, open loop", values=_drawn(design, design.open_loop), mark="x"),
        Poles(name=aim, values=_drawn(design, design.wanted), mark="o", colour="q0"),
        Poles(name="loop as it runs", values=_drawn(design, design.poles), mark="+", colour="q1"),
    ]
    drawn = pole_chart(kinds, design.cloud, cloud_of="loop, rigs that the fit allows")
    pictures = [
        drawn.picture(
            "poles",
            caption="Poles in the upper half of the s-plane; those of the loop as it runs are s = ln(z)/T of its "
            "sampled poles. Tinted: unstable.",
            description="; ".join(f"{k.name}: {written(k.values, 4)}" for k in kinds),
        )
    ]
    if design.R is None:
        return pictures
    weights = design.request.weights or (1.0,) * design.model.A.shape[0]
    discrete = design.model.dt is not None
    cheaper = design.R * np.geomspace(100, 0.01, 300)
    tracks = locus(design.model.A, design.model.B, weights, cheaper, sampled=discrete)
    tracks = to_s(tracks, design.request.period) if discrete else tracks
    chosen = {"chosen": _drawn(design, design.wanted)}
    cheaper_effort = locus_chart(
        tracks, cheaper, chosen, _drawn(design, design.open_loop), of="LQR poles as effort gets cheaper", symbol="R"
    )
    locus_of = cheaper_effort.picture(
        "locus",
        caption="LQR poles as the effort gets cheaper, from a hundred times the weight chosen to a hundredth.",
        description=f"Chosen: R = {number(design.R)}, poles {written(design.wanted, 4)}.",
    )
    return [*pictures, locus_of]


def _loop_picture(design: Designed) -> list[Picture]:
    """The loop gain with its margins; nothing where the loop falls."""
    m = design.chosen.margins
    if m is None:
        return []
    drawn = loop_chart(response(design.sampled, design.law), m, design.sampled.period)
    return [
        drawn.picture(
            "loop",
            caption="Bode plot of the loop gain, cut at the command. Dashed in the phase: where the gain is 1, with "
            "the phase margin. Dashed in the magnitude: where the phase is ±180°, with the factor on the command that "
            "the loop bears.",
            description=f"Phase margin {number(math.degrees(m.phase), 3)} deg; stable for factors on the command "
            f"from {number(m.least_gain, 2)} to {number(m.most_gain, 3)}.",
        )
    ]


def _swing_picture(design: Designed) -> Picture:
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
    return Chart(x="time", unit="s", panels=(*panels, command)).picture(
        "swing",
        caption="Linear model, continuous gains: the way back from the requested start, and the command it takes.",
        description=f"The command peaks at {design.peak:.3g} {design.rig.unit}.",
    )


def _over(t: Array, values: Array, title: str, unit: str, colour: str) -> ChartPanel:
    return ChartPanel(title=title, unit=unit, height=100.0, lines=(ChartLine(name="", x=t, y=values, colour=colour),))
