"""Poles in the s-plane, loci and the frequency response of a loop as charts, each value under the cursor."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from upright.gains.margins import Margins, Response
from upright.gains.requests import Roots, matched
from upright.identification.model.fit import Estimate, Pole
from upright.records import Array
from upright.report.interactive.charts import Chart, ChartLine, ChartPanel
from upright.report.symbols import number

_SAMPLES = 240


@dataclass(frozen=True, kw_only=True)
class Poles:
    """Poles [1/s] of one kind with their mark: ``x`` open loop, ``o`` requested, ``+`` attained."""

    name: str
    values: Roots
    mark: str
    colour: str = "ink"


def upper(values: Roots) -> Roots:
    """Poles of the upper half plane, which the lower one mirrors."""
    return values[values.imag > -1e-9 * np.maximum(1.0, np.abs(values))]


def _line(poles: Poles) -> ChartLine:
    values = upper(poles.values)
    return ChartLine(name=poles.name, x=values.real, y=np.abs(values.imag), mark=poles.mark, colour=poles.colour)


def _plane(
    panels: Mapping[str, Sequence[ChartLine]], left: float, right: float, high: float, *, height: float = 240.0
) -> Chart:
    """Upper half planes one below the other, each with what stands above its ordinate, and how many poles they miss."""
    points = [line for lines in panels.values() for line in lines if line.mark and line.read]
    beyond = sum(int(np.sum((line.x < left) | (line.x > right) | (line.y > high))) for line in points)
    note = f"; {beyond} outside the picture" if beyond else ""
    shown = tuple(
        ChartPanel(title=title, unit="rad/s", lines=tuple(lines), limits=(-0.06 * high, high), height=height)
        for title, lines in panels.items()
    )
    return Chart(x="real part", unit="1/s", note=note, panels=shown, limits=(left, right), plane="s")


def pole_chart(kinds: Sequence[Poles], cloud: Roots | None = None, *, cloud_of: str = "", frame: int = 2) -> Chart:
    """Poles in the upper half of the s-plane; `cloud` are those of the rigs that a fit allows.

    The view holds the first `frame` kinds; how many poles of the others lie outside is written below.
    """
    framed = np.concatenate([upper(k.values) for k in kinds[:frame]])
    lines = [_line(k) for k in kinds]
    if cloud is not None and cloud.size:
        dots = upper(cloud)
        lines.insert(0, ChartLine(name=cloud_of, x=dots.real, y=dots.imag, mark=".", colour="q1", read=False))
    return _plane({"imaginary part": lines}, *_view(framed))


def _view(shown: Roots) -> tuple[float, float, float]:
    """Least and greatest real part, and greatest imaginary part, of a plane that holds these poles."""
    left, right = 1.2 * float(min(shown.real.min(), -1.0)), 1.3 * float(max(shown.real.max(), 0.0))
    right = max(right, -0.12 * left)
    return left, right, max(1.25 * float(shown.imag.max()), 0.2 * (right - left))


def fitted_poles_chart(fitted: Mapping[str, Sequence[Pole]]) -> Chart:
    """Poles of a fitted rig at each equilibrium, with bars for the 95 % intervals of real and imaginary part."""
    lines: list[ChartLine] = []
    for (at, poles), mark, colour in zip(fitted.items(), "xosD^+" * 4, ("q0", "q1", "q2", "q3") * 6, strict=False):
        values: Roots = np.array([complex(p.real.value, p.imag.value) for p in poles])
        ends = [np.array([_ends(e) for e in part]).T for part in ([p.real for p in poles], [p.imag for p in poles])]
        notes = tuple(
            p.real.status
            if p.real.rests_on
            else f"95 % {number(p.real.interval[0], 3)} to {number(p.real.interval[1], 3)} 1/s"
            + (f", ± {number(p.imag.interval[0], 3)} to {number(p.imag.interval[1], 3)} rad/s" if p.imag.value else "")
            for p in poles
        )
        lines.append(
            ChartLine(name=at, x=values.real, y=values.imag, mark=mark, colour=colour, notes=notes,
                 across=(ends[0][0], ends[0][1]), bars=(ends[1][0], ends[1][1]))
        )  # fmt: skip
    every = np.concatenate([line.x + 1j * line.y for line in lines]).astype(np.complex128)
    return _plane({"imaginary part": lines}, *_view(every))


def _ends(e: Estimate) -> tuple[float, float]:
    """Of the interval; none where the pole rests on assumed numbers."""
    return (e.value, e.value) if e.rests_on else e.interval


def pole_panels(sets: Mapping[str, Sequence[Poles]], left: float, right: float, high: float) -> Chart:
    """Several sets of poles one below the other, in one scale."""
    return _plane({title: [_line(k) for k in kinds] for title, kinds in sets.items()}, left, right, high, height=110.0)


def track_lines(tracks: Roots, weights: Array, *, of: str, symbol: str) -> list[ChartLine]:
    """Poles as one number changes, shape (N, n); the cursor tells the number, `weights`, as `symbol`."""
    lines: list[ChartLine] = []
    notes = tuple(f"{symbol} {number(w, 3)}" for w in weights.tolist())
    rows = [tracks[0]]
    for row in tracks[1:]:
        rows.append(matched(rows[-1], row))
    for i, track in enumerate(np.array(rows).T):
        above = track.imag > -1e-9 * np.maximum(1.0, np.abs(track))
        y = np.where(above, np.abs(track.imag), np.nan)
        lines.append(ChartLine(name=of if i == 0 else "", x=track.real, y=y, colour="q0", notes=notes))
    return lines


def locus_chart(
    tracks: Roots, weights: Array, sets: Mapping[str, Roots], open_loop: Roots, *, of: str, symbol: str,
    origin: str = "open loop",
) -> Chart:  # fmt: skip
    """Poles as one number changes, shape (N, n), with up to four named sets of poles on them; see `track_lines`."""
    lines = track_lines(tracks, weights, of=of, symbol=symbol)
    lines.append(_line(Poles(name=origin, values=open_loop, mark="x", colour="ink-2")))
    lines += [
        _line(Poles(name=n, values=p, mark=m, colour="q1")) for (n, p), m in zip(sets.items(), "osD^", strict=False)
    ]
    every = upper(np.concatenate([*sets.values(), open_loop]))
    wide = float(np.ptp(every.real)) or float(np.abs(every).max()) or 1.0
    high = max(1.15 * float(every.imag.max()), 0.1 * wide)
    left, right = float(every.real.min()) - 0.1 * wide, max(float(every.real.max()), 0.0) + 0.1 * wide
    return _plane({"imaginary part": lines}, left, right, high)


@dataclass(frozen=True, kw_only=True, eq=False)
class RootLocus:
    """Poles [1/s] as a gain rises, shape (gains, states), with the poles at one marked gain, and the zeros."""

    title: str
    gains: Array
    tracks: Roots
    marked: Roots
    zeros: Roots


def loci_chart(loci: Sequence[RootLocus], open_loop: Roots, *, of: str, symbol: str, marked: str) -> Chart:
    """Root loci one below the other, in one scale."""
    size = 1.5 * float(np.abs(open_loop).max())
    panels = {
        locus.title: [
            *track_lines(locus.tracks, locus.gains, of=of, symbol=symbol),
            _line(Poles(name="open loop", values=open_loop, mark="x")),
            _line(Poles(name="zero", values=locus.zeros, mark="o")),
            _line(Poles(name=marked, values=locus.marked, mark="s", colour="q1")),
        ]
        for locus in loci
    }
    return _plane(panels, -size, 0.6 * size, size, height=170.0)


def loop_chart(loop: Response, margins: Margins, period: float) -> Chart:
    """Magnitude and phase of a sampled loop gain nearly up to half the sampling rate, its crossings marked.

    Dashed where the gain is 1, with the phase left to ±180 degrees, and where the phase is ±180 degrees, with the
    factor that the gain bears there.
    """
    crossed = [w for w, _ in (*margins.gain_crossings, *margins.phase_crossings) if w > 0]
    highest = 0.9 * math.pi / period  # at half the rate the delay of the holds cuts it to nothing
    lowest = max(min(crossed, default=highest / 100) / 8, highest * 1e-6)
    w = np.geomspace(lowest, min(highest, 40 * max(crossed, default=highest / 100)), _SAMPLES)
    response = loop.at(w * period)
    phase = np.degrees(np.unwrap(np.angle(response)))
    at = float(np.interp(math.log(min(crossed, default=w[0])), np.log(w), phase))
    phase -= 360.0 * round((at + 180.0) / 360.0)
    gains = tuple((x, f"{number(abs(math.degrees(p)), 3)}°") for x, p in margins.gain_crossings)
    turns = tuple((x, f"× {number(k, 3)}") for x, k in margins.phase_crossings if w[0] <= x <= w[-1])
    decibel = 20 * np.log10(np.maximum(np.abs(response), 1e-12))
    low, high = float(phase.min()), float(phase.max())
    return Chart(
        x="frequency", unit="rad/s", logarithmic=True, limits=(float(w[0]), float(w[-1])),
        panels=(
            ChartPanel(title="magnitude of the loop", unit="dB", levels=((0.0, ""),), places=turns,
                  lines=(ChartLine(name="", x=w, y=decibel, colour="ink"),)),
            ChartPanel(title="phase of the loop", unit="deg", step=90.0 if high - low > 200 else 45.0, places=gains,
                  levels=tuple((float(v), "") for v in range(-900, 901, 360) if low - 5 <= v <= high + 5),
                  lines=(ChartLine(name="", x=w, y=phase, colour="ink"),)),
        ),
    )  # fmt: skip
