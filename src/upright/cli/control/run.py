"""What comes of this law on that rig? Watched while it runs, stopped by a key."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.cli.terminal import AsJson, Out, Pdf, console, tell

if TYPE_CHECKING:
    from upright.realtime.session import RunState

STOPS = (" ", "q", "\x1b", "\r", "\n")
_BAR = 20


def run(
    rig: Annotated[Path, typer.Option("--rig", metavar="RIG.toml", help="What the rig is, and how far it may go.")],
    law: Annotated[
        Path | None, typer.Option("--law", metavar="GAIN.json", help="Law to run: design.json of upright design.")
    ] = None,
    excite: Annotated[
        str, typer.Option(metavar="SIGNAL", help='Instead of a law: "free", "step 0.5", "sweep 0.5 0.5 10".')
    ] = "",
    reference: Annotated[str, typer.Option(metavar="SIGNAL", help='That the law follows: "square 0.3 8".')] = "",
    duration: Annotated[float, typer.Option(metavar="SECONDS", help="How long.")] = 30.0,
    mode: Annotated[str, typer.Option(help="Who closes the loop: host, or mcu (the rig's own controller).")] = "host",
    tilt: Annotated[str, typer.Option(metavar="ANGLE", help="How a twin's pendulum leans when it is let go.")] = "",
    check: Annotated[bool, typer.Option(help="Compare a small pulse with the model first.")] = True,
    watch: Annotated[bool, typer.Option(help="Look for lying encoders beside the loop.")] = True,
    out: Out = Path("upright-run"),
    pdf: Pdf = False,
    as_json: AsJson = False,
) -> None:
    r"""Run a law, or a signal, on a rig: supervised, watched, logged, judged.

    The encoders are zeroed where the rig hangs, a small pulse is compared with the model,
    then you bring it where it is to be held. Space, q, Esc or Ctrl-C stop it: zero first.
    This is software, not a rated safety function: keep a stop in hardware within reach.

    \b
    upright run --rig RIG.toml --law design/design.json --duration 30
    upright run --rig RIG.toml --excite "sweep 0.5 0.5 8" --duration 60
    """
    from upright.verbs import rig as verbs

    with view(quiet=as_json) as observe:
        done = verbs.run(
            rig, law=law, excite=excite, reference=reference, duration=duration, mode=mode, tilt=tilt, check=check,
            watch=watch, out=out, pdf=pdf, observe=observe,
        )  # fmt: skip
    tell(done.chapter, done.files, done.numbers if as_json else None)
    if not done.value.sound:  # whether it ran, whatever its model is worth
        raise typer.Exit(3)


@contextmanager
def view(*, quiet: bool) -> Generator[Callable[[RunState], str]]:
    """State of the run on stderr, and whether a key was pressed; neither when nobody watches."""
    screen = console(error=True)
    if quiet or not screen.is_terminal:
        yield lambda _: ""
        return
    from rich.live import Live

    with _keys() as pressed, Live(console=screen, transient=True, refresh_per_second=20) as live:
        largest = 1e-9

        def observe(state: RunState) -> str:
            nonlocal largest
            largest = max(largest, abs(state.applied))
            live.update(lines(state, largest))
            return "Stopped by a key." if pressed() in STOPS else ""

        yield observe


def lines(state: RunState, largest: float) -> Any:
    """What is shown of a run: phase, deviations, command as a bar, late ticks, faults, the key that stops it."""
    from rich.text import Text

    from upright.rigs.board import told

    if state.phase != "running":
        return Text.assemble((f"{state.phase[:1].upper()}{state.phase[1:]}", "bold"), "\nspace, q or Esc: stop")
    bar = effort(state.applied, largest)
    away = "  ".join(f"{q:+9.4f}" for q in state.readings)
    late = (f"{state.late} late", "bold red" if state.late else "green")
    out = Text.assemble(
        (f"{state.time:8.2f} s  {state.mode.name}", "bold"), f"  tick {state.tick}  ", late, "\n",
        f"away {away}\n", f"command {state.applied:+8.3f} {bar}\n",
    )  # fmt: skip
    if state.faults:
        out.append(f"{told(state.faults)}\n", style="bold red")
    out.append("space, q or Esc: stop", style="dim")
    return out


def effort(value: float, largest: float) -> str:
    """A bar from the middle to either side."""
    n = min(_BAR, round(_BAR * abs(value) / largest)) if math.isfinite(value) else _BAR
    left, right = ("█" * n if value < 0 else "").rjust(_BAR), ("█" * n if value > 0 else "").ljust(_BAR)
    return f"[{left}|{right}]"


@contextmanager
def _keys() -> Generator[Callable[[], str]]:
    """The key that was pressed since the last call, or nothing; the terminal does not wait for Enter meanwhile."""
    if sys.platform == "win32":
        import msvcrt

        yield lambda: msvcrt.getwch() if msvcrt.kbhit() else ""
        return
    if not sys.stdin.isatty():
        yield lambda: ""
        return
    import select
    import termios
    import tty

    place = sys.stdin.fileno()
    before = termios.tcgetattr(place)
    tty.setcbreak(place)
    try:
        yield lambda: sys.stdin.read(1) if select.select([sys.stdin], [], [], 0)[0] else ""
    finally:
        termios.tcsetattr(place, termios.TCSADRAIN, before)
