"""A dot plot of a benchmark's table, drawn from its page: a picture that says what the table says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from upright.report.drawing import CYCLE, GREY, figure, save, styled

_NUMBER = r"([\d.]+)"
_MARKS = "osD^"


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Where in a row a number is: which cell after the name, and the pattern of the number, or of it and its range."""

    at: int = 0
    pattern: str = _NUMBER

    def of(self, cells: Sequence[str]) -> list[tuple[float, float, float]]:
        """Every such number with the ends of its range, itself where it has none."""
        matches = re.finditer(self.pattern, cells[self.at])
        return [tuple(float(n) for n in (m.groups() * 3)[:3]) for m in matches]


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
    log : bool
        Whether the axis is logarithmic.
    """

    label: str
    series: Mapping[str, Cell]
    targets: Mapping[str, float | Cell] = field(default_factory=dict)
    of: Cell | None = None
    named: int = 1
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
    "dying": Shown(
        label="command on after the death [ms]",
        series={"longest": Cell()},
        targets={"bound": Cell(at=1)},
        named=2,
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
        label="of runs that no fit has seen, explained [%]",
        series={"uw, tail": Cell(), "aau, tail": Cell(at=1), "aau, restarted": Cell(at=2)},
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
"""What is drawn of the first table of each page; other pages have a picture already, or nothing that dots would show."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """What a row says: measured, with ranges, and targets."""

    name: str
    measured: Mapping[str, Sequence[tuple[float, float, float]]]
    targets: Mapping[str, float]


def rows(page: str, shown: Shown) -> list[Row]:
    """Rows of the first table of a page that have something to draw."""
    lines = page.split("\n")
    begin = next(i for i, line in enumerate(lines) if re.fullmatch(r"\|[-:| ]+\|", line)) + 1
    end = next(i for i, line in enumerate([*lines[begin:], ""], begin) if not line.startswith("|"))
    out: list[Row] = []
    for line in lines[begin:end]:
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        rest = cells[shown.named :]
        measured = {name: cell.of(rest) for name, cell in shown.series.items()}
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
        if any(measured.values()):
            out.append(
                Row(name=", ".join(cells[: shown.named]), measured=measured, targets=targets)
            )
    return out


@styled
def draw(table: Sequence[Row], shown: Shown, path: Path) -> None:
    """Write the picture of the rows of a table."""
    drawing = figure(0.9 + 0.2 * len(table))
    ax = drawing.subplots()
    for (name, _), (colour, _), mark in zip(shown.series.items(), CYCLE, _MARKS, strict=False):
        dots = [(x, y) for y, row in enumerate(table) for x in row.measured[name]]
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
    before, head, after = re.split(r"(?m)^(\|.*\n\|[-:| ]+\|)$", page, maxsplit=1)
    alt = f"Dots for {len(table)} rows of the table below: {shown.label}"
    return f"{before}![{alt}]({folder.name}/{name}.svg)\n\n{head}{after}"
