"""A law as an Arduino sketch: the C files, encoders and an H-bridge, and a loop with limits that tests itself first."""

from __future__ import annotations

from string import Template

from upright.exports.controller import SampledController, identifiers
from upright.exports.targets import LawTarget, c
from upright.exports.vector import ReplayVector
from upright.laws import Law, Rule

_TRAVEL, _SPEED, _START = ({"rad": a, "m": b} for a, b in ((3.0, 0.3), (40.0, 3.0), (0.2, 0.02)))
_RESOLUTION = 1.0


def _files(made: SampledController, test: ReplayVector, single: bool) -> dict[str, str]:
    """Texts by file name, in the folder ``law`` that the sketch has to be called after."""
    texts = dict(c.TARGET.write(made, test, single))
    del texts["law_selftest.c"]
    return {f"law/{name}": text for name, text in {"law.ino": sketch(made), "board.h": board(made), **texts}.items()}


def board(made: SampledController) -> str:
    """Text of ``board.h``: wires, encoders, bridge and watchdog."""
    readings = len(made.readings)
    pins = ["2, 3", "18, 19", "20, 21"]
    wires = [f"{{{pins[i]}}}" if i < len(pins) else "{-1, -1}" for i in range(readings)]
    return Template(_BOARD).substitute(
        title=made.title, readings=readings, wires=", ".join(wires),
        named=", ".join(made.readings),
    )  # fmt: skip


def sketch(made: SampledController) -> str:
    """Text of ``law.ino``."""
    names, steps = identifiers(made.readings), made.encoder.tolist()
    units = [unit or "rad" for unit in made.reading_units]

    def each(values: dict[str, float], free: bool = False) -> str:
        """A limit for each reading; none on a pendulum, which may turn over."""
        return ", ".join("0" if free and k else f"{values.get(unit, values['rad']):g}" for k, unit in enumerate(units))

    target = made.law.arrays()["target"][0].tolist() if isinstance(made.law, Law) else [0.0] * len(names)
    target = (target * len(names))[: len(names)]
    return Template(_SKETCH).substitute(
        title=made.title,
        period=round(1e6 * made.law.period),
        steps=", ".join(
            f"LAW_STEP_{name.upper()}" if step else f"{_RESOLUTION:g} /* FILL IN: reading per count */"
            for name, step in zip(names, steps, strict=True)
        ),
        travel=each(_TRAVEL, free=True), speed=each(_SPEED), start=each(_START),
        target=", ".join(f"{value!r}" for value in target),
        named=", ".join(f"{n} [{u}]" for n, u in zip(made.readings, units, strict=True)),
        full=f"{made.law.limit!r}" if 0.0 < made.law.limit < float("inf") else "12.0 /* FILL IN */",
        unit=made.command_unit or "command",
        reference="  law_real r[LAW_REFERENCES] = {0};  // FILL IN: what it shall follow\n" if made.references else "",
        r="r" if made.references else "0",
        several="" if len(made.commands) == 1 else _SEVERAL,
    )  # fmt: skip


