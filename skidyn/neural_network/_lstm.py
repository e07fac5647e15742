# SPDX-License-Identifier: BSD-3-Clause
"""Recurrent regressors without physics: plain LSTM and NDL."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from skidyn._columns import _key_column
from skidyn._compat import StrOptions
from skidyn._keys import Keys
from skidyn._signals import Array
from skidyn.neural_network._base import SequenceRegressor
from skidyn.neural_network._engine import Plan

#: Weight decay of networks without physics.
WEIGHT_DECAY = 0.3


class LSTMRegressor(SequenceRegressor):
    """Long short-term memory network: one LSTM layer and a linear output.

    Each row is predicted from itself and the earlier rows of its segment (contiguous rows of one
    trajectory without a gap in time). The log is cut into pieces of `stride` rows; the network
    reads the `window` rows before each of them as history, and is trained on all rows of a piece at
    once.

    Weights decay (``optimizer__weight_decay=0.3``), since a log of some minutes has few
    trajectories, to which a network would overfit. The network is trained by skorch, whose
    callbacks and optimisers can be used.

    It is useful only if no model of the robot exists: with a URDF, a rigid-body model with friction
    predicts far better on most logs (:doc:`/user_guide/learners`).

    Parameters
    ----------
    {OWN_PARAMETERS}
    {PARAMETERS}

    Attributes
    ----------
    {ATTRIBUTES}

    See Also
    --------
    NDLRegressor : With the fully connected layer of the literature.
    SDLRegressor : The same with the rigid-body torque among its inputs.
    BLLRegressor : Bags and stacks such networks.

    Notes
    -----
    Internal computations are in single precision on one thread; inputs and outputs are double. With
    ``sample_weight``, rows of weight zero are still read as history.

    References
    ----------
    .. [1] S. Hochreiter and J. Schmidhuber, "Long Short-Term Memory", Neural Computation 9(8),
       1997.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.neural_network import LSTMRegressor
    >>> t = np.arange(400) * 0.05
    >>> X = np.c_[np.repeat([0, 1], 200), np.sin(t)]
    >>> model = LSTMRegressor(window=10, max_epochs=30, trajectory=0, random_state=0)
    >>> bool(model.fit(X, np.roll(X[:, 1], 3)).score(X, np.roll(X[:, 1], 3)) > 0.9)
    True
    """

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **SequenceRegressor._parameter_constraints,
        "per_joint": ["boolean"],
        "linear": ["boolean"],
        "direction": [StrOptions({"auto"}), "array-like", None],
    }

    def __init__(
        self,
        *,
        per_joint: bool = False,
        linear: bool = True,
        direction: Any = "auto",
        window: int = 1,
        **parameters: Any,
    ) -> None:
        super().__init__(window=window, **parameters)
        self.per_joint = per_joint
        self.linear = linear
        self.direction = direction

    def _inputs(self, X: Array, keys: Keys) -> Array:
        names = getattr(self, "feature_names_in_", None)
        velocities = directions(self.direction, names, X.shape[1])
        return np.hstack([super()._inputs(X, keys), np.sign(X[:, velocities])])

    def _network(self, n_inputs: int, n_outputs: int, seed: int) -> dict[str, Any]:
        return super()._network(n_inputs, n_outputs, seed) | {"linear": self.linear}

    def _plan(self) -> Plan:
        return replace(super()._plan(), weight_decay=WEIGHT_DECAY)


def directions(given: Any, names: Any, n_features: int) -> list[int]:
    """Columns of velocities whose sign is an input, from the value given by the user."""
    columns = None if names is None else [str(name) for name in names]
    if given is None:
        return []
    if isinstance(given, str):
        return [k for k, name in enumerate(columns or ()) if name.startswith("dq")]
    found = [_key_column("direction", spec, columns, n_features) for spec in given]
    return [column for column in found if column is not None]


class NDLRegressor(LSTMRegressor):
    """Nonparametric deep learning model: LSTM, fully connected layer, dropout, output.

    The network of [1]_, section 2.2.2: Glorot input weights, forget-gate bias 1; its scaling is
    ``scaling="minmax"``, and ``linear=False, direction=None`` removes what skidyn added to it
    (:ref:`papers_own_forms`). It learns the torque from positions, velocities and accelerations
    without physics. Windows, training and prediction are those of :class:`LSTMRegressor`.

    It is useful only if no model of the robot exists: with a URDF, a rigid-body model with friction
    predicts far better on most logs (:doc:`/user_guide/learners`).

    Parameters
    ----------
    dense_size : int, default=32
        Width of the fully connected layer (tanh; the paper does not state its activation).
    dropout : float, default=0.1
        Share of the fully connected layer's outputs dropped in training.
    {OWN_PARAMETERS}
    {PARAMETERS}

    Attributes
    ----------
    {ATTRIBUTES}

    See Also
    --------
    SDLRegressor : The same network with the rigid-body torque among its inputs.

    References
    ----------
    .. [1] "Semiparametric Deep Learning Manipulator Inverse Dynamics Modeling Method for Smart
       City and Industrial Applications", section 2.2.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn.neural_network import NDLRegressor
    >>> X = np.random.default_rng(0).normal(size=(100, 3))
    >>> NDLRegressor(window=5, max_epochs=2, random_state=0).fit(X, X).predict(X).shape
    (100, 3)
    """

    def __init__(self, *, dense_size: int = 32, dropout: float = 0.1, **parameters: Any) -> None:
        super().__init__(dense_size=dense_size, dropout=dropout, **parameters)
