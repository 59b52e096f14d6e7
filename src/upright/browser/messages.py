"""What may a client ask for? A table of messages and their fields; what is not in it changes nothing."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

from upright.errors import BadInput, nearest
from upright.realtime.reference import SHAPES

HELD, HANGING, MOTIONS, SWEEP, ONE_STEP = "held", "hanging", "motions", "sweep", "step"
"""Where a run begins: held; hanging, to be swung up; at rest, to be identified in one of three ways."""
ORIGINS = (HELD, HANGING, MOTIONS, SWEEP, ONE_STEP)
LONGEST = 4096
"""Bytes of a message at most."""
_STATES = 16


@dataclass(frozen=True, kw_only=True)
class ClientRequest:
    """What a client asks for, with its fields by name."""

    do: str
    fields: Mapping[str, Any] = field(default_factory=dict[str, Any])


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("a number")
    return float(value)


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("true or false")
    return value


def _text(value: Any) -> str:
    if not isinstance(value, str) or len(value) > 200:
        raise ValueError("a text of at most 200 letters")
    return value


def _where(value: Any) -> str:
    if value not in ORIGINS:
        raise ValueError(f"one of {', '.join(ORIGINS)}")
    return str(value)


def _shape(value: Any) -> str:
    if value not in SHAPES:
        raise ValueError(f"one of {', '.join(SHAPES)}")
    return str(value)


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list) or len(value) > _STATES:  # type: ignore[reportUnknownArgumentType]
        raise ValueError(f"a list of at most {_STATES}")
    return value  # type: ignore[reportUnknownVariableType]


def _numbers(value: Any) -> list[float]:
    return [_number(x) for x in _list(value)]


def _poles(value: Any) -> list[complex]:
    pairs = [_numbers(pair) for pair in _list(value)]
    if any(len(pair) != 2 for pair in pairs):
        raise ValueError("a list of pairs, real and imaginary part")
    return [complex(re, im) for re, im in pairs]


TABLE: Mapping[str, Mapping[str, tuple[Callable[[Any], Any], bool]]] = {
    "operate": {},
    "release": {},
    "start": {
        "seconds": (_number, False),
        "start": (_numbers, False),
        "accept": (_text, False),
        "from": (_where, False),
    },
    "stop": {},
    "end": {},
    "rearm": {},
    "tap": {"coordinate": (_text, True), "speed": (_number, True)},
    "poles": {"poles": (_poles, True), "confirm": (_flag, False)},
    "reference": {"value": (_number, True), "shape": (_shape, False), "period": (_number, False)},
}
"""By what is asked for: each field with what reads it, and whether it is needed."""


def read(text: str) -> ClientRequest:
    """A client's message.

    Raises
    ------
    BadInput
        When it is none of the table.
    """
    if len(text.encode(errors="replace")) > LONGEST:
        raise BadInput(f"a message has at most {LONGEST} bytes.")
    try:
        content: Any = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError):
        raise BadInput('a message is JSON such as {"do": "stop"}.') from None
    if not isinstance(content, dict) or not isinstance(content.get("do"), str):  # type: ignore[reportUnknownMemberType]
        raise BadInput('a message says what to do: {"do": "stop"}.')
    given: dict[str, Any] = dict(content)  # type: ignore[reportUnknownArgumentType]
    do = given.pop("do")
    if do not in TABLE:
        raise BadInput(f"nobody can '{do[:40]}' here; {nearest(do[:40], TABLE)}")
    fields = TABLE[do]
    if unknown := sorted(given.keys() - fields.keys()):
        raise BadInput(f"'{do}' has no field '{unknown[0][:40]}'.")
    if missing := [name for name, (_, needed) in fields.items() if needed and name not in given]:
        raise BadInput(f"'{do}' needs {missing[0]}.")
    out: dict[str, Any] = {}
    for name, value in given.items():
        try:
            out[name] = fields[name][0](value)
        except (ValueError, OverflowError) as needed:
            raise BadInput(f"{name} of '{do}' is {needed}.") from None
    return ClientRequest(do=do, fields=out)


def _no_number(name: str) -> NoReturn:
    raise ValueError(name)
