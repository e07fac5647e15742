# SPDX-License-Identifier: BSD-3-Clause
"""Evidence from files, trajectory by trajectory, and on a cluster that loses a worker."""

import subprocess
import sys
import tracemalloc

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.evidence import Evidence, evidence_from_parquet, linear_terms, make_problem
from skidyn.identification import RBDRegressor

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


def test_equals_the_evidence_of_the_whole_log(folder):
    terms = linear_terms(("viscous", "coulomb"), 2)
    model = RBDRegressor(ROBOT, smooth=True).fit(LOG.X, LOG.y)
    counted = LOG.X.assign(trajectory=LOG.X["trajectory"] - 1)  # as trajectories of files are
    problem = make_problem(
        model._read(counted.to_numpy()), LOG.y, robot=ROBOT, rigid_body=True, terms=terms
    )
    same(evidence_from_parquet(folder, ROBOT, groups=None), Evidence.from_problem(problem, terms))


def test_groups_hold_the_same_and_do_not_grow(folder):
    every, few = (evidence_from_parquet(folder, ROBOT, groups=g) for g in (None, 3))
    assert few.trajectories == [0, 1, 2]
    np.testing.assert_allclose(few.solve(), every.solve(), rtol=1e-8)


def test_memory_does_not_grow_with_the_number_of_trajectories(folder):
    files, peaks = sorted(folder.glob("*.parquet")), []
    for times in (1, 1, 12):  # the first imports and fills caches
        tracemalloc.start()
        evidence_from_parquet(files * times, ROBOT, groups=3)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 2 * peaks[1]


@pytest.mark.slow
def test_cluster_that_loses_a_worker_gives_the_same(folder):
    distributed = pytest.importorskip("distributed")

    def kill_own_worker(flag):  # within the test, so that workers need not import its module
        """Ends the worker process hard on the first call, and returns on the second."""
        import os
        import signal
        import time

        if os.path.exists(flag):
            return "done"
        with open(flag, "w"):
            pass
        time.sleep(0.2)
        os.kill(os.getpid(), signal.SIGKILL)

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        files = sorted(folder.glob("*.parquet")) * 8
        killer = client.submit(kill_own_worker, str(folder / "killed"), pure=False)
        got = evidence_from_parquet(files, ROBOT, client=client)
        assert killer.result() == "done" and (folder / "killed").exists()
    wanted = evidence_from_parquet(files, ROBOT)
    np.testing.assert_allclose(got.solve(), wanted.solve(), rtol=1e-8)
    assert dict(got.counts) == dict(wanted.counts)


def test_trajectories_of_two_files_never_share_a_factor(tmp_path, folder):
    for k, file in enumerate(sorted(folder.glob("*.parquet"))):
        frame = pd.read_parquet(file)
        frame["trajectory"] = frame["trajectory"] % 2 + 5
        frame.to_parquet(tmp_path / f"{k}.parquet")
    for groups in (None, 3):
        wanted = evidence_from_parquet(folder, ROBOT, groups=groups)
        same(evidence_from_parquet(tmp_path, ROBOT, groups=groups), wanted)
        same(evidence_from_parquet(tmp_path, ROBOT, groups=groups, n_jobs=2), wanted)


def test_what_trajectories_are_read_together_makes_no_difference(tmp_path):
    """Short ones share the computation of the regressor; a long one takes several parts of it."""
    log = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=20.0, random_state=3)
    whole = log.frame[log.frame["trajectory"] == 1]
    step = whole["time"].diff().median()
    long = pd.concat([whole, *(whole.assign(time=whole["time"] + 20.0 * k) for k in (1, 2))])
    long["time"] = np.arange(len(long)) * step
    short = [log.frame[log.frame["trajectory"] == k][:n] for k, n in ((2, 900), (3, 1400))]
    assert len(long) > 4000
    files = [tmp_path / f"{k}.parquet" for k in range(4)]
    for file, frame in zip(files, [short[0], short[1], long, short[0]], strict=True):
        frame.to_parquet(file)
    together = evidence_from_parquet(files, ROBOT, groups=None)
    alone = [evidence_from_parquet(file, ROBOT, groups=None) for file in files]
    same(together, sum((e.shifted(k) for k, e in enumerate(alone[1:], 1)), alone[0]))


def test_a_killed_worker_of_loky_is_a_clear_error(folder):
    """Other than on a cluster nothing runs again; nothing is added up without it either."""
    files = sorted(folder.glob("*.parquet")) * 2
    code = (
        "import os, signal, sys, threading, time\n"
        "from skidyn.datasets import load_planar_arm\n"
        "from skidyn.evidence import evidence_from_parquet, _streaming\n"
        "def die(chunk, *_):\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
        "_streaming._of_files = die\n"
        "evidence_from_parquet(sys.argv[1:], load_planar_arm(), n_jobs=2)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, files)], capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "worker" in done.stderr.strip().splitlines()[-1] or "terminated" in done.stderr
