"""Text of the loop that steps many motions side by side at the speed of the processor's vector unit.

``run_L`` takes blocks of L lanes, their numbers interleaved in one flat array with constant offsets, so that each
``for _i in range(L)`` below becomes vector instructions. L = 1 gives the path for a single motion.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from upright.laws.linear import Structure
from upright.laws.rule import Written
from upright.physics.actuator import ACTUATOR
from upright.simulation.kernel.drive import begin, commanded, substep
from upright.simulation.kernel.equations import step_arguments
from upright.simulation.kernel.events import places
from upright.simulation.kernel.flavour import Layout, Writer

_JOINT = ("coulomb", "quadratic", "stiction", "stribeck_speed", "presliding")


def start(w: Writer) -> None:
    """One lane's constants, initial state, modes and actuator."""
    p, d, f = w.p, w.p.derived, w.p.flavour
    first = len(d.parameters)
    texts = " ".join(d.lumps) + " " + " ".join(" ".join(vars(j)[k] for k in _JOINT) for j in d.joints)
    used = set(re.findall(r"[A-Za-z_]\w*", texts))
    w.add("_m = _base + _i")
    w.add(*(f"{name} = P[{r}, _m]" for r, name in enumerate(d.parameters) if name in used))
    w.add(*(f"{{k{i}}} = {text}" for i, text in enumerate(d.lumps)))
    for i, j in zip(p.pivots, d.joints, strict=True):
        if i in (*f.dry, *f.dahl):
            w.add(f"_c = {j.coulomb or '0.0'}", f"_level = {j.stiction or '0.0'}")
            # not zero: what holds at rest with nothing at all would be on its border for ever
            w.add(f"{{_Fc{i}}} = _c", f"{{_Fs{i}}} = max(_level if _level > _c else _c, 1e-300)")
        if i in f.drag:
            w.add(f"{{_cq{i}}} = {j.quadratic}")
        for name, on, text in (("_iv", f.stribeck, j.stribeck_speed), ("_id", f.dahl, j.presliding)):
            if i in on:
                w.add(f"{{{name}{i}}} = 1.0 / {text} if {text} > 0.0 else 1e300")
    for i in range(p.n):
        w.add(f"{{q{i}}} = X0[{2 * i}, _m]", f"{{v{i}}} = X0[{2 * i + 1}, _m]")
    for name, on in (("s", f.dry), ("y", f.dahl)):
        for i in on:
            v = p.along(i, lambda k: f"{{v{k}}}")
            w.add(f"{{{name}{i}}} = 1.0 if {v} > 0.0 else (-1.0 if {v} < 0.0 else 0.0)")
    w.add(*(f"{{hb{i}}} = HBASE[{k}, _m]" for k, i in enumerate(f.held)))
    for j in range(p.nu):
        for k, name in enumerate(("gain", "off", "lim")):
            w.add(f"{{{name}{j}}} = P[{first + k * p.nu + j}, _m]")
        if f.droop:
            w.add(f"{{gd{j}}} = P[{first + list(ACTUATOR).index('actuator.droop') * p.nu + j}, _m]")
        if f.dead:
            w.add(
                f"{{dz{j}}} = P[{first + list(ACTUATOR).index('actuator.dead_zone') * p.nu + j}, _m]",
                f"if not ({{dz{j}}} == {{dz{j}}}):", "    {q0} = nan",  # comparisons would let it pass unseen
            )  # fmt: skip
        if f.dynamic:
            _actuator(w, j, first)
    law = first + len(ACTUATOR) * p.nu
    w.add(*(f"{{{name}}} = P[{law + r}, _m]" for r, name in enumerate(p.numbers)))
    w.add(*(f"{{{name}}} = {_from_now(p, name)}X0[{2 * p.n + k}, _m]" for k, name in enumerate(p.carried)))


def _from_now(p: Layout, name: str) -> str:
    """The speed before a substep is handed on as what has been gained since, so that a tap later does not count."""
    return f"{{v{p.drives[int(name[2:])]}}} - " if name.startswith("vp") else ""


