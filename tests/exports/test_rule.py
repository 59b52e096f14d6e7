"""Does an exported rule answer readings with the very commands that the kernel has for them?"""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from math import asin, atan2, cos, exp, floor, log, pi, sin, sqrt, tanh

import numpy as np
import pytest

import upright as up
from upright.control import design_swing_up
from upright.errors import BadInput
from upright.exports.controller import of_law
from upright.exports.targets import TARGETS
from upright.exports.vector import self_test
from upright.laws import Rule
from upright.laws.values import as_values, of_values
from upright.rig.makes import make_rig

PASSED = "law: every sample is the expected one"
COMPILER = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not on this machine")


def swing_up():
    """The law that swings a pendulum up and holds it."""
    rig = make_rig("furuta", 3)
    hanging = np.zeros(2 * len(rig.plant.coordinates))
    return replace(design_swing_up(rig).rule(rig, hanging), limit=4.0)


def everything(t, y, r, z, p):
    """Each construct of the language, and each kind of function."""
    e = p[0] * (1 - cos(y[0])) + 0.5 * z[1] ** 2 + 1e-3 * y[0] ** 7
    speed: float = (y[0] - z[0]) / 0.02
    k, total = 0, 0.0
    for angle in y:
        total += angle
    while total > 0.3 and k < 7:
        total -= 0.1 * exp(-total)
        k += 1
    for i in range(1, k):
        if i == 5:
            break
        total = total + i // 2 - (i - 3) % 2 - (total // 0.7) * 1e-3 + total % 0.3 + (-i) // 2 + -i % 3
        k -= 1
    n = -7 // 2 + len(y) + i if k > 1 else 0
    if abs(e) > 1.0:
        return (min(e, 3.0, y[-1]) + tanh(speed) * r[0] + n, max(y) / 7 + 1e-3 * e), (y[0], speed)
    elif sin(40 * t) > 0.5 or not total < 1e9:
        total /= 2
    a, b = y
    last = speed + asin(sin(b)) + floor(a) * pi / 100
    return (atan2(a, 1 + b * b) + log(1 + a * a) * round(total) + k, 0.1 * sqrt(abs(a)) ** 3 + total), (y[0], last)


def relay(t, y, r, z, p):
    """No parameters, and what it remembers handed on."""
    return (1.0 if y[0] > 0.0 else -1.0,), z


MIXED = Rule(
    function=everything, initial=[0.0, 0.1], parameters=[0.3], measured=("theta", "psi"), period=2e-3,
    references=[[0.0]], limit=2.0, command_resolution=[0.001, 0.0], resolution=[2 * pi / 4096, 0.0],
)  # fmt: skip
RULES = {"swing-up": swing_up, "everything": lambda: MIXED, "relay": lambda: BARE}
BARE = Rule(function=relay, measured=("x",), period=0.01)


def written(rule, to, folder):
    made = of_law(rule)
    for file, text in TARGETS[to].write(made, self_test(made), False).items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    return folder


def said(*command):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("name", RULES)
def test_python_repeats_every_command_bit_for_bit(name, tmp_path):
    assert PASSED in said(sys.executable, "-I", written(RULES[name](), "python", tmp_path) / "law.py")


@pytest.mark.parametrize("options", [["-std=c99", "-pedantic", "-O2"], ["-std=gnu11", "-O3", "-march=native"]])
@pytest.mark.parametrize(
    "compiler",
    [pytest.param(c, marks=pytest.mark.skipif(shutil.which(c) is None, reason=f"no {c}")) for c in ("gcc", "clang")],
)
@pytest.mark.parametrize("name", RULES)
def test_c_repeats_every_command_bit_for_bit(name, compiler, options, tmp_path):
    folder = written(RULES[name](), "c", tmp_path)
    sources = [folder / "law.c", folder / "law_selftest.c"]
    said(compiler, "-Wall", "-Wextra", "-Werror", *options, *sources, "-o", folder / "law", "-lm")
    assert PASSED in said(folder / "law")


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_python_gives_zero_after_a_reading_that_is_no_number(bad, tmp_path):
    """The relay itself would give -1 for NaN, since NaN is not above zero."""
    scope = {"__name__": "law"}
    exec((written(BARE, "python", tmp_path) / "law.py").read_text(encoding="utf-8"), scope)
    run = scope["Law"]()
    assert [run.step([y]) for y in (2.0, -2.0, bad, 2.0, -2.0)] == [[1.0], [-1.0], [0.0], [0.0], [0.0]]
    assert scope["Law"]().step([2.0]) == [1.0]


