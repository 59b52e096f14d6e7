"""Experiment 1b as a chapter: excitation, response, both fits side by side, and the pole to be stabilised."""

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
from upright.report.page import Chapter, KeyNumber, Part, Picture, Points, Step, Symbol, Table
from upright.report.rig import rig_drawing
from upright.report.symbols import number, plain, typed, unit

QUESTION = (
    "What does the rig answer to a sine, and which numbers of its equations does that fix, the pole by which it falls "
    "upright among them?"
)
_EXCITATION = {
    "sines": "one sine after the other",
    "multisine": "all frequencies at once, periods averaged",
    "sweep": "a sweep up and down, windows averaged",
}


def chapter(result: FrequencyRun) -> Chapter:
    """The experiment on a twin."""
    answer = result.answer
    true = true_key(result)
    estimate = key_value(answer.key)
    inside = estimate.interval[0] <= true <= estimate.interval[1]
    off = 100 * abs(estimate.value / true - 1)
    upright = "inverted" in result.rig.plant.equilibria
    return Chapter(
        key="1b",
        best="bode",
        drawing=rig_drawing(result.rig.plant),
        title="Frequency response of the hanging rig" if upright else "Frequency response",
        question=QUESTION,
        verdict=answer.fit.verdict,
        detail=f"The twin's own is {number(true, 6)}: {off:.2g} % off, {'inside' if inside else 'outside'} the "
        f"interval. {_simplex_sentence(answer)}",
        sound=answer.fit.trusted,
        parts=(
            Part("Excitation", (*_campaign(result), _quality_picture(answer.data)), folded=True),
            *_answer_parts(answer, truth=result.truth, known=_bench(result)),
        ),
        steps=_steps(result),
        findings=_findings(result, estimate, true),
        numbers=_numbers(answer, truth=result.truth, key=true)
        | {"at_the_rig": result.sweep.seconds, "seconds": result.seconds},
    )


def log_chapter(result: LoggedResponse) -> Chapter:
    """What logs of one's own say, in the same frame."""
    data, answer = result.response, result.answer
    span = f"{data.omega[0]:.3g} to {data.omega[-1]:.3g} rad/s"
    sources = f"{len(data)} frequencies from {span} in {', '.join(result.sources)}."
    source_part = Part("Excitation", (sources, *data.notes, _quality_picture(data)))
    fit = typed(result.folder / "fit.json")
    if answer is not None:
        return Chapter(
            key="1b", title="Frequency response of a rig", question=QUESTION, verdict=answer.fit.verdict,
            detail=_simplex_sentence(answer), sound=answer.fit.trusted, parts=(source_part, *_answer_parts(answer)),
            steps=(
                Step("Find gains for these numbers, and what their errors do to the loop.",
                     f"upright design {fit} --lqr 1,0,1,0 --limit 5"),
                Step("Fit a log of a free swing too, and see whether both agree.",
                     "upright init LOG"),
            ),
            numbers=_numbers(answer) | {"response": _response_numbers(data)},
        )  # fmt: skip
    poor = data.coherence.min(axis=1) < 0.5
    verdict = (
        f"Where most of the power follows the command ({len(data) - int(poor.sum())} of {len(data)} frequencies), "
        f"magnitudes are known to {number(100 * float(np.median(data.error[~poor])), 2)} % (median standard error)."
        if not poor.all()
        else "Nowhere does half of the power follow the command: this log tells no response."
    )
    response = _response_numbers(data)
    return Chapter(
        key="1b", title="Frequency response", question="What does the rig answer, frequency by frequency?",
        verdict=verdict, sound=not poor.all(),
        parts=(source_part, Part("Response", (*_bode_pictures(data), _response_table(response)))),
        steps=(
            Step("Fit it: name the make, and what of it is known.",
                 f"upright frequency {typed(result.folder / 'frequency.csv')} --rig linear -o again"),
            Step("Take it to python-control.",
                 "FrequencyResponse.from_csv('frequency.csv').to_control()"),
        ),
        numbers=response,
    )  # fmt: skip


