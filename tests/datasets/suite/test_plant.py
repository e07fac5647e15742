# SPDX-License-Identifier: BSD-3-Clause
"""The simulator of the suite and skidyn are two programs."""

import numpy as np

from skidyn.datasets import load_planar_arm
from skidyn.identification import RBDRegressor


def test_a_log_that_hides_nothing_is_explained_by_the_base_model(empty):
    """Noise is all that is left: MuJoCo and skidyn agree on rigid bodies and drives."""
    frame, truth = empty.frame, empty.truth
    assert truth["effects"] == [] and not truth["detectable"]
    model = RBDRegressor(load_planar_arm(), ("viscous", "coulomb", "rotor_inertia"))
    tau = frame[["tau1", "tau2"]].to_numpy()
    signals = frame.drop(columns=["tau1", "tau2"])
    motion = planar_motion(signals)
    moves = (np.abs(frame[["dq1", "dq2"]]) > 0.1).all(axis=1).to_numpy()
    left = (tau - model.fit(motion[moves], tau[moves]).predict(motion))[moves]
    assert (left.std(axis=0) < 3 * np.array(truth["noise_std"])).all()


def planar_motion(frame):
    """The log with accelerations from differences over 50 ms, which noise needs."""
    out = frame[["time", "trajectory", "q1", "q2", "dq1", "dq2"]].copy()
    for j in (1, 2):
        parts = []
        for _, run in frame.groupby("trajectory"):
            smooth = run[f"dq{j}"].rolling(7, center=True, min_periods=1).mean()
            parts.append(np.gradient(smooth.to_numpy(), run["time"].to_numpy()))
        out[f"ddq{j}"] = np.concatenate(parts)
    return out
