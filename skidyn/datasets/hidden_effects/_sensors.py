# SPDX-License-Identifier: BSD-3-Clause
"""Effects of sensors on signals: noise, quantisation, and a user's derivatives."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array

#: Share of the variance of torque noise that is coloured, and its time constant in s.
COLOURED_SHARE, TIME_CONSTANT = 0.4, 0.03
#: Cut-off of the low-pass before a user's derivative, Hz.
CUTOFF = 10.0


def sensor_noise(
    shape: tuple[int, int, int], std: Array, step: float, rng: np.random.Generator
) -> Array:
    """White noise plus first-order coloured noise, per trajectory.

    The shape is (n_trajectories, n_samples, n_joints), samples are ``step`` s apart, and ``std`` is
    the standard deviation of the sum by joint.
    """
    from scipy.signal import lfilter  # a second of imports: only where a log is made

    pole = np.exp(-step / TIME_CONSTANT)
    drive = rng.standard_normal(shape)
    start = rng.standard_normal((shape[0], 1, shape[2]))
    coloured, _ = lfilter([np.sqrt(1 - pole**2)], [1, -pole], drive, axis=1, zi=pole * start)
    white = rng.standard_normal(shape)
    mixed = np.sqrt(1 - COLOURED_SHARE) * white + np.sqrt(COLOURED_SHARE) * coloured
    noise: Array = std * mixed
    return noise


def quantise(values: Array, resolution: Array | float) -> Array:
    """Round to whole steps of a sensor."""
    return np.round(values / resolution) * resolution


def filtered_derivative(velocity: Array, step: float) -> Array:
    """Acceleration from measured velocity, as derived by a user.

    Samples are ``step`` s apart and pass a zero-phase Butterworth low-pass.
    """
    from scipy.signal import butter, sosfiltfilt

    nyquist = 0.5 / step
    if CUTOFF < 0.9 * nyquist and velocity.shape[1] > 30:
        low_pass = butter(2, CUTOFF / nyquist, output="sos")
        velocity = sosfiltfilt(low_pass, velocity, axis=1)
    return np.gradient(velocity, step, axis=1)
