# SPDX-License-Identifier: BSD-3-Clause
"""Hidden effects are named and sized, and what is wrong with the data is not taken for one."""

from __future__ import annotations

import json
import re
import sys
import warnings
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_panda, load_planar_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.exceptions import LogError, LogWarning
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor
from skidyn.measurement import Suspicion
from skidyn.robots import Robot

ROBOTS = {"ur5": load_ur5, "planar arm": load_planar_arm}
#: Parameter of the truth whose interval is checked.
SIZE = {
    "viscous": "Fv",
    "coulomb": "Fc",
    "offset": "tau0",
    "asymmetric_friction": "dFv",
    "stribeck": "dF",
    "nonlinear_viscous": "power",
    "load_dependent_friction": "mu",
    "dahl": "presliding",
    "rotor_inertia": "Ia",
    "spring": "k",
    "torque_ripple": "N",
    "payload": "mass",
    "time_delay": "delay",
    "temperature_friction": "dFv_dT",
}
#: Kinds that act on all joints, or on the tool: the joints are not chosen.
WHOLE = ("payload", "time_delay")
HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}
#: As much as these effects need.
LENGTH = {
    "ur5": {"n_trajectories": 4, "duration": 5.0},
    "planar arm": {"n_trajectories": 8, "duration": 8.0},
}
#: Friction of one joint stands for these where there are six joints. Viscous friction is named on
#: three of six in test_reconsideration.py.
ALIKE = (
    *("viscous", "stribeck", "offset", "asymmetric_friction"),
    *("nonlinear_viscous", "temperature_friction"),
)
#: Tested always: friction of a joint of two, and of six.
FIRST = [
    ("stribeck", "planar arm"),
    ("load_dependent_friction", "ur5"),
]
#: Kind, robot and noise: each kind with one noise on two joints, and some of them on six.
CASES = [
    pytest.param(kind, robot, noise, marks=[] if (kind, robot) in FIRST else [pytest.mark.slow])
    for r, robot in enumerate(ROBOTS)
    for k, kind in enumerate(SIZE)
    for noise in [("low", "high")[(k + r) % 2]]
    if robot != "ur5" or (noise == "low" and kind not in ALIKE)
]
TURN = 2 * np.pi
#: Number of a joint when the right arm stands first, by its number when the left one does.
ORDER = {1: 2, 2: 3, 3: 1}


def hidden_log(kind, robot, noise):
    base = tuple(b for b in ("viscous", "coulomb") if b != kind)
    # The inertia of the rotor of a UR's second joint is part of its link's: take one that shows.
    joint = 4 if kind == "rotor_inertia" and robot == "ur5" else 2
    joints = None if kind in (None, *WHOLE) else [joint]
    options = {"joints": joints, "noise": noise, "base": base}
    options |= LENGTH[robot]
    log = make_hidden_effect_log(ROBOTS[robot](), kind, random_state=11, **options)
    return log, RBDRegressor(log.robot, base)


@cache
def healthy(robot, noise):
    """The diagnosis of a log that hides nothing."""
    log, model = hidden_log(None, robot, noise)
    return diagnose(model, log.X, log.y)


@pytest.mark.parametrize(("kind", "robot", "noise"), CASES)
def test_hidden_effect_is_named_and_sized_and_the_error_falls(kind, robot, noise):
    log, model = hidden_log(kind, robot, noise)

    diagnosis = diagnose(model, log.X, log.y)

    assert diagnosis.verdict == "missing"
    assert len(diagnosis.findings) == 1, [f.sentence for f in diagnosis.findings]
    finding = diagnosis.findings[0]
    names = {finding.kind, *finding.rivals}
    if kind in HYSTERESIS:  # members of the family need a special motion to be told apart
        assert finding.kind in HYSTERESIS
        assert kind in names
    else:
        assert finding.kind == kind
    assert finding.joints == tuple(log.joints)
    assert finding.q_value < 1e-3
    if finding.kind == kind:
        # The simulated temperature dependence is exponential, the fitted one a parabola.
        spare = 0.25 if kind == "temperature_friction" else 0.01
        _assert_inside(finding.parameters[SIZE[kind]], log.parameters[SIZE[kind]], spare)
    # Noise of the simulated sensors, or what the model without an effect leaves: whichever is more.
    floor = healthy(robot, noise).rmse_before
    reached = diagnosis.rmse_after / np.maximum(floor, log.noise_std)
    limit = 2.0 if kind == "time_delay" else 1.5
    assert np.all(reached < limit), reached
    assert np.any(diagnosis.rmse_after < 0.99 * diagnosis.rmse_before)


