"""How are many motions stepped side by side at the speed of the processor's vector unit?

Text of ``run_L``: blocks of L lanes, their numbers interleaved in one flat array with constant offsets, so that each
``for _i in range(L)`` below becomes vector instructions. L = 1 gives the path for a single motion.
"""

from __future__ import annotations

from upright.simulation.kernel.beginning import start
from upright.simulation.kernel.drive import substep
from upright.simulation.kernel.equations import step_arguments
from upright.simulation.kernel.flavour import Layout
from upright.simulation.kernel.inputs import command, controller, prescribed
from upright.simulation.kernel.reach import places
from upright.simulation.kernel.writer import Writer

RUN_ARGUMENTS = (
    "_b0, _b1, _total, P, X0, U, R, START, HELD, HBASE, _nsteps, _every, _substeps, _dt, FL, _nbuf, OUT, STAT, "
    "W, _data, _events"
)


def room(p: Layout, width: int, buffer: int) -> int:
    """Size of the working array ``W``: the lanes' numbers, commands still on their way, the search of events."""
    late = buffer * p.nu * width if p.flavour.loop and p.flavour.dynamic else 0
    return len(p.rows) * width + late + (places(p)["END"] if p.flavour.dry else 0)


def run(p: Layout, width: int) -> str:
    """Text of ``run_{width}``."""
    w = Writer(p, width)
    w.add(
        "" if p.plain else "wide()",
        "_h = _dt / _substeps",
        "_last = U.shape[0] - 1",
        "_final = HELD.shape[0] - 1",
        "for _b in range(_b0, _b1):",
    )
    w.depth = 2
    w.add(f"_base = _b * {width}", f"_valid = min({width}, _total - _base)", "W[:] = 0.0")
    w.lanes()
    start(w)
    w.depth = 2
    w.add("for _k in range(_nsteps + 1):")
    w.depth = 3
    prescribed(w)
    (controller if p.flavour.loop else command)(w)
    w.depth = 3
    (_record if p.flavour.record else _reduce)(w)
    w.depth = 3
    w.add("if _k == _nsteps:", "    break", "for _j in range(_substeps):")
    w.depth = 4
    _substep(w)
    if not p.flavour.record:
        w.depth = 2
        w.lanes()
        names = _statistics(p)
        w.add(*(f"STAT[{r}, _base + _i] = {{{name}}}" for r, name in enumerate(names)))
    return f"@compiled\ndef run_{width}({RUN_ARGUMENTS}):\n" + "\n".join(w.lines) + "\n"


def _statistics(p: Layout) -> list[str]:
    n = range(p.n)
    ends = [f"{c}{i}" for i in n for c in "qv"]
    return [*(f"mx{i}" for i in n), *(f"er{i}" for i in n), *(f"sat{j}" for j in range(p.nu)), *ends]


def _record(w: Writer) -> None:
    p = w.p
    w.add("if _k % _every == 0:")
    w.depth += 1
    w.add("_row = _k // _every")
    columns = [f"{c}{i}" for i in range(p.n) for c in "qv"]
    columns += [f"ua{j}" for j in range(p.nu)] if p.flavour.loop else []
    for c, name in enumerate(columns):
        # ua holds the command only between controller and substep, where this line stands
        w.add(f"for _i in range({w.width}):", f"    OUT[_row, {c}, _base + _i] = {{{name}}}")


def _reduce(w: Writer) -> None:
    p, n = w.p, w.p.n
    w.add(f"_on = 1.0 if _k >= FL[{n + 1}] else 0.0")
    w.lanes()
    for i in range(n):
        goal = f" - {{tg{i}}}" if f"tg{i}" in p.rows else ""
        w.add(f"_c = abs({{q{i}}})", f"_z = {{mx{i}}}", f"{{mx{i}}} = _c if _c > _z else _z")
        w.add(f"_c = abs({{q{i}}}{goal}) * _on", f"_z = {{er{i}}}", f"{{er{i}}} = _c if _c > _z else _z")


def _substep(w: Writer) -> None:
    """One Runge-Kutta step of every lane; then the lanes in which a joint stuck or broke away, one by one."""
    p, f = w.p, w.p.flavour
    if f.held:
        w.lanes()
        w.add("_m = (START[_base + _i] + _k) * 2 * _substeps + 2 * _j")
        for place, when in enumerate("amb"):
            w.add(f"_n = min(max(_m + {place}, 0), _final)")
            for k, i in enumerate(f.held):
                w.add(f"{{hq{i}{when}}} = HELD[_n, {3 * k}] + {{hb{i}}}")
                w.add(*(f"{{h{c}{i}{when}}} = HELD[_n, {3 * k + m}]" for m, c in ((1, "v"), (2, "a"))))
        w.depth -= 1
    w.lanes()
    if f.dynamic:
        for j in range(p.nu):
            w.add(
                f"_p = {{df{j}}} * _substeps - _j",
                "_p = 0.0 if _p < 0.0 else _p",
                "_p = 1.0 if _p > 1.0 else _p",
                f"_d = {{co{j}}} - {{cn{j}}}",
                f"_r = {{cn{j}}} + _p * _d",
                f"_w0 = {{w{j}}}",
                # read both before one is chosen: a load under a condition keeps LLVM from using vectors
                f"_e, _z = {{e{j}}}, {{ep{j}}}",
                "_z = _e if _p <= 0.0 else _z",
                "_z = 1.0 if _p >= 1.0 else _z",
                f"_w1 = {{cn{j}}} + (_w0 - {{co{j}}}) * _e + _d * _z",
                "_d = 6.0 * _d * _p * (_p - 1.0)",
                f"_wm = _r - (_w1 - _w0) * {{th{j}}}",
                f"_d = 0.5 * _d - 6.0 * {{th{j}}} * (0.5 * (_w0 + _w1) - _wm)",
                f"{{w{j}}} = _w1",
                f"{{ua{j}}} = _wm - _d",
                f"{{um{j}}} = _wm",
                f"{{ub{j}}} = _wm + _d",
            )
            substep(w, j)
    number = {a: a[1:] if a[1:] in p.rows and a != "_h" else a for a in step_arguments(p)}
    if not f.dynamic:
        number |= {f"_u{when}{j}": f"um{j}" for when in "ab" for j in range(p.nu)}
    call = ", ".join("_h" if a == "_h" else f"{{{place}}}" for a, place in number.items())
    new = [f"q{i}" for i in p.free] + [f"v{i}" for i in p.free] + [f"y{i}" for i in f.dahl]
    result = [f"_n{name}" for name in new] + (["_flag"] if f.dry else [])
    w.add(f"({', '.join(result or ['_nothing'])},) = step({call})")
    if f.dry:
        w.add(*(f"{{o{name}}} = {{{name}}}" for name in new), "{flag} = _flag")
    w.add(*(f"{{{name}}} = _n{name}" for name in new))
    if f.dry:
        w.depth -= 1
        w.add("_bad = 0.0", f"for _i in range({w.width}):", "    _bad += {flag}")
        w.add("if _bad > 0.0:", "    for _i in range(_valid):", "        if {flag} > 0.0:")
        end = places(p)["END"]
        if p.plain:
            w.add(f"            events(W[_i:], W[W.size - {end}:], {w.width}, _h)")
        else:
            w.add(f"            call(_events, _data + 8 * _i, _data + 8 * (W.size - {end}), {w.width}, _h)")
