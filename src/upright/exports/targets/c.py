"""A law in C99 without libraries or memory of its own: header, source, and a replay that tells whether it is right."""

from __future__ import annotations

import numpy as np

from upright.exports import rule
from upright.exports.arithmetic import Language, check_inputs, output_lines, statements
from upright.exports.controller import SampledController, identifiers
from upright.exports.targets import LawTarget
from upright.exports.vector import ReplayVector
from upright.laws import Rule
from upright.laws.linear import Array

_EXACT = """\
/* Products and sums are rounded one by one, as where the law was designed; a processor's fused ones differ in bits. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract(off)
#endif
"""


def _files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name."""
    return {
        "law.h": header(made, single=single),
        "law.c": c_source(made, single=single),
        "law_selftest.h": selftest_header(test, single=single),
        "law_selftest.c": _MAIN,
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
    return f"""\
/* {made.title}, written by upright export.

{about} */
#ifndef LAW_H
#define LAW_H

#ifdef __cplusplus
extern "C" {{
#endif

typedef {"float" if single else "double"} law_real;

#define LAW_PERIOD {constant(made.law.period, single)} /* between two samples [s] */
#define LAW_READINGS {len(made.readings)}
#define LAW_REFERENCES {len(made.references)}
#define LAW_COMMANDS {len(made.commands)}
{steps}
typedef struct {{
    law_real z[{max(made.memories, 1)}];
    {"unsigned long samples" if isinstance(made.law, Rule) else "int running"};
    int stopped; /* by a reading, reference or command that is not finite: every command is zero until law_start */
}} law_state;

/* Before the first sample: forget, so that no jump is taken for a speed. */
void law_start(law_state *s);

/* One sample: {"; ".join(listed)}. */
void law_step(law_state *s, const law_real *y, const law_real *r, law_real *u);

#ifdef __cplusplus
}}
#endif
#endif
"""


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
    if isinstance(made.law, Rule):
        return _of_rule(made, check_inputs(made, say), output_lines(made, say), single=single)
    body = "\n".join(f"    {line}".replace("law_real beyond", "int beyond") for line in statements(made, say))
    unused = "" if made.references else "    (void)r;\n"
    return f"""\
/* {made.title}, written by upright export; see law.h. */
{_EXACT}
#include "law.h"

#include <float.h>
#include <math.h>
#include <stdint.h>

{_stop(single)}
void law_start(law_state *s)
{{
    unsigned i;
    for (i = 0; i < sizeof s->z / sizeof s->z[0]; i++)
        s->z[i] = 0;
    s->running = 0;
    s->stopped = 0;
}}

void law_step(law_state *s, const law_real *y, const law_real *r, law_real *u)
{{
{unused}{body}
    s->running = 1;
}}
"""


def _stop(single: bool) -> str:
    return f"""\
/* By its bits, since compilers may take it for granted that comparisons meet no NaN (-ffast-math). */
static int is_finite(law_real x)
{{
#if {"FLT" if single else "DBL"}_MANT_DIG == 24
    union {{ law_real value; uint32_t bits; }} as;
    const uint32_t exponent = 0x7f800000;
#else
    union {{ law_real value; uint64_t bits; }} as;
    const uint64_t exponent = 0x7ff0000000000000;
#endif
    as.value = x;
    return (as.bits & exponent) != exponent;
}}

static void stop(law_state *s, law_real *u)
{{
    int j;
    s->stopped = 1;
    for (j = 0; j < LAW_COMMANDS; j++)
        u[j] = 0;
}}
"""


def _of_rule(made: SampledController, first: list[str], last: list[str], *, single: bool) -> str:
    inputs, states = len(made.commands), made.memories
    parameters, initial = (", ".join(constant(x, False) for x in values) or "0" for values in rule.rule_numbers(made))
    commands = "\n".join(f"    law_real c{j} = found[{j}];" for j in range(inputs))
    checked, body = ("\n".join(f"    {line}" for line in lines) for lines in (first, last))
    copied = "for (i = 0; i < LAW_REFERENCES; i++)\n        asked[i] = r[i];" if made.references else "(void)r;"
    return f"""\
