"""Does an exported law answer readings with the very commands that the kernel has for them?"""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.exports.laws import REST, designed, laws
from tests.gains.furuta import RIG
from upright.errors import BadInput
from upright.exports.controller import of_law
from upright.exports.targets import TARGETS
from upright.exports.vector import self_test
from upright.laws import Law, at_work
from upright.simulation import simulate

LAWS = laws()
PASSED = "law: every sample is the expected one"


def needs(tool: str):
    return pytest.mark.skipif(shutil.which(tool) is None, reason=f"{tool} is not on this machine")


def written(name: str, to: str, folder: Path, single: bool = False) -> Path:
    for file, text in TARGETS[to].write(LAWS[name], self_test(LAWS[name]), single).items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text, encoding="utf-8")
    return folder


def said(*command: str | Path, cwd: Path | None = None) -> str:
    done = subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def compiled(folder: Path, *options: str) -> Path:
    sources = [folder / "law.c", folder / "law_selftest.c"]
    said("gcc", "-Wall", "-Wextra", "-Werror", *options, *sources, "-o", folder / "law", "-lm")
    return folder / "law"


@pytest.mark.parametrize("name", LAWS)
def test_the_replay_meets_limit_and_memory(name):
    test = self_test(LAWS[name])
    limit = LAWS[name].law.limit
    at_limit = np.abs(test.commands) == limit
    assert np.ptp(test.commands) > 0
    assert not math.isfinite(limit) or 0 < at_limit.mean() < 0.7


@pytest.mark.parametrize("name", LAWS)
def test_a_law_at_work_on_a_rig_gives_the_kernel_s_commands_bit_for_bit(name):
    """What drives a rig from Python, what simulates it and what is exported are one law."""
    test, law = self_test(LAWS[name]), LAWS[name].law
    step = at_work(replace(law, references=test.references))
    found = [step(k * law.period, y) for k, y in enumerate(test.readings.tolist())]
    np.testing.assert_array_equal(found, test.commands)


@pytest.mark.parametrize("name", LAWS)
def test_python_repeats_every_command_bit_for_bit(name, tmp_path):
    assert PASSED in said(sys.executable, "-I", written(name, "python", tmp_path) / "law.py")


@needs("gcc")
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("single", [False, True], ids=["double", "single"])
def test_c_repeats_every_command(name, single, tmp_path):
    program = compiled(written(name, "c", tmp_path, single), "-std=c99", "-pedantic", "-O2")
    assert PASSED in said(program)


@needs("gcc")
def test_a_processor_that_fuses_products_and_sums_changes_no_bit(tmp_path):
    folder = written("dense", "c", tmp_path)
    assert PASSED in said(compiled(folder, "-std=gnu11", "-O3", "-march=native"))


def x87() -> bool:
    """Whether the compiler can be told to keep more digits than a double has."""
    return shutil.which("gcc") is not None and not subprocess.run(
        ["gcc", "-mfpmath=387", "-E", "-x", "c", "/dev/null"], capture_output=True, check=False
    ).returncode  # fmt: skip


@pytest.mark.skipif(not x87(), reason="gcc makes no code for an x87 here")
def test_a_processor_with_more_digits_is_no_error(tmp_path):
    program = compiled(written("dense", "c", tmp_path), "-std=c99", "-O2", "-mfpmath=387")
    assert PASSED in said(program)


@pytest.mark.parametrize("name", ["filtered", "pid"])
def test_single_precision_moves_a_command_by_a_converter_step_at_most(name):
    """Two parts in a million more, for the step itself is rounded."""
    assert self_test(LAWS[name]).single <= LAWS[name].converter[0] * (1 + 1e-3)


@needs("gcc")
def test_a_law_that_is_off_in_its_last_digit_is_found(tmp_path):
    folder = written("dense", "c", tmp_path)
    law = LAWS["dense"].law
    digits = repr(float(law.D[0, 1]))
    text = (folder / "law.c").read_text()
    assert digits in text
    (folder / "law.c").write_text(text.replace(digits, repr(float(np.nextafter(law.D[0, 1], 9)))))
    wrong = subprocess.run([compiled(folder, "-std=c99")], capture_output=True, text=True, check=False)
    assert wrong.returncode == 1
    assert "is not the expected one" in wrong.stdout


