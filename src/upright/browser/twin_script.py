"""The rig as a page moves it: its kernel, its law and the rigs that its fit allows, as a script."""

from __future__ import annotations

from upright.browser.rig import BenchRig
from upright.control.preflight import Task
from upright.errors import BadInput
from upright.live.page import in_script
from upright.live.twin import moving
from upright.rig.variation import allowed

LANES, SEED, SECONDS = 200, 0, 3.0
"""Rigs of the fit that run beside it, their draw, and for how long [s]."""


def twin_script(rig: BenchRig) -> str:
    """Declares ``DATA`` and ``OUTLINE``, as the page of `upright play` has them.

    Raises
    ------
    BadInput
        When the law is no feedback of states, or the rig cannot be drawn or compiled for a page.
    """
    if rig.loop is None or rig.still:
        raise BadInput(rig.still)
    from upright.experiments.regulation_2.run import HAND, START

    still = [0.0] * (2 * len(rig.model.per_unit) - 2)
    task = Task(start=(*still, *START), at=rig.at, hand=(*still, *HAND), seconds=SECONDS)
    data = moving(rig.model, rig.loop, task, others=allowed(rig.model, LANES, SEED), lanes=LANES, seed=SEED)
    numbers = in_script({name: value for name, value in data.items() if name != "outline"})
    return f"const DATA = {numbers};\nconst OUTLINE = {data['outline']};\n"
