"""A rig in memory, moving in a page: what reports, fits and `play` share."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.basis import NOT_SUPPORTED, Basis
from upright.errors import BadInput, UprightError
from upright.verbs.answer import Answer
from upright.verbs.options import TrialOptions, known_options, rig_entries
from upright.verbs.values import Start, read_pole_list, read_start

if TYPE_CHECKING:
    from upright.control.score import Scores
    from upright.files import PathLike
    from upright.identification.model.fit import RunScore
    from upright.physics import Plant
    from upright.records import Array, Record
    from upright.report.page import Chapter, Part
    from upright.rig import Rig


def played(
    known: Rig, *, poles: str | Iterable[complex] | None = None, seed: int = 0,
    out: PathLike | None = None, **options: Any,
) -> Played:  # fmt: skip
    """A rig that moves in a page; arguments, result and errors as for `play`."""
    from upright.basis import SIMULATED
    from upright.designing.proposal import design_unasked
    from upright.designing.run import DesignRequest, design_for
    from upright.files import replace_file
    from upright.live.twin import unplayable
    from upright.report.page import Chapter, Step, resting_on
    from upright.rig.completion import completed, doubts

    path = _page_path(out)
    on = known_options(TrialOptions, options, "play")
    seconds, draws = on.get("seconds", 3.0), on.get("draws", 200)
    if not 0 < seconds <= 20:
        raise BadInput(f"rigs in a page run more than 0 and at most 20 s, got {seconds:g} s.")
    if not 1 <= draws <= 1000:
        raise BadInput(f"a page holds 1 to 1000 rigs, got {draws}.")
    if (on.get("speed") or "filtered") not in ("plain", "filtered"):
        raise BadInput("in a page velocities come from plain or filtered differences; leave speed out.")
    if (lacks := unplayable(known)) is not None:
        raise BadInput(f"play needs {lacks}.")
    rig = completed(known, rig_entries(known.plant, known.unit, on), vendor=on.get("vendor"), who="play")
    speed, memory = on.get("speed") or "filtered", on.get("memory", 0.5)
    request = DesignRequest(
        at="inverted", poles=read_pole_list(poles), period=rig.period, speed=speed, memory=memory,
        resolution=tuple(rig.resolution.tolist()), limit=rig.saturation, on=rig,
    )  # fmt: skip
    gains = (design_unasked if request.poles is None else design_for)(known, request).continuous
    text, scored = live_page(
        known, rig, gains, start=on.get("start"), seconds=seconds, draws=draws, seed=seed, speed=speed, memory=memory
    )  # fmt: skip
    held = int(scored.held.sum())
    chapter = Chapter(
        title=f"The {rig.name} in a page", verdict=_verdict(held, draws, known.basis), sound=held > 0.95 * draws,
        warnings=tuple(doubts(known, rig)),
        steps=(Step("Open the page in a browser, push the pendulum, drag the poles."),),
        numbers={"held": known.basis.supported(held), "draws": draws, "seed": seed}
        | ({} if path is None else {"page": str(path)}),
    )  # fmt: skip
    files = [] if path is None else [replace_file(path, text.encode())]
    return Played(scored, resting_on(chapter, known.basis, SIMULATED), files, text)


class Played(Answer["Scores | RunScore | Record"]):
    """What becomes of the rigs, or of a run, and the page in which it moves; a notebook shows the page."""

    height = 1180

    def __init__(self, value: Scores | RunScore | Record, chapter: Chapter, files: Sequence[Path], page: str) -> None:
        super().__init__(value, chapter, files)
        self.page = page

    def _repr_html_(self) -> str:
        from html import escape

        frame = f'<iframe sandbox="allow-scripts" width="100%" height="{self.height}"'
        return f'{frame} srcdoc="{escape(self.page)}"></iframe>'


class PlayedRun(Played):
    """A run and the page in which it is played."""

    height = 760


def played_run(
    score: RunScore, plant: Plant, label: str, out: PathLike | None = None
) -> PlayedRun:  # fmt: skip
    """A run, measured and simulated, in a page that plays it; written where `out` names a file ending in .html."""
    from upright.files import replace_file
    from upright.report.page import Chapter
    from upright.report.symbols import percent

    path = _page_path(out)
    text = run_page(score, plant, label)
    explained = ", ".join(f"{n} {percent(v)}" for n, v in score.fit_percent.items())
    chapter = Chapter(
        title=f"Run '{label}' in a page", verdict=f"Measured and simulated motion of '{label}': {explained}.",
        numbers={"run": label, "fit_percent": dict(score.fit_percent)},
    )  # fmt: skip
    return PlayedRun(score, chapter, [] if path is None else [replace_file(path, text.encode())], text)


def run_page(score: RunScore, plant: Plant, label: str) -> str:
    """The page that plays a run, measured and simulated over each other."""
    import numpy as np

    from upright.live.motion import motion_page

    order = np.argsort(score.t, kind="stable")  # of predictions restarted from time to time, some overlap
    measured = {n: score.y[order, k] for k, n in enumerate(score.measured)}
    simulated = {n: score.simulated[order, k] for k, n in enumerate(score.measured)}
    ahead = "" if score.horizon is None else f"Predicted {score.horizon:g} s ahead, again and again. "
    missing = [c.name for c in plant.coordinates if c.name not in measured]
    still = f"Not measured, drawn at zero: {', '.join(missing)}." if missing else ""
    return motion_page(plant, score.t[order], measured, simulated, name=label, remark=f"{ahead}{still}")


def played_record(record: Record, plant: Plant, label: str, performed: str, out: PathLike | None = None) -> PlayedRun:
    """A record in a page that plays it; `performed` as for `motion_page`."""
    from upright.basis import SIMULATED
    from upright.files import replace_file
    from upright.live.motion import motion_page
    from upright.report.page import Chapter

    path = _page_path(out)
    motion = _coordinates_of(record, plant)
    if not motion:
        raise BadInput(
            f"play draws columns called {', '.join(c.name for c in plant.coordinates)}, and the record has "
            f"{', '.join(record.names)}; rename them."
        )
    missing = [c.name for c in plant.coordinates if c.name not in motion]
    no_unit = [n for n in motion if not record.units[n]]
    remarks = [f"Not in the record, drawn at zero: {', '.join(missing)}."] if missing else []
    remarks += [f"The record states no unit of {', '.join(no_unit)}; taken as SI."] if no_unit else []
    kind, parts = ("simulated", ({}, motion)) if performed == SIMULATED else ("measured", (motion, {}))
    text = motion_page(plant, record.t, *parts, name=label, performed=performed, remark=" ".join(remarks))
    seconds = float(record.t[-1] - record.t[0])
    chapter = Chapter(
        title=f"Run '{label}' in a page", verdict=f"The {kind} motion of '{label}', {seconds:.4g} s.",
        first_line=performed, warnings=tuple(remarks),
        numbers={"run": label, "seconds": seconds} | ({"first_line": performed} if performed else {}),
    )  # fmt: skip
    return PlayedRun(record, chapter, [] if path is None else [replace_file(path, text.encode())], text)


def _coordinates_of(record: Record, plant: Plant) -> dict[str, Array]:
    """Columns of a plant's coordinates [rad or m]."""
    from upright import units

    motion: dict[str, Array] = {}
    for c in plant.coordinates:
        if c.name not in record.signals:
            continue
        unit = record.units[c.name]
        if unit in ("", c.unit):
            motion[c.name] = record[c.name]
            continue
        if not (units.known(unit) and units.same_dimension(unit, c.unit)):
            raise BadInput(f"play draws {c.name} in {c.unit}, and its column is in {unit}; convert it first.")
        motion[c.name] = units.converted(record[c.name], units.scale(unit))
    return motion


