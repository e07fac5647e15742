# SPDX-License-Identifier: BSD-3-Clause
"""Torques that follow a signal with another size, or sign, in each recording."""

import warnings

import numpy as np

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.diagnosis._changing_sizes import changing_size
from skidyn.identification import RBDRegressor


def diagnosed(odd):
    """Diagnosis of a log in which joint 1 feels joint 2, with another size in odd recordings."""
    log = make_hidden_effect_log(
        load_planar_arm(), None, random_state=4, n_trajectories=6, duration=5.0
    )
    torque = np.array(log.y, dtype=float)
    away = log.X["q2"].to_numpy() - log.X["q2"].mean()
    torque[:, 0] += np.where(log.X["trajectory"] % 2 == 1, odd, 0.4) * away
    return diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, torque, checks=())


def test_a_torque_whose_sign_differs_between_recordings_is_found():
    diagnosis = diagnosed(-0.4)

    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.joints) == ("unknown", (1,))
    assert set(finding.variables) == {"q2", "trajectory"}
    assert "another size in each recording, on joint 1." in finding.sentence
    assert finding.error_drop > 0.7
    assert finding.trajectories is None


def test_a_torque_of_one_size_is_the_same_in_all_recordings():
    diagnosis = diagnosed(0.4)

    assert all("trajectory" not in f.variables for f in diagnosis.findings)
    assert any(1 in f.joints for f in diagnosis.findings)


def test_a_signal_that_hardly_varies_has_no_size():
    rng = np.random.default_rng(0)
    recording, quarter = np.repeat(np.arange(4), 80), np.tile(np.repeat(np.arange(4), 20), 4)
    y = rng.normal(size=320)
    rest = 1.0 + 1e-16 * rng.integers(0, 2, size=320)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert changing_size({"q1": rest, "q2": rest[::-1]}, y, recording, quarter) is None

        swing = rng.normal(size=320)
        y += np.where(recording % 2, 2.0, -2.0) * swing
        factors, _ = changing_size({"q1": rest, "q2": swing}, y, recording, quarter)
    assert [factor.signal for factor in factors] == ["q2"]