def _actuator(w: Writer, j: int, first: int) -> None:
    """Lag, delay and slope of input `j`; the lag starts from what the input was before."""
    p, loop, nu = w.p, w.p.flavour.loop, w.p.nu
    row = {name.removeprefix("actuator."): first + k * nu + j for k, name in enumerate(ACTUATOR)}
    w.add(
        f"{{_sl{j}}} = P[{row['slope']}, _m]",
        f"_tau = P[{row['lag']}, _m]",
        "_x = _h / _tau if _tau > 0.0 else 1e300",
        f"{{e{j}}} = falling(_x)",
        f"{{th{j}}} = 1.0 / _x",
        f"_z = P[{row['delay']}, _m] / _dt" + (f" + FL[{p.n}]" if loop else ""),
        "if not (abs(_z) < 1e6) or not (_tau == _tau):",
        "    {q0} = nan",
        "    _z = 0.0",
        "_z = _z if _z > 0.0 else 0.0",
        "{di} = floor(_z)" if j == 0 else "",
        f"{{df{j}}} = _z - floor(_z)",
        # what is left at the end of a substep of a jump inside it
        f"{{ep{j}}} = falling(_x * (1.0 - ({{df{j}}} * _substeps - floor({{df{j}}} * _substeps))))",
    )
    begin(w, j, row)
    if loop:
        w.add(*_force_lines(w, j, f"{{w{j}}}", "0.0"))
        return
    # settle the lag on the input before the first sample, which is held where the record does not reach
    w.add(
        "_n = START[_m] if 40.0 * _tau > _dt * START[_m] else int(40.0 * _tau / _dt) + 1",
        "_n = min(_n, START[_m]) if _tau > 0.0 else 0",
        "for _k in range(-_n - 1, 0):",
    )
    w.depth += 1
    for name, back in (("_cn", 0), ("_co", 1)):
        w.add(
            f"_z = U[min(max(START[_m] + _k - int({{di}}) - {back}, 0), _last), {j}] if _last >= 0 else 0.0",
            f"_z = {{lim{j}}} if _z > {{lim{j}}} else _z",
            f"_z = 0.0 - {{lim{j}}} if _z < 0.0 - {{lim{j}}} else _z",
            *_force_lines(w, j, name, "_z"),
        )
    w.add(
        "if _k == -_n - 1:",
        f"    {{w{j}}} = _cn",
        "    continue",
        "for _j in range(_substeps):",
        f"    _z = {{df{j}}} * _substeps - _j",
        f"    _z = {{e{j}}} if _z <= 0.0 else (1.0 if _z >= 1.0 else {{ep{j}}})",
        f"    {{w{j}}} = _cn + ({{w{j}}} - _co) * {{e{j}}} + (_co - _cn) * _z",
    )
    w.depth -= 1


def prescribed(w: Writer) -> None:
    """Held coordinates where they are at this sample."""
    held = w.p.flavour.held
    if not held:
        return
    w.lanes()
    w.add("_m = min(max((START[_base + _i] + _k) * 2 * _substeps, 0), _final)")
    for k, i in enumerate(held):
        w.add(f"{{q{i}}} = HELD[_m, {3 * k}] + {{hb{i}}}", f"{{v{i}}} = HELD[_m, {3 * k + 1}]")
    w.depth -= 1


def _clip(w: Writer, j: int, name: str) -> None:
    w.add(f"_c = {{lim{j}}} if _c > {{lim{j}}} else _c", f"_c = 0.0 - {{lim{j}}} if _c < 0.0 - {{lim{j}}} else _c")
    w.add(*_force_lines(w, j, f"{{{name}{j}}}", "_c"))


def _force_lines(w: Writer, j: int, name: str, command: str) -> list[str]:
    """Lines for the requested force of input `j` by a command."""
    f = w.p.flavour
    if not (f.droop or f.dead):
        return [f"{name} = {{gain{j}}} * ({command} + {{off{j}}})"]
    lines = [f"_z = {command} + {{off{j}}}"]
    if f.dead:
        lines.append(f"_z = _z - {{dz{j}}} if _z > {{dz{j}}} else (_z + {{dz{j}}} if _z < 0.0 - {{dz{j}}} else 0.0)")
    return [*lines, f"{name} = {{gain{j}}} * _z" + (f" / (1.0 + {{gd{j}}} * abs(_z))" if f.droop else "")]


