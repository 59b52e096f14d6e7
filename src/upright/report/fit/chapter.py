"""A fit as a chapter: the numbers and pictures that its words in `chapter.md` print."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from upright.errors import ImpossiblePhysics
from upright.identification.inference.assumptions import assumption_sentences
from upright.identification.ladder.cross_validation import CrossValidation
from upright.identification.model.fit import Fit
from upright.report.fit.advice import fit_steps
from upright.report.fit.equations import equations
from upright.report.fit.figures import directions_figure, interval_figure, path_figure
from upright.report.fit.interactive import path_traces, search_path
from upright.report.fit.pictures import rest_picture, run_pictures
from upright.report.fit.tables import (
    cross_table,
    finding,
    parameter_table,
    pole_table,
    ratio_table,
    run_table,
    score_table,
)
from upright.report.interactive.cells import Cells
from upright.report.page import Assessment, Block, Chapter, Facts, Formula, KeyNumber, Part, Picture, Symbol
from upright.report.planes import fitted_poles_chart
from upright.report.prose import chapter_of, templates_of
from upright.report.rig import rig_drawing

READABLE = 24
"""Parameters whose names there is room for beside a matrix."""


def chapter(
    fit: Fit,
    *,
    title: str = "Identification",
    provenance: Mapping[str, object] | None = None,
    study: str = "STUDY.toml",
    folder: str = "OUT",
    crossed: CrossValidation | None = None,
    windows: Sequence[str] = (),
) -> Chapter:
    """What a fit says.

    Parameters
    ----------
    provenance : mapping, optional
        Where the data came from: file, window, hash by run; texts, lists or further mappings.
    study, folder : str
        Study and folder of the results, as the commands that are proposed name them.
    crossed : CrossValidation, optional
        Every run predicted by the others.
    windows : sequence of str
        How much of each log counts, in sentences.
    """
    pictures, ratios, own, poles = run_pictures(fit, "fit"), ratio_table(fit), run_table(fit), pole_table(fit)
    estimated, assumed = parameter_table(fit), assumption_sentences(fit.assumptions)
    fitted = sum(s.role == "fit" for s in fit.runs.values())
    page = chapter_of(
        __name__, fit=fit, title=title, plant=fit.model.plant.__name__, headline=headline(fit),
        detail=" ".join([*(a.headline for a in fit.answers), *assumed]) or fit.verdict,
        fitted=fitted, predicted=len(fit.runs) - fitted, estimated=bool(estimated.rows), assumed=assumed,
        poles=bool(poles.rows), windows=windows, crossed=crossed,
        varied=any(e.status != "known" and e.value != 0 for e in fit.estimates.values()),
        strongest=_strongest(fit), directed=_directed(fit),
        figures={
            "fit-poles": fitted_poles_chart(fit.poles) if poles.rows else None,
            "fit-intervals": lambda: interval_figure(fit.estimates),
            "fit-correlation": Cells(names=fit.names, matrix=fit.correlation),
            "fit-directions": lambda: directions_figure(fit),
            "fit-search": (lambda: path_figure(*search_path(fit)), lambda: path_traces(fit)),
        },
        placed={
            "parameters": (estimated,), "ratios": (ratios,) if fit.assumptions and ratios.rows else (),
            "own": (own,) if own.rows else (), "poles": (poles,), "scores": (score_table(fit.runs),),
            "crossed": () if crossed is None else (cross_table(crossed),), "pictures": pictures,
            "residuals": rest_picture(fit, "fit"),
            "motion": (motion_part(fit),), "data": (data_part(provenance or {}),),
        },
    )  # fmt: skip
    return replace(
        page, sound=fit.trusted, warnings=fit.warnings, drawing=_drawing(fit), best=_best(fit, pictures),
        findings=tuple(_findings(fit)),
        assessments=tuple(
            Assessment(question=a.question, state=_STATES[a.answer], why=a.headline) for a in fit.answers
        ),
        steps=fit_steps(fit, study=study, folder=folder, crossed=crossed is not None),
    )  # fmt: skip


_STATES = {"yes": "supported", "in part": "in part", "no": "not supported"} | {
    w: w for w in ("not tested", "not asked")
}


def _drawing(fit: Fit) -> Picture | None:
    """The rig as estimated, where its numbers are those of a rig."""
    if fit.failed:
        return None
    try:
        return rig_drawing(fit.plant)
    except ImpossiblePhysics:
        return None


def _best(fit: Fit, pictures: Sequence[Picture]) -> str:
    """The run that tests the model, where one does: pictures begin with the fitted ones."""
    fitted = sum(s.role == "fit" for s in fit.runs.values())
    return pictures[fitted if fitted < len(pictures) else 0].name if pictures else ""


def _findings(fit: Fit) -> Iterator[KeyNumber]:
    """The pole that a loop has to master, then what was estimated, inertias and lengths before friction."""
    poles = [p.real for p in fit.poles.get("inverted", ()) if p.real.value > 0]
    fastest = max(poles, key=lambda e: e.value, default=None)
    if fastest is not None and not fastest.rests_on:
        yield finding("unstable pole", fastest, meaning="upright")
    about = fit.model.parameters
    estimates = [(n, e) for n, e in fit.estimates.items() if e.status not in ("known", "nuisance", "left out")]
    for name, e in sorted(estimates, key=lambda item: item[0].startswith(("b_", "delta_", "v_"))):
        yield finding(Symbol(name), e, meaning=about[name].meaning if name in about else "")


def headline(fit: Fit) -> str:
    """The verdict in a sentence."""
    return templates_of(__package__).get_template("headline.md").render(fit=fit).strip()


def data_part(provenance: Mapping[str, object]) -> Part:
    """Where the data came from."""
    origin: Block = Facts(tuple(_origin(provenance))) if provenance else "No origin was stated for these data."
    return Part(title="Where the data come from", key="data", content=(origin,), aside=True)


def _origin(provenance: Mapping[str, object], above: str = "") -> list[tuple[str, str]]:
    """What is known about the origin, nested mappings written out: ``runs / decay / file``."""
    rows: list[tuple[str, str]] = []
    for key, value in provenance.items():
        name = f"{above} / {key}" if above else str(key)
        if isinstance(value, Mapping):
            rows += _origin({str(k): v for k, v in value.items()}, name)
        elif isinstance(value, list | tuple | set | frozenset):
            rows.append((name, "; ".join(str(v) for v in value)))
        elif value is not None and value != "":
            rows.append((name, str(value)))
    return rows


def motion_part(fit: Fit) -> Part:
    """Equations of motion with the terms that this fit used."""
    plant, parameters = fit.model.plant, fit.model.parameters
    zero = {n for n, p in parameters.items() if not p.estimate and p.value == 0}
    for name in set(plant.names()) - parameters.keys():
        q = plant.quantity(name)
        if q.lower <= 0 <= q.upper and not q.open_lower:
            zero.add(name)
    derived = (
        f"Derived from the kinetic and potential energy of {plant.__name__}; terms whose parameter is zero in this fit "
        "are left out."
    )
    return Part(
        title="Equations of motion",
        key="motion",
        content=(derived, Formula(markup=equations(plant, zero=zero))),
        folded=True,
    )


def _strongest(fit: Fit) -> tuple[float, str, str] | None:
    """The strongest correlation and its pair, where there is a matrix that can be read."""
    n = len(fit.names)
    if not 1 < n <= READABLE or fit.correlation.shape != (n, n):
        return None
    off = np.nan_to_num(np.abs(fit.correlation - np.diag(np.diag(fit.correlation))))
    i, j = np.unravel_index(int(np.argmax(off)), off.shape)
    return fit.correlation[i, j], fit.names[i], fit.names[j]


def _directed(fit: Fit) -> bool:
    n, rank = len(fit.names), fit.singular_values.size
    return 0 < n <= READABLE and rank > 0 and fit.directions.shape == (rank, n)
