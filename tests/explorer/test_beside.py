# SPDX-License-Identifier: BSD-3-Clause
"""A ripple and a payload, which whole folds cannot judge."""

from __future__ import annotations

import numpy as np
import pytest

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.explorer import Session
from skidyn.identification import RBDRegressor


def test_a_ripple_is_offered_and_takes_its_error():
    log = make_hidden_effect_log(
        load_planar_arm(), "torque_ripple", joints=[2], n_trajectories=8, random_state=1
    )
    session = Session(RBDRegressor(log.robot), log.X, log.y)
    ranked = {effect.kind: effect for effect in session.ranked(joint=2)}
    promised = ranked["torque_ripple"].drop

    entry = session.add("torque_ripple", joint=2)

    came = 1 - (entry["rmse"][1] / session.history[0]["rmse"][1]) ** 2
    assert came == pytest.approx(promised, abs=0.01) and came > 0.05
    assert session.sizes()[0].startswith("A = ") and "±" in session.sizes()[0]
    assert "torque_ripple" in [term.kind for term in session.fitted_model().effect_terms_]
    assert "torque_ripple" not in [effect.kind for effect in session.ranked(joint=2)]
    session.remove(1)
    assert session.history[-1]["rmse"] == session.history[0]["rmse"]


def test_a_payload_of_some_recordings_is_offered_with_their_numbers():
    log = make_hidden_effect_log(load_planar_arm(), "payload", n_trajectories=8, random_state=1)
    session = Session(RBDRegressor(log.robot), log.X, log.y)
    best = session.ranked(joint=1)[0]

    entry = session.add("payload", joint=1)

    assert best.kind == "payload" and 0 < len(best.trajectories) < 8
    assert entry["rmse"][0] < 0.7 * session.history[0]["rmse"][0]
    assert np.isfinite(session.residuals(1, best.trajectories[0])["now"][5])
