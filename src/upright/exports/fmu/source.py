"""Text of the unit's one C file: the kernel, and the functions of FMI 3.0 around it."""

from __future__ import annotations

from upright.exports.controller import harmless
from upright.exports.fmu.translation import Kind, as_c, helpers
from upright.exports.fmu.unit import STEP, Unit
from upright.exports.texts import filled
from upright.simulation.kernel.compiled import source as kernel_text
from upright.simulation.kernel.flavour import lay_out
from upright.simulation.kernel.lanes import room


def fmu_source(unit: Unit, token: str) -> str:
    """Text of the C file."""
    simulator = unit.simulator
    layout = lay_out(simulator.derived, simulator.flavour)
    inputs, states = max(layout.nu, 1), 2 * layout.n
    table: tuple[Kind, tuple[int, ...]] = ("double *", (1, 1))
    arrays: dict[str, tuple[Kind, tuple[int, ...]]] = dict.fromkeys(("P", "X0", "R", "HELD", "HBASE", "STAT"), table)
    arrays |= {"U": ("double *", (inputs, 1)), "OUT": ("double *", (states, 1, 1))}
    arrays |= {"START": ("long *", (1,)), "FL": ("double *", (1,)), "W": ("double *", (1,))}
    sizes = {"W": "W_SIZE", "U": "(PAST + 1)", "HELD": "0", "R": "0"}
    kernel = as_c(kernel_text(layout), "run_1", arrays, sizes)
    rows = simulator.table(unit.values, 1)[:, 0].tolist()
    numbers = ", ".join(repr(v).replace("inf", "HUGE_VAL") for v in rows)
    places = ", ".join(str(p.row) for p in unit.parameters) or "0"
    return filled(
        "fmu.c.in", name=harmless(unit.rig.name), token=token, step=repr(STEP), substeps=simulator.substeps,
        states=states, inputs=layout.nu, past=unit.remembered, rows=len(rows), parameters=len(unit.parameters),
        room=room(layout, 1, 1), numbers=numbers, places=places, helpers=helpers(kernel), kernel=kernel,
    )  # fmt: skip
