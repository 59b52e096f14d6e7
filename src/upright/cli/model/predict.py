"""Does a model that was fitted before explain other runs?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import Data, Pdf, tell

WORSE = 3


def predict(
    model: Annotated[Path, typer.Argument(metavar="OUT/fit.json", help="Model that `upright identify` wrote.")],
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Runs to score; its guesses are not used.")],
    data: Data = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT", help="Folder for prediction.json and prediction.html.")
    ] = None,
    pdf: Pdf = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the scores as JSON instead of a table.")] = False,
) -> None:
    r"""Score other runs with a model that was fitted before.

    The study is written as for `upright identify`; \[parameters] and \[actuator]
    may be left out, since every number comes from the fit. Every run is scored,
    whatever its role. What a run lists under `unknown` (its initial state, unless
    it says otherwise) is estimated for that run alone; nothing else is.
    Around each prediction lies a band that should hold 90 % of the samples, as the
    fit promises; a run that goes beyond what was fitted is named, and by how much.

    upright predict swing-fit/fit.json other_day.toml

    Exit code: 0 predicted as well as the fit promises, 3 worse, 2 the model, the
    study or a log is wrong.
    """
    from upright.verbs import model as verbs

    scored = verbs.predict(model, study, data=data, out=out, pdf=pdf)
    tell(scored.chapter, scored.files, scored.numbers if as_json else None)
    if not scored.chapter.sound:
        raise typer.Exit(WORSE)
