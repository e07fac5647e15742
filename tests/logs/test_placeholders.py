# SPDX-License-Identifier: BSD-3-Clause
"""Values that stand for failed reads become missing values."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import check_log, read_log

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=2, duration=4.0).frame
FAILED = [40, 41, 200, 301, 450, 600]

pytestmark = pytest.mark.filterwarnings("ignore::skidyn.exceptions.LogWarning")


@pytest.mark.parametrize(
    "asked", [9999, [9999], {"all": 9999}, {"q": [9999.0]}, {"q2": 9999}, [9999, LOG["tau1"][7]]]
)
def test_rows_with_the_value_are_left_out_and_counted(read, asked):
    spoiled = LOG.copy()
    spoiled.loc[FAILED, "q2"] = 9999
    log = read(spoiled, placeholder=asked)
    more = [7] if asked == [9999, LOG["tau1"][7]] else []
    left = LOG.drop([*FAILED, *more]).reset_index(drop=True)
    pd.testing.assert_frame_equal(log, left, check_exact=False, check_like=True)
    notes = log.attrs["notes"]
    assert any(n.startswith(f"placeholder: {len(FAILED)} of {len(LOG)} rows hold") for n in notes)
    assert any(n.startswith(f"missing: {len(FAILED + more)} of {len(LOG)} rows") for n in notes)


def test_other_quantities_and_values_nearby_are_kept(read):
    spoiled = LOG.copy()
    spoiled.loc[FAILED, ["q1", "q2"]] = -1.0
    spoiled.loc[[10, 11], ["tau1", "dq1"]] = -1.0
    spoiled.loc[[20, 21], "q1"] = np.nextafter(-1.0, 0.0)
    assert len(read(spoiled, placeholder={"q": -1})) == len(LOG) - len(FAILED)


def test_values_are_those_of_the_file_or_those_that_the_check_states(read):
    degrees = LOG.assign(**{f"q{k}": np.degrees(LOG[f"q{k}"]) for k in (1, 2)})
    degrees.loc[FAILED, "q1"] = -1.0
    units = {"q": "deg"}
    of_file = read(degrees, units=units, placeholder={"q1": -1})
    converted = read(degrees, units=units)["q1"][FAILED[0]]
    of_check = read(degrees, units=units, placeholder={"q1": converted})
    assert len(of_file) == len(of_check) == len(LOG) - len(FAILED)


def test_velocities_are_derived_without_the_failed_reads(read):
    spoiled = LOG.drop(columns=["dq1", "dq2"])
    spoiled.loc[FAILED, ["q1", "q2"]] = 9999.0
    assert read(spoiled, placeholder=9999)[["dq1", "dq2"]].abs().to_numpy().max() < 50


def test_several_files_need_not_all_hold_it(tmp_path):
    spoiled = LOG.copy()
    spoiled.loc[FAILED, "q2"] = 9999
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path, frame in zip(paths, (LOG, spoiled), strict=True):
        frame.to_csv(path, index=False)
    with pytest.warns(LogWarning, match=f"placeholder: {len(FAILED)} of {2 * len(LOG)} rows"):
        log = read_log(paths, placeholder={"q2": 9999}, check=False)
    assert len(log) == 2 * len(LOG) - len(FAILED)


@pytest.mark.parametrize(
    "asked, words",
    [
        (9999, "no value of the signals equals 9999"),
        ({"q": -1}, "no value of q equals -1"),
        ({"q9": -1}, "the log has no q9"),
        ({"q": "none"}, "q has 'none'; expected a number"),
        (float("nan"), "all has nan; expected a number"),
    ],
)
def test_what_is_not_there_is_refused_by_name(read, asked, words):
    with pytest.raises(LogError, match=words):
        read(LOG, placeholder=asked)


def test_the_remedy_of_the_check_restores_the_rest(read):
    spoiled = LOG.copy()
    rows = np.random.default_rng(0).choice(len(LOG), 30, replace=False)
    spoiled.loc[rows, ["q1", "q2"]] = 0.0
    spoiled.loc[rows[:15], "tau1"] = -999.0
    told = [s for s in check_log(spoiled, ROBOT).checks if s.check == "failed_reads"]
    assert {s.remedy.option for s in told} == {"--placeholder q=0", "--placeholder tau1=-999"}
    asked = {k: v for s in told for k, v in s.remedy.arguments["placeholder"].items()}
    assert len(read(spoiled, placeholder=asked)) == len(LOG) - 30
