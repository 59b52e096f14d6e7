"""What are the parameters of this rig? A study goes in, estimates and a report come out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.cli.terminal import Data, Pdf, progress_bar, tell, write_page
from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.study.load import Study

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
    --hold-out each predicts every run from a fit of the others as well.
    Exit code: 0 a fit was written (3 with --strict when its verdict is not to
    trust it), 2 the study or a log is wrong, 130 stopped by Ctrl-C.
    """
    from upright.errors import nearest
    from upright.report.symbols import typed

    if method not in METHODS:
        raise BadInput(f"--method must be one of {', '.join(METHODS)}, got '{method}'; {nearest(method, METHODS)}")
    folder = out if out is not None else study.with_name(f"{study.stem}-fit")
    asked = read_study(study, folder, data)
    each = "each" in (hold_out or ()) and all(run.label != "each" for run in asked.runs)
    asked = asked.hold_out(*(label for label in hold_out or () if not (each and label == "each")))
    fitted = sum(run.role == "fit" for run in asked.runs)
    if each and fitted < 2:
        raise BadInput(f"{study}: --hold-out each takes two runs to fit or more, got {fitted}; add a run or a window")
    if not asked.rig.estimated:
        raise BadInput(
            f'{study}: nothing is asked; give a parameter a guess, such as J_p = {{ guess = "1e-3 kg m^2" }}, or score'
            " the runs with a model fitted before: upright predict OUT/fit.json STUDY.toml"
        )
    if not any(run.role == "fit" for run in asked.runs):
        raise BadInput(f'{study}: every run has role = "predict"; at least one needs role = "fit"')
    from upright.files import json_text
    from upright.identification.estimate import identify as estimate
    from upright.identification.ladder.cross_validation import cross_validate
    from upright.study.results import write_fit

    with progress_bar(quiet=as_json) as bar:
        fit = estimate(asked.rig, asked.runs, method=method, progress=bar)
    written = [folder / "fit.json"]
    content = write_fit(fit, asked, written[0])
    crossed = None
    if each and not fit.interrupted:
        with progress_bar(quiet=as_json) as bar:
            crossed = cross_validate(fit, asked.runs, progress=bar)
        content = write_fit(fit, asked, written[0], crossed)
    from upright.report.fit.chapter import chapter

    told = chapter(
        fit, title=asked.title or asked.path.stem.replace("_", " "), provenance=provenance(asked), crossed=crossed,
        study=typed(study) + (f" --data {typed(data)}" if data is not None else ""), folder=typed(folder),
    )  # fmt: skip
    if report or pdf:
        written += write_page(told, folder / "report.html", pdf)
    if as_json:
        typer.echo(json_text(content))
    else:
        tell(told, written)
    if fit.interrupted or (crossed is not None and crossed.interrupted):
        raise typer.Exit(INTERRUPTED)
    if strict and not fit.trusted:
        raise typer.Exit(NOT_TRUSTED)


def read_study(study: Path, folder: Path, data: Path | None) -> Study:
    """A study, once study and folder of the results are what they should be."""
    from upright.report.symbols import typed
    from upright.study.load import load_study

    if not study.exists():
        raise BadInput(
            f"the study {study} does not exist; `upright init LOG -o {typed(study.name)}` writes one from a log"
        )
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"results need a folder, but {folder} is a file; name another with -o")
    return load_study(study, data=data)


def provenance(asked: Study) -> dict[str, object]:
    """Where the numbers of a study come from."""
    return {
        "study": asked.path.name,
        "sha256 of the study": asked.sha256,
        "data": asked.source or "not stated",
        "runs": {run.label: run.source for run in asked.runs},
    }
