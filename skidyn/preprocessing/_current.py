# SPDX-License-Identifier: BSD-3-Clause
"""Motor current to joint torque."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.utils.validation import check_is_fitted

from skidyn._transformer import LogTransformer

Array = NDArray[np.float64]


class CurrentToTorque(LogTransformer):
    """Joint torque from motor current: gear ratio times torque constant times current.

    X has one column for each joint, in A; the result is in N m (N if prismatic).

    Parameters
    ----------
    gear_ratio : float or array-like of shape (n_joints,), default=1.0
        Turns of the motor per turn of the joint.
    torque_constant : float or array-like of shape (n_joints,), N m/A, default=1.0
        Motor torque per ampere. If only the product of both is known, give it here.

    Attributes
    ----------
    gain_ : ndarray of shape (n_joints,), N m/A
        Joint torque per ampere.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    References
    ----------
    .. [1] "Semiparametric Deep Learning Manipulator Inverse Dynamics Modeling Method for Smart
       City and Industrial Applications", eq. 6.

    Examples
    --------
    >>> from skidyn.preprocessing import CurrentToTorque
    >>> CurrentToTorque(101, [0.125, 0.0922]).fit_transform([[1.0, 2.0]]).round(3)
    array([[12.625, 18.624]])
    """

    def __init__(self, gear_ratio: ArrayLike = 1.0, torque_constant: ArrayLike = 1.0) -> None:
        self.gear_ratio = gear_ratio
        self.torque_constant = torque_constant

    def _learn(self, X: Array) -> None:
        gain = np.asarray(self.gear_ratio, dtype=float) * np.asarray(self.torque_constant, float)
        if gain.ndim > 1 or gain.size not in (1, X.shape[1]):
            raise ValueError(
                f"gear_ratio and torque_constant give {gain.size} gains for {X.shape[1]} joints; "
                "give one for all or one per joint."
            )
        if (gain == 0).any() or not np.isfinite(gain).all():
            raise ValueError("gear_ratio and torque_constant must be finite and not zero.")
        self.gain_ = np.broadcast_to(gain, (X.shape[1],)).copy()

    def _changed(self, X: Array) -> Array:
        torque: Array = X * self.gain_
        return torque

    def inverse_transform(self, X: Any) -> Array:
        """Current of every sample.

        Parameters
        ----------
        X : array-like of shape (n_samples, n_joints), N m (N if prismatic)
            Torques.

        Returns
        -------
        current : ndarray of shape (n_samples, n_joints), A
            Motor currents.
        """
        check_is_fitted(self)
        current: Array = np.asarray(X, dtype=np.float64) / self.gain_
        return current