ARDUINO_H = """
#include <avr/io.h>
#include <avr/interrupt.h>
#include <avr/sleep.h>
#define F(text) text
#define __FlashStringHelper char
enum { LOW, HIGH, INPUT_PULLUP, OUTPUT, CHANGE };
static int digitalRead(int) { return 0; }
static void digitalWrite(int, int) {}
static void pinMode(int, int) {}
static int digitalPinToInterrupt(int pin) { return pin; }
static void attachInterrupt(int, void (*)(), int) {}
static void noInterrupts() {}
static void interrupts() {}
struct Port {
  void begin(long) { UBRR0 = 8; UCSR0B = 1 << TXEN0; }
  int available() { return 0; }
  int read() { return -1; }
  void put(char c) { while (!(UCSR0A & (1 << UDRE0))) {} UDR0 = c; }
  void print(const char *text) { while (*text) put(*text++); }
  void println(const char *text) { print(text); put('\\n'); }
  void println(long n) { put('0' + n / 10); put('0' + n % 10); put('\\n'); }
} Serial;
static unsigned long micros() { return 0; }
"""
"""As much of Arduino's core as the sketch calls, on the serial port of an ATmega2560."""


@needs("avr-g++")
@needs("simavr")
@pytest.mark.parametrize("name", ["filtered", "pid"])
def test_an_arduino_mega_passes_its_own_test(name, tmp_path):
    """Whose double has 32 bits; the sketch itself, in a simulator of the processor."""
    folder = written(name, "arduino", tmp_path) / "law"
    (folder / "Arduino.h").write_text(ARDUINO_H)
    main = '#include "Arduino.h"\n#include "law.ino"\n'
    main += "int main() { setup(); loop(); while (!(UCSR0A & (1 << TXC0))) {} cli(); sleep_mode(); return 0; }\n"
    (folder / "main.cpp").write_text(main)
    common = ("-mmcu=atmega2560", "-DF_CPU=16000000UL", "-Os", "-Wall", "-Wextra", "-Werror")
    said("avr-gcc", *common, "-std=gnu11", "-c", "law.c", "-o", "law.o", cwd=folder)
    said("avr-g++", *common, "-std=gnu++11", "main.cpp", "law.o", "-lm", "-o", "law.elf", cwd=folder)
    run = subprocess.run(
        ["simavr", "-m", "atmega2560", "-f", "16000000", "law.elf"], cwd=folder, capture_output=True, text=True,
        timeout=60, check=False,
    )  # fmt: skip
    assert PASSED in run.stdout + run.stderr


@needs("octave-cli")
@pytest.mark.parametrize("name", ["filtered", "pid", "dense"])
def test_octave_repeats_every_command_bit_for_bit(name, tmp_path):
    assert PASSED in said("octave-cli", "--path", written(name, "matlab", tmp_path), "--eval", "law_selftest")


@needs("octave-cli")
def test_octave_in_single_precision_stays_within_what_is_said(tmp_path):
    assert PASSED in said("octave-cli", "--path", written("pid", "matlab", tmp_path, True), "--eval", "law_selftest")


SIMULINK = """
classdef FakeBlock < handle
    properties
        NumDialogPrms; NumInputPorts; NumOutputPorts; SampleTimes; NumDworks;
        InputPort = struct('Dimensions', {0, 0}, 'DirectFeedthrough', {0, 0}, 'Data', {[], []});
        OutputPort = struct('Dimensions', 0, 'Data', []);
        Dwork = struct('Name', '', 'Dimensions', 0, 'DatatypeID', 0, 'Complexity', '', 'UsedAsDiscState', 0, ...
                       'Data', []);
        SetPreCompInpPortInfoToDynamic; SetPreCompOutPortInfoToDynamic;
        methods_ = struct();
    end
    methods
        function RegBlockMethod(b, name, f)
            b.methods_.(name) = f;
        end
        function call(b, name)
            f = b.methods_.(name);
            f(b);
        end
    end
end
"""
"""What of Simulink's block object the S-function touches."""