def _feed(w: Writer, back: tuple[tuple[str, str], ...]) -> None:
    """Input samples of each lane, which may start at different places of the record."""
    w.lanes()
    for name, index in back:
        w.add(f"_m = min(max({index}, 0), _last)")
        w.add(*(f"{{{name}{j}}} = U[_m, {j}]" for j in range(w.p.nu)))
    w.depth -= 1


def open_loop(w: Writer) -> None:
    """Open loop: command, limit, offset and gain."""
    p, f = w.p, w.p.flavour
    if not p.nu:
        return
    now = "START[_base + _i] + _k"
    w.add("if _last >= 0:")
    w.depth += 1
    _feed(w, (("ff", f"{now} - int({{di}})"), ("fo", f"{now} - int({{di}}) - 1")) if f.dynamic else (("ff", now),))
    w.depth -= 1
    w.lanes()
    for j in range(p.nu):
        w.add(f"_c = {{ff{j}}}")
        if not f.record:
            w.add(f"{{sat{j}}} += 1.0 if abs(_c) > {{lim{j}}} else 0.0")
        commanded(w, j, "n")
        _clip(w, j, "cn" if f.dynamic else "um")
        if f.dynamic:
            w.add(f"_c = {{fo{j}}}")
            commanded(w, j, "o")
            _clip(w, j, "co")


def controller(w: Writer) -> None:
    """Closed loop: encoders, the controller's command, limit, delay."""
    p, f, n = w.p, w.p.flavour, w.p.n
    w.add("if _last >= 0:")
    w.depth += 1
    _feed(w, (("ff", "START[_base + _i] + _k"),))
    w.depth -= 1
    w.add(*(f"_resolution{i} = FL[{i}]" for i in range(n)))
    w.add(*(f"_per{i} = 1.0 / _resolution{i} if _resolution{i} > 0.0 else 0.0" for i in range(n)))
    (_law if isinstance(f.loop, Structure) else _rule)(w)
    if f.dynamic:
        w.depth -= 1
        w.add("_now = _k % _nbuf")
        w.lanes()
        for j in range(p.nu):
            place = f"(_slot * {p.nu} + {j} + {len(p.rows)}) * {w.width} + _i"
            w.add("_slot = _now", f"W[{place}] = {{ua{j}}}")
            for name, gap in (("cn", "int({di})"), ("co", "int({di}) + 1")):
                # commands stand in a ring; a remainder would cost more than all else here
                w.add(
                    f"_slot = _now - ({gap})", "_slot = max(_slot + _nbuf if _slot < 0 else _slot, 0)",
                    f"_c = W[{place}]", f"_c = _c if _k >= {gap} else 0.0",
                )  # fmt: skip
                commanded(w, j, name[1])
                w.add(*_force_lines(w, j, f"{{{name}{j}}}", "_c"))


ROUNDING = """
@exact
def rounded(x, per, step):
    \"\"\"A number as an encoder or a converter rounds it; a step of 0 is none.\"\"\"
    y = floor(x * per + 0.5) * step
    return y if step > 0.0 else x
"""


def _put(w: Writer, j: int) -> None:
    """Command ``_c`` of the controller, limited and put out."""
    f = w.p.flavour
    if not f.record:
        w.add(f"{{sat{j}}} += 1.0 if abs(_c) > {{lim{j}}} else 0.0")
    _clip(w, j, "cn" if f.dynamic else "um")
    w.add(f"{{ua{j}}} = _c")


