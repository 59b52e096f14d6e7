"""Gains for an identified rig or plain matrices, and the loop they make: `design`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.control.moving import live_page, live_part
from upright.verbs.handover import called, rig_of
from upright.verbs.linear.matrices import is_linear, linear_model, read_matrices
from upright.verbs.options import DesignOptions, above_zero, as_typed, known_options, rig_entries
from upright.verbs.pages import folder_if_given, write_page
from upright.verbs.values import Start, read_pole_list, read_start, si_if_given

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from upright.designing.run import Designed
    from upright.files import PathLike
    from upright.report.page import Part
    from upright.rig import Rig
    from upright.systems import LinearForm, StateSpace
    from upright.verbs.forms import RigLike

_poles = read_pole_list  # the verbs have options of this name


@command(
    "Control",
    metavars={
        "source": "FIT|STUDY", "matrices": "FILE", "at": "NAME", "lqr": "LIST", "effort_weight": "R",
        "start": "LIST", "delay": "SAMPLES", "speed": "ESTIMATOR", "lag": "TIME", "track": "COORDINATE",
    },
    helps={
        "source": "fit.json, its folder, or a study (TOML).",
        "speed": "Velocity estimator: plain, filtered or kalman; for matrices also measured or observer.",
        "matrices": "Plain matrices instead: TOML with A and B; C, D, dt, names, units if any.",
        "start": 'Deviation to recover from, as in "theta=5 deg, psi_dot=0.2 rad/s".',
    },
    defaults={"out": "."},
    more="""
    upright design out/fit.json
    upright design out/fit.json --at inverted --poles "-4.15+-1.63j, -16.9, -3.2"
    upright design --matrices model.toml --poles "-4, -5" --period "2 ms"
    """,
)  # fmt: skip
@keeps_its_inputs
def design(
    source: RigLike | LinearForm | None = None, *, matrices: PathLike | None = None, at: str | None = None,
    poles: str | Iterable[complex] | None = None, lqr: str | Iterable[float] | None = None,
    start: Start | None = None, seed: int = 0,
    out: PathLike | None = None, pdf: bool = False, **on: Unpack[DesignOptions],
) -> Answer[Designed]:  # fmt: skip
    """Find gains that stabilise a rig, and evaluate the loop as a computer runs it.

    The parameters are those identified, hanging for instance; the linear model is about another equilibrium, such as
    upright. Poles are placed by Ackermann's formula, chosen by LQR, or proposed when neither is requested. The loop is
    evaluated with servo period, delay and velocities from encoder differences.

    Parameters
    ----------
    source : fit, path, plant or linear model, optional
        What `identify` answered, a fit.json, its folder, or a study (TOML), or a plant with its numbers; or a
        `control.StateSpace` or TransferFunction, ``plant.linear("inverted")``, what `hold` gives, or arrays
        ``(A, B[, C[, D]])``.
    matrices : path, optional
        Instead of `source`, a file in TOML with A and B, and C, D, dt [s], names and units where there are any. Of a
        linear model there are no dry friction, no encoders and no covariance; a sampled one is designed for as it is.
    at : str, optional
        Equilibrium; the last that the plant names when omitted.
    poles : str or sequence of complex
        Poles [1/s], as in ``"-4.15+-1.63j, -16.9, -3.2"``, or ``"set 3"`` of Table 1 as in `regulate`; proposed when
        neither these nor weights are given.
    lqr : str or sequence of float
        Weights of the states, as in ``"1,0,1,0"``, instead of poles.
    start : str or mapping, optional
        Deviation to recover from, by state: ``{"theta": "5 deg"}``, ``{"theta": 0.087}`` [SI]; a value alone is of
        the last coordinate.
    seed : int
        Random seed of the rigs drawn from the fit's covariance.
    out : path, optional
        Folder for design.json and design.html.
    pdf : bool
        Write the page as PDF too.
    **on
        Of the gains, effort_weight, track, sampled; of the rig and its loop, limit, period, counts, vendor, speed,
        memory, delay, lag; see `DesignOptions`.

    Returns
    -------
    Answer
        Of a `Designed`: gains `K`, `poles`, margins.

    Raises
    ------
    BadInput
        When the call contradicts itself or the rig, or a pole is out of the input's reach.
    """
    from upright.designing.chapter import chapter
    from upright.designing.proposal import design_unasked
    from upright.designing.run import SPEEDS, DesignRequest, design_for
    from upright.files import write_json
    from upright.report.symbols import typed
    from upright.rig.completion import completed

    folder_at, on = folder_if_given(out, pdf), known_options(DesignOptions, on, "design")
    requested, weights = _pole_set(poles), _numbers(lqr)
    if requested is not None and weights is not None:
        raise BadInput('give either --poles "-4+-2j, -10, -3" or --lqr "1,0,1,0" (weights of the states), not both.')
    if (source is None) == (matrices is None):
        raise BadInput("design takes a fit.json, its folder, a study or a linear model, or --matrices FILE; give one.")
    request = DesignRequest(
        at="", poles=requested, weights=weights, R=on.get("effort_weight"), delay=on.get("delay"),
        lag=si_if_given(on.get("lag"), "s"), memory=on.get("memory", 0.5), track=on.get("track") or None,
        sampled=on.get("sampled") or False,
    )  # fmt: skip
    if matrices is not None or is_linear(source):
        if at or {"counts", "vendor"} & on.keys():
            raise BadInput("--at, --counts and --vendor are of a rig, and plain matrices are none; leave them out.")
        rig = read_matrices(matrices) if matrices is not None else linear_model(source)
        request = replace(
            request, period=_sampling(rig, on.get("period")), speed=on.get("speed") or "",
            limit=above_zero(on, "limit", rig.unit),
            start=_start(rig, start),
        )  # fmt: skip
        name = "--matrices " + (typed(Path(matrices)) if matrices is not None else "FILE")
    else:
        if (speed := on.get("speed") or "filtered") not in SPEEDS:
            raise BadInput(f"--speed is plain, filtered or kalman, got '{speed}'.")
        rig = rig_of(source, "design", seed=seed)
        here = at or list(rig.plant.equilibria)[-1]
        if here not in rig.plant.equilibria:
            raise BadInput(f"'{rig.name}' has no equilibrium '{here}'; {nearest(here, rig.plant.equilibria)}")
        loop = completed(
            rig, rig_entries(rig.plant, rig.unit, on), vendor=on.get("vendor"),
            needs=("servo_period", "counts"), who="design",
        )  # fmt: skip
        request = replace(
            request, at=here, period=loop.period, speed=speed, resolution=tuple(loop.resolution.tolist()),
            limit=loop.saturation if math.isfinite(loop.saturation) else None, start=_start(rig, start), on=loop,
        )  # fmt: skip
        name = called(source)
    designed = design_unasked(rig, request) if requested is None and weights is None else design_for(rig, request)
    page = chapter(designed, source=name + as_typed(on), folder=typed(folder_at or Path()))
    files: list[Path] = []
    if folder_at is not None:
        moves: tuple[Part, ...] = ()
        if (on_rig := request.on) is not None and request.at == "inverted" and request.speed != "kalman":
            how = {"seed": seed, "speed": request.speed, "memory": request.memory}
            page_of: Any = partial(live_page, on_rig, on_rig, designed.continuous, **how)
            moves = live_part(on_rig.name, lambda: page_of()[0])
        files = [
            write_json(folder_at / "design.json", page.numbers),
            *write_page(replace(page, parts=(*page.parts, *moves)), folder_at / "design.html", pdf),
        ]
    return Answer(designed, page, files)


def _pole_set(poles: str | Iterable[complex] | None) -> NDArray[np.complex128] | None:
    """Poles that were asked for, those of a set of Table 1 by its name."""
    name = re.fullmatch(r"\s*set\s*(\w+)\s*", poles, re.IGNORECASE) if isinstance(poles, str) else None
    if name is None:
        return _poles(poles)
    from upright.experiments.regulation_2.run import SETS

    if f"set {name[1]}" not in SETS:
        raise BadInput(f"--poles \"set N\" takes 1 to {len(SETS)} of Table 1, got '{name[1]}'.")
    return _poles(SETS[f"set {name[1]}"])


def _sampling(model: StateSpace, period: float | str | None) -> float:
    """Period of the loop [s]; that of sampled matrices is theirs."""
    requested = si_if_given(period, "s")
    if requested is None and not model.dt:
        raise BadInput('these matrices are continuous, and a computer closes the loop: say how often, --period "2 ms".')
    if requested is not None and model.dt and not math.isclose(requested, model.dt, rel_tol=1e-9):
        raise BadInput(
            f"these matrices are sampled every {1e3 * model.dt:.6g} ms, and a period of {1e3 * requested:.6g} ms is "
            "requested; leave --period out, or give a continuous model."
        )
    return model.dt or requested or 0.0


def _numbers(text: str | Iterable[float] | None) -> tuple[float, ...] | None:
    if text is None or (isinstance(text, str) and not text):
        return None
    parts = text.split(",") if isinstance(text, str) else text
    try:
        return tuple(float(part) for part in parts) or None
    except (TypeError, ValueError):
        raise BadInput(f'weights are numbers separated by commas, as in "1,0,1,0", got {text!r:.60}.') from None


def _start(rig: Rig | StateSpace, start: Start | None) -> tuple[float, ...] | None:
    """Deviation, state by state in its unit, where one was given."""
    states = read_start(start, rig.states, rig.state_units)
    if states and not any(states.values()):
        raise BadInput("--start must leave the equilibrium; give one state a value that is not 0.")
    return tuple(states.get(name, 0.0) for name in rig.states) if states else None
