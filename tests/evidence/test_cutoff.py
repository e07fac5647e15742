# SPDX-License-Identifier: BSD-3-Clause
"""Cut-off of the smoother by the noise of the positions and by the motion."""

import numpy as np
import pytest

from skidyn.effects import Signals
from skidyn.evidence import smooth_motion


def motion(rate, bits, fastest):
    """Two joints that move at up to some frequency in Hz, and what their encoders show."""
    time = np.arange(0, 10, 1 / rate)
    waves = np.array([0.11, 0.17, 1.0])[:, None] * fastest
    q = np.sin(2 * np.pi * waves * time + np.arange(3)[:, None]) / waves / 10
    q = np.column_stack([q.sum(axis=0), 0.7 * q[::-1].cumsum(axis=0)[-1] + 0.3])
    step = 2 * np.pi / 2 ** (bits or 40)
    read = np.round(q / step) * step
    dq = np.gradient(q, time, axis=0)
    number = np.zeros(len(time), dtype=int)
    return Signals(read, dq, np.zeros_like(q), number, time=time), np.gradient(dq, time, axis=0)


@pytest.mark.parametrize("rate", [100, 500, 1000])
@pytest.mark.parametrize("bits", [10, 12, 13])
def test_coarse_positions_are_smoothed_more_and_accelerations_get_better(rate, bits):
    signals, true = motion(rate, bits, fastest=1.5)
    usual = min(27.0, 0.24 * rate)

    chosen = smooth_motion(signals)
    other = smooth_motion(signals, usual)

    use = (chosen.usable & other.usable).all(axis=1)
    error, before = (np.std((m.ddq - true)[use]) for m in (chosen, other))
    assert chosen.cutoff.max() < 0.75 * usual
    assert error < 0.6 * before and error < 0.5 * np.std(true[use])


@pytest.mark.parametrize("rate", [100, 500, 1000])
def test_noise_that_is_a_tenth_of_the_accelerations_is_left(rate):
    signals, true = motion(rate, 14, fastest=1.5)
    chosen, other = smooth_motion(signals), smooth_motion(signals, min(27.0, 0.24 * rate))
    use = (chosen.usable & other.usable).all(axis=1)
    error, before = (np.std((m.ddq - true)[use]) for m in (chosen, other))
    assert error <= before and error < 0.15 * np.std(true[use])


@pytest.mark.parametrize("bits", [20, None])
def test_fine_positions_keep_the_usual_cutoff(bits):
    assert smooth_motion(motion(250, bits, fastest=1.5)[0]).cutoff.min() == 27.0


def test_the_cutoff_stays_above_the_motion():
    signals, true = motion(500, 12, fastest=8.0)
    smoothed = smooth_motion(signals)
    assert smoothed.cutoff.min() > 10.0
    use = smoothed.usable.all(axis=1)
    kept = np.sum(smoothed.ddq[use] * true[use]) / np.sum(true[use] ** 2)
    assert kept == pytest.approx(1.0, abs=0.03)


def test_smoothed_motion_is_smoothed_again_as_it_was():
    chosen = smooth_motion(motion(100, 12, fastest=1.5)[0])
    assert np.array_equal(smooth_motion(chosen).cutoff, chosen.cutoff)
    assert chosen.cutoff.max() < 20.0


def test_trajectories_are_smoothed_as_they_are_alone():
    coarse, fine = (motion(100, bits, fastest=1.5)[0] for bits in (12, 20))
    q, dq, ddq = (
        np.concatenate([getattr(s, name) for s in (coarse, fine)]) for name in ("q", "dq", "ddq")
    )
    number, time = np.repeat([4, 7], coarse.n_samples), np.concatenate([coarse.time, fine.time])
    both = Signals(q, dq, ddq, number, time=time)
    together, alone = smooth_motion(both), [smooth_motion(s) for s in (coarse, fine)]
    np.testing.assert_array_equal(together.ddq, np.concatenate([s.ddq for s in alone]))
    assert together.cutoff.min() < 20.0 and together.cutoff.max() == pytest.approx(24.0)