_BOARD = """\
// $title: wires, encoders, H-bridge and watchdog; written by upright export.
// A Mega 2560 as it stands. Any other board whose pins all interrupt (Teensy, Pico, ESP32, Nano Every) with its own
// numbers. Not an Uno or Nano: it interrupts on two pins, and an encoder takes two.
#ifndef BOARD_H
#define BOARD_H

// A and B of each encoder: $named.
static const int ENCODER_PINS[$readings][2] = {$wires};

// H-bridge by PWM and two lines for the way: VNH5019 (PWM, INA, INB), L298N (ENA, IN1, IN2).
// For one PWM line each way (BTS7960, DRV8871) put an inverter in between, or use `upright firmware` instead.
static const int PWM_PIN = 7, FORWARD_PIN = 8, BACKWARD_PIN = 9;
static const int ENABLE_PIN = 4;  // high while the drive may move; 10 kOhm to ground
static const int STOP_PIN = 22;   // a button that opens, to ground: open, or its wire off, is stop

#if defined(__AVR__) && !defined(__AVR_ATmega2560__)
#error "an Uno or Nano interrupts on two pins only; take a Mega 2560, or give encoders their counters and delete this"
#endif

// Encoders: x4, by a table of what follows what. On a Mega up to 20,000 edges a second in all.
static volatile long encoder_counts[$readings];
static volatile unsigned encoder_errors;  // both channels at once: lost edges, or noise
static unsigned char encoder_phases[$readings];

static unsigned char encoder_read(int i) {
  return (unsigned char)((digitalRead(ENCODER_PINS[i][0]) ? 1 : 0) | (digitalRead(ENCODER_PINS[i][1]) ? 2 : 0));
}

static void encoder_edge(int i) {
  static const signed char step[16] = {0, 1, -1, 2, -1, 0, 2, 1, 1, 2, 0, -1, 2, -1, 1, 0};
  const unsigned char now = encoder_read(i);
  const signed char s = step[encoder_phases[i] << 2 | now];
  encoder_phases[i] = now;
  if (s == 2) encoder_errors++;
  else encoder_counts[i] += s;
}

template <int i> static void encoder_isr() { encoder_edge(i); }

template <int i> struct Encoders {
  static void begin() {
    Encoders<i - 1>::begin();
    for (int channel = 0; channel < 2; channel++) pinMode(ENCODER_PINS[i - 1][channel], INPUT_PULLUP);
    encoder_phases[i - 1] = encoder_read(i - 1);
    for (int channel = 0; channel < 2; channel++)
      attachInterrupt(digitalPinToInterrupt(ENCODER_PINS[i - 1][channel]), encoder_isr<i - 1>, CHANGE);
  }
};
template <> struct Encoders<0> {
  static void begin() {}
};
static void encoders_begin() { Encoders<$readings>::begin(); }

static void encoders_read(long *counts, unsigned *errors) {
  noInterrupts();
  for (int i = 0; i < $readings; i++) counts[i] = encoder_counts[i];
  *errors = encoder_errors;
  interrupts();
}

static void encoders_zero() {
  noInterrupts();
  for (int i = 0; i < $readings; i++) encoder_counts[i] = 0;
  interrupts();
}

// The bridge: sign and magnitude at 20 kHz, above what is heard.
#define DRIVE_STEPS 800

static void drive_pwm(int steps) {
#if defined(__AVR_ATmega2560__)  // timer 4, OC4B is pin 7
  if (!steps) {
    TCCR4A = _BV(WGM41);
    digitalWrite(PWM_PIN, LOW);
  } else {
    OCR4B = steps - 1;
    TCCR4A = _BV(WGM41) | _BV(COM4B1);
  }
#else
  analogWrite(PWM_PIN, (int)((long)steps * 255 / DRIVE_STEPS));
#endif
}

static void drive_off() {
  drive_pwm(0);
  digitalWrite(FORWARD_PIN, LOW);
  digitalWrite(BACKWARD_PIN, LOW);
  digitalWrite(ENABLE_PIN, LOW);
}

static void drive_begin() {
  const int pins[] = {PWM_PIN, FORWARD_PIN, BACKWARD_PIN, ENABLE_PIN};
  for (int i = 0; i < 4; i++) {
    digitalWrite(pins[i], LOW);
    pinMode(pins[i], OUTPUT);
  }
#if defined(__AVR_ATmega2560__)
  ICR4 = DRIVE_STEPS - 1;
  TCCR4A = _BV(WGM41);
  TCCR4B = _BV(WGM43) | _BV(WGM42) | _BV(CS40);
#elif defined(TEENSYDUINO) || defined(ESP32)
  analogWriteFrequency(PWM_PIN, 20000);
#elif defined(ARDUINO_ARCH_RP2040)
  analogWriteFreq(20000);
#endif
  drive_off();
}

// A part of the supply, -1 to 1.
static void drive(float share) {
  static int last;
  int steps = (int)(share * DRIVE_STEPS + (share < 0 ? -0.5f : 0.5f));
  if (steps > DRIVE_STEPS) steps = DRIVE_STEPS;
  if (steps < -DRIVE_STEPS) steps = -DRIVE_STEPS;
  if ((steps > 0) != (last > 0) || (steps < 0) != (last < 0)) {  // off at once, before it pushes the other way
    drive_pwm(0);
    digitalWrite(FORWARD_PIN, LOW);
    digitalWrite(BACKWARD_PIN, LOW);
    if (steps) digitalWrite(steps > 0 ? FORWARD_PIN : BACKWARD_PIN, HIGH);
  }
  digitalWrite(ENABLE_PIN, HIGH);
  drive_pwm(steps < 0 ? -steps : steps);
  last = steps;
}

// The processor's own watchdog: a loop that hangs is reset, and stands stopped afterwards.
#if defined(__AVR__)
#include <avr/wdt.h>
static void watchdog_begin() { wdt_enable(WDTO_250MS); }
static void watchdog_feed() { wdt_reset(); }
#elif defined(ARDUINO_ARCH_RP2040)
static void watchdog_begin() { rp2040.wdt_begin(250); }
static void watchdog_feed() { rp2040.wdt_reset(); }
#else
#warning "FILL IN: this board's watchdog; without it a program that hangs leaves the drive as it was"
static void watchdog_begin() {}
static void watchdog_feed() {}
#endif
#endif
"""

_SEVERAL = '#error "this law gives several commands, and board.h drives one bridge: fill in the others in loop()"\n'

