"""How stiff, how heavy? Step responses with known added masses or inertias."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, Out, Pdf, tell


def loadings(
    logs: Annotated[
        list[Path] | None, typer.Argument(metavar="LOG...", help="One log of steps for each loading; repeats welcome.")
    ] = None,
    added: Annotated[
        list[str] | None,
        typer.Option(
            metavar="INERTIA",
            help="What was added, log by log: '1.5 kg', '4e-3 kg m^2', or '2 at 6.5 cm' (500 g each).",
        ),
    ] = None,
    signal: Annotated[str, typer.Option(metavar="COLUMN", help="Column of the position, in any unit.")] = "",
    command: Annotated[str, typer.Option(metavar="COLUMN", help="Column of the command that steps.")] = "",
    tolerance: Annotated[str, typer.Option(help="Standard uncertainty of one added piece.")] = "0 %",
    free: Annotated[
        bool, typer.Option("--free", help="Count swings at zero command only, with the drive silent.")
    ] = False,
    twin: Annotated[str, typer.Option(metavar="KIND", help="No logs: step a twin, rectilinear or torsional.")] = "",
    seed: Annotated[int, typer.Option(min=0, help="Which twin of the make; 0 is the one as designed.")] = 0,
    out: Out = Path("loadings"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Find stiffness and bare inertia from step responses with known added masses (experiment 1a).

    Each swing gives a damped period, and its extremes viscous and dry friction; 1/omega_n^2 over the added inertia is
    a line whose slope is 1/k.

    \b
    upright loadings --twin rectilinear -o out
    upright loadings bare.csv one.csv two.csv --added "0 kg" --added "0.5 kg" --added "1 kg" --signal x --command u
    """
    from upright.verbs import model as verbs

    found = verbs.loadings(
        logs or (), added=added or (), signal=signal, command=command, tolerance=tolerance, free=free, twin=twin,
        seed=seed, out=out, pdf=pdf,
    )  # fmt: skip
    tell(found.chapter, found.files, {**found.numbers, "report": str(found.files[0])} if as_json else None)
