"""A law as a Python module that imports nothing but `math`."""

from __future__ import annotations

from upright.errors import BadInput
from upright.exports import rule
from upright.exports.arithmetic import Language, check_inputs, output_lines, statements
from upright.exports.controller import SampledController
from upright.exports.targets import LawTarget
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
        raise BadInput("Python's numbers are doubles; leave --float out, or take --to c.")
    about = "\n".join(made.facts)
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
    first, body = ("\n".join(f"        {line}" for line in part) for part in (begin, lines))
    rows = zip(test.readings.tolist(), test.references.tolist(), test.commands.tolist(), strict=True)
    table = "\n".join(f"    ({y}, {r}, {u})," for y, r, u in rows)
    return {
        "law.py": f'''\
"""{made.title}, written by upright export.

{about}
Run this file to test it: the commands are compared with those of upright's own kernel, bit for bit.
"""

{needs}PERIOD = {made.law.period!r}
READINGS = {made.readings!r}
REFERENCES = {made.references!r}
COMMANDS = {made.commands!r}
{before}

class Law:
    """One run of the law; make another one for the next run.

    A reading, reference or command that is not finite ends the run: `stopped`, and every command is zero from there on.
    """

    def __init__(self):
{first}

    def step(self, y, r=()):
        """Commands for the readings `y` and references `r` of one sample."""
{body}
        return u


SELF_TEST = (  # readings, references, expected commands
{table}
)


def self_test():
    """Number of the first sample whose command is not the expected one, None when all are.

    Behind the samples comes a reading that is not finite, and a good one: both commands are zero, until a new start.
    """
    count, (y, r, _), zero = len(SELF_TEST), SELF_TEST[0], [0.0] * len(COMMANDS)
    for i in range(len(READINGS)):
        for bad in (nan, inf, -inf):
            law = Law()
            for k, (readings, references, expected) in enumerate(SELF_TEST):
                if law.step(readings, references) != expected:
                    return k
            if law.step([*y[:i], bad, *y[i + 1 :]], r) != zero:
                return count
            if law.step(y, r) != zero:
                return count + 1
    return None


if __name__ == "__main__":
    wrong = self_test()
    if wrong is not None:
        raise SystemExit(f"law: sample {{wrong}} is not the expected one; do not run it")
    print("law: every sample is the expected one")
'''
    }


TARGET = LawTarget(
    name="python", order=20, title="Python", write=_files, rules=True,
    test="python {folder}/law.py", onward="law = Law(); u = law.step(y) at every sample.",
)  # fmt: skip