@pytest.mark.parametrize("noise", ["low", "high"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_nothing_is_found_where_nothing_is_hidden(robot, noise):
    diagnosis = healthy(robot, noise)

    assert diagnosis.verdict == "complete"
    assert diagnosis.findings == []
    assert diagnosis.limits, "what the data could still hide is stated"


def _assert_inside(parameter, truth, spare):
    value, low, high = (parameter[k] for k in ("value", "low", "high"))
    truth = float(np.ravel(truth)[0])
    # A 95 % interval misses once in twenty: a little more than itself must hold the truth.
    margin = 0.5 * (high - low) + spare * abs(truth)
    assert low - margin <= truth <= high + margin, (low, truth, high)
    assert abs(value - truth) < (0.15 + spare) * abs(truth)


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(load_planar_arm(), None, noise="high", random_state=8)


def found(log, X, torque):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        diagnosis = diagnose(RBDRegressor(log.robot), X, torque)
    said = " ".join([*diagnosis.warnings, *(str(w.message) for w in caught)])
    return [(f.kind, f.joints) for f in diagnosis.findings], said


@pytest.mark.slow
def test_quantised_torque(log):
    step = 0.5 * np.std(log.y, axis=0)

    kinds, _ = found(log, log.X, np.round(log.y / step) * step)

    assert kinds == []


@pytest.mark.slow
def test_a_few_broken_rows(log):
    torque = np.array(log.y)
    rng = np.random.default_rng(0)
    rows = rng.choice(len(torque), 20, replace=False)
    torque[rows] += 30 * rng.normal(size=(20, 2)) * np.std(torque, axis=0)

    kinds, said = found(log, log.X, torque)

    assert kinds == []
    assert "has outliers" in said


@pytest.mark.slow
def test_rows_repeated_by_a_logger_that_polls_too_fast(log):
    X, torque = log.X.copy(), np.array(log.y)
    columns = ["q1", "q2", "dq1", "dq2"]
    late = np.arange(4, len(X), 7)
    X.loc[late, columns] = X.loc[late - 1, columns].to_numpy()
    torque[late] = torque[late - 1]

    kinds, said = found(log, X, torque)

    assert kinds == []
    assert "repeat" in said


@pytest.mark.slow
def test_a_torque_channel_that_lags(log):
    torque = np.array(log.y)
    for name in np.unique(log.X["trajectory"]):
        rows = np.flatnonzero(log.X["trajectory"] == name)
        torque[rows[2:]] = torque[rows[:-2]]

    kinds, _ = found(log, log.X, torque)

    assert [kind for kind, _ in kinds] == ["time_delay"]


@pytest.mark.slow
def test_torque_cut_off_at_a_limit_is_said(log):
    limit = np.quantile(np.abs(log.y[:, 0]), 0.9)

    kinds, said = found(log, log.X, np.clip(log.y, [-limit, -np.inf], [limit, np.inf]))

    assert {kind for kind, _ in kinds} <= {"saturation"}
    assert "saturated" in said


def test_an_error_of_units_is_said_with_its_evidence(log):
    X = log.X.copy()
    X[["q1", "q2", "dq1", "dq2"]] = np.rad2deg(X[["q1", "q2", "dq1", "dq2"]])

    with pytest.raises(LogError, match="degrees.*--units q=deg,dq=deg/s"):
        found(log, X, log.y)


def test_no_physics_is_named_while_a_unit_is_in_doubt():
    arm = load_planar_arm()
    log = make_hidden_effect_log(arm, "spring", n_trajectories=6, duration=4.0, random_state=3)
    X = log.X.assign(time=1.5 * log.X["time"])  # the clock, or velocities at another scale

    told = (
        r"measurement is in doubt \(.*scale of the clock.*\), "
        "so that no physical effect is identified"
    )
    with pytest.warns(LogWarning, match=told):
        doubted = diagnose(RBDRegressor(arm, effects=["viscous", "coulomb"]), X, log.y)

    assert {(check.check, check.certainty) for check in doubted.checks} == {
        ("clock_unit", "suspected")
    }
    assert {finding.kind for finding in doubted.findings} == {"unknown"}


@pytest.mark.slow
def test_an_effect_is_found_beside_a_joint_that_rests():
    robot, rng = load_planar_arm(), np.random.default_rng(0)
    tables, torques = [], []
    for trajectory in range(8):
        t = np.arange(0, 8, 0.01)
        a, w = rng.normal(size=(2, 3)), 2 * np.pi * np.array([0.2, 0.45, 0.7])
        phase = np.outer(t, w)
        q2 = 0.6 * (np.sin(phase) @ a[0] + np.cos(phase) @ a[1])
        dq2 = 0.6 * (np.cos(phase) @ (a[0] * w) - np.sin(phase) @ (a[1] * w))
        ddq2 = -0.6 * (np.sin(phase) @ (a[0] * w**2) + np.cos(phase) @ (a[1] * w**2))
        still = np.zeros_like(q2)
        q, dq, ddq = (np.column_stack([still, x]) for x in (q2, dq2, ddq2))
        tau = robot.inverse_dynamics(q, dq, ddq)
        tau[:, 1] += 0.4 * dq2 + 0.6 * np.tanh(dq2 / 0.01) + 1.5 * (q2 - 0.2)
        tau += 0.02 * rng.normal(size=tau.shape)
        frame = {"time": t, "trajectory": trajectory, "q1": q[:, 0], "q2": q2}
        tables.append(pd.DataFrame(frame | {"dq1": still, "dq2": dq2}))
        torques.append(tau)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it rests is said too
        diagnosis = diagnose(RBDRegressor(robot), pd.concat(tables), np.vstack(torques))

    assert [(f.kind, f.joints) for f in diagnosis.findings] == [("spring", (2,))]
    assert np.isfinite(diagnosis.rmse_after).all()
    assert 0 <= diagnosis.findings[0].q_value < 1e-6


def test_a_robot_that_rests_is_refused_by_a_sentence():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=4, duration=4.0)
    X = log.X.copy()
    moving = [c for c in X.columns if c[0] in "dq" and c[-1].isdigit()]
    X[moving] = 0.0
    y = 0.3 + 0.01 * np.random.default_rng(2).normal(size=np.shape(log.y))

    with pytest.raises(ValueError, match="no joint moves long enough"):
        diagnose(RBDRegressor(log.robot), X, y)


def test_a_short_log_is_refused_with_its_file_and_what_it_lacks():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=0.5)
    X = log.X.copy()
    X.attrs["files"] = ["short.csv"]
    with pytest.raises(LogError, match=r"^short.csv: no joint.*0.49 s in 1 traj.*8 are needed"):
        diagnose(RBDRegressor(log.robot), X, log.y)


