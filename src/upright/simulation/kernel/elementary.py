"""Elementary functions of the kernel's text: without branches, so that lanes stay vectors, and without a C library.

Each agrees with the exact value to within a few units in the last place; the tests say how many. A kernel holds the
sine and cosine that pendulums need and the decay that friction needs, and of the others what its text calls: nothing in
these is rearranged or fused, so that the same text has the same bits in C and in Python.
"""

from __future__ import annotations

import re

from upright.simulation.kernel.texts import kernel_text

_BLOCKS = re.split(r"\n{2,}(?=@)", kernel_text("elementary").strip())
_ALL = {re.findall(r"^def (\w+)", block, re.MULTILINE)[0]: f"\n{block}\n" for block in _BLOCKS}

_SINCOS = _ALL.pop("sincos")
_TEXTS = {"exact_sincos": _SINCOS.replace("@inline_strict\ndef ", "@exact\ndef exact_")} | _ALL

ALWAYS = f"{_SINCOS}\n{_TEXTS.pop('falling')}"
"""What every kernel holds."""

NAMES = frozenset(_TEXTS) - {"exact_sincos"}
"""Functions that a text may call."""


def definitions(*texts: str) -> str:
    """Definitions of what these texts call, each before those that call it."""
    distinct: list[str] = []

    def visit(text: str) -> None:
        for name in sorted(_TEXTS.keys() & set(re.findall(r"\b([a-z]\w*)\(", text))):
            if _TEXTS[name] not in distinct and _TEXTS[name] != text:
                visit(_TEXTS[name])
                distinct.append(_TEXTS[name])

    for text in texts:
        visit(text)
    return "\n".join(distinct)
