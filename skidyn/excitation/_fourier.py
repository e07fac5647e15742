# SPDX-License-Identifier: BSD-3-Clause
"""Fourier series that start and end at rest."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array


def fourier(time: Array, omega: float, weights: Array) -> Array:
    """A Fourier series and its two derivatives, shape (3, n_samples).

    Sine and cosine weights, harmonic by harmonic, are those of the velocity, so that high harmonics
    have small strokes. ``omega`` is the angular frequency of the first harmonic, rad/s.
    """
    series = np.zeros((3, len(time)))
    for k, (a, b) in enumerate(zip(weights[::2], weights[1::2], strict=True), start=1):
        w = k * omega
        sine, cosine = np.sin(w * time), np.cos(w * time)
        series[0] += (a * sine + b * cosine) / k
        series[1] += (a * cosine - b * sine) * w / k
        series[2] -= (a * sine + b * cosine) * w**2 / k
    return series


def rest_window(time: Array, duration: float, blend: float) -> Array:
    """A window that rises from 0 to 1 and falls back along quintics, with two derivatives.

    Rising and falling take ``blend`` s each; the shape is (3, n_samples).
    """
    window = np.stack([np.ones_like(time), np.zeros_like(time), np.zeros_like(time)])
    for distance, sign in ((time, 1.0), (duration - time, -1.0)):
        near = distance < blend
        x = np.clip(distance[near] / blend, 0, 1)
        window[0, near] = x**3 * (10 - 15 * x + 6 * x**2)
        window[1, near] = sign * 30 * x**2 * (1 - x) ** 2 / blend
        window[2, near] = 60 * x * (1 - 3 * x + 2 * x**2) / blend**2
    return window


def product(window: Array, wave: Array) -> Array:
    """The product of two functions with its two derivatives, shape (3, n_samples)."""
    (w, dw, ddw), (s, ds, dds) = window, wave
    return np.stack([w * s, dw * s + w * ds, ddw * s + 2 * dw * ds + w * dds])
