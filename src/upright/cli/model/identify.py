"""What are the parameters of this rig? A study goes in, estimates and a report come out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import Cluster, Data, Pdf, Processes, print_json, progress_bar, tell
from upright.verbs.study import read_study

INTERRUPTED, NOT_TRUSTED = 130, 3
METHODS = ("auto", "simplex", "least-squares")


def _keys(asked: bool) -> None:
    if asked:
        from upright.study.keys import reference

        typer.echo(reference())
        raise typer.Exit


def identify(
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Rig and runs; `upright init LOG` writes one.")],
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT", help="Folder for results; STUDY-fit if left out.")
    ] = None,
    data: Data = None,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(
            "--hold-out", metavar="LABEL", help="Predict this run instead of fitting it; 'each': all in turn."
        ),
    ] = None,
    method: Annotated[str, typer.Option(metavar="METHOD", help=f"How to search: {', '.join(METHODS)}.")] = "auto",
    as_json: Annotated[bool, typer.Option("--json", help="Print fit.json instead of tables.")] = False,
    report: Annotated[bool, typer.Option(help="Write report.html as well.")] = True,
    pdf: Pdf = False,
    workers: Processes = 1,
    cluster: Cluster = "",
    keys: Annotated[
        bool, typer.Option("--keys", help="Print every key a study may have.", callback=_keys, is_eager=True)
    ] = False,
    strict: Annotated[bool, typer.Option("--strict", help="Exit with 3 when the verdict is not to trust it.")] = False,
) -> None:
    r"""Fit a rig's parameters to its logs as a study file says; write estimates and report.

    A study names a rig and the runs that speak about it:

        \[rig]
        plant = "pendulum"      # cart-pendulum, furuta, torsional-2, my.py:MyRig
        \[parameters]
        m_p  = "0.107 kg"                                     # known
        l_cg = { value = "0.23 m", uncertainty = "2 mm" }     # known about
        J_p  = { guess = "1.6e-3 kg m^2", min = 0 }           # to estimate
        b_2c = { guess = "1e-4 N m" }
        \[sensors.theta]
        column = "theta"        # as `upright show LOG` lists them
        unit = "counts"
        counts_per_rev = 14400
        sign = -1
        \[\[runs]]
        file = "swing.csv"
        window = \[1.0, 30.0]
        \[\[runs]]
        file = "swing.csv"
        label = "tail"
        window = \[30.0, 60.0]
        role = "predict"        # scored, never fitted

    A driven rig adds, for instance,
        \[drive]
        column = "v"            # or expression = "2.5*(0.2 - z)"
        unit = "V"
        \[actuator]
        gain = { guess = "2 N/V" }

    All keys: `upright identify --keys`, or docs/study.md.
    Writes OUT/fit.json and OUT/report.html (and OUT/report.pdf with --pdf).
    Ctrl-C keeps the best so far and writes it.
    --hold-out each predicts every run from a fit of the others as well; --workers
    shares those fits among processes.
    Exit code: 0 a fit was written (3 with --strict when its verdict is not to
    trust it), 2 the study or a log is wrong, 130 stopped by Ctrl-C.
    """
    from upright.verbs.fitting import identify as fit
    from upright.verbs.study import folder_beside

    folder = out if out is not None else folder_beside(study, "fit")
    asked = read_study(study, folder, data)
    with progress_bar(quiet=as_json) as bar:
        answer = fit(
            asked, data=data, hold_out=hold_out or (), method=method, out=folder, report=report, pdf=pdf,
            workers=workers, cluster=cluster, progress=bar,
        )  # fmt: skip
    if as_json:
        print_json(json.loads(answer.files[0].read_text(encoding="utf-8")))
    else:
        tell(answer.chapter, answer.files)
    crossed = answer.crossed
    if answer.fit.interrupted or (crossed is not None and crossed.interrupted):
        raise typer.Exit(INTERRUPTED)
    if strict and not answer.fit.trusted:
        raise typer.Exit(NOT_TRUSTED)
