# SPDX-License-Identifier: BSD-3-Clause
"""What an earlier ranking found holds while the residual is the same, and no longer."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.diagnosis._candidates import Candidate
from skidyn.diagnosis._looked_at import LookedAt
from skidyn.effects import Term
from skidyn.identification import RBDRegressor


@pytest.fixture
def candidate():
    return Candidate("offset", Term.at("offset", (0,)), {0: np.ones((50, 1))})


def residual(size):
    return [size * np.sin(np.arange(50.0)), np.cos(np.arange(50.0))]


def test_a_candidate_that_removed_little_is_open_where_the_residual_changes(candidate):
    looked = LookedAt(2)
    looked.compare(residual(1.0))
    assert looked.changed == {0, 1} and looked.is_open(candidate)
    looked.keep_weak([candidate], np.array([3.0]), 30.0)
    looked.compare(residual(1.001))
    assert looked.changed == set() and not looked.is_open(candidate)
    looked.compare(residual(0.5))
    assert looked.changed == {0} and looked.is_open(candidate)


def test_small_changes_add_up(candidate):
    looked = LookedAt(2)
    looked.compare(residual(1.0))
    for size in 1.0 + 0.01 * np.arange(1, 4):
        looked.compare(residual(size))
        assert looked.changed == set()
    looked.compare(residual(1.04))
    assert looked.changed == {0}


def test_a_candidate_that_removed_much_or_has_other_columns_is_open(candidate):
    looked = LookedAt(2)
    looked.compare(residual(1.0))
    looked.keep_weak([candidate], np.array([20.0]), 30.0)
    looked.compare(residual(1.0))
    assert looked.is_open(candidate)
    looked.keep_weak([candidate], np.array([3.0]), 30.0)
    looked.forget([candidate])
    assert looked.is_open(candidate)


def test_a_look_returns_to_joints_on_which_it_found_something():
    looked = LookedAt(2)
    looked.compare(residual(1.0))
    assert looked.joints("parts") == {0, 1}
    looked.keep("parts", [1])
    looked.compare(residual(1.0))
    assert looked.joints("parts") == {1}
    looked.compare(residual(2.0))
    assert looked.joints("parts") == {0, 1}


def test_an_effect_on_a_joint_that_the_first_finding_leaves_as_it_was_is_found_second():
    strong = make_hidden_effect_log(load_panda(), "spring", joints=[2], noise="low", random_state=1)
    q = strong.X["q6"].to_numpy()
    torque = strong.y.copy()
    torque[:, 5] += 0.8 * np.cos(2.0 * q) * np.sign(strong.X["dq6"].to_numpy())
    diagnosis = diagnose(RBDRegressor(strong.robot), strong.X, torque)
    assert {j for f in diagnosis.findings for j in f.joints} == {2, 6}
