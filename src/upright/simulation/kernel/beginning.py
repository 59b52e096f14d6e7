"""What does a lane know before its first sample: constants, initial state, modes, what the actuator remembers?"""

from __future__ import annotations

import re

from upright.physics.actuator import ACTUATOR
from upright.simulation.kernel.drive import begin
from upright.simulation.kernel.writer import Writer

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
    for j in d.joints:
        i = j.coordinate
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
            if i in on:
                w.add(f"{{{name}{i}}} = 1.0 if {{v{i}}} > 0.0 else (-1.0 if {{v{i}}} < 0.0 else 0.0)")
    w.add(*(f"{{hb{i}}} = HBASE[{k}, _m]" for k, i in enumerate(f.held)))
    for j in range(p.nu):
        for k, name in enumerate(("gain", "off", "lim")):
            w.add(f"{{{name}{j}}} = P[{first + k * p.nu + j}, _m]")
        if f.dynamic:
            _actuator(w, j, first)
    law = first + len(ACTUATOR) * p.nu
    w.add(*(f"{{{name}}} = P[{law + r}, _m]" for r, name in enumerate(p.numbers)))


def _actuator(w: Writer, j: int, first: int) -> None:
    """Lag, delay and slope of input `j`; the lag starts from what the input was before."""
    p, loop, nu = w.p, w.p.flavour.loop, w.p.nu
    row = {name.removeprefix("actuator."): first + k * nu + j for k, name in enumerate(ACTUATOR)}
    w.add(
        f"{{_sl{j}}} = P[{row['slope']}, _m]",
        f"_tau = P[{row['lag']}, _m]",
        "_x = _h / _tau if _tau > 0.0 else 1e300",
        f"{{e{j}}} = exp(-_x)",
        f"{{th{j}}} = 1.0 / _x",
        f"_z = P[{row['delay']}, _m] / _dt" + (f" + FL[{p.n}]" if loop else ""),
        "if not (abs(_z) < 1e6) or not (_tau == _tau):",
        "    {q0} = nan",
        "    _z = 0.0",
        "_z = _z if _z > 0.0 else 0.0",
        "{di} = floor(_z)" if j == 0 else "",
        f"{{df{j}}} = _z - floor(_z)",
        # what is left at the end of a substep of a jump inside it
        f"{{ep{j}}} = exp(-_x * (1.0 - ({{df{j}}} * _substeps - floor({{df{j}}} * _substeps))))",
    )
    begin(w, j, row)
    if loop:
        w.add(f"{{w{j}}} = {{gain{j}}} * {{off{j}}}")
        return
    # settle the lag on the input before the first sample, which is held where the record does not reach
    w.add(
        "_n = START[_m] if 40.0 * _tau > _dt * START[_m] else int64(40.0 * _tau / _dt) + 1",
        "_n = min(_n, START[_m]) if _tau > 0.0 else 0",
        "for _k in range(-_n - 1, 0):",
    )
    w.depth += 1
    for name, back in (("_cn", 0), ("_co", 1)):
        w.add(
            f"_z = U[min(max(START[_m] + _k - int64({{di}}) - {back}, 0), _last), {j}] if _last >= 0 else 0.0",
            f"_z = {{lim{j}}} if _z > {{lim{j}}} else _z",
            f"_z = 0.0 - {{lim{j}}} if _z < 0.0 - {{lim{j}}} else _z",
            f"{name} = {{gain{j}}} * (_z + {{off{j}}})",
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