def at_once_chapter(result: AtOnce, folder: Path, truth: Mapping[str, float]) -> Chapter:
    """The motion's fit, and the response frequency by frequency before it."""
    page = fit_chapter(result.study, result.fit, folder, truth)
    if result.response is None:
        left = "Dry friction left too few frequencies for a response; the numbers rest on the motion alone."
        return replace(page, warnings=(*page.warnings, left))
    of_log = log_chapter(result.response)
    question = "What does the rig answer while it hangs, and which numbers of its equations does that fix?"
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


def _campaign(result: FrequencyRun) -> tuple[str, ...]:
    data = result.answer.data
    settle = np.array([d.settle for d in result.sweep.dwells])
    waited = settle[np.isfinite(settle)]
    sentences = [
        f"{len(data)} frequencies from {data.omega[0]:.3g} to {data.omega[-1]:.3g} rad/s, {_EXCITATION[result.kind]}, "
        f"in {result.sweep.seconds / 60:.0f} minutes at the rig. Commands were chosen, from probes, to move every "
        "coordinate well above stiction and encoder steps, and to stay within the drive's limit and the travel."
    ]
    if waited.size:
        late = settle.size - waited.size
        rest = f"; {late} had not settled after 40 s, and what beats there counts as their error" if late else ""
        sentences.append(
            "Each sine ran until its transient, estimated from the data, had decayed: "
            f"{waited.min():.0f} to {waited.max():.0f} s{rest}."
        )
    else:
        sentences += data.notes
    return tuple(sentences)


def _bench(result: FrequencyRun) -> str:
    names = ", ".join(f"{n} to {100 * s:g} %" for n, s in result.make.bench.items())
    weighed = {n: p for n, p in result.answer.rig.parameters.items() if p.uncertainty and n not in result.make.bench}
    if weighed:
        shares = ", ".join(f"{n} to {100 * p.uncertainty / p.value:.2g} %" for n, p in weighed.items())
        names += f"; from experiment 1a: {shares}"
    return (
        f"Known from the bench: {names}. A response sees masses, frictions and the drive's gain only relative to each "
        "other, so the bench fixes the scale; the unstable pole does not depend on it."
        if result.answer.key[1] == "unstable pole"
        else f"Known from the bench: {names}; it fixes the scale of masses, stiffness, frictions and gain."
    )


def _steps(result: FrequencyRun) -> tuple[Step, ...]:
    """What to do next with the fit."""
    answer, folder, make = result.answer, result.folder, result.make
    fit = typed(folder / "fit.json")
    if answer.key[1] == "unstable pole":
        gains = f'upright design {fit} --at {answer.key[0]} --poles "-4.15+-1.63j, -16.9, -3.2"'
    else:
        gains = f"upright design {fit} --lqr 1,0,1,0 --limit 5"
    log, hold = typed(folder / "sweep.csv"), answer.data.hold
    return (
        Step("Find gains for these numbers, and what their errors do to the loop.", gains),
        Step(
            "Estimate the response again from the log, as you would from your own.",
            f'upright frequency {log} --rig {make.key} --hold "{1e3 * hold:.4g} ms" -o again',
        ),
        Step(
            "Ask all frequencies at once, and see what that saves and costs.",
            f"upright frequency --rig {make.key} --ask multisine",
        ),
    )


def _simplex_sentence(answer: FrequencyFit) -> str:
    """What the paper's way says about the same number."""
    estimate = key_value(answer.key)
    there = answer.simplex_pole.real if answer.key[1] == "unstable pole" else answer.simplex_pole.imag
    if not math.isfinite(there):
        return "The simplex on dB ends at a rig without such a pole."
    off = 100 * (there / estimate.value - 1)
    why = (
        " It fits a linear model, in which dry friction has to pass for viscous friction."
        if abs(off) > 1 and any(j.coulomb in answer.squares.names for j in answer.rig.plant.joints)
        else ""
    )
    return f"The paper's simplex on dB says {number(there)}, {abs(off):.2g} % {'more' if off > 0 else 'less'}.{why}"


def _answer_parts(
    answer: FrequencyFit, *, truth: Mapping[str, float] | None = None, known: str = ""
) -> tuple[Part, ...]:
    """Data with both fits, their cost, and the numbers."""
    left = (Points(answer.left_out),) if answer.left_out else ()
    return (
        Part("Response and fits", (*left, *_bode_pictures(answer.data, answer))),
        Part(
            "Two ways to fit it",
            (
                "The simplex walks on squared dB of the linear model, the far output first and then all. Least squares "
                "uses the phase too, weighs points by their errors, and knows what dry friction amounted to in the "
                "motion that was measured (its describing function, from the turning points of the encoders).",
                f"Walk of the simplex: {'; '.join(answer.simplex.stages)}.",
                _way_table(answer),
            ),
        ),
        Part(
            "Numbers",
            (
                *((known,) if known else ()),
                _start_sentence(answer),
                _parameter_table(answer, truth),
                pole_table(answer.fit),
            ),
        ),
    )


