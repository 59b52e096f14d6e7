"""A rig that moves in a page: its kernel, its law, and the rigs that its fit allows."""

from pathlib import Path

SCRIPTS = tuple(Path(__file__).with_name(name) for name in ("kernel.js", "twin.js"))
"""Scripts that a page needs to move a rig, in order; they draw nothing."""
