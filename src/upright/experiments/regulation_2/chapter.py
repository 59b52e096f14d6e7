"""Experiment 2 as a chapter: gains, what was expected of them, what came, and was it expected?"""

from __future__ import annotations

import math
from typing import Any

from upright.basis import in_percent
from upright.control import Score
from upright.control.effort import FELT, RestEffort, of_limit, shown
from upright.control.preflight import BUSY, SATURATED, STABILISED, WORDS, word
from upright.control.score import effort_at_rest
from upright.designing.run import Designed, DesignRequest, design_for
from upright.experiments.regulation_2.figures import chances_figure, runs_figure, ways_figure
from upright.experiments.regulation_2.run import DRAWS, SETS, Attempt, Regulation, VelocityRun
from upright.gains.requests import written
from upright.report.page import Chapter, KeyNumber, Part, Picture, Points, Step, Table
from upright.report.rig import of_rig, rig_table
from upright.report.symbols import number, plain
from upright.rig import Rig

SURE = 0.8
"""Lower end of the probability's 95 % interval from which a recommendation stands: 16 rigs of 16 reach it."""
SHOWN = 2.5
"""Seconds of the runs that are drawn."""


def chapter(result: Regulation) -> Chapter:
    """What holding the rig upright came to."""
    page = Chapter(
        key="2",
        best="regulation-runs0",
        title="Holding it upright",
        question="Which of the pole sets hold the rig upright within its drive's limit, and can that be predicted "
        "before anything moves, from the numbers identified while it hung?",
        verdict=_verdict(result),
        detail=_detail(result),
        sound=_sound(result),
        parts=tuple(_parts(result)),
        steps=tuple(_steps(result)),
        findings=tuple(
            KeyNumber(
                what=f"most likely result of {a.name}",
                value=f"{a.before.word} ({_probability(a, a.before.words[a.before.word])})"
                + (f"; measured: {a.word}" if a.word and result.truth is None else ""),
                truth="" if result.truth is None else a.word,
            )
            for a in result.attempts
        ),
        numbers=_numbers(result),
    )  # fmt: skip
    return of_rig(page, result.rig, result.performed)


def _verdict(result: Regulation) -> str:
    """Which set to use, and whether the runs agreed with their predictions."""
    best, head = result.best, _recommended(result)
    ran = result.ran
    if not ran:
        return f"{head}{_excess(result, best)} Nothing was run: this is what the model says."
    agreed = [a for a in ran if a.word == a.before.word]
    if len(agreed) == len(ran):
        runs = f"All {len(ran)} runs agreed with their predictions." if len(ran) > 1 else "The run agreed with that."
    else:
        others = "; ".join(
            f"{a.name}: {a.word} (predicted probability {_probability(a, a.before.words[a.word])})"
            for a in ran
            if a not in agreed
        )
        runs = f"{len(agreed)} of {len(ran)} runs agreed with their predictions. Not so: {others}."
    return f"{head} {runs}{_excess(result, best)}"


def _recommended(result: Regulation) -> str:
    """Which set to use, where the model supports a recommendation and one is good enough."""
    best = result.best
    if not best.before.basis.supports:
        return (
            "No pole set is recommended, and no probability is given, since both would rest on the model; in "
            f"simulations of it {best.name} did best."
        )
    share = best.before.words[STABILISED]
    if share < 0.5:
        return (
            f"No pole set is recommended for this start. The best, {best.name}, stabilises {_of_rigs(result, share)} "
            f"without saturation or excessive effort; most often the result is: {best.before.word}."
        )
    return (
        f"Use {best.name}: it stabilises {_of_rigs(result, share)} without saturation; on 95 % of them the command at "
        f"rest has an rms of {of_limit(best.before.rest_rms, 'at most ')}."
    )


def design_of_best(result: Regulation) -> Designed | None:
    """The recommended set as a design, of the loop that was predicted; None where no set is recommended."""
    best, rig, request = result.best, result.rig, result.request
    if not best.before.basis.supports or best.before.words[STABILISED] < 0.5:
        return None
    return design_for(rig, DesignRequest(
        at=result.task.at, poles=best.placement.requested, period=rig.period, delay=rig.delay / rig.period,
        speed=request.speed, memory=request.memory, resolution=tuple(rig.resolution.tolist()),
        limit=rig.saturation if math.isfinite(rig.saturation) else None, start=result.task.start, on=rig,
    ))  # fmt: skip


def _of_rigs(result: Regulation, share: float) -> str:
    rigs, of = result.request.draws, "sampled from the fit's covariance" if result.uncertain else "sampled"
    some = round(share * rigs)
    return f"{'all' if some == rigs else f'{some} of' if some else 'none of'} {rigs} rigs {of}"


