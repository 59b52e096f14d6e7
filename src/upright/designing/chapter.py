"""A design as a chapter: gains, poles, the loop as it runs, and what they are worth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from upright.basis import in_percent
from upright.control.effort import shown
from upright.designing.run import Designed, Holding, VelocityLoop
from upright.gains.lqr import locus
from upright.gains.requests import Roots, written
from upright.laws import as_values
from upright.report.drawing import BLACK, BLUE, VERMILLION, Poles, locus_figure, pole_map, swing_figure
from upright.report.page import Block, Chapter, Part, Picture, Points, Step, Table, resting_on
from upright.report.rig import rig_table
from upright.report.symbols import number, plain
from upright.report.symbols import unit as raised
from upright.rig import Rig
from upright.rig.completion import doubts
from upright.systems import StateSpace, to_s


def chapter(done: Designed, *, source: str = "OUT/fit.json", folder: str = ".") -> Chapter:
    """What a design says; fit or study and the folder of its files are named as they were typed."""
    poles = "with poles " if done.wish.proposed is None else "with proposed poles "
    wish = poles + written(done.wish.poles) if done.wish.poles is not None else "of least cost"
    gains: list[str] = []
    if done.wish.proposed is not None:
        gains.append(
            f"Nobody asked for poles. These are proposed: {done.wish.proposed:g} times as fast as the model "
            "falls or swings by itself, the quietest of those whose loop keeps nearly the largest distance to -1. Ask "
            "for others with --poles or --lqr."
        )
    if done.placement is not None:
        gains.append(f"Farthest pole from where it was asked: {done.placement.miss:.1g} 1/s. {done.placement.sentence}")
    if done.R is not None:
        gains.append(f"Weight of the effort: {number(done.R)}.")
    sure: list[Block] = []
    if done.chance is not None:
        stable = done.basis.supported(in_percent(done.chance))
        what = "Share of the rigs sampled from the fit's covariance that these gains stabilise"
        sure.append(Points((f"{what}: {stable}.",)))
    plain_matrices = isinstance(done.rig, StateSpace)
    loop = (
        f"Period {1e3 * done.wish.period:.4g} ms, command {done.sampled.delay:.3g} samples late "
        f"({_delay_from(done)}), drive's lag {1e3 * done.sampled.lag:.3g} ms, "
        f"{f'states by {done.chosen.name}' if plain_matrices else 'velocities made from rounded encoders'}."
        f"{_effort(done)}"
    )
    what = f"{done.rig.name}, {done.wish.at}".removesuffix(", ")
    held = "the model" if plain_matrices else f"the rig at '{done.wish.at}'"
    trial = "sampling, delay and " + ("their way to the states" if plain_matrices else "differenced encoders")
    told = Chapter(
        title=f"Gains for {what}",
        verdict=done.verdict,
        sound=done.chosen.margins is not None and "reservations" not in done.verdict,
        question=f"Which gains hold {held} {wish}, and do they survive {trial}?",
        parts=(
            Part("Gains", (Points(tuple(gains)), _gain_table(done), _pole_table(done))),
            Part("Poles", (*sure, *_pole_pictures(done))),
            Part("The loop as it runs", (loop, _way_table(done))),
            Part("Coming back", (_swing_picture(done),)),
            *((Part("The rig", (rig_table(done.wish.on),)),) if done.wish.on else ()),
        ),
        steps=tuple(_next_steps(done, source, folder)),
        warnings=_doubts(done),
        numbers=_numbers(done),
    )
    return resting_on(told, done.basis)


def _delay_from(done: Designed) -> str:
    """Who says how late a command acts."""
    if done.wish.delay is not None:
        return "as asked"
    if isinstance(done.rig, StateSpace):
        return "besides what the matrices hold" if done.rig.dt else "assumed"
    return "as the file says" if done.rig.delay else "assumed"


def _doubts(done: Designed) -> tuple[str, ...]:
    """What was not said of the rig, and whose number stands for it."""
    if isinstance(done.rig, StateSpace):
        left = "dry friction, steps of encoders" + ("" if done.wish.limit else ", the largest command of the drive")
        return (f"Plain matrices say nothing of a rig: {left} are in none of these numbers.",)
    told = doubts(done.rig, done.wish.on) if done.wish.on else ()
    if done.wish.limit is not None:
        return told
    return (
        *told,
        "Nobody said how large a command the drive takes, so whether it saturates is not known: --limit 10, or "
        '[actuator] limit = "10 V" in the study.',
    )


def _gain_table(done: Designed) -> Table:
    """The gains in force, and those that meet the poles in the sampled loop."""
    command = done.rig.unit or "1"
    sampled = done.sampled_gains
    rows = tuple(
        (plain(name), number(k, 5), *((number(sampled[0, i], 5),) if sampled is not None else ()), _per(command, unit))
        for i, (name, k, unit) in enumerate(
            zip(done.model.states, done.continuous[0], done.rig.state_units, strict=True)
        )
    )  # fmt: skip
    marks = ("", " (used)") if done.wish.sampled else (" (used)", "")
    second = ("K, sampled" + marks[1],) if sampled is not None else ()
    headings = ("state", f"K, {_of_model(done)}" + marks[0], *second, "unit")
    caption = "Gains of u = −K x" + (f", prefilter k_pf = {number(done.k_pf)}" if done.k_pf is not None else "")
    return Table(caption=caption, headings=headings, rows=rows, numbers=tuple(range(1, len(headings) - 1)))


def _pole_table(done: Designed) -> Table:
    """Poles asked, attained by the gains on the continuous model, and of the loop as it runs."""
    discrete = done.model.dt is not None
    rows = [("model, open loop", _outlasting(done, done.open_loop, 5) if discrete else written(done.open_loop))]
    if done.placement is not None:
        rows.append(("asked", written(done.placement.requested)))
        rows.append((f"attained, {_of_model(done)}", written(done.placement.attained)))
    else:
        least = _outlasting(done, done.wanted, 5) if discrete else written(done.wanted)
        rows.append((f"least cost, {_of_model(done)}", least))
    rows.append(("loop as it runs", _outlasting(done, done.poles, 4)))
    return Table(caption="Poles [1/s]", headings=("", "poles"), rows=tuple(rows))


def _of_model(done: Designed) -> str:
    """Which model gains or poles belong to, before its loop."""
    return "at the samples" if done.model.dt is not None else "continuous"


def _drawn(done: Designed, poles: Roots) -> Roots:
    """Poles that a picture has room for: of sampled matrices those whose motion outlasts a few samples."""
    return poles[poles.real > -3.0 / done.wish.period] if done.model.dt is not None else poles


def _outlasting(done: Designed, poles: Roots, digits: int) -> str:
    """Poles whose motion outlasts a few samples, and how many die out at once (z close to 0)."""
    slow = poles[poles.real > -3.0 / done.wish.period]
    beyond = poles.size - slow.size
    return written(slow, digits) + (f", and {beyond} faster" if beyond else "")


def _way_table(done: Designed) -> Table:
    """Velocities by difference, filtered difference and Kalman filter, side by side."""
    rows = tuple((way.name + (" (chosen)" if way is done.chosen else ""), *_worth(way)) for way in done.ways)
    margins = ("gain between", "phase [deg]", "delay [ms]", "distance")
    caption = "factors on the command, phase, more delay, distance of the loop gain to −1; all with the same gains"
    if done.chosen.speed_noise is None:
        return Table(caption=f"Margins: {caption}", headings=("states from", *margins), rows=rows, numbers=(2, 3, 4))
    speeds = ", ".join(done.rig.state_units[1::2])
    noise = (f"speed noise [{speeds}]", f"command noise [{done.rig.unit}]")
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


def _numbers(done: Designed) -> dict[str, Any]:
    """Content of `design.json`: numbers in SI and the command's unit."""
    wish, way = done.wish, done.chosen
    return {
        "plant": done.rig.name,
        "at": wish.at,
        "states": list(done.model.states),
        "command_unit": done.rig.unit,
        "limit": wish.limit,
        "described": None if wish.on is None else wish.on.hardware.plain(),
        "period": wish.period,
        "delay_samples": done.sampled.delay,
        "delay_from": _delay_from(done),
        "K": done.K[0],
        "K_sampled": None if done.sampled_gains is None else done.sampled_gains[0],
        "k_pf": done.k_pf,
        "effort_weight": done.R,
        "poles": {
            "open_loop": done.open_loop,
            "asked": None if done.placement is None else done.placement.requested,
            "attained": None if done.placement is None else done.placement.attained,
            "sampled_loop": done.poles,
        },
        "worst_miss": None if done.placement is None else done.placement.miss,
        "condition": None if done.placement is None else done.placement.condition,
        "margins": way.margins,
        "lag": done.sampled.lag,
        "peak_command": done.peak,
        "peak_command_sampled": done.peak_sampled,
        "chance_over_the_fit": None if done.chance is None else done.basis.supported(done.chance),
        "at_rest": None if done.holding is None else _at_rest(done.holding),
        "readings": _readings(done),
        "states_from": done.chosen.name,
        "command": done.rig.inputs[0] if isinstance(done.rig, StateSpace) else "u",
        "converter": 0.0 if wish.on is None else wish.on.converter,
        "law": as_values(done.law),
        "verdict": done.verdict,
    }


