"""A frequency response, measured or read from logs, and the rig fitted to it: `frequency`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.progress import Progress, silent
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.options import known_options
from upright.verbs.pages import page_folder, write_page, written_where_named
from upright.verbs.values import pairs, path_of, paths, si

if TYPE_CHECKING:
    from upright.experiments.frequency_1b.run import FrequencyRun, LoggedResponse
    from upright.files import PathLike
    from upright.identification.frequency.response import FrequencyResponse

KINDS = ("sines", "multisine", "sweep")


class ResponseOptions(TypedDict, total=False):
    """What a log does not say of the response that it holds.

    Parameters
    ----------
    kind : str, optional
        What a log holds of these, when it is not recognised rightly.
    command : str, optional
        Column that drives.
    signal : mapping of str to str, optional
        Column by coordinate, or texts NAME=COLUMN.
    counts : mapping of str to float, optional
        Counts per rad or m by coordinate, negative if reversed, or texts NAME=N.
    known : mapping, optional
        What is known of the rig by parameter [SI]: a number, a number with its standard uncertainty, or a text such as
        ``"135 g +- 0.2 %"``; or texts NAME=VALUE.
    hold : float or str, optional
        How long a command is held [s]; one sample when omitted.
    low, high : float, optional
        Least and greatest frequency [rad/s].
    """

    kind: str
    command: str
    signal: Mapping[str, str] | Sequence[str] | None
    counts: Mapping[str, float | str] | Sequence[str] | None
    known: Mapping[str, float | str | tuple[float, float]] | Sequence[str] | None
    hold: float | str | None
    low: float | None
    high: float | None


@command(
    "Model",
    defaults={"out": "frequency"},
    names={"low": "--from", "high": "--to"},
    metavars={
        "sources": "[LOG...]", "rig": "KIND", "ask": "HOW", "kind": "HOW", "signal": "NAME=COLUMN", "counts": "NAME=N",
        "known": "NAME=VALUE", "hold": "TIME", "low": "W", "high": "W",
    },
    helps={
        "signal": "Column of a coordinate, as in theta=enc2.",
        "counts": "Counts per rad or m; negative if reversed.",
        "known": 'As in "m_p=135 g +- 0.2 %"; fixes the scale.',
        "low": "Least frequency, in rad/s.",
        "high": "Greatest frequency, in rad/s.",
    },
    prepare=lambda typed: {**typed, "progress": silent} if typed["sources"] else typed,
    more="""
    A log without --rig gives the response alone; fit.json goes to upright design.

    upright frequency --rig furuta --seed 3 -o out
    upright frequency sweep.csv --rig linear --known "m_p=135 g +- 0.2 %" -o out
    upright frequency analyser.csv --rig my-study.toml -o out
    upright frequency one.txt two.txt --command v --signal theta=theta
    """,
)  # fmt: skip
@written_where_named
@keeps_its_inputs
def frequency(
    sources: Sequence[PathLike] | PathLike | FrequencyResponse | None = None, *, rig: PathLike | None = None,
    seed: int = 0, ask: str = "sines", data: PathLike | None = None,
    out: PathLike | None = None, pdf: bool = False, progress: Progress = silent,
    **of_log: Unpack[ResponseOptions],
) -> Answer[FrequencyRun | LoggedResponse]:  # fmt: skip
    """Measure a frequency response, or read one from logs, and fit the rig to it.

    Fits by the paper's simplex on squared dB and by least squares with phase, weights and dry friction, side by side
    (experiment 1b).

    Parameters
    ----------
    sources : path, sequence of paths, FrequencyResponse or control.FrequencyResponseData, optional
        Logs (repeats together), a table of a response (frequency, magnitude, phase), or a study; a twin when omitted.
    rig : str or path
        Twin, or rig model of the logged rig: furuta, linear, rectilinear, torsional, or a STUDY.toml whose rig it is.
    seed : int
        Random seed of the rig model; 0 is nominal.
    ask : str
        Ask the twin by sines, multisine or sweep.
    data : path, optional
        Folder the runs' files are in; the study's own when omitted.
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    progress : callable, optional
        Called with the current step and the share completed.
    **of_log
        Of the logs: kind, command, signal, counts, known, hold, low, high; see `ResponseOptions`.

    Returns
    -------
    Answer
        Of a `FrequencyRun` on a twin, of a `LoggedResponse` from sources.

    Raises
    ------
    BadInput
        When there is no such rig or way, or a log cannot be used.
    """
    from upright.rig.makes import MAKES

    at, options = page_folder(out, pdf), known_options(ResponseOptions, of_log, "frequency")
    kind = options.get("kind")
    for value, option in ((ask, "--ask"), (kind or "sines", "--kind")):
        if value not in KINDS:
            raise BadInput(f"{option} is one of {', '.join(KINDS)}, got '{value}'.")
    limits = _band(options.get("low"), options.get("high"))
    files = [at / "frequency.csv"]
    if logs := [_source(source) for source in paths(sources)]:
        from upright.experiments.frequency_1b.chapter import log_chapter
        from upright.experiments.frequency_1b.run import LogRequest, response_of_logs
        from upright.verbs.values import si_if_given

        request = LogRequest(
            make=str(rig) if rig else None, command=options.get("command") or None,
            signals=pairs(options.get("signal"), "--signal"), kind=kind or None, seed=seed,
            hold=si_if_given(options.get("hold"), "s"), band=limits,
            counts={n: _count(n, v) for n, v in pairs(options.get("counts"), "--counts").items()},
            known={n: _known(n, v, str(rig or "")) for n, v in pairs(options.get("known"), "--known").items()},
        )  # fmt: skip
        result = response_of_logs(logs, request, at, data=None if data is None else Path(data))
        files += [at / "fit.json"] if result.answer else []
        page = log_chapter(result)
    else:
        for name in [*options, *(["data"] if data is not None else [])]:
            option = {"low": "from", "high": "to"}.get(name, name)
            raise BadInput(f"--{option} belongs to a log, and none was named; name one, or leave the option out.")
        if not rig:
            raise BadInput(
                "frequency needs a log, a frequency.csv or a study to read, or a twin to sweep: --rig "
                f"{', '.join(MAKES)}."
            )
        from upright.experiments.frequency_1b.chapter import chapter
        from upright.experiments.frequency_1b.run import run_frequency
        from upright.report.page import simulated
        from upright.rig.makes import make_named

        make_named(str(rig))
        result = run_frequency(str(rig), seed, at, progress, kind=ask)
        files += [at / "sweep.csv", at / "fit.json"]
        page = simulated(chapter(result))
    files += write_page(page, at / "report.html", pdf)
    numbers = {"verdict": page.verdict, "sound": page.sound, **page.numbers, "files": [str(f) for f in files]}
    return Answer(result, replace(page, numbers=numbers), files)


def _source(source: Any) -> Path | FrequencyResponse:
    """A file, or a response that is in memory."""
    from upright.identification.frequency.response import FrequencyResponse

    if hasattr(source, "frdata"):
        return FrequencyResponse.from_control(source)
    return source if isinstance(source, FrequencyResponse) else path_of(source, "a log")


def _band(low: float | None, high: float | None) -> tuple[float, float] | None:
    """Least and greatest frequency [rad/s] of those specified."""
    for value, option in ((low, "--from"), (high, "--to")):
        if value is not None and not 0 < value < math.inf:
            raise BadInput(f"{option} needs a frequency above 0 rad/s, got {value:g}; leave it out to take all.")
    band = (low or 0.0, high or math.inf)
    if not band[0] < band[1]:
        raise BadInput(f"--from must lie below --to, got {band[0]:g} and {band[1]:g} rad/s; exchange them.")
    return None if low is None and high is None else band


def _count(name: str, text: float | str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if value == 0 or not math.isfinite(value):
        raise BadInput(f"--counts {name} needs a finite number that is not 0, got '{text}'.")
    return value


def _known(name: str, value: float | str | tuple[float, float], make: str) -> tuple[float, float]:
    """Value and standard uncertainty [SI]."""
    from upright.rig.makes import MAKES

    if make not in MAKES:
        raise BadInput("--known belongs to a fit; name the rig with --rig too.")
    if isinstance(value, tuple):
        return si(value[0], ""), si(value[1], "")
    if not isinstance(value, str):
        return si(value, ""), 0.0
    from upright.units import measured

    plant = MAKES[make].rig.plant
    if name in plant.names():
        return measured(value, plant.quantity(name).unit)
    return measured(value, "s" if name in ("actuator.delay", "actuator.lag") else "")
