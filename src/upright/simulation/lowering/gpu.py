"""One thread for each lane: the entry of a text as a kernel of a GPU.

The entry is called with a block of one lane, and with room of the thread's own to work in; LLVM makes registers of it
where nobody asks for its address. What is `separate` elsewhere is called directly here.
"""

from __future__ import annotations

from collections.abc import Mapping

from upright.errors import BadInput
from upright.simulation.lowering.module import Module, Platform
from upright.simulation.lowering.operands import ArrayOf, Type, llvm

KERNEL, THREAD = "lanes", "thread"
"""Names of what a GPU launches, and of what one of its threads does, which any processor can."""

_FIRST, _LAST, _TOTAL, _WORK, _ADDRESS = "_b0", "_b1", "_total", "W", "_events"

_PLACES = ("ctaid", "ntid", "tid")
_DECLARED = "".join(f"declare i32 @llvm.nvvm.read.ptx.sreg.{x}.x()\n" for x in _PLACES)
_INDEX = [line for x in _PLACES for line in (
    f"%{x}.narrow = call i32 @llvm.nvvm.read.ptx.sreg.{x}.x()",
    f"%{x} = zext i32 %{x}.narrow to i64",
)] + ["%before = mul i64 %ctaid, %ntid", "%index = add i64 %before, %tid"]  # fmt: skip


def threads(text: str, entry: str, arguments: Mapping[str, Type], platform: Platform, room: int) -> str:
    """LLVM's text of ``thread(index, ...)``, and of the kernel around it where the platform is a GPU.

    Both take the arguments of the entry that are not the thread's own, plainly: an array as its pointer and its sizes.
    A thread beyond the last lane returns at once.

    Parameters
    ----------
    text, entry : str
        Text of the functions, and the name of the one to call.
    arguments : mapping of str to Type
        Those of the entry, in its order: ``_b0, _b1, W, _events`` are the thread's own, `_total` counts the lanes.
    platform : Platform
        A GPU, or whatever processor is to do what one thread does.
    room : int
        Size of ``W``.

    Raises
    ------
    BadInput
        When the text needs the C library.
    """
    module = Module(text, 1, together=True)
    symbol, _ = module.instance(entry, tuple(arguments.values()))
    if missing := module.library():
        raise BadInput(
            f"a GPU has no C library, and the rule or plant needs {', '.join(missing)} of it; write it with "
            "arithmetic, sqrt, floor, abs and round, or leave device at 'cpu'."
        )
    own = {_FIRST: "i64 %index", _LAST: "i64 %after", _WORK: f"ptr %room, i64 {room}", _ADDRESS: "i64 0"}
    plain = {name: _plainly(name, t) for name, t in arguments.items() if name not in own}
    parameters = ", ".join(plain.values())
    on_gpu = platform.triple.startswith("nvptx")
    thread = _function(
        f"{'internal ' if on_gpu else ''}void @{THREAD}(i64 %index, {parameters})",
        [
            f"%room = alloca [{room} x double], align 64",
            f"%exists = icmp slt i64 %index, %{_TOTAL}",
            "br i1 %exists, label %one, label %end",
            "one:",
            "%after = add i64 %index, 1",
            f"call void @{symbol}({', '.join([(own | plain)[name] for name in arguments])})",
            "br label %end",
            "end:",
        ],
    )
    call = f"call void @{THREAD}(i64 %index, {parameters})"
    kernel = f"{_DECLARED}{_function(f'ptx_kernel void @{KERNEL}({parameters})', [*_INDEX, call])}"
    return module.whole(platform, thread + kernel if on_gpu else thread)


def _plainly(name: str, t: Type) -> str:
    """An argument as a pointer and its sizes, or as the number that it is."""
    sizes = [f"i64 %{name}.{k}" for k in range(t.axes)] if isinstance(t, ArrayOf) else []
    return ", ".join([f"{llvm(t, 1)} %{name}", *sizes])


def _function(head: str, lines: list[str]) -> str:
    body = "\n".join(line if line.endswith(":") else f"  {line}" for line in [*lines, "ret void"])
    return f"define {head} nounwind {{\n{body}\n}}\n"
