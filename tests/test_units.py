# SPDX-License-Identifier: BSD-3-Clause
"""Units are converted when that is asked for, and refused where a header states others."""

import warnings

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_scara, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import read_log

TIME = np.arange(50) / 100
SOURCE = pd.DataFrame(
    {"time": TIME, "q1": np.sin(TIME), "q2": np.cos(TIME), "dq1": np.cos(TIME)}
    | {"dq2": -np.sin(TIME), "tau1": 1 + TIME, "tau2": 2 - TIME}
)


def quiet_read(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        return read_log(*args, **options)


def assert_same(frame):
    for name in SOURCE:
        np.testing.assert_allclose(frame[name], SOURCE[name], rtol=0, atol=1e-9, err_msg=name)


def test_units_are_converted_on_request(tmp_path):
    degrees = SOURCE.copy()
    degrees[["q1", "q2"]] = np.rad2deg(SOURCE[["q1", "q2"]])
    degrees["time"] *= 1000
    degrees["tau2"] *= 1000
    degrees.to_csv(tmp_path / "log.csv", index=False)
    assert_same(quiet_read(tmp_path / "log.csv", units={"q": "deg", "time": "ms", "tau2": "mNm"}))
    with pytest.raises(LogError, match="'grad' is not a unit of q"):
        read_log(tmp_path / "log.csv", units={"q": "grad"})


def test_units_that_a_header_states_must_be_asked_for(tmp_path):
    stated = SOURCE.rename(columns={"time": "Time [ms]", "q1": "q1 (deg)", "q2": "q2 (deg)"})
    stated["Time [ms]"] *= 1000
    stated[["q1 (deg)", "q2 (deg)"]] = np.rad2deg(SOURCE[["q1", "q2"]])
    stated.to_csv(tmp_path / "log.csv", index=False)
    wanted = r"'Time \[ms\]' states ms.* pass units={'time': 'ms', 'q': 'deg'}"
    with pytest.raises(LogError, match=wanted):
        read_log(tmp_path / "log.csv")
    assert_same(quiet_read(tmp_path / "log.csv", units={"time": "ms", "q": "deg"}))


@pytest.mark.parametrize("name", ["time_ms", "t_ms", "Timestamp ms"])
def test_a_clock_whose_name_ends_in_its_unit(tmp_path, name):
    rows = [[name, "q1", "tau1"], ["0", "0", "1"], ["10", "1", "1"], ["20", "2", "1"]]
    (tmp_path / "log.csv").write_text("\n".join(map(",".join, rows)))
    with pytest.raises(LogError, match=f"'{name}' states ms.*--units time=ms"):
        read_log(tmp_path / "log.csv", check=False)
    frame = read_log(tmp_path / "log.csv", units={"time": "ms"}, check=False)
    np.testing.assert_allclose(frame["time"], [0.0, 0.01, 0.02])


@pytest.fixture
def lift(saved):
    """A log of a SCARA, whose third joint slides, with angles in degrees."""
    frame = make_hidden_effect_log(load_scara(), None, n_trajectories=1, duration=1.0).frame
    turning = [f"{quantity}{k}" for quantity in ("q", "dq") for k in (1, 2, 4)]
    return frame, saved(frame.assign(**{name: np.rad2deg(frame[name]) for name in turning}))


def test_degrees_are_those_of_turning_joints(lift):
    frame, path = lift
    units = {"q": "deg", "dq": "deg/s"}
    log = quiet_read(path, robot=load_scara(), units=units, check=False)
    np.testing.assert_allclose(log.filter(regex="^d?q"), frame.filter(regex="^d?q"), atol=1e-6)
    assert any("deg was not applied to q3 (" in note for note in log.attrs["notes"])


@pytest.mark.parametrize("units", [{"q3": "deg"}, {"q1": "mm"}, {"dq3": "deg/s"}])
def test_a_unit_that_a_joint_cannot_have_is_refused_with_its_name(lift, units):
    (target,) = units
    with pytest.raises(LogError, match=rf"is no unit of {target} \(.*use one of"):
        read_log(lift[1], robot=load_scara(), units=units)