/* {made.title}, written by upright export; see law.h. */
{_EXACT}
#include "law.h"

#include <float.h>
#include <math.h>
#include <stdint.h>

{_stop(single)}
{rule.in_c(made)}
static double parameters[] = {{{parameters}}};
static const double initial[] = {{{initial}}};

void law_start(law_state *s)
{{
    unsigned i;
    for (i = 0; i < sizeof initial / sizeof initial[0]; i++)
        s->z[i] = initial[i];
    s->samples = 0;
    s->stopped = 0;
}}

void law_step(law_state *s, const law_real *y, const law_real *r, law_real *u)
{{
    double given[LAW_READINGS], asked[LAW_REFERENCES + 1] = {{0}}, found[{inputs + states}];
    int i;
{checked}
    for (i = 0; i < LAW_READINGS; i++)
        given[i] = y[i];
    {copied}
    k_rule(s->samples * LAW_PERIOD, given, asked, s->z, parameters, found);
{commands}
{body}
    for (i = 0; i < {states}; i++)
        s->z[i] = found[{inputs} + i];
    s->samples++;
}}
"""


def selftest_header(test: ReplayVector, *, single: bool) -> str:
    """Text of ``law_selftest.h``."""
    count = len(test.readings)
    readings = _table("given", test.readings, single)
    references = _table("asked", test.references, single) if test.references.shape[1] else ""
    reference, at_first = ("asked[k]", "asked[0]") if references else ("0", "0")
    exact = "0" if single else "LAW_EXACT"
    return f"""\
/* {count} samples with the commands that upright's own kernel answers, to be replayed wherever the law runs. */
#ifndef LAW_SELFTEST_H
#define LAW_SELFTEST_H

#include "law.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Bit for bit in double precision. In single precision, where double means single, and on processors that keep more
   digits than a double has (FLT_EVAL_METHOD), rounding may add up to: */
#define LAW_SINGLE_MISSES {constant(test.single, single)}
#if defined(FLT_EVAL_METHOD) && (FLT_EVAL_METHOD < 0 || FLT_EVAL_METHOD > 1)
#define LAW_EXACT 0
#else
#define LAW_EXACT (sizeof(law_real) >= 8)
#endif

/* The first sample whose command is not the expected one, -1 when all are.
   Behind the samples comes a reading that is not finite, and a good one: both commands are zero, until a new start. */
static long law_selftest(void)
{{
{readings}{references}{_table("expected", test.commands, single)}\
    const law_real allowed = ({exact}) ? 0 : LAW_SINGLE_MISSES;
    static const law_real bad[] = {{NAN, INFINITY, -INFINITY}}, zero[LAW_COMMANDS] = {{0}};
    law_real y[LAW_READINGS], u[LAW_COMMANDS];
    law_state s;
    long k;
    int j, run;
    for (run = 0; run < 3 * LAW_READINGS; run++) {{
        law_start(&s);
        for (k = 0; k < {count}; k++) {{
            law_step(&s, given[k], {reference}, u);
            for (j = 0; j < LAW_COMMANDS; j++) {{
                const law_real off = u[j] - expected[k][j];
                if (!(off <= allowed && -off <= allowed))
                    return k;
            }}
        }}
        memcpy(y, given[0], sizeof y);
        y[run / 3] = bad[run % 3];
        law_step(&s, y, {at_first}, u);
        if (memcmp(u, zero, sizeof u) != 0)
            return {count};
        law_step(&s, given[0], {at_first}, u);
        if (memcmp(u, zero, sizeof u) != 0)
            return {count + 1};
    }}
    return -1;
}}

#endif
"""


_MAIN = """\
/* cc -std=c99 -O2 law.c law_selftest.c -lm && ./a.out */
#include "law_selftest.h"

#include <stdio.h>

int main(void)
{
    const long wrong = law_selftest();
    if (wrong >= 0) {
        printf("law: sample %ld is not the expected one; do not run it\\n", wrong);
        return 1;
    }
    printf("law: every sample is the expected one\\n");
    return 0;
}
"""


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