@needs("octave-cli")
def test_the_s_function_keeps_the_memory_from_sample_to_sample(tmp_path):
    """Its callbacks in the order in which Simulink calls them; nothing free runs Simulink itself."""
    folder = written("filtered", "simulink", tmp_path)
    (folder / "FakeBlock.m").write_text(SIMULINK)
    test = self_test(LAWS["filtered"])
    rows = np.hstack([test.readings, test.references, test.commands])
    np.savetxt(folder / "rows.txt", rows, fmt="%.17g")
    script = """
b = FakeBlock(); rows = load('rows.txt'); law_sfun(b); b.call('PostPropagationSetup'); b.call('Start');
for k = 1:size(rows, 1)
  b.InputPort(1).Data = rows(k, 1:2).'; b.InputPort(2).Data = rows(k, 3);
  b.call('Outputs'); b.call('Outputs'); b.call('Update');
  if b.OutputPort(1).Data ~= rows(k, 4), error('sample %d', k); end
end
printf('%g %d\\n', b.SampleTimes(1), k);
"""
    (folder / "drive.m").write_text(script)
    assert said("octave-cli", "--eval", "drive", cwd=folder).split() == ["0.002", str(len(rows))]


GOOD = 4
"""Samples before each bad one."""
BAD = ("nan", "inf", "-inf")


def interrupted(name: str) -> tuple[list[str], np.ndarray]:
    """Lines of samples, "start" where the law is restarted, and the commands that every program has for them.

    Every input (readings, then references) is NaN, Inf and -Inf once, after good samples and before others. Good ones
    are answered as in the replay until the bad one comes, with zero from there on, and as in the replay after a start.
    """
    test = self_test(LAWS[name])
    good = np.hstack([test.readings, test.references])[:GOOD]
    rows = [[repr(x) for x in row] for row in good.tolist()]
    lines, commands, zero = [], [], np.zeros_like(test.commands[:1])
    for i in range(good.shape[1]):
        for bad in BAD:
            last = [*rows[-1][:i], bad, *rows[-1][i + 1 :]]
            lines += ["start", *(" ".join(row) for row in (*rows, last, *rows))]
            commands += [test.commands[:GOOD], *[zero] * (1 + GOOD)]
    lines += ["start", *(" ".join(row) for row in rows)]
    return lines, np.vstack([*commands, test.commands[:GOOD]])


@pytest.mark.parametrize("name", LAWS)
def test_python_gives_zero_after_a_reading_that_is_no_number(name, tmp_path):
    lines, expected = interrupted(name)
    scope: dict[str, object] = {"__name__": "law"}
    exec((written(name, "python", tmp_path) / "law.py").read_text(encoding="utf-8"), scope)
    commands, run, p = [], None, len(LAWS[name].readings)
    for line in lines:
        if line == "start":
            run = scope["Law"]()  # type: ignore[operator]
        else:
            values = [float(word) for word in line.split()]
            commands.append(run.step(values[:p], values[p:]))
    np.testing.assert_array_equal(commands, expected)


DRIVER = """
#include "law.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
int main(void)
{
    char word[64];
    double in[LAW_READINGS + LAW_REFERENCES];
    law_real y[LAW_READINGS], r[LAW_REFERENCES + 1], u[LAW_COMMANDS];
    law_state s;
    int i = 0, j;
    while (scanf("%63s", word) == 1) {
        if (strcmp(word, "start") == 0) {
            law_start(&s);
            continue;
        }
        in[i++] = strtod(word, 0);
        if (i < LAW_READINGS + LAW_REFERENCES)
            continue;
        for (i = 0; i < LAW_READINGS; i++)
            y[i] = (law_real)in[i];
        for (i = 0; i < LAW_REFERENCES; i++)
            r[i] = (law_real)in[LAW_READINGS + i];
        law_step(&s, y, r, u);
        for (j = 0; j < LAW_COMMANDS; j++)
            printf("%.17g ", (double)u[j]);
        printf("\\n");
        i = 0;
    }
    return 0;
}
"""
"""Hands samples from its input to the law; compiled by itself, so that options for the law are the law's alone."""


