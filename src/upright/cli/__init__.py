"""Which commands does the tool answer to, and how does it say that something went wrong?

Each command lives in its own file, `upright/cli/GROUP/NAME.py`, as a function called NAME (with _ for -). The file is
imported when the command runs, so that listing the commands loads no numerical library.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Generator
from contextlib import contextmanager
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from upright.errors import UprightError
from upright.files import keeps_its_inputs
from upright.trust import no_code

GROUPS = {
    "Log": {
        "show": "Print and draw what a log holds: columns, sample rate, quanta, gaps, lying columns.",
        "doctor": "Say in plain sentences what looks wrong with a log, on which evidence, and what to do.",
        "init": "Write a commented study file from a log, filled in with what could be recognised.",
        "law": "Recover the control law from a closed-loop log: structure, gains, limit, what is left.",
    },
    "Model": {
        "identify": "Fit a rig's parameters to its logs as a study file says; write estimates and report.",
        "predict": "Score other runs with a model that was fitted before.",
        "ladder": "Grow a model only while it predicts better what it has not seen.",
        "frequency": "Measure a frequency response, or read one from logs, and fit the rig to it.",
        "loadings": "Find stiffness and bare inertia from step responses with known added masses.",
        "plan-inertias": "Say which masses, where and how often, give the tightest stiffness for the fewest runs.",
    },
    "Control": {
        "design": "Find the gains that hold a rig, and what they are worth in the loop a computer runs.",
        "export": "Write a designed law as a program that tests itself, or an identified rig for other simulators.",
        "regulate": "Hold an identified rig upright; say beforehand what each pole set will come to.",
        "swing-up": "Swing a hanging pendulum up by its own drive and catch it, once its encoders are trusted.",
        "track": "Make the far inertia of a flexible shaft follow a step, by state feedback and by PD.",
        "run": "Run a law, or a signal, on a rig: supervised, watched, logged, judged.",
    },
    "Course": {
        "lab": "Run the experiments of the paper on simulated rigs, and report what they say.",
        "reproduce": "Regenerate the pole tables of the paper from a few numbers, and show its misprints.",
        "survey": "Evaluate ratings before and after a course; check printed means and percentages.",
    },
}
NESTED = {
    "rig": {
        "doctor": "Look at a rig before any loop: link, limits, encoders by hand, a small pulse.",
        "check": "Measure how late this machine wakes a loop, and say whether it holds a rate.",
    },
    "log": {
        "show": "Print what a run's log holds: rig, law, duration, rate, modes, faults, events, what is missing.",
        "tail": "Print the last row of every chunk as it reaches a log that is being written, and every event.",
        "recover": "Write the rows of a torn log, up to its first error, to a whole file.",
        "convert": "Write a run's log as CSV, Parquet or MATLAB file.",
        "replay": "Pass the logged measurements through the logged law; say whether its commands are the same.",
    },
}
"""Commands of two words, ``upright log show``: each in `upright/cli/logs/show.py`, its folder the first word with s."""
COMMANDS = {name: line for commands in GROUPS.values() for name, line in commands.items()}

SETTINGS = {"help_option_names": ["-h", "--help"]}
NO_CODE = "--no-code"
USER_ERROR, BUG, INTERRUPTED = 2, 1, 130


class LazyGroup(TyperGroup):
    """The commands by name and help line; a command's module is imported when it is asked for."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take `--no-code` wherever it stands; it is an option of all commands."""
        moved = [NO_CODE] if NO_CODE in args else []
        return super().parse_args(ctx, moved + [word for word in args if word != NO_CODE])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Replace the stand-in that carried the help line by the command itself."""
        name, command, rest = super().resolve_command(ctx, args)
        if name in COMMANDS:
            group = next(group for group, commands in GROUPS.items() if name in commands)
            command = _load(group.lower(), name, COMMANDS[name])
        return name, command, rest

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """List the commands in plain text; rich's boxes cost 0.15 s here, where people wait for nothing else."""
        super(TyperGroup, self).format_help(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the commands group by group."""
        for group, commands in GROUPS.items():
            with formatter.section(group):
                formatter.write_dl(list(commands.items()))
        for first, commands in NESTED.items():
            with formatter.section(f"upright {first}"):
                formatter.write_dl([(f"{first} {name}", line) for name, line in commands.items()])

    def invoke(self, ctx: Any) -> Any:
        """Run a command; what a person got wrong becomes a sentence and an exit code."""
        _only_sentences()
        with sentences(), no_code(bool(ctx.params.get("no_code"))):
            return super().invoke(ctx)


class LazyNested(TyperGroup):
    """The commands of two words that share the first."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Replace the stand-in by the command itself."""
        name, command, rest = super().resolve_command(ctx, args)
        lines = NESTED.get(str(self.name), {})
        return name, _load(f"{self.name}s", name, lines[name]) if name in lines else command, rest


def _load(folder: str, name: str, line: str) -> Any:
    module = name.replace("-", "_")
    function = getattr(import_module(f"upright.cli.{folder}.{module}"), module)
    text = function.__doc__ or line
    one = typer.Typer(add_completion=False, rich_markup_mode="rich", context_settings=SETTINGS)
    # Docstrings are raw, for rich's escapes; \b keeps the line breaks of a paragraph.
    # The laboratory goes on in the folder that it reads; every other command leaves what it reads as it is.
    guarded = function if name == "lab" else keeps_its_inputs(function)
    one.command(name, help=text.replace("\\b\n", "\b\n"))(guarded)
    return typer.main.get_command(one)


@contextmanager
def sentences() -> Generator[None]:
    """Turn errors into one sentence on stderr and an exit code; `UPRIGHT_DEBUG=1` shows the traceback."""
    try:
        yield
    except KeyboardInterrupt:
        raise _stop("stopped by Ctrl-C; what was already written is kept.", INTERRUPTED) from None
    except BrokenPipeError:  # `upright show LOG | head`: the reader has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(0) from None
    except UprightError as error:
        _debug()
        raise _stop(str(error), USER_ERROR) from None
    except OSError as error:
        _debug()
        raise _stop(_about_file(error), USER_ERROR) from None
    except MemoryError:
        _debug()
        raise _stop("not enough memory for this input; try a shorter time window or fewer runs.", USER_ERROR) from None
    except Exception as error:
        _debug()
        if isinstance(error, typer.Exit | typer.Abort) or hasattr(error, "exit_code"):
            raise  # typer's own: usage errors and requested exits
        where = f"{type(error).__name__}: {error}".rstrip(": ")
        raise _stop(f"this is a bug in upright ({where}); UPRIGHT_DEBUG=1 shows where it happened.", BUG) from None


def _only_sentences() -> None:
    """Keep the remarks of libraries off the terminal, unless somebody asks for them."""
    import logging
    import warnings

    if os.environ.get("UPRIGHT_DEBUG", "0") in ("", "0") and not sys.warnoptions:
        warnings.simplefilter("ignore")
        logging.getLogger("matplotlib").setLevel(logging.CRITICAL)  # says what is wrong with a user's matplotlibrc


def _debug() -> None:
    if os.environ.get("UPRIGHT_DEBUG", "0") not in ("", "0"):
        raise  # what the caller is handling


def _stop(sentence: str, code: int) -> typer.Exit:
    typer.echo(f"upright: {' '.join(sentence.split())}", err=True)
    return typer.Exit(code)


def _about_file(error: OSError) -> str:
    name = f"'{error.filename}'" if error.filename is not None else "a file"
    if isinstance(error, FileNotFoundError):
        return f"{name} was not found; check the spelling and the folder it is looked for in."
    if isinstance(error, IsADirectoryError):
        return f"{name} is a folder, a file is needed; name the file inside it."
    if isinstance(error, NotADirectoryError | FileExistsError):
        return f"a folder is needed where {name} is a file; choose another place with -o."
    if isinstance(error, PermissionError):
        return f"{name} may not be read or written by you; check its permissions or choose another place with -o."
    return f"{name} could not be used: {error.strerror or error}; check the disk and the path."


app = typer.Typer(
    name="upright",
    cls=LazyGroup,
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings=SETTINGS,
    epilog="Start with `upright lab`; with a log of your own: `upright show`, `upright init`, `upright identify`.",
)


def _version(asked: bool) -> None:
    if asked:
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
) -> None:
    """From one Lagrangian to a fitted real rig: a log goes in, a trusted nonlinear model comes out."""


for _name, _help in COMMANDS.items():
    app.command(_name, help=_help)(lambda: None)

for _first, _lines in NESTED.items():
    _nested = typer.Typer(cls=LazyNested, no_args_is_help=True, rich_markup_mode="rich", context_settings=SETTINGS)
    for _name, _help in _lines.items():
        _nested.command(_name, help=_help)(lambda: None)
    app.add_typer(_nested, name=_first, help=f"{', '.join(_lines)}: see below.")


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
    """Write what is still waiting; a reader that went away is no error, a full disk is said."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            typer.echo(f"upright: the output could not be written: {error.strerror or error}.", err=True)
            raise SystemExit(USER_ERROR) from None
