# SPDX-License-Identifier: BSD-3-Clause
"""Numbers, units and names in what users read."""

import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import ColumnError
from skidyn.identification import RBDRegressor
from skidyn.simulation import ServoFinding


@pytest.mark.parametrize(
    ("value", "half", "told"),
    [
        (10.534, 0.013, "dF = 10.534 ± 0.013 N m"),
        (0.35, 0.04, "dF = 0.350 ± 0.040 N m"),
        (971.2, 316.0, "dF = 971 ± 316 N m"),
        (-2e-7, 1e-8, "dF = −2e−07 ± 1e−08 N m"),
        (0.31, None, "dF = 0.31 N m"),
    ],
)
def test_a_value_is_rounded_as_its_interval_is(value, half, told):
    halves = {} if half is None else {"dF": half}
    found = ServoFinding("stribeck", 2, {"dF": value}, 0.012, 0.002, "dahl", 0.009, halves=halves)
    assert found.size == told


def test_names_of_people_keep_their_capital_within_a_sentence():
    for rival, told in (("dahl", "Dahl friction"), ("backlash", "backlash")):
        found = ServoFinding("stribeck", 2, {"dF": 0.3}, 0.012, 0.002, rival, 0.009)
        assert told in found.sentence, found.sentence


def test_a_similar_name_is_suggested_and_no_other():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=1.0)
    model = RBDRegressor(log.robot, trajectory="trajectry")
    with pytest.raises(
        ColumnError, match=r"'trajectry' is not in X \(did you mean 'trajectory'\?\)"
    ):
        model.fit(log.X, log.y)
    with pytest.raises(ColumnError, match=r"'qqqqqq' is not in X\."):
        model.set_params(trajectory="qqqqqq").fit(log.X, log.y)