def driven(folder: Path, lines: list[str], *options: str) -> np.ndarray:
    """Commands of the C law in a folder."""
    (folder / "driver.c").write_text(DRIVER)
    said("gcc", "-std=c99", *options, "-c", folder / "law.c", "-o", folder / "law.o")
    said("gcc", "-std=c99", "-O1", "-c", folder / "driver.c", "-o", folder / "driver.o")
    said("gcc", folder / "driver.o", folder / "law.o", "-o", folder / "driver", "-lm")
    done = subprocess.run(
        [folder / "driver"], input="\n".join(lines), capture_output=True, text=True, timeout=60, check=True
    )
    return np.loadtxt(done.stdout.splitlines(), ndmin=2)


@needs("gcc")
@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("single", [False, True], ids=["double", "single"])
@pytest.mark.parametrize("options", ["-O2", "-O3 -ffast-math"])
def test_c_gives_zero_after_a_reading_that_is_no_number(name, single, options, tmp_path):
    """Whatever the compiler takes for granted of comparisons and of the order of sums."""
    lines, expected = interrupted(name)
    commands = driven(written(name, "c", tmp_path, single), lines, *options.split())
    exact = not single and options == "-O2"
    step = LAWS[name].converter.max()  # sums in another order may round to the next step
    np.testing.assert_allclose(commands, expected, rtol=0, atol=0 if exact else self_test(LAWS[name]).single + step)
    np.testing.assert_array_equal(commands[(expected == 0).all(axis=1)], 0.0)


OCTAVE = """
s = []; file = fopen('lines.txt');
while ischar(line = fgetl(file))
  if strcmp(line, 'start'), s = []; continue; end
  v = sscanf(line, '%f');
  if numel(v) > COUNT, [u, s] = law_step(s, v(1:COUNT), v(COUNT + 1:end)); else, [u, s] = law_step(s, v); end
  printf('%.17g ', u); printf('\\n');
end
"""


@needs("octave-cli")
@pytest.mark.parametrize("name", ["pid", "dense"])
@pytest.mark.parametrize("single", [False, True], ids=["double", "single"])
def test_octave_gives_zero_after_a_reading_that_is_no_number(name, single, tmp_path):
    """Whose `max(NaN, -limit)` is the largest command there is."""
    lines, expected = interrupted(name)
    folder = written(name, "matlab", tmp_path, single)
    (folder / "lines.txt").write_text("\n".join(lines) + "\n")
    (folder / "drive.m").write_text(OCTAVE.replace("COUNT", str(len(LAWS[name].readings))))
    commands = np.loadtxt(said("octave-cli", "--eval", "drive", cwd=folder).splitlines(), ndmin=2)
    np.testing.assert_allclose(commands, expected, rtol=0, atol=self_test(LAWS[name]).single if single else 0)
    np.testing.assert_array_equal(commands[(expected == 0).all(axis=1)], 0.0)


@needs("octave-cli")
def test_the_s_function_gives_zero_until_the_model_is_started_again(tmp_path):
    folder = written("filtered", "simulink", tmp_path)
    (folder / "FakeBlock.m").write_text(SIMULINK)
    test = self_test(LAWS["filtered"])
    rows = np.hstack([test.readings, test.references, test.commands])[:GOOD]
    np.savetxt(folder / "rows.txt", rows, fmt="%.17g")
    script = """
b = FakeBlock(); rows = load('rows.txt'); law_sfun(b); b.call('PostPropagationSetup');
for bad = [NaN, Inf, -Inf]
  b.call('Start');
  for k = [1:size(rows, 1), -1, 1:size(rows, 1)]
    y = rows(abs(k), 1:2).'; if k < 0, y(2) = bad; end
    b.InputPort(1).Data = y; b.InputPort(2).Data = rows(abs(k), 3);
    b.call('Outputs'); b.call('Update'); printf('%.17g\\n', b.OutputPort(1).Data);
  end
end
"""
    (folder / "drive.m").write_text(script)
    found = [float(line) for line in said("octave-cli", "--eval", "drive", cwd=folder).splitlines()]
    assert found == [*rows[:, 3].tolist(), *[0.0] * (1 + GOOD)] * 3


