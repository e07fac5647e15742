# SPDX-License-Identifier: BSD-3-Clause
"""One constructor for all recurrent regressors, and skorch's own parameters beside it."""

from __future__ import annotations

import inspect
import re
from typing import Any

#: Parameters that go to the network, its optimiser and the callbacks, named as in skorch.
PREFIXES = ("module__", "optimizer__", "callbacks__")

#: What every recurrent regressor takes; its docstring has the line ``{PARAMETERS}`` in this place.
PARAMETERS = """\
    window : int, default=4
        Rows of history: each prediction has at least `window` and less than `window + stride` rows
        behind it. What the torque remembers for longer needs more.
    stride : int, default=4
        Rows per piece. Neighbouring rows carry nearly the same information, so shorter pieces learn
        more from an epoch, and cost more: ``1 + window / stride`` LSTM steps per row.
    hidden_size : int, default=32
        Cells of the LSTM.
    dense_size : int, default=0
        Width of the fully connected layer (tanh) after the LSTM; 0 is none.
    dropout : float, default=0.0
        Share of the fully connected layer's outputs dropped in training.
    max_epochs : int, default=100
        Passes over the log.
    learning_rate : float, default=0.03
        First step size, skorch's ``lr``. It falls to zero along a cosine unless a callback ends the
        training early or sets the rate itself.
    batch_size : int, default=32
        Pieces per step.
    optimizer : type of torch.optim.Optimizer or None, default=None
        None is AdamW with a weight decay (0.3, of SDL 0.05), which keeps a network from learning
        joints as functions of other joints, and ``betas=(0.8, 0.95)``, since torch's own need more
        steps than a log of minutes gives. ``optimizer__weight_decay=0.0`` makes it plain Adam:
        parameters named as in skorch are taken as well, ``optimizer__...``, ``callbacks__...`` and
        ``module__...`` (`hidden_size`, `dense_size` and `dropout` of the network).
    callbacks : list of skorch callbacks or None, default=None
        Such as ``EarlyStopping`` and ``Checkpoint``. Rows are held out for those that watch the
        validation loss, as these two do.
    validation_fraction : float, default=0.1
        Share of the trajectories that is held out then (at least one); of a single trajectory its
        last rows.
    scaling : {"standard", "minmax"}, default="standard"
        Inputs and outputs are scaled to zero mean and unit variance, or to the range 0 to 1, which
        leaves an offset and little variance, and so learns far more slowly.
    resample : {None, "trajectory"}, default=None
        Draw trajectories with replacement before training, for ensembles.
    device : str, default="cpu"
        Torch device, such as ``"cuda"``.
    verbose : int, default=0
        Above 0 skorch prints a line for every epoch.
    trajectory, time : int, str or None, default="auto"
        Key columns of X: ``"auto"`` takes the column of that name if X has names. They separate
        segments and are no features.
    random_state : int, RandomState or None, default=None
        Draws initial weights, order of windows, dropout, held-out trajectories and bootstrap. An
        integer gives bit-equal results whatever the number of processes.
"""

#: What every recurrent regressor has after a fit; the line ``{ATTRIBUTES}`` stands for it.
ATTRIBUTES = """\
    net_ : skorch.NeuralNet
        The initialised net with the fitted weights; its ``history`` and callbacks are those of the
        training in the process that trained it. Predictions are made with ``net_.module_``.
    weights_ : list of dict of str to ndarray
        Weights of the network, or of one network per output.
    loss_curve_, validation_curve_ : list of float
        Mean squared error of the scaled outputs after each epoch.
    n_iter_ : int
        Epochs trained, over all networks.
    input_offset_, input_scale_, output_offset_, output_scale_ : ndarray
        Scaling.
    n_features_in_ : int
        Columns of X.
    feature_names_in_ : ndarray of str
        Their names, where X has names.
"""


def _without(shared: str, docstring: str) -> str:
    """Shared entries, but for those that a docstring has of its own."""
    entries = re.split(r"(?m)^(?=    \S)", shared)
    return "".join(e for e in entries if f"\n    {e.strip().split(' : ')[0]} : " not in docstring)


class SkorchParameters:
    """Constructors that extend that of their base class, and parameters named as in skorch.

    A subclass lists what it adds and hands the rest on as ``**parameters``; its signature, its
    docstring and with them scikit-learn's ``get_params`` know all of them.
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        own = cls.__dict__.get("__init__")
        if own is not None:
            signature = inspect.signature(own)
            merged = dict(signature.parameters)
            if merged.pop("parameters", None) is not None:
                base: Any = cls.__mro__[1]
                for name, parameter in inspect.signature(base.__init__).parameters.items():
                    if parameter.kind is not parameter.VAR_KEYWORD:
                        merged.setdefault(name, parameter)
                ordered = sorted(merged.values(), key=lambda parameter: parameter.kind)
                own.__signature__ = signature.replace(parameters=ordered)
        if cls.__doc__:
            for place, shared in (("PARAMETERS", PARAMETERS), ("ATTRIBUTES", ATTRIBUTES)):
                cls.__doc__ = cls.__doc__.replace(
                    f"    {{{place}}}\n", _without(shared, cls.__doc__)
                )

    def _set_skorch(self, parameters: dict[str, Any]) -> None:
        """Keep parameters named as in skorch; refuse all others."""
        for name, value in parameters.items():
            if not name.startswith(PREFIXES):
                raise TypeError(
                    f"{type(self).__name__} has no parameter {name!r}; it has "
                    f"{', '.join(sorted(self._get_param_names()))}, and those that begin with "  # type: ignore[attr-defined]
                    f"{', '.join(PREFIXES)}"
                )
            setattr(self, name, value)

    def _skorch(self) -> dict[str, Any]:
        """Parameters named as in skorch."""
        return {name: value for name, value in vars(self).items() if name.startswith(PREFIXES)}

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Get parameters of this estimator.

        Parameters
        ----------
        deep : bool, default=True
            Also those of estimators among the parameters.

        Returns
        -------
        parameters : dict
            Parameter names mapped to their values.
        """
        given: dict[str, Any] = super().get_params(deep=deep)  # type: ignore[misc]
        return given | self._skorch()

    def set_params(self, **params: Any) -> Any:
        """Set parameters of this estimator.

        Parameters
        ----------
        **params : dict
            Estimator parameters.

        Returns
        -------
        self : estimator instance
            The estimator.
        """
        own = {name: value for name, value in params.items() if name.startswith(PREFIXES)}
        self._set_skorch(own)
        others = {name: value for name, value in params.items() if name not in own}
        return super().set_params(**others)  # type: ignore[misc]
