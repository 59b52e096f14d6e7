"""Are the faults found that the people who recorded these logs know of, and nothing where they know of none?"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from upright.diagnosis import Diagnosis, examine, read_known
from upright.readers import read

pytestmark = pytest.mark.real_data

FAULTS = {  # file, rig: kinds of finding, as the README beside each log tells
    ("ecp205_torsional_ucsd/28-Jan-2025 14_36_10.mat", "torsional-2"): {"sign", "settings", "creep"},
    ("ecp205_torsional_ucsd/Jan141428.mat", "torsional-2"): {"sign", "settings", "creep"},
    ("ecp205_torsional_ucsd/Jan211450.mat", "torsional-2"): {"sign", "trip", "settings"},
    ("ecp205_torsional_ucsd/Jan211453.mat", "torsional-2"): {"sign", "settings"},
    ("ecp205_torsional_ucsd/Jan211520.mat", "torsional-2"): {"sign", "trip"},
    ("ecp205_torsional_ucsd/Jan281420.mat", "torsional-2"): {"spike", "effort"},
    ("ecp210_rectilinear_ucsd_1khz/07-Feb-2025 09_26_10.txt", "rectilinear-2"): {"self-excited", "creep", "effort"},
    ("ecp210_rectilinear_ucsd_1khz/07-Feb-2025 11_28_21.txt", "rectilinear-2"): {"creep"},
    ("ecp210_rectilinear_ucsd_1khz/21-Feb-2025 09_19_16.mat", "rectilinear-2"): {"settings", "creep"},
    ("ecp210_rectilinear_ucsd_1khz/21-Feb-2025 10_26_38.txt", "rectilinear-2"): {"effort"},
    ("ecp210_rectilinear_ucsd_export/Open_Loop/test_2_1.csv", "rectilinear-2"): {"effort", "sign"},
    ("ecp210_rectilinear_ucsd_export/Open_Loop/test_3_9.csv", "rectilinear-2"): {"effort", "sign"},
    ("furuta_diy_odrive/hardware_step_response_4V.csv", "furuta"): {"early", "sign"},
    ("furuta_diy_odrive/hardware_sin_response_4V_1s.csv", "furuta"): {"sign", "jitter"},
    ("furuta_diy_odrive/hardware_pure_joint1_oscillations.csv", "furuta"): {"gap"},
    ("crane_cart_pendulum_kawata/cdip_cart_pcont_data_kP_050_ref_02.mat", "cart-pendulum"): {"sign"},
}
SOUND = {
    "crane_gantry_aau/meascrane.mat": "pendulum",
    "crane_gantry_aau/posxdata.mat": "rectilinear-1",
    "pendulum_cart_coulomb_aau/pend1test/test1pend1.csv": "pendulum",
    "pendulum_cart_coulomb_aau/cartTest1/testOffPointThree.csv": "rectilinear-1",
    "pendulum_single_multiarm_uw/SinglePendulumDataForParameterEstimation.mat": "pendulum",
    "pendulum_single_multiarm_uw/SingleDataFreeSwing_1_Dt_0_0001.mat": "pendulum",
    "ecp210_rectilinear_ucsd_export/Closed_Loop/closed_loop_pid.csv": "rectilinear-2",
}


def diagnosis(file: str, rig: str) -> Diagnosis:
    return examine(read(Path(os.environ["UPRIGHT_REAL_DATA"]) / file), *read_known(rig))


@pytest.mark.parametrize(("log", "kinds"), FAULTS.items(), ids=lambda x: x[0] if isinstance(x, tuple) else "")
def test_a_known_fault_is_found(log, kinds):
    assert kinds <= {f.kind for f in diagnosis(*log).wrong}


@pytest.mark.parametrize(("file", "rig"), SOUND.items())
def test_a_sound_log_raises_no_alarm(file, rig):
    assert [f.sentence for f in diagnosis(file, rig).wrong] == []


def test_saturation_at_the_start_of_a_balancing_run_is_noted():
    found = diagnosis("furuta_qube_servo_balance/qube_20230828T150615_434_696_394.csv", "furuta")
    assert any(f.kind == "saturation" and "-10" in f.sentence for f in found.findings)


def test_the_servo_that_trips_at_5_6_s_is_said_to():
    trip = next(f for f in diagnosis("ecp205_torsional_ucsd/Jan211450.mat", "torsional-2").wrong if f.kind == "trip")
    assert 5.4 < trip.evidence["end [s]"] < 5.8  # the speed falls from 5.6 s on, the volts are logged until 10 s
