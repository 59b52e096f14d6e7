"""What does the paper's experiment 4 look like when nothing is at hand but this program?"""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from upright.errors import BadInput

if TYPE_CHECKING:
    from upright.lab.experiment import Experiment

INTERRUPTED = 130


def lab(
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="DIR", help="Folder for logs, studies and report.")
    ] = Path("upright-lab"),
    seed: Annotated[int, typer.Option(help="Which rig of the make; 0 is the one as designed.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the numbers as JSON instead of sentences.")] = False,
) -> None:
    """Run the paper's experiment 4, a large free swing, on the simulated rig, from release to report.

    The pendulum of an ECP 205 with the A51 is lifted to horizontal and released; both encoders are logged, the rig's
    numbers are found from guesses 30 % off, and the wandering of the disk is explained: a push at the release, a rig
    out of level, and the soft spring that cures both. Everything is written to DIR: logs (CSV), studies (TOML) for
    `upright identify`, fit.json and report.html. Ctrl-C keeps and reports what is there.
    """
    if seed < 0:
        raise BadInput(f"--seed needs a whole number of at least 0, got {seed}.")
    if out.exists() and not out.is_dir():
        raise BadInput(f"results need a folder, but {out} is a file; name another with -o.")
    from upright.identification.fitfile import write_fit
    from upright.lab import experiment, page

    with _ctrl_c() as pressed, _progress(quiet=as_json) as tell:
        done = experiment.run(seed, out, tell, stopped=lambda: pressed.times > 0)
        pressed.patient = True
        tell("writing the report", 0.95)
        if "free_swing" in done.answers:
            first = done.answers["free_swing"]
            write_fit(first.fit, first.study, out / "fit.json")
        report = page.write(done)
    if as_json:
        typer.echo(json.dumps(page.summary(done, report), indent=2, ensure_ascii=False, allow_nan=False))
    else:
        _say(done, report)
    if done.interrupted or pressed.times:
        raise typer.Exit(INTERRUPTED)


@dataclass
class _Pressed:
    """How often Ctrl-C was pressed; once `patient`, the first press lets the report be written."""

    times: int = 0
    patient: bool = False


@contextmanager
def _ctrl_c() -> Generator[_Pressed]:
    """Count Ctrl-C besides raising it, for the time of the experiment."""
    pressed = _Pressed()

    def note(_signal: int, _frame: object) -> None:
        pressed.times += 1
        if not pressed.patient or pressed.times > 1:
            raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield pressed
        return
    before = signal.signal(signal.SIGINT, note)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _progress(*, quiet: bool) -> Generator[Callable[[str, float], None]]:
    """Bar on stderr; nothing when `quiet` or when nobody watches."""
    from upright.cli.terminal import console

    screen = console(error=True)
    if quiet or not screen.is_terminal:
        yield lambda step, share: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (BarColumn(bar_width=24), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Progress(*columns, console=screen, transient=True, refresh_per_second=8) as bar:
        task = bar.add_task("starting (the first time, equations are compiled)", total=1.0)
        yield lambda step, share: bar.update(task, description=step, completed=share)


def _say(done: Experiment, report: Path) -> None:
    """Numbers, verdict, where the report is and what to try next."""
    from rich.table import Table

    from upright.cli.terminal import console
    from upright.lab import page
    from upright.lab.free_swing import recovered
    from upright.report.symbols import number, unit

    screen = console()
    if "free_swing" in done.answers:
        title = "Numbers of the rig, from guesses 30 % off"
        table = Table(title=title, title_justify="left", box=None, pad_edge=False, header_style="bold")
        for heading in ("", "truth", "estimate", "95 % interval", "unit", ""):
            table.add_column(heading, justify="right" if heading in ("truth", "estimate") else "left", no_wrap=True)
        for f in recovered(done.rig, done.answers["free_swing"].fit):
            interval = f"{number(f.interval[0])} to {number(f.interval[1])}"
            cells = (
                f.name,
                number(f.truth),
                number(f.value),
                interval,
                unit(f.unit),
                "inside" if f.inside else "outside",
            )
            table.add_row(*cells)
        screen.print(table)
    screen.print(f"\n{page.verdict(done)}", soft_wrap=True, markup=False)
    if done.interrupted:
        screen.print("\nStopped by Ctrl-C; the report holds what was there by then.", soft_wrap=True)
    screen.print(
        f"\nReport: {report} (open it in a browser; {done.seconds:.1f} s)\nWhat next:", soft_wrap=True, markup=False
    )
    for sentence, command in page.next_steps(done):
        screen.print(f"- {sentence}\n    {command}", soft_wrap=True, markup=False)
