# SPDX-License-Identifier: BSD-3-Clause
"""Torques of the two motors of a differential."""

import pytest

from skidyn.datasets import make_hidden_effect_log
from skidyn.logs import read_log


def motors(frame, share, sign):
    both, apart = frame["tau1"] + frame["tau2"], frame["tau1"] - frame["tau2"]
    return frame.assign(tau1=share * both, tau2=sign * share * apart)


@pytest.mark.parametrize(
    ("share", "sign", "option"),
    [
        (0.5, 1, "--combine tau1=tau1+tau2,tau2=tau1-tau2"),
        (1.0, -1, "--combine tau1=0.5*tau1-0.5*tau2,tau2=0.5*tau1+0.5*tau2"),
    ],
)
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_sum_and_difference_are_named_and_undone(share, sign, option, only, told_of, arm, tmp_path):
    short = make_hidden_effect_log(arm, None, n_trajectories=4, duration=4.0, random_state=6).frame
    log = motors(short, share, sign)
    told = told_of(log)
    only(told.values(), "differential", "suspected", option)
    path = tmp_path / "log.parquet"
    log.to_parquet(path)
    sums = dict(pair.split("=") for pair in option.removeprefix("--combine ").split(","))
    assert told["differential"].remedy.code == f"combine={sums}"
    mended = read_log(path, robot=arm, combine=sums, check=False)
    for name in ("tau1", "tau2"):
        assert mended[name].to_numpy() == pytest.approx(short[name].to_numpy())


def test_exchanged_torques_are_no_differential(short, told_of):
    told = told_of(short.assign(tau1=short["tau2"], tau2=-short["tau1"]))
    assert "differential" not in told
