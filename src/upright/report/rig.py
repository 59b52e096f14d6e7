"""Table of a rig: drive, encoders and servo, with where each number comes from."""

from __future__ import annotations

from upright.quantities import with_unit
from upright.report.page import Table
from upright.rig import Rig
from upright.rig.hardware import meaning_of


def rig_table(rig: Rig) -> Table:
    """Drive, encoders and servo with what each number rests on."""
    shown = {n: e for n, e in rig.hardware.entries.items() if not n.startswith(("sign.", "offset."))}
    return Table(
        caption="The rig as it is described", headings=("", "value", "from"),
        rows=tuple((meaning_of(n), with_unit(e.value, e.unit, 6), e.source)
                   for n, e in shown.items()), numbers=(1,),
    )  # fmt: skip
