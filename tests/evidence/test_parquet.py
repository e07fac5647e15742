# SPDX-License-Identifier: BSD-3-Clause
"""Parquet files are read trajectory by trajectory, and wrong ones refused."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import Evidence, evidence_from_parquet
from skidyn.exceptions import LogError, SkidynError

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=8, duration=4.0, random_state=3)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four files of two trajectories, in row groups that cut through them."""
    folder = tmp_path_factory.mktemp("parquet")
    for k in range(4):
        part = LOG.frame[(LOG.frame["trajectory"] - 1) // 2 == k]
        part.to_parquet(folder / f"part{k}.parquet", row_group_size=150)
    return folder


def same(one: Evidence, other: Evidence):
    assert one.columns == other.columns and dict(one.counts) == dict(other.counts)
    for key, factor in one.factors.items():
        gram, wanted = factor.T @ factor, other.factors[key].T @ other.factors[key]
        np.testing.assert_allclose(gram, wanted, rtol=1e-9, atol=1e-10 * np.abs(wanted).max())


def test_a_missing_value_amid_a_file_is_told(tmp_path):
    frame = LOG.frame.copy()
    frame.loc[700, "dq2"] = np.nan
    frame.to_parquet(tmp_path / "log.parquet")
    with pytest.raises(LogError, match=r"log\.parquet: 1 rows are not finite.*row 700, column dq2"):
        evidence_from_parquet(tmp_path, ROBOT)


def test_wrong_files_are_refused(tmp_path, folder):
    with pytest.raises(LogError, match="no such Parquet file"):
        evidence_from_parquet(tmp_path, ROBOT)
    (tmp_path / "a.parquet").write_bytes(b"PAR1 nothing PAR1")
    with pytest.raises(LogError, match=r"a\.parquet: cannot be read"):
        evidence_from_parquet(tmp_path / "a.parquet", ROBOT)
    LOG.frame.drop(columns="tau2").to_parquet(tmp_path / "b.parquet")
    with pytest.raises(LogError, match="lacks tau2"):
        evidence_from_parquet(tmp_path / "b.parquet", ROBOT)
    with pytest.raises(LogError, match="more than max_rows = 300"):
        evidence_from_parquet(folder, ROBOT, max_rows=300)
    with pytest.raises(SkidynError, match="unspecified shape parameters"):
        evidence_from_parquet(folder, ROBOT, ["dahl"])


def test_columnar_bomb_is_never_unpacked(tmp_path):
    n = 3_000_000  # a few kB on disk
    zero = np.zeros(n, dtype=np.float32)
    names = ["time", "trajectory", "q1", "q2", "dq1", "dq2", "tau1", "tau2"]
    pd.DataFrame(dict.fromkeys(names, zero)).to_parquet(tmp_path / "bomb.parquet")
    assert (tmp_path / "bomb.parquet").stat().st_size < 500_000
    with pytest.raises(LogError, match="max_rows"):
        evidence_from_parquet(tmp_path, ROBOT, max_rows=1_000_000)


def test_names_of_recorders_and_of_the_user(tmp_path, folder):
    wanted = evidence_from_parquet(folder, ROBOT)
    joints = ROBOT.joint_names
    spoken = {f"{s}{j + 1}": f"{s}_{name}" for s in ("q", "dq") for j, name in enumerate(joints)}
    spoken |= {"tau1": "load a", "tau2": "load b", "time": "timestamp"}
    for k, file in enumerate(sorted(folder.glob("*.parquet"))):
        frame = pd.read_parquet(file).drop(columns=["dq1", "dq2"])  # derived from the positions
        frame.rename(columns=spoken).to_parquet(tmp_path / f"{k}.parquet")
    with pytest.raises(LogError, match="lacks tau1, tau2; it has .* load a"):
        evidence_from_parquet(tmp_path, ROBOT)
    same(evidence_from_parquet(tmp_path, ROBOT, columns={"tau": ["load a", "load b"]}), wanted)


def test_text_in_place_of_numbers_is_refused(tmp_path):
    frame = LOG.frame.assign(tau1="12 Nm")
    frame.to_parquet(tmp_path / "log.parquet")
    with pytest.raises(LogError, match=r"column tau1 holds .*string, numbers in SI units"):
        evidence_from_parquet(tmp_path, ROBOT)
