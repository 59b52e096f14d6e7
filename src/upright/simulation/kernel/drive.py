"""What does the drive do besides its command: trip, brake while it is powered, lose force at speed?

Text for one input of a kernel. ``u_eff = F_c(u, v) on(t) - slope v - B``, where the braking ``B = D(t) v`` may need a
time to build up and to fade, ``relaxation B' + B = D(t) v``, as the current of a winding does. There ``on`` is 1
between start and end, ``D = (damping + damping_rise |command|) on(t) [command is not zero] + standby [t < end]``, and
the force ``u`` loses `fade` for each unit of speed beyond `knee` in its own direction, down to zero at most. What then
reaches the body, the slope's part included and the braking's not, is no larger than `force_limit`. A commanded drive
brakes no harder beyond the knee than at it, so that `knee` joins a steep and a flat part of a torque-speed curve.
``on`` and ``D`` switch inside a substep: there the straight line with the same mean and first moment stands for them,
as for a delayed command, so that the motion depends continuously on when.
"""

from __future__ import annotations

from upright.simulation.kernel.flavour import Flavour, Layout, Writer


def nodes(f: Flavour) -> list[str]:
    """What a step needs at its start, middle and end besides the input: shares of the time, damping or braking."""
    braking = ["bk"] if f.relaxation else ["dm"] * f.damping + ["cs"] * (f.damping and f.curve)
    return ["on"] * (f.gate and f.curve) + braking


def force(p: Layout) -> list[str]:
    """Lines that turn the requested force of a drive into the one it gives at the speed it has."""
    f, lines = p.flavour, list[str]()
    for j, u in enumerate(p.derived.inputs if f.dynamic else ()):
        v, lost = p.velocities[p.drives[j]], f"_sl{j}"
        if f.curve:
            lines += [
                f"_z = ({v} if {u} > 0.0 else -{v}) - _kn{j}",
                f"_w = abs({u}) - _fd{j} * (_z if _z > 0.0 else 0.0)",
                "_w = _w if _w > 0.0 else 0.0",
            ]
            if f.damping and not f.relaxation:
                lines.append(f"_vb{j} = {_braked(v, u, f'_cs{j}')}")
            lines.append(f"{u} = _w if {u} > 0.0 else -_w")
            lines += [f"{u} = {u} * _on{j}"] if f.gate else []
        if f.damping and not f.relaxation:
            braking = f" - _dm{j} * {f'_vb{j}' if f.curve else v}"
        else:
            braking = f" - _bk{j}" if f.relaxation else ""
        if f.capped:
            lines += [
                f"_w = {u} - {lost} * {v}",
                f"_w = _fl{j} if _w > _fl{j} else _w",
                f"{u} = (0.0 - _fl{j} if _w < 0.0 - _fl{j} else _w){braking}",
            ]
        else:
            lines.append(f"{u} = {u} - {lost} * {v}{braking}")
    return lines


def _braked(v: str, u: str, share: str) -> str:
    """Speed at which a drive brakes whose speed lies ``_z`` beyond the knee, for the share of time commanded."""
    return f"{v} - {share} * ((_z if {u} > 0.0 else -_z) if _z > 0.0 else 0.0)"


def begin(w: Writer, j: int, row: dict[str, int]) -> None:
    """Numbers of input `j` that stay for one lane; `row` says where each parameter stands."""
    f = w.p.flavour
    wanted: list[str] = []
    if f.gate:
        # moments in substeps after the lane's own first one
        w.add(
            f"{{ge{j}}} = P[{row['end']}, _m] / _h - START[_m] * _substeps",
            f"_z = P[{row['start']}, _m] / _h - START[_m] * _substeps",
            f"{{gs{j}}} = _z if _z < {{ge{j}}} else {{ge{j}}}",
        )
        wanted += ["start", "end"]
    if f.damping:
        w.add(f"{{dc{j}}} = P[{row['damping']}, _m]", f"{{ds{j}}} = P[{row['standby']}, _m]")
    if f.rising:
        w.add(f"{{dr{j}}} = P[{row['damping_rise']}, _m]")
    if f.relaxation:
        w.add(
            f"_z = P[{row['relaxation']}, _m]",
            f"{{rt{j}}} = _z",
            f"{{re{j}}} = falling(_h / _z) if _z > 0.0 else 0.0",
            f"{{rh{j}}} = falling(0.5 * _h / _z) if _z > 0.0 else 0.0",
            f"{{vp{j}}} = {{v{w.p.drives[j]}}}",
        )
        wanted.append("relaxation")
    if f.curve:
        w.add(f"{{_kn{j}}} = P[{row['knee']}, _m]", f"{{_fd{j}}} = P[{row['fade']}, _m]")
        wanted += ["knee", "fade"]
    if f.capped:
        w.add(f"{{_fl{j}}} = P[{row['force_limit']}, _m]")
        wanted.append("force_limit")
    wanted += ["droop"] * f.droop
    for name in wanted:
        # comparisons would let it pass unseen
        w.add(f"_z = P[{row[name]}, _m]", "if not (_z == _z):", "    {q0} = nan")


