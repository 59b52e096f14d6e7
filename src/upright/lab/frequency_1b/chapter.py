"""How is experiment 1b told? What was asked, what came back, both fits side by side, and the pole to be held."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from upright.identification import Estimate
from upright.identification.frequency.answer import Answer, digits, key_value
from upright.lab.frequency_1b.from_logs import LoggedResponse
from upright.lab.frequency_1b.run import FrequencyRun
from upright.lab.frequency_1b.tables import (
    answer_parts,
    bode_picture,
    numbers,
    quality_picture,
    response_numbers,
    simplex_sentence,
)
from upright.report.advice import Step
from upright.report.chapter import Chapter, Finding
from upright.report.sections import Part
from upright.report.symbols import number, typed, unit

QUESTION = (
    "What does the rig answer to a sine, and which numbers of its equations does that fix, the pole by which it falls "
    "upright among them?"
)
_ASKED = {
    "sines": "one sine after the other",
    "multisine": "all frequencies at once, periods averaged",
    "sweep": "a sweep up and down, windows averaged",
}


def chapter(done: FrequencyRun) -> Chapter:
    """Experiment 1b as a chapter."""
    answer = done.answer
    true = true_key(done)
    number_of = key_value(answer.key)
    inside = number_of.interval[0] <= true <= number_of.interval[1]
    off = 100 * abs(number_of.value / true - 1)
    detail = (
        f"The twin's own is {number(true, 6)}: {off:.2g} % off, {'inside' if inside else 'outside'} the interval. "
        f"{simplex_sentence(answer)}"
    )
    return Chapter(
        key="1b",
        title="Frequency response of the hanging rig" if "inverted" in done.rig.plant.equilibria
        else "Frequency response",
        question=QUESTION,
        verdict=answer.fit.verdict,
        detail=detail,
        sound=answer.fit.trusted,
        parts=(
            Part(title="What was asked", sentences=_campaign(done), pictures=(quality_picture(answer.data),)),
            *answer_parts(answer, truth=done.truth, known=_bench(done)),
        ),
        steps=steps(answer, done.folder, done.make.key),
        findings=(_finding(answer, number_of, true), *_found(done)),
        numbers=numbers(answer, truth=done.truth, key=true)
        | {"at_the_rig": done.sweep.seconds, "seconds": done.seconds},
    )  # fmt: skip


def true_key(done: FrequencyRun) -> float:
    """The key number of the twin itself."""
    at, what, _ = done.answer.key
    poles = done.rig.plant.linear(at).poles()
    if what == "unstable pole":
        return float(poles[0].real)
    return float(poles.imag.max())


def _finding(answer: Answer, found: Estimate, true: float) -> Finding:
    d = digits(found)
    of = "1/s" if answer.key[1] == "unstable pole" else "rad/s"
    return Finding(
        what=f"{answer.key[1]}, {answer.key[0]} [{of}]", value=number(found.value, d),
        interval=f"{number(found.interval[0], d)} to {number(found.interval[1], d)}", truth=number(true, d),
    )  # fmt: skip


def _found(done: FrequencyRun) -> list[Finding]:
    """Inertia of the pendulum and gain of the drive, which nobody weighs."""
    out: list[Finding] = []
    for name, what in (("J_p", "J_p"), ("actuator.gain", "gain of the drive")):
        e = done.answer.fit.estimates.get(name)
        if e is None:
            continue
        d = digits(e)
        low, high = (number(x, d) for x in e.interval)
        out.append(
            Finding(what=f"{what} [{unit(e.unit)}]", value=number(e.value, d), interval=f"{low} to {high}",
                    truth=number(done.truth[name], d))
        )  # fmt: skip
    return out


def _campaign(done: FrequencyRun) -> tuple[str, ...]:
    data = done.answer.data
    settle = np.array([d.settle for d in done.sweep.dwells])
    waited = settle[np.isfinite(settle)]
    told = [
        f"{len(data)} frequencies from {data.omega[0]:.3g} to {data.omega[-1]:.3g} rad/s, {_ASKED[done.kind]}, in "
        f"{done.sweep.seconds / 60:.0f} minutes at the rig. Commands were chosen, from probes, to move every "
        "coordinate well above stiction and encoder steps, and to stay within the drive's limit and the travel."
    ]
    if waited.size:
        late = settle.size - waited.size
        rest = f"; {late} had not settled after 40 s, and what beats there counts as their error" if late else ""
        told.append(
            "Each sine was awaited until what was left of its transient, told from the data, had died away: "
            f"{waited.min():.0f} to {waited.max():.0f} s{rest}."
        )
    else:
        told += data.notes
    return tuple(told)


def _bench(done: FrequencyRun) -> str:
    names = ", ".join(f"{n} to {100 * s:g} %" for n, s in done.make.bench.items())
    weighed = {n: p for n, p in done.answer.rig.parameters.items() if p.uncertainty and n not in done.make.bench}
    if weighed:
        shares = ", ".join(f"{n} to {100 * p.uncertainty / p.value:.2g} %" for n, p in weighed.items())
        names += f"; from experiment 1a: {shares}"
    return (
        f"Known from the bench: {names}. A response sees masses, frictions and the drive's gain only relative to each "
        "other, so the bench fixes the scale; the unstable pole does not depend on it."
        if done.answer.key[1] == "unstable pole"
        else f"Known from the bench: {names}; it fixes the scale of masses, stiffness, frictions and gain."
    )


def steps(answer: Answer, folder: Path, make: str) -> tuple[Step, ...]:
    """What to do next with the fit."""
    fit = typed(folder / "fit.json")
    if answer.key[1] == "unstable pole":
        gains = f'upright design {fit} --at {answer.key[0]} --poles "-4.15+-1.63j, -16.9, -3.2"'
    else:
        gains = f"upright design {fit} --lqr 1,0,1,0 --limit 5"
    log, hold = typed(folder / "sweep.csv"), answer.data.hold
    return (
        Step(sentence="Find gains for these numbers, and what their errors do to the loop.", command=gains),
        Step(
            sentence="Estimate the response again from the log, as you would from your own.",
            command=f'upright frequency {log} --rig {make} --hold "{1e3 * hold:.4g} ms" -o again',
        ),
        Step(
            sentence="Ask all frequencies at once, and see what that saves and costs.",
            command=f"upright frequency --rig {make} --ask multisine",
        ),
    )


def of_log(found: LoggedResponse) -> Chapter:
    """What logs of one's own say, in the same frame."""
    data, answer = found.response, found.answer
    span = f"{data.omega[0]:.3g} to {data.omega[-1]:.3g} rad/s"
    asked = (f"{len(data)} frequencies from {span} in {', '.join(found.sources)}.", *data.notes)
    first = Part(title="What was asked", sentences=asked, pictures=(quality_picture(data),))
    if answer is None:
        poor = data.coherence.min(axis=1) < 0.5
        verdict = (
            f"Where most of the power follows the command ({len(data) - int(poor.sum())} of {len(data)} frequencies), "
            f"magnitudes are known to {number(100 * float(np.median(data.error[~poor])), 2)} % (median standard error)."
            if not poor.all()
            else "Nowhere does half of the power follow the command: this log tells no response."
        )
        return Chapter(
            key="1b", title="Frequency response", question="What does the rig answer, frequency by frequency?",
            verdict=verdict, detail="", sound=not poor.all(),
            parts=(first, Part(title="Response", pictures=(bode_picture(data),))),
            steps=(
                Step(sentence="Fit it: name the make, and what of it is known.",
                     command=f"upright frequency {typed(found.folder / 'frequency.csv')} --rig linear"),
                Step(sentence="Take it to python-control.",
                     command="FrequencyResponse.from_csv('frequency.csv').to_control()"),
            ),
            numbers=response_numbers(data),
        )  # fmt: skip
    return Chapter(
        key="1b", title="Frequency response of a rig", question=QUESTION, verdict=answer.fit.verdict,
        detail=simplex_sentence(answer), sound=answer.fit.trusted, parts=(first, *answer_parts(answer)),
        steps=(
            Step(sentence="Find gains for these numbers, and what their errors do to the loop.",
                 command=f"upright design {typed(found.folder / 'fit.json')} --lqr 1,0,1,0 --limit 5"),
            Step(sentence="Fit a log of a free swing too, and see whether both agree.", command="upright init LOG"),
        ),
        numbers=numbers(answer) | {"response": response_numbers(data)},
    )  # fmt: skip
