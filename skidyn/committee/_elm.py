# SPDX-License-Identifier: BSD-3-Clause
"""Committee of networks with a fixed random hidden layer."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.utils import check_random_state
from sklearn.utils.parallel import Parallel, delayed
from sklearn.utils.validation import _check_sample_weight, check_is_fitted
from threadpoolctl import threadpool_limits

from skidyn._columns import ColumnSpec
from skidyn._compat import Interval, StrOptions, fit_context
from skidyn._keys import fitted_keys
from skidyn._validation import validate_motion
from skidyn.preprocessing import scaling_of

Array = NDArray[Any]

#: Number of rows whose hidden activations are stored at once.
CHUNK = 2048
#: Above this p the ridge is too weak for the rounding of single precision.
LARGEST_SINGLE_PRECISION_P = 0.99


class ELMCommittee(MultiOutputMixin, RegressorMixin, BaseEstimator):
    r"""Committee of extreme learning machines, learned exactly in one pass or online.

    Each member has a fixed random hidden layer of rectifiers; only the linear output layer is
    learned, by ridge regression on the hidden activations. The fit only needs the second moments of
    the data, so ``partial_fit`` on parts of a log gives the same result as ``fit`` on the whole
    log, with the same scaling of the inputs (up to rounding: sums are in single precision up to p =
    0.99).

    Use it without physics only if no model of the robot exists: with a URDF, a rigid-body model
    with friction predicts far better, and boosted trees may also be better
    (:doc:`/user_guide/learners`).

    Parameters
    ----------
    n_estimators : int, default=10
        Number of members.
    n_hidden : int, default=500
        Hidden units of each member.
    p : float in (0, 1], default=0.5
        Strength of the data against the prior: the ridge is ``(1 - p) / p`` on the covariance of
        the activations.
    fit_intercept : bool, default=True
        Subtract the means of activations and torque, which the ridge then does not shrink. False
        uses second moments about zero, as eq. 4 of [1]_.
    scaling : {"standard", "minmax", None}, default="standard"
        Scaling of the inputs before the random layer, fixed by the first call of ``fit`` or
        ``partial_fit``; None for no scaling.
    n_jobs : int, default=None
        Members computed at the same time (threads).
    trajectory, time : int, str or None, default="auto"
        Key columns of X, which are not features.
    random_state : int, RandomState or None, default=None
        Seed of the hidden layers.

    Attributes
    ----------
    hidden_weights_ : ndarray of shape (n_estimators, n_inputs, n_hidden)
        Weights of the hidden layers, uniform in (-1, 1).
    hidden_bias_ : ndarray of shape (n_estimators, n_hidden)
        Weights of the constant input 1.
    coef_ : ndarray of shape (n_estimators, n_hidden, n_outputs), N m (N if prismatic)
        Weights of the output layers.
    intercept_ : ndarray of shape (n_estimators, n_outputs), N m (N if prismatic)
        Mean torque minus the output for the mean activations; zero without `fit_intercept`.
    n_samples_seen_ : float
        Number of rows seen, or sum of their weights.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    Notes
    -----
    With the hidden activations :math:`h` and the torque :math:`\tau` each member's output layer is

    .. math::

        W = (\operatorname{cov}(h, h) + \tfrac{1 - p}{p} I)^{-1} \operatorname{cov}(h, \tau).

    Eq. 4 of [1]_ has means of products in place of covariances, and contains :math:`E[\tau
    \tau^T]`, although only :math:`E[h \tau^T]` has the dimensions of the output layer. Its form is
    ``ELMCommittee(fit_intercept=False, scaling=None)`` (:ref:`papers_own_forms`).

    References
    ----------
    .. [1] V. Bargsten, J. de Gea Fernandez, Y. Kassahun, "Experimental Robot Inverse Dynamics
       Identification Using Classical and Machine Learning Techniques", eq. 4.
    .. [2] G.-B. Huang, Q.-Y. Zhu, C.-K. Siew, "Extreme learning machine: Theory and applications",
       Neurocomputing 70, 2006.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.committee import ELMCommittee
    >>> X = np.random.default_rng(0).uniform(-1, 1, size=(500, 2))
    >>> y = np.sin(3 * X[:, 0]) + X[:, 1] ** 2
    >>> committee = ELMCommittee(p=0.99, random_state=0).fit(X, y)
    >>> bool(committee.score(X, y) > 0.95)
    True
    >>> torque, spread = committee.predict(X[:3] + 10, return_std=True)
    >>> bool((spread > committee.predict(X[:3], return_std=True)[1]).all())
    True
    """

    __metadata_request__fit = {"sample_weight": True}
    __metadata_request__score = {"sample_weight": True}

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        "n_estimators": [Interval(Integral, 1, None, closed="left")],
        "n_hidden": [Interval(Integral, 1, None, closed="left")],
        "p": [Interval(Real, 0, 1, closed="right")],
        "fit_intercept": ["boolean"],
        "scaling": [StrOptions({"standard", "minmax"}), None],
        "n_jobs": [Integral, None],
        "trajectory": [str, Integral, None],
        "time": [str, Integral, None],
        "random_state": ["random_state"],
    }

    def __init__(
        self,
        n_estimators: int = 10,
        *,
        n_hidden: int = 500,
        p: float = 0.5,
        fit_intercept: bool = True,
        scaling: str | None = "standard",
        n_jobs: int | None = None,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
        random_state: Any = None,
    ) -> None:
        self.n_estimators = n_estimators
        self.n_hidden = n_hidden
        self.p = p
        self.fit_intercept = fit_intercept
        self.scaling = scaling
        self.n_jobs = n_jobs
        self.trajectory = trajectory
        self.time = time
        self.random_state = random_state

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: Any, y: Any, sample_weight: Any = None) -> ELMCommittee:
        """Fit to a log, discarding previous data.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with or without key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Torque.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row.

        Returns
        -------
        self : object
            The fitted committee.
        """
        return self._learn(X, y, sample_weight, first=True)

    @fit_context(prefer_skip_nested_validation=True)
    def partial_fit(self, X: Any, y: Any, sample_weight: Any = None) -> ELMCommittee:
        """Fit to further rows, keeping previous data.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Features, with or without key columns.
        y : array-like of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Torque.
        sample_weight : array-like of shape (n_samples,), default=None
            Weight of each row.

        Returns
        -------
        self : object
            The fitted committee.
        """
        return self._learn(X, y, sample_weight, first=not hasattr(self, "coef_"))

    def _learn(self, X: Any, y: Any, sample_weight: Any, first: bool) -> ELMCommittee:
        X, y = validate_motion(
            self, X, y, reset=first, multi_output=True, y_numeric=True, dtype=np.float64
        )
        weight = _check_sample_weight(sample_weight, X, dtype=np.float64)
        if not (weight > 0).any():
            raise ValueError("all sample weights are zero; at least one must be positive.")
        inputs = X[:, list(fitted_keys(self).features)]
        targets = y.reshape(len(y), -1)
        if first:
            self._start(inputs, targets, y.ndim == 1, weight)
        elif targets.shape[1] != self.coef_.shape[2]:
            raise ValueError(
                f"y has {targets.shape[1]} outputs; the rows learned before had "
                f"{self.coef_.shape[2]}."
            )
        scaled = self._scaled(inputs)
        self.n_samples_seen_ += float(weight.sum())
        # The division of a product among threads changes its rounding, in single precision by more
        # than the ridge tolerates; members share the cores instead.
        with threadpool_limits(1, user_api="blas"):
            Parallel(n_jobs=self.n_jobs, prefer="threads")(
                delayed(self._learn_member)(k, scaled, targets, weight)
                for k in range(len(self.hidden_bias_))
            )
        return self

    def _start(self, inputs: Array, targets: Array, one_dimensional: bool, weight: Array) -> None:
        rng = check_random_state(self.random_state)
        n_inputs, members, size = inputs.shape[1], self.n_estimators, self.n_hidden
        n_outputs = targets.shape[1]
        if self.scaling is None:
            self._offset, self._scale = np.zeros(n_inputs), np.ones(n_inputs)
        else:
            self._offset, self._scale = scaling_of(inputs[weight > 0], self.scaling)
        self.hidden_weights_ = rng.uniform(-1, 1, size=(members, n_inputs, size))
        self.hidden_bias_ = rng.uniform(-1, 1, size=(members, size))
        self.coef_ = np.zeros((members, size, n_outputs))
        self.intercept_ = np.zeros((members, n_outputs))
        self.n_samples_seen_ = 0.0
        self._one_dimensional = one_dimensional
        # near the targets' mean, so that a large offset does not reduce the precision
        self._origin = np.average(targets, axis=0, weights=weight)
        # weighted sums of products of [h, 1, t] over all rows seen; h: activations, t: targets
        self._moments = np.zeros((members, *2 * (size + 1 + n_outputs,)))

    def _learn_member(self, k: int, scaled: Array, targets: Array, weight: Array) -> None:
        """Add the moments of new rows, then solve for the output layer."""
        size = self.n_hidden
        weights = self._layer(k, scaled.dtype)
        table = np.empty((min(CHUNK, len(scaled)), len(self._moments[k])), dtype=scaled.dtype)
        weighted = (weight != 1).any()
        for i in range(0, len(scaled), CHUNK):
            rows = slice(i, i + CHUNK)
            part = table[: len(scaled[rows])]
            np.maximum(scaled[rows] @ weights, 0, out=part[:, :size])
            part[:, size] = 1
            part[:, size + 1 :] = targets[rows] - self._origin
            if weighted:
                part *= np.sqrt(weight[rows, None])
            self._moments[k] += part.T @ part
        n = self.n_samples_seen_
        moments = self._moments[k] / n
        h_mean, t_mean = moments[:size, size], moments[size, size + 1 :]
        second, cross = moments[:size, :size], moments[:size, size + 1 :]
        if self.fit_intercept:
            second, cross = second - np.outer(h_mean, h_mean), cross - np.outer(h_mean, t_mean)
        else:
            cross = cross + np.outer(h_mean, self._origin)
        # the share of the trace is only needed for the factorisation if p = 1
        ridge = (1 - self.p) / self.p + 1e-10 * np.trace(second)
        second[np.diag_indices_from(second)] += max(ridge, np.finfo(float).tiny)
        self.coef_[k] = linalg.solve(second, cross, assume_a="pos")
        if self.fit_intercept:
            self.intercept_[k] = self._origin + t_mean - h_mean @ self.coef_[k]

    def predict(self, X: Any, return_std: bool = False) -> Any:
        """Predict the torque as the mean of the members.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            As in fit.
        return_std : bool, default=False
            Return the spread of the members as well: small where the data determines them.

        Returns
        -------
        y : ndarray of shape (n_samples,) or (n_samples, n_outputs), N m (N if prismatic)
            Predicted torque.
        std : ndarray of the same shape, N m (N if prismatic)
            Standard deviation over the members; only with ``return_std=True``.
        """
        check_is_fitted(self)
        X = validate_motion(self, X, reset=False, dtype=np.float64)
        scaled = self._scaled(X[:, list(fitted_keys(self).features)])
        members = np.stack(
            Parallel(n_jobs=self.n_jobs, prefer="threads")(
                delayed(self._predict_member)(k, scaled) for k in range(len(self.hidden_bias_))
            )
        )
        if self._one_dimensional:
            members = members[..., 0]
        return (members.mean(axis=0), members.std(axis=0)) if return_std else members.mean(axis=0)

    def _predict_member(self, k: int, scaled: Array) -> Array:
        coef, weights = self.coef_[k].astype(scaled.dtype), self._layer(k, scaled.dtype)
        parts = [
            np.maximum(scaled[i : i + CHUNK] @ weights, 0) @ coef
            for i in range(0, len(scaled), CHUNK)
        ]
        output: Array = np.concatenate(parts).astype(np.float64) + self.intercept_[k]
        return output

    def _layer(self, k: int, dtype: Any) -> Array:
        """Weights of the hidden layer: of the scaled inputs and, last, of the constant."""
        weights: Array = np.vstack([self.hidden_weights_[k], self.hidden_bias_[k]]).astype(dtype)
        return weights

    def _scaled(self, inputs: Array) -> Array:
        """Scaled inputs and, last, a constant."""
        dtype = np.float32 if self.p <= LARGEST_SINGLE_PRECISION_P else np.float64
        scaled = (inputs - self._offset) / self._scale
        with_constant: Array = np.c_[scaled, np.ones(len(scaled))].astype(dtype)
        return with_constant