@needs("gcc")
@pytest.mark.parametrize("reading", ["1e308", "-1e308"])
def test_a_command_that_overflows_is_none(reading, tmp_path):
    """-3.3 times 1e308 is beyond the largest double, 1.8e308: there is no such command."""
    lines = ["start", "1.0", reading, "1.0", "start", "1.0"]
    commands = [-3.3, 0.0, 0.0, -3.3]
    assert driven(written("proportional", "c", tmp_path), lines, "-O2")[:, 0].tolist() == commands
    scope: dict[str, object] = {"__name__": "law"}
    exec((written("proportional", "python", tmp_path) / "law.py").read_text(encoding="utf-8"), scope)
    run = scope["Law"]()  # type: ignore[operator]
    assert [run.step([float(y)])[0] for y in lines[1:4]] == commands[:3]


FORGETFUL = {
    "c": ("law.c", "s->stopped = 1;", "s->stopped = 0;"),
    "python": ("law.py", "self.stopped = True", "self.stopped = False"),
    "matlab": ("law_step.m", "s.stopped = true;", "s.stopped = false;"),
}
"""How each program would forget a bad reading."""


@pytest.mark.parametrize(
    "to", ["python", pytest.param("c", marks=needs("gcc")), pytest.param("matlab", marks=needs("octave-cli"))]
)
def test_the_replay_finds_a_law_that_forgets_a_bad_reading(to, tmp_path):
    folder = written("filtered", to, tmp_path)
    file, latched, forgotten = FORGETFUL[to]
    text = (folder / file).read_text(encoding="utf-8")
    assert latched in text
    (folder / file).write_text(text.replace(latched, forgotten), encoding="utf-8")
    if to == "c":
        command = [compiled(folder, "-std=c99")]
    else:
        command = {"python": [sys.executable, "-I", folder / "law.py"]}.get(
            to, ["octave-cli", "--path", folder, "--eval", "law_selftest"]
        )
    wrong = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=60, check=False)
    assert wrong.returncode == 1
    assert "is not the expected one; do not run it" in wrong.stdout + wrong.stderr


def test_the_module_holds_the_simulated_rig_with_the_kernel_s_commands(tmp_path):
    """Closed loop of the nonlinear rig: what its encoders showed, given to the Python module, one by one."""
    law = replace(designed("filtered"), **REST, command_resolution=1e-3)
    x0 = RIG.state("inverted", theta=math.pi + 0.03)
    motion = simulate(RIG, {}, x0, None, law.period, samples=500, substeps=2, loop=law)[:, :, 0]
    resolution = REST["resolution"]
    readings = np.floor(motion[:, [0, 2]] * (1.0 / resolution) + 0.5) * resolution
    scope: dict[str, object] = {}
    exec(TARGETS["python"].write(of_law(law), self_test(of_law(law)), False)["law.py"], scope)
    run = scope["Law"]()  # type: ignore[operator]
    commands = [run.step(y, [0.0])[0] for y in readings.tolist()]
    assert commands == motion[:, 4].tolist()
    assert abs(motion[-1, 2] - math.pi) < 2e-2


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (None, "takes design.json"),
        (Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), [[1.0]]), "sample period"),
        (Law(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1, 7)), period=0.1), "a batch of 7"),
        ([1.0, 2.0], "state_feedback"),
    ],
)
def test_what_cannot_be_exported_is_refused_with_what_to_try(law, words):
    with pytest.raises(BadInput, match=words):
        of_law(law)


@needs("gcc")
def test_a_name_cannot_end_the_comment_that_it_stands_in(tmp_path):
    strange = ('*/ int x; /*"""', "\n%{\\")
    made = of_law(replace(LAWS["filtered"].law, measured=strange))
    test = self_test(made)
    for to in ("c", "python"):
        for file, text in TARGETS[to].write(made, test, False).items():
            (tmp_path / file).write_text(text, encoding="utf-8")
    assert PASSED in said(compiled(tmp_path, "-std=c99"))
    assert PASSED in said(sys.executable, "-I", tmp_path / "law.py")
