"""One rig of every plant, and the same rig as an MJCF text: a new plant is tested by being listed here.

MuJoCo knows bodies, joints and springs, none of our equations.
"""

from dataclasses import dataclass
from pathlib import Path

from upright.physics import CartPendulum, DoublePendulum, FlexibleLink, Furuta, Pendulum, Plant, chain, find

EXAMPLES = Path(__file__).parents[2] / "examples" / "plants"
G = 9.81


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """A plant with values, its MJCF bodies, joints in the plant's order, and how far it may be thrown.

    `swing` and `speed` bound random initial coordinates and velocities; `substeps` per millisecond suffice the kernel.
    """

    plant: Plant
    bodies: str
    tendons: str = ""
    gravity: tuple[float, float, float] = (0.0, 0.0, -G)
    swing: float = 2.5
    speed: float = 3.0

    @property
    def mjcf(self) -> str:
        """Contacts off, no armature, fourth-order Runge and Kutta."""
        gravity = " ".join(repr(g) for g in self.gravity)
        return f"""<mujoco><compiler angle="radian" autolimits="false" inertiafromgeom="false" balanceinertia="false"/>
<option timestep="1e-3" integrator="RK4" gravity="{gravity}"><flag contact="disable" constraint="disable"/></option>
<worldbody>{self.bodies}</worldbody><tendon>{self.tendons}</tendon></mujoco>"""


def hinge(name: str, axis: str, damping: float = 0.0, stiffness: float = 0.0, kind: str = "hinge") -> str:
    return f'<joint name="{name}" type="{kind}" axis="{axis}" damping="{damping!r}" stiffness="{stiffness!r}"/>'


def inertial(mass: float, transverse: float, axial: float, down: float = 0.0) -> str:
    """A body symmetric about its own z axis, centre of gravity `down` below its frame."""
    return f'<inertial pos="0 0 {-down!r}" mass="{mass!r}" diaginertia="{transverse!r} {transverse!r} {axial!r}"/>'


def pendulum() -> Specimen:
    p = Pendulum(m_p=0.21, l_cg=0.23, J_p=1.7e-3, b_2=2e-3)
    body = hinge("theta", "0 1 0", p.b_2) + inertial(p.m_p, p.J_p, 1e-5, p.l_cg)
    return Specimen(plant=p, bodies=f"<body>{body}</body>")


def cart_pendulum() -> Specimen:
    p = CartPendulum(m_c=0.7, m_p=0.21, l_cg=0.23, J_p=1.7e-3, b_1=0.9, b_2=2e-3, k_x=4.0)
    # turning about -y carries the hanging rod towards +x
    swinging = f"<body>{hinge('theta', '0 -1 0', p.b_2)}{inertial(p.m_p, p.J_p, 1e-5, p.l_cg)}</body>"
    cart = hinge("x", "1 0 0", p.b_1, p.k_x, kind="slide") + inertial(p.m_c, 1e-3, 1e-3)
    return Specimen(plant=p, bodies=f"<body>{cart}{swinging}</body>")


def furuta(k_psi: float, tilt: tuple[float, float]) -> Specimen:
    values = {"m_p": 0.2, "l_cg": 0.15, "r": 0.2, "J_d": 0.01, "J_p": 5e-4, "J_a": 3e-5, "b_1": 4e-3, "b_2": 4e-4}
    p = Furuta(**values, k_psi=k_psi, tilt_x=tilt[0], tilt_y=tilt[1])
    rod = hinge("theta", "-1 0 0", p.b_2) + inertial(p.m_p, p.J_p, p.J_a, p.l_cg)
    arm = hinge("psi", "0 0 1", p.b_1, p.k_psi) + inertial(1.0, p.J_d / 2, p.J_d)
    level = (1 - tilt[0] ** 2 - tilt[1] ** 2) ** 0.5
    gravity = (G * tilt[0], G * tilt[1], -G * level)
    return Specimen(plant=p, bodies=f'<body>{arm}<body pos="{p.r!r} 0 0">{rod}</body></body>', gravity=gravity)


