# SPDX-License-Identifier: BSD-3-Clause
"""Torques that are products of functions of several signals, which have no effect alone."""

import numpy as np
import pytest

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.diagnosis._signal_products import product_of_three
from skidyn.identification import RBDRegressor

SHORT = {"n_trajectories": 6, "duration": 4.0}


def diagnosed(log, y):
    """The motion is as it should be: no test looks at the checks of the log."""
    return diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, y, checks=())


def away(log, name):
    """A position, from its middle."""
    return log.X[name].to_numpy() - log.X[name].mean()


@pytest.mark.parametrize(
    ("torque", "signals"),
    [
        (
            lambda log: 1.2 * away(log, "q1") * away(log, "q2") * log.X["dq3"],
            {"q1", "q2", "dq3"},
        ),
        pytest.param(
            lambda log: 0.3 * np.sign(away(log, "q2")) * np.abs(log.X["dq5"]),
            {"q2", "dq5"},
            marks=pytest.mark.slow,
        ),
    ],
    ids=["of three", "of two"],
)
def test_a_product_is_found_in_a_short_log(torque, signals):
    log = make_hidden_effect_log(load_ur5(), None, random_state=11, **SHORT)
    y = np.array(log.y, dtype=float)
    y[:, 3] += torque(log)

    diagnosis = diagnosed(log, y)

    (finding,) = diagnosis.findings
    assert (diagnosis.verdict, finding.joints) == ("unknown", (4,))
    assert set(finding.variables) == signals


def test_a_product_of_three_has_three_signals():
    """The square of a signal times another one, which removes more, is no product of three."""
    x, y, z = np.random.default_rng(0).normal(size=(3, 400)).cumsum(axis=1)
    signals = {"ddq1": x - x.mean(), "ddq2": y - y.mean(), "ddq3": z - z.mean()}
    torque = signals["ddq1"] * signals["ddq3"] * signals["ddq3"]
    fold = np.repeat(np.arange(8), 50)
    found = product_of_three(signals, torque, fold, None, np.zeros((400, 0)))
    assert found is None or len({factor.signal for factor in found[0]}) == 3


def test_a_product_that_acts_in_two_of_many_recordings_is_found():
    rng = np.random.default_rng(1)
    fold = np.repeat(np.arange(12), 40)
    time, names = np.arange(480) / 20, ("ddq1", "ddq2", "ddq3", "dq2", "dq3")
    signals = {
        name: np.sin(f * time + f) for name, f in zip(names, (2, 3.1, 4.3, 5.7, 1.3), strict=True)
    }
    signals["ddq1"] *= np.where(fold < 2, 1.0, 0.02)  # joint 1 hardly moves in the others
    torque = signals["ddq1"] * signals["ddq2"] * signals["dq3"]
    noise = rng.normal(0, 0.1, 480)
    found = product_of_three(signals, torque + noise, fold, None, np.zeros((480, 0)))
    assert found is not None
    assert {factor.signal for factor in found[0]} == {"ddq1", "ddq2", "dq3"}
    alone = torque * (fold == 0)  # that no other recording confirms
    found = product_of_three(signals, alone + noise, fold, None, np.zeros((480, 0)))
    assert found is None or {factor.signal for factor in found[0]} != {"ddq1", "ddq2", "dq3"}


@pytest.mark.slow
def test_a_product_of_signals_that_do_nothing_alone_is_followed():
    log = make_hidden_effect_log(load_ur5(), None, random_state=3, **SHORT)
    y = np.array(log.y, dtype=float)
    y[:, 5] += 0.05 * np.sign(log.X["dq4"]) * log.X["dq5"] + 0.05 * log.X["dq4"]

    diagnosis = diagnosed(log, y)

    (finding,) = diagnosis.findings
    assert finding.joints == (6,)
    assert set(finding.variables) == {"dq4", "dq5"}


@pytest.mark.slow
def test_a_loss_under_load_that_follows_the_speed_of_another_joint_names_both():
    log = make_hidden_effect_log(load_ur5(), None, random_state=11, **SHORT)
    q, dq = (log.X[[f"{name}{j}" for j in range(1, 7)]].to_numpy() for name in ("q", "dq"))
    load = log.robot.inverse_dynamics(q, dq, np.zeros_like(q))
    y = np.array(log.y, dtype=float)
    y[:, 2] += 0.3 * load[:, 2] * dq[:, 0]

    diagnosis = diagnosed(log, y)

    finding = diagnosis.findings[0]
    assert (finding.kind, finding.joints) == ("unknown", (3,))
    assert set(finding.variables) == {"dq1", "tau3"}
