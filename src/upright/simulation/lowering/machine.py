"""Machine code in memory from LLVM's text, for the processor it runs on."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache
from threading import Lock
from typing import Any

import llvmlite.binding as llvm

from upright.simulation.lowering.module import Platform

_CODE = 2
"""How hard LLVM works on the machine code; 3 takes longer and gains nothing here."""

_PASSES = 1
"""How hard on its own text: what is left after inlining are arithmetic, loads and stores."""

_LINKS = sys.platform == "linux"
"""Whether LLVM's linker lays out code and constants side by side: near enough for a constant to be an operand.

Elsewhere each section may lie anywhere, and every constant needs an instruction or two of its own: a sixth slower.
"""

_loaded: list[Any] = []
"""Whoever loaded code owns it, and stays."""

_loading = Lock()
"""One linker serves all threads, and calls what it loads by their number."""


@cache
def _processor() -> tuple[str, str, int]:
    """Name and features of this processor, and the lanes that a vector is written for."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    name, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features()
    return name, features.flatten(), lanes_of(features)


def lanes_of(features: dict[str, bool]) -> int:
    """Lanes of a vector that suit a processor: two registers of AVX-512, AVX2 or NEON."""
    return 16 if features.get("avx512f") else 8 if features.get("avx2") else 4


def lanes() -> int:
    """Lanes that a vector is written for here."""
    return _processor()[2]


@cache
def _target() -> Any:
    name, features, _ = _processor()
    return llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(
        cpu=name,
        features=features,
        opt=_CODE,
        reloc="pic" if _LINKS else "default",
        codemodel="small" if _LINKS else "jitdefault",
    )


@cache
def platform() -> Platform:
    """What modules are written for here."""
    return Platform(triple=llvm.get_process_triple(), layout=str(_target().target_data), head=object.__basicsize__)


@cache
def identity() -> str:
    """Everything of this machine that its code depends on."""
    name, features, lanes = _processor()
    return f"{llvm.llvm_version_info} {platform()} {name} {features} {lanes} {_CODE} {_PASSES} {_LINKS}"


def compiled(text: str) -> bytes:
    """Object code of a module.

    Parameters
    ----------
    text : str
        LLVM's text, written for `platform`.
    """
    return translated(text, _target())


def translated(text: str, target: Any) -> bytes:
    """Object code of a module for any target machine of llvmlite."""
    return target.emit_object(_optimized(text, target))


def _optimized(text: str, target: Any) -> Any:
    module = llvm.parse_assembly(text)
    options = llvm.create_pipeline_tuning_options(speed_level=_PASSES)
    # lanes are vectors already
    options.loop_vectorization = options.slp_vectorization = options.loop_interleaving = options.loop_unrolling = False
    passes = llvm.create_pass_builder(target, options)
    passes.getModulePassManager().run(module, passes)
    return module


GPU = "sm_80"
"""Oldest GPU of NVIDIA's that code is written for: A100; the driver translates it for the one at hand."""


@cache
def _gpu() -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple("nvptx64-nvidia-cuda").create_target_machine(cpu=GPU, opt=_CODE)


@cache
def gpu() -> Platform:
    """What modules are written for that run on a GPU; no Python object lies there."""
    return Platform(triple="nvptx64-nvidia-cuda", layout=str(_gpu().target_data), head=0)


def ptx(text: str) -> bytes:
    """Code of a module for NVIDIA's driver.

    Parameters
    ----------
    text : str
        LLVM's text, written for `gpu`.
    """
    return _gpu().emit_assembly(_optimized(text, _gpu())).encode()


_PAGE = "wasm32-unknown-unknown"
_PAGE_FEATURES = "+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext,+mutable-globals,+multivalue"
"""What every browser of today has; fused multiply-adds and wider vectors are not among it."""


@cache
def _page() -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    triple = llvm.Target.from_triple(_PAGE)
    return triple.create_target_machine(cpu="generic", features=_PAGE_FEATURES, opt=_CODE, reloc="static")


@cache
def page_platform() -> Platform:
    """What modules are written for that run in a page."""
    return Platform(triple=_PAGE, layout=str(_page().target_data), head=0)


def wasm(text: str) -> bytes:
    """Object of WebAssembly of a module.

    Parameters
    ----------
    text : str
        LLVM's text, written for `page`.
    """
    return translated(text, _page())


@cache
def _linker() -> Any:
    return llvm.create_lljit_compiler(_target(), use_jit_link=True)


def address_of(code: bytes, name: str) -> int:
    """Address of a function in object code, brought into memory."""
    with _loading:
        return _brought(code, name)


def _brought(code: bytes, name: str) -> int:
    if _LINKS:
        library = llvm.JITLibraryBuilder().add_object_img(code).add_current_process().export_symbol(name)
        _loaded.append(library.link(_linker(), f"kernel {len(_loaded)}"))
        return _loaded[-1][name]
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target())
    # an empty module is compiled, and this is handed over as what became of it
    engine.set_object_cache(None, lambda _: code)
    engine.finalize_object()
    _loaded.append(engine)
    return engine.get_function_address(name)


def function(address: int) -> Callable[[bytes], None]:
    """The function at an address, called with packed words; Python's lock is given up meanwhile."""
    return ctypes.CFUNCTYPE(None, ctypes.c_char_p)(address)