RELAY = """
#include "law.h"
#include <math.h>
int main(void)
{
    const double bad[] = {NAN, INFINITY, -INFINITY}, plus = 2.0, minus = -2.0;
    double u;
    law_state s;
    int i;
    for (i = 0; i < 3; i++) {
        law_start(&s);
        law_step(&s, &plus, 0, &u);
        if (u != 1.0) return 1;
        law_step(&s, &bad[i], 0, &u);
        if (u != 0.0) return 2;
        law_step(&s, &minus, 0, &u);
        if (u != 0.0) return 3;
    }
    return 0;
}
"""


@COMPILER
@pytest.mark.parametrize("options", [["-O2"], ["-O3", "-ffast-math"]])
def test_c_gives_zero_after_a_reading_that_is_no_number(options, tmp_path):
    folder = written(BARE, "c", tmp_path)
    (folder / "main.c").write_text(RELAY)
    said("gcc", "-std=c99", *options, "-c", folder / "law.c", "-o", folder / "law.o")
    said("gcc", "-std=c99", folder / "main.c", folder / "law.o", "-o", folder / "main", "-lm")
    said(folder / "main")


@pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="no avr-gcc")
def test_an_arduino_s_compiler_takes_it(tmp_path):
    folder = written(MIXED, "arduino", tmp_path) / "law"
    options = ["-mmcu=atmega328p", "-std=gnu11", "-Os", "-Wall", "-Wextra", "-Werror"]
    said("avr-gcc", *options, "-c", folder / "law.c", "-o", folder / "law.o")


@COMPILER
def test_another_parameter_is_found(tmp_path):
    folder = written(MIXED, "c", tmp_path)
    text = (folder / "law.c").read_text()
    assert "parameters[] = {0.3}" in text
    (folder / "law.c").write_text(text.replace("parameters[] = {0.3}", f"parameters[] = {{{0.3 * (1 + 1e-9)!r}}}"))
    said("gcc", folder / "law.c", folder / "law_selftest.c", "-o", folder / "law", "-lm")
    assert subprocess.run([folder / "law"], capture_output=True, check=False).returncode == 1


def test_the_replay_takes_every_branch():
    """The same function, called by Python alone, switches as the kernel's commands do."""
    made = of_law(MIXED)
    test = self_test(made)
    commands, memory = replace(MIXED, references=test.references).follow(test.readings, MIXED.period)
    assert np.abs(np.clip(commands, -2.0, 2.0) - test.commands).max() <= 0.001
    assert len(np.unique(test.commands[:, 0])) > 20
    assert np.ptp(memory[:, 1]) > 1.0


def test_the_verb_writes_a_sketch_and_says_what_a_mega_does_not(tmp_path):
    done = up.export(MIXED, to="arduino", out=tmp_path)
    assert (tmp_path / "law" / "law.ino").exists()
    assert "double has 32 bits (Mega) the self-test may fail" in str(done)


@pytest.mark.parametrize(
    ("rule", "how", "sentence"),
    [
        (replace(BARE, measured=()), {"to": "c"}, r"needs the names of its readings: replace\(rule, measured="),
        (replace(BARE, period=None), {"to": "c"}, "needs its sample period"),
        (replace(BARE, parameters=np.ones((1, 2))), {"to": "c"}, "a batch of 2"),
        (BARE, {"to": "matlab"}, "a rule is exported to c, arduino, python, in double precision only.* got matlab"),
        (BARE, {"to": "c", "single": True}, "got single"),
        (replace(MIXED, measured=("theta",)), {"to": "c"}, "the rule stops at readings of zero: ValueError"),
    ],
)
def test_what_cannot_be_written_is_said(rule, how, sentence, tmp_path):
    with pytest.raises(BadInput, match=sentence):
        up.export(rule, out=tmp_path, **how)


def nested(t, y, r, z, p):
    pair = (y[0], (t, 1.0))
    return (pair[1][0],), ()


def held_out(t, y, r, z, p):
    u = (1.0,)
    return u, ()


@pytest.mark.parametrize("function", [nested, held_out])
def test_what_c_has_no_words_for_goes_to_python_only(function, tmp_path):
    rule = Rule(function=function, measured=("x",), period=0.01)
    with pytest.raises(BadInput, match=r"which cannot be translated to C.* or export it to python"):
        written(rule, "c", tmp_path)
    assert PASSED in said(sys.executable, "-I", written(rule, "python", tmp_path) / "law.py")


def test_names_and_period_are_kept_with_the_law():
    again = of_values(as_values(MIXED))
    assert (again.measured, again.period) == (MIXED.measured, MIXED.period)
