# SPDX-License-Identifier: BSD-3-Clause
"""Sizes by single recordings."""

from __future__ import annotations

import numpy as np

from skidyn.datasets import load_ur5, make_hidden_effect_log
from skidyn.payload import identify_payload

FRICTION = ("viscous", "coulomb")


def test_recording_with_another_drive_gain_is_named(runs, found):
    log, loaded, unloaded = runs
    shares = found.by_recording
    moved = np.isfinite(shares.values) & (shares.std < 0.005)
    np.testing.assert_allclose(shares.values[moved], 1.0, atol=0.02)
    assert "of what the other recordings" not in found.text
    last = unloaded["trajectory"] == unloaded["trajectory"].iloc[-1]
    changed = unloaded.assign(tau2=unloaded["tau2"].where(~last, 0.95 * unloaded["tau2"]))
    other = identify_payload(log.robot, loaded, changed, effects=("viscous", "coulomb"))
    name = shares.names[-1]
    assert name.startswith("unloaded")
    assert f"In {name}, shoulder_lift_joint measures 95" in other.text
    assert other.to_dict()["by_recording"]["recordings"][-1] == name


def test_one_loaded_recording_among_many_has_a_narrow_interval():
    log = make_hidden_effect_log(
        load_ur5(), "payload", base=FRICTION, n_trajectories=8, duration=4.0, random_state=5
    )
    number = log.frame["trajectory"]
    carries = number.isin(log.parameters["trajectories"])
    one = number == number[carries].iloc[0]
    found = identify_payload(log.robot, log.frame[one], log.frame[~carries], effects=FRICTION)
    low, high = found.mass_interval
    assert low < log.parameters["mass"] < high and high - low < 0.2 * found.mass


def test_the_only_recording_of_its_kind_is_compared_with_nothing(runs):
    log, loaded, unloaded = runs
    one = loaded[loaded["trajectory"] == loaded["trajectory"].iloc[0]]
    found = identify_payload(log.robot, one, unloaded, effects=("viscous", "coulomb"))
    assert np.isnan(found.by_recording.values[0]).all()
    assert np.isfinite(found.by_recording.values[1:]).all()
