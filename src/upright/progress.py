"""How far has a long piece of work come? The one callback by which it tells."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with what is being done, in words, and the share of the whole that is done."""


def silent(step: str, share: float) -> None:
    """Ignore progress; the default."""


def part(progress: Progress, start: float, stop: float, what: str) -> Progress:
    """Progress of one part, called `what`, of a longer piece of work of which it takes the shares `start` to `stop`."""

    def tell(step: str, share: float) -> None:
        progress(f"{what}: {step}", start + (stop - start) * share)

    return tell