def _excess(result: Regulation, a: Attempt) -> str:
    """What is too much about the command at rest, as a sentence after others; empty where nothing is."""
    if a.word == BUSY and a.after is not None:
        effort = effort_at_rest(a.after)
    elif a.before.word == BUSY:
        effort = a.before.rest
    else:
        return ""
    if effort.quiet:  # of the rig as identified, unlike that of most rigs allowed
        return ""
    return (
        f" The command at rest {shown(effort, result.rig.saturation, result.rig.unit)}. Ask for slower poles, or take "
        "the velocities from a filter (--speed kalman)."
    )


def _sound(result: Regulation) -> bool:
    """Whether the set to use is sure and quiet beforehand, and was so where it was run."""
    best = result.best
    ran_well = best.score is None or best.word in (STABILISED, SATURATED)
    enough = best.before.interval[0] >= SURE
    return not result.interrupted and ran_well and enough and best.before.words[STABILISED] > 0.9


def _detail(result: Regulation) -> str:
    """How far that can be trusted."""
    spread = (
        f"The {result.request.draws} rigs are sampled from the fit's covariance, with day-to-day variation of dry "
        "friction and of the release by hand."
        if result.uncertain
        else "The fit states no uncertainty, so only dry friction and the release by hand vary: the probabilities are "
        "too high."
    )
    low, high = result.best.before.interval
    if low < SURE <= high:
        spread += (
            f" {result.request.draws} {'rigs say' if result.request.draws > 1 else 'rig says'} little: stabilised in "
            f"{in_percent(result.best.before.share)} of them, the probability lies between {in_percent(low)} and "
            f"{in_percent(high)} (95 % interval). Draw more (--draws {DRAWS})."
        )
    return spread + (" Stopped by Ctrl-C before every set was run." if result.interrupted else "")


def _sentence(result: Regulation, a: Attempt) -> str:
    """One pole set: predicted, and measured."""
    b, rig = a.before, result.rig
    reach = (
        f"it recovers tilts up to {math.degrees(b.tilt):.0f}° and taps up to {b.push:.1f} rad/s"
        if b.margins is not None
        else "the sampled loop is not stable"
    )
    predicted = (
        f"{a.name[:1].upper()}{a.name[1:]}: predicted probability of stabilisation {_probability(a, b.share)}"
        f" ({_shares(a)}); {reach}; predicted peak {b.score.effort_peak:.2g} of {rig.limit:g} {rig.unit}; rms at rest "
        f"{of_limit(b.rest_rms)}."
    )
    if a.after is None or a.measured is None:
        return f"{predicted} It was not run." if result.ran else predicted
    measured = _measured_sentence(result.rig, a.measured.score, effort_at_rest(a.after))
    return f"{predicted} {measured} {a.measured.ended}".rstrip()


def _probability(a: Attempt, share: float) -> str:
    """A share of the simulated rigs as the probability that it stands for."""
    return str(a.before.basis.supported(in_percent(share)))


def _shares(a: Attempt) -> str:
    if not a.before.basis.supports:
        return f"most simulated runs of the model: {a.before.word}"
    return ", ".join(f"{w} {in_percent(a.before.words[w])}" for w in WORDS if a.before.words[w] > 0)


def _measured_sentence(rig: Rig, s: Score, rest: RestEffort) -> str:
    driven = plain(rig.plant.inputs[0].on)
    if not s.held and s.fell < s.ran_out:
        return f"Measured: it fell after {s.fell:.2g} s."
    if not s.held:
        return f"Measured: {driven} came to the end of its travel after {s.ran_out:.2g} s."
    if math.isinf(s.settled):
        return f"Measured: it did not settle; the pendulum kept swinging by {math.degrees(s.final[-1]):.2g}°."
    full = f", {1e3 * s.at_limit:.0f} ms of it at the limit" if s.at_limit > FELT else ""
    still = "comes to rest"
    if s.final[0] > 2 * rig.resolution[0]:
        every = f" every {rest.body.period:.2g} s" if rest.body is not None else ""
        still = f"swings on by {_shown(rig, 0, s.final[0])}{every}"
    return (
        f"Measured: settled in {s.settled:.2g} s with a peak of {s.effort_peak:.2g} {rig.unit}{full}, "
        f"rms at rest {of_limit(s.rest_rms)}; {driven} went {_shown(rig, 0, s.peaks[0])} and {still}."
    )


def _shown(rig: Rig, i: int, value: float) -> str:
    """A coordinate's deviation in degrees or centimetres."""
    if rig.plant.coordinates[i].unit == "rad":
        return f"{math.degrees(value):.2g}°" if math.degrees(value) < 99.5 else f"{math.degrees(value):.0f}°"
    return f"{100 * value:.2g} cm"


