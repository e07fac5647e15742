# SPDX-License-Identifier: BSD-3-Clause
"""Effects added to a regressor that is not a rigid-body model; models inside other estimators."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from sklearn.base import BaseEstimator, MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, clone
from sklearn.exceptions import NotFittedError
from sklearn.utils import _safe_indexing, get_tags
from sklearn.utils.validation import check_is_fitted

from skidyn._columns import column_names
from skidyn._signals import Array, Signals, read_signals
from skidyn.effects import Term, make_terms
from skidyn.evidence import Problem, make_problem
from skidyn.identification import (
    check_terms,
    find_terms,
    named_recordings,
    recognise,
    remember,
)
from skidyn.robots import Robot

if TYPE_CHECKING:
    from sklearn.pipeline import Pipeline


class CorrectedRegressor(MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, BaseEstimator):
    """A regressor plus physical effects fitted to its residual.

    Parameters
    ----------
    regressor : regressor
        Regressor of torque, N m or N. :meth:`fit` trains a copy of it, :meth:`fit_effects` uses it
        unchanged.
    robot : Robot
        Robot.
    effects : sequence of str, (str, joints) or Term, default=()
        Effects to add.

    Attributes
    ----------
    regressor_ : regressor
        Fitted.
    effect_terms_ : list of Term
        Effects.
    coef_ : ndarray of shape (n_coefficients,)
        Their coefficients.
    """

    __metadata_request__fit = {"sample_weight": True}
    __metadata_request__score = {"sample_weight": True}

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
        """
        return CorrectedRegressor(self.regressor, self.robot, [*self.effects, *effects])

    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> CorrectedRegressor:
        """Fit a copy of the regressor, then the effects to its residual.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, with time.
        y : array-like of shape (n_samples, n_joints)
            Torque, N m or N.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of every sample.
        """
        if not hasattr(self.regressor, "fit"):
            return self.fit_effects(X, y, sample_weight)
        self.regressor_ = clone(self.regressor, safe=False)
        self.regressor_.fit(X, y, **weights_of_fit(self.regressor_, sample_weight))
        return self._fit_effects(X, y, sample_weight)

    def fit_effects(self, X: Any, y: Any, sample_weight: Any = None) -> CorrectedRegressor:
        """Fit the effects to the residual of the unchanged fitted regressor.

        Parameters
        ----------
        X : DataFrame or array of shape (n_samples, n_features)
            Motion, with time.
        y : array-like of shape (n_samples, n_joints)
            Torque, N m or N.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of every sample.
        """
        self.regressor_ = self.regressor
        return self._fit_effects(X, y, sample_weight)

    def _fit_effects(self, X: Any, y: Any, sample_weight: Any) -> CorrectedRegressor:
        torque = np.asarray(y, dtype=float)
        self._one_output = torque.ndim == 1
        self.effect_terms_ = make_terms(self.effects, self.robot.n_joints)
        self.__dict__.pop("recordings_", None)
        problem = self._problem(X, torque.reshape(len(torque), -1), sample_weight)
        check_terms(self.effect_terms_, problem.signals)
        if any(term.is_open for term in self.effect_terms_):
            self.effect_terms_ = list(find_terms(problem).terms)
        self.coef_ = np.zeros(0)
        if self.effect_terms_:
            self.coef_ = problem.fit(self.effect_terms_, passes=3).coefficients
        self.recordings_ = remember(self._signals(X, torque)[0], self.effect_terms_)
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
        own = self._own(X)
        torque = own
        if self.effect_terms_:
            problem = self._problem(X, own)
            fit = problem.fit(self.effect_terms_)
            torque = own + problem.term_torque(replace(fit, coefficients=self.coef_))
        return torque[:, 0] if self._one_output else torque

    def _own(self, X: Any) -> Array:
        own = np.asarray(self.regressor_.predict(X), dtype=float)
        return own.reshape(len(own), -1)

    def _signals(self, X: Any, torque: Array) -> tuple[Signals, Array]:
        keys: dict[str, Any] = {
            name: getattr(self.regressor_, name, "auto") for name in ("trajectory", "time")
        }
        return read_signals(X, torque, self.robot, **keys)

    def _problem(self, X: Any, torque: Array, weight: Any = None) -> Problem:
        own = self._own(X)
        signals, torque = self._signals(X, torque)
        if hasattr(self, "recordings_") and named_recordings(self.effect_terms_):
            signals = recognise(signals, self.recordings_)
        problem = make_problem(
            signals,
            torque - own,
            robot=self.robot,
            rigid_body=False,
            terms=self.effect_terms_,
            subtract_urdf=False,
            weight=None if weight is None else np.asarray(weight, dtype=float),
        )
        s = problem.signals
        load = self.robot.inverse_dynamics(s.q, s.dq, s.ddq)
        problem.signals = s.with_(load=load, model_torque=own, smooth_torque=own)
        return problem


