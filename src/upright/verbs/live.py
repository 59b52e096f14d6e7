"""A rig that is there: is it wired as described, does this machine keep time, and what comes of a law on it?"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from upright.files import keeps_its_inputs
from upright.verbs.answer import Answer
from upright.verbs.pages import folder_if_given, page_folder, write_page
from upright.verbs.values import si_if_given

if TYPE_CHECKING:
    from upright.experiments.running.doctor import Checkup
    from upright.experiments.running.run import RigRun
    from upright.realtime.jitter import Jitter
    from upright.realtime.session import RunState


@keeps_its_inputs
def run(
    rig: str | os.PathLike[str], *, law: str | os.PathLike[str] | None = None, excite: str = "", reference: str = "",
    duration: float = 30.0, mode: str = "host", tilt: float | str = "", check: bool = True, watch: bool = True,
    out: str | os.PathLike[str] = "upright-run", pdf: bool = False,
    observe: Callable[[RunState], str] = lambda _: "",
) -> Answer[RigRun]:  # fmt: skip
    """Run a law, or a signal, on the rig of a RIG.toml; supervised, logged, judged.

    A rig of hardware runs by the clock on the wall in a process of its own; twins and replays in virtual time.

    Parameters
    ----------
    rig : path
        RIG.toml.
    law : path, optional
        design.json of `design`.
    excite : str, optional
        Instead of a law, a signal put out blindly: ``"free"``, ``"step 0.5"``, ``"square 0.5 2"``, ``"sine 0.5 1.2"``,
        ``"sweep 0.5 0.5 10"`` [command unit, s, Hz].
    reference : str, optional
        The same, for the coordinate that the law's design tracks [rad or m].
    duration : float
        [s].
    mode : str
        ``"host"``, or ``"mcu"`` for the loop on the rig's own controller.
    tilt : float or str, optional
        Of the last coordinate when the hand of a twin lets go [rad or m].
    check : bool
        Whether a small pulse is compared with the model first.
    watch : bool
        Whether a bank of Kalman filters looks for lying encoders beside the loop.
    out : path
        Folder for the log and the page.
    pdf : bool
        Write the page as PDF too.
    observe : callable, optional
        Shown how it goes; answers with a sentence to end the run.

    Returns
    -------
    Answer
        Of a `RigRun`: how it ended, its log, deviations.

    Raises
    ------
    BadInput
        When files contradict each other.
    """
    from upright.experiments.running.chapter import run_chapter
    from upright.experiments.running.run import RunRequest, run_rig

    folder = page_folder(out, pdf)
    leaning = si_if_given(tilt, "rad") or 0.0
    wish = RunRequest(
        rig=Path(rig), law=None if law is None else Path(law), excite=excite, reference=reference, seconds=duration,
        mode=mode, tilt=leaning, check=check, watch=watch,
    )  # fmt: skip
    done = run_rig(wish, folder, watch=observe)
    told = run_chapter(done)
    page = write_page(told, done.log_path.with_suffix(".html"), pdf)
    return Answer(done, told, [*([done.log_path] if done.log is not None else []), *page])


def rig_check(
    *, seconds: float = 60.0, rate: float = 1000.0, fifo: bool = True, out: str | os.PathLike[str] | None = None
) -> Answer[Jitter]:
    """How late this machine wakes a loop, and what rate it can hold.

    Parameters
    ----------
    seconds, rate : float
        How long, and how often [s, Hz].
    fifo : bool
        Whether to ask for real-time priority.
    out : path, optional
        Folder for jitter.svg.

    Returns
    -------
    Answer
        Of a `Jitter`: `quantiles` [s], `late` ticks, `rate` held [Hz].

    Raises
    ------
    BadInput
        When that is no loop.
    """
    from upright.experiments.running.chapter import jitter_chapter
    from upright.experiments.running.figures import jitter_figure
    from upright.realtime.jitter import measure
    from upright.report.drawing import save

    folder = folder_if_given(out)
    found = measure(seconds, rate, fifo=fifo)
    files: list[Path] = []
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        files.append(folder / "jitter.svg")
        save(jitter_figure(found), files[0])
    return Answer(found, jitter_chapter(found), files)


@keeps_its_inputs
def rig_doctor(
    rig: str | os.PathLike[str], *, clear: bool = False, pulse: bool = True,
    hand: Callable[[str], bool] | None = None,
) -> Answer[Checkup]:  # fmt: skip
    """Whether a rig is wired as it is described: link, limits read back, encoders by hand, a small pulse.

    Parameters
    ----------
    rig : path
        RIG.toml.
    clear : bool
        Forget faults that are latched.
    pulse : bool
        Give the small pulse.
    hand : callable, optional
        Asked to move a coordinate by hand, with a sentence; answers whether that was done.

    Returns
    -------
    Answer
        Of a `Checkup`.

    Raises
    ------
    BadInput
        When RIG.toml cannot be used.
    """
    from upright.experiments.running.chapter import checkup_chapter
    from upright.experiments.running.doctor import check_up
    from upright.report.symbols import typed

    found = check_up(Path(rig), hand=hand, clear=clear, pulse=pulse)
    return Answer(found, checkup_chapter(found, typed(Path(rig))))
