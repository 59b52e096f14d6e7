"""A dot plot of a benchmark's table, drawn from its page: a picture that says what the table says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from upright.report.drawing import CYCLE, GREY, figure, save, styled

_NUMBER = r"([\d.]+)"
_AFTER = rf"{_NUMBER} s, {_NUMBER}"
_POSITIVE = rf"(?:^|/ ){_NUMBER}"
_MARKS = "osD^"
_APART = 0.2
"""Between two series of one row, so that neither hides the other [rows]."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Where in a row a number is.

    Attributes
    ----------
    at : int
        Which cell after the name.
    pattern : str
        Of the number, or of it and its range.
    table : int
        Which table of the page.
    whole : str
        Of what of which that is a share: percents are drawn.
    where : str
        What the row must hold, its name included; every row does by itself.
    """

    at: int = 0
    pattern: str = _NUMBER
    table: int = 0
    whole: str = ""
    where: str = ""

    def of(self, cells: Sequence[str]) -> list[tuple[float, float, float]]:
        """Every such number with the ends of its range, itself where it has none."""
        matches = re.finditer(self.pattern, cells[self.at])
        most = re.search(self.whole, cells[self.at]) if self.whole else None
        unit = 100 / float(most[1]) if most else 1.0
        return [tuple(unit * float(n) for n in (m.groups() * 3)[:3]) for m in matches]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What of a table is drawn.

    Attributes
    ----------
    label : str
        Axis, with its unit.
    series : mapping of str to Cell
        What is measured, by its name; the only one needs none.
    targets : mapping of str to float or Cell
        What it is to be, the same for all rows or a number in each.
    of : Cell or None
        All of which these are some, where a row counts: a share [%] is drawn.
    named : int
        Cells that make the name of a row.
    kinds : sequence of (str, str)
        Patterns and names of kinds of rows: all rows of a kind are one, by the first pattern that they match.
    log : bool
        Whether the axis is logarithmic.
    """

    label: str
    series: Mapping[str, Cell]
    targets: Mapping[str, float | Cell] = field(default_factory=dict)
    of: Cell | None = None
    named: int = 1
    kinds: Sequence[tuple[str, str]] = ()
    log: bool = False


