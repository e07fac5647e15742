# SPDX-License-Identifier: BSD-3-Clause
"""Effects found in a sample of a recording and put to all the rest of it."""

import tracemalloc

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose_parquet
from skidyn.exceptions import LogError, SkidynError
from skidyn.identification import RBDRegressor

ROBOT = load_planar_arm()
TRIED = ["stribeck", "spring"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("parquet")
    log = make_hidden_effect_log(
        ROBOT, "stribeck", joints=[2], n_trajectories=18, duration=8.0, rate=100.0
    )
    for k in range(3):
        part = log.frame[(log.frame["trajectory"] - 1) // 6 == k]
        part.to_parquet(folder / f"{k}.parquet")
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return diagnose_parquet(RBDRegressor(ROBOT), folder, sample_rows=7000, effects=TRIED)


def test_a_hidden_effect_is_found_and_confirmed(result):
    (only,) = result.confirmations
    assert (only.finding.kind, only.finding.joints, only.confirmed) == ("stribeck", (2,), True)
    assert only.rmse_with[2] < only.rmse_without[2] and only.error_drop > 0.05
    assert [t.kind for t in result.model.effect_terms_].count("stribeck") == 1


def test_the_search_and_the_judgement_share_no_trajectory(result):
    assert (result.trajectories, result.sampled, result.rows) == (18, 8, 18 * 800)
    assert len(result.diagnosis.data[0]) == 8 * 800
    assert result.evidence.trajectories == list(range(10))


def test_an_effect_that_the_rest_does_not_show_is_not_confirmed(folder, result, tmp_path):
    """The joint was freed after the recordings in which the search finds its friction."""
    _, torque = result.diagnosis.data
    healthy = make_hidden_effect_log(
        ROBOT, None, n_trajectories=18, duration=8.0, rate=100.0, random_state=5
    ).frame
    whole = pd.concat(pd.read_parquet(folder / f"{k}.parquet") for k in range(3))
    drawn = set(whole["trajectory"][whole["tau1"].isin(torque[:, 0])])
    freed = whole.where(whole["trajectory"].isin(drawn), healthy.set_index(whole.index))
    freed.to_parquet(tmp_path / "log.parquet")
    again = diagnose_parquet(RBDRegressor(ROBOT), tmp_path, sample_rows=7000, effects=TRIED)
    assert np.array_equal(again.diagnosis.data[1], torque)
    (only,) = again.confirmations
    assert only.confirmed is False and only.error_drop < 0.01
    assert "stribeck" not in [t.kind for t in again.model.effect_terms_]


def test_what_cannot_be_judged_out_of_core_is_refused(folder, tmp_path):
    with pytest.raises(SkidynError, match="require a fit of the model first"):
        diagnose_parquet(RBDRegressor(ROBOT, ("load_dependent_friction",)), folder)
    make_hidden_effect_log(ROBOT, None, n_trajectories=7, duration=2.0).frame.to_parquet(
        tmp_path / "few.parquet"
    )
    with pytest.raises(LogError, match="7 trajectories are too few"):
        diagnose_parquet(RBDRegressor(ROBOT), tmp_path)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_memory_is_that_of_the_sample_whatever_it_is_drawn_from(tmp_path):
    """Ten trajectories are drawn, of twenty in one file or of two hundred in ten.

    No joint moves, so that the diagnosis is refused as soon as they are read.
    """
    n = 1000
    table = pd.DataFrame({"time": np.arange(20 * n) / 100, "trajectory": np.arange(20 * n) // n})
    table[["q1", "q2"]] = 0.1
    table[["dq1", "dq2", "tau1", "tau2"]] = 0.0
    peak = {}
    for n_files in (1, 1, 10):  # imports and caches first
        folder = tmp_path / f"{n_files}"
        folder.mkdir(exist_ok=True)
        for k in range(n_files):
            table.to_parquet(folder / f"{k}.parquet")
        tracemalloc.start()
        with pytest.raises(LogError, match="no joint moves long enough"):
            diagnose_parquet(RBDRegressor(ROBOT), folder, sample_rows=10 * n)
        peak[n_files] = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak[10] < 1.5 * peak[1]


def test_files_of_other_columns_are_told_apart(folder, tmp_path):
    for k in range(3):
        frame = pd.read_parquet(folder / f"{k}.parquet")
        if k == 1:
            frame = frame.assign(temp1=20.0, temp2=20.0)
        frame.to_parquet(tmp_path / f"{k}.parquet")
    with pytest.raises(LogError, match=r"temp1, temp2.*all need the same columns"):
        diagnose_parquet(RBDRegressor(ROBOT), tmp_path, sample_rows=7000)
