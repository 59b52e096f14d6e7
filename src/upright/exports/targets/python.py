"""A law as a Python module that imports nothing but `math`."""

from __future__ import annotations

from upright.errors import BadInput
from upright.exports import rule
from upright.exports.arithmetic import Language, check_inputs, output_lines, statements
from upright.exports.controller import SampledController
from upright.exports.targets import LawTarget
from upright.exports.texts import filled, indented
from upright.exports.vector import ReplayVector
from upright.laws import Rule

_LANGUAGE = Language(
    number=lambda x: repr(float(x)), reading="y[{}]".format, reference="r[{}]".format, memory="z[{}]".format,
    command="u[{}]".format, let="", end="", remark="# {}".format, floor="floor", absolute="abs",
    limited=lambda c, most: f"min(max({c}, -{most}), {most})",
    first=lambda lines: ["if not self.running:", *(f"    {line}" for line in lines)],
    hold=lambda line: ["if not beyond:", f"    {line}"], either="or",
    stopped="self.stopped", not_finite="not isfinite({})".format,
    stop=lambda when: [f"if {when}:", "    self.stopped = True", "    return [0.0] * len(COMMANDS)"],
)  # fmt: skip


def _files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Text by file name."""
    if single:
        raise BadInput("Python's numbers are doubles; leave --float out, or take the target c.")
    if isinstance(made.law, Rule):
        needs = "from math import floor, frexp, inf, isfinite, nan, pi, sqrt\n\n"
        before = f"\n\n{rule.in_python(made)}\n"
        parameters, initial = (tuple(values) for values in rule.rule_numbers(made))
        begin = [f"self.z = {initial!r}", "self.samples = 0"]
        inputs = range(len(made.commands))
        lines = [
            *check_inputs(made, _LANGUAGE),
            f"found, self.z = rule(self.samples * PERIOD, tuple(y), tuple(r), self.z, {parameters!r})",
            *(f"c{j} = found[{j}]" for j in inputs),
            f"u = [0.0] * {len(made.commands)}",
            *output_lines(made, _LANGUAGE),
            "self.samples += 1",
        ]  # fmt: skip
    else:
        before, begin = "", [f"self.z = [0.0] * {made.memories}", "self.running = False"]
        lines = [f"z, u = self.z, [0.0] * {len(made.commands)}", *statements(made, _LANGUAGE), "self.running = True"]
        floor = "floor, " * any("floor(" in line for line in lines)
        needs = f"from math import {floor}inf, isfinite, nan\n\n"
    begin.append("self.stopped = False")
    rows = zip(test.readings.tolist(), test.references.tolist(), test.commands.tolist(), strict=True)
    return {"law.py": filled(
        "law.py.in", title=made.title, about="\n".join(made.facts), needs=needs, period=repr(made.law.needed_period),
        readings=repr(made.readings), references=repr(made.references), commands=repr(made.commands), before=before,
        first=indented(begin, 8), body=indented(lines, 8), table=indented(f"({y}, {r}, {u})," for y, r, u in rows),
    )}  # fmt: skip


TARGET = LawTarget(
    name="python", order=20, title="Python", write=_files, rules=True,
    test="python {folder}/law.py", onward="law = Law(); u = law.step(y) at every sample.",
)  # fmt: skip
