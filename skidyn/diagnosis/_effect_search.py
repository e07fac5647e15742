# SPDX-License-Identifier: BSD-3-Clause
"""The automatic loop as a scikit-learn search."""

from __future__ import annotations

import time
from collections.abc import Iterable
from numbers import Integral
from typing import Any

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, clone
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import _check_sample_weight, check_is_fitted

from skidyn._exceptions import SkidynError
from skidyn._keys import keys_of
from skidyn._signals import Array
from skidyn._validation import table_of, validate_motion
from skidyn.diagnosis._correction import is_physics, open_model, weights_of_fit
from skidyn.diagnosis._diagnosis import diagnose
from skidyn.diagnosis._faded import FadingCorrection, step_scores
from skidyn.diagnosis._result import Diagnosis
from skidyn.diagnosis._rule import Settings
from skidyn.effects import Term

#: Largest p-value of a gain over the folds.
LEVEL = 0.05


def _refits(search: EffectSearchCV) -> bool:
    if not search.refit:
        raise AttributeError("the search was run with refit=False and has no model; set refit=True")
    return True


class EffectSearchCV(MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Find the effects that a rigid-body model lacks, add them, and predict with the best model.

    The diagnosis adds one finding after the other. Models with the first k of them are scored on
    held-out folds, and findings are kept as long as they raise the score in most folds: an effect
    that is significant on the judged samples may not improve a score over all samples.
    ``diagnosis_`` has all findings.

    Added effects fade out beyond the motion of the log, since a function of the position that was
    fitted to a part of the travel is not valid elsewhere.

    Parameters
    ----------
    estimator : RBDRegressor
        Model to start from, also as the last step of a ``Pipeline``.
    effects : sequence of str, optional
        Kinds to try; by default the whole catalogue.
    settings : Settings, optional
        Thresholds of the search.
    smooth : bool, default=True
        Derive velocity and acceleration from the positions in the search; if False, use those of X.
    scoring : str, callable or None, default=None
        Score of the models of ``cv_results_`` on held-out folds; R2 if None. The effects themselves
        are judged by :func:`diagnose`, independent of the scoring.
    cv : int, cross-validator or iterable, default=5
        Folds of these scores; by trajectory if it is a number.
    refit : bool, default=True
        Fit the best model to all rows.
    n_jobs : int or None, default=None
        Processes for the scores.
    fade_out : bool, default=True
        Let added effects fade out, also in the scores, where the uncertainty of the best model
        exceeds that in the log. The uncertainty is the standard deviation of its prediction
        (:meth:`~skidyn.identification.RBDRegressor.predict`) relative to that of the given model.
        Added effects have full weight up to the largest ratio in the log, or 1, and zero weight at
        twice that ratio. False predicts with ``best_estimator_`` only.

    Attributes
    ----------
    diagnosis_ : Diagnosis
        Diagnosis with all findings.
    best_estimator_ : estimator
        The given model with ``best_effects_`` added, fitted to all data; with ``refit=True``.
    fading_ : FadingCorrection
        The given model and the best one, both fitted to all data; only if added effects fade out.
    best_params_ : dict
        The parameter ``effects`` of the best model, by its name in ``estimator``.
    best_effects_ : list of Term
        Added effects: the findings up to the last one that raised the score.
    best_index_ : int
        Row of ``cv_results_`` of the best model: the last that scores higher than the best before
        it, in the mean and by the signed ranks of the differences over the folds [1]_, at the level
        of 5 % (one-sided): in all folds where there are five or fewer. A single fold can dominate
        the mean of the differences and their standard error, but not their ranks.
    best_score_ : float
        Its mean score on held-out folds.
    cv_results_ : dict of str to ndarray
        One entry per step, as scikit-learn's searches have them: ``params`` (list of dict),
        ``param_<name>``, ``split<k>_test_score``, ``mean_test_score``, ``std_test_score``,
        ``rank_test_score`` and the times to fit and score, s. In addition ``added``, ``rmse1`` ..
        of every joint (N m or N, held out, on the samples judged) and ``mean_rmse``.
    n_splits_ : int
        Number of folds.
    scorer_ : callable
        The scorer.
    multimetric_ : bool
        False: there is one score.
    refit_time_ : float
        Time to fit the best model to all rows, s; with ``refit=True``.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    See Also
    --------
    diagnose : The same with all results.

    References
    ----------
    .. [1] F. Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1, 1945.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(
    ...     load_planar_arm(), "stribeck", joints=[2], n_trajectories=6, duration=5.0
    ... )
    >>> search = EffectSearchCV(RBDRegressor(log.robot)).fit(log.X, log.y)
    >>> search.cv_results_["added"].tolist()
    [None, 'stribeck']
    """

    __metadata_request__fit = {"sample_weight": True, "groups": True}
    __metadata_request__score = {"sample_weight": True}

    def __init__(
        self,
        estimator: Any,
        *,
        effects: Iterable[str] | None = None,
        settings: Settings | None = None,
        smooth: bool = True,
        scoring: Any = None,
        cv: Any = 5,
        refit: bool = True,
        n_jobs: int | None = None,
        fade_out: bool = True,
    ) -> None:
        self.estimator = estimator
        self.effects = effects
        self.settings = settings
        self.smooth = smooth
        self.scoring = scoring
        self.cv = cv
        self.refit = refit
        self.n_jobs = n_jobs
        self.fade_out = fade_out

    def fit(self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None) -> EffectSearchCV:
        """Search for missing effects and fit the best model.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, with time and trajectory.
        y : array-like of shape (n_samples, n_joints)
            Torque, N m or N.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of every sample in all fits, as in :class:`~skidyn.identification.RBDRegressor`;
            scores use equal weights.
        groups : array-like of shape (n_samples,), default=None
            Groups of the rows for a `cv` that splits by groups.

        Returns
        -------
        EffectSearchCV
            The search itself.
        """
        for name in ("refit", "fade_out"):
            if not isinstance(getattr(self, name), bool | np.bool_):
                raise ValueError(f"{name}={getattr(self, name)!r}; expected True or False")
        array, torque = validate_motion(
            self, X, y, multi_output=True, y_numeric=True, dtype=np.float64
        )
        if sample_weight is not None:
            sample_weight = _check_sample_weight(sample_weight, array, dtype=np.float64)
        X, y, sample_weight = self._log(self._table(X, array), torque, sample_weight)
        model = clone(self.estimator)
        opened = open_model(model, X, y)
        if not is_physics(opened.model):
            raise SkidynError(
                f"{type(self.estimator).__name__} has no parameter effects; give an RBDRegressor, "
                "alone or as the last step of a Pipeline. diagnose(model, ...) accepts any "
                "fitted regressor"
            )
        name = "".join(f"{pipeline.steps[-1][0]}__" for pipeline in opened.outer) + "effects"
        if name not in model.get_params():
            raise SkidynError(
                f"{type(self.estimator).__name__} hides the parameter effects of the "
                f"{type(opened.model).__name__} inside, which this search has to set; give that "
                "model, alone or as the last step of a Pipeline, and put other searches and "
                "transformed targets around the EffectSearchCV"
            )
        self.diagnosis_: Diagnosis = diagnose(
            model,
            X,
            y,
            effects=self.effects,
            smooth=self.smooth,
            settings=self.settings,
            sample_weight=sample_weight,
        )
        weights = weights_of_fit(self.estimator, sample_weight)
        self._score_steps(X, y, groups, weights, name, list(opened.model.effects))
        self.__dict__.pop("fading_", None)
        if self.refit:
            begun = time.perf_counter()
            self.best_estimator_ = self.diagnosis_.model
            if self.best_index_ < len(self.cv_results_["params"]) - 1:
                best = clone(self.estimator).set_params(**self.best_params_)
                self.best_estimator_ = best.fit(X, y, **weights)
            if self.fade_out and self.best_effects_:
                start = clone(self.estimator).fit(X, y, **weights)
                self.fading_ = FadingCorrection(start, self.best_estimator_).fit(X)
            self.refit_time_ = time.perf_counter() - begun
        return self

    def _score_steps(
        self, X: Any, y: Any, groups: Any, weights: dict[str, Any], name: str, start: list[Any]
    ) -> None:
        """Scores of the models along the history, in the form of scikit-learn's searches."""
        from sklearn.metrics import check_scoring
        from sklearn.model_selection import check_cv
        from sklearn.utils.parallel import Parallel, delayed

        from skidyn.model_selection import held_out_folds

        history, findings = self.diagnosis_.history, self.diagnosis_.findings
        # One model per step, with the effects found up to it; effects added in several steps at
        # last.
        steps: list[list[Term]] = [[]]
        for k in range(1, len(history)):
            upto = findings if k == len(history) - 1 else findings[:k]
            steps.append([t for f in upto for t in f.terms])
        params = [{name: [*start, *terms]} for terms in steps]
        keys = keys_of(X)
        if isinstance(self.cv, Integral):
            table = np.asarray(X, dtype=float)
            folds = held_out_folds(keys.trajectories(table), int(self.cv))
        else:
            folds = list(check_cv(self.cv).split(X, y, groups))
        self.scorer_ = check_scoring(self.estimator, scoring=self.scoring)
        of_fold = (
            delayed(step_scores)(
                self.estimator, params, X, y, fold, self.scorer_, weights, self.fade_out
            )
            for fold in folds
        )
        # each of shape (n_steps, n_folds)
        scores, *times = np.transpose(Parallel(n_jobs=self.n_jobs)(of_fold), (2, 1, 0))
        rmse = np.array([step["rmse"] for step in history])
        mean = scores.mean(axis=1)
        rank = np.array([1 + np.sum(mean > own) for own in mean], dtype=np.int32)
        self.n_splits_, self.multimetric_ = len(folds), False
        column = np.empty(len(params), dtype=object)
        for k, own in enumerate(params):
            column[k] = tuple(own[name])
        self.cv_results_ = {
            **{
                f"{kind}_{what}_time": reduce(spent, axis=1)
                for what, spent in zip(("fit", "score"), times, strict=True)
                for kind, reduce in (("mean", np.mean), ("std", np.std))
            },
            f"param_{name}": column,
            "params": params,
            **{f"split{k}_test_score": scores[:, k] for k in range(len(folds))},
            "mean_test_score": mean,
            "std_test_score": scores.std(axis=1),
            "rank_test_score": rank,
            "added": np.array([step["added"] for step in history], dtype=object),
            **{f"rmse{j}": of_joint for j, of_joint in enumerate(rmse.T, 1)},
            "mean_rmse": rmse.mean(1),
        }
        self.best_index_ = _best_step(scores)
        self.best_effects_ = steps[self.best_index_]
        self.best_params_ = params[self.best_index_]
        self.best_score_ = float(mean[self.best_index_])

    @available_if(_refits)
    def predict(self, X: Any) -> Array:
        """Torque of the best model; added effects fade out beyond the motion of the log.

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
        array = validate_motion(self, X, reset=False, dtype=np.float64)
        model = getattr(self, "fading_", self.best_estimator_)
        return np.asarray(model.predict(self._table(X, array)))

    # Two hooks that the common tests replace, because their rows have any width and are no motion.

    def _table(self, X: Any, array: Array) -> Any:
        """The motion as given if the columns of X have names, else as an array."""
        return table_of(self, X, array)

    def _log(self, X: Any, torque: Array, weight: Array | None) -> tuple[Any, Array, Array | None]:
        """The log that is searched."""
        return X, torque, weight


def _best_step(scores: Array) -> int:
    """Last step that is better than the best before it by a signed-rank test over the folds."""
    from scipy.stats import wilcoxon

    best = 0
    for k in range(1, len(scores)):
        gain = scores[k] - scores[best]
        if gain.mean() > 0:
            differing = gain[gain != 0]
            chance = wilcoxon(differing, alternative="greater").pvalue
            # with four folds the smallest p-value is 1/16, with two it is 1/4
            best = k if chance <= max(LEVEL, 0.5 ** len(differing)) else best
    return best
