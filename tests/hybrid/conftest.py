# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest


def make_wave_log(n_trajectories=10, n_rows=100, seed=0, hidden=(1.0, 0.0), noise=0.1):
    """Two joints; a linear model misses a wave of the first joint's position."""
    rng = np.random.default_rng(seed)
    t = np.arange(n_rows) * 0.02
    frames, torques = [], []
    for k in range(n_trajectories):
        speed, phase = rng.uniform(1, 4, 2), rng.uniform(0, 6, 2)
        q, dq = np.sin(speed * t[:, None] + phase), speed * np.cos(speed * t[:, None] + phase)
        torque = 3 * dq + np.sin(5 * q) * hidden
        # noise that is coloured, as residuals of real logs are
        coloured = np.apply_along_axis(np.convolve, 0, rng.normal(size=q.shape), np.ones(20) / 4.5)
        torques.append(torque + noise * coloured[:n_rows])
        frames.append(pd.DataFrame(np.c_[q, dq], columns=["q1", "q2", "dq1", "dq2"]))
        frames[-1] = frames[-1].assign(trajectory=k, time=t)
    return pd.concat(frames, ignore_index=True), np.concatenate(torques)


@pytest.fixture(scope="session")
def make_log():
    return make_wave_log
