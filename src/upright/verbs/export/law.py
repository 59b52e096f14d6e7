"""A designed law, written as a program."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.files import read_text
from upright.verbs.answer import Answer
from upright.verbs.export.exported import Exported, exported

if TYPE_CHECKING:
    from upright.exports.controller import SampledController
    from upright.exports.targets import LawTarget

FILES = ("design.json", "swing_up.json")
"""Of a folder, the first that is there."""


def controller_of(source: Any) -> tuple[SampledController, str]:
    """The law to be written, and what it is called by."""
    from upright.exports.controller import of_law
    from upright.exports.targets import TARGETS, RigTarget

    if isinstance(source, Answer) and {"law", "rule"} & (source.numbers or {}).keys():
        from upright.files import plain_values

        return _of_content(plain_values(source.numbers), "this design")
    if not isinstance(source, str | os.PathLike):
        return of_law(source), "this law"
    path = Path(source)
    if path.is_dir():
        path = next((p for p in (path / name for name in FILES) if p.exists()), path / FILES[0])
    if not path.exists():
        raise BadInput(f"{path} does not exist; `upright design ... -o FOLDER` writes FOLDER/design.json.")
    try:
        content = json.loads(read_text(path))
    except (UnicodeDecodeError, ValueError, RecursionError):
        raise BadInput(f"{path} is not a design.json; `upright design ... -o FOLDER` writes one.") from None
    if isinstance(content, dict) and {"plant", "parameters"} <= content.keys():
        *forms, last = (t.name for t in TARGETS.own.values() if isinstance(t, RigTarget))
        raise BadInput(
            f"{path} is a fit, not a law. `upright design {path} --poles ... -o FOLDER` makes a law from it; the rig "
            f"itself is exported to {', '.join(forms)} or {last}."
        )
    return _of_content(content, str(path))


def _of_content(content: Any, name: str) -> tuple[SampledController, str]:
    """The law of a design, or of a swing-up, whose file holds a rule."""
    from upright.exports.controller import of_design, of_swing_up

    swings = isinstance(content, dict) and ("rule" in content or "swing_up" in content)
    return (of_swing_up if swings else of_design)(content, name), name


def write_law(made: SampledController, name: str, target: LawTarget, at: Path | None, single: bool) -> Exported:
    """The law in one form, its files in a folder."""
    from upright.exports.targets import TARGETS, LawTarget
    from upright.exports.vector import self_test
    from upright.laws import Rule
    from upright.report.page import Chapter, Part, Points, Step, resting_on
    from upright.report.symbols import number, typed

    if isinstance(made.law, Rule) and (single or not target.rules):
        of_rules = (t.name for t in TARGETS.own.values() if isinstance(t, LawTarget) and t.rules)
        raise BadInput(
            f"a rule is exported to {', '.join(of_rules)}, in double precision only, since its error in single "
            f"precision is not known; got {'--float' if single else target.name}."
        )
    test = self_test(made)
    texts = target.write(made, test, single)
    unit, step = made.command_unit, float(made.converter.max(initial=0.0))
    warnings: list[str] = []
    if not math.isfinite(made.law.limit):
        warnings.append("The command's limit is not specified, so the program has none: design with --limit.")
    exact = f"its self-test compares {len(test.readings)} samples bit for bit"
    miss = f"{number(test.single, 2)} {unit}".strip()
    if single:
        exact = f"its self-test compares {len(test.readings)} samples to within {miss} in single precision"
        if test.single > 1.5 * step:  # whole steps, and the last digits of the command itself
            than = f"more than the converter's step of {number(step, 2)} {unit}" if step else "with no converter step"
            warnings.append(f"In single precision a command may differ by {miss}, {than}; a longer period reduces it.")
    else:
        warnings += filter(None, [target.warn(made, miss)])
    page = Chapter(
        title=f"{made.title} for {target.name}", verdict=f"{name} is written for {target.name}; {exact}.",
        parts=(Part("What it takes and gives", (Points(tuple(made.facts)),)),), warnings=tuple(warnings),
        steps=(
            Step("Run its self-test on the computer that will run it.", target.test.format(folder=typed(at or Path()))),
            Step(target.onward),
        ),
        numbers={
            "period": made.law.period, "limit": made.law.limit,
            "samples": len(test.readings), "single_precision_misses": test.single,
        },
    )  # fmt: skip
    return exported({n: text.encode() for n, text in texts.items()}, resting_on(page, made.basis), at, target.name)
