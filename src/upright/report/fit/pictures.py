"""Pictures of the runs of a fit: data against model, and what is left over."""

from __future__ import annotations

from collections.abc import Mapping

from upright.identification.model.fit import Fit, RunScore
from upright.physics import Plant
from upright.report.fit.figures import autocorrelation_figure, fit_figure
from upright.report.fit.interactive import score_traces
from upright.report.interactive.traces import ROOM
from upright.report.page import Picture
from upright.report.symbols import percent, plain


def run_pictures(fit: Fit, prefix: str) -> list[Picture]:
    """Data against model, run by run, fitted runs first."""
    return score_pictures(fit.runs, fit.model.plant, prefix)


def score_pictures(scores: Mapping[str, RunScore], plant: type[Plant], prefix: str) -> list[Picture]:
    """Data against model, run by run, fitted runs first, predicted ones with their bands."""
    pictures: list[Picture] = []
    runs = sorted(scores.items(), key=lambda item: item[1].role != "fit")
    signals = sum(len(score.measured) for _, score in runs)
    buckets = max(100, min(450, 6000 // max(signals, 1)))  # keeps the page below 2 MB whatever the number of runs
    for i, (label, score) in enumerate(runs):
        what = "fitted" if score.role == "fit" else "predicted, not fitted"
        how = "" if score.horizon is None else f", restarted from the measured state every {score.horizon:g} s"
        how = f", every sample predicted {score.horizon:g} s ahead" if score.ahead else how
        how += f", scored from {score.score_from:g} s on" if score.score_from > 0 else ""
        fits = ", ".join(f"{plain(n)} {percent(v)}" for n, v in score.fit_percent.items())
        title = f"{label} ({what})"
        pictures.append(
            Picture(
                name=f"{prefix}-run{i}",
                draw=lambda score=score, title=title: fit_figure(score, plant, title=title, buckets=buckets),
                interactive=lambda score=score, title=title: score_traces(
                    {"model": score}, plant, name=title, room=ROOM // len(runs)
                ),
                caption=f"Run '{label}', {what}{how}. Wide light line: measured; thin line: model; "
                f"below each, their difference.{_banded(score)}",
                description=f"Measured and modelled signals over {score.t[-1] - score.t[0]:.3g} s; fit {fits}.",
            )
        )
    return pictures


def _banded(score: RunScore) -> str:
    if not score.band:
        return ""
    inside = ", ".join(f"{plain(n)} {percent(v)}" for n, v in score.inside.items())
    return f" Grey: the band that should hold 90 % of the samples; inside are {inside}."


def rest_picture(fit: Fit, prefix: str) -> list[Picture]:
    """Autocorrelation of the residuals of all runs, or nothing when there is no run."""
    if not fit.runs:
        return []
    return [
        Picture(
            name=f"{prefix}-rest",
            draw=lambda: autocorrelation_figure(fit.runs),
            caption="Autocorrelation of the residuals. White noise would stay inside the grey band 95 % of the "
            "time; slow waves outside it are motion that the model does not explain.",
            description="One panel per run and signal; correlation from −1 to 1 against lag in seconds.",
        )
    ]
