# SPDX-License-Identifier: BSD-3-Clause
"""What only changes the description of a log changes nothing of what is found in it."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

TURN = 2 * np.pi


def link(name: str, mass: float) -> str:
    return f"""
  <link name="{name}"><inertial><origin xyz="0.15 0.01 0"/><mass value="{mass}"/>
    <inertia ixx="0.002" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def joint(name: str, parent: str, child: str, xyz: str, axis: str = "0 1 0") -> str:
    return f"""
  <joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>
    <origin xyz="{xyz}"/><axis xyz="{axis}"/>
    <limit lower="-3.1" upper="3.1" effort="100" velocity="5"/></joint>"""


LEFT = [
    link("upper_left", 2.0),
    link("lower_left", 1.0),
    joint("shoulder_left", "base", "upper_left", "0 0.2 0"),
    joint("elbow_left", "upper_left", "lower_left", "0.3 0 0"),
]
RIGHT = [link("upper_right", 1.5), joint("shoulder_right", "base", "upper_right", "0 -0.2 0")]


def urdf(*branches: list[str]) -> str:
    return f'<robot name="torso"><link name="base"/>{"".join(map("".join, branches))}</robot>'


TORSO = urdf(LEFT, RIGHT)


@pytest.fixture(scope="module")
def log() -> Any:
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
def plain(log: Any) -> tuple[str, str, tuple[int, ...], np.ndarray]:
    found = answer(TORSO, log.frame)
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


@pytest.mark.filterwarnings("ignore::skidyn.exceptions.LogWarning")
@pytest.mark.parametrize(
    "changes", [(later, reordered, turned), (restarted, renumbered), (duplicated,)]
)
def test_how_time_trajectories_and_turns_are_counted_changes_nothing(
    changes: tuple[Callable[[pd.DataFrame], pd.DataFrame], ...], log: Any, plain: Any
) -> None:
    frame = log.frame
    for change in changes:
        frame = change(frame)

    *said, figures = answer(TORSO, frame)

    assert said == list(plain[:3])
    np.testing.assert_allclose(figures, plain[3], rtol=1e-5)


@pytest.mark.parametrize("factor", [1e-9, 1e9])
def test_torque_and_inertia_in_another_unit_change_nothing(
    factor: float, log: Any, plain: Any
) -> None:
    text = re.sub(
        r'(value|ixx|iyy|izz)="([^"]+)"', lambda m: f'{m[1]}="{float(m[2]) * factor!r}"', TORSO
    )
    frame = log.frame.copy()
    frame[["tau1", "tau2", "tau3"]] *= factor

    verdict, kind, joints, figures = answer(text, frame)

    assert (verdict, kind, joints) == plain[:3]
    # dF with its interval, errors and noise are torques; vs and delta are none.
    scale = np.ones(len(figures))
    scale[:3] = scale[9:] = factor
    np.testing.assert_allclose(figures / scale, plain[3], rtol=1e-5)


def test_trajectories_cut_in_two_give_the_same_finding(log: Any, plain: Any) -> None:
    half = log.frame.groupby("trajectory").cumcount() >= 250

    *said, figures = answer(TORSO, log.frame.assign(trajectory=2 * log.frame.trajectory + half))

    assert said == list(plain[:3])
    # Other folds and a few rows less at the cuts.
    np.testing.assert_allclose(figures, plain[3], rtol=0.1)


def test_names_of_joints_change_nothing(log: Any, plain: Any) -> None:
    text = TORSO.replace("elbow_left", "b").replace("shoulder_left", "c")

    *said, figures = answer(text, log.frame)

    assert said == list(plain[:3])
    np.testing.assert_allclose(figures, plain[3], rtol=1e-9)


def test_a_joint_that_counts_the_other_way_round_changes_nothing(log: Any, plain: Any) -> None:
    text = TORSO.replace(LEFT[3], LEFT[3].replace("0 1 0", "0 -1 0"))
    frame = log.frame.copy()
    frame[["q2", "dq2", "tau2"]] *= -1

    *said, figures = answer(text, frame)

    assert said == list(plain[:3])
    np.testing.assert_allclose(figures, plain[3], rtol=1e-5)


def test_the_order_of_branches_changes_nothing_but_the_numbers_of_joints(
    log: Any, plain: Any
) -> None:
    text = urdf(RIGHT, LEFT)
    names = {f"{c}{old}": f"{c}{new}" for c in ("q", "dq", "tau") for old, new in ORDER.items()}
    frame = log.frame.rename(columns=names)

    verdict, kind, joints, figures = answer(text, frame[list(log.frame)])

    assert (verdict, kind, joints) == (*plain[:2], (3,))
    expected = plain[3].copy()
    errors = expected[9:].reshape(3, 3)[:, [2, 0, 1]]
    np.testing.assert_allclose(figures, [*expected[:9], *errors.ravel()], rtol=1e-5)


#: Number of a joint when the right arm stands first, by its number when the left one does.
ORDER = {1: 2, 2: 3, 3: 1}
