"""The fit and the velocity filter that a rig of the bench is used with, kept in its folder for the next bench.

A twin takes them up again where every file that they rest on is what it was; else its page offers them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from upright.browser.identify.fits import Identifications
from upright.browser.rig import HARDWARE, MEMORY, BenchRig
from upright.errors import UprightError
from upright.files import replace_file

FILE = "last_use.json"


@dataclass(frozen=True, kw_only=True)
class LastUse:
    """What a page says about how its rig was used last.

    Attributes
    ----------
    sentence : str
        Whether it is used so again, and if not, why.
    offer : mapping or None
        What the page requests to have it so again; None where it is, or cannot be.
    """

    sentence: str
    offer: Mapping[str, Any] | None = None

    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {"sentence": self.sentence, "offer": self.offer}


def keep_use(rig: BenchRig, came: BenchRig, folder: Path) -> None:
    """Keep in the folder of a rig what it is used with beside what it `came` with.

    Raises
    ------
    OSError
        When it cannot be written.
    """
    usual = MEMORY if rig.fit else came.memory
    memory = None if rig.memory == usual else rig.memory
    if not rig.fit and memory is None:
        (folder / FILE).unlink(missing_ok=True)
        return
    facts = {"fit": rig.fit, "of": rig.fit_of, "memory": memory, "files": _digest(came, rig.fit, folder)}
    replace_file(folder / FILE, json.dumps(facts).encode())


def take_up(came: BenchRig, fits: Identifications, folder: Path) -> tuple[BenchRig, LastUse | None]:
    """The rig as it was used last, else as it `came`; and what its page says about that."""
    path = folder / FILE
    if not path.exists():
        return came, None
    try:
        facts: Any = json.loads(path.read_text(encoding="utf-8"))
        fit, memory = str(facts["fit"]), None if facts["memory"] is None else float(facts["memory"])
        same = facts["files"] == _digest(came, fit, folder)
        parts = [f"the fit of {facts['of']}"] if fit else []
    except (OSError, ValueError, KeyError, TypeError) as error:
        return came, LastUse(sentence=f"How {came.name} was used last cannot be read from {path}: {error}.")
    parts += [] if memory is None else [f"the velocity filter a = {memory:g}"]
    last = f"When the bench last ran, {came.name} was used with {' and '.join(parts)}"
    offer = ({"fit": fit} if fit else {}) | ({} if memory is None else {"memory": memory})
    if fit and all(each["id"] != fit for each in fits.listed()):
        return came, LastUse(sentence=f"{last}. That fit is no longer there, so that it starts as it came.")
    if came.kind == HARDWARE:
        why = "It can really move, so that this waits until you confirm it on the screen Identify."
        return came, LastUse(sentence=f"{last}. {why}", offer=offer)
    if not same:
        why = "Its RIG.toml, its law or the fit has changed since, so that it starts as it came"
        return came, LastUse(sentence=f"{last}. {why}; the screen Identify offers this again.", offer=offer)
    try:
        rig = fits.described_again(fit)
        rig = rig if memory is None else rig.with_memory(memory, rig.law_path.parent if rig.fit else folder)
    except UprightError as error:
        return came, LastUse(sentence=f"{last}. That cannot be used now: {error}")
    return rig, LastUse(sentence=f"{last}, and so it is again. The screen Identify goes back to what it came with.")


def _digest(came: BenchRig, fit: str, folder: Path) -> str:
    """Of every file on which a rig rests that is used with a fit."""
    files = [came.rig_path, came.law_path, *([] if came.file.known is None else [came.file.known])]
    files += [folder / "fits" / fit / name for name in ("fit.json", "law.json")] if fit else []
    contents = [hashlib.sha256(path.read_bytes()).hexdigest() for path in files if path.exists()]
    return hashlib.sha256(" ".join(contents).encode()).hexdigest()
