"""Experiment 1b at a rig: all frequencies at once while it hangs, as strongly as its travel allows, and fits of that.

Short probes, each stronger than the one before, show what a unit of command does on this rig; the last and longest run
asks for motion that keeps clear of dry friction and counts and stays well within the travel. Its response is reported
frequency by frequency; the numbers come from the motion itself, which knows dry friction for what it is, and are held
against the last probe, which they have not seen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from upright.errors import BadInput, NotIdentifiable
from upright.experiments.frequency_1b.run import LoggedResponse, LogRequest, response_of_logs
from upright.experiments.stand.fits import fit_study
from upright.experiments.stand.known import Known
from upright.experiments.stand.stand import TestStand, file_of
from upright.experiments.stand.strength import GROWTH, OF_TRAVEL, REACH, SHARE, STILL, swinging
from upright.experiments.stand.studies import write_study
from upright.identification.frequency.spectra import multisine, odd_lines
from upright.identification.model.fit import Fit
from upright.progress import Progress, part
from upright.records import Array, Record
from upright.study.load import Study

BELOW, ABOVE = 0.4, 4.0
"""Ends of the band beside the slowest and the fastest swing of a rig that nobody makes."""
LINES, RESOLVED = 20, 4
"""Frequencies, and how many times the period of the multisine holds that of the slowest."""
PROBES = (0.15, 0.4, 0.8)
"""Commands of the probes, as shares of what the guesses call for; what came of each bounds the next."""
PROBED, PERIODS = 2, 8
"""Periods of a probe, and of the run."""


@dataclass(frozen=True, kw_only=True)
class Asking:
    """Excitation of the rig: a band [rad/s], amplitudes wanted [m or rad], and one period of the command."""

    band: tuple[float, float]
    reach: Array
    wave: Array


def band_and_reach(stand: TestStand) -> tuple[tuple[float, float], Array]:
    """Frequencies between which a rig is excited [rad/s], and the amplitudes that are wanted there [m or rad].

    Raises
    ------
    BadInput
        When it does not swing where it rests.
    """
    model, at = stand.rig, stand.resting
    linear = model.linear(at)
    if stand.make is not None:
        (low, high), reach = stand.make.band, np.array(stand.make.reach)
    else:
        swings = [abs(p) for p in swinging(linear.poles().tolist())]
        if not swings:
            raise BadInput(
                f"{model.name} does not swing about '{at}', and the band of its excitation follows from its "
                "swings; log a step of it instead (upright run --excite), and fit that (upright identify)."
            )
        low, high = BELOW * min(swings), ABOVE * max(swings)
        reach = np.array([REACH[c.unit] for c in model.plant.coordinates])
    driven = stand.names.index(model.plant.inputs[0].on)
    reach[driven] = min(reach[driven], OF_TRAVEL * stand.travel)
    return (low, high), reach


def asking(stand: TestStand) -> Asking:
    """Of the rig as its owner describes it.

    Raises
    ------
    BadInput
        When it does not swing where it rests.
    """
    model, linear = stand.rig, stand.rig.linear(stand.resting)
    band, reach = band_and_reach(stand)
    length = 64 * math.ceil(RESOLVED * 2 * math.pi / (64 * band[0] * model.period))
    base = 2 * math.pi / (length * model.period)
    lines = odd_lines(*band, LINES, base)
    moved = np.abs(linear.response(lines * base)[:, :, 0])
    level = np.minimum(model.limit, np.min(reach / moved, axis=1))
    wave = multisine(lines, level, length)
    return Asking(band=band, reach=reach, wave=wave / np.abs(wave).max())


@dataclass(frozen=True, kw_only=True, eq=False)
class AtOnce:
    """What the rig answered: its response, if it has one, and a fit of the motion with the study that repeats it."""

    response: LoggedResponse | None
    study: Study
    fit: Fit


def run_at_once(
    stand: TestStand, folder: Path, progress: Progress, weighed: Sequence[Known] = ()
) -> AtOnce:  # fmt: skip
    """Ask the rig, and fit what it answered; leaves logs, `study.toml`, `fit.json` and the response in a folder.

    What experiment 1a `weighed` is known.

    Raises
    ------
    RigStopped
        When the rig was stopped by a limit, or was not left to rest.
    """
    request = asking(stand)
    names = stand.names
    rests = f"{names[-1]} hang at rest" if stand.resting == "hanging" else "everything rest"
    still = f"Let {rests}, with {names[0]} in the middle of its travel and room around it"
    still = f"Take the added masses off. {still}" if weighed else still
    most = SHARE * stand.rig.limit
    right = _level(stand, request, most)  # by the guesses
    level, stronger, logs = PROBES[0] * right, right, list[Record]()
    for i, share in enumerate(PROBES):
        progress(f"probing, {i + 1} of {len(PROBES)}", 0.3 * i / len(PROBES))
        level = min(share * stronger, GROWTH * level, most)
        stand.ask(f"{still}; probe {i + 1} of {len(PROBES)} follows.")
        logs.append(stand.run(_from_rest(stand, level * request.wave, PROBED), folder, "probe"))
        stronger = min(level / max(_share(logs[-1], names, request), 1e-3), most)
    level = min(stronger, GROWTH * level)
    seconds = PERIODS * request.wave.size * stand.rig.period
    stand.ask(f"{still}; all frequencies at once follow for {seconds:.0f} s.")
    progress(f"asking all frequencies at once for {seconds:.0f} s", 0.3)
    log = stand.run(_from_rest(stand, level * request.wave, PERIODS), folder, "multisine")
    runs = [_run("multisine", log, request, PERIODS), _run("probe", logs[-1], request, PROBED) | {"role": "predict"}]
    path = write_study(stand, folder / "study.toml", f"Hanging: {stand.rig.name}", runs, known=weighed)
    log_request = LogRequest(
        kind="multisine", hold=stand.rig.period, band=request.band, signals={}, counts={}, known={}
    )
    alone = {**runs[0], "file": f"../{file_of(log)}"}
    answered = write_study(stand, folder / "response" / "study.toml", f"Response: {stand.rig.name}", [alone],
                           known=weighed)  # fmt: skip
    tell = part(progress, 0.5, 0.6, "fitting the response")
    try:
        response = response_of_logs([answered], log_request, answered.parent, tell=tell)
    except NotIdentifiable:  # friction may leave too few frequencies; the motion says more
        response = None
    study, fit = fit_study(path, part(progress, 0.6, 1.0, "fitting the motion"))
    return AtOnce(response=response, study=study, fit=fit)


def _run(label: str, log: Record, request: Asking, periods: int) -> dict[str, Any]:
    """The part of a log in which the command was whole: while it grows, what sticks and slips hardly moves, and a
    simulation that errs there is lost from there on.
    """
    window = [float(log.t[-periods * request.wave.size]), float(log.t[-1])]
    return {"label": label, "file": file_of(log), "window": window}


def _from_rest(stand: TestStand, wave: Array, periods: int) -> list[float]:
    """Samples that begin at rest, since a drive with a lag looks back, and grow over a period before those requested.

    What begins at once gives a free axis a push, on which it drifts out of its travel.
    """
    growing = wave * (1 - np.cos(np.linspace(0.0, math.pi, wave.size))) / 2
    return np.concatenate([np.zeros(math.ceil(STILL / stand.rig.period)), growing, np.tile(wave, periods)]).tolist()


def _level(stand: TestStand, request: Asking, most: float) -> float:
    """Largest command that by the guesses moves no coordinate further than wanted."""
    spectrum = np.fft.rfft(request.wave)
    omega = 2 * math.pi * np.arange(spectrum.size) / (request.wave.size * stand.rig.period)
    lines = np.flatnonzero(np.abs(spectrum) > 1e-6 * np.abs(spectrum).max())
    answer = np.zeros((request.reach.size, spectrum.size), dtype=np.complex128)
    answer[:, lines] = stand.rig.linear(stand.resting).response(omega[lines])[:, :, 0].T * spectrum[lines]
    peaks = np.ptp(np.fft.irfft(answer, request.wave.size, axis=1), axis=1) / 2
    return float(min(most, np.min(request.reach / np.maximum(peaks, 1e-12))))


def _share(log: Record, names: list[str], request: Asking) -> float:
    """Largest amplitude over the last period of a probe, beside the one that is wanted."""
    measured = np.column_stack([log[n] for n in names])[-request.wave.size :]
    return float(np.max(np.ptp(measured, axis=0) / (2 * request.reach)))
