# SPDX-License-Identifier: BSD-3-Clause
"""Effects of any kind that only a part of the recordings has."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

PART = (2, 5, 6, 9)


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), None, noise="low", duration=5.0, random_state=21
    )


@pytest.fixture(scope="module")
def diagnosed(log):
    """Diagnosis of the log with a torque, by its function, in some of the recordings; once each."""

    @cache
    def of(torque, recordings):
        return diagnose(
            RBDRegressor(log.robot), log.X, added(log, torque(log), recordings), checks=()
        )

    return of


def added(log, torque, trajectories):
    """Torque of the log with another on joint 2 in some trajectories."""
    y = np.array(log.y)
    inside = np.isin(log.X["trajectory"].to_numpy(), trajectories)
    y[:, 1] += np.where(inside, torque, 0.0)
    return y


def rising(log):
    """A bar that pushes back from a certain position on."""
    q = log.X["q2"].to_numpy()
    return 0.4 * np.std(log.y[:, 1]) * np.maximum(0.0, q - np.quantile(q, 0.3))


def falling(log):
    """Friction that falls with the speed."""
    dq = log.X["dq2"].to_numpy()
    usual = np.quantile(np.abs(dq), 0.3)
    return 0.2 * np.std(log.y[:, 1]) * np.sign(dq) * np.exp(-((dq / usual) ** 2))


@pytest.mark.parametrize(
    ("torque", "kinds"),
    [
        pytest.param(rising, {"end_stop", "nonlinear_spring"}, marks=pytest.mark.slow),
        (falling, {"stribeck"}),
    ],
)
def test_is_named_with_its_recordings(diagnosed, torque, kinds):
    (finding,) = diagnosed(torque, PART).findings
    assert finding.kind in kinds
    assert finding.joints == (2,)
    assert set(finding.trajectories) <= set(PART)
    assert len(finding.trajectories) >= 3
    assert "in trajectories 2, 5" in finding.sentence


def test_is_predicted_for_these_recordings_only(log, diagnosed):
    diagnosis = diagnosed(rising, PART)

    truth = RBDRegressor(log.robot).fit(log.X, log.y).predict(log.X)[:, 1]
    inside = np.isin(log.X["trajectory"].to_numpy(), diagnosis.findings[0].trajectories)
    error = (diagnosis.model.predict(log.X)[:, 1] - truth)[~inside]
    assert np.std(error) < 0.1 * np.std(rising(log)[inside])


@pytest.mark.slow
def test_an_effect_of_all_recordings_has_no_part(log, diagnosed):
    everywhere = tuple(np.unique(log.X["trajectory"]))

    assert all(f.trajectories is None for f in diagnosed(rising, everywhere).findings)


def test_elastic_joints_and_inertias_are_not_tried_in_a_part(log):
    from skidyn.effects import get_effect, list_effects

    passing = {kind for kind in list_effects() if get_effect(kind).comes_and_goes}
    assert {"stribeck", "end_stop", "coupling_spring", "saturation", "base_tilt"} <= passing
    assert not passing & {"joint_elasticity", "backlash", "rotor_inertia", "payload"}


def test_an_offset_of_several_joints_is_one_of_the_few_recordings():
    # beside a function of the position, an offset of the other recordings is as good on a joint
    log = make_hidden_effect_log(
        load_planar_arm(), None, noise="low", n_trajectories=7, duration=5.0, random_state=4
    )
    torque = np.array(log.y)
    own = np.isin(log.X["trajectory"].to_numpy(), (2, 3))
    torque[own] += 8 * log.noise_std
    model = RBDRegressor(log.robot, effects=["viscous", "coulomb", "offset"])

    found = diagnose(model, log.X, torque, checks=()).findings

    assert {(f.kind, f.joints, f.trajectories) for f in found} == {
        ("offset", (1,), (2, 3)),
        ("offset", (2,), (2, 3)),
    }


def test_a_function_of_another_joint_in_some_recordings_has_its_signal_and_these():
    """It need not be zero in the middle of the signal, as one whose size changes."""
    log = make_hidden_effect_log(
        load_planar_arm(), None, n_trajectories=6, duration=6.0, random_state=8
    )
    some = log.X["trajectory"].isin(sorted(log.X["trajectory"].unique())[1:5:3]).to_numpy()
    q, torque = log.X["q2"].to_numpy(), np.array(log.y)
    hose = q / np.ptp(q) + 0.3
    torque[:, 0] += 0.5 * np.std(log.y[:, 0]) * np.where(some, hose, 0.0)

    found = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, torque, checks=())

    (finding,) = found.findings
    assert (finding.kind, finding.joints, finding.variables) == ("unknown", (1,), ("q2",))
    assert finding.trajectories == tuple(sorted(log.X["trajectory"][some].unique()))
