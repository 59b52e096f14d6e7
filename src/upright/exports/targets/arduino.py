"""A law as an Arduino sketch: the C files, and a loop that tests itself before it reads an encoder."""

from __future__ import annotations

from upright.exports.controller import SampledController, identifiers
from upright.exports.targets import LawTarget, c
from upright.exports.vector import ReplayVector
from upright.laws import Rule


def files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name, in the folder ``law`` that the sketch has to be called after."""
    texts = c.files(made, test, single=single)
    del texts["law_selftest.c"]
    return {f"law/{name}": text for name, text in {"law.ino": sketch(made), **texts}.items()}


def sketch(made: SampledController) -> str:
    """Text of ``law.ino``."""
    names, steps = identifiers(made.readings), made.encoder.tolist()
    read = "\n".join(
        f"  y[{i}] = counts_of({i}) * " + (f"LAW_STEP_{name.upper()};" if step else "1;  // FILL IN: reading per count")
        for i, (name, step) in enumerate(zip(names, steps, strict=True))
    )
    encoders = ", ".join(f"{i} is {name}" for i, name in enumerate(made.readings))
    reference = "  law_real r[LAW_REFERENCES] = {0};  // FILL IN: what it shall follow\n" if made.references else ""
    return f"""\
// {made.title}, written by upright export; see law.h.
// On boards whose double has 32 bits (Uno, Mega, Nano) the law runs in single precision.
#include "law.h"
#include "law_selftest.h"

static law_state state;
static unsigned long next_sample;

// FILL IN: counts of an encoder, zero where its coordinate is zero; {encoders}.
static long counts_of(int encoder) {{
  (void)encoder;
  return 0;
}}

// FILL IN: put the commands out{f" [{made.command_unit}]" if made.command_unit else ""}.
static void put_out(const law_real *u) {{
  (void)u;
}}

void setup() {{
  Serial.begin(115200);
  const long wrong = law_selftest();
  if (wrong >= 0) {{
    Serial.print(F("law: sample is not the expected one, nothing runs: "));
    Serial.println(wrong);
    for (;;) {{
    }}
  }}
  Serial.println(F("law: every sample is the expected one"));
  law_start(&state);
  next_sample = micros();
}}

void loop() {{
  if ((long)(micros() - next_sample) < 0) return;
  next_sample += {round(1e6 * made.law.period)}UL;
  law_real y[LAW_READINGS], u[LAW_COMMANDS];
{reference}{read}
  law_step(&state, y, {"r" if made.references else "0"}, u);
  put_out(u);
}}
"""


def _narrow(made: SampledController, miss: str) -> str:
    """That some boards have no double precision."""
    where = "On boards whose double has 32 bits"
    if isinstance(made.law, Rule):
        return f"{where} (Uno, Mega, Nano) the self-test may fail, and nothing runs."
    return f"{where} commands may miss by {miss}."


TARGET = LawTarget(
    name="arduino", order=15, title="an Arduino sketch", write=files,
    rules=True, warn=_narrow,
    test="arduino-cli compile --upload -b arduino:avr:uno -p PORT {folder}/law && arduino-cli monitor -p PORT "
    "-c baudrate=115200",
    onward="Fill in counts_of and put_out in law.ino; until then it reads zeros and puts nothing out.",
)  # fmt: skip
