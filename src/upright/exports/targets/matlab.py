"""A law as a function of MATLAB that GNU Octave runs as well, and the same as a block of Simulink."""

from __future__ import annotations

import numpy as np

from upright.exports.arithmetic import Language, statements
from upright.exports.controller import SampledController
from upright.exports.targets import LawTarget
from upright.exports.texts import filled, indented
from upright.exports.vector import ReplayVector
from upright.laws.linear import Array


def _files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name."""
    return {"law_step.m": step_function(made, single=single), "law_selftest.m": selftest_function(test, single=single)}


def simulink_block(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name for Simulink: the same function, a level-2 S-function that calls it, what makes its block."""
    return {
        **_files(made, test, single=single),
        "law_sfun.m": _s_function(made, single=single),
        "law_block.m": filled("law_block.m"),
    }


def step_function(made: SampledController, *, single: bool) -> str:
    """Text of ``law_step.m``."""
    number = "single" if single else "double"
    say = Language(
        number=lambda x: f"{x:.17g}", reading=lambda i: f"y({i + 1})", reference=lambda c: f"r({c + 1})",
        memory=lambda i: f"s.z({i + 1})", command=lambda j: f"u({j + 1})", let="", end=";", remark="% {}".format,
        floor="floor", absolute="abs", limited=lambda c, most: f"min(max({c}, -{most}), {most})",
        first=lambda lines: ["if ~s.running", *(f"    {line}" for line in lines), "end"],
        hold=lambda line: ["if ~beyond", f"    {line}", "end"], either="||",
        stopped="s.stopped", not_finite="~isfinite({})".format,
        stop=lambda when: [f"if {when}", "    s.stopped = true;", "    return;", "end"],
    )  # fmt: skip
    return filled(
        "law_step.m.in", with_r=", r" if made.references else "", title=made.title, number=number,
        about="\n".join(f"% {fact}" for fact in made.facts), memories=max(made.memories, 1),
        commands=len(made.commands), body=indented(statements(made, say)),
    )  # fmt: skip


def selftest_function(test: ReplayVector, *, single: bool) -> str:
    """Text of ``law_selftest.m``."""
    with_r, first_r = (", asked(k, :)", ", asked(1, :)") if test.references.shape[1] else ("", "")
    references = _table("asked", test.references) if with_r else ""
    return filled(
        "law_selftest.m.in", given=_table("given", test.readings), references=references, with_r=with_r,
        first_r=first_r, expected=_table("expected", test.commands),
        allowed=f"{test.single if single else 0.0:.17g}",
    )  # fmt: skip


def _table(name: str, rows: Array) -> str:
    body = "".join(f"        {', '.join(f'{x:.17g}' for x in row)}\n" for row in np.asarray(rows).tolist())
    return f"    {name} = [\n{body}    ];\n"


def _s_function(made: SampledController, *, single: bool) -> str:
    """Text of ``law_sfun.m``, which keeps memory in Simulink's own, so that stored states can be restored."""
    m = len(made.references)
    second = (
        f"    block.InputPort(2).Dimensions = {m};\n    block.InputPort(2).DirectFeedthrough = true;\n" if m else ""
    )
    return filled(
        "law_sfun.m.in", title=made.title, readings=", ".join(made.readings), commands=", ".join(made.commands),
        then="; then " + ", ".join(made.references) if m else "", ports=2 if m else 1, inputs=len(made.readings),
        second=second, outputs=len(made.commands), period=f"{made.law.needed_period:.17g}",
        kept=max(made.memories, 1) + 2,
        r=", block.InputPort(2).Data" if m else "", number="single" if single else "double",
    )  # fmt: skip


MATLAB = LawTarget(
    name="matlab", order=25, title="MATLAB and GNU Octave", write=_files,
    test="octave-cli --path {folder} --eval law_selftest",
    onward="[u, s] = law_step(s, y) at every sample, with s = [] before the first.",
)  # fmt: skip
SIMULINK = LawTarget(
    name="simulink", order=30, title="Simulink", write=simulink_block,
    test=MATLAB.test,
    onward="In MATLAB, run law_block: it makes a model with the law as a block at its own sample time.",
)  # fmt: skip
