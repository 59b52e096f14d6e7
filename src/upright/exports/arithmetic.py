"""A law's arithmetic as statements of any language, in the kernel's order: the same operations give the same bits.

As in `simulation.kernel.lanes.law`: deviations from rest, commands summed from left to right from zero, memory first,
then rounded and limited, then the next memory. Entries of zero are left out, and 1 is no factor: neither changes a bit.

A reading, reference or command that is not finite stops the law: commands of zero until it is restarted. A comparison
with NaN is false, so that a limit would make the largest command of it, and a memory would never lose it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from upright.exports.controller import SampledController


@dataclass(frozen=True, kw_only=True)
class Language:
    """How a language says it; `first` and `hold` wrap statements in a condition.

    Attributes
    ----------
    number : callable
        A constant, to its last bit.
    reading, reference, memory, command : callable
        By number, from 0.
    let : str
        What goes before a new name.
    end : str
        What ends a statement.
    limited : callable
        A value between plus and minus another.
    first : callable
        Statements for the first sample alone.
    hold : callable
        A statement for samples at which no command is beyond its limit.
    stopped : str
        Whether the law is stopped until it is restarted.
    not_finite : callable
        Whether a value is NaN or infinite.
    stop : callable
        Statements that, on a condition, stop the law and end the sample with commands of zero.
    """

    number: Callable[[float], str]
    reading: Callable[[int], str]
    reference: Callable[[int], str]
    memory: Callable[[int], str]
    command: Callable[[int], str]
    let: str
    end: str
    remark: Callable[[str], str]
    floor: str
    absolute: str
    limited: Callable[[str, str], str]
    first: Callable[[list[str]], list[str]]
    hold: Callable[[str], list[str]]
    stopped: str
    not_finite: Callable[[str], str]
    stop: Callable[[str], list[str]]
    either: str


def statements(made: SampledController, say: Language) -> list[str]:
    """One sample of the law."""
    law, limit = made.linear, made.linear.limit
    A, B, C, D = (getattr(law, name).tolist() for name in "ABCD")
    target, initial = (law.arrays()[name][0].tolist() for name in ("target", "initial"))
    hold = law.windup == "hold" and math.isfinite(limit)
    units = [f" [{unit}]" if unit else "" for unit in made.reading_units]
    lines: list[str] = []

    def put(text: str, remark: str = "") -> None:
        lines.append(f"{text}{say.end}" + (f"  {say.remark(remark)}" if remark else ""))

    lines += check_inputs(made, say)
    for i, (name, unit) in enumerate(zip(made.readings, units, strict=True)):
        less = f" - {say.number(target[i])}" if target[i] else ""
        put(f"{say.let}w{i} = {say.reading(i)}{less}", f"{name} less its reading at rest{unit}")
    signals = [f"w{i}" for i in range(len(made.readings))]
    signals += [say.reference(c) for c in range(len(made.references))]
    if A:
        begin = [[0.0] * len(made.readings)] * len(A) if law.begin is None else law.begin.tolist()
        deviations = signals[: len(made.readings)]
        starts = [
            " + ".join([say.number(z)] * bool(z) + _terms(row, deviations, say)) or say.number(0.0)
            for z, row in zip(initial, begin, strict=True)
        ]
        lines += say.first([f"{say.memory(i)} = {start}{say.end}" for i, start in enumerate(starts)])
    memory = [say.memory(i) for i in range(len(A))]
    unit = f" [{made.command_unit}]" if made.command_unit else ""
    of = [*(f"memory {i}" for i in range(len(A))), *(f"{n}{u}" for n, u in zip(made.readings, units, strict=True))]
    of += list(made.references)
    for j, name in enumerate(made.commands):
        put(f"{say.let}c{j} = {say.number(0.0)}", f"{name}{unit}")
        for k, value, what in zip([*C[j], *D[j]], [*memory, *signals], of, strict=True):
            for term in _terms([k], [value], say):
                put(f"c{j} = c{j} + {term}", f"of {what}")
    lines += _check_commands(made, say)
    for j, step in enumerate(made.converter.tolist()):
        if step:
            put(_rounded(j, step, say), "to the converter's steps")
    if hold:
        beyond = f" {say.either} ".join(f"{say.absolute}(c{j}) > {say.number(limit)}" for j in range(len(C)))
        put(f"{say.let}beyond = {beyond}", "sums then stand still")
    for j in range(len(C)):
        put(_put_out(j, limit, say))
    for i, (a, b) in enumerate(zip(A, B, strict=True)):
        terms = _terms([*a, *b], [*memory, *signals], say)
        remark = "" if i else "what is remembered until the next sample"
        put(f"{say.let}n{i} = {' + '.join(terms) or say.number(0.0)}", remark)
    for i, row in enumerate(A):
        line = f"{say.memory(i)} = n{i}{say.end}"
        stands = hold and all(value == float(i == j) for j, value in enumerate(row))
        lines += say.hold(line) if stands else [line]
    return lines


def check_inputs(made: SampledController, say: Language) -> list[str]:
    """What every sample begins with: without finite readings and references there are no commands."""
    readings, references = map(say.reading, range(len(made.readings))), map(say.reference, range(len(made.references)))
    return say.stop(f" {say.either} ".join([say.stopped, *map(say.not_finite, (*readings, *references))]))


def _check_commands(made: SampledController, say: Language) -> list[str]:
    """Before they are rounded: numbers that are finite may overflow on their way."""
    values = [_scaled(j, step, say) if step else f"c{j}" for j, step in enumerate(made.converter.tolist())]
    return say.stop(f" {say.either} ".join(map(say.not_finite, values)))


def output_lines(made: SampledController, say: Language) -> list[str]:
    """What becomes of the commands c0, c1, ... of a rule."""
    rounded = [_rounded(j, step, say) for j, step in enumerate(made.converter.tolist()) if step]
    commands = [_put_out(j, made.law.limit, say) for j in range(len(made.commands))]
    return [*_check_commands(made, say), *(f"{line}{say.end}" for line in (*rounded, *commands))]


def _scaled(j: int, step: float, say: Language) -> str:
    return f"c{j} * {say.number(1.0 / step)}"


def _rounded(j: int, step: float, say: Language) -> str:
    return f"c{j} = {say.floor}({_scaled(j, step, say)} + {say.number(0.5)}) * {say.number(step)}"


def _put_out(j: int, limit: float, say: Language) -> str:
    limited = say.limited(f"c{j}", say.number(limit)) if math.isfinite(limit) else f"c{j}"
    return f"{say.command(j)} = {limited}"


def _terms(factors: list[float], values: list[str], say: Language) -> list[str]:
    pairs = [(k, v) for k, v in zip(factors, values, strict=True) if k]
    return [v if k == 1.0 else f"{say.number(k)} * {v}" for k, v in pairs]
