"""What does a person at a terminal see of a command at work, and how do they answer it?"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Generator, Set
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from upright.cli import terminal

if TYPE_CHECKING:
    from upright.realtime.session import RunState

STOPS = (" ", "q", "\x1b", "\r", "\n")
_BAR = 20


@contextmanager
def services(wanted: Set[str], *, quiet: bool) -> Generator[dict[str, Any]]:
    """What a verb calls back, by the names of its parameters: bars, views, questions."""
    at_hand = "ask" in wanted  # a bar would be torn by what is asked and shown in between
    makers: dict[str, Callable[[ExitStack], Any]] = {
        "progress": lambda stack: stack.enter_context(
            (terminal.step_lines if at_hand else terminal.progress_bar)(quiet=quiet)
        ),
        "observe": lambda stack: stack.enter_context(view(quiet=quiet)),
        "watching": lambda _: partial(view, quiet=quiet),
        "ask": lambda _: _asking("Ready?"),
        "hand": lambda _: _asking("Done?"),
    }
    with ExitStack() as stack:
        yield {name: make(stack) for name, make in makers.items() if name in wanted}


def _asking(question: str) -> Callable[[str], bool] | None:
    """Asks the person for something, in a sentence; None where nobody sits there."""

    def ask(sentence: str) -> bool:
        try:
            text = sentence if sentence.endswith("?") else f"{sentence} {question}"
            return typer.confirm(text, default=True, err=True)
        except typer.Abort:
            raise KeyboardInterrupt from None

    return ask if sys.stdin.isatty() else None


@contextmanager
def view(*, quiet: bool) -> Generator[Callable[[RunState], str]]:
    """State of the run on stderr, and whether a key was pressed; neither when nobody watches."""
    screen = terminal.console(error=True)
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
    """What is shown of a run: phase, time left, deviations, command as a bar, late ticks, faults, the key to stop.

    The bar is full at the limit, or at the `largest` command so far where the limit is not known.
    """
    from rich.text import Text

    from upright.rigs.board import fault_text

    if state.phase != "running":
        return Text.assemble((f"{state.phase[:1].upper()}{state.phase[1:]}", "bold"), "\nspace, q or Esc: stop")
    scene = state.scene
    limited = math.isfinite(scene.limit)
    bar = effort_bar(state.applied, scene.limit if limited else largest)
    names = scene.readings if len(scene.readings) == len(state.readings) else (("", ""),) * len(state.readings)
    away = "  ".join(_deviation(*named, q) for named, q in zip(names, state.readings, strict=True))
    left = f", {max(scene.seconds - state.time, 0.0):.1f} s left" if math.isfinite(scene.seconds) else ""
    of_limit = f" of {scene.limit:g}" if limited else ""
    unit = f" {scene.command_unit}" if scene.command_unit else ""
    late = (f"{state.late} late", "bold red" if state.late else "green")
    out = Text.assemble(
        (f"{state.time:8.2f} s{left}  {state.mode.name}", "bold"), f"  tick {state.tick}  ", late, "\n",
        f"away {away}\n", f"command {state.applied:+8.3f}{of_limit}{unit} {bar}\n",
    )  # fmt: skip
    if state.faults:
        out.append(f"{fault_text(state.faults)}\n", style="bold red")
    out.append("space, q or Esc: stop", style="dim")
    return out


def _deviation(name: str, unit: str, value: float) -> str:
    """One deviation with its name, angles in degrees."""
    if unit == "rad":
        return f"{name} {math.degrees(value):+8.2f} deg"
    return f"{name} {value:+9.4f} {unit}".strip(" ") if name else f"{value:+9.4f}"


def effort_bar(value: float, largest: float) -> str:
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
