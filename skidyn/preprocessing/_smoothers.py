# SPDX-License-Identifier: BSD-3-Clause
"""Three smoothers with one parameter, a cut-off in Hz, and a known leave-one-out error.

Each maps the samples of one segment to smoothed values, first and second derivatives, all linear in
the samples. ``weight`` is the weight of a sample in its own smoothed value (the diagonal of the hat
matrix): ``(y - smoothed) / (1 - weight)`` is the error of predicting a sample from the others, so
cross-validation costs no second pass (Craven and Wahba 1979).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Smoothed:
    """Result of smoothing one segment: the signal and its time derivatives, by column.

    ``weight``, of shape (n_samples, 1), is that of each sample in its own smoothed value, 0 to 1.
    """

    value: Array
    first: Array
    second: Array
    weight: Array

    def left_out_error(self, values: Array) -> Array:
        """Error of every sample predicted from the others, of the shape of ``values``."""
        return (values - self.value) / np.maximum(1 - self.weight, 1e-9)


#: Signature of a smoother: times (s), values (n_samples, n_signals), cut-off (Hz).
Smoother = Callable[[Array, Array, float], Smoothed]


def butterworth(times: Array, values: Array, cutoff: float) -> Smoothed:
    """Zero-phase Butterworth low-pass of order 4, then central differences.

    The cut-off is that of one pass; forward and backward together halve the amplitude there.
    """
    rate = _rate(times)
    sections = signal.butter(4, cutoff, fs=rate, output="sos")
    padding = min(int(3 * rate / cutoff), len(values) - 1)
    value = signal.sosfiltfilt(sections, values, axis=0, padlen=padding)
    impulse = np.zeros(2 * int(4 * rate / cutoff) + 1)
    impulse[len(impulse) // 2] = 1.0
    own = signal.sosfiltfilt(sections, impulse, padlen=0)[len(impulse) // 2]
    first = np.gradient(value, times, axis=0, edge_order=2)
    second = np.gradient(first, times, axis=0, edge_order=2)
    return Smoothed(value, first, second, np.full((len(values), 1), own))


def savitzky_golay(times: Array, values: Array, cutoff: float) -> Smoothed:
    """Local polynomials of degree 4; the window follows from the cut-off (Schafer 2011, eq. 12)."""
    rate = _rate(times)
    degree = 4
    half = round(((degree + 1) * rate / (2 * cutoff) + 4.6) / 3.2)
    half = int(np.clip(half, degree // 2 + 1, (len(values) - 1) // 2))
    window = 2 * half + 1
    degree = min(degree, window - 1)
    value, first, second = (
        signal.savgol_filter(values, window, degree, deriv=k, delta=1 / rate, axis=0)
        for k in range(3)
    )
    own = signal.savgol_coeffs(window, degree)[half]
    return Smoothed(value, first, second, np.full((len(values), 1), own))


def kalman(times: Array, values: Array, cutoff: float) -> Smoothed:
    """Kalman smoother of a point with white jerk; uses the recorded times unchanged.

    The ratio of jerk to measurement noise is that at which the smoother transmits half of the
    amplitude at the cut-off, ``|H|^-1 = 1 + (f / cutoff)^6``.

    References
    ----------
    .. [1] H. E. Rauch, F. Tung, C. T. Striebel, "Maximum Likelihood Estimates of Linear Dynamic
       Systems", AIAA Journal 3(8), 1965.
    """
    n = len(values)
    steps = np.diff(times)
    jerk = (2 * np.pi * cutoff) ** 6 * float(np.median(steps))
    state = np.zeros((n, 3, values.shape[1]))
    spread = np.empty((n, 3, 3))
    predicted, predicted_spread = np.empty_like(state), np.empty_like(spread)
    moves = np.empty((n, 3, 3))
    # the initial state is unknown: a variance far above that due to the jerk over one period
    wide = 1e6 * (2 * np.pi * cutoff) ** np.array([0.0, 2.0, 4.0])
    x, P = np.zeros((3, values.shape[1])), np.diag(wide)
    x[0] = values[0]
    for k in range(n):
        if k:
            h = steps[k - 1]
            moves[k] = F = np.array([[1, h, h * h / 2], [0, 1, h], [0, 0, 1]])
            x, P = F @ x, F @ P @ F.T + jerk * _jerk_spread(h)
        predicted[k], predicted_spread[k] = x, P
        gain = P[:, :1] / (P[0, 0] + 1)
        x = x + gain @ (values[k] - x[0])[None]
        P = P - gain @ P[:1]
        state[k], spread[k] = x, (P + P.T) / 2
    for k in range(n - 2, -1, -1):
        C = np.linalg.solve(predicted_spread[k + 1], moves[k + 1] @ spread[k]).T
        state[k] += C @ (state[k + 1] - predicted[k + 1])
        spread[k] += C @ (spread[k + 1] - predicted_spread[k + 1]) @ C.T
    return Smoothed(state[:, 0], state[:, 1], state[:, 2], spread[:, 0, :1])


def _jerk_spread(h: float) -> Array:
    """Covariance due to white jerk of unit density within a step ``h``."""
    return np.array(
        [
            [h**5 / 20, h**4 / 8, h**3 / 6],
            [h**4 / 8, h**3 / 3, h**2 / 2],
            [h**3 / 6, h**2 / 2, h],
        ]
    )


def _rate(times: Array) -> float:
    return float(1 / np.median(np.diff(times)))


#: Smoothers by the names for users.
SMOOTHERS: dict[str, Smoother] = {
    "butterworth": butterworth,
    "kalman": kalman,
    "savitzky_golay": savitzky_golay,
}
