"""How does a fit become a page that can be mailed, printed and read in ten years?

One HTML file: figures as SVG, formulas as MathML, style inside, nothing fetched from anywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from upright.identification import Fit
from upright.identification.inference.assumptions import sentences
from upright.identification.ladder.cross_validation import CrossValidation
from upright.report.advice import next_steps
from upright.report.drawing import svg
from upright.report.equations import equations
from upright.report.tables import (
    cross_rows,
    parameter_rows,
    pole_rows,
    provenance_rows,
    run_rows,
    score_rows,
    without_rows,
)


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A figure's markup, the caption under it, and what a reader who cannot see it is told."""

    markup: Markup
    caption: str
    description: str


def picture(drawing: Any, name: str, *, caption: str, description: str) -> Picture:
    """A matplotlib figure made ready for a page; `name` is unique on the page."""
    return Picture(markup=Markup(svg(drawing, name)), caption=caption, description=description)


def render(template: str, **content: Any) -> str:
    """Fill one of the package's templates; every text is escaped unless it is `Markup`."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    from upright import __version__

    pages = Environment(
        loader=PackageLoader("upright.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return pages.get_template(template).render(version=__version__, **content)


def write_page(folder: Path, template: str, **content: Any) -> Path:
    """Fill a template and write it as `report.html`; a page that exists is replaced at once or not at all."""
    text = render(template, **content)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "report.html"
    half = folder / ".report.html.part"
    half.write_text(text, encoding="utf-8", errors="replace")
    half.replace(path)
    return path


def write_fit_report(
    fit: Fit,
    folder: Path,
    *,
    title: str = "Identification",
    provenance: Mapping[str, object] | None = None,
    crossed: CrossValidation | None = None,
) -> Path:
    """Write what a fit says as one self-contained page.

    Parameters
    ----------
    fit : Fit
    folder : Path
        Made when it does not exist.
    title : str
        Heading of the page.
    provenance : mapping, optional
        Where the data came from: file, window, hash by run; texts, lists or further mappings.
        ``"study"`` is the study's file name, used in the commands that are proposed.
    crossed : CrossValidation, optional
        Every run predicted by the others.

    Returns
    -------
    Path
        The page, ``folder / "report.html"``.
    """
    provenance = provenance or {}
    content = fit_content(fit, title=title, provenance=provenance, folder=folder.name, crossed=crossed)
    return write_page(folder, "fit.html", **content)


def fit_content(
    fit: Fit, *, title: str, provenance: Mapping[str, object], folder: str, prefix: str = "fit",
    crossed: CrossValidation | None = None,
) -> dict[str, Any]:  # fmt: skip
    """What the template of a fit needs to know."""
    study = str(provenance.get("study") or "STUDY.toml")
    return {
        "title": title,
        "fit": fit,
        "question": question(fit),
        "provenance": provenance_rows(provenance),
        "motion": Markup(motion(fit)),
        "parameters": parameter_rows(fit),
        "without": without_rows(fit),
        "assumed": sentences(fit.assumptions),
        "own": run_rows(fit),
        "scores": score_rows(fit),
        "poles": pole_rows(fit),
        "runs": run_pictures(fit, prefix),
        "certainty": certainty_pictures(fit, prefix),
        "rest": rest_picture(fit, prefix),
        "crossed": cross_rows(crossed),
        "steps": next_steps(fit, study=study, folder=folder or "OUT", crossed=crossed is not None),
    }


def question(fit: Fit) -> str:
    """The question that was asked, in a sentence."""
    fitted = sum(s.role == "fit" for s in fit.runs.values())
    predicted = len(fit.runs) - fitted
    runs = f"{fitted} run{'s' if fitted != 1 else ''}"
    asked = ", ".join(fit.rig.estimated) or "no parameter"
    held = f", and does the model then predict {predicted} more that it has not seen?" if predicted else "?"
    return f"Which values of {asked} let the equations of motion of '{fit.rig.plant.__name__}' follow {runs}{held}"


def motion(fit: Fit) -> str:
    """Equations of motion with the terms that this fit used."""
    zero = {n for n, p in fit.rig.parameters.items() if not p.estimate and p.value == 0}
    unnamed = {
        n
        for n in fit.rig.plant.names()
        if n not in fit.rig.parameters
        and fit.rig.plant.quantity(n).lower <= 0 <= fit.rig.plant.quantity(n).upper
        and not fit.rig.plant.quantity(n).open_lower
    }
    return equations(fit.rig.plant, zero=zero | unnamed)


def run_pictures(fit: Fit, prefix: str) -> list[Picture]:
    """Data against model, run by run, fitted runs first."""
    from upright.report.figures import fit_figure
    from upright.report.symbols import percent, plain

    pictures: list[Picture] = []
    runs = sorted(fit.runs.items(), key=lambda item: item[1].role != "fit")
    signals = sum(len(score.measured) for _, score in runs)
    buckets = max(100, min(450, 6000 // max(signals, 1)))  # keeps the page below 2 MB whatever the number of runs
    for i, (label, score) in enumerate(runs):
        what = "fitted" if score.role == "fit" else "predicted, not fitted"
        how = "" if score.horizon is None else f", restarted from the measured state every {score.horizon:g} s"
        how = f", every sample predicted {score.horizon:g} s ahead" if score.ahead else how
        how += f", scored from {score.score_from:g} s on" if score.score_from > 0 else ""
        fits = ", ".join(f"{plain(n)} {percent(v)}" for n, v in score.fit_percent.items())
        pictures.append(
            picture(
                fit_figure(score, fit.rig.plant, title=f"{label} ({what})", buckets=buckets),
                f"{prefix}-run{i}",
                caption=f"Run '{label}', {what}{how}. Wide light line: measured; thin dashed line: model; "
                "below each, their difference.",
                description=f"Measured and modelled signals over {score.t[-1] - score.t[0]:.3g} s; fit {fits}.",
            )
        )
    return pictures


def rest_picture(fit: Fit, prefix: str) -> list[Picture]:
    """Autocorrelation of the residuals of all runs, or nothing when there is no run."""
    from upright.report.figures import autocorrelation_figure

    if not fit.runs:
        return []
    return [
        picture(
            autocorrelation_figure(fit.runs),
            f"{prefix}-rest",
            caption="Autocorrelation of the residuals. White noise would stay inside the grey band 95 % of the "
            "time; slow waves outside it are motion that the model does not explain.",
            description="One panel per run and signal; correlation from −1 to 1 against lag in seconds.",
        )
    ]


def certainty_pictures(fit: Fit, prefix: str) -> list[Picture]:
    """Intervals, correlations and directions, as far as the fit states them."""
    from upright.report.certainty import correlation_figure, directions_figure, interval_figure

    pictures: list[Picture] = []
    if any(e.status != "known" and e.value != 0 for e in fit.estimates.values()):
        pictures.append(
            picture(
                interval_figure(fit.estimates),
                f"{prefix}-intervals",
                caption="Interval of every estimate relative to its value. Solid with a disk: firm. Dashed with a "
                "square: weak, unseen or at a bound; an arrow leaves the picture.",
                description="The same intervals as in the table above.",
            )
        )
    n = len(fit.names)
    if 1 < n <= 24 and fit.correlation.shape == (n, n):
        pictures.append(
            picture(
                correlation_figure(fit),
                f"{prefix}-correlation",
                caption="Correlation of the estimates. Close to ±1 (bold): the data fix a combination of the two "
                "better than either.",
                description=_strongest(fit),
            )
        )
    if n and n <= 24 and fit.singular_values.size and fit.directions.shape == (fit.singular_values.size, n):
        pictures.append(
            picture(
                directions_figure(fit),
                f"{prefix}-directions",
                caption="Singular values of the scaled Jacobian, each with its combination of relative changes in the "
                "parameters. What stands near or left of the dotted line, the data cannot see.",
                description="; ".join(fit.unseen) or "No combination of the parameters is unseen.",
            )
        )
    return pictures


def _strongest(fit: Fit) -> str:
    import numpy as np

    off = np.nan_to_num(np.abs(fit.correlation - np.diag(np.diag(fit.correlation))))
    i, j = np.unravel_index(int(np.argmax(off)), off.shape)
    return f"The strongest correlation is {fit.correlation[i, j]:.3f}, between {fit.names[i]} and {fit.names[j]}."
