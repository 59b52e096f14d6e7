"""Does every rig of a make get up, and is a lying encoder caught before the fall? 100 twins up, 200 asked, two makes.

Law and check are designed from the make as designed; the twins' inertias differ by two percent, friction by a seventh,
the drive by two percent, and three times as much. Twins stand side by side in the lanes of the kernel.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.measure import Line, spread

SECONDS, HELD = 15.0, 5.0
LIES = tuple((place, factor) for factor in (-1.0, 0.5, 2.0, 4.0, 1.1, 0.9) for place in (0, 1))


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Shares, times, efforts; then detections and false alarms, hanging and in the running loop."""
    from upright.rig.makes import PENDULUMS

    lines: list[Line] = []
    for make in PENDULUMS:
        progress(f"{make}, up")
        lines += [_up(make, 3 if quick else 100, far) for far in (1.0, 3.0)]
        progress(f"{make}, encoders")
        lines += _sensors(make, 4 if quick else 200)
    return lines


def _line(make: str, what: str, seconds: float, note: str) -> Line:
    return Line(contender=f"{make}, {what}", seconds=spread([seconds]), note=note)


def _up(make: str, count: int, scatter: float) -> Line:
    """Twins whose numbers lie `scatter` times as far from the model's as a make's do."""
    from upright.control import design_swing_up
    from upright.control.swing_up import UPRIGHT
    from upright.rig.makes import make_rig
    from upright.simulation import simulate

    model, rigs = make_rig(make), [make_rig(make, seed) for seed in range(1, count + 1)]
    law = design_swing_up(model)
    start = np.tile(model.plant.state("hanging"), (count, 1))
    values: dict[str, Any] = {
        n: middle * np.array([r.plant.parameters()[n] / middle if middle else 0.0 for r in rigs]) ** scatter
        for n, middle in model.plant.parameters().items()
    }
    values |= {**model.drive, "actuator.gain": model.gain * np.array([r.gain / model.gain for r in rigs]) ** scatter}
    samples = round(SECONDS / model.period)
    begin = time.process_time()
    x = simulate(
        type(model.plant), values, start, None, model.period, samples=samples, substeps=2, loop=law.rule(model, start)
    )
    each = (time.process_time() - begin) / count
    away = np.abs(np.mod(x[:, 2], 2 * math.pi) - math.pi) > UPRIGHT
    last = samples - np.argmax(away[::-1], axis=0)  # every twin begins hanging
    up = last * model.period
    held = up <= SECONDS - HELD
    tripped = np.abs(x[:, 0]).max(axis=0) > law.travel
    peak, far = np.abs(x[:, 4]).max(axis=0), np.abs(x[:, 0]).max(axis=0)
    t = up[held] if held.any() else np.array([np.nan])
    unit = model.plant.coordinates[0].unit
    return _line(
        make, f"from hanging, scatter x {scatter:g}", each,
        f"{held.sum()} of {count} stand for {HELD:g} s ({tripped.sum()} tripped); upright after {np.median(t):.2f} s,"
        f" at most {t.max():.2f}; command at most {np.median(peak):.2f}, worst {peak.max():.2f} of {model.limit:g}"
        f" {model.unit}; travel {np.median(far):.3g}, worst {far.max():.3g} of {law.travel:.3g} {unit}",
    )  # fmt: skip


def _sensors(make: str, count: int) -> list[Line]:
    from upright import gains
    from upright.control import design_swing_up, trial
    from upright.control.score import FALLEN
    from upright.control.sensors import probe, scales, shown_by_encoders
    from upright.control.trial import readings
    from upright.control.watch import Suspicion, Watch
    from upright.rig.makes import make_rig

    model = make_rig(make)
    names = [c.name for c in model.plant.coordinates]
    law = design_swing_up(model)
    command = probe(model, law)
    sampled = model.linear("inverted").to_sampled(model.period, (model.delay + model.lag) / model.period)
    estimator = gains.filtered(sampled, law.memory)
    # the paper's set 1, which is slow enough to fall in every way
    poles = [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220]
    feedback = gains.feedback(estimator, gains.place_sampled(sampled, estimator, poles))
    rng = np.random.default_rng(61)
    wrong = false = named = 0
    worst: list[float] = []
    hanging = looping = 0.0
    logs: dict[str, list[Any]] = {"sound": [], "lie": []}
    told: list[tuple[str, float]] = []
    for seed in range(1, count + 1):
        place, factor = LIES[seed % len(LIES)]
        twin = make_rig(make, seed)
        liar = replace(twin, scales=tuple(factor if i == place else 1.0 for i in range(2)))
        told.append((names[place], factor))
        begin = time.process_time()
        false += not scales(model, shown_by_encoders(twin, command)).sound
        found = scales(model, shown_by_encoders(liar, command))
        hanging += time.process_time() - begin
        wrong += not found.sound
        named += found.wrong == (names[place],)
        worst.append(abs(found.value[place] / factor - 1))
        tilt = [0.0, 0.0, rng.normal(0, 0.05), rng.normal(0, 0.2)]
        for kind, rig in (("sound", twin), ("lie", liar)):
            rest = readings(rig, [0.0, math.pi])
            went = trial(rig, feedback, at="inverted", start=tilt, seconds=3.0, rest=rest)
            seen = np.column_stack([went.record[n] for n in names]) - rest
            logs[kind].append((seen, went.u, np.abs(went.deviation[:, 1])))
    watch = Watch(model)
    alarms = {}
    for kind, runs in logs.items():
        begin = time.process_time()
        alarms[kind] = watch.over(np.stack([r[0] for r in runs], axis=-1), np.column_stack([r[1] for r in runs]))
        looping += (time.process_time() - begin) / (2 * count)
    spoke, away = alarms["lie"].sample, np.array([r[2] for r in logs["lie"]])
    fell = np.where((away > FALLEN).any(axis=1), np.argmax(away > FALLEN, axis=1), away.shape[1])
    falls = fell < away.shape[1]
    timely = falls & (spoke >= 0) & (spoke < fell)
    right = [w == Suspicion(name=n, factor=f) for w, (n, f) in zip(alarms["lie"].what, told, strict=True)]
    tilts = np.degrees(away[np.arange(count), np.maximum(spoke, 0)][timely])
    when, then = spoke[timely] * model.period, fell[timely] * model.period
    return [
        _line(
            make, "encoders, hanging", hanging / (2 * count),
            f"{wrong} of {count} faulty encoders detected, {named} named, scale off by {np.median(worst):.1g}, at most"
            f" {max(worst):.1g}; {false} false alarms in {count} sound rigs",
        ),
        _line(
            make, "encoders, in the loop", looping,
            f"{timely.sum()} of {falls.sum()} falls foreseen, after {np.median(when):.3f} s (at most {when.max():.2f})"
            f" where the fall comes after {np.median(then):.2f} s (at least {then.min():.2f}); tilt then"
            f" {np.median(tilts):.1f} degrees, at most {tilts.max():.1f};"
            f" {100 * np.mean(np.array(right)[timely]):.0f} % named; {np.sum(alarms['sound'].sample >= 0)} false"
            f" alarms in {count} sound loops; {np.sum((spoke >= 0) & ~falls)} of {np.sum(~falls)} lies under which the"
            " loop stands",
        ),
    ]  # fmt: skip
