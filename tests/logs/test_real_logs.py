# SPDX-License-Identifier: BSD-3-Clause
"""The real recordings are read, and their known defects are told."""

import warnings

import numpy as np
import pytest

from skidyn.exceptions import LogError
from skidyn.logs import check_log, read_log

#: File, and a word of what is known to be wrong with it; None where nothing is.
KNOWN = {
    "bam/bam_pendulum.npz": "extreme value",
    "dfki/simple_pendulum.npz": "polled faster",
    "dvrk/dvrk_mtm.npz": "polled faster",
    "dvrk/dvrk_psm.npz": None,
    "emps/emps.npz": "single trajectory",
    "kuka_lwr4/kuka_lwr4.npz": "time stamps jitter",
    "lbr_med7/lbr_med7.npz": "polled faster",
    "panda/panda_gaz.npz": "taken at uneven steps",
    "polydoros/kuka_iiwa.npz": None,
    "rokae/rokae_xmate.npz": "single trajectory",
    "screw_drive/screw_drives.npz": "gap(s) in time",
    "tiago/tiago.npz": "single trajectory",
    "tx40/staubli_tx40.npz": "single trajectory",
    "ur10e/ur10e_excitation.npz": "gap(s) in time",
    "ur10e/ur10e_validation.npz": None,
}


@pytest.mark.parametrize("name", KNOWN)
def test_recording_is_read_and_judged(name, data_dir):
    file = data_dir / name
    if not file.exists():
        pytest.skip(f"{file} is not here")
    with np.load(file) as archive:
        rows, n = archive["q"].shape
        gains = None if "tau" in archive else [1.0] * n
        unreadable = int(np.isnan(archive["t"]).sum())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        log = read_log(file, drive_gains=gains, missing="drop", check=False)
    assert len(log) == rows - unreadable
    quality = check_log(log)
    assert all(0.95 < joint.velocity_slope < 1.2 for joint in quality.joints if joint.excited)
    if KNOWN[name] is None:
        assert quality.warnings == ()
    else:
        assert any(KNOWN[name] in message for message in quality.warnings + quality.notes)


def test_rows_without_order_in_time_are_refused(data_dir):
    file = data_dir / "sarcos/sarcos_test.npz"
    if not file.exists():
        pytest.skip(f"{file} is not here")
    with pytest.raises(LogError, match="4449 of 4449 rows"):
        read_log(file)