def _read(w: Writer) -> None:
    """References of this sample; steps of the converters; then, lane by lane, what the encoders show."""
    p, law = w.p, w.p.flavour.loop
    if law and law.references:
        w.lanes()
        w.add("_m = min(max(START[_base + _i] + _k, 0), R.shape[0] - 1)")
        w.add(*(f"{{ref{c}}} = R[_m, {c}]" for c in range(law.references)))
        w.depth -= 1
    for j in range(p.nu):
        w.add(f"_step{j} = FL[{p.n + 2 + j}]", f"_steps{j} = 1.0 / _step{j} if _step{j} > 0.0 else 0.0")
    w.lanes()
    for i in range(p.n):
        w.add(f"_y{i} = rounded({{q{i}}}, _per{i}, _resolution{i})")


def _rule(w: Writer) -> None:
    """A controller given as a function, `Rule`."""
    p, rule = w.p, w.p.flavour.loop
    assert isinstance(rule, Written)  # asked before
    _read(w)
    names = (
        [f"_y{i}" for i in range(p.n)],
        *(
            [f"{{{c}{i}}}" for i in range(size)]
            for c, size in (("ref", rule.references), ("z", rule.states), ("rp", rule.parameters))
        ),
    )
    args = ", ".join(f"({''.join(f'{name}, ' for name in group)})" for group in names)
    w.add(f"_put, _memory = rule((START[_base + _i] + _k) * _dt, {args})")
    for j in range(p.nu):
        w.add(f"_c = rounded({{ff{j}}} + _put[{j}], _steps{j}, _step{j})")
        _put(w, j)
    w.add(*(f"{{z{i}}} = _memory[{i}]" for i in range(rule.states)))


def _law(w: Writer) -> None:
    """A linear controller with a state of its own, `Law`."""
    p, law = w.p, w.p.flavour.loop
    assert isinstance(law, Structure)  # asked before
    _read(w)
    args = [name if name.startswith("_") else f"{{{name}}}" for name in _law_arguments(p, law)]
    outputs = [f"_c{j}" for j in range(p.nu)] + [f"{{z{i}}}" for i in range(len(law.A))]
    w.add(f"({', '.join(outputs)},) = law({', '.join(args)})")
    for j in range(p.nu):
        w.add(f"_c = _c{j}")
        _put(w, j)


def _law_arguments(p: Layout, law: Structure) -> list[str]:
    readings, inputs = range(p.n), range(p.nu)
    rounding = [f"_step{s}{j}" for j in inputs for s in ("s", "")]
    limits = [f"lim{j}" for j in inputs] if law.hold else []
    references = [f"ref{c}" for c in range(law.references)]
    return [*(f"ff{j}" for j in inputs), *(f"_y{i}" for i in readings), *references, *p.numbers, *rounding, *limits]


def law_text(p: Layout) -> str:
    """Text of ``law(...)``: commands, rounded, and what a `Law` remembers next; 0 and 1 of its A and B are left out.

    Every operation is rounded by itself and sums run from left to right, so that the law on a rig's own computer can
    repeat the commands bit for bit.
    """
    law = p.flavour.loop
    assert isinstance(law, Structure)  # asked before
    memory = [f"z{i}" for i in range(len(law.A))]
    signals = [f"_w{i}" for i in range(p.n)] + [f"ref{c}" for c in range(law.references)]

    def terms(of: str, row: int, values: list[str], known: Sequence[float | None]) -> list[str]:
        factors = ["" if k == 1 else f"l{of}{row}_{i} * " for i, k in enumerate(known)]
        return [f + x for f, x, k in zip(factors, values, known, strict=True) if k != 0]

    lines = [f"_w{i} = _y{i} - tg{i}" for i in range(p.n)] + ["_over = 0.0"] * law.hold
    for j in range(p.nu):
        both = terms("C", j, memory, [None] * len(memory)) + terms("D", j, signals, [None] * len(signals))
        lines.append(f"_c{j} = rounded({' + '.join([f'ff{j}', *both])}, _steps{j}, _step{j})")
        lines += [f"_over = 1.0 if abs(_c{j}) > lim{j} else _over"] * law.hold
    for i, (a, b) in enumerate(zip(law.A, law.B, strict=True)):
        lines.append(f"_z{i} = {' + '.join(terms('A', i, memory, a) + terms('B', i, signals, b)) or '0.0'}")
    for i, row in enumerate(law.A):  # at the limit sums stand still; what differences and filters remember goes on
        if law.hold and all(k in (None, float(i == j)) for j, k in enumerate(row)):
            sums = "".join(f" & (lA{i}_{j} == {float(i == j)})" for j, k in enumerate(row) if k is None)
            lines.append(f"_z{i} = z{i} if (_over != 0.0){sums} else _z{i}")
    outputs = [f"_c{j}" for j in range(p.nu)] + [f"_z{i}" for i in range(len(law.A))]
    body = "\n".join(f"    {line}" for line in [*lines, f"return ({', '.join(outputs)},)"])
    return f"@exact\ndef law({', '.join(_law_arguments(p, law))}):\n{body}\n"


