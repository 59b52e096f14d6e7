"""Does every benchmark's page open as its generator writes it, with a headline that says what its table says?"""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import (
    agree,
    bands,
    crash,
    dying,
    false_stops,
    first,
    gym,
    jitter,
    kept,
    measure,
    misfit,
    mutants,
    peers,
    quick_lab,
    real,
    regulation,
    rigs,
    safety,
    soak,
    starts,
    strangers,
    verdicts,
    workers,
)
from benchmarks.__main__ import PUBLISHED
from benchmarks.measure import Line

FOLDER = Path(measure.__file__).parent


class Page:
    """A published page: its text, and its tables as rows of cells."""

    def __init__(self, name: str) -> None:
        self.text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
        self.rows = [
            [cell.strip() for cell in row[1:-1].split("|")] for row in self.text.splitlines() if row.startswith("| ")
        ]

    @property
    def lines(self) -> list[Line]:
        """Rows of a name and a note."""
        return [Line(contender=row[0], note=row[1]) for row in self.rows if len(row) == 2 and row[0]]

    def section(self, title: str) -> list[list[str]]:
        """Rows below a heading that begins so, the table's own heading left out."""
        part = self.text.split(f"\n## {title}")[1].split("\n## ")[0]
        rows = [row for row in part.splitlines() if row.startswith("|")]
        return [[cell.strip() for cell in row[1:-1].split("|")] for row in rows[2:]]

    def numbers(self, pattern: str) -> list[float]:
        """The groups of the first match, as numbers."""
        match = re.search(pattern, self.text)
        assert match is not None, pattern
        return [float(group) for group in match.groups()]


def of_safety(page: Page) -> str:
    cases = [row for row in page.rows if len(row) == 6 and row[0] != "hazard" and row[1] != "left out"]
    return safety.headline(sum("not as required" not in row[1] for row in cases), len(cases))


def of_dying(page: Page) -> str:
    cases = [row for row in page.rows if len(row) == 5 and row[2].isdigit()]
    return dying.headline(sum("**missed**" not in row[4] for row in cases), len(cases))


def of_crash(page: Page) -> str:
    damaged = [row for row in page.rows if row[0].startswith(("file cut", "one random", "disk full"))]
    wrong = sum(int(re.findall(r"wrong(?: rows)? (\d+)", row[2])[0]) for row in damaged)
    return crash.headline(page.rows[1][1], wrong)


def of_false_stops(page: Page) -> str:
    played = page.section("Nothing broken")
    return false_stops.headline(sum(int(row[2]) for row in played), sum(float(row[1]) for row in played))


def of_jitter(page: Page) -> str:
    row = page.rows[1]
    late, due = (int(n) for n in row[2].split(" of "))
    return jitter.headline(late, due, float(row[0].split()[0]), row[1], 1e-6 * float(row[6].split()[0]))


def of_strangers(page: Page) -> str:
    rigs = [row for row in page.rows if re.fullmatch(r"(furuta|cart) \d+", row[0])]
    trusted = [row for row in rigs if row[1] == "yes"]
    return strangers.headline(len(trusted), len(rigs), sum(len({*row[3].split(" of ")}) == 1 for row in trusted))


def of_quick_lab(page: Page) -> str:
    twins = [row for row in page.rows if re.fullmatch(r"(furuta|linear) \d+", row[0])]
    beyond = sum(float(row[3].rstrip("%")) > 100 for row in twins)
    return quick_lab.headline(sum(row[4] == "yes" for row in twins), len(twins), beyond)


def of_first(page: Page) -> str:
    logs = [row for row in page.rows if len(row) == 7 and row[0] != "log"]
    usable, wrong = page.numbers(r"\| all \| .*?(\d+) usable numbers, (\d+) of them wrong")
    same, every = page.numbers(r"\| dialects \| (\d+) of (\d+) logs")
    assert wrong == sum(row[6].count("**") // 2 for row in logs)
    trusted = sum(row[3] == "trusted" for row in logs)
    return first.headline(trusted, len(logs), int(usable), int(wrong), int(same), int(every))


def of_gym(page: Page) -> str:
    rates = {row[0]: (float(row[1].split()[0]), float(row[2].split()[0])) for row in page.rows if row[0]}
    return gym.headline(rates)


def of_agree(page: Page) -> str:
    counts = [(line.contender, re.match(r"(\d+) of (\d+) pairs", line.note)) for line in page.lines]
    return agree.headline({name: (int(m[1]), int(m[2])) for name, m in counts if m})


def of_real(page: Page) -> str:
    asked = [row for row in page.rows if len(row) == 6 and row[0] != "study"]
    seconds = [float(row[1]) for row in page.rows if len(row) == 3 and row[0] != "study"]
    return real.headline(sum("missed" not in row[5] for row in asked), len(asked), seconds)


def of_regulation(page: Page) -> str:
    rows = dict(row[:2] for row in page.section("500 twins identified by steps") if len(row) == 2)
    (share,) = (float(found[1]) for name in rows if (found := re.search(r"always predicting ([\d.]+) %", name)))
    (predicted,) = (float(found[1]) for name in rows if (found := re.search(r"of ([\d.]+) predicted", name)))
    brier, expected = float(rows["Brier score"]), float(rows["the same if the probabilities are right"])
    return regulation.headline(500, share / 100, predicted / 500, brier, expected)


def of_kept(page: Page) -> str:
    kept_, drafts = page.numbers(r"\| all \| (\d+) of (\d+) keep")
    return kept.headline(int(kept_), int(drafts), *page.numbers(r"intervals of trusted fits \| \d+ fits; ([\d.]+) %"))


def of_workers(page: Page) -> str:
    return workers.headline(*(page.numbers(rf"\| {name}, two processes \|.*?([\d.]+) times")[0]
                              for name in ("closed loops", "fits")))  # fmt: skip


HEADLINES: dict[str, Callable[[Page], str]] = {
    "agree": of_agree, "bands": lambda page: bands.headline(page.lines), "crash": of_crash, "dying": of_dying,
    "false_stops": of_false_stops, "first": of_first, "gym": of_gym, "jitter": of_jitter, "kept": of_kept,
    "misfit": lambda page: misfit.headline(page.lines), "quick_lab": of_quick_lab,
    "peers": lambda page: peers.headline(peers.lines_in(page.text)),
    "mutants": lambda page: mutants.headline([replace(x, contender=x.contender + mutants.NOT) for x in page.lines]),
    "real": of_real, "regulation": of_regulation, "rigs": lambda page: rigs.headline(page.lines), "safety": of_safety,
    "soak": lambda page: soak.headline(page.lines), "starts": lambda page: starts.headline(page.lines),
    "strangers": of_strangers, "verdicts": lambda page: verdicts.headline(page.lines), "workers": of_workers,
}  # fmt: skip


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_page_opens_as_its_generator_writes_it(name: str) -> None:
    """Title, headline, command and method; the title of a page is free."""
    page = Page(name)
    title = page.text.partition(":")[0].removeprefix("# ")
    needs = "UPRIGHT_REAL_DATA=... " if name in ("agree", "real") else ""
    about = importlib.import_module(f"benchmarks.{name}").__doc__
    opening = measure.page(name, title, about, [], HEADLINES[name](page), needs=needs)
    assert page.text.startswith(opening)
