"""Does a model that was fitted before explain other runs?"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from upright.cli.terminal import Data, tell
from upright.errors import BadInput


def predict(
    model: Annotated[Path, typer.Argument(metavar="OUT/fit.json", help="Model that `upright identify` wrote.")],
    study: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Runs to score; its guesses are not used.")],
    data: Data = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="OUT", help="Folder for prediction.json; none if left out.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the scores as JSON instead of a table.")] = False,
) -> None:
    r"""Score other runs with a model that was fitted before.

    The study is written as for `upright identify`; \[parameters] and \[actuator]
    may be left out, since every number comes from the fit. Every run is scored,
    whatever its role. What a run lists under `unknown` (its initial state, unless
    it says otherwise) is estimated for that run alone; nothing else is.

    upright predict swing-fit/fit.json other_day.toml
    """
    from upright.files import json_text
    from upright.report.fit.tables import score_table
    from upright.report.page import Chapter, Part
    from upright.study.load import load_study
    from upright.study.results import read_fit

    for file, what in ((model, "the model"), (study, "the study")):
        if not file.exists():
            raise BadInput(f"{what} {file} does not exist; the call is upright predict OUT/fit.json STUDY.toml")
    if model.is_dir():
        model = model / "fit.json"
    fitted = read_fit(model)
    asked = load_study(study, data=data, fixed=fitted.values)
    missing = [n for n in fitted.values if n not in asked.rig.parameters]
    if missing:
        raise BadInput(
            f"{study}: the plant '{asked.plant}' has no parameter {missing[0]}, and {model} is a '{fitted.plant}';"
            " both must be the same plant"
        )
    from upright.identification.inference.scoring import predict as score

    rig = replace(asked.rig, substeps=fitted.substeps)
    scores = score(fitted.values, rig, [replace(run, role="predict") for run in asked.runs], groups=fitted.groups)
    content: dict[str, Any] = {
        "model": model.name,
        "study": study.name,
        "runs": {
            label: {
                "role": s.role,
                "fit_percent": s.fit_percent,
                "horizon": s.horizon,
                "adapted": s.adapted,
            }
            for label, s in scores.items()
        },
    }
    text = json.dumps(content, indent=2, ensure_ascii=False)
    written = [] if out is None else [out / "prediction.json"]
    for path in written:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n", encoding="utf-8")
    if as_json:
        typer.echo(json_text(content))
        return
    explained = Part("How much of each signal is explained", (score_table(scores),))
    doubt = () if fitted.trusted else (f"The model's own verdict was: {fitted.verdict}",)
    tell(Chapter(title=f"{model.name} on {study.name}", verdict="", parts=(explained,), warnings=doubt), written)
