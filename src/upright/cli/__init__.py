"""Which commands does the tool answer to?

Each is a function in `upright/verbs`, or in another package that names it as an entry point of the group
``upright.commands``; `cli.build` makes a command of it when it is called.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from importlib import import_module
from inspect import isfunction
from pathlib import Path
from pkgutil import iter_modules
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from upright import verbs
from upright.cli.build import SETTINGS, build
from upright.cli.sentences import USER_ERROR, only_sentences, sentences
from upright.errors import BadInput
from upright.trust import allow_code, no_code
from upright.verbs.command import Command, command_of

NO_CODE, ALLOW_CODE = "--no-code", "--allow-code"
SECTIONS = ("Log", "Model", "Control", "Course", "upright rig", "upright log")
"""Of ``upright --help``; what other packages add follows."""
ELSEWHERE = "upright.commands"


def _declared() -> dict[str, Command]:
    """Every command of this package by its words; rooms of verbs without one may need NumPy, and are not imported."""
    commands: dict[str, Command] = {}
    for name, origin in _modules(verbs.__path__, verbs.__name__):
        if b"@command(" in Path(origin).read_bytes():
            for value in vars(import_module(name)).values():
                if isfunction(value) and value.__module__ == name and "command" in vars(value):
                    command = command_of(value)
                    commands[command.words] = command
    return commands


def _modules(folders: Iterable[str], package: str) -> Iterator[tuple[str, str]]:
    """Name and file of every module of a package and of those inside it, imported or not."""
    for module in iter_modules(folders, f"{package}."):
        spec: Any = module.module_finder.find_spec(module.name, None)
        if spec is not None and spec.origin is not None:
            yield module.name, spec.origin
            yield from _modules(spec.submodule_search_locations or (), module.name)


DECLARED = _declared()
COMMANDS = {words: command.line for words, command in DECLARED.items() if " " not in words}
NESTED: dict[str, dict[str, str]] = {}
"""Commands of two words, ``upright log show``, by the first."""
for _words, _command in DECLARED.items():
    if " " in _words:
        NESTED.setdefault(_words.split()[0], {})[_words.split()[1]] = _command.line


def elsewhere() -> dict[str, Any]:
    """Entry points of other packages by their words; importing what reads them takes as long as all of our own."""
    group = f"[{ELSEWHERE}]".encode()
    files = (file for folder in sys.path for file in Path(folder).glob("*-info/entry_points.txt"))
    if not any(group in file.read_bytes() for file in files):
        return {}
    from importlib.metadata import entry_points

    return {point.name: point for point in entry_points(group=ELSEWHERE) if point.name not in DECLARED}


class Commands(TyperGroup):
    """The commands by their names; one is built when it is called. Of ``log show``, `log` is such a group itself."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.before = "" if self.name == "upright" else f"{self.name} "
        self.commands = self._named(DECLARED)

    def _named(self, words: Any) -> dict[str, Any]:
        """First words after those that led here."""
        return dict.fromkeys(w.removeprefix(self.before).split()[0] for w in words if w.startswith(self.before))

    def list_commands(self, ctx: Any) -> list[str]:
        """Names, for the completion of a shell."""
        return list(self.commands | self._named(elsewhere()))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name, or the group of those that begin with it."""
        words = self.before + cmd_name
        if words in DECLARED:
            return build(DECLARED[words])
        others = {} if cmd_name in self.commands else elsewhere()
        if words in others:
            return build(_loaded(words, others[words]))
        self.commands |= self._named(others)  # a name that is none is compared with these
        if cmd_name not in self.commands:
            return None
        seconds = [w.split()[1] for w in (*DECLARED, *others) if w.startswith(f"{words} ")]
        return Commands(
            name=words, help=f"{', '.join(seconds)}: see below.", rich_markup_mode="rich", context_settings=SETTINGS
        )  # fmt: skip

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take `--no-code` and `--allow-code` of any command wherever they stand. Without a word, list commands."""
        if not args and not ctx.resilient_parsing:  # Typer shows nothing where rich has no part in the help
            typer.echo(ctx.get_help(), err=True)
            ctx.exit(USER_ERROR)
        moved = [option for option in (NO_CODE, ALLOW_CODE) if option in args]
        return super().parse_args(ctx, moved + [word for word in args if word not in moved])

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """List the commands in plain text; rich's boxes cost 0.15 s here, where people wait for nothing else."""
        super(TyperGroup, self).format_help(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands section by section."""
        sections: dict[str, list[tuple[str, str]]] = {name: [] for name in SECTIONS}
        for words, command in (DECLARED | elsewhere()).items():
            if words.startswith(self.before):
                try:
                    command = command if words in DECLARED else _loaded(words, command)
                    group, line = command.group, command.line
                except BadInput as error:
                    group, line = Command.group, str(error)
                section = f"upright {words.split()[0]}" if " " in words else group
                sections.setdefault(section, []).append((words, line))
        for section, rows in sections.items():
            if rows:
                with formatter.section(section):
                    formatter.write_dl(rows)

    def invoke(self, ctx: Any) -> Any:
        """Run a command; what a person got wrong becomes a sentence and an exit code."""
        only_sentences()
        refused, allowed = (bool(ctx.params.get(name)) for name in ("no_code", "allow_code"))
        with sentences(), no_code(refused), allow_code(allowed):
            return super().invoke(ctx)


def _loaded(words: str, point: Any) -> Command:
    """The command of another package, called as its entry point is."""
    try:
        return replace(command_of(point.load()), name=words)
    except Exception as error:
        raise BadInput(f"upright {words} cannot be imported from {point.value}: {error}.") from error


app = typer.Typer(
    name="upright",
    cls=Commands,
    add_completion=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings=SETTINGS,
    epilog="Start with `upright lab`; with a log of your own: `upright show`, `upright init`, `upright identify`.",
)


def _version(requested: bool) -> None:
    if requested:
        from upright._version import __version__

        typer.echo(f"upright {__version__}")
        raise typer.Exit


@app.callback()
def _upright(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_version, is_eager=True)
    ] = False,
    no_code: Annotated[
        bool, typer.Option(NO_CODE, help="Refuse to run Python code that a study or a fit.json names as its plant.")
    ] = False,
    allow_code: Annotated[
        bool, typer.Option(ALLOW_CODE, help="Run it without asking; where nobody can answer it is refused otherwise.")
    ] = False,
) -> None:
    """From one Lagrangian to a fitted real rig: a log goes in, a trusted nonlinear model comes out."""


def main() -> None:
    """Run the command line; the entry point of the script `upright`."""
    _any_terminal()
    os.environ["MPLBACKEND"] = "agg"  # nothing is shown in a window, and an unknown backend stops matplotlib
    date = os.environ.get("SOURCE_DATE_EPOCH", "0")
    if not date.isdecimal() or len(date) > 10:  # numpy.f2py, which SciPy imports, stops at what is no date
        del os.environ["SOURCE_DATE_EPOCH"]
    # The matrices of a fit are small: threads of the linear algebra only wait for each other (14.2 s against 8.1 s).
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    try:
        app()
    finally:
        _flush()


def _any_terminal() -> None:
    """Let streams of any encoding take any text, and have streams where they were closed before the start."""
    for name in ("stdout", "stderr"):
        stream: Any = getattr(sys, name)
        if stream is None:  # `upright show LOG >&-`
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a console of cp1252 has no Greek letter


def _flush() -> None:
    """Write what is still waiting; a reader that closed is no error, a full disk is reported."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            typer.echo(f"upright: the output could not be written: {error.strerror or error}.", err=True)
            raise SystemExit(USER_ERROR) from None
