"""One protocol to every rig: the twin, a replayed record, firmware behind a wire, a vendor's board."""

from __future__ import annotations

from upright.rigs.board import Board, Port
from upright.rigs.protocol import Capabilities, Fault, Limits, LiveRig, Mode, SelfTest, Tick
from upright.rigs.replay import ReplayPort
from upright.rigs.twin import TwinPort

__all__ = [
    "Board",
    "Capabilities",
    "Fault",
    "Limits",
    "LiveRig",
    "Mode",
    "Port",
    "ReplayPort",
    "SelfTest",
    "Tick",
    "TwinPort",
]
