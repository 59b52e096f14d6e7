"""How fast does the plant accelerate, written out for one kernel?

Text of the acceleration, of one Runge-Kutta step, and of mass matrix and forces for the search of events. Where a joint
acts on several coordinates (``theta_2 - theta_1``), dry friction is solved for in coordinates ``z = T q`` of which each
joint is one, ``S' M S z'' = S' f`` with ``q = S z``; the state stays q.
Names that start with an underscore are ours, so that they cannot meet a plant's.
"""

from __future__ import annotations

from upright.physics.combination import spelled
from upright.simulation.kernel.drive import force, nodes
from upright.simulation.kernel.flavour import Layout


def arguments(p: Layout) -> list[str]:
    """Arguments of the acceleration, in order."""
    f = p.flavour
    return [
        *p.derived.coordinates,
        *p.velocities,
        *p.derived.inputs,
        *(f"_s{i}" for i in f.dry),
        *(f"_y{i}" for i in f.dahl),
        *(f"_ah{i}" for i in f.held),
        *(f"_{c}{j}" for c in nodes(f) for j in range(p.nu)),
        *p.constants,
    ]


def _forces(p: Layout) -> tuple[list[str], dict[tuple[int, int], str]]:
    """Lines that compute mass matrix and forces of the joints; and the name of each entry that is not zero.

    Free coordinates only, ``z`` where a joint acts on several of them.
    """
    d, f = p.derived, p.flavour
    lines = force(p)
    lines += [f"{s}, {c} = sincos({x})" for s, c, x in d.trig]
    lines += [f"{name} = {text}" for name, text in d.steps]
    entries = {(i, j): d.mass[k] for k, (i, j) in enumerate((i, j) for i in range(p.n) for j in range(i, p.n))}
    names: dict[tuple[int, int], str] = {}
    for (i, j), text in entries.items():
        if text.strip() not in ("0", "0.0") and not (i in f.held and j in f.held):
            lines.append(f"_m{i}_{j} = {text}")
            names[i, j] = names[j, i] = f"_m{i}_{j}"
    pull = {i: "".join(f" - {names[i, j]} * _ah{j}" for j in f.held if (i, j) in names) for i in p.free}
    force_of = {i: f"({d.force[i]})" for i in p.free}
    names = {k: name for k, name in names.items() if k[0] in p.free and k[1] in p.free}
    if p.slanted:
        lines += [f"_o{i} = {force_of[i]}{pull[i]}" for i in p.free]
        more, names = _turned(p, names)
        lines += more
        force_of = {i: spelled(p.from_joints[:, k], [f"_o{j}" for j in p.free]) for k, i in enumerate(p.free)}
        pull = dict.fromkeys(p.free, "")
    for i in p.free:
        v, text = p.velocities[i], force_of[i]
        if i in {*f.dry, *f.dahl, *f.drag}:
            v = spelled(p.joints[i], p.velocities)
        level = f"_Fc{i}"
        if i in f.stribeck:
            lines += [f"_r = {v} * _iv{i}", f"_lv{i} = _Fc{i} + (_Fs{i} - _Fc{i}) * falling(_r * _r)"]
            level = f"_lv{i}"
        if i in f.dry:
            text += f" - _s{i} * ({level}" + (f" + _cq{i} * {v} * {v})" if i in f.drag else ")")
        elif i in f.drag:
            text += f" - _cq{i} * {v} * abs({v})"
        if i in f.dahl:
            text += f" - _y{i} * {level}"
        lines.append(f"_f{i} = {text}{pull[i]}")
    return lines, names


def _turned(p: Layout, mass: dict[tuple[int, int], str]) -> tuple[list[str], dict[tuple[int, int], str]]:
    """Lines that compute the mass matrix of the joints, ``S' M S``, and the names of its entries."""
    lines, names = list[str](), dict[tuple[int, int], str]()
    S = p.from_joints
    for a, i in enumerate(p.free):
        for b, j in enumerate(p.free[: a + 1]):
            pairs = {(min(k, m), max(k, m)): 0.0 for k, m in mass}
            for c, k in enumerate(p.free):
                for d, m in enumerate(p.free):
                    if (k, m) in mass:
                        pairs[min(k, m), max(k, m)] += float(S[c, a] * S[d, b])
            text = spelled(pairs.values(), [mass[pair] for pair in pairs])
            if text != "0.0":
                lines.append(f"_n{j}_{i} = {text}")
                names[i, j] = names[j, i] = f"_n{j}_{i}"
    return lines, names


