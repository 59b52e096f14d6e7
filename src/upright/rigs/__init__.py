"""One protocol to every rig: the twin, a replayed record, firmware behind a wire, a vendor's board."""

from __future__ import annotations

from upright.rigs.protocol import Capabilities, Fault, Limits, LiveRig, Mode, SelfTest, Tick

__all__ = ["Capabilities", "Fault", "Limits", "LiveRig", "Mode", "SelfTest", "Tick"]
