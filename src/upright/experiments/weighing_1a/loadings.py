"""Stiffness and bare inertia of a body from labelled logs of its steps, each with what was bolted to it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from upright.errors import BadInput, NotIdentifiable
from upright.identification.loadings import Loaded, Loadings, fit_loadings, swings
from upright.physics.oscillators import added_inertia
from upright.records import Record
from upright.rig.makes import MASS_RADIUS, check_radius
from upright.units import parse, same_dimension

_MASSES = re.compile(r"\s*(\d+)\s+at\s+(.+)")


def weigh(
    logs: Mapping[str, Record], added: Sequence[float], signals: Mapping[str, str], commands: Mapping[str, str], *,
    tolerance: float = 0.0, piece: float = 0.0, free: bool = False,
) -> tuple[Loadings, tuple[str, ...]]:  # fmt: skip
    """Stiffness and bare inertia of a rig from labelled logs, and why some of them did not count.

    Parameters
    ----------
    logs : mapping of str to Record
        By label.
    added : sequence of float
        Inertia that was on, log by log [kg or kg m^2].
    signals, commands : mapping of str to str
        Columns of position and command of each, the command's empty where there is none.
    tolerance, piece : float
        Of the added inertias, see `fit_loadings`.
    free : bool
        Count swings at zero command only.

    Raises
    ------
    NotIdentifiable
        When too few swings can be seen.
    """
    loaded: list[Loaded] = []
    left_out: list[str] = []
    for (label, record), value in zip(logs.items(), added, strict=True):
        try:
            observed = swings(record, added=value, label=label, signal=signals[label], command=commands[label])
        except NotIdentifiable as error:
            left_out.append(str(error))
            continue
        loaded += [s for s in observed if not free or s.command == 0]
    if left_out and len({s.added for s in loaded}) < 2:
        raise NotIdentifiable(left_out[0])
    return fit_loadings(loaded, tolerance=tolerance, piece=piece), tuple(left_out)


def inertia_of(text: str) -> tuple[float, str]:
    """Added inertia [SI] and the kind of rig it belongs to; none for a plain zero.

    Raises
    ------
    BadInput
        When it is no inertia.
    """
    if masses := _MASSES.fullmatch(text):
        radius = check_radius(parse(masses[2], "m"))
        return added_inertia(int(masses[1]), radius, mass_radius=MASS_RADIUS), "torsional"
    if text.strip() in ("0", "none"):
        return 0.0, ""
    unit = text.lstrip("+-0123456789.eE ").strip()
    torsional = bool(unit) and same_dimension(unit, "kg m^2")
    value = parse(text, "kg m^2" if torsional else "kg")
    if value < 0:
        raise BadInput(f"--added needs what was put on, got '{text}'; take the heaviest rig's bare body as zero.")
    return value, "torsional" if torsional else "rectilinear"
