"""What drives the plant from one sample to the next: a command, a controller, a hand that moves a coordinate?"""

from __future__ import annotations

from collections.abc import Sequence

from upright.laws.linear import Structure
from upright.laws.rule import Written
from upright.simulation.kernel.drive import commanded
from upright.simulation.kernel.writer import Writer


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
    w.add(f"{{{name}{j}}} = {{gain{j}}} * (_c + {{off{j}}})")


def _feed(w: Writer, back: tuple[tuple[str, str], ...]) -> None:
    """Input samples of each lane, which may start at different places of the record."""
    w.lanes()
    for name, index in back:
        w.add(f"_m = min(max({index}, 0), _last)")
        w.add(*(f"{{{name}{j}}} = U[_m, {j}]" for j in range(w.p.nu)))
    w.depth -= 1


def command(w: Writer) -> None:
    """Open loop: command, limit, offset and gain."""
    p, f = w.p, w.p.flavour
    now = "START[_base + _i] + _k"
    w.add("if _last >= 0:")
    w.depth += 1
    _feed(w, (("ff", f"{now} - int64({{di}})"), ("fo", f"{now} - int64({{di}}) - 1")) if f.dynamic else (("ff", now),))
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
    w.add(*(f"_quantum{i} = FL[{i}]" for i in range(n)))
    w.add(*(f"_per{i} = 1.0 / _quantum{i} if _quantum{i} > 0.0 else 0.0" for i in range(n)))
    (_law if isinstance(f.loop, Structure) else _rule)(w)
    if f.dynamic:
        w.depth -= 1
        w.lanes()
        for j in range(p.nu):
            place = f"(_slot * {p.nu} + {j} + {len(p.rows)}) * {w.width} + _i"
            w.add("_slot = _k % _nbuf", f"W[{place}] = {{ua{j}}}")
            for name, back in (("cn", "int64({di})"), ("co", "int64({di}) - 1")):
                gap = back if name == "cn" else "int64({di}) + 1"
                w.add(f"_slot = (_k - ({gap})) % _nbuf", f"_c = W[{place}]", f"_c = _c if _k >= {gap} else 0.0")
                commanded(w, j, name[1])
                w.add(f"{{{name}{j}}} = {{gain{j}}} * (_c + {{off{j}}})")


def _encoder(w: Writer, i: int) -> None:
    w.add(
        f"_y{i} = floor({{q{i}}} * _per{i} + 0.5) * _quantum{i}",
        f"_y{i} = _y{i} if _quantum{i} > 0.0 else {{q{i}}}",
    )


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
        _encoder(w, i)


def _converted(j: int) -> tuple[str, str]:
    """Command ``_c`` as the converter rounds it."""
    return (f"_z = floor(_c * _steps{j} + 0.5) * _step{j}", f"_c = _z if _step{j} > 0.0 else _c")


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
    given = ", ".join(f"({''.join(f'{name}, ' for name in group)})" for group in names)
    w.add(f"_put, _kept = rule((START[_base + _i] + _k) * _dt, {given})")
    for j in range(p.nu):
        w.add(f"_c = {{ff{j}}} + _put[{j}]", *_converted(j))
        _put(w, j)
    w.add(*(f"{{z{i}}} = _kept[{i}]" for i in range(rule.states)))


def _law(w: Writer) -> None:
    """A linear controller with a state of its own, `Law`; what is 0 or 1 of its A and B is not computed."""
    p, law = w.p, w.p.flavour.loop
    assert isinstance(law, Structure)  # asked before
    _read(w)
    w.add(*(f"_y{i} = _y{i} - {{tg{i}}}" for i in range(p.n)))
    memory = [f"{{z{i}}}" for i in range(len(law.A))]
    signals = [f"_y{i}" for i in range(p.n)] + [f"{{ref{c}}}" for c in range(law.references)]

    def terms(of: str, row: int, values: list[str], known: Sequence[float | None]) -> list[str]:
        factors = ["" if k == 1 else f"{{l{of}{row}_{i}}} * " for i, k in enumerate(known)]
        return [f + x for f, x, k in zip(factors, values, known, strict=True) if k != 0]

    w.add(*["_over = 0.0"] * law.hold)
    for j in range(p.nu):
        both = terms("C", j, memory, [None] * len(memory)) + terms("D", j, signals, [None] * len(signals))
        w.add(f"_c = {' + '.join([f'{{ff{j}}}', *both])}", *_converted(j))
        w.add(*[f"_over = 1.0 if abs(_c) > {{lim{j}}} else _over"] * law.hold)
        _put(w, j)
    for i, (a, b) in enumerate(zip(law.A, law.B, strict=True)):
        w.add(f"_z{i} = {' + '.join(terms('A', i, memory, a) + terms('B', i, signals, b)) or '0.0'}")
    for i, row in enumerate(law.A):  # at the limit sums stand still; what differences and filters remember goes on
        if law.hold and all(k in (None, float(i == j)) for j, k in enumerate(row)):
            sums = "".join(f" & ({{lA{i}_{j}}} == {float(i == j)})" for j, k in enumerate(row) if k is None)
            w.add(f"_z = {{z{i}}}", f"_z{i} = _z if (_over != 0.0){sums} else _z{i}")
        w.add(f"{{z{i}}} = _z{i}")
