"""A program for the RP2040 as the file that is copied to its drive: python uf2.py rig.bin rig.uf2"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

FLASH, BLOCK, FAMILY = 0x10000000, 256, 0xE48BFF56
BOOT = 252
"""Bytes in front of the checksum that the boot ROM compares."""


def checksum(data: bytes) -> int:
    """CRC-32 without reflection or final inversion (CRC-32/MPEG-2), as the RP2040's data sheet, 2.8.1.3.1, has it."""
    r = 0xFFFFFFFF
    for byte in data:
        r ^= byte << 24
        for _ in range(8):
            r = (r << 1 ^ 0x04C11DB7 if r & 1 << 31 else r << 1) & 0xFFFFFFFF
    return r


def uf2(program: bytes) -> bytes:
    """Blocks of 256 bytes for the flash, the first of them with its checksum."""
    program = program[:BOOT] + struct.pack("<I", checksum(program[:BOOT])) + program[BOOT + 4 :]
    parts = [program[at : at + BLOCK].ljust(BLOCK, b"\0") for at in range(0, len(program), BLOCK)]
    return b"".join(
        struct.pack("<8I", 0x0A324655, 0x9E5D5157, 0x2000, FLASH + BLOCK * k, BLOCK, k, len(parts), FAMILY)
        + part.ljust(476, b"\0")
        + struct.pack("<I", 0x0AB16F30)
        for k, part in enumerate(parts)
    )


if __name__ == "__main__":
    Path(sys.argv[2]).write_bytes(uf2(Path(sys.argv[1]).read_bytes()))
