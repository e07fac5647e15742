# SPDX-License-Identifier: BSD-3-Clause
"""Bagged LSTM networks, stacked by a meta-regressor (BLL)."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral
from typing import Any, ClassVar

import numpy as np
from joblib import parallel_config
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.ensemble import BaggingRegressor
from sklearn.linear_model import Ridge
from sklearn.model_selection import check_cv
from sklearn.multioutput import MultiOutputRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils import check_random_state
from sklearn.utils.validation import (
    _check_sample_weight,
    check_is_fitted,
    has_fit_parameter,
)
from skorch import NeuralNet

from skidyn._columns import ColumnSpec
from skidyn._compat import HasMethods, Interval, StrOptions, fit_context
from skidyn._keys import Keys, fitted_keys
from skidyn._order import folds_taken, taken, time_order
from skidyn._signals import Array
from skidyn._validation import validate_motion
from skidyn.model_selection import held_out_folds, order_of_log
from skidyn.neural_network._base import SequenceRegressor, deferred_training, train_together
from skidyn.neural_network._lstm import LSTMRegressor, directions
from skidyn.neural_network._skorch_member import SkorchMember
from skidyn.preprocessing import without_keys_inside

#: Number of folds of the trajectories; each member leaves out one of them.
FOLDS = 20
#: Number of folds of the stacking if members are trained again for it.
BLOCKS = 3
#: Number of folds, and strengths from which the default meta-regressor's is chosen.
FOLDS_OF_HEAD, ALPHAS = 5, (1.0, 1e2, 1e4, 1e6)


class BLLRegressor(MetaEstimatorMixin, MultiOutputMixin, RegressorMixin, BaseEstimator):
    """Bagged LSTM networks, stacked by a meta-regressor (BLL).

    Members are trained on bootstraps of the log; their mean is the input of a meta-regressor,
    which is trained on predictions for trajectories that were not used to train the averaged
    members. (The paper [1]_ trains it on the rows for which it reports errors;
    :ref:`papers_own_forms` lists all differences.)

    To learn the residual of a physical model, use it in :class:`skidyn.hybrid.HybridRegressor`:
    ``HybridRegressor(physics, BLLRegressor())``.

    Without a physical model it is useful only if no model of the robot exists: with a URDF, a
    rigid-body model with friction predicts far better on most logs (:doc:`/user_guide/learners`).

    Parameters
    ----------
    estimator : estimator, default=None
        Member: a network of this package, any scikit-learn regressor or a skorch
        ``NeuralNetRegressor``, also inside a ``Pipeline``; :class:`LSTMRegressor` if None. Its key
        columns are set from those given here; a member without such parameters does not get the key
        columns. If the member has ``per_joint=True``, each output has its own networks.
    final_estimator : estimator, default=None
        Meta-regressor. If None, a ridge regression that shrinks towards the members' mean, with the
        strength that predicts left-out trajectories best, or the mean itself if that is better. A
        regressor of a single output is fitted once for each output.
    n_estimators : int, default=10
        Members.
    resample : {"window", "trajectory"}, default="window"
        Draw single target rows or whole trajectories with replacement. Rows that are not drawn
        still serve as history. Whole trajectories give a more realistic spread, but every member
        then misses a third of them, which reduces accuracy.
    cv : int, cross-validator or None, default=None
        How the meta-regressor's inputs are predicted on rows that were not used for training. With
        None, they are the mean over the members that were trained without the trajectory, which
        needs no further training: with ``resample="trajectory"`` the members whose bootstrap left
        it out; with ``"window"`` every member leaves out one of twenty folds of the trajectories.
        With a number (or a cross-validator) the members are trained again without each fold; so
        they are with None if there are fewer than three trajectories or the members are not
        networks of this package (3 folds, by trajectory or, for a single one, by blocks of rows).
    n_jobs : int, default=None
        Number of processes. Each trains ten networks side by side, since most of the time of a
        small network's step is overhead that they can share; more processes therefore help only
        with more than ten members. Members with callbacks, an optimiser of their own or ``verbose``
        are trained one by one, with the same result without dropout, and another random draw of
        the dropped units with it.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.
    random_state : int, RandomState or None, default=None
        Seed of members, bootstraps and the meta-regressor; the result does not depend on `n_jobs`.

    Attributes
    ----------
    bagging_ : BaggingRegressor
        The members, in ``bagging_.estimators_``.
    final_estimator_ : estimator
        The meta-regressor.
    n_stacked_ : int
        Number of rows on which the meta-regressor was trained: those with a prediction by members
        that were trained without them.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    References
    ----------
    .. [1] Y. Tao et al., "Robot hybrid inverse dynamics model compensation method based on the BLL
       residual prediction algorithm", Robotica 43, 2025, doi:10.1017/S0263574724001905.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.neural_network import BLLRegressor, LSTMRegressor
    >>> X = np.c_[np.repeat(np.arange(4), 50), np.random.default_rng(0).normal(size=(200, 2))]
    >>> member = LSTMRegressor(window=4, hidden_size=8, max_epochs=5)
    >>> bll = BLLRegressor(member, n_estimators=3, trajectory=0, random_state=0)
    >>> torque, spread = bll.fit(X, X[:, 1:]).predict(X, return_std=True)
    >>> torque.shape, spread.shape
    ((200, 2), (200, 2))
    """

    __metadata_request__fit = {"sample_weight": True, "groups": True}
    __metadata_request__score = {"sample_weight": True}

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "estimator": [HasMethods(["fit", "predict"]), None],
        "final_estimator": [HasMethods(["fit", "predict"]), None],
        "n_estimators": [Interval(Integral, 1, None, closed="left")],
        "resample": [StrOptions({"trajectory", "window"})],
        "cv": [
            Interval(Integral, 2, None, closed="left"),
            HasMethods(["split"]),
            Iterable,
            None,
        ],
        "n_jobs": [Integral, None],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
        "random_state": ["random_state"],
    }

    def __init__(
        self,
        estimator: Any = None,
        final_estimator: Any = None,
        *,
        n_estimators: int = 10,
        resample: str = "window",
        cv: Any = None,
        n_jobs: int | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
        random_state: Any = None,
    ) -> None:
        self.estimator = estimator
        self.final_estimator = final_estimator
        self.n_estimators = n_estimators
        self.resample = resample
        self.cv = cv
        self.n_jobs = n_jobs
        self.trajectory = trajectory
        self.time = time
        self.random_state = random_state

    @classmethod
    def from_table_iii(cls, **parameters: Any) -> BLLRegressor:
        """Make the BLL of the paper's table III.

        One LSTM with 32 cells per joint, learning rate 0.01, 130 epochs, batches of 32, window
        bootstrap, and a meta-network with layers of 100, 50 and 25 rectifiers, trained in the same
        way. The paper gives neither the number of members (10 here) nor the window (10 rows here).

        Parameters
        ----------
        **parameters : dict
            Further parameters; they override those of the paper.

        Returns
        -------
        bll : BLLRegressor

        Examples
        --------
        >>> from skidyn.neural_network import BLLRegressor
        >>> BLLRegressor.from_table_iii(n_estimators=5).estimator.max_epochs
        130
        """
        member = LSTMRegressor(
            window=10,
            stride=8,
            hidden_size=32,
            learning_rate=0.01,
            optimizer__weight_decay=0.0,
            optimizer__betas=(0.9, 0.999),
            max_epochs=130,
            batch_size=32,
            per_joint=True,
            linear=False,
            direction=None,
        )
        network = MLPRegressor(
            hidden_layer_sizes=(100, 50, 25), learning_rate_init=0.01, batch_size=32, max_iter=130
        )
        head = TransformedTargetRegressor(
            make_pipeline(StandardScaler(), network), transformer=StandardScaler()
        )
        defaults = {"estimator": member, "final_estimator": head, "resample": "window"}
        return cls(**(defaults | parameters))

    @fit_context(prefer_skip_nested_validation=False)
    def fit(self, X: Any, y: Any, sample_weight: Any = None, groups: Any = None) -> BLLRegressor:
        """Train the members and the meta-regressor.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with key columns; rows of a trajectory in order of time.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Torque, or the residual of a physical model.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row: members draw rows in proportion to their weights.
        groups : array-like of shape (n_samples,), default=None
            Groups of the rows for a `cv` that splits by groups, such as ``GroupKFold``.

        Returns
        -------
        self : object
            The fitted regressor.
        """
        table = X
        X, y = validate_motion(self, X, y, multi_output=True, y_numeric=True, dtype=np.float64)
        if sample_weight is not None:
            sample_weight = _check_sample_weight(sample_weight, X, dtype=np.float64)
        keys = fitted_keys(self)
        folds = self._given_folds(table, y, groups)
        order = order_of_log(self, X, keys)
        if order is not None:
            folds = folds_taken(folds, order)
            X, y, sample_weight = (taken(t, order) for t in (X, y, sample_weight))
        rng = check_random_state(self.random_state)
        bagging = self._bagging(keys, sample_weight is not None, int(rng.randint(2**31 - 1)))
        trajectories = keys.trajectories(X)
        X = keys.for_learner(X, bagging.estimator)
        leave_out = self.cv is None and len(np.unique(trajectories)) > 2
        self.bagging_, unseen = self._train(bagging, X, y, sample_weight, trajectories, leave_out)
        if unseen is not None:
            inputs = _unseen_means(self.bagging_, X, unseen)
        else:
            inputs = np.full((len(X), y[:1].size), np.nan)
            for train, test in folds or self._folds(trajectories):
                part = None if sample_weight is None else sample_weight[train]
                again, _ = self._train(
                    bagging, X[train], y[train], part, trajectories[train], False
                )
                inputs[test] = _member_mean(again, X[test])
        honest = np.isfinite(inputs).all(axis=1)
        if not honest.any():  # too few rows to hold any out: stack all of them
            inputs, honest = _member_mean(self.bagging_, X), np.ones(len(X), dtype=bool)
        self.n_stacked_ = int(honest.sum())
        weight = None if sample_weight is None else sample_weight[honest]
        if self.final_estimator is None:
            own = inputs[honest], y[honest], weight, trajectories[honest]
            self.final_estimator_ = _ridge_towards_mean(*own)
            return self
        head = clone(self.final_estimator)
        seeded = [n for n in sorted(head.get_params()) if n.split("__")[-1] == "random_state"]
        head.set_params(**{name: int(rng.randint(2**31 - 1)) for name in seeded})
        self.final_estimator_ = _fit_head(head, inputs[honest], y[honest], weight)
        return self

    def _train(
        self,
        bagging: BaggingRegressor,
        X: Array,
        y: Array,
        weight: Array | None,
        trajectories: NDArray[Any],
        leave_out: bool,
    ) -> tuple[BaggingRegressor, NDArray[np.bool_] | None]:
        """Fitted members, and the rows that each has not seen (None if unknown)."""
        fitted = clone(bagging)
        if not isinstance(fitted.estimator, SequenceRegressor):
            return _fit(fitted, X, y, weight), None
        # the bagging only draws and seeds, in this process regardless of the joblib backend
        with parallel_config("sequential"), deferred_training() as pending:
            _fit(fitted, X, y, weight)
        unseen = None
        if leave_out:
            if self.resample == "window":
                folds = held_out_folds(trajectories, FOLDS)
                for k, fit in enumerate(pending):
                    fit.leave_out(folds[k % len(folds)][1])
            unseen = np.array([fit.unseen(trajectories) for fit in pending])
        train_together(pending, self.n_jobs)
        return fitted, unseen

    def _bagging(self, keys: Keys, weighted: bool, seed: int) -> BaggingRegressor:
        member = LSTMRegressor() if self.estimator is None else clone(self.estimator)
        member = _with_skorch_members(member)
        names = member.get_params()
        # BaggingRegressor passes arrays to the members, so the keys are given by position
        position = {"trajectory": keys.trajectory, "time": keys.time}
        wanted = {name: name.rpartition("__")[2] for name in names}
        member.set_params(**{n: position[key] for n, key in wanted.items() if key in position})
        for name, last in wanted.items():
            if last == "direction" and isinstance(names[name], str):
                given = getattr(self, "feature_names_in_", None)
                member.set_params(**{name: directions("auto", given, self.n_features_in_)})
        member = without_keys_inside(member, keys)
        if self.resample == "trajectory":
            if "resample" not in names:
                raise ValueError(
                    f"{type(member).__name__} has no parameter 'resample', which draws "
                    "trajectories; use resample='window'."
                )
            member.set_params(resample="trajectory")
        return BaggingRegressor(
            member,
            n_estimators=self.n_estimators,
            # scikit-learn's bagging honours weights by drawing rows in proportion to them
            bootstrap=weighted or self.resample == "window",
            n_jobs=self.n_jobs,  # for members that are not trained side by side
            random_state=seed,
        )

    def _given_folds(self, table: Any, y: Array, groups: Any) -> list[Any]:
        """Folds of a cross-validator or list; none where `cv` is a number."""
        if self.cv is None or isinstance(self.cv, Integral):
            return []
        return list(check_cv(self.cv).split(table, y, groups))

    def _folds(self, trajectories: NDArray[Any]) -> Iterable[Any]:
        member = LSTMRegressor() if self.estimator is None else self.estimator
        guard = int(getattr(member, "window", 0))
        return held_out_folds(trajectories, int(self.cv or BLOCKS), guard=guard)

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Predict the torque of every row.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.
        return_std : bool, default=False
            Return the spread of the members as well.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Predicted torque.
        std : ndarray of the same shape, N m (N if prismatic)
            Standard deviation over the members; only with ``return_std=True``.
        """
        check_is_fitted(self)
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        keys = fitted_keys(self)
        order = time_order(X, keys)
        X = keys.for_learner(X if order is None else X[order], self.bagging_.estimator_)
        members = np.stack([member.predict(X) for member in self.bagging_.estimators_])
        if order is not None:
            members = members[:, np.argsort(order)]
        mean = members.mean(axis=0)
        torque = self.final_estimator_.predict(mean.reshape(len(X), -1)).reshape(mean.shape)
        return (torque, members.std(axis=0)) if return_std else torque


