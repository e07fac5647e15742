# SPDX-License-Identifier: BSD-3-Clause
"""Every bad input of docs/bad_input.rst gives the error or the warning that the page promises."""

import io
import zipfile

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_panda, load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import check_log, read_log

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=4.0).frame


def test_absent_unknown_and_empty_files(tmp_path):
    with pytest.raises(LogError, match="no such file"):
        read_log(tmp_path / "log.csv")
    (tmp_path / "log.xyz").write_text("1")
    with pytest.raises(LogError, match="unknown kind of log '.xyz'"):
        read_log(tmp_path / "log.xyz")
    (tmp_path / "log.csv").write_text("")
    with pytest.raises(LogError, match="empty"):
        read_log(tmp_path / "log.csv")
    with pytest.raises(LogError, match="list of paths is empty"):
        read_log([])


def test_rows_in_reverse_order(saved):
    one = LOG[LOG["trajectory"] == 1].drop(columns="trajectory")
    with pytest.raises(LogError, match=r"reverse order. Sort them by time"):
        read_log(saved(one[::-1]))


def test_gaps_are_counted():
    gap = LOG.drop(index=range(100, 200))
    quality = check_log(gap)
    assert quality.gaps == 1
    assert any(
        "1 gap(s) in time inside trajectories: the longest lasts 1.01 s" in w
        for w in quality.warnings
    )


def test_repeated_times_are_counted(saved):
    repeated = pd.concat([LOG, LOG.iloc[[10, 20]]]).sort_values("time", kind="stable")
    with pytest.warns(LogWarning, match="2 of 1202 rows repeat the time.*first in row 11"):
        frame = read_log(saved(repeated), check=False)
    assert len(frame) == len(LOG)


def test_stale_rows_are_counted():
    stale = LOG.copy()
    signals = [name for name in LOG.columns if name[0] in "qd"]
    stale.loc[1::2, signals] = LOG.loc[0::2, signals].to_numpy()
    quality = check_log(stale)
    assert quality.repeated_rows > 0.8 * len(LOG) / 2
    assert any("no position changes although joints move" in text for text in quality.warnings)


def test_single_trajectory_is_told():
    quality = check_log(LOG[LOG["trajectory"] == 1])
    assert any("single trajectory" in text for text in quality.notes)
    assert not check_log(LOG).notes


def test_constant_joint_and_constant_torque_are_told():
    quality = check_log(LOG.assign(q1=0.3, dq1=0.0, tau2=1.0), ROBOT)
    assert any("joint 1 (joint1) hardly moves" in text for text in quality.warnings)
    assert any("torque of joint 2 (joint2) is constant" in text for text in quality.warnings)


def test_saturated_torque_is_told():
    limit = LOG["tau1"].abs().quantile(0.9)
    quality = check_log(LOG.assign(tau1=LOG["tau1"].clip(-limit, limit)))
    assert any("(joint1) stays at its extreme value" in text for text in quality.warnings)


def test_degrees_are_suspected_with_the_evidence():
    panda = load_panda()
    log = make_hidden_effect_log(panda, None, n_trajectories=2, duration=4.0).frame
    angles = [f"{name}{k}" for name in ("q", "dq") for k in range(1, 8)]
    log[angles] = np.rad2deg(log[angles])
    told = [text for text in check_log(log, panda).warnings if "degrees" in text]
    assert len(told) == 1 and "where the limit is" in told[0] and "units={'q': 'deg'," in told[0]


@pytest.mark.parametrize(
    "change, unit",
    [
        ({"time": 1e3}, "time looks like ms"),
        ({"time": 1e9}, "time looks like ns"),
        ({"dq1": 57.29578, "dq2": 57.29578}, "velocities look like deg/s"),
        ({"q1": 57.29578, "q2": 57.29578}, "positions look like degrees"),
        ({"dq1": -1.0, "dq2": -1.0}, "has the opposite sign"),
        ({"dq1": 1.6, "dq2": 1.6}, "is not the derivative"),
    ],
)
def test_inconsistent_units_are_suspected(change, unit):
    other = LOG.assign(**{name: LOG[name] * factor for name, factor in change.items()})
    assert any(unit in text for text in check_log(other).warnings)


def test_joint_counts_that_differ(saved):
    with pytest.raises(LogError, match=r"has 2 joints.*robot has 7.*joints=\[...\]"):
        read_log(saved(LOG), robot=load_panda())
    with pytest.raises(LogError, match="the log has 2 joints, the robot has 7"):
        check_log(LOG, load_panda())
    with pytest.raises(LogError, match=r"tau3, but positions of 2 joint"):
        read_log(saved(LOG.assign(tau3=0.0)))


