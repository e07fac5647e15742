# SPDX-License-Identifier: BSD-3-Clause
"""Friction as features for any scikit-learn regressor."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidyn._columns import Columns, ColumnSpec, _key_column, resolve_columns
from skidyn._exceptions import ColumnError, EffectError
from skidyn._keys import Keys, resolve_keys
from skidyn._order import refuse_shuffled
from skidyn._signals import Array, signals_from
from skidyn._transformer import LogTransformer
from skidyn._validation import motion_of
from skidyn.effects._catalogue import make_terms
from skidyn.effects._term import Term


class FrictionTransformer(LogTransformer):
    """Append the columns of friction and other joint effects to X.

    X is motion, following the X contract. The new columns, one for each coefficient of each effect,
    are called ``<kind>_<coefficient>_<joint>``, joints from 1. States of hysteresis are reset in
    each trajectory.

    Parameters
    ----------
    effects : sequence of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects that act on single joints and depend on the motion only. Those with shape parameters
        are given as :class:`~skidyn.effects.Term`.
    n_joints : int, default=None
        Number of joints; from the columns if None. All joints are assumed to be revolute.
    trajectory, time : int, str or None, default="auto"
        Key columns, passed on unchanged.

    Attributes
    ----------
    terms_ : list of Term
        Effects per joint, in the order of the appended columns.
    columns_ : Columns
        Meaning of the columns of X.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.

    See Also
    --------
    skidyn.identification.RBDRegressor : Rigid body and effects identified together.

    Examples
    --------
    >>> import numpy as np
    >>> X = np.array([[0.1, 2.0, 0.0], [0.2, -2.0, 0.0]])
    >>> FrictionTransformer().fit_transform(X)[:, 3:].tolist()
    [[2.0, 1.0], [-2.0, -1.0]]
    """

    def __init__(
        self,
        effects: Iterable[Any] = ("viscous", "coulomb"),
        n_joints: int | None = None,
        *,
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
    ) -> None:
        self.effects = effects
        self.n_joints = n_joints
        self.trajectory = trajectory
        self.time = time

    def _table(self, X: Any) -> Any:
        return motion_of(self, X)

    def _learn(self, X: Array) -> None:
        self.columns_ = self._resolve(X.shape[1])
        self.terms_ = make_terms(self.effects, self.columns_.n_joints)
        for term in self.terms_:
            _refuse(term, self.columns_)

    def _changed(self, X: Array) -> Array:
        signals = signals_from(X, self.columns_, to_derive=self.columns_.ddq is None)
        if not all(term.is_pointwise for term in self.terms_):
            refuse_shuffled("An effect with a memory", signals.trajectory, signals.time)
        blocks = [t.torque_columns(signals)[t.places[0]] for t in self.terms_]
        return np.hstack([X, *blocks])

    def _renamed(self, names: NDArray[Any]) -> list[str]:
        named = [*names]
        for i, term in enumerate(self.terms_):
            own = [f"{term.kind}_{c.name}_{term.joints[0]}" for c in term.coefficients]
            # Two terms of one kind on a joint differ only in their shape parameters.
            named += [f"{name}_{i}" if name in named else name for name in own]
        return named

    def _resolve(self, n_features: int) -> Columns:
        given = getattr(self, "feature_names_in_", None)
        names = None if given is None else [str(name) for name in given]
        joints = self._joints(names, n_features)
        keys = resolve_keys(names, n_features, trajectory=self.trajectory, time=self.time)
        if names is None and self.n_joints is None and len(keys.features) % 3:
            return _with_further_columns(keys)
        return resolve_columns(
            names, n_features, joints, trajectory=self.trajectory, time=self.time
        )

    def _joints(self, names: list[str] | None, n_features: int) -> list[str]:
        """Names of the joints: those of columns ``dq_<joint>``, numbers otherwise."""
        named = [name[3:] for name in names or () if name.startswith("dq_")]
        numbered = [name for name in names or () if name[:2] == "dq" and name[2:].isdigit()]
        if named:
            found = named
        else:
            keys = {
                _key_column(what, spec, names, n_features)
                for what, spec in (("trajectory", self.trajectory), ("time", self.time))
            } - {None}
            count = len(numbered) or max(1, (n_features - len(keys)) // 3)
            found = [str(k + 1) for k in range(count)]
        if self.n_joints is not None and self.n_joints != len(found):
            raise ColumnError(
                f"n_joints={self.n_joints}, but X has the columns of {len(found)} joint(s)"
            )
        return found


def _with_further_columns(keys: Keys) -> Columns:
    """Columns by position for a table with more columns than the motion of its joints."""
    own = keys.features
    if len(own) < 2:
        raise ColumnError(
            f"X has {len(own)} feature(s); the motion of a joint is its position, velocity and "
            "acceleration (q, dq, ddq)."
        )
    n = max(1, len(own) // 3)
    ddq = own[2 * n : 3 * n] or None
    warnings.warn(
        f"X has {len(own)} columns without names, which is not a multiple of 3: they are "
        f"interpreted as q, dq{'' if ddq is None else ', ddq'} of {n} joint(s), and "
        f"{max(0, len(own) - 3 * n)} further column(s) are passed on. Name the columns q1.., "
        "dq1.., ddq1.., or give n_joints.",
        UserWarning,
        stacklevel=6,
    )
    return Columns(own[:n], own[n : 2 * n], ddq, keys.trajectory, keys.time)


def _refuse(term: Term, columns: Columns) -> None:
    """Raise an error for an effect that depends on more than the motion of one joint."""
    effect = term.effect
    beyond = [need for need in effect.needs if need not in ("temperature", "time")]
    if effect.scope != "joint" or beyond:
        what = ", ".join(beyond) or f"scope {effect.scope!r}"
        raise EffectError(
            f"{term.kind} does not depend on the motion of one joint alone ({what}); use "
            "RBDRegressor, which has the robot and its torque"
        )
    if term.is_open:
        example = ", ".join(f"{s.name!r}: .." for s in effect.shapes) or ".."
        raise EffectError(
            f"{term.kind} needs shape parameters; pass Term({term.kind!r}, ({term.joints[0]},), "
            f"{{{example}}}) or use RBDRegressor, which estimates them"
        )
    for need in effect.needs:
        if getattr(columns, need) is None:
            raise ColumnError(f"{term.kind} needs the column(s) of {need}, which X lacks")
