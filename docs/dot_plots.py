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
class Told:
    """Where in a row something stands: cell behind the row's name, pattern of the number, or of it and its range."""

    cell: int = 0
    pattern: str = _NUMBER

    def of(self, cells: Sequence[str]) -> list[tuple[float, float, float]]:
        """Every such number with the ends of its range, itself where it has none."""
        found = re.finditer(self.pattern, cells[self.cell])
        return [tuple(float(n) for n in (m.groups() * 3)[:3]) for m in found]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What of a table is drawn.

    Attributes
    ----------
    label : str
        Axis, with its unit.
    series : mapping of str to Told
        What is measured, by its name; the only one needs none.
    asked : mapping of str to float or Told
        What it is to be, the same for all rows or told in each.
    of : Told or None
        All of which these are some, where a row counts: a share [%] is drawn.
    named : int
        Cells that make the name of a row.
    log : bool
        Whether the axis is logarithmic.
    """

    label: str
    series: Mapping[str, Told]
    asked: Mapping[str, float | Told] = field(default_factory=dict)
    of: Told | None = None
    named: int = 1
    log: bool = False


HELD = Shown(
    label="95 % intervals that hold the truth [%]",
    series={"": Told(pattern=rf"{_NUMBER} % of \d+ intervals")},
    asked={"promised": 95.0},
)
SHOWN: Mapping[str, Shown] = {
    "agree": Shown(
        label="pairs of halves that agree within their intervals [%]",
        series={"": Told(pattern=rf"{_NUMBER} %; median")},
    ),
    "bands": Shown(
        label="unseen samples inside 90 % bands [%]",
        series={"": Told(pattern=rf"{_NUMBER} % inside")},
        asked={"promised": 90.0},
    ),
    "dying": Shown(
        label="command on after the death [ms]",
        series={"longest": Told()},
        asked={"bound": Told(cell=1)},
        named=2,
    ),
    "first": Shown(
        label="contacts that end with a trusted fit [%]",
        series={"": Told(pattern=rf"{_NUMBER} trusted")},
        of=Told(pattern=rf"{_NUMBER} contacts"),
    ),
    "gym": Shown(
        label="million steps a second, with quartiles",
        series={"": Told(pattern=rf"{_NUMBER} \({_NUMBER} to {_NUMBER}\)")},
        log=True,
    ),
    "jitter": Shown(
        label="ticks late by [µs]",
        series={"99 %": Told(cell=2), "99.9 %": Told(cell=3), "the latest": Told(cell=4)},
        named=2,
        log=True,
    ),
    "kept": Shown(
        label="logs of which nine tenths of what moves are kept [%]",
        series={"": Told(pattern=rf"\({_NUMBER} %\)")},
        asked={"asked": 95.0},
    ),
    "misfit": HELD,
    "mutants": Shown(
        label="changes to the code that tests notice [%], with 95 % interval",
        series={"": Told(pattern=rf"{_NUMBER} % \({_NUMBER} to {_NUMBER}\)")},
        asked={"asked": 90.0},
    ),
    "peers": Shown(
        label="of runs that no fit has seen, explained [%]",
        series={"uw, tail": Told(), "aau, tail": Told(cell=1), "aau, restarted": Told(cell=2)},
    ),
    "real": Shown(
        label="explained, run by run [%]",
        series={"reached": Told(cell=1)},
        asked={"asked": Told(cell=2)},
        named=2,
    ),
    "rigs": HELD,
    "safety": Shown(
        label="command zero after the fault [ms]",
        series={"": Told(cell=1, pattern=rf"^{_NUMBER} ms")},
        log=True,
    ),
    "soak": Shown(
        label="longest time from fault to stop [ms]",
        series={"": Told(pattern=rf"at most {_NUMBER} ms later")},
        log=True,
    ),
    "starts": Shown(
        label="starts that end at the lowest cost [%]",
        series={"": Told(pattern=rf"\({_NUMBER} %; asked")},
        asked={"asked": 95.0},
    ),
    "strangers": Shown(
        label="runs held on a simulator that shares no code [%]",
        series={"": Told(pattern=rf"times of 12, {_NUMBER} of")},
        of=Told(pattern=rf"times of 12, \d+ of {_NUMBER} runs"),
    ),
    "verdicts": Shown(
        label="verdicts that were wrong [%]",
        series={
            "“yes”": Told(pattern=rf"wrong yes {_NUMBER} %"),
            "“no”": Told(pattern=rf"wrong no {_NUMBER} %"),
        },
        asked={"“yes”, at most": 5.0, "“no”, at most": 15.0},
    ),
    "workers": Shown(
        label="times as fast as one process",
        series={"": Told(cell=1, pattern=rf"{_NUMBER} times as fast")},
        asked={"asked": 1.8},
    ),
}
"""What is drawn of the first table of each page; other pages have a picture already, or nothing that dots would show."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """What a row says: measured, with ranges, and asked."""

    name: str
    measured: Mapping[str, Sequence[tuple[float, float, float]]]
    asked: Mapping[str, float]


def rows(page: str, shown: Shown) -> list[Row]:
    """Rows of the first table of a page that have something to draw."""
    lines = page.split("\n")
    begin = next(i for i, line in enumerate(lines) if re.fullmatch(r"\|[-:| ]+\|", line)) + 1
    end = next(i for i, line in enumerate([*lines[begin:], ""], begin) if not line.startswith("|"))
    out: list[Row] = []
    for line in lines[begin:end]:
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        rest = cells[shown.named :]
        measured = {name: told.of(rest) for name, told in shown.series.items()}
        if shown.of is not None:
            most = shown.of.of(rest)
            measured = {
                name: [tuple(100 * n / most[0][0] for n in each) for each in numbers if most]
                for name, numbers in measured.items()
            }
        asked = {
            name: told.of(rest)[0][0] if isinstance(told, Told) else told
            for name, told in shown.asked.items()
            if not isinstance(told, Told) or told.of(rest)
        }
        if any(measured.values()):
            out.append(Row(name=", ".join(cells[: shown.named]), measured=measured, asked=asked))
    return out


@styled
def draw(told: Sequence[Row], shown: Shown, path: Path) -> None:
    """Write the picture of the rows of a table."""
    drawing = figure(0.9 + 0.2 * len(told))
    ax = drawing.subplots()
    for (name, _), (colour, _), mark in zip(shown.series.items(), CYCLE, _MARKS, strict=False):
        dots = [(x, y) for y, row in enumerate(told) for x in row.measured[name]]
        for (_, low, high), y in dots:
            ax.plot([low, high], [y, y], color=colour, linewidth=1.0)
        ax.plot(
            [x[0] for x, _ in dots], [y for _, y in dots], mark, color=colour, markersize=4.5, clip_on=False,
            label=name or "_",
        )  # fmt: skip
    for (name, asked), (_, dashes) in zip(shown.asked.items(), CYCLE, strict=False):
        if isinstance(asked, Told):
            at = [(row.asked[name], y) for y, row in enumerate(told) if name in row.asked]
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
                asked, color=GREY, linewidth=1.2, linestyle=dashes, label=f"{name}: {asked:g}"
            )
    ax.set_xlabel(shown.label)
    ax.set_yticks(range(len(told)), [row.name for row in told])
    ax.set_ylim(len(told) - 0.4, -0.6)
    ax.grid(axis="y", visible=False)
    if shown.log:
        ax.set_xscale("symlog", linthresh=min(1.0, _least(told)))
        ax.margins(x=0.03)
    ax.set_xlim(left=0)
    if ax.get_legend_handles_labels()[1]:
        drawing.legend(loc="outside upper right", ncols=4)
    save(drawing, path)


def _least(told: Sequence[Row]) -> float:
    """The least number that is not 0: a logarithmic axis goes from there, and evenly down to 0."""
    return min(x[0] for row in told for xs in row.measured.values() for x in xs if x[0] > 0)


def with_picture(name: str, page: str, folder: Path) -> str:
    """The page of a benchmark with a picture above its first table, written into a folder beside it."""
    shown = SHOWN.get(name)
    told = [] if shown is None else rows(page, shown)
    if shown is None or not told:
        return page
    folder.mkdir(parents=True, exist_ok=True)
    draw(told, shown, folder / f"{name}.svg")
    head, above, table = re.split(r"(?m)^(\|.*\n\|[-:| ]+\|)$", page, maxsplit=1)
    alt = f"Dots for {len(told)} rows of the table below: {shown.label}"
    return f"{head}![{alt}]({folder.name}/{name}.svg)\n\n{above}{table}"