def _start_sentence(answer: FrequencyFit) -> str:
    s = answer.squares
    return (
        f"{s.reached} of {s.starts} starts reached the same minimum; chi square per degree of freedom {s.misfit:.2g} "
        f"by the errors stated{', by whose root intervals are widened' if s.misfit > 1 else ''}."
    )


def _way_table(answer: FrequencyFit) -> Table:
    """Both methods side by side."""
    estimate = key_value(answer.key)
    unstable = answer.key[1] == "unstable pole"
    d = digits(estimate)
    poles = (answer.simplex_pole.real if unstable else answer.simplex_pole.imag, estimate.value)
    rows = tuple(
        (w.name, number(w.squares_dB, 3), str(w.evaluations), number(w.seconds, 2), number(p, n))
        for w, p, n in ((answer.simplex, poles[0], 4), (answer.squares.way, poles[1], d))
    )
    return Table(
        caption="Sum of squared errors of the magnitude, models computed, time, and the number that matters",
        headings=("", "dB²", "models", "s", f"{answer.key[1]} [{'1/s' if unstable else 'rad/s'}]"), rows=rows,
        numbers=(1, 2, 3, 4),
    )  # fmt: skip


def _parameter_table(answer: FrequencyFit, truth: Mapping[str, float] | None = None) -> Table:
    """Every number, by both ways; a magnitude of the linear model does not determine all of them."""
    unasked = {j.coulomb for j in answer.rig.plant.joints} | {"actuator.lag", "actuator.delay"}
    unasked |= {n for n, p in answer.rig.parameters.items() if not p.estimate}
    walked = {n: "–" if n in unasked else number(answer.simplex.values[n]) for n in answer.fit.estimates}
    return parameter_table(
        answer.fit, truth=truth, beside=("simplex", walked),
        caption="Least squares with 95 % intervals, and the simplex' values beside them",
    )  # fmt: skip


def _bode_pictures(data: FrequencyResponse, answer: FrequencyFit | None = None) -> list[Picture]:
    """The paper's fig. 5, an output each, with what the fits leave."""
    fits = " Both fits; below, how far each misses the points." if answer is not None else ""
    charts = bode_charts(data, answer, fine=curves(answer) if answer is not None else ())
    return [
        chart.picture(
            f"bode{j or ''}",
            caption=f"Magnitude, phase and coherence of {plain(output)} per unit of command, with 95 % bars (mostly "
            f"smaller than the points).{fits}",
            description=f"{len(data)} frequencies, {data.omega[0]:.3g} to {data.omega[-1]:.3g} rad/s.",
        )
        for j, (output, chart) in enumerate(zip(data.outputs, charts, strict=True))
    ]


def _quality_picture(data: FrequencyResponse) -> Picture:
    """Coherence, distortion, error and amplitude."""
    return quality_chart(data).picture(
        "quality",
        caption="What each point is worth: how far its coherence stays below 1, harmonics (dry friction makes them; a "
        "sweep measures none), stated error, and the motion and command it was measured with.",
        description=f"Least coherence {float(data.coherence.min()):.4g}, "
        f"largest distortion {float(data.distortion.max()):.2g}.",
    )


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


def _response_table(response: Mapping[str, Any]) -> Table:
    """A response, output by output, from `_response_numbers`."""
    rows = tuple(
        (name, number(w, 4), number(o["magnitude_dB"][k], 4), number(o["phase_deg"][k], 4),
         number(o["error_percent"][k], 2), number(o["coherence"][k], 4))
        for name, o in response["outputs"].items() for k, w in enumerate(response["omega"])
    )  # fmt: skip
    return Table(
        caption="Response", headings=("", "rad/s", "dB", "deg", "error [%]", "coherence"), rows=rows,
        numbers=(1, 2, 3, 4, 5),
    )  # fmt: skip