def _gain_table(result: Regulation) -> Table:
    """Requested poles, the gains they take, and the margins of the loop as it runs."""
    rows: list[tuple[str, ...]] = []
    for a in result.attempts:
        m = a.before.margins
        worth = ("falls", "–", "–") if m is None else (
            f"{number(m.least_gain, 2)} to {number(m.most_gain, 3)}", number(1e3 * m.delay, 3), number(m.modulus, 2)
        )  # fmt: skip
        gains = ", ".join(number(k, 3) for k in a.placement.K[0])
        rows.append((a.name, written(a.placement.requested), gains, *worth))
    states = ", ".join(plain(n) for n in result.rig.plant.state_names())
    return Table(
        caption=f"Gains of u = −K x for {states} [{result.rig.unit} per SI unit], and the sampled loop's margins: "
        "factors on the command, more delay, distance to −1",
        headings=("", "poles [1/s]", "K", "gain", "delay [ms]", "distance"),
        rows=tuple(rows),
        numbers=(4, 5),
    )


def _prediction_table(result: Regulation) -> Table:
    """Predicted and measured, set by set."""
    rows: list[tuple[str, ...]] = []
    for a in result.attempts:
        b = a.before
        noise = "–" if b.noise is None else number(b.noise, 2)
        rows.append(
            (a.name, b.word, _probability(a, b.share), f"{math.degrees(b.tilt):.0f}", f"{b.push:.1f}", noise,
             *_figures(result, b.score))
        )  # fmt: skip
        if a.score is not None:
            rows.append(
                (
                    "",
                    f"measured: {a.word}",
                    "stabilised" if a.score.held else "lost",
                    "",
                    "",
                    "",
                    *_figures(result, a.score),
                )
            )
    driven = result.rig.plant.coordinates[0]
    return Table(
        caption="Predicted (first lines) and measured; tilt and tap are the largest recovered, each alone; noise is "
        "that of the command from the encoders' counts; rest is the command over the last third of the run, rms and "
        "peak as shares of the limit",
        headings=(
            "", "verdict", "chance", "tilt [deg]", "tap [rad/s]", f"noise [{result.rig.unit}]", "settled [s]",
            f"peak [{result.rig.unit}]", "at limit", "rest", f"{plain(driven.name)} peak", f"{plain(driven.name)} rest",
        ),
        rows=tuple(rows), numbers=tuple(range(2, 12)),
    )  # fmt: skip


def _figures(result: Regulation, s: Score) -> tuple[str, ...]:
    settled = number(s.settled, 3) if math.isfinite(s.settled) else "never"
    still = "still" if s.final[0] <= 2 * result.rig.resolution[0] else f"±{_shown(result.rig, 0, s.final[0])}"
    rest = still if s.held else "–"
    return (
        settled, number(s.effort_peak, 3), f"{100 * s.saturated:.1f} %",
        f"{100 * s.rest_rms:.2g}, {100 * s.rest_peak:.2g} %", _shown(result.rig, 0, s.peaks[0]), rest,
    )  # fmt: skip


def _way_table(result: Regulation) -> Table:
    """Plain and filtered differences and the Kalman filter, with the same gains from the same start."""

    def row(w: VelocityRun) -> tuple[str, ...]:
        return (
            w.name, "falls" if w.noise is None else number(w.noise, 2), number(w.restless, 2),
            "–" if w.margins is None else number(1e3 * w.margins.delay, 3),
            "–" if w.margins is None else number(w.margins.modulus, 2), word(w.score),
            number(w.score.settled, 3) if math.isfinite(w.score.settled) else "never",
            number(w.score.effort_peak, 3),
        )  # fmt: skip

    unit = result.rig.unit
    return Table(
        caption=f"Ways to the velocities, all with the gains of {result.best.name}: noise of the command predicted "
        "from the counts, its change from sample to sample as measured in the first second, delay borne and "
        "distance to −1",
        headings=("from", f"noise [{unit}]", f"change [{unit}]", "delay [ms]", "distance", "measured", "settled [s]",
                  f"peak [{unit}]"),
        rows=tuple(row(w) for w in result.ways), numbers=(1, 2, 3, 4, 6, 7),
    )  # fmt: skip


