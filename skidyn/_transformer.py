# SPDX-License-Identifier: BSD-3-Clause
"""Base of the transformers of logs, which keep the number of rows."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import _check_feature_names_in, check_is_fitted, validate_data

from skidyn._compat import fit_context

Array = NDArray[np.float64]


class LogTransformer(TransformerMixin, BaseEstimator):
    """Base of transformers of logs, which validates tables and names.

    A transformer defines its fit to a log (``_learn``), its result (``_changed``) and the names of
    the resulting columns (``_renamed``, unchanged by default).
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {}

    @fit_context(prefer_skip_nested_validation=True)
    def fit(self, X: Any, y: Any = None) -> Self:
        """Fit the transformer to a log.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Log, with the units of the class.
        y : None
            Ignored.

        Returns
        -------
        self : object
            The fitted transformer.
        """
        self._learn(validate_data(self, self._table(X), dtype=np.float64))
        return self

    def transform(self, X: Any) -> Array:
        """Transform a log.

        Parameters
        ----------
        X : DataFrame or array-like of shape (n_samples, n_features)
            Log with the columns of that in fit.

        Returns
        -------
        X_new : ndarray of shape (n_samples, n_features_out)
            The same number of rows, with the columns of :meth:`get_feature_names_out`.
        """
        check_is_fitted(self)
        return self._changed(validate_data(self, self._table(X), reset=False, dtype=np.float64))

    def get_feature_names_out(self, input_features: Any = None) -> NDArray[Any]:
        """Names of the columns that :meth:`transform` returns.

        Parameters
        ----------
        input_features : array-like of str, default=None
            Names of the columns of X; those seen in fit if None.

        Returns
        -------
        names : ndarray of str
            One for each column.
        """
        check_is_fitted(self)
        names = _check_feature_names_in(self, input_features)
        return np.asarray(self._renamed(names), dtype=object)

    def _table(self, X: Any) -> Any:
        """The columns that are read."""
        return X

    def _learn(self, X: Array) -> None:
        """Set fitted attributes."""
        raise NotImplementedError

    def _changed(self, X: Array) -> Array:
        """The new log."""
        raise NotImplementedError

    def _renamed(self, names: NDArray[Any]) -> Any:
        """Names of its columns."""
        return names

    def _names(self) -> list[str] | None:
        """Names of the columns in fit, if there were any."""
        names = getattr(self, "feature_names_in_", None)
        return None if names is None else [str(name) for name in names]
