"""Is there machine code for the processors and systems that this project says it runs on, whatever this one is?"""

from __future__ import annotations

import llvmlite.binding as llvm
import pytest

from upright.physics import Furuta
from upright.simulation import choose
from upright.simulation.kernel.compiled import RUN, source
from upright.simulation.kernel.flavour import Layout
from upright.simulation.lowering import machine
from upright.simulation.lowering.module import Module, Platform

# First bytes of an object as each system's format fixes them, with the code of the processor.
OTHERS = {
    ("aarch64-unknown-linux-gnu", "cortex-a72", 4): b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x01\x00\xb7\x00",
    ("x86_64-unknown-linux-gnu", "haswell", 8): b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x01\x00\x3e\x00",
    ("arm64-apple-macosx13.0", "apple-m1", 4): b"\xcf\xfa\xed\xfe\x0c\x00\x00\x01",
    ("x86_64-pc-windows-msvc", "haswell", 8): b"\x64\x86",
}


@pytest.mark.parametrize(("triple", "cpu", "lanes"), OTHERS)
def test_the_same_text_becomes_an_object_of_another_system(triple, cpu, lanes):
    rig = Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1c=0.1)
    derived = rig.derived_for(rig.parameters())
    text = source(Layout(derived=derived, flavour=choose(derived, rig.parameters())))
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(triple).create_target_machine(cpu=cpu, opt=2, reloc="pic")
    platform = Platform(triple=triple, layout=str(target.target_data), head=16)
    code = machine.translated(Module(text, lanes).entry("run_16", RUN, platform), target)
    assert code.startswith(OTHERS[triple, cpu, lanes])
    assert b"run_16" in code


@pytest.mark.parametrize(
    ("features", "lanes"),
    [({"avx512f": True, "avx2": True}, 16), ({"avx2": True, "avx512f": False}, 8), ({"neon": True}, 4), ({}, 4)],
)
def test_a_vector_takes_two_registers(features, lanes):
    """Of 512, 256 or 128 bits, each of which holds 8, 4 or 2 numbers of 64 bits."""
    assert machine.lanes_of(features) == lanes
