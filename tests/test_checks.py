# SPDX-License-Identifier: BSD-3-Clause
"""What would make every later result of a log wrong is refused."""

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.exceptions import LogError, LogWarning
from skidyn.logs import check_log, read_log

ROBOT = load_planar_arm()
LOG = make_hidden_effect_log(ROBOT, None, n_trajectories=3, duration=4.0).frame


@pytest.mark.parametrize(
    "lost, message",
    [
        ("q2", r"has tau2, but positions of 1 joint"),
        ("tau1", r"lacks tau1: 2 joints need tau1..tau2"),
        ("time", r"no time column.*rate="),
    ],
)
def test_missing_columns(saved, lost, message):
    with pytest.raises(LogError, match=message):
        read_log(saved(LOG.drop(columns=lost)))


def test_no_recognised_columns(saved):
    odd = LOG.rename(columns={"q1": "alpha", "q2": "beta"})
    with pytest.raises(LogError, match="no joint positions.*alpha"):
        read_log(saved(odd))


def test_numbered_columns_are_offered_as_positions(saved):
    odd = LOG.rename(columns={f"q{k}": f"turn_A{k}" for k in (1, 2)})
    with pytest.raises(LogError, match=r"Name them with --columns 'q=turn_A\{i\}'"):
        read_log(saved(odd))


def test_duplicated_columns(tmp_path):
    twice = pd.concat([LOG, LOG[["q1"]]], axis=1)
    twice.to_csv(tmp_path / "log.csv", index=False)
    with pytest.raises(LogError, match=r"q1 occur more than once"):
        read_log(tmp_path / "log.csv")
    with pytest.raises(LogError, match="q1 occur more than once"):
        check_log(twice)


def test_text_where_a_number_is_expected(saved):
    spoiled = LOG.astype({"tau1": object})
    spoiled.loc[17, "tau1"] = "stopped"
    with pytest.raises(LogError, match=r"'tau1' holds 'stopped' in row 17"):
        read_log(saved(spoiled))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_rows_that_are_not_finite(saved, value):
    holes = LOG.copy()
    holes.loc[[5, 6, 800], "q1"] = value
    with pytest.raises(LogError, match=r"3 of 1200 rows.*q1: 3; first in row 5"):
        read_log(saved(holes))
    with pytest.warns(LogWarning, match="3 of 1200 rows.*left out"):
        frame = read_log(saved(holes), missing="drop", check=False)
    assert len(frame) == 1197
    assert any("3 of 1200 rows" in text for text in check_log(holes).warnings)
    with pytest.raises(LogError, match="No row is left"):
        read_log(saved(LOG.assign(q1=value)), missing="drop")


def test_time_going_backwards(saved):
    disorder = LOG.copy()
    disorder.loc[100, "time"] -= 0.5
    with pytest.raises(LogError, match=r"backwards in 1 place.*row 100"):
        read_log(saved(disorder))
    with pytest.raises(LogError, match="backwards"):
        check_log(disorder)
