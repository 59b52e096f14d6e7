"""Options that verbs of loops share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.rig import Rig

FIT = "fit.json or its folder; "
COUNTS = 'Encoder counts per turn or metre, "4096" or "x=20000, theta=4096"; the study\'s when omitted.'


def vendor_of(known: Rig, rig: str, vendor: str, source: str) -> str:
    """Data sheet chosen by the name of a make, ``--rig``, or of the vendor."""
    if not rig:
        return vendor
    from upright.rig.makes import make_of_rig

    make = make_of_rig(known)
    if rig != make.key:
        raise BadInput(f"{source} is of the make '{make.key}', not '{rig}'; leave --rig out.")
    return vendor or make.vendor
