"""Does the pendulum that the firmware is tested on move by the equations that its plant's energies give?"""

from __future__ import annotations

import runpy
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from upright.physics import Furuta
from upright.physics.lagrange import derive

FIRMWARE = Path(__file__).parents[2] / "firmware"
RIG = {"m_p": 0.12, "l_cg": 0.2, "r": 0.15, "J_d": 4e-3, "J_p": 5e-4, "J_a": 3e-5, "b_1": 5e-3, "b_2": 3e-4, "g": 9.81}
SECONDS, DT, TORQUE = 2.0, 1e-3, 0.05
MAIN = r"""
#include "furuta.h"
#include <stdio.h>
int main(int n, char **words) {
    furuta_t rig;
    furuta_prepare(&rig);
    for (int i = 1; i < n; i++) if (!furuta_set(&rig, words[i])) return 1;
    for (int i = 0; i < 2000; i++) furuta_move(&rig, 0.05, 1e-3);
    printf("%.17g %.17g %.17g %.17g\n", rig.x[0], rig.x[1], rig.x[2], rig.x[3]);
    return 0;
}
"""


def test_the_header_is_what_the_energies_give() -> None:
    written = runpy.run_path(str(FIRMWARE / "equations.py"))["source"](
        derive(Furuta, without=frozenset(Furuta.optional))
    )
    assert (FIRMWARE / "furuta_equations.h").read_text(encoding="utf-8") == written


def by_hand(p: dict[str, float], state: np.ndarray) -> np.ndarray:
    """PHYSICS, section 2, solved for the accelerations."""
    psi, psi_dot, theta, theta_dot = state
    s, c = np.sin(theta), np.cos(theta)
    J_A, k = p["J_p"] + p["m_p"] * p["l_cg"] ** 2, p["m_p"] * p["r"] * p["l_cg"]
    M = np.array([[p["J_d"] + p["m_p"] * p["r"] ** 2 + J_A * s**2 + p["J_a"] * c**2, -k * c], [-k * c, J_A]])
    f = np.array([
        TORQUE - 2 * theta_dot * psi_dot * s * c * (J_A - p["J_a"]) - k * s * theta_dot**2
        - p["b_1"] * psi_dot - p.get("k_psi", 0.0) * psi,
        -p["m_p"] * p["g"] * p["l_cg"] * s + s * c * psi_dot**2 * (J_A - p["J_a"]) - p["b_2"] * theta_dot,
    ])  # fmt: skip
    a = np.linalg.solve(M, f)
    return np.array([psi_dot, a[0], theta_dot, a[1]])


@pytest.mark.parametrize("anchor", [{}, {"k_psi": 0.05}])
def test_it_moves_as_equation_3_says_with_an_anchor_and_without(anchor: dict[str, float], tmp_path: Path) -> None:
    """Runge and Kutta's steps of 1 ms err by less than 1e-8 of a swing at some 10 rad/s, (w dt)^4 per radian."""
    if not shutil.which("cc"):
        pytest.skip("needs cc")
    (tmp_path / "main.c").write_text(MAIN)
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-I", FIRMWARE, tmp_path / "main.c",
               FIRMWARE / "furuta.c", "-lm", "-o", tmp_path / "moves"]  # fmt: skip
    subprocess.run([str(word) for word in command], check=True)
    start = {"theta": 1.4, "psi_dot": 0.8}
    said = {**RIG, **anchor, **start, "gain": 1.0, "step": 1.0, "counts_psi": 1.0, "counts_theta": 1.0}
    words = [f"{name}={value!r}" for name, value in said.items()]
    shown = subprocess.run([tmp_path / "moves", *words], capture_output=True, text=True, check=True).stdout
    exact = solve_ivp(lambda _, x: by_hand(RIG | anchor, x), (0, SECONDS), [0.0, 0.8, 1.4, 0.0], rtol=1e-11, atol=1e-12)
    assert np.array(shown.split(), dtype=float) == pytest.approx(exact.y[:, -1], abs=1e-7)
