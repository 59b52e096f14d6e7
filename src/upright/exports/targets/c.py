"""A law in C99 without libraries or memory of its own: header, source, and a replay that tells whether it is right."""

from __future__ import annotations

import numpy as np

from upright.exports import rule
from upright.exports.arithmetic import Language, check_inputs, output_lines, statements
from upright.exports.controller import SampledController, identifiers
from upright.exports.targets import LawTarget
from upright.exports.texts import filled, indented
from upright.exports.vector import ReplayVector
from upright.laws import Rule
from upright.laws.linear import Array


def _files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name."""
    return {
        "law.h": header(made, single=single),
        "law.c": c_source(made, single=single),
        "law_selftest.h": selftest_header(test, single=single),
        "law_selftest.c": filled("law_selftest.c"),
    }


def header(made: SampledController, *, single: bool) -> str:
    """Text of ``law.h``."""
    names, units = identifiers(made.readings), [_in(unit) for unit in made.reading_units]
    steps = "".join(
        f"#define LAW_STEP_{name.upper()} {constant(sign * step, single)} "
        f"/* reading per count of the encoder{unit} */\n"
        for name, step, unit, sign in zip(names, made.encoder.tolist(), units, made.signs, strict=True)
        if step
    )
    listed = [f"y[{i}] is {name}{unit}" for i, (name, unit) in enumerate(zip(names, units, strict=True))]
    listed += [f"r[{c}] is {name}" for c, name in enumerate(made.references)]
    listed += [f"u[{j}] is {name}{_in(made.command_unit)}" for j, name in enumerate(made.commands)]
    about = "\n".join(f"   {fact}" for fact in made.facts)
    return filled(
        "law.h.in", title=made.title, about=about, real="float" if single else "double",
        period=constant(made.law.needed_period, single), readings=len(made.readings), references=len(made.references),
        commands=len(made.commands), steps=steps, memories=max(made.memories, 1), listed="; ".join(listed),
        progress="unsigned long samples" if isinstance(made.law, Rule) else "int running",
    )  # fmt: skip


def c_source(made: SampledController, *, single: bool) -> str:
    """Text of ``law.c``."""
    f = "f" if single else ""
    say = Language(
        number=lambda x: constant(x, single), reading="y[{}]".format, reference="r[{}]".format,
        memory="s->z[{}]".format, command="u[{}]".format, let="law_real ", end=";", remark="/* {} */".format,
        floor=f"floor{f}", absolute=f"fabs{f}",
        limited=lambda c, most: f"{c} > {most} ? {most} : {c} < -{most} ? -{most} : {c}",
        first=lambda lines: ["if (!s->running) {", *(f"    {line}" for line in lines), "}"],
        hold=lambda line: ["if (!beyond)", f"    {line}"], either="||",
        stopped="s->stopped", not_finite="!is_finite({})".format,
        stop=lambda when: [f"if ({when}) {{", "    stop(s, u);", "    return;", "}"],
    )  # fmt: skip
    rules = isinstance(made.law, Rule)
    functions = _of_rule(made, check_inputs(made, say), output_lines(made, say)) if rules else filled(
        "linear.c.in", unused="" if made.references else "    (void)r;\n",
        body=indented(statements(made, say)).replace("law_real beyond", "int beyond"),
    )  # fmt: skip
    return filled("law.c.in", title=made.title, real="FLT" if single else "DBL", functions=functions)


def _of_rule(made: SampledController, first: list[str], last: list[str]) -> str:
    inputs, states = len(made.commands), made.memories
    parameters, initial = (", ".join(constant(x, False) for x in values) or "0" for values in rule.rule_numbers(made))
    copied = "for (i = 0; i < LAW_REFERENCES; i++)\n        asked[i] = r[i];" if made.references else "(void)r;"
    return filled(
        "rule.c.in", rule=rule.in_c(made), parameters=parameters, initial=initial, numbers=inputs + states,
        checked=indented(first), body=indented(last), copied=copied, inputs=inputs, states=states,
        commands=indented(f"law_real c{j} = found[{j}];" for j in range(inputs)),
    )  # fmt: skip


def selftest_header(test: ReplayVector, *, single: bool) -> str:
    """Text of ``law_selftest.h``."""
    count = len(test.readings)
    readings = _table("given", test.readings, single)
    references = _table("asked", test.references, single) if test.references.shape[1] else ""
    reference, at_first = ("asked[k]", "asked[0]") if references else ("0", "0")
    return filled(
        "law_selftest.h.in", count=count, beyond=count + 1, misses=constant(test.single, single), readings=readings,
        references=references, expected=_table("expected", test.commands, single), reference=reference,
        at_first=at_first, exact="0" if single else "LAW_EXACT",
    )  # fmt: skip


def constant(x: float, single: bool) -> str:
    """A constant in C, to its last bit: the shortest decimals that are read as the same number."""
    return f"{float(x)!r}f" if single else repr(float(x))


def _in(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _table(name: str, rows: Array, single: bool) -> str:
    body = "".join(f"        {{{', '.join(constant(x, single) for x in row)}}},\n" for row in np.asarray(rows).tolist())
    return f"    static const law_real {name}[{len(rows)}][{rows.shape[1]}] = {{\n{body}    }};\n"


TARGET = LawTarget(
    name="c", order=10, title="C99", write=_files, rules=True,
    test="cd {folder} && cc -std=c99 -O2 law.c law_selftest.c -lm && ./a.out",
    onward="Call law_start once and law_step at every sample.",
)  # fmt: skip