def _solution(p: Layout, mass: dict[tuple[int, int], str]) -> list[str]:
    """Lines that solve for the accelerations; a stuck joint's row and column become those of the unit matrix."""
    f, free = p.flavour, p.free
    lines = [f"_free{i} = _s{i} * _s{i}" for i in f.dry]
    right = {i: f"_b{i}" if i in f.dry else f"_f{i}" for i in free}
    lines += [f"_b{i} = _f{i} * _free{i}" for i in f.dry]
    m = dict(mass)
    for i in free:
        for j in free:
            mask = " * ".join(f"_free{k}" for k in (i, j) if k in f.dry)
            if i < j and (i, j) in m and mask:
                lines.append(f"_c{i}_{j} = {m[i, j]} * ({mask})")
                m[i, j] = m[j, i] = f"_c{i}_{j}"
    if len(free) == 2 and (free[0], free[1]) in m:
        i, j = free
        lines.append(f"_d = 1.0 / ({m[i, i]} * {m[j, j]} - {m[i, j]} * {m[i, j]})")
        lines.append(f"_a{i} = ({m[j, j]} * {right[i]} - {m[i, j]} * {right[j]}) * _d")
        lines.append(f"_a{j} = ({m[i, i]} * {right[j]} - {m[i, j]} * {right[i]}) * _d")
        return lines
    return lines + _elimination(free, m, right)


def _elimination(free: tuple[int, ...], m: dict[tuple[int, int], str], right: dict[int, str]) -> list[str]:
    """Lines of L D L' without the entries that stay zero."""
    lines: list[str] = []
    low: set[tuple[int, int]] = set()
    for j in free:
        before = [k for k in free if k < j]
        pivot = m[j, j] + "".join(f" - _l{j}_{k} * _w{j}_{k}" for k in before if (j, k) in low)
        lines.append(f"_r{j} = 1.0 / ({pivot})")
        for i in (i for i in free if i > j):
            terms = [f" - _l{i}_{k} * _w{j}_{k}" for k in before if (i, k) in low and (j, k) in low]
            if (i, j) in m or terms:
                lines.append(f"_w{i}_{j} = {m.get((i, j), '0.0')}" + "".join(terms))
                lines.append(f"_l{i}_{j} = _w{i}_{j} * _r{j}")
                low.add((i, j))
    for i in free:
        lines.append(f"_z{i} = {right[i]}" + "".join(f" - _l{i}_{k} * _z{k}" for k in free if (i, k) in low))
    for i in reversed(free):
        lines.append(f"_a{i} = _z{i} * _r{i}" + "".join(f" - _l{k}_{i} * _a{k}" for k in free if (k, i) in low))
    return lines


def acceleration(p: Layout) -> str:
    """Text of ``acceleration(...)``: accelerations of the free coordinates, then what dry joints would have to hold."""
    lines, mass = _forces(p)
    lines += _solution(p, mass)
    held = []
    for i in p.flavour.dry:
        pull = "".join(f" - {mass[i, j]} * _a{j}" for j in p.free if j != i and (i, j) in mass)
        held.append(f"(1.0 - _free{i}) * abs(_f{i}{pull})")
    accelerations = [spelled(row, [f"_a{i}" for i in p.free]) for row in p.from_joints]
    result = ", ".join(accelerations + held or ["0.0"])  # with all coordinates held nothing is left
    return _function("@inline", "acceleration", arguments(p), [*lines, f"return ({result},)"])


def terms(p: Layout, places: dict[str, int]) -> str:
    """Text of ``terms(..., _S)``: mass matrix, row by row, and forces of the free coordinates, where `places` says."""
    lines, mass = _forces(p)
    place = {c: k for k, c in enumerate(p.free)}
    n = len(p.free)
    for i in p.free:
        lines += [f"_S[{places['MASS'] + n * place[i] + place[j]}] = {mass.get((i, j), '0.0')}" for j in p.free]
        lines.append(f"_S[{places['FORCE'] + place[i]}] = _f{i}")
    return _function("@inline", "terms", [*arguments(p), "_S"], lines)


def step_arguments(p: Layout) -> list[str]:
    """Arguments of one Runge-Kutta step, in order."""
    f, u = p.flavour, range(p.nu)
    return [
        "_h",
        *(f"_q{i}" for i in p.free),
        *(f"_v{i}" for i in p.free),
        *(f"_{c}{s}{j}" for c in ("u", *nodes(f)) for s in "amb" for j in u),
        *(f"_h{c}{i}{s}" for i in f.held for s in "amb" for c in "qva"),
        *(f"_s{i}" for i in f.dry),
        *(f"_y{i}" for i in f.dahl),
        *p.constants,
    ]


