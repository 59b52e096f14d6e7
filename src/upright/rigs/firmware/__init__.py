"""The project's own firmware for boards: which boards there are, their wires, how an image is built and flashed."""

from upright.rigs.firmware.boards import BOARDS, BoardKind, board_of
from upright.rigs.firmware.flash import Flashed, flash
from upright.rigs.firmware.images import Image, build_image, ceilings_in_words, ceilings_of, sources
from upright.rigs.firmware.pins import Pin, pins
from upright.rigs.firmware.wiring import wiring

__all__ = [
    "BOARDS", "BoardKind", "Flashed", "Image", "Pin", "board_of", "build_image", "ceilings_in_words", "ceilings_of",
    "flash", "pins", "sources", "wiring",
]  # fmt: skip
