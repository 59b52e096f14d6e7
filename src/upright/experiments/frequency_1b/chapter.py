"""Experiment 1b as a chapter: the numbers that its words in `chapter.md` print, and what other programs read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from upright.experiments.frequency_1b.at_once import AtOnce
from upright.experiments.frequency_1b.figures import bode_charts, quality_chart
from upright.experiments.frequency_1b.run import FrequencyRun, LoggedResponse
from upright.experiments.stand.fits import fit_chapter
from upright.identification.frequency.answer import FrequencyFit, curves, digits, key_value
from upright.identification.frequency.response import FrequencyResponse
from upright.identification.model.fit import Estimate
from upright.report.fit.tables import finding, parameter_table, plain_estimate, pole_table
from upright.report.page import Chapter, KeyNumber, Symbol, Table
from upright.report.prose import chapter_of
from upright.report.rig import rig_drawing
from upright.report.symbols import number, unit


def chapter(result: FrequencyRun) -> Chapter:
    """The experiment on a twin."""
    answer, true, bench = result.answer, true_key(result), result.make.bench
    uncertain = {n: p for n, p in answer.rig.parameters.items() if p.uncertainty and n not in bench}
    page = _page(
        answer.data, answer, result.folder, truth=result.truth, run=result, actual=true,
        upright="inverted" in result.rig.plant.equilibria,
        settled=[d.settle for d in result.sweep.dwells if math.isfinite(d.settle)],
        weighed={n: p.uncertainty / p.value for n, p in uncertain.items()},
    )  # fmt: skip
    return replace(
        page, best="bode", drawing=rig_drawing(result.rig.plant),
        findings=_findings(result, key_value(answer.key), true),
        numbers=_numbers(answer, truth=result.truth, key=true)
        | {"at_the_rig": result.sweep.seconds, "seconds": result.seconds},
    )  # fmt: skip


def log_chapter(result: LoggedResponse) -> Chapter:
    """What logs of one's own say, in the same frame."""
    data, answer = result.response, result.answer
    response = _response_numbers(data)
    page = _page(data, answer, result.folder, run=None, sources=result.sources, response=response)
    numbers = response if answer is None else _numbers(answer) | {"response": response}
    return replace(page, best="bode", numbers=numbers)


def _page(
    data: FrequencyResponse, answer: FrequencyFit | None, folder: Path, *, truth: Mapping[str, float] | None = None,
    **values: Any,
) -> Chapter:  # fmt: skip
    """A response, with both fits where there are such."""
    still = np.all(data.coherence < 0.5, axis=0)  # outputs that follow the command nowhere
    poor = data.coherence[:, still.all() | ~still].min(axis=1) < 0.5
    charts = bode_charts(data, answer, fine=() if answer is None else curves(answer))
    more: dict[str, Any] = {} if answer is None else {
        "estimate": key_value(answer.key), "digits": digits,
        "reached": answer.simplex_pole.real if answer.key[1] == "unstable pole" else answer.simplex_pole.imag,
        "dry": any(j.coulomb in answer.squares.names for j in answer.rig.plant.joints),
    }  # fmt: skip
    page = chapter_of(
        __name__, data=data, answer=answer, folder=folder, poor=int(poor.sum()),
        deaf=[] if still.all() else [n for n, deaf in zip(data.outputs, still, strict=True) if deaf],
        error=0.0 if poor.all() else float(np.median(data.error[~poor][:, ~still])), **values, **more,
        figures={"quality": quality_chart(data), **{f"bode{j or ''}": chart for j, chart in enumerate(charts)}},
        placed={
            "notes": data.notes,
            "parameters": () if answer is None else (_parameter_table(answer, truth), pole_table(answer.fit)),
        },
    )  # fmt: skip
    return replace(page, key="1b", sound=not poor.all() if answer is None else answer.fit.trusted)


def at_once_chapter(result: AtOnce, folder: Path, truth: Mapping[str, float]) -> Chapter:
    """The motion's fit, and the response frequency by frequency before it."""
    page = fit_chapter(result.study, result.fit, folder, truth)
    if result.response is None:
        left = "Dry friction left too few frequencies for a response; the parameters rest on the motion alone."
        return replace(page, warnings=(*page.warnings, left))
    of_log = log_chapter(result.response)
    question = "How does the hanging rig respond, and which parameters does that determine?"
    return replace(
        page, question=question, parts=(*of_log.parts[:2], *page.parts),
        numbers={**page.numbers, "response": of_log.numbers},
    )  # fmt: skip


def true_key(result: FrequencyRun) -> float:
    """The key number of the twin itself."""
    at, what, _ = result.answer.key
    poles = result.rig.plant.linear(at).poles()
    if what == "unstable pole":
        return float(poles[0].real)
    return float(poles.imag.max())


def _findings(result: FrequencyRun, estimate: Estimate, true: float) -> tuple[KeyNumber, ...]:
    """The key number, inertia of the pendulum and gain of the drive, which nobody weighs."""
    at, what, _ = result.answer.key
    of = "1/s" if what == "unstable pole" else "rad/s"
    out = [finding(f"{what}, {at} [{of}]", estimate, true)]
    estimates = result.answer.fit.estimates
    if (e := estimates.get("J_p")) is not None:
        out.append(finding(Symbol(f"J_p [{unit(e.unit)}]"), e, result.truth["J_p"]))
    if (e := estimates.get("actuator.gain")) is not None:
        out.append(finding(f"gain of the drive [{unit(e.unit)}]", e, result.truth["actuator.gain"]))
    return tuple(out)


def _parameter_table(answer: FrequencyFit, truth: Mapping[str, float] | None = None) -> Table:
    """Every number, by both ways; a magnitude of the linear model does not determine all of them."""
    unasked = {j.coulomb for j in answer.rig.plant.joints} | {"actuator.lag", "actuator.delay"}
    unasked |= {n for n, p in answer.rig.parameters.items() if not p.estimate}
    walked = {n: "–" if n in unasked else number(answer.simplex.values[n]) for n in answer.fit.estimates}
    return parameter_table(
        answer.fit, truth=truth, beside=("simplex", walked),
        caption="Least squares with 95 % intervals, and the simplex' values beside them",
    )  # fmt: skip


def _numbers(
    answer: FrequencyFit, *, truth: Mapping[str, float] | None = None, key: float | None = None
) -> dict[str, Any]:
    """The same as plain values."""
    true = truth or {}
    return {
        "at": answer.key[0], "what": answer.key[1],
        "pole": plain_estimate(key_value(answer.key), key),
        "simplex_pole": complex(answer.simplex_pole),
        "misfit": answer.squares.misfit,
        "parameters": {
            n: plain_estimate(e, true.get(n)) | {"unit": e.unit} for n, e in answer.fit.estimates.items()
        },
        "ways": {
            w.name: {
                "squares_dB": w.squares_dB, "models": w.evaluations, "seconds": w.seconds, "values": dict(w.values),
            }
            for w in (answer.simplex, answer.squares.way)
        },
        "left_out": answer.left_out,
        "trusted": answer.fit.trusted,
    }  # fmt: skip


def _response_numbers(data: FrequencyResponse) -> dict[str, Any]:
    """A response as plain values."""
    return {
        "omega": data.omega,
        "outputs": {
            name: {
                "magnitude_dB": data.magnitude_dB[:, j],
                "phase_deg": np.degrees(np.angle(data.response[:, j])),
                "error_percent": 100 * data.error[:, j],
                "coherence": data.coherence[:, j],
                "distortion": data.distortion[:, j],
            }
            for j, name in enumerate(data.outputs)
        },
    }