def _page_path(out: PathLike | None) -> Path | None:
    path = None if out is None else Path(out)
    if path is not None and path.suffix != ".html":
        raise BadInput(f"play writes a page, a file ending in .html, got '{path}'.")
    return path


def live_part(name: str, draw: Callable[[], str], title: str = "Push it", *, short: bool = False) -> tuple[Part, ...]:
    """The part of a report in which a rig moves; none where something is not known that it would take."""
    from upright.report.page import Live, Part

    try:
        markup = draw()
    except UprightError:
        return ()
    return (Part(title, (Live(markup=markup, description=f"{title}: {name}", short=short),), aside=True),)


def live_page(
    known: Rig, rig: Rig, K: Array, *, start: Start | None = None, seconds: float = 3.0, draws: int = 200,
    seed: int = 0, speed: str = "filtered", memory: float = 0.5,
) -> tuple[str, Scores]:  # fmt: skip
    """The page of a rig under gains K, and what becomes of the rigs that its fit allows; options as for `play`."""
    import numpy as np

    from upright.control.preflight import Task
    from upright.control.score import outcomes
    from upright.designing.run import velocities
    from upright.experiments.regulation_2.run import HAND, START
    from upright.gains import feedback
    from upright.live.page import page
    from upright.live.twin import Loop, moving
    from upright.rig.completion import doubts
    from upright.rig.variation import allowed

    model = rig.linear("inverted")
    way = velocities(
        model, model.to_sampled(rig.period, rig.delay / rig.period), speed, memory, rig.limit, rig.resolution
    )  # fmt: skip
    loop = Loop(estimator=way, K=K, law=feedback(way, K))
    let_go = dict(zip(("theta", "theta_dot"), START, strict=True))
    let_go |= read_start(start, ("theta", "theta_dot"), ("rad", "rad/s"))
    task = Task(start=(0.0, 0.0, *let_go.values()), hand=(0.0, 0.0, *HAND), seconds=seconds)
    others = allowed(rig, draws, seed)
    starts = task.starts(draws, np.random.default_rng([seed, 52]))
    scored = outcomes(rig, loop.law, at="inverted", starts=starts, seconds=seconds, parameters=others)
    held = int(scored.held.sum())
    blind = () if known.draws else ("The fit has no covariance: only dry friction and the hand vary.",)
    text = page(
        moving(rig, loop, task, others=others, lanes=draws, seed=seed) | {"said": _of_model(known.basis)}, rig.plant,
        headline=known.basis.qualified(_verdict(held, draws, known.basis)),
        cautions=[c for c in (known.basis.first_line(), *blind, *doubts(known, rig)) if c],
        share=f"{_of_model(known.basis)}{held} of {draws} rigs are stabilised for {seconds:g} s.",
        numbers=_numbers(rig),
        origin="drawn from the covariance of the fit" if known.draws else "with the same numbers",
        start=f"{math.degrees(let_go['theta']):.3g}° at {let_go['theta_dot']:.2g} rad/s", seed=seed,
    )  # fmt: skip
    return text, scored


