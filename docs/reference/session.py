"""An example for every public name, in one session: a test runs it from top to bottom in an empty folder."""

# %% set-up
import numpy as np

import upright as up

arm = up.Furuta(
    m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=1e-3, b_2=6e-5, b_1c=2e-3, b_2c=1e-4
)
t = np.arange(0, 10, 5e-3)
torque = 0.05 * np.sin(2 * t + 0.05 * t**2)
motion = up.simulate(arm, u=torque, seconds=10, dt=5e-3, start={"theta": "40 deg"})
table = motion.to_pandas()[["psi", "theta", "T"]].round(4)
table.to_csv("swing.csv", index_label="time [s]")

# %% read
log = up.read("swing.csv")
log.names, log.period

# %% show
up.show("swing.csv")

# %% doctor
up.doctor(log, rig="furuta")

# %% init
up.init("swing.csv", out="drafted.toml", plant="furuta")

# %% law
time = np.arange(0, 20, 2e-3)
x = 0.02 * np.sin(3 * time) + 0.01 * np.sin(7.3 * time + 1)
closed = {"time": time, "reference": 0 * time, "x": x, "command": np.clip(-35 * x, -0.5, 0.5)}
np.savetxt(
    "loop.csv",
    np.column_stack(list(closed.values())),
    delimiter=",",
    header=",".join(closed),
    comments="",
)
up.law("loop.csv", command="command", measured="x", reference="reference")

# %% Record
isinstance(log, up.Record), log["theta"].max(), log.to_pandas().head()

# %% identify
known = {"m_p": "135 g +- 0.3 g", "r": "160 mm +- 0.5 mm", "l_cg": "190 mm +- 0.5 mm"}
fit = up.identify(log, up.Furuta, known=known, ask=["J_d", "J_p", "b_1", "b_2", "b_1c", "b_2c"])
fit.parameters

# %% predict
other = up.simulate(arm, u=-0.8 * torque, seconds=10, dt=5e-3, start={"theta": "20 deg"})
fit.save("fit.json")
up.predict("fit.json", other.to_pandas()[["psi", "theta", "T"]])

# %% compare
rigid = up.identify(
    log, up.Furuta, known={**known, "b_1c": 0.0, "b_2c": 0.0}, ask=["J_d", "J_p", "b_1", "b_2"]
)
up.compare([fit, rigid], log=other.to_pandas()[["psi", "theta", "T"]]).table

# %% ladder
up.ladder(fit.study)

# %% frequency
up.frequency(rig="furuta", seed=1)

# %% plan_inertias
up.plan_inertias(rig="torsional")

# %% loadings
up.loadings(rig="torsional", seed=1)

# %% Pendulum
rod = up.Pendulum(m_p=0.22, l_cg=0.2, J_p=2e-3, b_2=2e-4)
rod.linear("hanging").poles()

# %% CartPendulum
cart = up.CartPendulum(m_c=0.8, m_p=0.22, l_cg=0.2, J_p=2e-3)
cart.linear("inverted").poles()

# %% Furuta
type(arm) is up.Furuta
arm.linear("inverted").poles()

# %% DoublePendulum
up.DoublePendulum.names()

# %% DoublePendulumAbsolute
up.DoublePendulumAbsolute.names()

# %% FlexibleLink
up.FlexibleLink.names()

# %% chain
Carts = up.chain(3, "rectilinear")
Carts.names()


# %% Plant
class Seesaw(up.Plant):
    """A rigid beam on a pivot above its centre of gravity, turned by a torque."""

    J: float = up.quantity("kg m^2", "inertia about the pivot", above=0)
    h: float = up.quantity("kg m", "mass times depth of the centre of gravity", above=0)
    b: float = up.quantity("N m s/rad", "viscous friction", default=0.0, at_least=0)
    b_c: float = up.quantity("N m", "Coulomb friction", default=0.0, at_least=0)
    g: float = up.quantity("m/s^2", "gravity", default=9.81, above=0)

    coordinates = (up.Coordinate("theta", "rad", "tilt, 0 level"),)
    inputs = (up.Input("T", "N m", "torque", on="theta"),)
    joints = (up.Joint("theta", coulomb="b_c"),)
    equilibria = {"level": {}}

    @staticmethod
    def energies(p, q, v):
        from sympy import cos

        (theta,), (theta_dot,) = q, v
        return p.J * theta_dot**2 / 2, -p.g * p.h * cos(theta), p.b * theta_dot**2 / 2


Seesaw(J=0.02, h=0.01).linear("level").poles()

# %% Coordinate
up.Coordinate("theta", "rad", "tilt, 0 level")

# %% Input
up.Input("T", "N m", "torque", on="theta")

# %% Joint
up.Joint("theta", coulomb="b_c")

# %% quantity
up.quantity("kg m^2", "inertia about the pivot", above=0)

# %% Rig
rig = up.Rig.known(arm, gain="0.65 N m/V", limit="10 V", period="2 ms", counts=4096)
rig

# %% StateSpace
A, B, *_ = rig.linear("inverted")
model = up.StateSpace(A, B, states=["psi", "psi_dot", "theta", "theta_dot"], inputs=["v"])
model.poles()

# %% from_matlab
from scipy.io import savemat  # stands for MATLAB's save

