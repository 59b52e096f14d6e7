"""Do the tests notice when one place of the code is changed? Random changes, room by room.

Operators, comparisons, constants, guards, indices and signs: each change is one place, drawn from all of them, and the
quick tests that cover it run until one fails, the nearest and cheapest first, 60 s of CPU of them. `--slow` then runs
the slow tests that cover what no quick one noticed, 120 s of them; `--seconds` allows less. A test that hangs has
noticed. Intervals are Wilson's of 95 %. What no test noticed is listed.

A change matters when it makes something false that the project says to anybody (a docstring, a comment with its source,
a page, help, the sentence of an error, a number within the interval it is shown with, what is promised for safety), or
when a figure or a result becomes wrong. It does not matter when the program stays equivalent, when a tuning number
moves within the freedom that its comment leaves and every claim still holds, or when only speed or the layout of a
picture changes. Whatever went unnoticed is judged by that, one by one; what does not matter is written with its reason
into `benchmarks/mutants/judged.txt`, lines `file:line before -> after  # reason`, and left out of the shares. What
nobody judged counts as unnoticed.
"""

from __future__ import annotations

import math
import os
import random
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from benchmarks.measure import Line, Target, page
from benchmarks.mutants.covering import SOURCE, digest, map_of
from benchmarks.mutants.places import Change, compiles, places
from benchmarks.mutants.trial import KERNEL, LONGER, SECONDS, Bench, Outcome
from benchmarks.mutants.trying import Kept, said, tried

ROOT = Path(__file__).parents[2]
UNNOTICED = 0.10
"""Share of changes that may go unnoticed."""
NOT = ": share not noticed"
JUDGED = Path(__file__).with_name("judged.txt")
DEEPER = "identification"
"""Room whose own rooms are counted one by one."""


def drawn(root: Path, sample: int, seed: int, within: str = "") -> list[Change]:
    """Changes of different places, each a program that compiles, the same for the same seed and source."""
    chance = random.Random(seed)
    sources = {p.relative_to(root).as_posix(): p.read_bytes() for p in sorted((root / SOURCE).rglob("*.py"))}
    file = f"{SOURCE}/{within}".partition(":")[0]
    everywhere = [
        (path, place)
        for path, source in sources.items()
        if path.startswith(file)
        for place in places(source)
        if f"{path}:{place.line}:".startswith(f"{SOURCE}/{within}{':' if ':' in within else ''}")
    ]
    chance.shuffle(everywhere)
    found: list[Change] = []
    for path, place in everywhere:
        change = Change(path=path, place=place, text=chance.choice(place.instead))
        if len(found) < sample and compiles(change.applied(sources[path])):
            found.append(change)
    return found


def traced(changes: Iterable[Change]) -> set[str]:
    """Files whose covering tests are asked for."""
    paths = {change.path for change in changes}
    return paths | ({KERNEL} if any(Path(path).parent == Path(KERNEL).parent for path in paths) else set())


def room(path: str) -> str:
    """First folder of a file below the package, the second too in identification."""
    parts = Path(path).relative_to(SOURCE).parts[:-1]
    return "/".join(parts[: 2 if parts[:1] == (DEEPER,) else 1]) or "upright"


def interval(hits: int, of: int) -> tuple[float, float]:
    """Wilson's interval of a share, 95 %."""
    if not of:
        return 0.0, 1.0
    z, p = 1.959964, hits / of
    middle, half = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return (middle - half) / (1 + z * z / of), (middle + half) / (1 + z * z / of)


