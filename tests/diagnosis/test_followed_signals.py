# SPDX-License-Identifier: BSD-3-Clause
"""Torques of a form that nobody wrote down: the signals they follow are found all the same."""

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor

#: Torque on a joint (from 1), its size in N m, the signals, and the formula if it is a short one.
FORMS = {
    "square of another position": (3, 2.0, lambda x: x["q5"] ** 2, {"q5"}, "q5**2"),
    "product of two velocities": (
        4,
        0.4,
        lambda x: x["dq1"] * x["dq2"],
        {"dq1", "dq2"},
        "dq1 * dq2",
    ),
    "step": (1, 0.5, lambda x: np.sign(x["q3"] - x["q3"].median()), {"q3"}, None),
    "bump": (2, 4.0, lambda x: np.exp(-((x["q2"] / 0.15) ** 2)), {"q2"}, None),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_form_in_no_catalogue_is_unknown_and_its_signals_are_named(form):
    joint, size, torque, signals, formula = FORMS[form]
    log = make_hidden_effect_log(load_ur5(), None, noise="low", random_state=11)
    y = np.array(log.y, dtype=float)
    y[:, joint - 1] += size * torque(log.X)

    diagnosis = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, y)

    assert diagnosis.verdict == "unknown"
    (finding,) = diagnosis.findings
    assert finding.joints == (joint,)
    assert set(finding.variables) == signals
    proposal = diagnosis.unknowns[0].proposal
    if formula is not None:
        assert proposal.expressions == (formula,)
        assert proposal.coefficients[0] == pytest.approx(size, rel=0.1)


def test_a_joint_that_rests_in_some_trajectories_is_diagnosed_all_the_same():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=8, duration=8.0)
    X = log.X.copy()
    rests = X["trajectory"].isin([4, 8])  # every fourth: a quarter of the folds is empty
    X.loc[rests, ["q2", "dq2", "ddq2"]] = [0.3, 0.0, 0.0]
    signals = [X[[f"{s}{j}" for j in (1, 2)]].to_numpy() for s in ("q", "dq", "ddq")]
    y = log.robot.inverse_dynamics(*signals) + 0.5 * np.sign(signals[1])
    y += 0.02 * np.random.default_rng(1).normal(size=y.shape)
    y[:, 1] += np.where(X["q1"] > X["q1"].median(), 1.0, -1.0)

    diagnosis = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), X, y)

    assert diagnosis.verdict != "complete"
    assert any(2 in finding.joints for finding in diagnosis.findings)


def test_a_product_of_signals_that_do_nothing_alone_is_followed():
    log = make_hidden_effect_log(load_ur5(), None, noise="low", random_state=3)
    y = np.array(log.y, dtype=float)
    y[:, 5] += 0.05 * np.sign(log.X["dq4"]) * log.X["dq5"] + 0.05 * log.X["dq4"]

    diagnosis = diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, y)

    (finding,) = diagnosis.findings
    assert finding.joints == (6,)
    assert set(finding.variables) == {"dq4", "dq5"}
