# SPDX-License-Identifier: BSD-3-Clause
"""Held-out residuals are those of models that have not seen the sample."""

import numpy as np

from skidyn.diagnosis._held_out import told_alone


def test_errors_of_data_left_out_are_no_smaller_than_those_of_the_fit(missing, spring_log):
    inside = np.asarray(spring_log.y) - missing.model.predict(spring_log.X)
    sliding = missing.comparison_after.sliding
    fitted = np.sqrt(np.mean(inside[sliding] ** 2))
    held = np.sqrt(np.mean(missing.comparison_after.residual[sliding] ** 2))
    assert fitted < 1.02 * held < 1.2 * fitted


def test_what_one_recording_alone_determines_is_not_held_out_with_it():
    # recording 0 shows both columns apart, recording 1 only their sum
    grams = np.array([[[1.0, 0.0], [0.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]]])

    assert not told_alone(grams, [2]).any()
    np.testing.assert_array_equal(told_alone(grams, [2], [True]), [[True, True], [False, False]])
    assert not told_alone(0 * grams, [2], [True]).any()


def test_what_differs_in_all_recordings_but_one_is_told_by_this_one_alone():
    # one column of all recordings, and the same in the second and in the third alone
    levels = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
    grams = levels[:, :, None] * levels[:, None, :]

    alone = told_alone(grams, [1, 1, 1], [False, True, True])

    np.testing.assert_array_equal(alone, np.eye(3, dtype=bool))
