"""A law as an Arduino sketch: the C files, encoders and an H-bridge, and a loop with limits that tests itself first."""

from __future__ import annotations

from upright.exports.controller import SampledController, identifiers
from upright.exports.targets import LawTarget, c
from upright.exports.texts import filled
from upright.exports.vector import ReplayVector
from upright.laws import Law, Rule
from upright.units import is_acceleration

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
    named = ", ".join(made.readings)
    return filled("board.h.in", title=made.title, readings=readings, wires=", ".join(wires), named=named)


def sketch(made: SampledController) -> str:
    """Text of ``law.ino``."""
    names, steps = identifiers(made.readings), made.encoder.tolist()
    units = [unit or "rad" for unit in made.reading_units]

    def each(values: dict[str, float], free: bool = False) -> str:
        """A limit for each reading; none on a pendulum, which may turn over."""
        return ", ".join("0" if free and k else f"{values.get(unit, values['rad']):g}" for k, unit in enumerate(units))

    target = made.law.arrays()["target"][0].tolist() if isinstance(made.law, Law) else [0.0] * len(names)
    target = (target * len(names))[: len(names)]
    return filled(
        "law.ino.in",
        title=made.title,
        period=round(1e6 * made.law.needed_period),
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
        several=_SEVERAL if len(made.commands) > 1 else _ACCELERATION if is_acceleration(made.command_unit) else "",
    )  # fmt: skip


_SEVERAL = '#error "this law gives several commands, and board.h drives one bridge: fill in the others in loop()"\n'


_ACCELERATION = (
    '#error "this law commands an acceleration, and board.h drives a bridge by PWM: in its place let your stepper go "'
    ' "at speed += command * 1e-6 * PERIOD, 0 after a stop"\n'
)


def _narrow(made: SampledController, miss: str) -> str:
    """That some boards have no double precision."""
    where = "On boards whose double has 32 bits"
    if isinstance(made.law, Rule):
        return f"{where} (Mega) the self-test may fail, and nothing runs."
    return f"{where} commands may differ by {miss}."


TARGET = LawTarget(
    name="arduino", order=15, title="an Arduino sketch", write=_files,
    rules=True, warn=_narrow,
    test="arduino-cli compile --upload -b arduino:avr:mega -p PORT {folder}/law && arduino-cli monitor -p PORT "
    "-c baudrate=115200",
    onward="Set limits and supply in law.ino and wires in board.h; it stays stopped until you send g.",
)  # fmt: skip