def test_a_log_with_fewer_rows_than_its_model_needs_is_refused():
    log = make_hidden_effect_log(load_panda(), None, n_trajectories=1, duration=1.6)
    with pytest.raises(LogError, match=r"1.59 s in 1 traj.*windows away from rest.*; 1\d\d are"):
        diagnose(RBDRegressor(log.robot), log.X, log.y)


@pytest.mark.parametrize("model", [None, pd.DataFrame({"q1": [0.0]})])
def test_a_model_that_is_none_is_refused_with_the_order_of_arguments(model):
    with pytest.raises(ValueError, match=r"expected a regressor: diagnose\(model, X, tau\)"):
        diagnose(model, RBDRegressor(load_planar_arm()), [[0.0]])


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_what_is_wrong_with_a_log_survives_a_failure_of_its_checks(n_jobs, monkeypatch):
    def fails(measurement):
        raise IndexError("out of bounds")

    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=1.0)
    monkeypatch.setattr("skidyn.diagnosis._diagnosis.check_measurement", fails)
    with pytest.raises(LogError, match="no joint moves long enough"):
        diagnose(RBDRegressor(log.robot), log.X.iloc[:10], log.y[:10], n_jobs=n_jobs)


@pytest.mark.parametrize(
    ("load", "kind"),
    [
        (load_planar_arm, "load_dependent_friction"),
        pytest.param(load_ur5, "torque_gain", marks=pytest.mark.slow),
    ],
)
def test_a_completed_model_is_complete(load, kind):
    """Also where the effect's columns need the load or the torque of the model itself."""
    log = make_hidden_effect_log(load(), kind, joints=[2], n_trajectories=4, duration=4.0)
    model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    first = diagnose(model, log.X, log.y)
    assert [(f.kind, f.joints) for f in first.findings] == [(kind, (2,))]
    completed = model.with_effects(first.findings[0].terms)
    second = diagnose(completed, log.X, log.y, checks=first.checks)
    assert second.verdict == "complete"
    assert second.rmse_before == pytest.approx(first.rmse_after, rel=0.1)
    assert Session(completed, log.X, log.y).history[0]["rmse"] is not None


