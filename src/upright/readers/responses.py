"""Columns of a table of a frequency response, as analysers and other programs name them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

FREQUENCIES = {"f", "freq", "freqs", "frequency", "frequencies", "frequenz", "w", "wout", "omega", "ω"}
KINDS = {
    "magnitude": {"mag", "magnitude", "gain", "amplitude", "amp", "ampl", "abs", "modulus", "betrag", "db"},
    "phase": {"phase", "ph", "arg", "angle", "winkel"},
    "real": {"re", "real"}, "imaginary": {"im", "imag", "imaginary"}, "coherence": {"coh", "coherence"},
}  # fmt: skip
"""Words by which a column says what it holds."""
UNITS = {"hz": 2 * math.pi, "khz": 2000 * math.pi, "rad/s": 1.0, "rad/sec": 1.0, "1/s": 1.0, "db": 0.0,
         "deg": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180, "rad": 1.0}  # fmt: skip
"""What one of each is in rad/s or rad; decibels are no factor."""
_FILLING = {"h", "g", "of", "response", "frf", "tf", "jw", ""}


@dataclass(frozen=True, kw_only=True)
class ResponseColumn:
    """Place and name of a column, the output that it is of, what it holds of it, and its unit as written."""

    at: int
    name: str
    output: str
    kind: str
    unit: str


def response_columns(names: Sequence[str]) -> tuple[ResponseColumn, ...]:
    """Columns of a frequency response, the frequency first; none where the names are not those of one."""
    columns = [_column(at, name) for at, name in enumerate(names)]
    frequency = next((c for c in columns if c.kind == "frequency"), None)
    held = [c for c in columns if c.kind not in ("frequency", "")]
    return (frequency, *held) if frequency and {"magnitude", "real"} & {c.kind for c in held} else ()


def is_frequency(name: str) -> bool:
    """Whether a column says of itself that it is a frequency, by a whole word or by hertz."""
    column = _column(0, name)
    return column.kind == "frequency" and (len(_words(name)[0]) > 3 or column.unit in ("hz", "khz"))


def _column(at: int, name: str) -> ResponseColumn:
    bracketed = re.search(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$", name)
    unit = bracketed[1].casefold() if bracketed else ""
    words = _words(name)
    if not unit and words[-1] in UNITS and len(words) > 1:
        unit = words.pop()
    kind = next((k for k, own in KINDS.items() if own & set(words)), "")
    if not kind and (unit == "db" or re.match(r"\s*\|.*\|", name)):
        kind = "magnitude"
    if not kind and FREQUENCIES & set(words):
        kind = "frequency"
    named = KINDS.get(kind, FREQUENCIES)
    output = "_".join(w for w in words if w not in named | _FILLING)
    return ResponseColumn(at=at, name=name, output=output, kind=kind, unit="db" if "db" in words else unit)


def _words(name: str) -> list[str]:
    """Words of a name without its unit in brackets; an ``H`` there is no unit, but neither is it needed."""
    return re.split(r"[\s_.|:()\[\]-]+", re.sub(r"[\[(][^\[\]()]*[\])]\s*$", "", name.casefold()).strip(" |")) or [""]