def test_joint_names_that_differ_are_suggested(saved):
    renamed = LOG.rename(columns=lambda name: name.replace("q1", "q_jiont1").replace("q2", "q_x"))
    with pytest.raises(LogError, match=r"joint1, joint2 \(did you mean 'jiont1'\?\)"):
        read_log(saved(renamed), robot=ROBOT)
    with pytest.raises(LogError, match="'speed', .*did you mean 'speed1'"):
        read_log(saved(LOG.rename(columns={"q1": "speed1"})), columns={"q": ["speed", "q2"]})


def test_currents_passed_as_torques_are_suspected():
    panda = load_panda()
    log = make_hidden_effect_log(panda, None, n_trajectories=3, duration=5.0).frame
    torques = [f"tau{k}" for k in range(1, 8)]
    assert not [text for text in check_log(log, panda).warnings if "currents" in text]
    log[torques] /= 9.0
    told = [text for text in check_log(log, panda).warnings if "motor currents" in text]
    assert len(told) == 1 and "panda_joint2 0.1" in told[0]


def test_pickles_in_npz_are_refused(tmp_path):
    objects = np.array([{"a": 1}, None], dtype=object)
    np.savez(tmp_path / "log.npz", t=np.arange(2), q=objects)
    with pytest.raises(LogError, match="pickles"):
        read_log(tmp_path / "log.npz")


def test_archives_that_unpack_to_too_much_are_refused(tmp_path):
    np.savez_compressed(tmp_path / "bomb.npz", t=np.zeros(2_000_000))
    with pytest.raises(LogError, match="more than max_bytes"):
        read_log(tmp_path / "bomb.npz", max_bytes=2**20)
    header = io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (10**12,)}
    np.lib.format.write_array_header_1_0(header, shape)
    with zipfile.ZipFile(tmp_path / "lie.npz", "w") as archive:
        archive.writestr("t.npy", header.getvalue() + b"\0" * 80)
    with pytest.raises(LogError, match="declares an array of shape"):
        read_log(tmp_path / "lie.npz")
    (tmp_path / "no.npz").write_bytes(b"no archive")
    with pytest.raises(LogError, match="not a NumPy archive"):
        read_log(tmp_path / "no.npz")


def test_lists_of_differing_length(tmp_path):
    rows = [[0.0, 0.0]] * 5 + [[0.0]]
    pd.DataFrame({"time": range(6), "position": rows, "effort": rows}).to_parquet(
        tmp_path / "log.parquet"
    )
    with pytest.raises(LogError, match="position has 1 values in row 5, 2 in most"):
        read_log(tmp_path / "log.parquet")


def test_channels_without_common_time(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, start in (("q", 0.0), ("tau", 100.0)):
            file[f"{name}_group/time"] = start + np.arange(50) / 100
            file[f"{name}_group/{name}"] = np.ones((50, 2))
    with pytest.raises(LogError, match="do not overlap in time"):
        read_log(tmp_path / "log.h5")


def test_broken_bags(tmp_path):
    pytest.importorskip("mcap_ros2")
    pytest.importorskip("rosbags")
    for name in ("log.mcap", "log.bag", "log.db3"):
        (tmp_path / name).write_bytes(b"nothing of the kind" * 10)
        with pytest.raises(LogError, match=name):
            read_log(tmp_path / name)


def test_broken_containers(tmp_path):
    pytest.importorskip("h5py")
    for name in ("log.h5", "log.mat", "log.parquet"):
        (tmp_path / name).write_bytes(b"nothing of the kind" * 10)
        with pytest.raises(LogError, match=name):
            read_log(tmp_path / name)


def test_suspicions_are_issued_as_warnings(saved):
    first = LOG[LOG["trajectory"] == 1].reset_index(drop=True)
    with pytest.warns(LogWarning, match="1 gap") as caught:
        read_log(saved(first.drop(index=range(100, 200))), robot=ROBOT)
    assert caught[0].filename == __file__  # at the caller's line, not inside skidyn


def test_a_time_to_split_at_is_no_yes_or_no(saved):
    with pytest.raises(LogError, match="split_gaps is True; expected the time in s"):
        read_log(saved(LOG), split_gaps=True)


def test_one_broken_log_among_fifty_is_named(tmp_path):
    files = []
    for k in range(50):
        rows = "".join(f"{t / 10},{t * 0.1},{t * 0.2}\n" for t in range(5))
        broken = "0.5,0.1\n" if k == 37 else ""
        files.append(tmp_path / f"robot_{k}.csv")
        files[-1].write_text("time,q1,tau1\n" + rows + broken)
    with pytest.raises(LogError, match=r"robot_37\.csv: line 7 has 2 fields"):
        read_log(files, check=False)
