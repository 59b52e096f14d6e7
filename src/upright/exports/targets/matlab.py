"""A law as a function of MATLAB that GNU Octave runs as well, and the same as a block of Simulink."""

from __future__ import annotations

import numpy as np

from upright.exports.arithmetic import Language, statements
from upright.exports.controller import SampledController
from upright.exports.targets import LawTarget
from upright.exports.vector import ReplayVector
from upright.laws.linear import Array


def _files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name."""
    return {"law_step.m": step_function(made, single=single), "law_selftest.m": selftest_function(test, single=single)}


def simulink_block(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name for Simulink: the same function, a level-2 S-function that calls it, what makes its block."""
    return {**_files(made, test, single=single), "law_sfun.m": _s_function(made, single=single), "law_block.m": _BLOCK}


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
    body = "\n".join(f"    {line}" for line in statements(made, say))
    about = "\n".join(f"% {fact}" for fact in made.facts)
    with_r = ", r" if made.references else ""
    return f"""\
function [u, s] = law_step(s, y{with_r})
% Commands u and memory s of one sample; s is [] before the first, so that no jump is taken for a speed.
% A reading, reference or command that is not finite sets s.stopped: u is zero until s is [] again.
% {made.title}, written by upright export.
{about}
%#codegen
    if isempty(s)
        s = struct('z', zeros({max(made.memories, 1)}, 1, '{number}'), 'running', false, 'stopped', false);
    end
    y = {number}(y);
    u = zeros({len(made.commands)}, 1, '{number}');
{body}
    s.running = true;
end
"""


def selftest_function(test: ReplayVector, *, single: bool) -> str:
    """Text of ``law_selftest.m``."""
    with_r, first_r = (", asked(k, :)", ", asked(1, :)") if test.references.shape[1] else ("", "")
    references = _table("asked", test.references) if with_r else ""
    return f"""\
function law_selftest()
% Compares the commands of a replay with those that upright's own kernel answers.
% Behind the samples comes a reading that is not finite, and a good one: both commands are zero, until a new start.
{_table("given", test.readings)}{references}{_table("expected", test.commands)}\
    allowed = {f"{test.single if single else 0.0:.17g}"};
    wrong = 'law: sample %d is not the expected one; do not run it';
    bad = [NaN, Inf, -Inf];
    for run = 1:3 * size(given, 2)
        s = [];
        for k = 1:size(given, 1)
            [u, s] = law_step(s, given(k, :){with_r});
            if ~all(abs(double(u(:)).' - expected(k, :)) <= allowed)
                error('law:selftest', wrong, k);
            end
        end
        y = given(1, :);
        y(ceil(run / 3)) = bad(mod(run, 3) + 1);
        for k = 1:2
            [u, s] = law_step(s, y{first_r});
            if ~all(u(:) == 0)
                error('law:selftest', wrong, size(given, 1) + k);
            end
            y = given(1, :);
        end
    end
    disp('law: every sample is the expected one');
end
"""


def _table(name: str, rows: Array) -> str:
    body = "".join(f"        {', '.join(f'{x:.17g}' for x in row)}\n" for row in np.asarray(rows).tolist())
    return f"    {name} = [\n{body}    ];\n"


def _s_function(made: SampledController, *, single: bool) -> str:
    """Text of ``law_sfun.m``, which keeps memory in Simulink's own, so that stored states can be restored."""
    m, z, number = len(made.references), max(made.memories, 1), "single" if single else "double"
    r = ", block.InputPort(2).Data" if m else ""
    second = (
        f"    block.InputPort(2).Dimensions = {m};\n    block.InputPort(2).DirectFeedthrough = true;\n" if m else ""
    )
    return f"""\
function law_sfun(block)
% Level-2 S-function around law_step; {made.title}, written by upright export.
% In: {", ".join(made.readings)}{"; then " + ", ".join(made.references) if m else ""}. Out: {", ".join(made.commands)}.
    block.NumDialogPrms = 0;
    block.NumInputPorts = {2 if m else 1};
    block.NumOutputPorts = 1;
    block.SetPreCompInpPortInfoToDynamic;
    block.SetPreCompOutPortInfoToDynamic;
    block.InputPort(1).Dimensions = {len(made.readings)};
    block.InputPort(1).DirectFeedthrough = true;
{second}    block.OutputPort(1).Dimensions = {len(made.commands)};
    block.SampleTimes = [{made.law.period:.17g} 0];
    block.RegBlockMethod('PostPropagationSetup', @allocate);
    block.RegBlockMethod('Start', @start);
    block.RegBlockMethod('Outputs', @outputs);
    block.RegBlockMethod('Update', @update);
end

function allocate(block)
    block.NumDworks = 1;
    block.Dwork(1).Name = 'memory';
    block.Dwork(1).Dimensions = {z + 2};
    block.Dwork(1).DatatypeID = 0;
    block.Dwork(1).Complexity = 'Real';
    block.Dwork(1).UsedAsDiscState = true;
end

function start(block)
    block.Dwork(1).Data = zeros({z + 2}, 1);
end

function outputs(block)
    block.OutputPort(1).Data = double(law_step(memory(block), block.InputPort(1).Data{r}));
end

function update(block)
    [~, s] = law_step(memory(block), block.InputPort(1).Data{r});
    block.Dwork(1).Data = [double(s.z); double(s.running); double(s.stopped)];
end

function s = memory(block)
    kept = block.Dwork(1).Data;
    s = struct('z', {number}(kept(1:end - 2)), 'running', kept(end - 1) ~= 0, 'stopped', kept(end) ~= 0);
end
"""


_BLOCK = """\
% Makes a model with the law as a block, to be copied into one's own; law_step.m and law_sfun.m must be on the path.
law_selftest();
new_system('law_model');
add_block('simulink/User-Defined Functions/Level-2 MATLAB S-Function', 'law_model/law', 'FunctionName', 'law_sfun');
open_system('law_model');
"""

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
