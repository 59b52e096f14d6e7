"""Every form that a law can be written in, and what to do with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from upright.errors import BadInput
from upright.exports import arduino, c, matlab, python
from upright.exports.controller import SampledController
from upright.exports.vector import ReplayVector


@dataclass(frozen=True, kw_only=True)
class Target:
    """One form: its name, what writes its texts (single precision or not), and how to run its self-test."""

    name: str
    write: Callable[[SampledController, ReplayVector, bool], Mapping[str, str]]
    test: str
    onward: str


def _python(made: SampledController, test: ReplayVector, single: bool) -> Mapping[str, str]:
    if single:
        raise BadInput("Python's numbers are doubles; leave --float out, or take --to c.")
    return python.files(made, test)


TARGETS: Mapping[str, Target] = {
    "c": Target(
        name="C99", write=lambda m, t, s: c.files(m, t, single=s),
        test="cd {folder} && cc -std=c99 -O2 law.c law_selftest.c -lm && ./a.out",
        onward="Call law_start once and law_step at every sample.",
    ),
    "arduino": Target(
        name="an Arduino sketch", write=lambda m, t, s: arduino.files(m, t, single=s),
        test="arduino-cli compile --upload -b arduino:avr:uno -p PORT {folder}/law && arduino-cli monitor -p PORT "
        "-c baudrate=115200",
        onward="Fill in counts_of and put_out in law.ino; until then it reads zeros and puts nothing out.",
    ),
    "python": Target(
        name="Python", write=_python, test="python {folder}/law.py",
        onward="law = Law(); u = law.step(y) at every sample.",
    ),
    "matlab": Target(
        name="MATLAB and GNU Octave", write=lambda m, t, s: matlab.files(m, t, single=s),
        test="octave-cli --path {folder} --eval law_selftest",
        onward="[u, s] = law_step(s, y) at every sample, with s = [] before the first.",
    ),
    "simulink": Target(
        name="Simulink", write=lambda m, t, s: matlab.block(m, t, single=s),
        test="octave-cli --path {folder} --eval law_selftest",
        onward="In MATLAB, run law_block: it makes a model with the law as a block at its own sample time.",
    ),
}  # fmt: skip