def _fit_head(head: Any, X: Array, y: Array, weight: Array | None) -> Any:
    """Fitted meta-regressor, once for each output if it supports only one.

    Its tags are no guide: those of MLPRegressor deny several outputs although it supports them.
    """
    try:
        return _fit(head, X, y, weight)
    except ValueError:
        if y.ndim == 1:
            raise
        return _fit(MultiOutputRegressor(clone(head)), X, y, weight)


def _ridge_towards_mean(
    X: Array, y: Array, weight: Array | None, trajectories: NDArray[Any]
) -> Ridge:
    """Ridge correction of the members' mean, if it predicts left-out trajectories better.

    Rows of a trajectory are similar, and the mean over the few members that have not seen a row is
    less accurate than that over all members. Leaving out single rows would therefore overrate such
    a correction.
    """
    missing = y.reshape(len(y), -1) - X
    size, spread = X.std(axis=0), y.reshape(len(y), -1).std(axis=0)
    size[size == 0], spread[spread == 0] = 1.0, 1.0
    scaled, folds = X / size, list(held_out_folds(trajectories, FOLDS_OF_HEAD))
    best, least = Ridge(), np.average((missing / spread) ** 2, axis=0, weights=weight).mean()
    correction, offset = np.zeros((X.shape[1], X.shape[1])), np.zeros(X.shape[1])
    for alpha in ALPHAS:
        left = missing.copy()
        for train, test in folds:
            own = None if weight is None else weight[train]
            head = Ridge(alpha=alpha).fit(scaled[train], missing[train], own)
            left[test] -= head.predict(scaled[test]).reshape(len(test), -1)
        error = np.average((left / spread) ** 2, axis=0, weights=weight).mean()
        if error < least:
            best, least = Ridge(alpha=alpha), error
            found = clone(best).fit(scaled, missing, weight)
            correction, offset = np.atleast_2d(found.coef_) / size, found.intercept_
    best.fit(X, X)  # sets the fitted attributes other than the coefficients
    best.coef_, best.intercept_ = np.eye(X.shape[1]) + correction, offset
    return best