RUN_ARGUMENTS = (
    "_b0, _b1, _total, P, X0, U, R, START, HELD, HBASE, _first, _end, _nsteps, _every, _substeps, _dt, FL, "
    "_nbuf, OUT, STAT, W, _events"
)
"""What ``run_L`` takes.

A motion in one call has `_first` 0 and `_end` after `_nsteps`, the sample that nothing follows. One block's motion in
several calls has an `_end` where the next `_first` goes on from ``W`` as it was left, and no `_nsteps` that it reaches.
Rows of ``OUT`` are counted from `_first`.
"""


def room(p: Layout, width: int, buffer: int) -> int:
    """Size of the working array ``W``: the lanes' numbers, commands still on their way, the search of events."""
    late = buffer * p.nu * width if p.flavour.loop and p.flavour.dynamic else 0
    return len(p.rows) * width + late + (places(p)["END"] if p.flavour.dry else 0)


def run_text(p: Layout, width: int) -> str:
    """Text of ``run_{width}``."""
    w = Writer(p, width)
    w.add(
        "_h = _dt / _substeps",
        "_last = U.shape[0] - 1",
        "_final = HELD.shape[0] - 1",
        "for _b in range(_b0, _b1):",
    )
    w.depth = 2
    w.add(f"_base = _b * {width}", f"_valid = min({width}, _total - _base)", "if _first == 0:")
    w.depth = 3
    w.add("W[:] = 0.0")
    w.lanes()
    start(w)
    w.depth = 2
    w.add("for _k in range(_first, _end):")
    for part in (prescribed, controller if p.flavour.loop else open_loop, _record if p.flavour.record else _reduce):
        w.depth = 3
        part(w)
    w.depth = 3
    w.add("if _k == _nsteps:", "    break", "for _j in range(_substeps):")
    w.depth = 4
    _substep(w)
    if not p.flavour.record:
        w.depth = 2
        w.lanes()
        names = _statistics(p)
        w.add(*(f"STAT[{r}, _base + _i] = {{{name}}}" for r, name in enumerate(names)))
    return f"@entry\ndef run_{width}({RUN_ARGUMENTS}):\n" + "\n".join(w.lines) + "\n"


def _statistics(p: Layout) -> list[str]:
    n = range(p.n)
    ends = [f"{c}{i}" for i in n for c in "qv"]
    return [*(f"mx{i}" for i in n), *(f"er{i}" for i in n), *(f"sat{j}" for j in range(p.nu)), *ends]


def _record(w: Writer) -> None:
    p = w.p
    w.add("if (_k - _first) % _every == 0:")
    w.depth += 1
    w.add("_row = (_k - _first) // _every")
    columns = [f"{c}{i}" for i in range(p.n) for c in "qv"]
    columns += [f"ua{j}" for j in range(p.nu)] if p.flavour.loop else []
    for c, name in enumerate(columns):
        # ua holds the command only between controller and substep, where this line stands
        w.add(f"for _i in range({w.width}):", f"    OUT[_row, {c}, _base + _i] = {{{name}}}")
    for c, name in enumerate(p.carried, len(columns)):
        w.add(f"for _i in range({w.width}):", f"    OUT[_row, {c}, _base + _i] = {_from_now(p, name)}{{{name}}}")


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
                # read both before one is chosen: a load under a condition would need a jump
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
        w.add(f"            events(W[_i:], W[W.size - {end}:], {w.width}, _h)")
