"""What was asked of the studies of real rigs: least fit percent by study, run and signal."""

from __future__ import annotations

ASKED: dict[str, dict[tuple[str, str], float]] = {
    "aau_pendulum": {("whole fall", "theta"): 99.3},
    "aau_pendulum_tail": {("tail, restarted", "theta"): 97.0},
    "uw_pendulum": {("55 s", "theta"): 98.5},
    "uw_pendulum_tail": {("tail", "theta"): 90.0},
    "furuta_fall": {("fall", "theta"): 98.0},
    "furuta_sines": {
        ("sine 2 V", "psi"): 96.0,
        ("sine 2 V", "theta"): 92.0,
        ("sine 4 V", "psi"): 96.0,
        ("sine 4 V", "theta"): 92.0,
        ("constant 2 V", "psi"): 97.0,
        ("constant 2 V", "theta"): 85.0,
        ("constant 4 V", "psi"): 97.0,
        ("constant 4 V", "theta"): 85.0,
    },
    "kawata_crane": {
        **{(f"kP {k}", "x"): 98.5 for k in ("2.5", "5", "10")},
        **{(f"kP {k}", "theta"): 96.0 for k in ("2.5", "5", "10")},
        ("decay", "theta"): 98.0,
    },
    "ecp205_held": {
        ("disk 2 held, -0.5 V", "theta_1"): 90.0,
        ("disk 2 held, +0.5 V", "theta_1"): 90.0,
        ("disk 1 held", "theta_2"): 97.0,
    },
}

HELD_OUT: dict[tuple[str, str], dict[str, float]] = {
    **{("kawata_crane", f"kP {k}"): {"x": 97.0, "theta": 93.0} for k in ("2.5", "5", "10")},
    **{("ecp205_held", f"disk 2 held, {s}0.5 V"): {"theta_1": 85.0} for s in "-+"},
}
"""Study and the run it must predict from its others: least fit percent by signal."""