def commanded(w: Writer, j: int, place: str) -> None:
    """Whether the command ``_c`` of this sample or of the one before is not zero."""
    if w.p.flavour.damping:
        w.add(f"{{z{place}{j}}} = 1.0 if _c != 0.0 else 0.0")
    if w.p.flavour.rising:
        w.add("_z = abs(_c)", f"{{y{place}{j}}} = {{lim{j}}} if _z > {{lim{j}}} else _z")


def _step_down(name: str, slope: str, moment: str) -> list[str]:
    """Lines for what is 1 until a moment and 0 after it, both counted in this substep."""
    return [
        f"{name} = {moment}",
        f"{name} = 0.0 if {name} < 0.0 else {name}",
        f"{name} = 1.0 if {name} > 1.0 else {name}",
        f"{slope} = 3.0 * {name} * ({name} - 1.0)",
    ]


def substep(w: Writer, j: int) -> None:
    """Input `j` during one substep, once lag and delay have given it."""
    f = w.p.flavour
    if f.relaxation:
        _build_up(w, j)
    if f.gate:
        w.add("_here = float(_k * _substeps + _j)")
        w.add(*_step_down("_ne", "_de", f"{{ge{j}}} - _here"), *_step_down("_ns", "_ds", f"{{gs{j}}} - _here"))
        w.add("_r = _ne - _ns", "_d = _de - _ds", "_oa = _r - _d", "_om = _r", "_ob = _r + _d")
        if f.curve:
            w.add(*(f"{{on{c}{j}}} = _o{c}" for c in "amb"))
        else:
            w.add(*(f"{{u{c}{j}}} = {{u{c}{j}}} * _o{c}" for c in "amb"))
    if f.damping:
        w.add(*_step_down("_p", "_z", f"{{df{j}}} * _substeps - _j"), f"_d = {{zo{j}}} - {{zn{j}}}")
        for c, side in zip("amb", ("- ", None, "+ "), strict=True):
            at = f"{side}_z" if side else ""
            on, alive = (f" * _o{c}", f" * (_ne {side}_de)" if side else " * _ne") if f.gate else ("", "")
            w.add(f"_r = ({{zn{j}}} + _d * (_p {at})){on}", f"{{dm{c}{j}}} = {{dc{j}}} * _r + {{ds{j}}}{alive}")
            if f.rising:
                rise = f"({{yn{j}}} + ({{yo{j}}} - {{yn{j}}}) * (_p {at})){on}"
                w.add(f"{{dm{c}{j}}} = {{dm{c}{j}}} + {{dr{j}}} * {rise}")
            if f.curve:
                w.add(f"{{cs{c}{j}}} = _r")
    if f.relaxation:
        _braking(w, j)


def _build_up(w: Writer, j: int) -> None:
    """Braking at the end of the substep before, whose damping is still there; none at the first sample."""
    v = f"{{v{w.p.drives[j]}}}"
    w.add(f"_v = {v}")
    if w.p.flavour.curve:
        w.add(f"_z = ({v} if {{um{j}}} > 0.0 else -{v}) - {{_kn{j}}}")
        w.add(f"_v = {_braked(v, f'{{um{j}}}', f'{{csm{j}}}')}")
    w.add(
        f"_a = (_v - {{vp{j}}}) / _h",
        f"_z = {{bk{j}}} - {{dmm{j}}} * ({{vp{j}}} - {{rt{j}}} * _a)",
        f"{{bk{j}}} = {{dmm{j}}} * (_v - {{rt{j}}} * _a) + _z * {{re{j}}}",
        f"{{vp{j}}} = _v",
        f"{{bka{j}}} = {{bk{j}}}",
    )


def _braking(w: Writer, j: int) -> None:
    """Braking in the middle and at the end of this substep, if the speed changes as it did in the one before."""
    w.add(f"_z = {{bk{j}}} - {{dmm{j}}} * (_v - {{rt{j}}} * _a)")
    for c, part, left in (("m", "0.5 * _h", "rh"), ("b", "_h", "re")):
        w.add(f"{{bk{c}{j}}} = {{dmm{j}}} * (_v + (" + f"{part} - {{rt{j}}}) * _a) + _z * {{{left}{j}}}")