@pytest.fixture(scope="module")
def sticking():
    return make_hidden_effect_log(
        load_planar_arm(), "stribeck", joints=[2], n_trajectories=4, duration=4.0
    )


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
def test_two_processes_give_the_same_report_to_the_last_bit(sticking):
    one, two = (
        diagnose(RBDRegressor(sticking.robot), sticking.X, sticking.y, n_jobs=n).to_dict()
        for n in (1, 2)
    )
    assert json.dumps(one, default=str) == json.dumps(two, default=str)
    assert [e["kind"] for e in one["effects"]] == ["stribeck"]


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_doubt_keeps_names_back_however_many_processes_work(sticking, n_jobs, monkeypatch):
    told = [Suspicion("copied_torque", "a torque twice", "in every row", "suspected")]
    monkeypatch.setattr("skidyn.diagnosis._diagnosis.check_measurement", lambda _: told)
    with pytest.warns(UserWarning, match="no physical effect is identified"):
        diagnosis = diagnose(RBDRegressor(sticking.robot), sticking.X, sticking.y, n_jobs=n_jobs)
    assert {finding.kind for finding in diagnosis.findings} <= {"unknown"}


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_a_log_that_is_certainly_wrong_is_refused(sticking, n_jobs):
    mirrored = sticking.frame.assign(dq2=-sticking.frame["dq2"])
    torque = [f"tau{j + 1}" for j in range(sticking.robot.n_joints)]
    with pytest.raises(ValueError, match="dq2|velocity of joint 2"):
        diagnose(
            RBDRegressor(sticking.robot),
            mirrored.drop(columns=torque),
            mirrored[torque],
            n_jobs=n_jobs,
        )