_SKETCH = """\
// $title, written by upright export; see law.h for the law and board.h for wires.
//
// Switch it on with the rig at its zero, bring it where it starts, and send g (serial monitor, 115200). Anything else
// that is sent, the stop button, or a limit below stops it. This is not a rated safety function: the drive needs a stop
// in hardware besides, and somebody with a hand on it.
// On boards whose double has 32 bits (Mega) the law runs in single precision.
#include "law.h"
#include "law_selftest.h"
#include "board.h"

$several
// SET THESE for your rig; $named.
static const law_real TRAVEL[LAW_READINGS] = {$travel};  // from zero; 0 for one that may turn over
static const law_real SPEED[LAW_READINGS] = {$speed};    // in a second
static const law_real TARGET[LAW_READINGS] = {$target};  // where it is held
static const law_real START[LAW_READINGS] = {$start};    // how far from there a run may start
static const law_real STEP[LAW_READINGS] = {$steps};
static const law_real LIMIT = $full;              // largest command [$unit]
static const law_real SUPPLY = $full;             // command at full PWM: the motor's supply [$unit]
static const unsigned long LONGEST_AT_LIMIT = 2000000UL;  // us

static const unsigned long PERIOD = ${period}UL;  // us
static const unsigned long MOST_LATE = 3 * PERIOD;

static law_state state;
static unsigned long next_sample, at_limit;
static law_real before[LAW_READINGS];
static unsigned errors_before;
static bool running;

static void stop(const __FlashStringHelper *why) {
  drive_off();
  if (!running) return;
  running = false;
  Serial.print(F("stopped: "));
  Serial.println(why);
}

static unsigned read_all(law_real *y) {
  long counts[LAW_READINGS];
  unsigned errors;
  encoders_read(counts, &errors);
  for (int i = 0; i < LAW_READINGS; i++) y[i] = counts[i] * STEP[i];
  return errors;
}

static law_real size(law_real x) { return x < 0 ? -x : x; }

static void start() {
  law_real y[LAW_READINGS];
  errors_before = read_all(y);
  if (digitalRead(STOP_PIN) != LOW) {
    Serial.println(F("not started: the stop button is open"));
    return;
  }
  for (int i = 0; i < LAW_READINGS; i++) {
    if (size(y[i] - TARGET[i]) > START[i]) {
      Serial.println(F("not started: off its start"));
      return;
    }
    before[i] = y[i];
  }
  law_start(&state);
  at_limit = 0;
  running = true;
  next_sample = micros();
  Serial.println(F("started"));
}

void setup() {
  drive_begin();
  pinMode(STOP_PIN, INPUT_PULLUP);
  Serial.begin(115200);
  const long wrong = law_selftest();
  if (wrong >= 0) {
    Serial.print(F("law: sample is not the expected one, nothing runs: "));
    Serial.println(wrong);
    for (;;) {
    }
  }
  Serial.println(F("law: every sample is the expected one"));
  encoders_begin();
  encoders_zero();
  next_sample = micros();
  watchdog_begin();
}

// Whether the rig may go on with these readings.
static bool within_limits(const law_real *y, unsigned errors) {
  for (int i = 0; i < LAW_READINGS; i++) {
    if (TRAVEL[i] > 0 && !(size(y[i]) <= TRAVEL[i])) return stop(F("beyond its travel")), false;
    if (!(size(y[i] - before[i]) <= SPEED[i] * LAW_PERIOD * 2)) return stop(F("faster than its limit")), false;
    before[i] = y[i];
  }
  if (errors != errors_before) return stop(F("a transition that no encoder makes")), false;
  return true;
}

void loop() {
  while (Serial.available() > 0) {
    const int word = Serial.read();
    if (word == 'g' && !running) start();
    else if (word != '\\n' && word != '\\r') stop(F("by hand"));
  }
  if (digitalRead(STOP_PIN) != LOW) stop(F("stop button"));
  const unsigned long now = micros();
  const long late = (long)(now - next_sample);
  if (late < 0) return;
  // What was missed is not caught up: after a stall there is one sample, and after a long one none.
  next_sample += (1 + (unsigned long)late / PERIOD) * PERIOD;
  if (running && (unsigned long)late > MOST_LATE) stop(F("a sample came too late"));
  watchdog_feed();
  if (!running) {
    drive_off();
    return;
  }
  law_real y[LAW_READINGS], u[LAW_COMMANDS];
  if (!within_limits(y, read_all(y))) return;
$reference  law_step(&state, y, $r, u);
  if (state.stopped) return stop(F("the law met what is no number"));
  const law_real command = u[0] > LIMIT ? LIMIT : u[0] < -LIMIT ? -LIMIT : u[0];
  at_limit = size(command) < LIMIT ? 0 : at_limit + PERIOD;
  if (at_limit > LONGEST_AT_LIMIT) return stop(F("at its limit for too long"));
  drive((float)(command / SUPPLY));
}
"""


def _narrow(made: SampledController, miss: str) -> str:
    """That some boards have no double precision."""
    where = "On boards whose double has 32 bits"
    if isinstance(made.law, Rule):
        return f"{where} (Mega) the self-test may fail, and nothing runs."
    return f"{where} commands may miss by {miss}."


TARGET = LawTarget(
    name="arduino", order=15, title="an Arduino sketch", write=_files,
    rules=True, warn=_narrow,
    test="arduino-cli compile --upload -b arduino:avr:mega -p PORT {folder}/law && arduino-cli monitor -p PORT "
    "-c baudrate=115200",
    onward="Set limits and supply in law.ino and wires in board.h; it stands stopped until it is sent g.",
)  # fmt: skip
