"""The same diagnosis on one core and on two."""

import json
import sys

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.identification import RBDRegressor
from skidyn.measurement import Suspicion


@pytest.fixture(scope="module")
def log():
    return make_hidden_effect_log(
        load_planar_arm(), "stribeck", joints=[2], n_trajectories=8, duration=4.0
    )


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
def test_two_processes_give_the_same_report_to_the_last_bit(log):
    one, two = (diagnose(RBDRegressor(log.robot), log.X, log.y, n_jobs=n).to_dict() for n in (1, 2))
    assert json.dumps(one, default=str) == json.dumps(two, default=str)
    assert [e["kind"] for e in one["effects"]] == ["stribeck"]


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_doubt_keeps_names_back_however_many_processes_work(log, n_jobs, monkeypatch):
    told = [Suspicion("copied_torque", "a torque twice", "in every row", "suspected")]
    monkeypatch.setattr("skidyn.diagnosis._diagnosis.check_measurement", lambda _: told)
    with pytest.warns(UserWarning, match="no physical effect is identified"):
        diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y, n_jobs=n_jobs)
    assert {finding.kind for finding in diagnosis.findings} <= {"unknown"}


@pytest.mark.parametrize("n_jobs", [1, 2])
def test_a_log_that_is_certainly_wrong_is_refused(log, n_jobs):
    mirrored = log.frame.assign(dq2=-log.frame["dq2"])
    torque = [f"tau{j + 1}" for j in range(log.robot.n_joints)]
    with pytest.raises(ValueError, match="dq2|velocity of joint 2"):
        diagnose(
            RBDRegressor(log.robot), mirrored.drop(columns=torque), mirrored[torque], n_jobs=n_jobs
        )
