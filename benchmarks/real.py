"""Do the studies of real rigs reach what was asked, and how long does each take warm?

- *Reached* is the fit percent, `100 (1 - |y - simulated| / |y - mean|)`, of a free run from the first sample, or of
  predictions as far ahead as stated.
- *Left out*: every run in turn predicted from a fit of the others. It chooses only what the study declares unknown for
  a single run.
- *Twist*: first minus second coordinate.
- *Speed*: slope by parabolas over 50 ms, in measurement and model alike.
- *Seconds* are warm, from study file to verdict.

Each study gives its report page with `upright identify examples/studies/STUDY.toml --data DIR -o OUT`.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks import measure
from benchmarks.asked import ASKED, Asked, studies
from benchmarks.measure import Line, Target, spread

STUDIES = Path(__file__).parents[1] / "examples" / "studies"
TARGET = Target(most=5.0, of="seconds")


@dataclass(frozen=True)
class Result:
    """What one study came to: fit, scores of runs left out in turn, seconds from file to verdict."""

    study: str
    fit: Any
    left_out: dict[str, Any]
    seconds: tuple[float, float, float]
    rounds: int

    def reached(self, asked: Asked) -> dict[str, float]:
        """Fit percent by run of what was asked."""
        return asked.reached(self.left_out if asked.how == "left out" else self.fit.runs)


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """One line per study; `quick`, of every twelfth."""
    data = os.environ.get("UPRIGHT_REAL_DATA", "")
    if not data:
        return [Line(contender="all studies", note="left out: UPRIGHT_REAL_DATA names no folder")]
    results: list[Result] = []
    every = 12 if quick and markdown is None else 1
    for name in studies()[::every]:
        progress(name)
        results.append(_result(name, data, rounds=1 if quick else 3))
        if markdown is not None:  # what is done is kept, should somebody interrupt
            markdown.write_text(page(results), encoding="utf-8")
    return [_line(r) for r in results]


def _result(name: str, data: str, rounds: int) -> Result:
    from upright.identification.ladder.cross_validation import cross_validate

    study, fit, _ = _timed(name, data)  # compiles what is not compiled yet
    taken = [_timed(name, data)[2] for _ in range(rounds)]
    wanted = any(a.how == "left out" for a in ASKED if a.study == name)
    left_out = dict(cross_validate(fit, study.runs).predicted) if wanted else {}
    return Result(study=name, fit=fit, left_out=left_out, seconds=spread(taken), rounds=rounds)


def _timed(name: str, data: str) -> tuple[Any, Any, float]:
    """A study, its fit and the seconds from study file to verdict."""
    from upright.identification.estimate import identify
    from upright.study.load import load_study

    start = time.perf_counter()
    study = load_study(STUDIES / f"{name}.toml", data=data)
    fit = identify(study.model, study.runs)
    return study, fit, time.perf_counter() - start


def _line(r: Result) -> Line:
    told: list[str] = []
    for asked in (a for a in ASKED if a.study == r.study):
        reached = r.reached(asked)
        told.append(f"{_what(asked)} {_span(reached, asked)} (asked {asked.least:g}{_missed(asked, reached)})")
    note = "; ".join([*told, *([] if r.fit.trusted else ["not trusted"])])
    return Line(contender=r.study, seconds=r.seconds, rounds=r.rounds, target=TARGET, note=note)


def _missed(asked: Asked, reached: dict[str, float]) -> str:
    return "" if asked.met(reached) else ", MISSED"


def _why(asked: Asked) -> str:
    return f"**missed**: {asked.missed}" if asked.missed else "**missed**"


def _what(asked: Asked) -> str:
    ahead = f" {1e3 * asked.horizon:g} ms ahead" if asked.horizon is not None else ""
    return f"{asked.signal}{ahead} {asked.how}"


def _span(reached: dict[str, float], asked: Asked) -> str:
    """Fit percent of every run, or the median first when that was asked."""
    import numpy as np

    each = ", ".join(f"{v:.1f}" for v in reached.values())
    return each if asked.over == "each" else f"median {np.median(list(reached.values())):.1f} of {each}"


def page(results: list[Result]) -> str:
    """The published table."""
    lines = [
        "",
        "| study | signal | runs | reached [%] | asked [%] | |",
        "|---|---|---|---|---|---|",
    ]
    met = [asked.met(r.reached(asked)) for r in results for asked in ASKED if asked.study == r.study]
    for r in results:
        for asked in (a for a in ASKED if a.study == r.study):
            reached = r.reached(asked)
            over = "" if asked.over == "each" else "median "
            runs = f"{asked.how}: {', '.join(reached)}"
            if len(reached) > 4:
                runs = f"{asked.how}: {len(reached)} runs"
            lines.append(
                f"| {r.study} | {_what(asked).removesuffix(asked.how).strip()} | {runs} | {_span(reached, asked)} | "
                f"{over}{asked.least:g} | {'' if asked.met(reached) else _why(asked)} |"
            )
    lines += ["", "| study | seconds | verdict |", "|---|---|---|"]
    lines += [f"| {r.study} | {r.seconds[0]:.2g} | {r.fit.verdict.replace('|', '/')} |" for r in results]
    result = headline(sum(met), len(met), [r.seconds[0] for r in results])
    return measure.page("real", "Real rigs", __doc__, lines, result, needs="UPRIGHT_REAL_DATA=... ")


def headline(reached: int, of: int, seconds: Sequence[float]) -> str:
    """The result in a sentence, of the figures that were required and the seconds of each study."""
    slow = sum(s > TARGET.most for s in seconds)
    return (
        f"{reached} of {of} figures that were required are reached; a study takes {min(seconds):.2g} to "
        f"{max(seconds):.2g} s" + (f", {slow} of {len(seconds)} more than {TARGET.most:g} s." if slow else ".")
    )