def _parts(result: Regulation) -> list[Part]:
    tilt, push = math.degrees(result.task.start[2]), result.task.start[3]
    rig = result.rig
    steps = f"steps of {1e3 * rig.converter:.2g} m{rig.unit}" if rig.converter else "unspecified steps"
    sources = (
        f"{rig.name}, sampled every {1e3 * rig.period:.3g} ms; the command has a limit of {rig.limit:g} {rig.unit}, "
        f"{steps}, and acts {1e3 * rig.delay:.2g} ms late with a lag of "
        f"{1e3 * rig.lag:.2g} ms. Positions come in counts; velocities are made of them.",
        f"The pendulum is let go {tilt:.0f}° from upright, moving away at {push:.2g} rad/s, by a hand that errs by "
        f"{math.degrees(result.task.hand[2]):.1f}° and {result.task.hand[3]:.1g} rad/s.",
    )
    parts = [
        Part("Gains", (*sources, _gain_table(result))),
        Part("The rig", (rig_table(result.rig),)),
        Part(
            "Predicted and measured",
            (
                Points(tuple(_sentence(result, a) for a in result.attempts)),
                _prediction_table(result),
                _chance_picture(result),
                *_run_pictures(result),
            ),
        ),
    ]
    if result.ways:
        ways = Picture(
            name="regulation-ways", draw=lambda: ways_figure({w.name: w.run for w in result.ways}),
            caption="The command on its way back: the same gains on velocities made in three ways.",
            description="Changes of the command from sample to sample: "
            + ", ".join(f"{w.name} {number(w.restless, 2)} {rig.unit}" for w in result.ways) + ".",
        )  # fmt: skip
        parts.append(Part("Velocities", (_way_table(result), ways), folded=True))
    return parts


def _chance_picture(result: Regulation) -> Picture:
    predicted = {a.name: a.before.words for a in result.attempts}
    return Picture(
        name="regulation-chances", draw=lambda: chances_figure(predicted, {a.name: a.word for a in result.attempts}),
        caption="Share of the rigs sampled from the fit's covariance by what the run comes to, and what was measured.",
        description="; ".join(
            f"{n}: " + ", ".join(f"{w} {100 * s:.0f} %" for w, s in words.items() if s > 0)
            for n, words in predicted.items()
        ),
    )  # fmt: skip


def _run_pictures(result: Regulation) -> list[Picture]:
    """Four sets at a time."""
    return [
        Picture(
            name=f"regulation-runs{i // 4}", draw=lambda four=result.attempts[i : i + 4]: runs_figure(four, SHOWN),
            caption="Deviation from upright and command. Dashed: predicted by the identified model; solid: measured; a "
            "cross ends a run that was lost.",
            description="; ".join(a.title for a in result.attempts[i : i + 4]),
        )
        for i in range(0, len(result.attempts), 4)
    ]  # fmt: skip


def _steps(result: Regulation) -> list[Step]:
    seed = f" --seed {result.truth.seed}" if result.truth is not None else ""
    base = f"upright regulate {result.source}{seed}"
    first = [] if result.ran else [
        Step("Run the laws on another rig: of this make, or one that the fit allows.",
             f"upright regulate {result.source} --seed 0")
    ]  # fmt: skip
    own = f'--poles "{written(result.best.placement.requested).replace("±", "+-")}"'
    best = f"--set {result.best.name[4:]}" if result.best.name in SETS else own
    return [
        *first,
        Step("See how hard a start the recommended set bears.",
             f'{base} {best} --start "theta=25 deg, theta_dot=3 rad/s"'),
        Step("Let an observer make the velocities.", f"{base} --speed kalman"),
        Step("Try poles of your own.", f'{base} --poles "-5+-3j, -25, -4"'),
    ]  # fmt: skip


def _numbers(result: Regulation) -> dict[str, Any]:
    """The same for another program: SI, finite."""
    return {
        "rig": result.rig.name,
        "seed": None if result.truth is None else result.truth.seed,
        "start": dict(zip(result.rig.plant.state_names(), result.task.start, strict=True)),
        "limit": result.rig.limit,
        "described": result.rig.hardware.plain(),
        "command_unit": result.rig.unit,
        "recommended": result.best.name,
        "as_told": sum(a.word == a.before.word for a in result.ran) if result.ran else None,
        "sets": {a.name: _set(a) for a in result.attempts},
        "velocities": {
            w.name: {"noise": w.noise, "change_per_sample": w.restless, **_scored(w.score)} for w in result.ways
        },
    }


def _set(a: Attempt) -> dict[str, Any]:
    b = a.before
    measured = a.measured
    return {
        "poles": a.placement.requested,
        "K": a.placement.K[0],
        "before": {
            "word": b.word, "words": dict(b.words), "chance": b.basis.supported(b.share),
            "interval": b.basis.supported(b.interval), "tilt": b.tilt, "push": b.push,
            "command_noise": b.noise, "rest_rms_95": b.rest_rms,
            "margins": b.margins, "rest": _rest(b.rest),
            **_scored(b.score),
        },
        "after": None if measured is None else {
            "word": a.word, "ended": measured.ended, "rest": _rest(effort_at_rest(measured.trial)),
            **_scored(measured.score),
        },
    }  # fmt: skip


def _rest(effort: RestEffort) -> dict[str, Any]:
    return {
        "quiet": effort.quiet,
        "rms": effort.rms,
        "peak": effort.peak,
        "command": effort.command,
        "body": effort.body,
    }


def _scored(s: Score) -> dict[str, Any]:
    return {**vars(s), "held": s.held}
