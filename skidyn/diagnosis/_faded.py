# SPDX-License-Identifier: BSD-3-Clause
"""Corrections that fade out beyond the motion to which they were fitted.

A function of the position that was fitted to a part of the travel is not reliable for the rest, and
held-out recordings of the same part cannot show this. The coefficients can: due to their spread
over the recordings, the standard deviation of the corrected model's prediction grows there, and
faster than that of the model without the correction.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, RegressorMixin, clone
from sklearn.exceptions import FitFailedWarning
from sklearn.utils import _safe_indexing

from skidyn._signals import Array
from skidyn.identification import RBDRegressor


class FadingCorrection(RegressorMixin, BaseEstimator):
    """A fitted model and its correction, which fades out beyond the motion of the training rows.

    The relative uncertainty of the corrected model is the ratio of the standard deviations of the
    two predictions. The correction has full weight up to the largest ratio among the training rows,
    or 1, and zero weight at twice that ratio.

    Parameters
    ----------
    start, corrected : RBDRegressor
        Fitted, alone or as the last step of a Pipeline. Corrections of other models, which have no
        standard deviation, do not fade out.

    Attributes
    ----------
    reach_ : ndarray of shape (n_joints,) or ()
        The ratio up to which the correction has full weight.
    """

    def __init__(self, start: Any, corrected: Any) -> None:
        self.start = start
        self.corrected = corrected

    def __getattr__(self, name: str) -> Any:
        """Attributes of the model that a scorer needs, such as its effects."""
        if name.startswith("__") or "corrected" not in self.__dict__:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        return getattr(self.corrected, name)

    def fit(self, X: Any, y: Any = None) -> FadingCorrection:
        """Find the range of the training rows.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Training rows.
        y : object, default=None
            Ignored.
        """
        both = (self.start, self.corrected)
        if self.start is not self.corrected and all(_knows_its_std(m) for m in both):
            self.reach_ = np.maximum(1.0, self._torques(X)[2].max(axis=0))
        return self

    def predict(self, X: Any) -> Array:
        """Torque of the start plus the weighted correction.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion.

        Returns
        -------
        ndarray of shape (n_samples, n_joints) or (n_samples,), N m or N
            Predicted torque.
        """
        from skidyn.hybrid import fade

        if "reach_" not in self.__dict__:
            return np.asarray(self.corrected.predict(X))
        before, after, ratio = self._torques(X)
        torque: Array = after - (1.0 - fade(ratio / self.reach_)) * (after - before)
        return torque

    def _torques(self, X: Any) -> tuple[Array, Array, Array]:
        """Torques of both models, and the ratio of their standard deviations."""
        before, std_before = _with_std(self.start, X)
        after, std_after = _with_std(self.corrected, X)
        return before, after, std_after / std_before


def _knows_its_std(model: Any) -> bool:
    return isinstance(_opened(model)[0], RBDRegressor)


def _with_std(model: Any, X: Any) -> tuple[Array, Array]:
    """Prediction and standard deviation; a Pipeline would need requests for routed metadata."""
    model, before = _opened(model)
    for steps in before:
        X = steps.transform(X)
    torque, std = model.predict(X, return_std=True)
    return torque, std


def _opened(model: Any) -> tuple[Any, list[Any]]:
    """The last step of nested Pipelines, and the steps before it, the outermost first."""
    from sklearn.pipeline import Pipeline  # its import takes 0.1 s

    before = []
    while isinstance(model, Pipeline):
        before += [model[:-1]] if len(model) > 1 else []
        model = model[-1]
    return model, before


def step_scores(
    estimator: Any,
    params: Sequence[dict[str, Any]],
    X: Any,
    y: Any,
    fold: tuple[Any, Any],
    scorer: Any,
    weights: dict[str, Any],
    fade_out: bool,
) -> list[tuple[float, float, float]]:
    """Scores of several models on the held-out rows of one fold, with the time that they took.

    Parameters
    ----------
    estimator : estimator
        Estimator to be cloned.
    params : sequence of dict
        Parameters of each model; the first is the start of all.
    X, y : table and array
        All rows.
    fold : (array of int, array of int)
        Training and test rows.
    scorer : callable
        The scorer.
    weights : dict of str to ndarray
        Weights of all rows, by their keyword of ``fit``.
    fade_out : bool
        Whether to score the torque with fading.

    Returns
    -------
    list of (float, float, float)
        Score of every model; nan, with a warning, for one that this fold cannot fit. Time to fit
        and to score it, s.
    """
    train, test = fold
    X_train, y_train = _safe_indexing(X, train), _safe_indexing(y, train)
    own = {name: _safe_indexing(weight, train) for name, weight in weights.items()}
    start: Any = None
    scores = []
    for parameters in params:
        model = clone(estimator).set_params(**parameters)
        begun = time.perf_counter()
        try:
            model.fit(X_train, y_train, **own)
        except ValueError as error:
            if start is None:
                raise
            warnings.warn(
                f"{parameters} was not fitted in one fold: {error}", FitFailedWarning, stacklevel=2
            )
            scores.append((np.nan, time.perf_counter() - begun, 0.0))
            continue
        start = model if start is None else start
        scored = FadingCorrection(start, model).fit(X_train) if fade_out else model
        fitted = time.perf_counter()
        score = float(scorer(scored, _safe_indexing(X, test), _safe_indexing(y, test)))
        scores.append((score, fitted - begun, time.perf_counter() - fitted))
    return scores
