"""A law as a Python module that imports nothing but `math`."""

from __future__ import annotations

from upright.exports.arithmetic import Language, statements
from upright.exports.controller import SampledController
from upright.exports.vector import ReplayVector

_LANGUAGE = Language(
    number=lambda x: repr(float(x)), reading="y[{}]".format, reference="r[{}]".format, memory="z[{}]".format,
    command="u[{}]".format, let="", end="", remark="# {}".format, floor="floor", absolute="abs",
    limited=lambda c, most: f"min(max({c}, -{most}), {most})",
    first=lambda lines: ["if not self.running:", *(f"    {line}" for line in lines)],
    hold=lambda line: ["if not beyond:", f"    {line}"], either="or",
)  # fmt: skip


def files(made: SampledController, test: ReplayVector) -> dict[str, str]:
    """Text by file name."""
    body = "\n".join(f"        {line}" for line in statements(made, _LANGUAGE))
    about = "\n".join(made.facts)
    needs = "from math import floor\n\n" if "floor(" in body else ""
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


class Law:
    """One run of the law; make another one for the next run."""

    def __init__(self):
        self.z = [0.0] * {len(made.law.A)}
        self.running = False

    def step(self, y, r=()):
        """Commands for the readings `y` and references `r` of one sample."""
        z, u = self.z, [0.0] * {len(made.commands)}
{body}
        self.running = True
        return u


SELF_TEST = (  # readings, references, expected commands
{table}
)


def self_test():
    """Number of the first sample whose command is not the expected one, None when all are."""
    law = Law()
    for k, (y, r, expected) in enumerate(SELF_TEST):
        if law.step(y, r) != expected:
            return k
    return None


if __name__ == "__main__":
    wrong = self_test()
    if wrong is not None:
        raise SystemExit(f"law: sample {{wrong}} is not the expected one; do not run it")
    print("law: every sample is the expected one")
'''
    }
