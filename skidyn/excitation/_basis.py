# SPDX-License-Identifier: BSD-3-Clause
"""Functions of time whose weighted sum is a motion; all start and end at rest at zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

from skidyn._signals import Array
from skidyn.excitation._fourier import fourier, product, rest_window


@dataclass(frozen=True)
class FourierBasis:
    """Sines and cosines under a window that rises and falls along quintics in ``blend`` s [1]_.

    References
    ----------
    .. [1] Swevers, Ganseman, Tukel, De Schutter, Van Brussel (1997), IEEE TRA 13(5), 730-740.
    """

    duration: float
    base_frequency: float
    harmonics: int
    blend: float

    def __call__(self, time: Array) -> Array:
        """Values and two derivatives, shape (3, n_samples, n_functions)."""
        window = rest_window(time, self.duration, self.blend)
        omega = 2 * np.pi * self.base_frequency
        unit = np.eye(2 * self.harmonics)
        return np.stack([product(window, fourier(time, omega, w)) for w in unit], axis=2)


@dataclass(frozen=True)
class QuinticBasis:
    """Quintics between points at even times, smooth up to the acceleration [1]_.

    The functions are position, velocity and acceleration at each of the points between start and
    end, the latter two in units of the time between points.

    References
    ----------
    .. [1] Biagiotti, Melchiorri (2008), Trajectory Planning for Automatic Machines and Robots,
       Springer.
    """

    duration: float
    points: int

    def __call__(self, time: Array) -> Array:
        """Values and two derivatives, shape (3, n_samples, n_functions)."""
        step = self.duration / (self.points + 1)
        columns = []
        for point in range(1, self.points + 1):
            place = np.asarray(time) / step - point
            for before, after in zip(_BEFORE, _AFTER, strict=True):
                columns.append(
                    [
                        np.where(place < 0, before.deriv(k)(place + 1), after.deriv(k)(place))
                        * (np.abs(place) < 1)
                        / step**k
                        for k in range(3)
                    ]
                )
        return np.moveaxis(np.array(columns), 0, 2)


#: Position, velocity and acceleration of 1 at the end, and at the start, of a unit of time.
_BEFORE = (
    Polynomial([0, 0, 0, 10, -15, 6]),
    Polynomial([0, 0, 0, -4, 7, -3]),
    Polynomial([0, 0, 0, 0.5, -1, 0.5]),
)
_AFTER = (
    Polynomial([1, 0, 0, -10, 15, -6]),
    Polynomial([0, 1, 0, -6, 8, -3]),
    Polynomial([0, 0, 0.5, -1.5, 1.5, -0.5]),
)
