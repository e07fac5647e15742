# SPDX-License-Identifier: BSD-3-Clause
"""Labelled recordings, made here and real ones."""

import json

import numpy as np
import pytest

from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import load_recording


@pytest.fixture
def archive(tmp_path):
    """Two runs of a pendulum with currents; one unreadable row."""
    t = np.tile(np.arange(50) / 100, 2)
    q = np.sin(3 * t)[:, None]
    current = np.cos(3 * t)[:, None]
    current[10] = np.nan
    np.savez(
        tmp_path / "pendulum.npz",
        t=t,
        q=q,
        dq=3 * np.cos(3 * t)[:, None],
        i=current,
        volts=np.full((100, 1), 12.0),
        traj=np.repeat([0, 1], 50),
        traj_name=["free", "loaded"],
        traj_label=[json.dumps({"load_kg": 0.0}), json.dumps({"load_kg": 1.5})],
        fs=[100.0, 100.0],
        joint_names=["pivot"],
        meta=json.dumps({"robot": "pendulum"}),
    )
    return tmp_path / "pendulum.npz"


def test_runs_labels_and_gains(archive):
    recording = load_recording(archive, "loaded", drive_gains=[2.0])
    assert recording.labels == {1: {"load_kg": 1.5, "name": "loaded", "rate": 100.0}}
    assert recording.joint_names == ["pivot"] and recording.meta["robot"] == "pendulum"
    frame = recording.frame
    assert frame["trajectory"].unique().tolist() == [1]
    np.testing.assert_allclose(frame["tau1"], 2 * frame["i1"])
    assert (frame["volts"] == 12).all()


def test_unreadable_rows_are_counted(archive):
    with pytest.warns(LogWarning, match="1 of 100 rows"):
        assert len(load_recording(archive, drive_gains=[2.0]).frame) == 99
    with pytest.raises(LogError, match="1 of 100 rows"):
        load_recording(archive, drive_gains=[2.0], missing="error")


def test_requests_that_cannot_be_met(archive, tmp_path):
    with pytest.raises(LogError, match="no run 'heavy'; it has free, loaded"):
        load_recording(archive, "heavy")
    with pytest.raises(LogError, match="holds motor currents"):
        load_recording(archive, "loaded")
    with pytest.raises(LogError, match="no such file"):
        load_recording(tmp_path / "absent.npz")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(LogError, match="lacks t, q, traj"):
        load_recording(tmp_path / "other.npz")


@pytest.mark.parametrize(
    "file, gains, n_joints, n_runs",
    [
        ("panda/panda_gaz.npz", None, 7, 1),
        ("kuka_lwr4/kuka_lwr4.npz", None, 7, 3),
        ("ur10e/ur10e_validation.npz", [14.87, 13.26, 11.13, 10.62, 11.03, 11.47], 6, 11),
        ("bam/bam_pendulum.npz", [0.6], 1, 16),
    ],
)
def test_real_recordings(data_dir, file, gains, n_joints, n_runs):
    recording = load_recording(data_dir / file, drive_gains=gains)
    frame = recording.frame
    assert len(recording.joint_names) == n_joints and len(recording.labels) == n_runs
    assert frame["trajectory"].nunique() == n_runs
    names = [f"{name}{k + 1}" for name in ("q", "dq", "tau") for k in range(n_joints)]
    assert np.isfinite(frame[names].to_numpy()).all()


def test_payload_run_of_the_ur10e(data_dir):
    gains = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47]
    path = data_dir / "ur10e" / "ur10e_excitation.npz"
    names = json.loads(json.dumps(np.load(path)["traj_name"].tolist()))
    loaded = next(name for name in names if "20_02_19" in name and "oad" in name)
    recording = load_recording(path, loaded, drive_gains=gains)
    (label,) = recording.labels.values()
    assert label["payload_kg"] == pytest.approx(2.805)
