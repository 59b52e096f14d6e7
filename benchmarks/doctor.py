"""How often does `upright doctor` find a fault that was put in, and how often one that was not?

Every line is one fault in records of random rigs (`benchmarks/doctored.py`); ``python -m benchmarks doctor`` writes the
table of docs/howto/doctor.md too.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.doctored import FAULTS, PLANTS, batch
from benchmarks.measure import Line

EACH, QUICK = 100, 1
"""Records per plant and fault."""
SEED = 2026
PAGE = Path(__file__).resolve().parent.parent / "docs" / "howto" / "doctor.md"
BEGIN, END = "<!-- table: python -m benchmarks doctor -->", "<!-- end of table -->"


@dataclass(frozen=True, kw_only=True)
class Count:
    """How many of `records` with a fault were told, how many got another finding too, and of which kinds."""

    fault: str
    records: int
    hits: int
    others: int
    kinds: dict[str, int]
    seconds: float


def count(fault: str, each: int, seed: int) -> Count:
    """Records of every plant with one fault ("" for none), examined with their rig known."""
    from upright.diagnosis import examine

    hits = others = records = 0
    kinds: Counter[str] = Counter()
    start = time.process_time()
    for plant in PLANTS:
        for d in batch(plant, fault, each, seed):
            found = {f.kind for f in examine(d.record, d.rig, d.wiring).wrong}
            wanted = FAULTS.get(fault, set())
            hits += bool(found & wanted)
            others += bool(found - wanted)
            kinds.update(found - wanted)
            records += 1
    spent = time.process_time() - start
    return Count(fault=fault, records=records, hits=hits, others=others, kinds=dict(kinds), seconds=spent / records)


def markdown(counts: list[Count], seed: int) -> str:
    """Table of docs/howto/doctor.md."""
    lines = [
        f"{counts[0].records} records per fault, {len(PLANTS)} plants, seed {seed}.",
        "",
        "| fault put in | found [%] | another finding as well or instead [%] | which |",
        "|---|---|---|---|",
    ]
    for c in counts:
        which = ", ".join(f"{k} {n}" for k, n in sorted(c.kinds.items(), key=lambda item: -item[1]))
        found = f"{100 * c.hits / c.records:.1f}" if c.fault else "none was put in"
        lines.append(f"| {c.fault or '**none**'} | {found} | {100 * c.others / c.records:.1f} | {which} |")
    return "\n".join(lines)


def write_page(text: str) -> None:
    """Replace the table of docs/howto/doctor.md."""
    page = PAGE.read_text(encoding="utf-8")
    before, _, rest = page.partition(BEGIN)
    _, _, after = rest.partition(END)
    PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def run(*, quick: bool, progress: Callable[[str], None], seed: int = SEED) -> list[Line]:
    """Hits and false alarms; the full run rewrites the table in docs/howto/doctor.md."""
    counts: list[Count] = []
    lines: list[Line] = []
    for fault in ("", *FAULTS):
        progress(fault or "no fault")
        c = count(fault, QUICK if quick else EACH, seed)
        counts.append(c)
        share, alarms = 100 * c.hits / c.records, 100 * c.others / c.records
        error = 100 * math.sqrt(max(c.hits * (c.records - c.hits), 1) / c.records**3)
        found = f"found {share:.1f} % (standard error {error:.1f} %), " if fault else ""
        note = f"{c.records} records: {found}{'another' if fault else 'a'} finding in {alarms:.1f} % {c.kinds or ''}"
        each = (c.seconds, c.seconds, c.seconds)
        lines.append(Line(contender=fault or "no fault", seconds=each, note=note))
    if not quick:
        write_page(markdown(counts, seed))
    return lines
