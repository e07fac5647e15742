# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pandas as pd
import pytest
from sklearn.pipeline import make_pipeline

from skidyn.datasets import load_planar_arm, make_hidden_effect_log
from skidyn.identification import RBDRegressor
from skidyn.preprocessing import SmoothDerivatives, TimeDerivative

W = 2 * np.pi * np.array([0.3, 0.7, 1.1])


def motion(t, order=0):
    phase = t[:, None] * W + order * np.pi / 2
    return (W**order * np.sin(phase)).sum(axis=1)


def record(noise, rate=200.0, seconds=10.5, jitter=0.0):
    rng = np.random.default_rng(0)
    t = np.arange(int(rate * seconds)) / rate
    t = t + jitter / rate * rng.uniform(-0.5, 0.5, t.size)
    return pd.DataFrame({"time": t, "q1": motion(t) + noise * rng.normal(size=t.size)})


def error(table, log):
    exact = motion(log["time"].to_numpy(), 2)
    return np.sqrt(np.mean((table[:, -1] - exact)[100:-100] ** 2)) / exact.std()


@pytest.mark.parametrize(
    "method",
    ["butterworth", pytest.param("kalman", marks=pytest.mark.slow), "savitzky_golay"],
)
@pytest.mark.parametrize("noise", [1e-4, 2e-3])
def test_chosen_cutoff_is_close_to_the_best(method, noise):
    log = record(noise)
    smooth = SmoothDerivatives(method=method)
    chosen = error(smooth.fit_transform(log), log)
    cutoffs = smooth.cv_results_["cutoff"]
    best = min(
        error(SmoothDerivatives(method=method, cutoff=c).fit_transform(log), log) for c in cutoffs
    )
    assert chosen < max(2.5 * best, 0.01)


def test_more_noise_is_smoothed_more():
    quiet, loud = (SmoothDerivatives(method="savitzky_golay").fit(record(n)) for n in (1e-5, 1e-2))
    assert loud.cutoff_ < quiet.cutoff_


def test_uneven_steps_take_the_kalman_smoother():
    log = record(1e-4, jitter=0.8)
    smooth = SmoothDerivatives().fit(log)
    assert smooth.method_ == "kalman"
    assert error(smooth.transform(log), log) < 0.01


def test_velocities_are_differentiated_once_and_columns_named():
    log = record(1e-4).assign(dq1=lambda f: motion(f["time"].to_numpy(), 1), trajectory=0)
    table = SmoothDerivatives(cutoff=5.0).set_output(transform="pandas").fit_transform(log)
    assert list(table.columns) == [*log.columns, "ddq1"]
    positions = SmoothDerivatives(["q1"], cutoff=5.0).fit(log.drop(columns="dq1"))
    assert positions.get_feature_names_out().tolist()[-2:] == ["dq1", "ddq1"]


def test_trajectories_do_not_mix():
    log = record(1e-3, seconds=5.0)
    both = pd.concat([log.assign(trajectory=0), log.assign(trajectory=1, q1=-log["q1"])])
    alone = SmoothDerivatives(cutoff=5.0).fit_transform(both[: len(log)])
    together = SmoothDerivatives(cutoff=5.0).fit_transform(both)
    assert np.array_equal(alone, together[: len(log)])


def test_serves_a_model_of_positions_alone():
    log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    positions = log.frame[["time", "trajectory", "q1", "q2"]]
    pipe = make_pipeline(
        SmoothDerivatives().set_output(transform="pandas"), RBDRegressor(log.robot)
    ).fit(positions, log.y)
    assert pipe.score(positions, log.y) > 0.97


def test_messages():
    with pytest.raises(ValueError, match="not below half the sampling rate"):
        SmoothDerivatives(cutoff=200.0).fit(record(1e-3))
    log = record(1e-3)
    with pytest.raises(ValueError, match="row 2000 has 3 sample"):
        SmoothDerivatives(cutoff=5.0).fit_transform(
            log[:2003].assign(trajectory=lambda f: (f.index >= 2000).astype(int))
        )


def test_derivatives_that_are_there_are_not_appended_again():
    frame = pd.DataFrame({"time": np.arange(50) * 0.01, "dq1": 0.0, "ddq1": 0.0})
    for transformer in (SmoothDerivatives(), TimeDerivative()):
        with pytest.raises(ValueError, match="ddq1 already"):
            transformer.fit(frame)