def _of_model(basis: Basis) -> str:
    """What stands before the share of rigs of a model that is not trusted."""
    return "" if basis.supports else f"Of the rig {NOT_SUPPORTED}; of the model: "


def _verdict(held: int, draws: int, basis: Basis) -> str:
    if not basis.supports:
        return f"How many rigs the law stabilises is {NOT_SUPPORTED}: the model is not known to be the rig."
    return f"The law stabilises {held} of {draws} rigs that the fit allows."


def _numbers(rig: Rig) -> list[tuple[str, str, str]]:
    """Symbol, meaning with unit, value of what is known of a rig."""
    from upright.quantities import quantities
    from upright.report.symbols import number, symbol, unit

    what, values = quantities(rig.plant), rig.plant.parameters()
    return [
        *((symbol(n), f"{what[n].meaning} [{unit(what[n].unit)}]", number(v)) for n, v in values.items() if v),
        ("", f"gain of the drive [{unit(rig.plant.inputs[0].unit)} per {rig.unit}]", number(rig.gain)),
        ("", f"limit of the drive [{rig.unit}]", number(rig.limit)),
        ("", "servo period [ms]", number(1e3 * rig.period)),
        *((symbol(c.name), "encoder counts", f"{n:g}") for c, n in zip(rig.plant.coordinates, rig.counts, strict=True)),
    ]
