# SPDX-License-Identifier: BSD-3-Clause
"""Angles against the base, other orders and another gravity are among the changes tried."""

from dataclasses import replace

import numpy as np
import pytest

from skidyn.datasets import (
    load_ur5,
    make_hidden_effect_log,
)
from skidyn.logs import check_log


def test_a_description_without_gravity(arm, recorded, told_of):
    told = told_of(recorded.frame, replace(arm, gravity=np.zeros(3)))["reading"]
    assert told.remedy.option.startswith("--gravity=")
    x, y, z = (float(v) for v in told.remedy.option.partition("=")[2].split(","))
    assert z == pytest.approx(-9.8, abs=0.3) and abs(y) < 0.1 and abs(x) < 2


@pytest.mark.parametrize("joint", [3, pytest.param(4, marks=pytest.mark.slow)])
def test_an_angle_against_the_base(joint):
    log = make_hidden_effect_log(load_ur5(), None, n_trajectories=4, duration=4.0)
    frame = log.frame
    sums = {f"{x}{joint}": frame[f"{x}{joint}"] + frame[f"{x}{joint - 1}"] for x in ("q", "dq")}
    told = {s.check: s for s in check_log(log.frame.assign(**sums), log.robot).checks}["reading"]
    assert told.remedy.option == f"--summed q{joint}=q{joint - 1}"
    assert told.joints == (joint,) and told.certainty == "certain"


def test_motions_that_are_exchanged_with_their_torques_in_place(recorded, told_of):
    frame = recorded.frame
    changes = {f"{x}{i}": frame[f"{x}{3 - i}"] for x in ("q", "dq") for i in (1, 2)}
    told = told_of(frame.assign(**changes))["reading"]
    assert told.certainty == "certain" and told.remedy.option == "--order motion=2,1"
