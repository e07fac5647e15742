# SPDX-License-Identifier: BSD-3-Clause
"""Errors of the robot on a measurement, to compare it before and after a remedy."""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import fit_admissible

#: Rows of the fits: as for other first tests, more would not change an order.
ROWS = 1500


def errors_of_fits(measurement: Measurement) -> Array | None:
    """Errors of two models of the robot, each with friction, as shares of the torque.

    The first one has the bodies of the description, and no scale of the torque is fitted, so that
    its error depends on units and gains; the second one has identified bodies, and its error does
    not depend on wrong masses of the description.

    Parameters
    ----------
    measurement : Measurement
        Recording and robot.

    Returns
    -------
    ndarray of shape (2,) or None
        Mean over joints; None without a robot, or if no joint moves enough.
    """
    fits = measurement.fits
    if fits is None:
        return None
    fits = fits.thinned(ROWS)
    joints = [k for k in range(fits.n_joints) if fits.usable(k)]
    if not joints:
        return None
    columns, identified = fits.columns(Reading()), fits.identified(Reading()).scale
    shares = []
    for k in joints:
        y, use = fits.mean_torque(k)
        own = columns[use, :, k]
        stated = fit_admissible(np.insert(own[:, 1:], 0, 0.0, axis=1), y[use] - own[:, 0])
        size = float(np.sqrt(np.mean(y[use] ** 2))) + np.finfo(float).tiny
        shares.append((stated.scale / size, identified[k] / size))
    return np.asarray(np.mean(shares, axis=0))