def _at_rest(held: Holding) -> dict[str, Any]:
    """Command at rest, as shares of the limit; a limit cycle in SI."""
    found = held.effort
    return {"quiet": found.quiet, "rms": found.rms, "peak": found.peak, "cycle": found.command, "lost": held.lost}


def _readings(done: Designed) -> list[dict[str, Any]]:
    """What the law reads, one by one: encoder's step and sign as described."""
    rig, on = done.rig, done.wish.on
    steps = dict(zip(rig.outputs, done.wish.resolution, strict=False))
    return [
        {
            "name": name,
            "unit": unit,
            "step": steps.get(name, 0.0),
            "sign": 1.0 if on is None else on.hardware.value(f"sign.{name}", 1.0),
        }
        for name, unit in zip(rig.outputs, rig.output_units, strict=True)
    ]


def _effort(done: Designed) -> str:
    if not math.isfinite(done.peak_sampled):
        return ""
    rest = ""
    if done.holding is not None and math.isinf(done.holding.lost):
        rest = (
            " Simulated with counts and dry friction, the command at rest "
            f"{shown(done.holding.effort, done.wish.limit or math.inf, done.rig.unit)}."
        )
    return rest + (
        f" The start asked for takes {number(done.peak_sampled, 3)} {done.rig.unit} at most, "
        f"{number(done.peak, 3)} {done.rig.unit} by the continuous model."
    )