def is_physics(model: Any) -> bool:
    """Whether a model is refitted together with effects, rather than corrected by them."""
    takes_effects = hasattr(model, "with_effects") and hasattr(model, "effects")
    return takes_effects and not isinstance(model, CorrectedRegressor)


def weights_of_fit(regressor: Any, sample_weight: Any) -> dict[str, Any]:
    """Keyword of fit for weights of samples; those of a Pipeline are passed to its last step.

    With metadata routing, the Pipeline passes them to the steps that request them.
    """
    from sklearn._config import get_config
    from sklearn.pipeline import Pipeline

    name = "sample_weight"
    while isinstance(regressor, Pipeline) and not get_config()["enable_metadata_routing"]:
        step, regressor = regressor.steps[-1]
        name = f"{step}__{name}"
    return {} if sample_weight is None else {name: sample_weight}


#: Most folds on which copies of a model without physics are fitted again.
REFITS = 4


def refitted_errors(
    regressor: Any,
    robot: Robot,
    steps: Sequence[Sequence[Term]],
    X: Any,
    y: Any,
    sample_weight: Any = None,
) -> list[Array] | None:
    """Held-out error of copies of a regressor, fitted again with more and more effects.

    A model without physics is biased by the effects that it lacks, so an effect may reduce the
    residual of the fitted model by another amount than that of a refitted one.

    Parameters
    ----------
    regressor : regressor
        Predicts torque, N m or N.
    robot : Robot
        Robot.
    steps : sequence of sequence of Term
        Effects in addition to the regressor at every step.
    X : DataFrame or array of shape (n_samples, n_features)
        Motion, with time and trajectory.
    y : array-like of shape (n_samples, n_joints)
        Measured torque, N m or N.
    sample_weight : array-like of shape (n_samples,), default=None
        Weight of every sample in the fits; errors use equal weights.

    Returns
    -------
    list of ndarray of shape (n_joints,), N m or N, or None
        Root mean square at every step; None for a regressor that cannot be fitted again, and for a
        single trajectory, which cannot be held out.
    """
    from sklearn.model_selection import GroupKFold  # its import takes 0.2 s

    if not (hasattr(regressor, "fit") and hasattr(regressor, "get_params")):
        return None
    torque = np.asarray(y, dtype=float)
    torque = torque.reshape(len(torque), -1)
    keys: dict[str, Any] = {
        name: getattr(regressor, name, "auto") for name in ("trajectory", "time")
    }
    groups = read_signals(X, torque, robot, **keys)[0].trajectory
    n_folds = min(REFITS, len(np.unique(groups)))
    if n_folds < 2:
        return None
    total = [np.zeros(torque.shape[1]) for _ in steps]
    for train, test in GroupKFold(n_folds).split(torque, groups=groups):
        weight = None if sample_weight is None else _safe_indexing(sample_weight, train)
        own = clone(regressor)
        own.fit(_safe_indexing(X, train), _safe_indexing(y, train), **weights_of_fit(own, weight))
        for k, terms in enumerate(steps):
            model = CorrectedRegressor(own, robot, list(terms))
            model.fit_effects(_safe_indexing(X, train), torque[train], weight)
            predicted = model.predict(_safe_indexing(X, test)).reshape(len(test), -1)
            total[k] += np.sum((predicted - torque[test]) ** 2, axis=0)
    return [np.sqrt(t / len(torque)) for t in total]