def step(p: Layout) -> str:
    """Text of ``step(...)``: state after one classical Runge-Kutta step, and a flag when a dry joint changed mode.

    Input and prescribed motion are given at the start (a), middle (m) and end (b) of the step.
    """
    f, free = p.flavour, p.free
    lines = ["_hh = 0.5 * _h"]

    def stage(k: int, when: str, shift: str, speed: str) -> None:
        """One evaluation: coordinates moved by `shift`, velocities called `speed`, each with its number."""
        call: list[str] = []
        call += [
            f"_h{'q'}{i}{when}" if i in f.held else (f"_q{i} + {shift}{i}" if shift else f"_q{i}") for i in range(p.n)
        ]
        call += [f"_h{'v'}{i}{when}" if i in f.held else f"{speed}{i}" for i in range(p.n)]
        call += [f"_u{when}{j}" for j in range(p.nu)] + [f"_s{i}" for i in f.dry]
        for i in f.dahl:
            lines.extend(_presliding(i, f"_y{k}_", p.along(i, lambda j: f"{shift}{j}")) if shift else [])
        call += [(f"_y{k}_{i}" if shift else f"_y{i}") for i in f.dahl]
        call += [f"_ha{i}{when}" for i in f.held]
        call += [f"_{c}{when}{j}" for c in nodes(f) for j in range(p.nu)] + list(p.constants)
        result = [f"_a{k}_{i}" for i in free] + [f"_e{k}_{i}" for i in f.dry]
        result = result or ["_nothing"]
        lines.append(f"({', '.join(result)},) = acceleration({', '.join(call)})")

    stage(1, "a", "", "_v")
    for k, (when, weight, before) in enumerate(
        (("m", "_hh", "_v"), ("m", "_hh", "_p2_"), ("b", "_h", "_p3_")), start=2
    ):
        lines += [f"_g{k}_{i} = {weight} * {before}{i}" for i in free]
        lines += [f"_p{k}_{i} = _v{i} + {weight} * _a{k - 1}_{i}" for i in free]
        stage(k, when, f"_g{k}_", f"_p{k}_")
    lines.append("_h6 = _h * (1.0 / 6.0)")
    for i in free:
        lines.append(f"_g5_{i} = _h6 * (_v{i} + 2.0 * _p2_{i} + 2.0 * _p3_{i} + _p4_{i})")
        lines.append(f"_nq{i} = _q{i} + _g5_{i}")
        lines.append(f"_nv{i} = _v{i} + _h6 * (_a1_{i} + 2.0 * _a2_{i} + 2.0 * _a3_{i} + _a4_{i})")
    for i in f.dahl:
        lines += _presliding(i, "_ny", p.along(i, lambda j: f"_g5_{j}"))
    result = [f"_nq{i}" for i in free] + [f"_nv{i}" for i in free] + [f"_ny{i}" for i in f.dahl]
    if f.dry:
        lines.append("_flag = 0.0")
        for i in f.dry:
            lines.append(f"_w = _s{i} * {p.along(i, lambda j: f'_nv{j}')}")
            for k in (2, 3, 4):
                speed = p.along(i, lambda j, k=k: f"_p{k}_{j}")
                lines += [f"_z = _s{i} * {speed}", "_w = _z if _z < _w else _w"]
            lines.append(f"_z = _e4_{i} if _e4_{i} > _e1_{i} else _e1_{i}")
            lines.append(f"_flag = 1.0 if (_w < 0.0) | (_z > _Fs{i}) else _flag")
        result.append("_flag")
    return _function("@inline", "step", step_arguments(p), [*lines, f"return ({', '.join(result or ['0.0'])},)"])


def _presliding(i: int, target: str, way: str) -> list[str]:
    """Dahl's deflection after the way `way`: exact, because it depends on the way alone."""
    return [
        f"_z = 1.0 if {way} > 0.0 else -1.0",
        f"{target}{i} = _z + (_y{i} - _z) * falling(abs({way}) * _id{i})",
    ]


def _function(decorator: str, name: str, args: list[str], lines: list[str]) -> str:
    body = "\n".join(f"    {line}" for line in lines)
    return f"{decorator}\ndef {name}({', '.join(args)}):\n{body}\n"
