"""Which law closed the loop? Sampled laws, how programs write them, and their recovery from a log."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from upright.closed_loop.feedback import Feedback
    from upright.closed_loop.law import SampledLaw
    from upright.closed_loop.recovery import Gain, Recovery
    from upright.closed_loop.search import recover
    from upright.closed_loop.structures import Channel, Filter, joined, pid, state_feedback

__all__ = [
    "Channel",
    "Feedback",
    "Filter",
    "Gain",
    "Recovery",
    "SampledLaw",
    "joined",
    "pid",
    "recover",
    "state_feedback",
]

_HOME = {
    "feedback": ("Feedback",),
    "law": ("SampledLaw",),
    "recovery": ("Gain", "Recovery"),
    "search": ("recover",),
    "structures": ("Channel", "Filter", "joined", "pid", "state_feedback"),
}
_OF = {name: module for module, names in _HOME.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_OF[name]}"), name)
