# SPDX-License-Identifier: BSD-3-Clause
"""Whatever the number of threads or processes, the same data gives the same answer."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from sklearn.base import clone
from sklearn.ensemble import HistGradientBoostingRegressor

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.hybrid import OwnJointRegressor

#: Identifies, diagnoses and trains one of each learner, and prints all numbers that come out.
ANSWERS = """
import json
from sklearn.linear_model import Ridge
from skidyn.committee import ELMCommittee
from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.hybrid import HybridRegressor
from skidyn.neural_network import BLLRegressor, LSTMRegressor, NDLRegressor, SDLRegressor
from skidyn.identification import RBDRegressor

log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2], n_trajectories=4,
                             duration=3.0, rate=100.0)
X, y, robot = log.X, log.y, log.robot
physics = RBDRegressor(robot).fit(X, y)
found = diagnose(RBDRegressor(robot), X, y, effects=["stribeck", "spring", "dahl"])
said = {"identification": physics.coef_.tolist(),
        "standard errors": physics.coef_std_.tolist(),
        "verdict": [found.verdict, *[[f.kind, list(f.joints)] for f in found.findings]],
        "diagnosis": [[f.error_drop, *found.rmse_after] for f in found.findings]}
net = {"window": 8, "hidden_size": 8, "max_epochs": 2, "random_state": 0}
learners = {"LSTM": LSTMRegressor(**net), "NDL": NDLRegressor(**net),
            "SDL": SDLRegressor(robot, **net),
            "BLL": BLLRegressor(LSTMRegressor(**net), n_estimators=2, random_state=0),
            "ELM": ELMCommittee(4, n_hidden=40, random_state=0),
            "hybrid": HybridRegressor(RBDRegressor(robot), Ridge(), cv=2)}
for name, learner in learners.items():
    said[name] = learner.fit(X, y).predict(X)[::50].tolist()
print(json.dumps(said))
"""
#: What rounding in another order of summation may do, relative to the largest number.
NUMBERS, LEARNERS = 1e-10, 1e-4
#: Trained in single precision.
TRAINED = ("LSTM", "NDL", "SDL", "BLL")


def answers(threads):
    environment = os.environ | dict.fromkeys(
        ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), str(threads)
    )
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", ANSWERS],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def one_thread():
    return answers(1)


@pytest.mark.slow
def test_another_process_gives_the_same_bits(one_thread):
    assert answers(1) == one_thread


@pytest.mark.slow
def test_two_threads_give_the_same_to_rounding(one_thread):
    two = answers(2)
    assert two.pop("verdict") == one_thread["verdict"] == ["missing", ["stribeck", [2]]]
    for name, numbers in two.items():
        wanted = np.array(one_thread[name])
        np.testing.assert_allclose(
            numbers, wanted, rtol=0, err_msg=name,
            atol=(LEARNERS if name in TRAINED else NUMBERS) * np.abs(wanted).max(),
        )  # fmt: skip


def test_a_regressor_for_each_joint_is_the_same_in_any_number_of_processes():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=3.0)
    model = OwnJointRegressor(HistGradientBoostingRegressor(max_iter=5, random_state=0))
    one, two = (clone(model).set_params(n_jobs=n).fit(log.X, log.y) for n in (1, 2))
    np.testing.assert_array_equal(two.predict(log.X), one.predict(log.X))
