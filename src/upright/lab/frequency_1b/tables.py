"""How is a fitted frequency response told? Tables and pictures for a page, a terminal, another program."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from upright.identification import Estimate
from upright.identification.frequency.answer import Answer, curves, digits, key_value
from upright.identification.frequency.response import FrequencyResponse
from upright.lab.frequency_1b.figures import bode_figure, quality_figure
from upright.report.document import Picture, picture
from upright.report.sections import Part, Table
from upright.report.symbols import measured, number, unit


def simplex_sentence(answer: Answer) -> str:
    """What the paper's way says about the same number."""
    found = key_value(answer.key)
    there = answer.simplex_pole.real if answer.key[1] == "unstable pole" else answer.simplex_pole.imag
    if not math.isfinite(there):
        return "The simplex on dB ends at a rig without such a pole."
    off = 100 * (there / found.value - 1)
    why = (
        " It fits a linear model, in which dry friction has to pass for viscous friction."
        if abs(off) > 1 and any(j.coulomb in answer.squares.names for j in answer.rig.plant.joints)
        else ""
    )
    return f"The paper's simplex on dB says {number(there)}, {abs(off):.2g} % {'more' if off > 0 else 'less'}.{why}"


def answer_parts(answer: Answer, *, truth: Mapping[str, float] | None = None, known: str = "") -> tuple[Part, ...]:
    """Data with both fits, their cost, and the numbers."""
    return (
        Part(title="Response and fits", sentences=answer.left_out, pictures=(bode_picture(answer.data, answer),)),
        Part(
            title="Two ways to fit it",
            sentences=(
                "The simplex walks on squared dB of the linear model, the far output first and then all. Least squares "
                "uses the phase too, weighs points by their errors, and knows what dry friction amounted to in the "
                "motion that was measured (its describing function, from the turning points of the encoders).",
                f"Walk of the simplex: {'; '.join(answer.simplex.stages)}.",
            ),
            tables=(way_table(answer),),
        ),
        Part(
            title="Numbers",
            sentences=tuple(s for s in (known, _start_sentence(answer)) if s),
            tables=(parameter_table(answer, truth), pole_table(answer)),
        ),
    )


def _start_sentence(answer: Answer) -> str:
    s = answer.squares
    return (
        f"{s.reached} of {s.starts} starts reached the same minimum; chi square per degree of freedom {s.misfit:.2g} "
        f"by the errors stated{', by whose root intervals are widened' if s.misfit > 1 else ''}."
    )


def way_table(answer: Answer) -> Table:
    """Both methods side by side."""
    found = key_value(answer.key)
    unstable = answer.key[1] == "unstable pole"
    d = digits(found)
    poles = (answer.simplex_pole.real if unstable else answer.simplex_pole.imag, found.value)
    rows = tuple(
        (w.name, number(w.squares_dB, 3), str(w.evaluations), number(w.seconds, 2), number(p, n))
        for w, p, n in ((answer.simplex, poles[0], 4), (answer.squares.way, poles[1], d))
    )
    return Table(
        caption="Sum of squared errors of the magnitude, models computed, time, and the number that matters",
        headings=("", "dB²", "models", "s", f"{answer.key[1]} [{'1/s' if unstable else 'rad/s'}]"), rows=rows,
        numbers=(1, 2, 3, 4),
    )  # fmt: skip


def parameter_table(answer: Answer, truth: Mapping[str, float] | None = None) -> Table:
    """Every number sought, by both ways."""
    rows: list[tuple[str, ...]] = []
    for name, e in answer.fit.estimates.items():
        value, error = measured(e.value, e.stderr)
        other = answer.simplex.values[name]
        true = (number(truth[name]),) if truth and name in truth else ("",) if truth else ()
        walked = number(other) if name not in _unseen(answer) else "–"
        rows.append((name, *true, value, error, _interval(e), walked, unit(e.unit), _meaning(answer, name)))
    extra = ("truth",) if truth else ()
    return Table(
        caption="Least squares with 95 % intervals, and the simplex' values beside them",
        headings=("", *extra, "value", "std. error", "interval", "simplex", "unit", "meaning"), rows=tuple(rows),
        numbers=tuple(range(1, 3 + len(extra))),
    )  # fmt: skip


def _unseen(answer: Answer) -> set[str]:
    """What a magnitude of the linear model is not asked."""
    dry = {j.coulomb for j in answer.rig.plant.joints} | {"actuator.lag", "actuator.delay"}
    return dry | {n for n, p in answer.rig.parameters.items() if not p.estimate}


def _meaning(answer: Answer, name: str) -> str:
    p = answer.rig.parameters[name]
    return p.meaning + ("" if p.estimate else ", known beforehand")