savemat("model.mat", {"A": model.A, "B": model.B, "C": model.C, "D": model.D, "Ts": 0.0})
up.from_matlab("model.mat").poles()

# %% from_mjcf
pole = '<inertial pos="0 0 -0.2" mass="0.3" diaginertia="2e-3 2e-3 1e-5"/>'
with open("rig.xml", "w") as file:  # stands for a model of your own
    file.write(f'<mujoco><worldbody><body><joint axis="0 1 0"/>{pole}</body></worldbody></mujoco>')
up.from_mjcf("rig.xml").plant.linear("hanging").poles()

# %% place
gains = up.place(rig.linear("inverted"), [-4 + 2j, -4 - 2j, -17, -3])
gains

# %% lqr
K, S, E = up.lqr(rig.linear("inverted"), [1, 0, 1, 0], 0.1)

# %% hold
sampled = up.hold(rig.linear("inverted"), "2 ms", delay=1)

# %% dlqr
up.dlqr(up.hold(rig.linear("inverted"), "2 ms"), [1, 0, 1, 0], 0.1)

# %% observer
measured = up.StateSpace(*rig.linear("inverted")[:2], C=[[1, 0, 0, 0], [0, 0, 1, 0]])
up.observer(up.hold(measured, "2 ms"), [0.7, 0.72, 0.74, 0.76])

# %% prefilter
up.prefilter(rig.linear("inverted"), gains, output=0)

# %% margins
up.margins(rig.linear("inverted"), gains)

# %% simulate
run = up.simulate(rig, gains, start={"theta": "8 deg"}, seconds=5)
run["theta"][-1]  # upright is pi

# %% Law
push = up.Law(
    A=np.zeros((0, 0)), B=np.zeros((0, 2)), C=np.zeros((1, 0)), D=[[0.0, -0.4]], period=2e-3
)
up.simulate(rig, push, start={"theta": "8 deg"}, seconds=2, at="hanging")


# %% Rule
def towards(t, y, r, z, p):
    push = p[0] if y[0] < 0 else -p[0]
    return (push,), ()


bang = up.Rule(function=towards, initial=[], parameters=[0.2], period=2e-3)
up.simulate(rig, bang, start={"psi": 0.3}, seconds=2, at="hanging")

# %% chance
loop = {"limit": "0.5 N m", "period": "1 ms", "counts": 4096, "speed": "kalman"}
torque_gains = up.place(fit.plant.linear("inverted"), [-4 + 2j, -4 - 2j, -17, -3])
up.chance(fit, torque_gains, start={"theta": "8 deg"}, draws=50, **loop)

# %% design
design = up.design(fit, poles=[-4 + 2j, -4 - 2j, -17, -3], out="design", **loop)
design.verdict

# %% export
up.export(design, to="python", out="law").files

# %% regulate
up.regulate(fit, draws=50, **loop)

# %% swing_up
up.swing_up(fit, limit="0.5 N m", period="1 ms", counts=4096, travel="2 rad")

# %% play
up.play(fit, draws=20, out="play.html", limit="0.5 N m", period="1 ms", counts=4096)

# %% track
up.track(rig="rectilinear", sets=2)

# %% run
with open("RIG.toml", "w") as file:
    file.write('kind = "twin"\nmake = "furuta"\nat = "inverted"\n')
up.regulate(rig="furuta", draws=20, out="regulate")
up.run("RIG.toml", law="regulate/design.json", duration=5, out="upright-run")

# %% rig_doctor
up.rig_doctor("RIG.toml")

# %% bench
with up.bench(out="bench", port=0, browser=False, fifo=False) as bench:
    print(bench.rigs, bench.url)

# %% rig_check
up.rig_check(seconds=1, fifo=False)

# %% log_show
up.log_show("upright-run/run.mcap")

# %% log_tail
list(up.log_tail("upright-run/run.mcap"))

# %% log_recover
up.log_recover("upright-run/run.mcap", out="whole.mcap")

# %% log_convert
up.log_convert("upright-run/run.mcap", out="run.csv")

# %% log_replay
up.log_replay("upright-run/run.mcap")

# %% firmware_pins
up.firmware_pins(board="mega", drive="pair")

# %% firmware_build
up.firmware_build(board="mega", drive="pair", out="firmware")

# %% firmware_flash
try:
    up.firmware_flash(board="mega", port="/dev/no-board", out="firmware")
except up.UprightError as error:
    print(error)

# %% lab
up.lab(experiment="4", rig="furuta", out="lab")

# %% reproduce
up.reproduce()

# %% survey
import pandas as pd

up.survey(pd.DataFrame({"concept": ["stability"], "pre": [2.2], "post": [3.1]}), n=25)

# %% UprightError
try:
    up.simulate(arm, start={"thet": 0.1})
except up.UprightError as error:
    print(error)

# %% BadInput
try:
    up.place(rig.linear("inverted"), [-4])
except up.BadInput as error:
    print(error)

# %% ImpossiblePhysics
try:
    up.Pendulum(m_p=-1, l_cg=0.2, J_p=2e-3)
except up.ImpossiblePhysics as error:
    print(error)

# %% NotIdentifiable
issubclass(up.NotIdentifiable, up.UprightError)

# %% __version__
up.__version__
