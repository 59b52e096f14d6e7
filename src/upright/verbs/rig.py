"""Options that say what is known of a rig, as entries of its description; they come before study and data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from upright.errors import BadInput, nearest
from upright.verbs.values import si_if_given

if TYPE_CHECKING:
    from upright.physics import Plant
    from upright.study.description import Entry

Counts = float | str | Mapping[str, float]


def rig_options(
    plant: Plant, unit: str, *, limit: float | None = None, period: float | str = "", counts: Counts = "",
    travel: float | None = None,
) -> dict[str, Entry]:  # fmt: skip
    """Entries that options give.

    Parameters
    ----------
    plant : Plant
    unit : str
        Of the command.
    limit : float, optional
    period : float or str, optional
    counts : float, str or mapping, optional
        Encoder counts per turn or metre, one number or by coordinate.
    travel : float, optional

    Raises
    ------
    BadInput
        When one of them is no such number.
    """
    from upright.study.description import Entry, driven_unit

    every = si_if_given(period, "s")
    if limit is not None and not 0 < limit < 1e9:
        raise BadInput(f"the largest command lies above 0 and below 1e9, got {limit:g}.")
    if every is not None and not 1e-6 <= every <= 10.0:
        raise BadInput(f"a loop is closed every 1e-6 to 10 s, got a period of {every:g} s.")
    if travel is not None and not 0 < travel < 1e9:
        raise BadInput(f"--travel must be above 0, got {travel:g}.")
    said = (("limit", limit, unit), ("servo_period", every, "s"), ("travel", travel, driven_unit(type(plant))))
    options = {"limit": "--limit", "servo_period": "--period", "travel": "--travel"}
    out = {n: Entry(value=v, unit=u, source=options[n]) for n, v, u in said if v is not None}
    units = {c.name: c.unit for c in plant.coordinates}
    for name, number in _counts(counts, list(units)).items():
        per = "1/rev" if units[name] == "rad" else f"1/{units[name]}"
        out[f"counts.{name}"] = Entry(value=number, unit=per, source="--counts")
    return out


def as_typed(**options: float | str | Mapping[str, float] | None) -> str:
    """Options as a command line says them again, a space before each; those left out are left out."""
    out = ""
    for name, value in options.items():
        if isinstance(value, Mapping):
            value = ", ".join(f"{k}={v}" for k, v in value.items())
        if value not in (None, ""):
            out += f" --{name} " + (f"{value:g}" if isinstance(value, int | float) else f'"{value}"')
    return out


def _counts(counts: Counts, names: list[str]) -> dict[str, float]:
    """Counts by coordinate; a number alone is for all of them."""
    if (isinstance(counts, Mapping) and not counts) or (isinstance(counts, str) and not counts.strip()):
        return {}
    said = str(counts)
    if isinstance(counts, Mapping):
        said = ",".join(f"{name}={value}" for name, value in counts.items())
    per: dict[str, float] = {}
    for piece in said.split(","):
        name, equals, value = piece.rpartition("=")
        name = name.strip()
        if equals and name not in names:
            raise BadInput(
                f"--counts names coordinates as in \"{names[0]}=4096\", got '{name}'; {nearest(name, names)}"
            )
        try:
            number = float(value)
        except ValueError:
            number = 0.0
        if not 0 < number < 1e15:
            raise BadInput(
                f"--counts takes numbers above 0, got '{piece.strip()[:40]}'; write 4096 or \"{names[0]}=4096\"."
            )
        per |= {name: number} if equals else dict.fromkeys(names, number)
    return per