def _interval(e: Estimate) -> str:
    d = min(digits(e), 6)
    return f"{number(e.interval[0], d)} to {number(e.interval[1], d)}"


def pole_table(answer: Answer) -> Table:
    """Poles at every equilibrium."""
    rows = tuple(
        (at, number(p.real.value, 5), _interval(p.real), number(p.imag.value, 5) if p.imag.value else "",
         _interval(p.imag) if p.imag.value else "")
        for at, poles in answer.fit.poles.items() for p in poles if abs(complex(p.real.value, p.imag.value)) > 1e-6
    )  # fmt: skip
    return Table(
        caption="Poles of the fitted rig, dry friction left out; of a pair the upper one",
        headings=("at", "real part [1/s]", "interval", "imaginary part [rad/s]", "interval"), rows=rows, numbers=(1, 3),
    )  # fmt: skip


def bode_picture(data: FrequencyResponse, answer: Answer | None = None) -> Picture:
    """The paper's fig. 5 with residuals."""
    fine = curves(answer) if answer is not None else ()
    told = (
        "Magnitude and phase of what the encoders showed per unit of command, with 95 % bars (mostly smaller than the "
        "points); both fits; below, what each fit leaves, on a scale that is linear within ±0.1."
        if answer is not None
        else "Magnitude and phase of each output per unit of command, with 95 % bars."
    )
    return picture(
        bode_figure(data, answer, fine=fine), "bode", caption=told,
        description=f"{len(data)} frequencies, {data.omega[0]:.3g} to {data.omega[-1]:.3g} rad/s.",
    )  # fmt: skip


def quality_picture(data: FrequencyResponse) -> Picture:
    """Coherence, distortion, error and amplitude."""
    return picture(
        quality_figure(data), "quality",
        caption="What each point is worth: how far its coherence stays below 1, harmonics (dry friction makes them), "
        "stated error, and the motion and command it was measured with.",
        description=f"Least coherence {float(data.coherence.min()):.4g}, "
        f"largest distortion {float(data.distortion.max()):.2g}.",
    )  # fmt: skip


def numbers(answer: Answer, *, truth: Mapping[str, float] | None = None, key: float | None = None) -> dict[str, Any]:
    """The same as plain values."""
    found = key_value(answer.key)
    out: dict[str, Any] = {
        "at": answer.key[0], "what": answer.key[1],
        "pole": {"value": found.value, "stderr": found.stderr, "interval": list(found.interval)},
        "simplex_pole": [_finite(answer.simplex_pole.real), _finite(answer.simplex_pole.imag)],
        "misfit": answer.squares.misfit,
        "parameters": {
            n: {"value": e.value, "stderr": e.stderr, "interval": list(e.interval), "unit": e.unit}
            | ({"truth": truth[n], "inside": e.interval[0] <= truth[n] <= e.interval[1]}
               if truth and n in truth else {})
            for n, e in answer.fit.estimates.items()
        },
        "ways": {
            w.name: {
                "squares_dB": w.squares_dB, "models": w.evaluations, "seconds": w.seconds, "values": dict(w.values),
            }
            for w in (answer.simplex, answer.squares.way)
        },
        "left_out": list(answer.left_out),
        "trusted": answer.fit.trusted,
    }  # fmt: skip
    if key is not None:
        out["pole"] |= {"truth": key, "inside": found.interval[0] <= key <= found.interval[1]}
    return out


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def response_numbers(data: FrequencyResponse) -> dict[str, Any]:
    """A response as plain values."""
    return {
        "omega": data.omega.tolist(),
        "outputs": {
            name: {
                "magnitude_dB": data.magnitude_dB[:, j].tolist(),
                "phase_deg": [math.degrees(math.atan2(z.imag, z.real)) for z in data.response[:, j].tolist()],
                "error_percent": (100 * data.error[:, j]).tolist(),
                "coherence": data.coherence[:, j].tolist(),
                "distortion": data.distortion[:, j].tolist(),
            }
            for j, name in enumerate(data.outputs)
        },
    }


def response_table(told: Mapping[str, Any]) -> Table:
    """A response, output by output, from `response_numbers`."""
    rows = tuple(
        (name, number(w, 4), number(o["magnitude_dB"][k], 4), number(o["phase_deg"][k], 4),
         number(o["error_percent"][k], 2), number(o["coherence"][k], 4))
        for name, o in told["outputs"].items() for k, w in enumerate(told["omega"])
    )  # fmt: skip
    return Table(
        caption="Response", headings=("", "rad/s", "dB", "deg", "error [%]", "coherence"), rows=rows,
        numbers=(1, 2, 3, 4, 5),
    )  # fmt: skip
