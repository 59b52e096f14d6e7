"""How is the text of a loop over lanes written down?"""

from __future__ import annotations

import re

from upright.simulation.kernel.flavour import Layout


class Writer:
    """Lines of one function, with the working array's places filled in."""

    def __init__(self, layout: Layout, width: int) -> None:
        self.p, self.width, self.lines, self.depth = layout, width, [], 1

    def at(self, name: str) -> str:
        """Place of a per-lane number in the working array."""
        return f"W[{self.p.rows[name] * self.width} + _i]"

    def add(self, *lines: str) -> None:
        """Write lines; ``{name}`` in braces becomes that number's place."""
        for line in lines:
            text = re.sub(r"\{(\w+)\}", lambda m: self.at(m[1]), line)
            self.lines.append("    " * self.depth + text)

    def lanes(self) -> None:
        """Open a loop over the lanes of the block."""
        self.add(f"for _i in range({self.width}):")
        self.depth += 1
