# SPDX-License-Identifier: BSD-3-Clause
"""Torques of a form that nobody wrote down: the signals they follow are found all the same."""

import numpy as np
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_ur5, make_hidden_effect_log
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
    "wave over the sum of three positions": (
        3,
        1.5,
        lambda x: np.sin(1.5 * (x["q2"] + x["q4"] - x["q5"])),
        {"q2", "q4", "q5"},
        None,
    ),
    "step": (1, 0.2, lambda x: np.sign(x["q2"] - x["q2"].median()), {"q2"}, None),
    "fades after a reversal": (1, 1.0, lambda x: _since_reversal(x, "q1"), {"q1", "dq1"}, None),
    "snaps over": (2, 0.6, lambda x: _snapped(x, "q2", 0.15), {"q2"}, None),
    "relaxes": (2, 1.8, lambda x: _relaxed(x, "q2", 0.5), {"q2", "dq2"}, None),
    "remembers a reversal": (1, 0.3, lambda x: _last_turn(x, "q2"), {"q2", "dq2"}, None),
    "pushes during motion": (
        2,
        0.4,
        lambda x: x["dq2"].abs() * (x["q2"] - x["q2"].median()),
        {"q2", "dq2"},
        None,
    ),
    "remembers motion": (1, 0.8, lambda x: _warmed(x, "dq2", 1.5), {"dq2"}, None),
    "drags less and less": (
        1,
        0.5,
        lambda x: x["dq2"] * (x["time"] - x.groupby("trajectory")["time"].transform("median")),
        {"dq2", "time"},
        None,
    ),
    "settles with the way": (1, 0.8, lambda x: np.exp(-_way(x, "dq2")), {"dq2", "time"}, None),
    "bump": (2, 1.2, lambda x: np.exp(-((x["q2"] / 0.15) ** 2)), {"q2"}, None),
}
#: Forms for which the signals are chosen among those of six joints.
AMONG_MANY = tuple(FORMS)[:3]

#: What is hidden in one log: a form alone among six joints, and one on each of two joints.
TOGETHER = [
    *(pytest.param((form,), marks=pytest.mark.slow) for form in AMONG_MANY),
    ("step", "bump"),
    pytest.param(("fades after a reversal", "relaxes"), marks=pytest.mark.slow),
    pytest.param(("snaps over",), marks=pytest.mark.slow),
    ("remembers a reversal",),
    ("remembers motion",),
    ("drags less and less",),
    ("settles with the way",),
    pytest.param(("pushes during motion",), marks=pytest.mark.slow),
]
LENGTH = {"n_trajectories": 6, "duration": 6.0}
SHORT = {"n_trajectories": 4, "duration": 4.0}


def _since_reversal(x, name):
    """A hump along the way since the joint turned back, alike in both directions."""
    way = np.zeros(len(x))
    for _, rows in x.groupby("trajectory").indices.items():
        q = x[name].to_numpy()[rows]
        step = np.diff(q, prepend=q[0])
        turns = np.flatnonzero(np.diff(np.sign(step), prepend=0) != 0)
        turn = turns[np.maximum(np.searchsorted(turns, np.arange(len(q)), "right") - 1, 0)]
        way[rows] = np.abs(q - q[turn]) / 0.2
    return way * np.exp(1 - way)


def _warmed(x, name, time_constant):
    """Square of a velocity, averaged over the recent past."""
    heat = np.zeros(len(x))
    for _, rows in x.groupby("trajectory").indices.items():
        power, t = x[name].to_numpy()[rows] ** 2, x["time"].to_numpy()[rows]
        for i in range(1, len(t)):
            now = heat[rows[i - 1]]
            heat[rows[i]] = now + (t[i] - t[i - 1]) / time_constant * (power[i] - now)
    return heat


def _way(x, name):
    """Distance since the start of the recording."""
    step = (x[name].abs() * x["time"].diff()).where(x["trajectory"].diff() == 0, 0.0)
    return step.groupby(x["trajectory"]).cumsum()


def _last_turn(x, name):
    """Position of the last reversal, or of the start before the first one."""
    held = np.zeros(len(x))
    for _, rows in x.groupby("trajectory").indices.items():
        q = x[name].to_numpy()[rows]
        turns = np.r_[0, np.flatnonzero(np.diff(np.sign(np.diff(q)))) + 1]
        held[rows] = q[turns[np.searchsorted(turns, np.arange(len(q)), "right") - 1]]
    return np.tanh(1.5 * held)


