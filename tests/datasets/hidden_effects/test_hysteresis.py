# SPDX-License-Identifier: BSD-3-Clause
"""Simulated pre-sliding friction."""

import numpy as np

from skidyn.datasets import load_planar_arm, load_scara, make_hidden_effect_log

PLANAR, SCARA = load_planar_arm(), load_scara()
SHORT = {"n_trajectories": 4, "duration": 4.0}


def test_dahl_turns_over_its_presliding_distance():
    log = make_hidden_effect_log(
        PLANAR, "dahl", joints=[1], noise=0.0, base=(), n_trajectories=2, rate=1000.0
    )
    bare = make_hidden_effect_log(PLANAR, None, noise=0.0, base=(), n_trajectories=2, rate=1000.0)
    force = (log.y - bare.y)[:10_000, 0] / log.parameters["Fc"][0]
    q = log.frame["q1"].to_numpy()[:10_000]
    dq = log.frame["dq1"].to_numpy()[:10_000]
    assert np.abs(force).max() < 1 + 1e-9
    turn = int(np.flatnonzero(np.diff(np.sign(dq)))[0]) + 1
    travelled = np.abs(q[turn:] - q[turn])
    after = turn + int(np.argmax(travelled > log.parameters["presliding"][0]))
    # after one pre-sliding distance a Dahl element has covered 1 - 1/e of the way round
    before, now = force[turn], force[after] * np.sign(dq[after])
    expected = 1 - (1 + np.abs(before)) * np.exp(-1)
    np.testing.assert_allclose(now, expected, atol=0.05)


def test_hysteresis_replaces_the_coulomb_friction_of_its_joint():
    log = make_hidden_effect_log(PLANAR, "lugre", joints=[2], noise=0.0, base=("coulomb",), **SHORT)
    bare = make_hidden_effect_log(PLANAR, "lugre", joints=[2], noise=0.0, base=(), **SHORT)
    np.testing.assert_allclose(log.y[:, 1], bare.y[:, 1], atol=1e-9)
    assert not np.allclose(log.y[:, 0], bare.y[:, 0])