def judged(file: Path) -> dict[str, str]:
    """Reason why a change does not matter, by the change: a line of a file has both, `  # ` between them."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    parts = [line.rpartition("  # ") for line in lines if "  # " in line]
    return {" ".join(change.split()): reason.strip() for change, _, reason in parts}


def run(
    *, quick: bool, progress: Callable[[str], None], sample: int = 150, seed: int = 0, within: str = "",
    folder: Path | None = None, verdicts: Path | None = None, workers: int = 2, slow: bool = False,
    seconds: float = SECONDS, markdown: Path | None = None,
) -> list[Line]:  # fmt: skip
    """A line for each room, one or two for all, and one for each change that went unnoticed."""
    cache = Path(os.environ["UPRIGHT_CACHE"]) if os.environ.get("UPRIGHT_CACHE") else None
    kept = folder or (cache or ROOT / "build") / "mutants"
    harmless = judged(verdicts or JUDGED)
    changes = drawn(ROOT, min(sample, 10) if quick else sample, seed, within)
    covered = map_of(ROOT, kept, workers, progress, traced(changes))
    by_slow: list[Outcome] | None = None
    with tempfile.TemporaryDirectory(prefix="upright-mutants-", ignore_cleanup_errors=True) as name:
        benches = [Bench(ROOT, Path(name) / str(i), cache) for i in range(workers)]
        before = [Kept(kept / f"{suite}-{digest(ROOT)}.jsonl") for suite in ("quick", "slow")]
        done = tried(benches, changes, covered, seconds, before[0], progress)
        if slow:
            left = [o.change for o in done if not o.noticed and _line(o) not in harmless]
            slower = map_of(ROOT, kept, workers, progress, traced(left), slow=True)
            by_slow = tried(benches, left, slower, LONGER * seconds, before[1], progress)
    lines = table(done, harmless, by_slow)
    passed = {_line(o): harmless[_line(o)] for o in done if _line(o) in harmless}
    if markdown is not None:
        where = f", within {within}" if within else ""
        asked = f"Sample {len(changes)}, seed {seed}{where}; {len(done)} were tried, with {seconds:g} s of quick tests."
        body, result = _body(asked, lines, passed), headline(lines)
        text = page("mutants", "Changes that tests notice", __doc__, body, result)
        markdown.write_text(text, encoding="utf-8")
    return lines


def _line(outcome: Outcome) -> str:
    """An outcome as a line of the judged ones begins."""
    return " ".join(said(outcome.change, outcome.shown).split())


def table(
    done: Sequence[Outcome], harmless: Iterable[str] = (), by_slow: Sequence[Outcome] | None = None
) -> list[Line]:
    """Shares of rooms and of all, by quick tests and by all of them, then what no quick test noticed."""
    left_out = set(harmless)
    counted = [o for o in done if _line(o) not in left_out]
    lines = [_share(name, [o.noticed for o in counted if room(o.change.path) == name])
             for name in sorted({room(o.change.path) for o in counted})]  # fmt: skip
    judged_out = len(done) - len(counted)
    note = f"; {judged_out} judged not to matter" * bool(judged_out)
    lines.append(_share("all", [o.noticed for o in counted], asked=True, note=note))
    slowly = {o.change: o for o in by_slow or ()}
    if by_slow is not None:
        both = [o.noticed or (o.change in slowly and slowly[o.change].noticed) for o in counted]
        lines.append(_share("all, by quick and slow tests", both, asked=True, note=note))
    missed = sorted((o for o in counted if not o.noticed), key=lambda o: (o.change.path, o.change.place.line))
    return lines + [
        Line(contender=f"{o.change.path.removeprefix(SOURCE + '/')}:{o.change.place.line}",
             note=f"{o.shown} ({_tests(o, slowly.get(o.change))})")
        for o in missed
    ]  # fmt: skip


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of all changes by quick tests, and by slow ones where they ran."""
    notes = {line.contender.removesuffix(NOT): line.note.partition(";")[0] for line in lines}
    both = notes.get("all, by quick and slow tests")
    return (
        f"Of all changes that matter quick tests noticed {notes['all'].replace(' noticed', '')}"
        + (f", and with slow tests {both.replace(' noticed', '')}" if both else "")
        + f"; {100 * (1 - UNNOTICED):.0f} % are required."
    )


def _tests(quick: Outcome, slow: Outcome | None) -> str:
    if slow is not None and slow.noticed:
        return f"slow: {slow.by}"
    also = "" if slow is None else f"; slow: {slow.ran} ran, {slow.covering} cover it"
    return f"{quick.ran} tests ran, {quick.covering} cover it{also}"


def _share(name: str, noticed: Sequence[bool], *, asked: bool = False, note: str = "") -> Line:
    hits, of = sum(noticed), len(noticed)
    low, high = interval(hits, of)
    missed = 1 - hits / of if of else 0.0
    return Line(
        contender=f"{name}{NOT}", ratio=(missed, 1 - high, 1 - low) if of else None,
        target=Target(most=UNNOTICED) if asked else None,
        note=f"{hits} of {of} noticed, {100 * (1 - missed):.0f} % ({100 * low:.0f} to {100 * high:.0f}){note}",
    )  # fmt: skip


def _body(asked: str, lines: Sequence[Line], passed: Mapping[str, str]) -> list[str]:
    """Shares as a table, then the changes that no quick test noticed, and those that do not matter."""
    shares = [line for line in lines if line.contender.endswith(NOT)]
    listed = [line for line in lines if not line.contender.endswith(NOT)]
    return [
        "", asked, "", "| room | noticed |", "|---|---|",
        *(f"| {line.contender.removesuffix(NOT)} | {line.note} |" for line in shares),
        "", "Not noticed by a quick test:", "", *(f"- `{line.contender}` `{line.note}`" for line in listed),
        "", "Not noticed, and judged not to matter:", "", *(f"- `{change}`: {why}" for change, why in passed.items()),
    ]  # fmt: skip
