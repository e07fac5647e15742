# SPDX-License-Identifier: BSD-3-Clause
"""From channels to a table of signals: velocities, further columns, commands."""

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import read_log
from skidyn.simulation import Controller, servo_torque

ROBOT = load_planar_arm()
N = 200
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=4.0).frame


def table(n=N, names="q{k} dq{k} tau{k}", rate=100.0):
    """Two joints that swing, with torques of the order of the planar arm's."""
    t = np.arange(n) / rate
    columns = {"time": t}
    q, dq, tau = names.split()
    for k in range(2):
        phase = 2 * np.pi * (0.7 + 0.4 * k)
        columns[q.format(k=k + 1, j=ROBOT.joint_names[k])] = 0.5 * np.sin(phase * t)
        columns[dq.format(k=k + 1, j=ROBOT.joint_names[k])] = 0.5 * phase * np.cos(phase * t)
        columns[tau.format(k=k + 1, j=ROBOT.joint_names[k])] = np.cos(phase * t) + k
    return pd.DataFrame(columns)


def test_missing_velocity_is_derived_and_said(tmp_path):
    source = table()
    source.drop(columns=["dq1", "dq2"]).to_csv(tmp_path / "log.csv", index=False)
    with pytest.warns(LogWarning, match="derived by central differences"):
        frame = read_log(tmp_path / "log.csv", check=False)
    np.testing.assert_allclose(frame["dq1"][1:-1], source["dq1"][1:-1], atol=5e-3)


def test_further_columns_stay(tmp_path):
    table().assign(volts=24.0, note="calm").to_csv(tmp_path / "log.csv", index=False)
    with pytest.warns(LogWarning, match="without numbers left out: note"):
        frame = read_log(tmp_path / "log.csv", check=False)
    assert (frame["volts"] == 24).all()


def test_commands_may_stand_in_place_of_torque(tmp_path):
    time = np.arange(20) * 0.01
    table = pd.DataFrame({"time": time, "q1": np.sin(time), "q_ref1": np.sin(time) + 0.1})
    table.to_csv(tmp_path / "run.csv", index=False)
    with pytest.raises(LogError, match="lacks tau1"):
        read_log(tmp_path / "run.csv")
    with pytest.warns(LogWarning, match="no velocities recorded"):
        frame = read_log(tmp_path / "run.csv", needs_torque=False)
    assert frame.columns.tolist() == ["time", "trajectory", "q1", "dq1", "cmd1"]
    torque = servo_torque(Controller(20.0), frame)
    np.testing.assert_allclose(torque, 2.0)


def quiet_read(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return read_log(*args, **options)


def test_currents_are_never_taken_for_torques(saved):
    currents = LOG.rename(columns={"tau1": "i1", "tau2": "i2"})
    with pytest.raises(LogError, match="holds motor currents.*drive_gains"):
        read_log(saved(currents))
    frame = quiet_read(saved(currents), drive_gains=[10.0, 4.0])
    np.testing.assert_allclose(frame["tau2"], 4.0 * LOG["tau2"])
    with pytest.raises(LogError, match=r"expected 2 finite numbers.*\[0.62, 0.5\]"):
        read_log(saved(currents), drive_gains=[10.0])
    with pytest.raises(LogError, match="has no currents"):
        read_log(saved(LOG), drive_gains=[10.0, 4.0])


def test_the_gain_of_one_joint_may_be_a_number(saved):
    one = LOG[["time", "q1", "dq1"]].assign(i1=LOG["tau1"])
    np.testing.assert_allclose(quiet_read(saved(one), drive_gains=0.62)["tau1"], 0.62 * LOG["tau1"])
    with pytest.raises(LogError, match=r"currents \(i1\) and no torques"):
        read_log(saved(one))


def test_a_file_is_named_once(saved):
    path = saved(LOG.drop(columns="time"))
    with pytest.raises(LogError, match=r"log.csv has no time column"):
        read_log(path)


def test_a_clock_without_values_is_replaced_by_a_rate(saved):
    path = saved(LOG.assign(time=np.nan))
    for missing in ("error", "drop"):
        with pytest.raises(LogError, match="No row has a time: state the sampling rate"):
            read_log(path, missing=missing)
    assert quiet_read(path, rate=50.0)["time"].iloc[1] == 0.02


def test_trajectory_numbers_must_be_whole(saved):
    with pytest.raises(LogError, match="whole numbers"):
        read_log(saved(LOG.assign(trajectory=LOG["trajectory"] + 0.5)))


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_units_of_velocities_that_are_derived_are_those_of_the_positions(saved):
    degrees = LOG.drop(columns=["dq1", "dq2"])
    degrees[["q1", "q2"]] = np.rad2deg(LOG[["q1", "q2"]])
    degrees = degrees.assign(cmd1=degrees["q1"], cmd2=degrees["q2"])
    frame = read_log(saved(degrees), units={"q": "deg", "dq": "deg/s"}, check=False)
    assert (frame["dq1"] - LOG["dq1"]).abs().median() < 0.01
    assert any("--units cmd=deg" in note for note in frame.attrs["notes"])


def test_unit_of_an_absent_quantity(saved):
    with pytest.raises(LogError, match="has no temp"):
        read_log(saved(LOG), units={"temp": "K"})
