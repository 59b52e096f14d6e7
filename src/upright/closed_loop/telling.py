"""How is a recovered law handed on? As JSON for programs, and as the `loop` that a study takes."""

from __future__ import annotations

import json
from typing import Any

from upright.closed_loop.recovery import Recovery


def as_json(found: Recovery) -> str:
    """Everything about the law but the samples."""
    law = found.law
    whole: dict[str, Any] = {
        "command": found.command,
        "structure": found.structure,
        "quality": found.quality,
        "sentence": found.sentence,
        "explained_percent": found.explained,
        "largest_residual": found.largest,
        "gains": {
            name: {"value": g.value, "low": g.interval[0], "high": g.interval[1], "meaning": g.meaning}
            for name, g in found.gains.items()
        },
        "period_s": law.period,
        "samples_per_row": found.every,
        "limit": law.limit if found.saturated else None,
        "windup": law.windup,
        "delay_samples": law.delay,
        "command_step": found.quantum,
        "measured": law.measured,
        "references": law.references,
        "A": law.A.tolist(),
        "B": law.B.tolist(),
        "C": law.C.tolist(),
        "D": law.D.tolist(),
        "tried": [{"name": c.name, "numbers": c.parameters, "missed": c.missed} for c in found.candidates],
    }
    return json.dumps(whole, indent=1)


def recovering(found: Recovery) -> str:
    """`loop` of a study that recovers the law from the log each time; coordinates stay to be named."""
    parts = [
        'kind = "recover"', f"command = {_text(found.command)}",
        f"reference = {_list([_text(r) for r in found.law.references])}" if found.law.references else "",
        f"feedforward = {_list([_text(f) for f in found.feedforward])}" if found.feedforward else "",
    ]  # fmt: skip
    return f"loop = {{ {', '.join(part for part in parts if part)} }}"


def written(found: Recovery) -> str:
    """`loop` of a study with the gains written out, for other runs under the same law; "" when PID keys cannot say it.

    The coordinates that the columns measure are named as the columns are: the study's reader has to say which.
    """
    channels, law = found.channels, found.law
    first = channels[0]
    if found.feedforward or any(c.filter != first.filter for c in channels):
        return ""
    parts = ['kind = "pid"']
    for key in ("kp", "ki", "kd"):
        values = [getattr(c, key) for c in channels]
        if any(values):
            parts.append(f"{key} = {_list([f'{v:.6g}' for v in values])}")
    if first.filter.pole:
        tau = law.period * first.filter.pole / (1 - first.filter.pole)
        parts.append(f'tau = "{tau:.6g} s"')
    if first.filter.second:
        parts.append(f"taps = [{1 - first.filter.second:.4g}, {first.filter.second:.4g}]")
    if first.on == "measurement":
        parts.append('on = "measurement"')
    parts.append(f"measured = {_coordinates(found)}")
    references = [c.reference for c in channels if c.reference]
    if references:
        parts.append(f"reference = {_list([_text(r) for r in references])}")
    if found.saturated:
        parts.append(f"limit = {law.limit:.6g}")
    if law.windup == "hold":
        parts.append('windup = "hold"')
    if law.delay:
        parts.append(f"delay = {law.delay:g}")
    if found.every > 1:
        parts.append(f'period = "{law.period * 1e3:.6g} ms"')
    return f'loop = {{ {", ".join(parts)}, units = "log" }}'


def _coordinates(found: Recovery) -> str:
    return _list([_text(f"COORDINATE OF {c.measured}") for c in found.channels])


def _text(name: str) -> str:
    return json.dumps(name, ensure_ascii=False)


def _list(items: list[str]) -> str:
    return items[0] if len(items) == 1 else f"[{', '.join(items)}]"
