"""A rig that is there: looked at, timed, run."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.renamed import renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.options import RunOptions, known_options
from upright.verbs.pages import folder_if_given, page_folder, write_page
from upright.verbs.values import Start, path_of, read_start

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.realtime.jitter import Jitter
    from upright.realtime.session import RunState
    from upright.running.doctor import Checkup
    from upright.running.run import RigRun
    from upright.verbs.control.moving import PlayedRun


@command(
    "Control",
    names={"rig": "--rig", "start": "--start --tilt"},
    metavars={
        "rig": "RIG.toml", "law": "DESIGN.json", "excite": "SIGNAL", "reference": "SIGNAL", "duration": "SECONDS",
        "start": "ANGLE", "accept": "REASON",
    },
    helps={
        "rig": "Description and limits of the rig.",
        "law": "Law to run: design.json of `upright design`.",
        "reference": 'Signal that the law follows: "square 0.3 8".',
        "duration": "Length of the run.",
    },
    defaults={"out": "upright-run"},
    wrong=lambda answer: not answer.value.sound,  # whether it ran, whatever its model is worth
    more="""
    Space, q, Esc or Ctrl-C stop it; the command goes to zero first.
    This is software, not a rated safety function: keep a stop in hardware within reach.

    upright run --rig RIG.toml --law design/design.json --duration 30
    upright run --rig RIG.toml --excite "sweep 0.5 0.5 8" --duration 60
    """,
)  # fmt: skip
@renamed({"tilt": ("start", lambda value: value)})
@keeps_its_inputs
def run(
    rig: PathLike, *, law: PathLike | None = None, excite: str | None = None,
    duration: float = 30.0, check: bool = True, watch: bool = True,
    out: PathLike | None = None, pdf: bool = False,
    observe: Callable[[RunState], str] = lambda _: "", **on: Unpack[RunOptions],
) -> RunAnswer:  # fmt: skip
    """Run a law or a signal on a rig, supervised and logged, and evaluate the run.

    The encoders are zeroed while the rig hangs, a small pulse is compared with the model, then you move it to where it
    is to be stabilised. Hardware runs in real time in a process of its own; twins and replays in virtual time.

    Parameters
    ----------
    rig : path
        RIG.toml.
    law : path, optional
        design.json of `design`.
    excite : str, optional
        Open-loop signal instead of a law: ``"free"``, ``"step 0.5"``, ``"square 0.5 2"``, ``"sine 0.5 1.2"``,
        ``"sweep 0.5 0.5 10"`` [command unit, s, Hz].
    duration : float
        [s].
    check : bool
        Compare a small pulse with the model first.
    watch : bool
        Monitor the loop for faulty encoders and a weak drive.
    out : path
        Folder for the log and the page.
    pdf : bool
        Write the page as PDF too.
    observe : callable, optional
        Shown how it goes; answers with a sentence to end the run. On hardware it has 2 s for that: who looks no more
        cannot stop it either, and it ends.
    **on
        Of the run: start, reference, mode, accept; see `RunOptions`.

    Returns
    -------
    RunAnswer
        Of a `RigRun`: how it ended, its log, deviations; `play` shows the rig as it moved.

    Raises
    ------
    BadInput
        When files contradict each other.
    """
    from upright.running.chapter import run_chapter
    from upright.running.run import RunRequest, run_rig

    if out is None:
        raise BadInput("the log of a run is kept: name a folder for it, such as out='runs'.")
    folder, on = page_folder(out, pdf), known_options(RunOptions, on, "run")
    if not path_of(rig, "the rig that runs").exists():
        from upright.readers.source import neighbour

        raise BadInput(
            f"There is no file '{rig}';{neighbour(Path(rig))} docs/howto/rigs.md says what a RIG.toml holds."
        )
    leaning = _let_go(on.get("start"), path_of(rig, "the rig that runs"), law=law is not None)
    request = RunRequest(
        rig=path_of(rig, "the rig that runs"), law=None if law is None else path_of(law, "a law that runs"),
        excite=excite or None, reference=on.get("reference") or None, seconds=duration, mode=on.get("mode") or "host",
        tilt=leaning, check=check, watch=watch, accept=on.get("accept") or "",
    )  # fmt: skip
    result = run_rig(request, folder, watch=observe)
    written = run_chapter(result)
    page = write_page(written, result.log_path.with_suffix(".html"), pdf)
    return RunAnswer(result, written, [*([result.log_path] if result.log is not None else []), *page])


class RunAnswer(Answer["RigRun"]):
    """A run of a rig."""

    def play(self, *, out: PathLike | None = None) -> PlayedRun:
        """The rig as its encoders saw it, in a page with a slider of time; written where `out` names one.

        Raises
        ------
        BadInput
            When no loop began, or the plant has no drawing.
        """
        from upright.verbs.control.moving import played_record

        run: RigRun = self.value
        if run.log is None:
            raise BadInput(f"there is nothing to play, since no loop began: {self.chapter.verdict}")
        return played_record(run.log.record(), run.model.plant, run.log_path.stem, run.file.performed, out)


TAP = 3.0
"""Degrees, or millimetres, from which a twin starts under a law where nobody says, for something to be seen."""


def _let_go(start: Start | float | None, rig: Path, *, law: bool) -> float:
    """Deviation of the last coordinate [SI], at rest and the others in the middle, as a hand lets go."""
    if isinstance(start, int | float):
        return float(start)
    from upright.basis import SIMULATED
    from upright.rigs.rigfile import read_rig_file
    from upright.running.rig import model_and_truth

    file = read_rig_file(rig)
    if not start and not (law and file.performed == SIMULATED):
        return 0.0
    model, _ = model_and_truth(file)
    last, unit = model.states[-2], model.state_units[-2]
    if not start:
        return math.radians(TAP) if unit == "rad" else 1e-3 * TAP
    start_state = read_start(start, model.states, model.state_units)
    if any(value for name, value in start_state.items() if name != last):
        raise BadInput(f'the hand of a twin lets go of {last} at rest; --start takes its deviation, such as "5 deg".')
    return start_state.get(last, 0.0)


@command(
    name="rig check",
    metavars={"rate": "HZ"},
    defaults={"out": "rig-check"},
    wrong=lambda answer: not answer.chapter.sound,
    more="""
    Measure with everything running that will run beside the loop.

    upright rig check --seconds 60
    """,
)
def rig_check(
    *, seconds: float = 60.0, rate: float = 1000.0, fifo: bool = True, out: PathLike | None = None
) -> Answer[Jitter]:
    """Measure how late this machine wakes a loop, and say whether a rate is safe on it.

    The loop has the law and the supervision of a run.

    Parameters
    ----------
    seconds : float
        How long to measure.
    rate : float
        Ticks per second.
    fifo : bool
        Ask for real-time priority.
    out : path, optional
        Folder for jitter.svg, the histogram.

    Returns
    -------
    Answer
        Of a `Jitter`: `quantiles` [s], `late` ticks, `rate` held [Hz], a faster one that is `promising`.

    Raises
    ------
    BadInput
        When that is no loop.
    """
    from upright.realtime.jitter import measure
    from upright.report.drawing import save
    from upright.running.chapter import jitter_chapter
    from upright.running.figures import jitter_figure
    from upright.running.tick import supervised

    folder = folder_if_given(out)
    jitter = measure(seconds, rate, fifo=fifo, make=supervised)
    files: list[Path] = []
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        files.append(folder / "jitter.svg")
        save(jitter_figure(jitter), files[0])
    return Answer(jitter, jitter_chapter(jitter), files)


def _for_hardware(typed: dict[str, Any]) -> dict[str, Any]:
    from upright.rigs.rigfile import read_rig_file

    return typed if read_rig_file(typed["rig"]).hardware else {**typed, "hand": None}


@command(
    name="rig doctor",
    metavars={"rig": "RIG.toml"},
    helps={"rig": "Description and limits of the rig."},
    prepare=_for_hardware,
    wrong=lambda answer: not answer.chapter.sound,
    more="""
    It asks for what a person does, and says what is wrong and how to mend it; see docs/tutorials/own_rig.md.

    upright rig doctor RIG.toml
    """,
)
def rig_doctor(
    rig: PathLike, *, clear: bool = False, pulse: bool = True,
    hand: Callable[[str], bool] | None = None,
) -> Answer[Checkup]:  # fmt: skip
    """Walk through a rig's first power-up: link, limits, encoders by hand, pulses, stop button, travel, watchdog.

    The drive stays off while an encoder is wrong, since every limit is in counts. Counts that a hand has shown are
    written into RIG.toml when you agree.

    Parameters
    ----------
    rig : path
        RIG.toml.
    clear : bool
        Forget faults that are latched.
    pulse : bool
        Try the drive: pulses that grow until it moves, stop button, end of travel, watchdog.
    hand : callable, optional
        Called with a sentence that asks for something to be done, or with a question; answers whether it was done, or
        yes.

    Returns
    -------
    Answer
        Of a `Checkup`: `findings`, each with its `fix`; `counts` and `dead_zone` as they were seen; `lost`, what the
        dead zone takes with its standard error.

    Raises
    ------
    BadInput
        When RIG.toml cannot be used.
    """
    from upright.report.symbols import typed
    from upright.running.chapter import checkup_chapter
    from upright.running.doctor import check_up

    file = path_of(rig, "a rig on hardware")
    checkup = check_up(file, hand=hand, clear=clear, pulse=pulse)
    return Answer(checkup, checkup_chapter(checkup, typed(file)))
