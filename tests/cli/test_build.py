"""Does a verb's signature become the command that it describes: arguments, options, defaults, ranges, exit codes?"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from upright.cli.build import build
from upright.report.page import Chapter
from upright.verbs.answer import Answer
from upright.verbs.command import Flag, command, command_of

SEEN: dict[str, Any] = {}


@command(
    "Log",
    metavars={"log": "LOG"},
    ranges={"every": (1, 4)},
    hidden=("secret",),
    flags={"strict": Flag(help="Be strict."), "keys": Flag(help="Print keys.", prints=lambda: "all the keys")},
    prepare=lambda typed: {**typed, "secret": 7},
    wrong=lambda answer, strict, keys: strict and answer.numbers["every"] == 3,
)
def weigh(
    log: Path, *, every: int = 2, share: float = 0.5, named: str = "", check: bool = True, fast: bool = False,
    texts: Sequence[str] | str = (), counts: Mapping[str, float] | None = None, secret: int = 0, seed: int = 0,
    limit: float | None = None, progress: Callable[[str, float], None] = lambda step, share: None,
) -> Answer[int]:  # fmt: skip
    """Weigh a log.

    So that ``it`` is known.

    Parameters
    ----------
    log : path
        What to weigh.
    every : int
        How many [of them].
    share, named, check, fast, texts, counts, secret, seed, limit, progress
        As they are.
    """
    SEEN.update(log=log, every=every, share=share, named=named, check=check, fast=fast, texts=texts, counts=counts,
                secret=secret, seed=seed, limit=limit, progress=progress)  # fmt: skip
    return Answer(every, Chapter(title="T", verdict=f"It is {every}.", numbers={"every": every}))


def typed(*words: str):
    SEEN.clear()
    return CliRunner().invoke(build(command_of(weigh)), list(words))


def test_what_is_left_out_is_what_the_verb_has_by_itself():
    done = typed("a.csv")
    assert (done.exit_code, "It is 2." in done.stdout) == (0, True)
    told = {n: v for n, v in SEEN.items() if n != "progress"}
    assert told == {
        "log": Path("a.csv"), "every": 2, "share": 0.5, "named": "", "check": True, "fast": False, "texts": (),
        "counts": None, "secret": 7, "seed": 0, "limit": None,
    }  # fmt: skip
    assert callable(SEEN["progress"])


def test_each_option_reaches_the_verb_as_its_kind():
    words = "a.csv --every 4 --share 0.25 --named x --no-check --fast --texts a --texts b --counts x=1 --counts y=2"
    assert typed(*words.split(), "--limit", "3", "--seed", "5").exit_code == 0
    assert (SEEN["every"], SEEN["share"], SEEN["named"], SEEN["check"], SEEN["fast"]) == (4, 0.25, "x", False, True)
    assert (SEEN["texts"], SEEN["counts"]) == (["a", "b"], {"x": "1", "y": "2"})
    assert (SEEN["limit"], SEEN["seed"]) == (3.0, 5)


def test_numbers_are_printed_as_json():
    assert json.loads(typed("a.csv", "--every", "3", "--json").stdout) == {"every": 3}


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("--every", "1"), 0), (("--every", "0"), 2), (("--every", "5"), 2), (("--seed", "-1"), 2),
        (("--every", "x"), 2),
        (("--secret", "1"), 2), (("--every", "3"), 0), (("--every", "3", "--strict"), 3), (("--strict",), 0),
        (("--progress", "x"), 2),
    ],
)  # fmt: skip
def test_ranges_and_what_is_wrong_end_with_their_codes(words, code):
    assert typed("a.csv", *words).exit_code == code


def test_a_flag_that_prints_does_only_that():
    done = typed("--keys")
    assert (done.exit_code, done.stdout, SEEN) == (0, "all the keys\n", {})


def test_help_is_the_docstring_without_its_backticks():
    text = " ".join(typed("--help").stdout.split())
    assert "Weigh a log." in text
    assert "So that it is known." in text
    assert "How many [of them]." in text
    assert "LOG" in text
    assert "--no-check" in text
    assert "--secret" not in text


def test_a_verb_that_was_interrupted_says_so_by_its_code():
    @command("Log")
    def stopped() -> Any:
        """Stop."""
        return type("Stopped", (), {"interrupted": True})()

    assert CliRunner().invoke(build(command_of(stopped)), []).exit_code == 130