def shaken(bodies: int, kind: str) -> Specimen:
    """A chain: each body on its own joint to ground, neighbours joined by tendons."""
    letter, place, axis, joint = (
        ("m", "x", "1 0 0", "slide") if kind == "rectilinear" else ("J", "theta", "0 0 1", "hinge")
    )
    numbers = range(1, bodies + 1)
    inertia = {f"{letter}_{i}": (0.8, 0.6, 0.75, 0.5)[i - 1] for i in numbers} | {"a_1": 0.5}
    ground = {f"k_{i}": (30.0, 0.0, 90.0, 10.0)[i - 1] for i in numbers} | {f"c_{i}": 0.3 * i for i in numbers}
    links = {f"k_{i}{i + 1}": 180.0 + 20 * i for i in numbers[:-1]} | {f"c_{i}{i + 1}": 0.2 for i in numbers[:-1]}
    p = chain(bodies, kind)(**inertia, **ground, **links)
    values, placed, tendons = p.parameters(), "", ""
    for i in numbers:
        name, total = f"{place}_{i}", values[f"{letter}_{i}"] + values[f"a_{i}"]
        body = hinge(name, axis, values[f"c_{i}"], values[f"k_{i}"], kind=joint) + inertial(total, total / 2, total)
        placed += f"<body>{body}</body>"
        if i < bodies:
            spring = f'stiffness="{values[f"k_{i}{i + 1}"]!r}" damping="{values[f"c_{i}{i + 1}"]!r}" springlength="0 0"'
            ends = f'<joint joint="{name}" coef="-1"/><joint joint="{place}_{i + 1}" coef="1"/>'
            tendons += f"<fixed {spring}>{ends}</fixed>"
    return Specimen(plant=p, bodies=placed, tendons=tendons, swing=0.3, speed=2.0)


def double_pendulum() -> Specimen:
    p = find("double_pendulum.py:DoublePendulum", EXAMPLES)(
        m_1=0.3, m_2=0.2, l_1=0.25, a_1=0.12, a_2=0.15, J_1=2e-3, J_2=1.5e-3, b_1=4e-3, b_2=3e-3
    )
    v = p.parameters()
    lower = hinge("phi", "0 -1 0", v["b_2"]) + inertial(v["m_2"], v["J_2"], 1e-5, v["a_2"])
    upper = hinge("theta", "0 -1 0", v["b_1"]) + inertial(v["m_1"], v["J_1"], 1e-5, v["a_1"])
    return Specimen(plant=p, bodies=f'<body>{upper}<body pos="0 0 {-v["l_1"]!r}">{lower}</body></body>', swing=1.5)


def two_links() -> Specimen:
    p = DoublePendulum(m_1=0.35, m_2=0.2, l_1=0.2, l_c1=0.11, l_c2=0.13, J_1=1e-3, J_2=8e-4, b_1=5e-3, b_2=2e-3)
    lower = hinge("theta_2", "0 -1 0", p.b_2) + inertial(p.m_2, p.J_2, 1e-5, p.l_c2)
    upper = hinge("theta_1", "0 -1 0", p.b_1) + inertial(p.m_1, p.J_1, 1e-5, p.l_c1)
    return Specimen(plant=p, bodies=f'<body>{upper}<body pos="0 0 {-p.l_1!r}">{lower}</body></body>', swing=1.5)


def flexible_link() -> Specimen:
    p = FlexibleLink(J_h=2e-3, J_l=4e-3, k_s=1.4, b_1=4e-3, b_2=1e-3)
    link = hinge("alpha", "0 0 1", p.b_2, p.k_s) + inertial(0.07, p.J_l / 2, p.J_l)
    hub = hinge("theta", "0 0 1", p.b_1) + inertial(0.5, p.J_h / 2, p.J_h)
    return Specimen(plant=p, bodies=f"<body>{hub}<body>{link}</body></body>", swing=0.5)


SPECIMENS = {
    "double-pendulum": two_links(),
    "flexible-link": flexible_link(),
    "pendulum": pendulum(),
    "cart-pendulum": cart_pendulum(),
    "furuta": furuta(0.0, (0.0, 0.0)),
    "furuta anchored": furuta(0.4, (0.0, 0.0)),
    "furuta out of level": furuta(0.2, (0.05, -0.03)),
    **{f"{kind}-{n}": shaken(n, kind) for kind in ("rectilinear", "torsional") for n in (1, 2, 3)},
    "rectilinear-4": shaken(4, "rectilinear"),
    "double pendulum": double_pendulum(),
}
