# SPDX-License-Identifier: BSD-3-Clause
"""Effects added to a regressor that is not a rigid-body model."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from skidyn._signals import Array
from skidyn.effects import make_terms
from skidyn.evidence._problem import Problem, make_problem
from skidyn.robots import Robot


class CorrectedRegressor(RegressorMixin, BaseEstimator):
    """A fitted regressor plus physical effects fitted to its residual.

    Parameters
    ----------
    regressor : fitted regressor
        Predicts torque, N m or N.
    robot : Robot
        Robot.
    effects : sequence of str, (str, joints) or Term, default=()
        Effects to add.

    Attributes
    ----------
    effect_terms_ : list of Term
        Effects.
    coef_ : ndarray of shape (n_coefficients,)
        Their coefficients.
    """

    def __init__(self, regressor: Any, robot: Robot, effects: Iterable[Any] = ()) -> None:
        self.regressor = regressor
        self.robot = robot
        self.effects = effects

    def with_effects(self, effects: Iterable[Any]) -> CorrectedRegressor:
        """An unfitted copy with more effects.

        Parameters
        ----------
        effects : iterable of str, (str, joints) or Term
            Effects to add.

        Returns
        -------
        CorrectedRegressor
        """
        return CorrectedRegressor(self.regressor, self.robot, [*self.effects, *effects])

    def fit(self, X: Any, y: Any) -> CorrectedRegressor:
        """Fit the effects to the regressor's residual.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, with time.
        y : array-like of shape (n_samples, n_joints)
            Torque, N m or N.

        Returns
        -------
        CorrectedRegressor
        """
        self.effect_terms_ = make_terms(self.effects, self.robot.n_joints)
        problem = self._problem(X, np.asarray(y, dtype=float))
        self.coef_ = problem.fit(self.effect_terms_, passes=3).coefficients
        return self

    def predict(self, X: Any) -> Array:
        """Torque of the regressor and the effects.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, with time.

        Returns
        -------
        ndarray of shape (n_samples, n_joints), N m or N
        """
        check_is_fitted(self)
        own = np.asarray(self.regressor.predict(X), dtype=float)
        problem = self._problem(X, own)
        fit = problem.fit(self.effect_terms_)
        torque = problem.term_torque(
            type(fit)(fit.terms, self.coef_, fit.covariance, fit.residual, fit.sigma)
        )
        return own + torque

    def _problem(self, X: Any, torque: Array) -> Problem:
        from skidyn.diagnosis._reading import read_signals

        own = np.asarray(self.regressor.predict(X), dtype=float).reshape(len(torque), -1)
        signals, torque = read_signals(X, torque, self.robot)
        problem = make_problem(
            signals,
            torque - own,
            robot=self.robot,
            rigid_body=False,
            terms=self.effect_terms_,
            subtract_urdf=False,
        )
        s = problem.signals
        load = self.robot.inverse_dynamics(s.q, s.dq, s.ddq)
        problem.signals = s.with_(load=load, model_torque=own, smooth_torque=own)
        return problem
