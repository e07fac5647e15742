# SPDX-License-Identifier: BSD-3-Clause
"""Every kind of the vocabulary is found in a log that another code path has made.

The kinds of tests/diagnosis/test_diagnosis.py and test_servo_settings.py are left out here, and
what MuJoCo has natively, which is tested in test_mujoco.py. The simulator integrates states and
play at about 1 kHz and shares no code with the catalogue.
"""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import list_effects
from skidyn.identification import RBDRegressor

HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}
#: Kind: robot, and the parameter of the truth that must be met, with its tolerance.
KINDS = {
    "friction_drift": (load_planar_arm, None, 0),
    "lugre": (load_planar_arm, None, 0),
    "maxwell_slip": (load_planar_arm, None, 0),
    "position_dependent_friction": (load_planar_arm, "A", 0.05),
    "nonlinear_spring": (load_planar_arm, "k3", 0.4),
    "gravity_compensator": (load_planar_arm, None, 0),
    "joint_elasticity": (load_planar_arm, "K", 0.5),
    "backlash": (load_planar_arm, "gap", 0.5),
    "torque_gain": (load_ur5, "epsilon", 0.05),
    "saturation": (load_planar_arm, "limit", 0.06),
    "temperature_offset": (load_planar_arm, "dtau_dT", 0.05),
    "environment_contact": (load_planar_arm, "z0", 0.05),
}
#: Six joints take most of the time, and a shorter log shows as much on them.
SHORT = {"n_trajectories": 6, "duration": 6.0}
ELSEWHERE = {
    *("viscous", "coulomb", "offset", "asymmetric_friction", "stribeck", "nonlinear_viscous"),
    *("load_dependent_friction", "dahl", "rotor_inertia", "spring", "torque_ripple", "payload"),
    *("time_delay", "temperature_friction"),
    *("coupled_friction", "coupled_inertia", "coupling_spring", "base_tilt", "end_stop"),
    "external_wrench",
    *("servo_gain", "servo_current", "servo_voltage", "servo_deadband"),
}


def test_every_kind_has_its_test():
    assert {*KINDS, *ELSEWHERE} == set(list_effects())


@pytest.mark.parametrize("kind", KINDS)
def test_a_simulated_effect_is_named_with_its_joints_and_size(kind):
    load, name, tolerance = KINDS[kind]
    length = {} if load is load_planar_arm else SHORT
    log = make_hidden_effect_log(load(), kind, noise="low", random_state=11, **length)

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)

    (finding,) = diagnosis.findings
    if kind in HYSTERESIS:  # told apart by special motion only
        assert finding.kind in HYSTERESIS
        assert kind in {finding.kind, *finding.rivals}
    else:
        assert finding.kind == kind
    if log.joints:
        assert finding.joints == tuple(log.joints)
    assert np.any(diagnosis.rmse_after < 0.97 * diagnosis.rmse_before)
    if name:
        value, truth = finding.parameters[name]["value"], np.ravel(log.parameters[name])[0]
        assert value == pytest.approx(truth, rel=tolerance)
