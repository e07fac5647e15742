# SPDX-License-Identifier: BSD-3-Clause
"""Gain of one more column beside the fit of all joints, at the weights of that fit.

What a column would gain follows from the residual without it, so that many columns, each a mistake
of which the torque is a linear function where it is small, are tested with a single fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._fits import Fits
from skidyn.measurement._joint_fit import JointFit
from skidyn.measurement._near_bodies import Factored
from skidyn.measurement._peak import peak
from skidyn.measurement._robust import RobustFit, robust_weights

#: Lag for a slope, and the distance of the lags of a parabola, s.
SLOPE, NEAR = 2e-3, 4e-3
#: Least share of a column that the others do not follow.
ALONE = 1e-6


class Score:
    """A fit of all joints, and what further columns would gain beside it.

    Parameters
    ----------
    fits : Fits
        Rows.
    """

    def __init__(self, fits: Fits) -> None:
        self.fits, self.together = fits, JointFit(fits, range(fits.n_joints))
        self.plain = self.together.fit(fits.torque)
        self.inflation = [fit.inflation for fit in self.plain]
        self.weights = [
            robust_weights(fit) / i for fit, i in zip(self.plain, self.inflation, strict=True)
        ]
        places = self.together.places
        self.size = 1 + max((int(place.max()) for place in places), default=0)
        gram = np.zeros((self.size, self.size))
        for design, place, weight in zip(self.together.designs, places, self.weights, strict=True):
            gram[np.ix_(place, place)] += (design.T * weight) @ design
        self.factor = Factored(gram)

    @property
    def joints(self) -> list[int]:
        """Joints that are fitted."""
        return self.together.joints

    def promise(self, column: Array) -> tuple[float, float]:
        """Log-likelihood gain and coefficient of a column, about.

        Parameters
        ----------
        column : ndarray of shape (n_rows, n_fitted_joints)

        Returns
        -------
        gain, coefficient : float
        """
        own, right, cross = 0.0, 0.0, np.zeros(self.size)
        together = self.together
        for j, (use, fit, weight) in enumerate(
            zip(together.rows, self.plain, self.weights, strict=True)
        ):
            values = column[use, j]
            own += float(weight @ values**2)
            right += float((weight * values) @ fit.residual)
            cross[together.places[j]] += together.designs[j].T @ (weight * values)
        rest = own - float(cross @ self.factor.solve(cross))
        return (0.5 * right**2 / rest, right / rest) if rest > ALONE * own else (0.0, 0.0)

    def gain(self, fitted: Sequence[RobustFit]) -> float:
        """Log-likelihood gain of another fit of the same rows."""
        gained = zip(fitted, self.plain, self.inflation, strict=True)
        return sum((there.likelihood - here.likelihood) / i for there, here, i in gained)

    def gain_of_torque(self, late: Sequence[int]) -> Callable[[float | Array], float]:
        """Log-likelihood gain as a function of the lag of some torques, s."""
        changed = self.together.changing(late)
        return lambda lag: self.gain(changed.fit_at(lag))


def likeliest_lag(gain: Callable[[float], float], first: float) -> float:
    """Lag of the largest log-likelihood gain, s.

    Parameters
    ----------
    gain : callable
        Gain as a function of the lag, s.
    first : float, s
        Lag that a slope promises: too small where something is late, since the weights of its rows
        are small.
    """
    return peak(gain, max((first, 1.5 * first, 2 * first), key=gain), NEAR)