HELD = Shown(
    label="95 % intervals that hold the truth [%]",
    series={"": Cell(pattern=rf"{_NUMBER} % of \d+ intervals")},
    targets={"nominal": 95.0},
)
SHOWN: Mapping[str, Shown] = {
    "agree": Shown(
        label="pairs of halves that agree within their intervals [%]",
        series={"": Cell(pattern=rf"{_NUMBER} %; median")},
    ),
    "bands": Shown(
        label="unseen samples inside 90 % bands [%]",
        series={"": Cell(pattern=rf"{_NUMBER} % inside")},
        targets={"nominal": 90.0},
    ),
    "crash": Shown(
        label="read again, of all logs, or of all rows reported as written [%]",
        series={
            "logs, or rows": Cell(
                at=1,
                pattern=r"(?:readable |rows from |, read )(\d+)",
                whole=r"(?:^|readable \d+ of |rows reported as written )(\d+)(?: files|;|,)",
            ),
            "rows of a log, median": Cell(at=1, pattern=r"rows kept (\d+) %"),
        },
    ),
    "dying": Shown(
        label="command on after the death [ms]",
        series={"longest": Cell()},
        targets={"bound": Cell(at=1)},
        named=2,
    ),
    "false_stops": Shown(
        label="from the fault to the stop, median and nine tenths [s]",
        series={
            "Furuta pendulum": Cell(at=4, pattern=_AFTER, table=1),
            "pendulum on a cart": Cell(at=4, pattern=_AFTER, table=2),
        },
        log=True,
    ),
    "first": Shown(
        label="contacts that end with a trusted fit [%]",
        series={"": Cell(pattern=rf"{_NUMBER} trusted")},
        of=Cell(pattern=rf"{_NUMBER} contacts"),
    ),
    "gym": Shown(
        label="million steps a second, with quartiles",
        series={"": Cell(pattern=rf"{_NUMBER} \({_NUMBER} to {_NUMBER}\)")},
        log=True,
    ),
    "jitter": Shown(
        label="ticks late by [µs]",
        series={"99 %": Cell(at=2), "99.9 %": Cell(at=3), "the latest": Cell(at=4)},
        named=2,
        log=True,
    ),
    "kept": Shown(
        label="logs of which nine tenths of what moves are kept [%]",
        series={"": Cell(pattern=rf"\({_NUMBER} %\)")},
        targets={"target": 95.0},
    ),
    "misfit": HELD,
    "mutants": Shown(
        label="changes to the code that tests notice [%], with 95 % interval",
        series={"": Cell(pattern=rf"{_NUMBER} % \({_NUMBER} to {_NUMBER}\)")},
        targets={"target": 90.0},
    ),
    "peers": Shown(
        label="of runs that no fit has seen, explained, where that is above 0 [%]",
        series={
            "uw, tail": Cell(pattern=_POSITIVE),
            "aau, tail": Cell(at=1, pattern=_POSITIVE),
            "aau, restarted": Cell(at=2, pattern=_POSITIVE),
            "macstepien": Cell(at=3, pattern=_POSITIVE),
        },
    ),
    "quick_lab": Shown(
        label="farthest that the driven body went, of its travel [%]",
        series={
            "Furuta pendulum": Cell(at=2, where=r"^furuta .*\| yes$"),
            "pendulum on a cart": Cell(at=2, where=r"^linear .*\| yes$"),
            "not right": Cell(at=2, where=r"\*\*no\*\*$"),
        },
        targets={"end of the travel": 100.0},
        kinds=(
            (r"^\S+ \d+ \| none", "no fault"),
            (r"^\S+ \d+ \| [^|]*,", "two faults"),
            (r"drive × -1 ", "motor leads swapped"),
            (r"drive × -", "leads swapped, weak supply"),
            (r"drive × ", "weak supply"),
            (r"× -1 ", "encoder's channels swapped"),
            (r"× 1.024 ", "counts 2.4 % off"),
            (r"× -", "channels swapped, wrong counts"),
            (r"× ", "wrong counts"),
        ),
    ),
    "real": Shown(
        label="explained, run by run [%]",
        series={"reached": Cell(at=1)},
        targets={"target": Cell(at=2)},
        named=2,
    ),
    "rigs": HELD,
    "safety": Shown(
        label="command zero after the fault [ms]",
        series={"": Cell(at=1, pattern=rf"^{_NUMBER} ms")},
        log=True,
    ),
    "soak": Shown(
        label="longest time from fault to stop [ms]",
        series={"": Cell(pattern=rf"at most {_NUMBER} ms later")},
        log=True,
    ),
    "starts": Shown(
        label="starts that end at the lowest cost [%]",
        series={"": Cell(pattern=rf"\({_NUMBER} %; asked")},
        targets={"target": 95.0},
    ),
    "strangers": Shown(
        label="runs held on a simulator that shares no code [%]",
        series={"": Cell(pattern=rf"times of 12, {_NUMBER} of")},
        of=Cell(pattern=rf"times of 12, \d+ of {_NUMBER} runs"),
    ),
    "verdicts": Shown(
        label="verdicts that were wrong [%]",
        series={
            "“yes”": Cell(pattern=rf"wrong yes {_NUMBER} %"),
            "“no”": Cell(pattern=rf"wrong no {_NUMBER} %"),
        },
        targets={"“yes”, at most": 5.0, "“no”, at most": 15.0},
    ),
    "workers": Shown(
        label="times as fast as one process",
        series={"": Cell(at=1, pattern=rf"{_NUMBER} times as fast")},
        targets={"target": 1.8},
    ),
}
"""What is drawn of the tables of each page; other pages have a picture already, or nothing that dots would show."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """What a row says: measured, with ranges, and targets."""

    name: str
    measured: Mapping[str, Sequence[tuple[float, float, float]]]
    targets: Mapping[str, float]


def rows(page: str, shown: Shown) -> list[Row]:
    """Rows that have something to draw: of the first table of a page, or of those that its cells name."""
    tables = _tables(page)
    used = sorted({cell.table for cell in shown.series.values()})
    merged = bool(shown.kinds) or used != [0]
    out: dict[str | int, Row] = {}
    for number in used:
        for line in tables[number][1]:
            row = _row(line, number, shown)
            if not any(row.measured.values()):
                continue
            key = row.name if merged else len(out)
            if key in out:
                so_far = out[key].measured
                both = {name: [*so_far[name], *more] for name, more in row.measured.items()}
                row = Row(name=row.name, measured=both, targets=row.targets)
            out[key] = row
    order = [name for _, name in shown.kinds]
    return (
        sorted(out.values(), key=lambda row: order.index(row.name)) if order else list(out.values())
    )


def _tables(page: str) -> list[tuple[int, list[str]]]:
    """Number of the line above which a table's rule stands, and the lines below that, of each table."""
    lines = page.split("\n")
    rules = [i for i, line in enumerate(lines) if re.fullmatch(r"\|[-:| ]+\|", line)]
    ends = [
        next(i for i, line in enumerate([*lines[r + 1 :], ""], r + 1) if not line.startswith("|"))
        for r in rules
    ]
    return [(r - 1, lines[r + 1 : end]) for r, end in zip(rules, ends, strict=True)]


