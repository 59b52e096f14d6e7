"""What was found wrong with a record, how badly, on which evidence, and what to do about it?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from upright.records import Array

Severity = Literal["fault", "warning", "note"]
SEVERITIES: tuple[Severity, ...] = ("fault", "warning", "note")
"""A fault makes numbers wrong until it is acted on, a warning wants a look, a note costs nothing."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """One curve of a picture: `y` (N,) over `t` (N,) [s]; ``"points"`` are drawn as dots."""

    name: str
    t: Array
    y: Array
    style: Literal["line", "steps", "points"] = "line"


@dataclass(frozen=True, kw_only=True, eq=False)
class Panel:
    """Curves on one axis, labelled with quantity and unit."""

    label: str
    curves: tuple[Curve, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Finding:
    """One thing that looks wrong.

    Attributes
    ----------
    kind : str
        One word of `KINDS`.
    columns : tuple of str
        Columns of the log that it is about.
    sentence : str
        What looks wrong.
    evidence : mapping of str to float
        Numbers it rests on; each name ends with its unit in brackets.
    advice : str
        What to do.
    key : str
        Lines of a study that do it; empty when none does.
    panels : tuple of Panel
        Its picture.
    marks : tuple of float
        Instants [s] to point at.
    spans : tuple of (float, float)
        Spans of time [s] to shade.
    """

    kind: str
    columns: tuple[str, ...]
    severity: Severity
    sentence: str
    evidence: Mapping[str, float] = field(default_factory=dict[str, float])
    advice: str = ""
    key: str = ""
    panels: tuple[Panel, ...] = ()
    marks: tuple[float, ...] = ()
    spans: tuple[tuple[float, float], ...] = ()
    left: float = 0.0
    """What stays unexplained once this is acted on [%], where that was computed."""
    spoils: bool = True
    """Whether so much of the record is touched that equations of motion need not be evaluated."""


KINDS = {
    "sign": "signs: effort against motion, and the sensors against each other",
    "scale": "scales of sensors and effort against the rig's inertias and stiffnesses",
    "dead": "channels that never move",
    "stuck": "channels that freeze",
    "wrap": "counters that wrap",
    "jump": "lost counts",
    "spike": "isolated spikes",
    "effort": "whether the effort column is the effort",
    "trip": "drives that trip silently",
    "saturation": "effort and sensors at their limits",
    "early": "motion before the first command",
    "gap": "gaps in time",
    "jitter": "jitter of the samples",
    "doubled": "doubled rows",
    "clock": "rounding and resets of the clock",
    "creep": "held bodies that creep",
    "drift": "rest positions that drift",
    "self-excited": "oscillations that grow by themselves",
    "copy": "columns that repeat other ones",
    "settings": "settings stored with the log",
}
"""What is looked for, by kind of finding."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Diagnosis:
    """All findings about one record, worst first; what was looked for; what could not be looked for, and why.

    `rig` is how it was described; without a description, `rigs` are the plants whose coordinates its columns can
    measure.
    """

    file: str
    rig: str
    samples: int
    duration: float
    findings: tuple[Finding, ...]
    checked: tuple[str, ...]
    unchecked: Mapping[str, str]
    rigs: tuple[str, ...] = ()

    @property
    def wrong(self) -> tuple[Finding, ...]:
        """Faults and warnings, without notes."""
        return tuple(f for f in self.findings if f.severity != "note")
