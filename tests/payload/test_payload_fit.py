# SPDX-License-Identifier: BSD-3-Clause
"""Least squares for a payload and the robot that carries it, together."""

import numpy as np
import pytest

from skidyn.payload import identify_payload

FRICTION = ("viscous", "coulomb")


def test_a_known_centre_of_mass_leaves_the_mass_to_be_found(runs, found):
    log, loaded, unloaded = runs
    com = np.array(runs[0].parameters["com"])
    known = identify_payload(log.robot, loaded, unloaded, effects=FRICTION, com=com)
    np.testing.assert_allclose(known.com, com)
    assert known.mass == pytest.approx(log.parameters["mass"], rel=0.02)
    assert known.std[0] <= 1.05 * found.std[0]  # fewer numbers, none of them less certain


def test_the_interval_of_the_mass_comes_from_the_folds_left_out(runs, found):
    log, loaded, unloaded = runs
    few = loaded["trajectory"].unique()[:2]
    less = identify_payload(
        log.robot, loaded[loaded["trajectory"].isin(few)], unloaded, effects=FRICTION
    )
    assert 0 < found.std[0] < 0.05 * found.mass
    assert abs(less.mass - found.mass) < 5 * np.hypot(less.std[0], found.std[0])
