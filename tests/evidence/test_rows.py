# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest

from skidyn.effects import Signals
from skidyn.evidence import column_step, sliding_samples, window_rows


@pytest.fixture
def signals():
    t = np.tile(np.arange(400) * 0.01, 2)
    q = np.sin(2 * t)[:, None]
    return Signals(q, 2 * np.cos(2 * t)[:, None], -4 * q, np.repeat([3, 7], 400), time=t)


def test_averaging_keeps_a_linear_model_exact(signals):
    rng = np.random.default_rng(0)
    columns, truth = rng.normal(size=(800, 3)), np.array([1.0, -2.0, 0.5])
    rows = window_rows(signals, rng.random((800, 1)) > 0.3)
    np.testing.assert_allclose(
        rows.average(columns, 0) @ truth, rows.average(columns @ truth, 0), atol=1e-12
    )


def test_windows_have_unit_noise_gain_and_stay_in_their_trajectory(signals):
    use = np.ones((800, 1), dtype=bool)
    use[100:150] = False
    rows = window_rows(signals, use)
    weights = rows.weights[0].toarray()
    np.testing.assert_allclose((weights**2).sum(1), 1.0)
    assert not weights[:, 100:150].any()
    for weight, trajectory in zip(weights, rows.trajectory[0], strict=True):
        assert set(signals.trajectory[weight != 0]) == {trajectory}
    assert set(rows.quarter[0]) == {0, 1, 2, 3}


def test_rows_some_time_apart_are_in_one_trajectory(signals):
    rows = window_rows(signals, np.ones((800, 1), dtype=bool))
    shuffled = rows.taken([np.random.default_rng(0).permutation(rows.counts[0])])
    order, earlier = shuffled.in_time(0), shuffled.earlier(0, 2)
    time, trajectory = shuffled.time[0][order], shuffled.trajectory[0][order]
    np.testing.assert_array_equal(trajectory[earlier], trajectory[earlier + 2])
    np.testing.assert_allclose(time[earlier + 2] - time[earlier], 2 * rows.hop)
    assert len(earlier) == len(order) - 2 * 2


def test_rest_and_reversals_do_not_slide(signals):
    sliding = sliding_samples(signals, np.ones((800, 1), dtype=bool), margin=3)
    turn = int(np.pi / 4 / 0.01)
    assert not sliding[turn - 3 : turn + 4].any()
    assert sliding[turn + 20 : turn + 60].all()


def test_no_rows_can_be_weighted():
    short = Signals(*np.zeros((3, 4, 1)), np.arange(4), time=np.arange(4.0))
    rows = window_rows(short, np.ones((4, 1), dtype=bool))
    assert rows.counts.tolist() == rows.weighted(np.ones(4)).counts.tolist() == [0]


def test_columns_of_a_fast_log_are_computed_at_one_of_several_samples():
    """A log at 1 kHz: columns are computed at 111 Hz, and the torque is averaged at 1 kHz."""
    t = np.arange(20_000) * 0.001
    q = np.sin(2 * np.pi * 1.3 * t)[:, None]
    signals = Signals(q, q, q, np.repeat([0, 1], 10_000), time=t)
    step = column_step(signals, 1 / 8, margin=31)
    assert step == 9
    assert signals.thinned(step)[1].segments == [slice(0, 1111), slice(1111, 2222)]


def at_rate(*rates):
    t = [np.arange(400) / rate for rate in rates]
    still = np.zeros((400 * len(rates), 1))
    return Signals(still, still, still, np.repeat(range(len(rates)), 400), time=np.concatenate(t))


def test_logs_of_ordinary_rates_have_columns_at_every_sample():
    assert {column_step(at_rate(rate), 1 / 8, 20) for rate in (1.0, 50.0, 250.0, 500.0)} == {1}
    assert column_step(at_rate(1000.0), 1 / 32, 31) == 5
    assert column_step(at_rate(1000.0), 1 / 8, margin=1) == 1
    assert column_step(at_rate(1000.0, 1000.0, 100.0), 1 / 8, 31) == 1  # the slow one, too