def _snapped(x, name, play):
    """1 or -1, switched where the position passes the middle by some play."""
    state = np.zeros(len(x))
    middle = x[name].median()
    for _, rows in x.groupby("trajectory").indices.items():
        q = x[name].to_numpy()[rows] - middle
        at = 1.0 if q[0] > 0 else -1.0
        for row, here in zip(rows, q, strict=True):
            at = np.sign(here) if abs(here) > play else at
            state[row] = at
    return state


def _relaxed(x, name, time_constant):
    """Position less what follows it with a time constant."""
    left = np.zeros(len(x))
    for _, rows in x.groupby("trajectory").indices.items():
        q, t = x[name].to_numpy()[rows], x["time"].to_numpy()[rows]
        slow = q[0]
        for i in range(1, len(q)):
            slow += (t[i] - t[i - 1]) / time_constant * (q[i] - slow)
            left[rows[i]] = q[i] - slow
    return left


def diagnosed(log, y):
    """The motion is as it should be: no test looks at the checks of the log."""
    return diagnose(RBDRegressor(log.robot, ("viscous", "coulomb")), log.X, y, checks=())


@pytest.mark.parametrize("forms", TOGETHER, ids=" and ".join)
def test_a_form_in_no_catalogue_is_unknown_and_its_signals_are_named(forms):
    many = forms[0] in AMONG_MANY
    robot, length = (load_ur5(), SHORT) if many else (load_planar_arm(), LENGTH)
    log = make_hidden_effect_log(robot, None, random_state=11, **length)
    y = np.array(log.y, dtype=float)
    for form in forms:
        joint, size, torque, *_ = FORMS[form]
        y[:, joint - 1] += size * torque(log.X)

    diagnosis = diagnosed(log, y)

    assert diagnosis.verdict == "unknown"
    findings = {finding.joints: finding for finding in diagnosis.findings}
    assert len(findings) == len(diagnosis.findings) == len(forms)
    for form in forms:
        joint, size, _, signals, formula = FORMS[form]
        assert set(findings[joint,].variables) == signals
        if formula is not None:
            proposal = diagnosis.unknowns[0].proposal
            assert proposal.expressions == (formula,)
            assert proposal.coefficients[0] == pytest.approx(size, rel=0.1)


def test_signals_are_found_of_a_torque_that_bodies_mostly_take_in():
    robot = load_panda()
    log = make_hidden_effect_log(robot, None, n_trajectories=6, duration=5.0, random_state=24)
    q4, q6 = (log.X[name] - log.X[name].median() for name in ("q4", "q6"))
    y = np.array(log.y, dtype=float)
    y[:, 1] += 8.0 * np.maximum(q4 - 0.1, 0.0) * q6

    diagnosis = diagnosed(log, y)

    assert diagnosis.findings[0].joints == (2,)
    assert set(diagnosis.findings[0].variables) == {"q4", "q6"}


@pytest.mark.slow
@pytest.mark.filterwarnings("error::RuntimeWarning")
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


@pytest.mark.slow
def test_what_lies_between_two_joints_is_one_finding_on_both():
    log = make_hidden_effect_log(load_ur5(), None, random_state=11, **LENGTH)
    x = log.X["q3"] + 0.6 * log.X["q4"]
    tight = 8 * np.maximum(0.0, x - np.quantile(x, 0.7))
    y = np.array(log.y, dtype=float)
    y[:, 2] += tight
    y[:, 3] += 0.6 * tight

    diagnosis = diagnosed(log, y)

    (finding,) = diagnosis.findings
    assert (finding.kind, finding.joints) == ("coupling_spring", (3, 4))
    assert finding.parameters["k"]["value"] == pytest.approx(8.0, rel=0.01)
    assert finding.parameters["ratio"]["value"] == pytest.approx(0.6, rel=0.01)


@pytest.mark.slow
def test_a_bath_that_the_tool_dips_into_drags_on_all_joints():
    log = make_hidden_effect_log(load_ur5(), None, random_state=11, **SHORT)
    q, dq = (log.X[[f"{s}{j}" for j in range(1, 7)]].to_numpy() for s in ("q", "dq"))
    place = log.robot.forward_kinematics(q)[0]
    jacobian = log.robot.jacobian(q)[:, :3]
    velocity = np.einsum("ian,in->ia", jacobian, dq)
    deep = place[:, 2] < np.quantile(place[:, 2], 0.5)
    y = np.array(log.y) + 30 * np.einsum("ian,ia->in", jacobian, velocity) * deep[:, None]

    diagnosis = diagnosed(log, y)

    assert diagnosis.verdict == "unknown"
    assert set(diagnosis.findings[0].variables) == {"tool position", "tool velocity"}
