"""Is this rig wired as it is described?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from upright.cli.terminal import AsJson, tell


def doctor(
    rig: Annotated[Path, typer.Argument(metavar="RIG.toml", help="What the rig is, and how far it may go.")],
    clear: Annotated[bool, typer.Option("--clear", help="Forget faults that are latched.")] = False,
    pulse: Annotated[bool, typer.Option(help="Give a small pulse and compare its answer with the model's.")] = True,
    as_json: AsJson = False,
) -> None:
    """Look at a rig before any loop: link, limits read back, each encoder moved by hand, a small pulse.

    Let the rig hang freely, with nobody in its way: the pulse moves it.

    upright rig doctor RIG.toml
    """
    from upright.rigs.rigfile import read_rig_file
    from upright.verbs import rig as verbs

    asked = _asks if read_rig_file(rig).hardware and sys.stdin.isatty() else None
    done = verbs.rig_doctor(rig, clear=clear, pulse=pulse, hand=asked)
    tell(done.chapter, done.files, done.numbers if as_json else None)
    if not done.chapter.sound:
        raise typer.Exit(3)


def _asks(sentence: str) -> bool:
    return typer.confirm(f"{sentence} Done?", default=True, err=True)
