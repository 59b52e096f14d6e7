"""Does the core build for another processor and answer there, and does nothing that comes over the wire break it?"""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

from benchmarks.boards import rig_on
from upright.rigs.protocol import Fault, Mode

pytestmark = pytest.mark.slow


def test_a_cortex_m3_answers_in_qemu(built):
    folder = built("arm", "arm-none-eabi-gcc")
    if shutil.which("qemu-system-arm") is None:
        pytest.skip("qemu-system-arm is missing")
    qemu = subprocess.Popen(
        ["qemu-system-arm", "-M", "mps2-an385", "-nographic", "-monitor", "none", "-serial", "pty",
         "-kernel", str(folder / "cortexm.elf")],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, encoding="utf-8",
    )  # fmt: skip
    try:
        assert qemu.stdout is not None
        port = next(found[0] for line in qemu.stdout if (found := re.search(r"/dev/pts/\d+", line)))
        rig = rig_on(port, patience=5.0, resend=1.0)
        assert "Cortex-M3" in rig.open().name
        assert rig.exchange(0.0).faults == Fault.RESET
        rig.clear_fault()
        first, second = rig.exchange(0.0), rig.exchange(0.0)
        assert first.mode == Mode.IDLE
        assert second.tick > first.tick
        rig.close()
    finally:
        qemu.terminate()
        qemu.communicate(timeout=60)


def test_a_fuzzer_finds_nothing_that_breaks_it(built):
    folder = built("fuzz", "clang")
    found = subprocess.run(
        [folder / "fuzz-wire", "-seed=1", "-runs=100000", "-max_len=2000", f"-artifact_prefix={folder}/"],
        capture_output=True, encoding="utf-8", check=False,
    )  # fmt: skip
    assert found.returncode == 0, found.stderr[-2000:]
