"""Which masses should be bolted on, where, and how often?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import tell


def plan_inertias(
    rig: Annotated[str, typer.Option(metavar="KIND", help="rectilinear (carts) or torsional (disks).")] = "rectilinear",
    bare: Annotated[str, typer.Option(help="Bare inertia, roughly; 0.77 kg or 3e-3 kg m^2 if left out.")] = "",
    error: Annotated[
        str, typer.Option(help="Standard error of a frequency from one run, as it was measured.")
    ] = "0.2 %",
    tolerance: Annotated[str, typer.Option(help="Standard uncertainty of one added mass or inertia.")] = "0.2 %",
    runs: Annotated[int, typer.Option(min=2, max=16, help="Most runs to be planned.")] = 10,
    levels: Annotated[int, typer.Option(min=2, max=5, help="Different loadings at least.")] = 3,
    radius: Annotated[
        list[str] | None, typer.Option(metavar="LENGTH", help="Bolt circle of a disk, once for each; 2 to 9 cm.")
    ] = None,
    target: Annotated[str, typer.Option(help="Standard error of the stiffness that would do, such as '0.3 %'.")] = "",
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="FILE", help="Picture to draw (SVG, PNG).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the plans as JSON instead of a table.")] = False,
) -> None:
    """Say which masses give the tightest stiffness for the fewest runs of experiment 1a.

    Carts take 0, 0.5, 1, 1.5 or 2 kg; disks take none, two or four masses of 500 g on any bolt circle, so that they
    stay balanced. Every design is compared on the line 1/omega_n^2 = (m_0 + a)/k.

    upright plan-inertias --rig torsional --error "0.3 %" --radius "4 cm" --radius "9 cm"
    """
    from upright.verbs import model as verbs

    plans = verbs.plan_inertias(
        rig=rig, bare=bare, error=error, tolerance=tolerance, runs=runs, levels=levels, radius=radius or (),
        target=target, out=out,
    )  # fmt: skip
    tell(plans.chapter, plans.files, plans.numbers if as_json else None)