def link(name: str, mass: float) -> str:
    return f"""
  <link name="{name}"><inertial><origin xyz="0.15 0.01 0"/><mass value="{mass}"/>
    <inertia ixx="0.002" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def joint(name: str, parent: str, child: str, xyz: str, axis: str = "0 1 0") -> str:
    return f"""
  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}"/><axis xyz="{axis}"/>
    <limit lower="-3.1" upper="3.1" effort="100" velocity="5"/></joint>"""


def urdf(*branches: list[str]) -> str:
    return f'<robot name="torso"><link name="base"/>{"".join(map("".join, branches))}</robot>'


LEFT = [
    link("upper_left", 2.0),
    link("lower_left", 1.0),
    joint("shoulder_left", "base", "upper_left", "0 0.2 0"),
    joint("elbow_left", "upper_left", "lower_left", "0.3 0 0"),
]
RIGHT = [link("upper_right", 1.5), joint("shoulder_right", "base", "upper_right", "0 -0.2 0")]
TORSO = urdf(LEFT, RIGHT)


@pytest.fixture(scope="module")
def torso_log() -> Any:
    """Two arms on one torso; friction that falls with speed is hidden on the left elbow."""
    robot = Robot.from_urdf(TORSO)
    assert robot.joint_names == ("shoulder_left", "elbow_left", "shoulder_right")
    return make_hidden_effect_log(
        robot, "stribeck", joints=[2], n_trajectories=6, duration=5.0, random_state=3
    )


def split(frame: pd.DataFrame) -> tuple[pd.DataFrame, np.ndarray]:
    torque = [c for c in frame if c.startswith("tau")]
    return frame.drop(columns=torque), frame[torque].to_numpy()


def answer(text: str, frame: pd.DataFrame) -> tuple[str, str, tuple[int, ...], np.ndarray]:
    """Verdict, kind and joints of the only finding, and its figures with errors and q-value."""
    X, torque = split(frame)
    diagnosis = diagnose(RBDRegressor(Robot.from_urdf(text), ["viscous", "coulomb"]), X, torque)
    (finding,) = diagnosis.findings
    figures = [p[key] for p in finding.parameters.values() for key in ("value", "low", "high")]
    errors = [*diagnosis.rmse_before, *diagnosis.rmse_after, *diagnosis.sensor_noise]
    return diagnosis.verdict, finding.kind, finding.joints, np.array([*figures, *errors])


@pytest.fixture(scope="module")
def unchanged(torso_log: Any) -> tuple[str, str, tuple[int, ...], np.ndarray]:
    found = answer(TORSO, torso_log.frame)
    assert found[:3] == ("missing", "stribeck", (2,))
    return found


def later(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(time=frame.time + 1e5)


def restarted(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(time=frame.time - frame.groupby("trajectory").time.transform("min"))


def reordered(frame: pd.DataFrame) -> pd.DataFrame:
    parts = [part for _, part in frame.groupby("trajectory")]
    return pd.concat([parts[i] for i in (3, 0, 5, 1, 4, 2)], ignore_index=True)


def renumbered(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(trajectory=frame.trajectory.map([0, 30, 4, 8, 1, 7, 9].__getitem__))


def duplicated(frame: pd.DataFrame) -> pd.DataFrame:
    again = frame.assign(trajectory=frame.trajectory + 6, time=frame.time + 1e3)
    return pd.concat([frame, again], ignore_index=True)


def turned(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(q1=frame.q1 + TURN, q2=frame.q2 - 2 * TURN)


def in_unit(factor: float, text: str, frame: pd.DataFrame) -> tuple[str, pd.DataFrame]:
    """Robot and log with torque and inertia in another unit."""
    text = re.sub(
        r'(value|ixx|iyy|izz)="([^"]+)"', lambda m: f'{m[1]}="{float(m[2]) * factor!r}"', text
    )
    return text, frame.assign(**{tau: frame[tau] * factor for tau in ("tau1", "tau2", "tau3")})


def in_newton_meters(figures: np.ndarray, factor: float) -> np.ndarray:
    """Figures of a diagnosis in another unit: dF with its interval, errors and noise are torques.

    vs and delta are none.
    """
    scale = np.ones(len(figures))
    scale[:3] = scale[9:] = factor
    return figures / scale


# Changes that should change nothing are made together, since a diagnosis takes seconds.
@pytest.mark.filterwarnings("ignore::skidyn.exceptions.LogWarning")
def test_how_time_recordings_turns_and_units_are_counted_changes_nothing(
    torso_log: Any, unchanged: Any
) -> None:
    frame = duplicated(turned(reordered(later(torso_log.frame))))

    *said, figures = answer(*in_unit(1e9, TORSO, frame))

    assert said == list(unchanged[:3])
    np.testing.assert_allclose(in_newton_meters(figures, 1e9), unchanged[3], rtol=1e-5)


@pytest.mark.slow
def test_trajectories_cut_in_two_give_the_same_finding(torso_log: Any, unchanged: Any) -> None:
    half = torso_log.frame.groupby("trajectory").cumcount() >= 250

    *said, figures = answer(
        TORSO, torso_log.frame.assign(trajectory=2 * torso_log.frame.trajectory + half)
    )

    assert said == list(unchanged[:3])
    # Other folds and a few rows less at the cuts.
    np.testing.assert_allclose(figures, unchanged[3], rtol=0.1)


def test_names_and_directions_of_joints_and_numbers_of_recordings_change_nothing(
    torso_log: Any, unchanged: Any
) -> None:
    text = TORSO.replace(LEFT[3], LEFT[3].replace("0 1 0", "0 -1 0"))
    text = text.replace("elbow_left", "b").replace("shoulder_left", "c")
    frame = renumbered(torso_log.frame)
    frame[["q2", "dq2", "tau2"]] *= -1

    *said, figures = answer(text, frame)

    assert said == list(unchanged[:3])
    np.testing.assert_allclose(figures, unchanged[3], rtol=1e-9)


def test_the_order_of_branches_changes_nothing_but_the_numbers_of_joints(
    torso_log: Any, unchanged: Any
) -> None:
    """Also in a small unit, with times that start anew in every recording."""
    text, frame = in_unit(1e-9, urdf(RIGHT, LEFT), restarted(torso_log.frame))
    names = {f"{c}{old}": f"{c}{new}" for c in ("q", "dq", "tau") for old, new in ORDER.items()}
    frame = frame.rename(columns=names)

    verdict, kind, joints, figures = answer(text, frame[list(torso_log.frame)])

    assert (verdict, kind, joints) == (*unchanged[:2], (3,))
    expected = unchanged[3].copy()
    errors = expected[9:].reshape(3, 3)[:, [2, 0, 1]]
    expected = [*expected[:9], *errors.ravel()]
    np.testing.assert_allclose(in_newton_meters(figures, 1e-9), expected, rtol=1e-5)
