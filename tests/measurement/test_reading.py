# SPDX-License-Identifier: BSD-3-Clause
"""A reading changes the motion and the columns of the torque, and nothing else."""

import numpy as np

from skidyn.measurement._reading import Reading


def test_the_default_changes_nothing(signals):
    read = Reading().motion(signals)
    np.testing.assert_array_equal(read.q, signals.q)
    assert [Reading().torque_column(j) for j in (0, 1)] == [(0, 1.0), (1, 1.0)]


def test_signs_zeros_and_scales_of_the_motion(signals):
    reading = Reading(flip_motion=frozenset([1]), zero=((0, 0.5),), stretch=2.0, size=4.0)
    read = reading.motion(signals)
    np.testing.assert_allclose(read.q, signals.q * [0.25, -0.25] - [0.5, 0.0])
    np.testing.assert_allclose(read.dq, signals.dq * [0.5, -0.5])
    np.testing.assert_allclose(read.ddq, signals.ddq * [1.0, -1.0])


def test_angles_against_the_base(signals):
    read = Reading(summed=((1, 1),)).motion(signals)
    np.testing.assert_allclose(read.q[:, 1], signals.q[:, 1] - signals.q[:, 0])


def test_torques_are_those_of_exchanged_joints():
    reading = Reading(order=(1, 0), flip_torque=frozenset([0]))
    assert [reading.torque_column(j) for j in (0, 1)] == [(1, -1.0), (0, 1.0)]
    assert reading.of_motion == Reading(order=(1, 0))
