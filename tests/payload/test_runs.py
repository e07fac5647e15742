# SPDX-License-Identifier: BSD-3-Clause
"""Runs that cannot be used are refused with what they lack."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.payload import identify_payload

LOG = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
RUN = LOG.frame[LOG.frame["trajectory"] == 1]


@pytest.mark.parametrize(
    ("loaded", "options", "message"),
    [
        ([], {}, "no run with the load"),
        (RUN.drop(columns="tau2"), {}, r"lacks the torque column\(s\) tau2"),
        ([RUN.to_numpy()], {}, "loaded holds a ndarray"),
        (RUN.drop(columns="time"), {}, "no column time"),
        (RUN[:0], {}, "a loaded run has no rows"),
        (RUN.sample(frac=1.0, random_state=0), {}, "a loaded run are not in the order of time"),
        (RUN, {"link": "gripper"}, "no link 'gripper'"),
        (RUN, {"link": "base"}, "does not move"),
        (RUN, {"smooth": False}, "needs accelerations"),
    ],
)
def test_what_is_missing_is_named(loaded, options, message):
    with pytest.raises(SkidynError, match=message):
        identify_payload(LOG.robot, loaded, RUN, **options)


def test_joints_may_be_named_in_the_torque_columns():
    named = RUN.rename(
        columns={f"tau{j + 1}": f"tau_{n}" for j, n in enumerate(LOG.robot.joint_names)}
    )
    unloaded = LOG.frame[LOG.frame["trajectory"] == 2]
    one, other = (identify_payload(LOG.robot, runs, unloaded) for runs in (RUN, named))
    np.testing.assert_array_equal(one.inertial_parameters, other.inertial_parameters)
