# SPDX-License-Identifier: BSD-3-Clause
"""The loop without a person in it, as a scikit-learn search."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, RegressorMixin, clone
from sklearn.utils.validation import check_is_fitted

from skidyn._signals import Array
from skidyn.diagnosis._diagnosis import diagnose
from skidyn.diagnosis._hypothesis import Settings
from skidyn.diagnosis._result import Diagnosis


class EffectSearchCV(MetaEstimatorMixin, RegressorMixin, BaseEstimator):
    """Find the effects a rigid-body model lacks, add them, and predict with the better model.

    Parameters
    ----------
    estimator : RBDRegressor
        Model to start from.
    effects : sequence of str, optional
        Kinds to try; by default the whole catalogue.
    settings : Settings, optional
        Thresholds of the search.

    Attributes
    ----------
    diagnosis_ : Diagnosis
        Everything that was found.
    best_estimator_ : RBDRegressor
        The given model with the findings added, fitted to all data.
    best_effects_ : list of Term
        What was added.
    cv_results_ : dict of str to ndarray
        One entry per step: ``added``, ``mean_rmse`` over the joints (N m or N), ``rmse`` of every
        joint, held out.
    n_features_in_ : int
        Number of columns of X.

    See Also
    --------
    diagnose : The same with everything to look at.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.rigid_body import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), "stribeck", joints=[2])
    >>> search = EffectSearchCV(RBDRegressor(log.robot)).fit(log.X, log.y)
    >>> search.cv_results_["added"].tolist()
    [None, 'stribeck']
    """

    def __init__(
        self,
        estimator: Any,
        *,
        effects: Iterable[str] | None = None,
        settings: Settings | None = None,
    ) -> None:
        self.estimator = estimator
        self.effects = effects
        self.settings = settings

    def fit(self, X: Any, y: Any) -> EffectSearchCV:
        """Search for missing effects and fit the better model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, with time and trajectory.
        y : array-like of shape (n_samples, n_joints)
            Torque, N m or N.

        Returns
        -------
        EffectSearchCV
            The search itself.
        """
        model = clone(self.estimator)
        self.diagnosis_: Diagnosis = diagnose(
            model, X, y, effects=self.effects, settings=self.settings
        )
        self.best_estimator_ = self.diagnosis_.model
        self.best_effects_ = [t for f in self.diagnosis_.findings for t in f.terms]
        history = self.diagnosis_.history
        rmse = np.array([step["rmse"] for step in history])
        self.cv_results_ = {
            "added": np.array([step["added"] for step in history], dtype=object),
            "rmse": rmse,
            "mean_rmse": rmse.mean(1),
        }
        self.n_features_in_ = int(np.shape(X)[1])
        return self

    def predict(self, X: Any) -> Array:
        """Torque of the better model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion.

        Returns
        -------
        ndarray of shape (n_samples, n_joints), N m or N
            Predicted torque.
        """
        check_is_fitted(self)
        return np.asarray(self.best_estimator_.predict(X))
