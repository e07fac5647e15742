# SPDX-License-Identifier: BSD-3-Clause
"""A log hides an effect; the diagnosis names it, sizes it, and the error falls to the noise."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

ROBOTS = {"ur5": load_ur5, "planar arm": load_planar_arm}
#: Parameter of the truth whose interval is checked.
SIZE = {
    "viscous": "Fv",
    "coulomb": "Fc",
    "offset": "tau0",
    "asymmetric_friction": "dFv",
    "stribeck": "dF",
    "nonlinear_viscous": "power",
    "load_dependent_friction": "mu",
    "dahl": "presliding",
    "rotor_inertia": "Ia",
    "spring": "k",
    "torque_ripple": "N",
    "payload": "mass",
    "time_delay": "delay",
    "temperature_friction": "dFv_dT",
}
#: Kinds that act on all joints, or on the tool: the joints are not chosen.
WHOLE = ("payload", "time_delay")
HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}


def hidden_log(kind, robot, noise):
    base = tuple(b for b in ("viscous", "coulomb") if b != kind)
    # The inertia of the rotor of a UR's second joint is part of its link's: take one that shows.
    joint = 4 if kind == "rotor_inertia" and robot == "ur5" else 2
    joints = None if kind in (None, *WHOLE) else [joint]
    log = make_hidden_effect_log(
        ROBOTS[robot](), kind, joints=joints, noise=noise, base=base, random_state=11
    )
    return log, RBDRegressor(log.robot, base)


@pytest.mark.parametrize("noise", ["low", "high"])
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("kind", SIZE)
def test_hidden_effect_is_named_and_sized_and_the_error_falls(kind, robot, noise):
    log, model = hidden_log(kind, robot, noise)

    diagnosis = diagnose(model, log.X, log.y)

    assert diagnosis.verdict == "missing"
    assert len(diagnosis.findings) == 1, [f.sentence for f in diagnosis.findings]
    finding = diagnosis.findings[0]
    names = {finding.kind, *finding.rivals}
    if kind in HYSTERESIS:  # members of the family need a special motion to be told apart
        assert finding.kind in HYSTERESIS
        assert kind in names
    else:
        assert finding.kind == kind
    assert finding.joints == tuple(log.joints)
    assert finding.q_value < 1e-3
    if finding.kind == kind:
        # The simulated temperature dependence is exponential, the fitted one a parabola.
        spare = 0.25 if kind == "temperature_friction" else 0.01
        _assert_inside(finding.parameters[SIZE[kind]], log.parameters[SIZE[kind]], spare)
    # Noise of the simulated sensors, or what the model without an effect leaves: whichever is more.
    floor = _error_without_effect(robot, noise)
    reached = diagnosis.rmse_after / np.maximum(floor, log.noise_std)
    limit = 2.0 if kind == "time_delay" else 1.5
    assert np.all(reached < limit), reached
    assert np.any(diagnosis.rmse_after < 0.99 * diagnosis.rmse_before)


@pytest.mark.parametrize("noise", ["low", "high"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_nothing_is_found_where_nothing_is_hidden(robot, noise):
    log, model = hidden_log(None, robot, noise)

    diagnosis = diagnose(model, log.X, log.y)

    assert diagnosis.verdict == "complete"
    assert diagnosis.findings == []
    assert diagnosis.limits, "what the data could still hide is stated"


def test_backlash_and_elasticity_are_told_apart():
    for kind in ("backlash", "joint_elasticity"):
        log = make_hidden_effect_log(load_planar_arm(), kind, joints=[1], random_state=5)
        found = diagnose(RBDRegressor(log.robot), log.X, log.y).findings
        assert found[0].kind == kind


def test_unknown_effect_is_reported_with_its_variables():
    log = make_hidden_effect_log(load_ur5(), "unknown_cable", joints=[2, 3], random_state=2)

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)

    assert diagnosis.verdict == "unknown"
    assert diagnosis.unexplained["joints"] == [2, 3]
    assert diagnosis.unexplained["variables"] == ["q2", "q3"]
    assert diagnosis.rmse_after[1] < 0.5 * diagnosis.rmse_before[1]


def _assert_inside(parameter, truth, spare):
    value, low, high = (parameter[k] for k in ("value", "low", "high"))
    truth = float(np.ravel(truth)[0])
    # A 95 % interval misses once in twenty: a little more than itself must hold the truth.
    margin = 0.5 * (high - low) + spare * abs(truth)
    assert low - margin <= truth <= high + margin, (low, truth, high)
    assert abs(value - truth) < (0.15 + spare) * abs(truth)


_FLOORS: dict[tuple[str, str], np.ndarray] = {}


def _error_without_effect(robot, noise):
    if (robot, noise) not in _FLOORS:
        log, model = hidden_log(None, robot, noise)
        _FLOORS[robot, noise] = diagnose(model, log.X, log.y).rmse_before
    return _FLOORS[robot, noise]