def _with_skorch_members(member: Any) -> Any:
    """Member whose skorch nets, alone or as a part, accept tables in double precision."""
    if isinstance(member, NeuralNet):
        return SkorchMember(member)
    nets = {k: v for k, v in member.get_params().items() if isinstance(v, NeuralNet)}
    return member.set_params(**{name: SkorchMember(net) for name, net in nets.items()})


def _fit(estimator: Any, X: Any, y: Any, sample_weight: Array | None) -> Any:
    if sample_weight is None:
        return estimator.fit(X, y)
    inner = estimator.estimator if isinstance(estimator, MultiOutputRegressor) else estimator
    if not has_fit_parameter(inner, "sample_weight"):
        raise ValueError(f"{type(inner).__name__} does not accept sample_weight; fit without it.")
    return estimator.fit(X, y, sample_weight=sample_weight)


def _member_mean(bagging: BaggingRegressor, X: Array) -> Array:
    members = [member.predict(X).reshape(len(X), -1) for member in bagging.estimators_]
    mean: Array = np.mean(members, axis=0)
    return mean


def _unseen_means(bagging: BaggingRegressor, X: Array, unseen: NDArray[np.bool_]) -> Array:
    """Mean over the members that have not seen a row; nan if every member has seen it."""
    total: Any = 0.0
    for member, rows in zip(bagging.estimators_, unseen[..., None], strict=True):
        total = total + np.where(rows, member.predict(X).reshape(len(X), -1), 0.0)
    count = unseen.sum(axis=0)[:, None]
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
