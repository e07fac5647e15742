# SPDX-License-Identifier: BSD-3-Clause
"""Common constructor of the recurrent regressors, with the parameters of skorch."""

from __future__ import annotations

import inspect
import re
from typing import Any

#: Parameters that go to the network, its optimiser and the callbacks, named as in skorch.
PREFIXES = ("module__", "optimizer__", "callbacks__")

#: Parameters of every recurrent regressor; they replace the line ``{PARAMETERS}`` of docstrings.
PARAMETERS = """\
    window : int, default=4
        Rows of history: each prediction uses at least `window` and less than `window + stride`
        earlier rows. A torque that depends on a longer past needs more.
    stride : int, default=4
        Rows per piece. Neighbouring rows carry nearly the same information, so with shorter pieces
        an epoch has more effect, and takes longer: ``1 + window / stride`` LSTM steps per row.
    hidden_size : int, default=32
        Cells of the LSTM.
    dense_size : int, default=0
        Width of the fully connected layer (tanh) after the LSTM; 0 for no such layer.
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
        None is AdamW with a weight decay (0.3, for SDL 0.05), which keeps a network from predicting
        a joint from the motion of other joints, and ``betas=(0.8, 0.95)``, since torch's defaults
        need more steps than a log of some minutes gives. ``optimizer__weight_decay=0.0`` gives
        plain Adam. Further parameters are named as in skorch: ``optimizer__...``,
        ``callbacks__...`` and ``module__...`` (`hidden_size`, `dense_size` and `dropout` of the
        network).
    callbacks : list of skorch callbacks or None, default=None
        Callbacks such as ``EarlyStopping`` and ``Checkpoint``. Rows are held out if a callback
        monitors the validation loss, as these two do.
    validation_fraction : float, default=0.1
        Share of the trajectories that is held out in this case (at least one); of a single
        trajectory, the share of its last rows.
    scaling : {"standard", "minmax"}, default="standard"
        Scale inputs and outputs to zero mean and unit variance, or to the range 0 to 1, which
        leaves an offset and little variance and makes training far slower.
    resample : {None, "trajectory"}, default=None
        Whether to draw trajectories with replacement before training, for ensembles.
    device : str, default="cpu"
        Torch device, such as ``"cuda"``.
    verbose : int, default=0
        Above 0 skorch prints a line for every epoch.
    trajectory, time : int, str or None, default="auto"
        Key columns of X: ``"auto"`` takes the column of that name if X has names. They separate
        segments and are not features.
    random_state : int, RandomState or None, default=None
        Seed of initial weights, order of windows, dropout, held-out trajectories and bootstrap. An
        integer gives bit-equal results whatever the number of processes.
"""

#: Parameters of the regressors without physics; they replace the line ``{OWN_PARAMETERS}``.
OWN_PARAMETERS = """\
    per_joint : bool, default=False
        Train one network per output instead of one for all.
    linear : bool, default=True
        Add a linear function of the row itself to the output. Torque is nearly linear in the
        acceleration, also beyond the training range, where an LSTM is flat.
    direction : "auto", sequence of int or str, or None, default="auto"
        Velocities whose sign is a further input, since friction changes sign with it: ``"auto"``
        takes the columns whose names begin with ``dq``, and none if X has no names.
    window : int, default=1
        Rows of history: each prediction uses at least `window` and less than `window + stride`
        earlier rows. A torque that depends on a longer past needs more.
"""

#: Attributes of every fitted regressor; they replace the line ``{ATTRIBUTES}`` of docstrings.
ATTRIBUTES = """\
    net_ : skorch.NeuralNet
        The initialised net with the fitted weights; its ``history`` and callbacks are available
        only in the process that trained it. Predictions are made with ``net_.module_``.
    weights_ : list of dict of str to ndarray
        Weights of the network, or of one network per output.
    loss_curve_, validation_curve_ : list of float
        Mean squared error of the scaled outputs after each epoch.
    n_iter_ : int
        Epochs trained, over all networks.
    input_offset_, input_scale_, output_offset_, output_scale_ : ndarray
        Offset and scale of inputs and outputs.
    n_features_in_ : int
        Number of columns of X.
    feature_names_in_ : ndarray of str
        Names of the columns, if X has names.
"""

_SHARED = {"OWN_PARAMETERS": OWN_PARAMETERS, "PARAMETERS": PARAMETERS, "ATTRIBUTES": ATTRIBUTES}


def _without(shared: str, docstring: str) -> str:
    """Shared entries, except those that a docstring has itself."""
    entries = re.split(r"(?m)^(?=    \S)", shared)
    return "".join(e for e in entries if f"\n    {e.strip().split(' : ')[0]} : " not in docstring)


class SkorchParameters:
    """Constructors that extend that of the base class, and parameters named as in skorch.

    A subclass lists only its own parameters and passes the others on as ``**parameters``; its
    signature, its docstring and scikit-learn's ``get_params`` then include all of them.
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
            for place, shared in _SHARED.items():
                own_entries = _without(shared, cls.__doc__)
                cls.__doc__ = cls.__doc__.replace(f"    {{{place}}}\n", own_entries)

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
            Include the parameters of nested estimators.

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
