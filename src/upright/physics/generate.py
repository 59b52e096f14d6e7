"""Write the built-in plants' equations into the package: ``python -m upright.physics.generate``.

A test derives them afresh and compares, so that the text and the energies cannot drift apart.
"""

from __future__ import annotations

from upright.physics import BUILT_IN
from upright.physics.lagrange import derive
from upright.physics.nonideal import NonidealCartPendulum, NonidealFuruta
from upright.physics.plant import Plant, stem
from upright.physics.stored import FOLDER, file_text


def variants() -> list[tuple[type[Plant], frozenset[str]]]:
    """Every built-in plant and those that twins are made of, whole and with all its optional parameters left out."""
    plants = (*BUILT_IN.values(), NonidealCartPendulum, NonidealFuruta)
    return [(cls, frozenset(w)) for cls in plants for w in ([(), cls.optional] if cls.optional else [()])]


def write_equations() -> None:
    """Write every variant's file."""
    FOLDER.mkdir(exist_ok=True)
    for cls, without in variants():
        text = file_text(derive(cls, without=without))
        (FOLDER / f"{stem(cls, without)}.json").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    write_equations()
