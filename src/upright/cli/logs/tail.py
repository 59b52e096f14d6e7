"""What is this run doing now?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def tail(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run (MCAP) that is being written.")],
    patience: Annotated[
        float, typer.Option(min=0.0, metavar="SECONDS", help="End when nothing came for so long; 0 waits for ever.")
    ] = 0.0,
) -> None:
    """Print the last row of every chunk as it reaches a log that is being written, and every event.

    Ends when the run ends its log, or with Ctrl-C.

    upright log tail run.mcap
    """
    from upright.verbs import logs as verbs

    rows = 0
    for fresh in verbs.log_tail(log, patience=patience):
        for event in fresh.events:
            typer.echo(f"{event.t:10.3f} s  {event.kind}: {event.text}")
        if new := fresh.columns["t"].size:
            rows += new
            last = {name: column[-1].item() for name, column in fresh.columns.items()}
            shown = [c for c in fresh.header.columns if c.unit not in ("s", "1", "counts")]
            values = "  ".join(f"{c.name} {last[c.name]:.5g} {c.unit}" for c in shown)
            mode = fresh.header.modes.get(last["mode"], f"mode {last['mode']}")
            state = " ".join((mode, *fresh.header.fault_names(last["faults"])))
            typer.echo(f"{last['t']:10.3f} s  {values}  {state}  ({rows} rows)")
