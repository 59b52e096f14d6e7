"""How does a verb become a command? Its signature gives arguments and options, its docstring their help."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from upright.cli import terminal
from upright.cli.watch import services
from upright.files import keeps_its_inputs
from upright.verbs.command import Command, Flag, description, parameter_texts
from upright.verbs.options import shared_parameters
from upright.verbs.values import pairs

SETTINGS = {"help_option_names": ["-h", "--help"]}
INTERRUPTED, WRONG = 130, 3
# What options of one name have in common, whichever command they are of.
METAVARS = {
    "command": "COLUMN", "counts": "LIST", "data": "DIR", "limit": "U", "log": "LOG",
    "logs": "LOG...", "out": "DIR", "period": "TIME", "poles": "LIST", "reader": "NAME", "travel": "M_OR_RAD",
    "speed": "WAY", "vendor": "NAME", "workers": "N",
}  # fmt: skip
HELPS = {
    "pdf": "Write the page as PDF too (pdf extra).",
    "workers": "Share the work among N processes of this machine, or a Dask scheduler, tcp://host:8786.",
}
RANGES = {"seed": (0, None)}


def build(command: Command) -> Any:
    """The command as Typer runs it."""
    verb: Mapping[str, inspect.Parameter] = inspect.signature(command.verb).parameters
    callbacks = {n for n, p in verb.items() if re.search(r"Callable|Progress", _annotation(p))}
    texts = parameter_texts(command.verb)
    for p in [p for p in verb.values() if p.kind is p.VAR_KEYWORD]:
        shared, shared_texts = shared_parameters(p, command.verb.__module__)
        verb, texts = {**verb, **shared}, {**shared_texts, **texts}
    away = {*callbacks, *command.hidden, *(n for n, p in verb.items() if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD))}
    typed = [_option(command, p, texts) for p in verb.values() if p.name not in away]
    typed += [_flag(name, flag) for name, flag in command.flags.items()]
    if "Answer" in str(inspect.signature(command.verb).return_annotation):
        typed.append(_flag("as_json", Flag(help="Print the numbers as JSON instead of tables."), "--json"))

    def call(**words: Any) -> None:
        as_json = words.pop("as_json", False)
        flags = {name: words.pop(name) for name in command.flags}
        arguments = command.prepare({n: _value(verb[n], word) for n, word in words.items()} | flags)
        arguments = {n: value for n, value in arguments.items() if n not in flags}
        with services(callbacks - arguments.keys(), quiet=as_json) as served:
            answer = command.verb(**arguments, **served)
        answer = answer if command.lines is None else command.lines(answer)
        terminal.tell(answer, as_json=as_json)
        if getattr(answer, "interrupted", False):
            raise typer.Exit(INTERRUPTED)
        if command.wrong(answer, **flags):
            raise typer.Exit(WRONG)

    guarded = call if command.resumes else keeps_its_inputs(call)
    guarded.__signature__ = inspect.Signature(typed)  # type: ignore[attr-defined]
    guarded.__annotations__ = {p.name: p.annotation for p in typed}
    one = typer.Typer(add_completion=False, rich_markup_mode="rich", context_settings=SETTINGS)
    one.command(command.words, help=_help(command))(guarded)
    return typer.main.get_command(one)


def _option(command: Command, parameter: inspect.Parameter, texts: Mapping[str, str]) -> inspect.Parameter:
    """A parameter of the verb as one that Typer reads."""
    name, default = parameter.name, command.defaults.get(parameter.name, parameter.default)
    kind, named = _kind(parameter), command.options(name)
    if _repeated(parameter):
        kind, default = list[kind], parameter.empty if default is parameter.empty else None
    elif kind is Path and isinstance(default, str):
        default = Path(default)
    least, most = command.ranges.get(name, RANGES.get(name, (None, None)))
    settings: dict[str, Any] = {
        "help": _plain(command.helps.get(name) or HELPS.get(name) or texts.get(name, "")) or None,
        "metavar": command.metavars.get(name, METAVARS.get(name)), "min": least, "max": most,
    }  # fmt: skip
    if parameter.kind is not parameter.KEYWORD_ONLY and not named:
        about = typer.Argument(**settings)
    else:
        word = name.replace("_", "-")
        words = (word, f"no-{word}") if default is True else (word,)
        switch = "/".join(f"--{w}" for w in words)
        about = typer.Option(*(named or [switch]), **settings)
    kind = kind | None if default is None else kind
    return parameter.replace(kind=parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, about])


def _value(parameter: inspect.Parameter, word: Any) -> Any:
    """What the verb is called with."""
    if word is None:
        return parameter.default
    only_mapping = "Mapping[" in _annotation(parameter) and "Sequence[" not in _annotation(parameter)
    return pairs(word, f"--{parameter.name}") if only_mapping and isinstance(word, list) else word


def _annotation(parameter: inspect.Parameter) -> str:
    annotation = parameter.annotation
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return text.replace("collections.abc.", "").replace("typing.", "")


def _repeated(parameter: inspect.Parameter) -> bool:
    return parameter.default == () or re.match(r"(Sequence|Mapping|list)\[", _annotation(parameter)) is not None


def _kind(parameter: inspect.Parameter) -> Any:
    """Type of what is typed; a value with its unit is a text, which the verb reads."""
    text, default = _annotation(parameter), parameter.default
    if text == "Workforce":
        return str
    for kind in (bool, int, float):
        if isinstance(default, kind):
            return kind
    if re.search(r"Path|\bLog\b|(Rig|Fit|Study)Like", text):
        return Path
    return next((kind for kind in (str, float, int, bool) if re.search(rf"\b{kind.__name__}\b", text)), str)


def _help(command: Command) -> str:
    """The docstring's description, its lines as wide as the terminal, and what the command adds to it."""
    paragraphs = description(command.verb).split("\n\n")
    joined = (p if p.startswith(" ") else " ".join(p.split()) for p in paragraphs)
    return _plain("\n\n".join([*joined, *filter(None, [inspect.cleandoc(command.more)])]))


def _plain(text: str) -> str:
    """Text without Python's double backticks, and with its brackets kept from being read as rich's mark-up."""
    return re.sub(r"\[(?=[a-z#/@\[])", r"\\[", text.replace("``", ""))


def _flag(name: str, flag: Flag, option: str = "") -> inspect.Parameter:
    def shown(requested: bool) -> None:
        if requested and flag.prints is not None:
            typer.echo(flag.prints())
            raise typer.Exit

    switch = typer.Option(
        option or f"--{name}", help=flag.help, callback=shown if flag.prints else None, is_eager=bool(flag.prints)
    )
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Annotated[bool, switch])