@dataclass(frozen=True)
class Opened:
    """A model of a robot inside estimators of scikit-learn.

    Attributes
    ----------
    model : regressor
        The innermost model with effects, or the given regressor without the steps of a Pipeline
        that produce signals.
    X : table
        Input of the model.
    outer : tuple of Pipeline
        Pipelines around the model, the outermost first; the steps before the model are fitted.
    """

    model: Any
    X: Any
    outer: tuple[Pipeline, ...] = ()

    def closed(self, model: Any) -> Any:
        """Replace the model by a better, fitted one."""
        for pipeline in reversed(self.outer):
            model = _with_steps(pipeline, [*pipeline.steps[:-1], (pipeline.steps[-1][0], model)])
        return model


def _with_steps(pipeline: Pipeline, steps: list[tuple[str, Any]]) -> Pipeline:
    """A copy of a Pipeline with these fitted steps."""
    return pipeline.__class__(**{**pipeline.get_params(deep=False), "steps": steps})


def _fitted(step: Any, X: Any, y: Any) -> Any:
    """A fitted step itself, else a fitted copy.

    A step without a state counts as fitted before it knows the names of its columns.
    """
    try:
        check_is_fitted(step)
    except NotFittedError:
        return clone(step).fit(X, y)
    stateless = not get_tags(step).requires_fit and not hasattr(step, "n_features_in_")
    return clone(step).fit(X, y) if stateless else step


def open_model(model: Any, X: Any, y: Any) -> Opened:
    """Extract the rigid-body model from searches, pipelines and transformed targets.

    A Pipeline without such a model is opened after the steps that produce named signals: effects
    are functions of these, and not of the results of the learner's own steps.

    Parameters
    ----------
    model : estimator
        Fitted or not.
    X : table
        Motion.
    y : array
        Torque.

    Returns
    -------
    Opened
        The extracted model of the robot, or the given model if there is none.
    """
    if hasattr(model, "with_effects"):
        return Opened(model, X)
    # Their import takes longer than most operations with a model that is in none of them.
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.pipeline import Pipeline

    from skidyn._compat import BaseSearchCV

    inner, table, outer = model, X, []
    while True:
        if isinstance(inner, BaseSearchCV):
            inner = getattr(inner, "best_estimator_", inner.estimator)
        elif isinstance(inner, TransformedTargetRegressor):
            # A rigid body is identified from torque in N m, for any transformation of the target.
            inner = inner.regressor
        elif isinstance(inner, Pipeline):
            steps = []
            for name, step in inner.steps[:-1]:
                if step is not None and step != "passthrough":
                    step = _fitted(step, table, y)
                    table = step.transform(table)
                steps.append((name, step))
            outer.append(_with_steps(inner, [*steps, inner.steps[-1]]))
            inner = inner.steps[-1][1]
        else:
            break
    if hasattr(inner, "with_effects"):
        return Opened(inner, table, tuple(outer))
    return _behind_signals(model, X) if isinstance(model, Pipeline) else Opened(model, X)


def _behind_signals(pipeline: Pipeline, X: Any) -> Opened:
    """A Pipeline opened after the steps that produce named signals, such as derivatives."""
    n_before = 0
    for k, (_, step) in enumerate(pipeline.steps[:-1], 1):
        table = pipeline[k - 1 : k].transform(X) if getattr(step, "gives_signals", False) else None
        if table is None or column_names(table) is None:
            break
        X, n_before = table, k
    rest, name = pipeline[n_before:], pipeline.steps[-1][0]
    return Opened(rest, X, (_with_steps(pipeline, [*pipeline.steps[:n_before], (name, rest)]),))