def _next_steps(done: Designed, source: str, folder: str) -> list[Step]:
    """What to try after this design."""
    steps: list[Step] = []
    plain_matrices = isinstance(done.rig, StateSpace)
    base = f"upright design {source}" + ("" if plain_matrices else f" --at {done.wish.at}")
    if done.sampled_gains is not None and (done.chosen.margins is None or done.chosen.margins.modulus < 0.4):
        steps.append(
            Step("Make up for delay and differences: gains that meet the poles in the sampled loop.",
                 f'{base} --poles "{written(done.wanted)}" --sampled'.replace("±", "+-"))
        )  # fmt: skip
    if done.wish.poles is not None and not done.model.dt is not None:
        limit = " --limit LIMIT" if done.wish.limit is None else ""
        steps.append(
            Step("Let the drive's limit choose: the cheapest effort that comes back from this start.",
                 f"{base} --lqr {','.join('1' for _ in done.model.states)}{limit}")
        )  # fmt: skip
    if isinstance(done.rig, Rig) and not done.rig.draws:
        steps.append(
            Step("See what the uncertainty of the numbers does to the poles: design from a fit.json.",
                 "upright identify STUDY.toml -o OUT && upright design OUT/fit.json")
        )  # fmt: skip
    if done.chosen.margins is not None:
        steps.append(
            Step("Take the law to the computer that closes the loop, in C or another form: upright export --help.",
                 f"upright export {folder}/design.json --to c")
        )  # fmt: skip
    steps.append(
        Step(f"Simulate it: upright.laws.of_values makes the law of what stands as law in {folder}/design.json.")
    )  # fmt: skip
    if not plain_matrices:
        steps.append(Step("Run it on the rig, or on its twin (RIG.toml: docs/rigs.md).",
                          f"upright run --rig RIG.toml --law {folder}/design.json"))  # fmt: skip
    return steps


def _pole_pictures(done: Designed) -> list[Picture]:
    """Poles in the s-plane, and those of least cost as the effort's weight varies, a hundredfold either way."""
    aim = "asked" if done.placement else "least cost"
    kinds = [
        Poles(name="model, open loop", values=_drawn(done, done.open_loop), mark="x", colour=BLACK),
        Poles(name=aim, values=_drawn(done, done.wanted), mark="o", colour=BLUE),
        Poles(name="loop as it runs", values=_drawn(done, done.poles), mark="+", colour=VERMILLION),
    ]
    pictures = [
        Picture(
            name="poles", draw=lambda: pole_map(kinds, done.cloud),
            caption="Poles in the s-plane; those of the loop as it runs are s = ln(z)/T of its sampled poles.",
            description="; ".join(f"{k.name}: {written(k.values, 4)}" for k in kinds),
        )
    ]  # fmt: skip
    if done.R is None:
        return pictures
    weights = done.wish.weights or (1.0,) * done.model.A.shape[0]
    discrete = done.model.dt is not None
    tracks = locus(done.model.A, done.model.B, weights, done.R * np.geomspace(100, 0.01, 300), sampled=discrete)
    tracks = to_s(tracks, done.wish.period) if discrete else tracks
    cheaper = Picture(
        name="locus",
        draw=lambda: locus_figure(tracks, {"chosen": _drawn(done, done.wanted)}, _drawn(done, done.open_loop)),
        caption="Poles of least cost as the effort gets cheaper, from a hundred times the weight chosen to a "
        "hundredth.",
        description=f"Chosen: R = {number(done.R)}, poles {written(done.wanted, 4)}.",
    )  # fmt: skip
    return [*pictures, cheaper]


def _swing_picture(done: Designed) -> Picture:
    t, y, u = done.swing
    units = zip(done.rig.outputs, done.rig.output_units, strict=True)
    shown = {name: (y[:, i], unit) for i, (name, unit) in enumerate(units)}
    return Picture(
        name="swing", draw=lambda: swing_figure(t, shown, u[:, 0], done.rig.unit, done.wish.limit),
        caption="Linear model, continuous gains: the way back from the start asked for, and the command it takes.",
        description=f"The command peaks at {done.peak:.3g} {done.rig.unit}.",
    )  # fmt: skip
