"""How does a frequency response look beside its fits? The paper's fig. 5, with residuals and each point's worth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from upright.gains.requests import Roots
from upright.identification.frequency.answer import FrequencyFit
from upright.identification.frequency.response import FrequencyResponse
from upright.records import Array
from upright.report.interactive.charts import Chart, ChartLine, ChartPanel
from upright.report.symbols import plain, unit


def bode_charts(
    data: FrequencyResponse, answer: FrequencyFit | None = None, *, fine: Sequence[tuple[Array, Roots]] = ()
) -> list[Chart]:
    """Magnitude [dB], phase [deg] and coherence of each output, with 95 % bars; both fits, and how far they miss.

    `fine` are frequencies and responses (F, n) of the fits on a close grid, least squares first.
    """
    return [_bode(data, answer, fine, j) for j in range(len(data.outputs))]


def _bode(data: FrequencyResponse, answer: FrequencyFit | None, fine: Sequence[tuple[Array, Roots]], j: int) -> Chart:
    used = np.isin(data.omega, answer.used.omega) if answer is not None else np.ones(len(data), dtype=bool)
    turn = np.degrees(np.unwrap(np.angle(data.response[:, j])))
    turn -= 360 * np.round(np.median(turn + 90) / 360)
    # a bar of half a turn says that the phase is unknown; a longer one would hide all else
    decibel, error = data.magnitude_dB[:, j], np.minimum(data.error[:, j], np.pi / 1.96)
    magnitude = _measured(data.omega, decibel, 1.96 * 20 / np.log(10) * error, used)
    phase = _measured(data.omega, turn, 1.96 * np.degrees(error), used)
    fits = (("least squares", "q0", "", "o"), ("simplex on dB", "q1", "7 4", "s"))
    for (name, colour, dash, _), (w, model) in zip(fits, fine, strict=False):
        magnitude.append(ChartLine(name=name, x=w, y=20 * np.log10(np.abs(model[:, j])), colour=colour, dash=dash))
        angle = np.degrees(np.unwrap(np.angle(model[:, j])))
        near = int(np.argmin(np.abs(w - data.omega[len(data) // 2])))
        angle -= 360 * np.round((angle[near] - turn[len(data) // 2]) / 360)
        phase.append(ChartLine(name=name, x=w, y=angle, colour=colour, dash=dash))
    to, by = unit(data.units[j]), unit(data.units[-1])
    per = f" re 1 {to}/{by}" if to and by else ""
    of = f"{plain(data.outputs[j])} / {data.input}"
    coherent = ChartLine(name="measured", x=data.omega, y=data.coherence[:, j], mark="p")
    panels = [
        ChartPanel(title=f"{of}, magnitude", unit=f"dB{per}", lines=tuple(magnitude)),
        ChartPanel(title=f"{of}, phase", unit="deg", step=90.0 if np.ptp(turn) > 200 else 45.0, lines=tuple(phase)),
    ]
    if data.states_coherence:
        least = min(0.9, float(coherent.y.min()) - 0.02)
        panels.append(ChartPanel(title="coherence", lines=(coherent,), limits=(least, 1.02), height=80.0))
    if answer is not None:
        at, models = answer.used, (answer.squares.way.model, answer.simplex.model)
        missed = tuple(
            ChartLine(
                name=name, x=at.omega, y=100 * np.abs(at.response[:, j] / model[:, j] - 1), colour=colour, mark=mark
            )
            for (name, colour, _, mark), model in zip(fits, models, strict=True)
        )
        panels.append(
            ChartPanel(title="distance from each fit", unit="%", lines=missed, logarithmic=True, height=110.0)
        )
    return Chart(x="frequency", unit="rad/s", logarithmic=True, panels=tuple(panels))


def _measured(w: Array, y: Array, half: Array, used: np.ndarray) -> list[ChartLine]:
    """Points with their bars, those that no fit used hollow and grey."""
    bars = (y - half)[used], (y + half)[used]
    lines = [ChartLine(name="measured", x=w[used], y=y[used], mark="p", bars=bars)]
    if not used.all():
        lines.append(ChartLine(name="measured, left out", x=w[~used], y=y[~used], mark="x", colour="ink-2"))
    return lines


def quality_chart(data: FrequencyResponse) -> Chart:
    """What each point is worth: what is not coherent, harmonics, stated error, and the motion it was measured at.

    What a campaign does not measure, such as harmonics of a sweep, has no panel.
    """
    amplitude = np.abs(data.response * data.drive[:, None])
    shown = (
        (np.maximum(1 - data.coherence, 1e-9) * data.states_coherence, "1 − coherence", ""),
        (data.distortion, "harmonics over fundamental", ""),
        (np.maximum(100 * data.error, 1e-5), "standard error", "%"),
        (amplitude, "amplitude", ""),
    )
    marks = (("o", "q0"), ("s", "q1"), ("^", "q2"), ("D", "q3"))

    def name(j: int) -> str:
        of = unit(data.units[j])
        return plain(data.outputs[j]) + (f" [{of}]" if of else "")

    panels: list[ChartPanel] = []
    for values, title, of in shown:
        lines = [
            ChartLine(name=name(j), x=data.omega, y=values[:, j], mark=marks[j % 4][0], colour=marks[j % 4][1])
            for j in range(len(data.outputs))
        ]
        if title == "amplitude":
            of_command = unit(data.units[-1])
            command = "command" + (f" [{of_command}]" if of_command else "")
            lines.append(ChartLine(name=command, x=data.omega, y=np.abs(data.drive), mark="x"))
        if values.any():
            panels.append(ChartPanel(title=title, unit=of, lines=tuple(lines), logarithmic=True, height=100.0))
    return Chart(x="frequency", unit="rad/s", logarithmic=True, panels=tuple(panels))