def _row(line: str, table: int, shown: Shown) -> Row:
    """What a line of a table says."""
    text = line.strip().strip("|").strip()
    cells = [cell.strip() for cell in text.split("|")]
    rest = cells[shown.named :]
    measured = {
        name: cell.of(rest) if cell.table == table and re.search(cell.where, text) else []
        for name, cell in shown.series.items()
    }
    if shown.of is not None:
        most = shown.of.of(rest)
        measured = {
            name: [tuple(100 * n / most[0][0] for n in each) for each in numbers if most]
            for name, numbers in measured.items()
        }
    targets: dict[str, float] = {}
    for name, target in shown.targets.items():
        numbers = target.of(rest) if isinstance(target, Cell) else [(target, target, target)]
        targets |= {name: numbers[0][0]} if numbers else {}
    kind = next((name for pattern, name in shown.kinds if re.search(pattern, text)), "")
    return Row(name=kind or ", ".join(cells[: shown.named]), measured=measured, targets=targets)


@styled
def draw(table: Sequence[Row], shown: Shown, path: Path) -> None:
    """Write the picture of the rows of a table."""
    drawing = figure(0.9 + 0.2 * len(table))
    ax = drawing.subplots()
    apart = _APART * (np.arange(len(shown.series)) - (len(shown.series) - 1) / 2)
    for (name, _), (colour, _), mark, off in zip(
        shown.series.items(), CYCLE, _MARKS, apart.tolist(), strict=False
    ):
        dots = [(x, y + off) for y, row in enumerate(table) for x in row.measured[name]]
        for (_, low, high), y in dots:
            ax.plot([low, high], [y, y], color=colour, linewidth=1.0)
        ax.plot(
            [x[0] for x, _ in dots], [y for _, y in dots], mark, color=colour, markersize=4.5, clip_on=False,
            label=name or "_",
        )  # fmt: skip
    for (name, target), (_, dashes) in zip(shown.targets.items(), CYCLE, strict=False):
        if isinstance(target, Cell):
            at = [(row.targets[name], y) for y, row in enumerate(table) if name in row.targets]
            ax.plot(
                [x for x, _ in at],
                [y for _, y in at],
                "|",
                color=GREY,
                markersize=9,
                mew=1.6,
                label=name,
            )
        else:
            ax.axvline(
                target, color=GREY, linewidth=1.2, linestyle=dashes, label=f"{name}: {target:g}"
            )
    ax.set_xlabel(shown.label)
    ax.set_yticks(range(len(table)), [row.name for row in table])
    ax.set_ylim(len(table) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    if shown.log:
        ax.set_xscale("symlog", linthresh=min(1.0, _least(table)))
        ax.margins(x=0.03)
    ax.set_xlim(left=0)
    if ax.get_legend_handles_labels()[1]:
        drawing.legend(loc="outside upper right", ncols=4)
    save(drawing, path)


def _least(table: Sequence[Row]) -> float:
    """The least number that is not 0: a logarithmic axis goes from there, and evenly down to 0."""
    return min(x[0] for row in table for xs in row.measured.values() for x in xs if x[0] > 0)


def with_picture(name: str, page: str, folder: Path) -> str:
    """The page of a benchmark with a picture above its first table, written into a folder beside it."""
    shown = SHOWN.get(name)
    table = [] if shown is None else rows(page, shown)
    if shown is None or not table:
        return page
    folder.mkdir(parents=True, exist_ok=True)
    draw(table, shown, folder / f"{name}.svg")
    alt = f"Dots for {len(table)} rows of the table below: {shown.label}"
    if shown.kinds:
        alt = f"Dots for {len(table)} kinds of rows of the table below: {shown.label}"
    lines = page.split("\n")
    above = _tables(page)[min(cell.table for cell in shown.series.values())][0]
    return "\n".join([*lines[:above], f"![{alt}]({folder.name}/{name}.svg)", "", *lines[above:]])
