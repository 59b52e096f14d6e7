"""Write the reference pages: every command as the command line has it, every public name with an example that runs."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import upright as up
from upright.cli import DECLARED
from upright.cli.build import build
from upright.verbs.command import Command, description

SESSION = Path(__file__).parent / "reference" / "session.py"
GROUPS = re.compile(r"^(\w[\w ]*?)  +(\w.*(?:\n {12}.*)*)", re.M)
"""Rows of the table in the package's docstring: a group and its names."""


def write(folder: Path) -> None:
    """Pages below `commands/` and `api/`, each with an index."""
    sections: dict[str, dict[str, str]] = {}
    for words, command in DECLARED.items():
        section = f"upright {words.split()[0]}" if " " in words else command.group
        sections.setdefault(section, {})[words.replace(" ", "_")] = command_page(command)
    _write(
        folder / "commands",
        "Commands",
        "Every command and each of its options, as `upright COMMAND --help` prints them.",
        sections,
    )
    cells = examples()
    pages = {
        group: {name: name_page(name, cells[name]) for name in names if name in cells}
        for group, names in groups().items()
    }
    intro = (
        "Every name of `import upright as up`. The examples form one session, which a test runs from top to bottom; "
        "each builds on what the ones before it made. It begins with a simulated rig and its log:\n\n"
        f"```python\n{cells['set-up']}```\n"
    )
    _write(folder / "api", "Python", intro, pages)


def examples() -> dict[str, str]:
    """Cells of the session by the name that they show."""
    pieces = re.split(r"^# %% (\S+)\n", SESSION.read_text(encoding="utf-8"), flags=re.M)
    return {
        name: code.strip() + "\n" for name, code in zip(pieces[1::2], pieces[2::2], strict=True)
    }


def groups() -> dict[str, list[str]]:
    """Public names by the section of the package's docstring; what stands in none is an error or the version."""
    table: dict[str, list[str]] = {}
    for group, text in GROUPS.findall(inspect.getdoc(up) or ""):
        listed = [n for n in re.findall(r"\w+", text) if n in up.__all__]
        if listed:
            table.setdefault(group.strip(), []).extend(
                n for n in listed if not any(n in t for t in table.values())
            )
    rest = [n for n in up.__all__ if not any(n in names for names in table.values())]
    return {**table, "Errors and version": rest}


def name_page(name: str, example: str) -> str:
    """Docstring of a public name, and its example."""
    value = getattr(up, name)
    if isinstance(value, str):
        text = "Version of the package."
    else:
        kind = "autoclass" if inspect.isclass(value) else "autofunction"
        option = (
            "\n:members:" if name in ("Record", "StateSpace", "Rig", "Law", "Rule", "Plant") else ""
        )
        text = f"```{{eval-rst}}\n.. currentmodule:: upright\n\n.. {kind}:: upright.{name}{_indent(option)}\n```"
    return f"# up.{name}\n\n{text}\n\n## Example\n\n```python\n{example}```\n"


def _indent(option: str) -> str:
    return option.replace("\n", "\n   ")


def command_page(command: Command) -> str:
    """Usage, help, arguments and options of a command."""
    made = build(command)
    arguments = [p for p in made.params if p.param_type_name == "argument"]
    options = [p for p in made.params if p.param_type_name == "option" and p.name != "help"]
    usage = " ".join(
        [
            f"upright {command.words}",
            *(_usage(p) for p in arguments),
            *(["[OPTIONS]"] if options else []),
        ]
    )
    parts = [f"# upright {command.words}", f"```text\n{usage}\n```"]
    for paragraph in [*description(command.verb).split("\n\n"), inspect.cleandoc(command.more)]:
        if re.match(r" {2,}|upright ", paragraph):
            parts.append("```text\n" + inspect.cleandoc("\n" + paragraph).strip() + "\n```")
        elif paragraph.strip():
            parts.append(_text(" ".join(paragraph.split())))
    for title, rows in (("Arguments", arguments), ("Options", options)):
        if rows:
            parts.append(f"## {title}\n\n" + "\n\n".join(_row(p) for p in rows))
    verb = command.verb.__name__
    if verb in up.__all__:
        parts.append(f"From Python: [`up.{verb}`](../api/{verb}.md).")
    return "\n\n".join(parts) + "\n"


def _usage(parameter: Any) -> str:
    word = parameter.metavar or parameter.name.upper()
    word = f"{word}..." if parameter.nargs == -1 and not word.endswith("...") else word
    return word if parameter.required else f"[{word}]"


def _row(parameter: Any) -> str:
    """A definition: what is typed, then what it means."""
    if parameter.param_type_name == "argument":
        typed = f"`{_usage(parameter)}`"
    else:
        value = "" if parameter.is_flag else " " + (parameter.metavar or parameter.name.upper())
        words = [*parameter.opts, *parameter.secondary_opts]
        typed = ", ".join(f"`{word}{value}`" for word in words)
    default = parameter.default
    shown = (
        default not in (None, False, (), [], "")
        and not callable(default)
        and parameter.param_type_name == "option"
    )
    tail = f" Default: `{default}`." if shown and not parameter.is_flag else ""
    repeated = " May be repeated." if getattr(parameter, "multiple", False) else ""
    return f"{typed}\n: {_text(parameter.help or 'See above.')}{repeated}{tail}"


def _text(text: str) -> str:
    """Help as Markdown: rich's escapes undone, HTML's kept from being read."""
    plain = text.replace("\\[", "[").replace("``", "`")
    return re.sub(r"(`[^`]*`)|([<>*_\[\]$|~])", lambda m: m[1] or "\\" + m[2], plain)


def _write(folder: Path, title: str, intro: str, sections: dict[str, dict[str, str]]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    index = [f"# {title}\n\n{intro}"]
    for section, pages in sections.items():
        for name, text in pages.items():
            (folder / f"{name}.md").write_text(text, encoding="utf-8")
        index.append(
            f"## {section}\n\n```{{toctree}}\n:maxdepth: 1\n\n" + "\n".join(pages) + "\n```\n"
        )
    (folder / "index.md").write_text("\n".join(index), encoding="utf-8")
