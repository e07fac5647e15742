# SPDX-License-Identifier: BSD-3-Clause
"""Private and experimental names of scikit-learn, which only this module uses.

scikit-learn validates parameters through names that are private, and its progress callbacks (new
in 1.9) may change without deprecation. All that skidyn needs of both is collected here, so that
only one module has to be adapted to a new release.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sklearn.base import _fit_context as fit_context
from sklearn.model_selection._search import BaseSearchCV as BaseSearchCV
from sklearn.utils._param_validation import HasMethods, Interval, StrOptions

try:
    from sklearn.callback import CallbackSupportMixin
except ImportError:  # scikit-learn 1.8 has no callbacks

    class CallbackSupportMixin:  # type: ignore[no-redef]
        """Stand-in that supports no callbacks."""


__all__ = [
    "CallbackSupportMixin",
    "FitProgress",
    "HasMethods",
    "Interval",
    "StrOptions",
    "fit_context",
    "fit_progress",
]


class FitProgress:
    """Report the progress of a fit to scikit-learn's callbacks, for example a progress bar.

    The context is None if scikit-learn has no callbacks; ``task_name`` tells what a step is.
    """

    def __init__(self, estimator: Any, context: Any, task_name: str = "epoch") -> None:
        self._estimator = estimator
        self._context = context
        self._task_name = task_name
        self._step: Any = None

    def begin_step(self) -> None:
        """Report the beginning of a step."""
        if self._context is not None:
            self._step = self._context.subcontext(task_name=self._task_name)
            self._step.call_on_fit_task_begin(estimator=self._estimator)

    def end_step(self) -> bool:
        """Report the end of a step; True if a callback requests to stop the fit."""
        if self._step is None:
            return False
        return bool(self._step.call_on_fit_task_end(estimator=self._estimator))


@contextmanager
def fit_progress(
    estimator: Any, n_steps: int, X: Any, y: Any, task_name: str = "epoch"
) -> Iterator[FitProgress]:
    """Progress of one fit; ``fit`` must be decorated with :func:`fit_context`.

    The estimator derives from ``CallbackSupportMixin``; X and y are passed to the callbacks, and
    the methods of the result mark the steps.
    """
    if not hasattr(estimator, "_init_callback_context"):
        yield FitProgress(estimator, None)
        return
    context = estimator._init_callback_context(max_subtasks=n_steps)
    context.call_on_fit_task_begin(estimator=estimator, X=X, y=y)
    yield FitProgress(estimator, context, task_name)
    context.call_on_fit_task_end(estimator=estimator, X=X, y=y)
