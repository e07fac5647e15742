# SPDX-License-Identifier: BSD-3-Clause
"""Recurrent regressors that know nothing of physics: plain LSTM and NDL."""

from __future__ import annotations

from typing import Any, ClassVar

from skidyn._columns import ColumnSpec
from skidyn.neural_network._base import SequenceRegressor


class LSTMRegressor(SequenceRegressor):
    """Long short-term memory network: one LSTM layer and a linear output.

    Each row is predicted from itself and the rows before it in its segment (contiguous rows of
    one trajectory without a gap in time). The log is cut into pieces of `stride` rows; the network
    reads the `window` rows before each of them as history, and is trained on all rows of a piece
    at once.

    Parameters
    ----------
    window : int, default=4
        Rows of history: each prediction has at least `window` and less than `window + stride` rows
        behind it. What the torque remembers for longer needs more.
    stride : int, default=4
        Rows per piece. Neighbouring rows tell a network nearly the same, so shorter pieces learn
        more from an epoch, and cost more: ``1 + window / stride`` LSTM steps per row.
    hidden_size : int, default=32
        Cells of the LSTM.
    max_epochs : int, default=100
        Passes over the log.
    learning_rate : float, default=0.03
        First step size of Adam; it falls to zero along a cosine unless `early_stopping` is on.
    weight_decay : float, default=0.05
        Every step shrinks the weights by this share of the step size (AdamW), which
        keeps a network from learning joints as functions of other joints. 0 is plain Adam.
    betas : tuple of two float, default=(0.8, 0.95)
        How much Adam keeps of its averages of the gradient and of its square from step to step.
        torch's own ``(0.9, 0.999)`` want more steps than a log of minutes gives.
    batch_size : int, default=32
        Pieces per step.
    scaling : {"standard", "minmax"}, default="standard"
        Inputs and outputs are scaled to zero mean and unit variance, or to the range 0 to 1.
    early_stopping : bool, default=False
        Hold trajectories out, stop when they stop improving, keep the best weights.
    validation_fraction : float, default=0.1
        Share of the trajectories held out (at least one); of a single trajectory its last rows.
    n_iter_no_change : int, default=10
        Epochs without improvement before stopping.
    resample : {None, "trajectory"}, default=None
        Draw trajectories with replacement before training, for ensembles.
    per_joint : bool, default=False
        Train one network per output instead of one for all.
    device : str, default="cpu"
        Torch device, such as ``"cuda"``.
    trajectory, time : int, str or None, default="auto"
        Key columns of X: ``"auto"`` takes the column of that name if X has names. They separate
        segments and are no features; all other columns are.
    random_state : int, RandomState or None, default=None
        Draws initial weights, order of windows and bootstrap. An integer gives bit-equal results
        whatever the number of processes.

    Attributes
    ----------
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

    See Also
    --------
    NDLRegressor : With the fully connected layer of the literature.
    SDLRegressor : Reads the rigid-body torque as well.
    BLLRegressor : Bags and stacks such networks.

    Notes
    -----
    Computations inside are in single precision on one thread; inputs and outputs are double.
    With ``sample_weight``, rows of weight zero are still read as history.

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
        key: value
        for key, value in SequenceRegressor._parameter_constraints.items()
        if key not in ("dense_size", "dropout")
    }

    def __init__(
        self,
        *,
        window: int = 4,
        stride: int = 4,
        hidden_size: int = 32,
        max_epochs: int = 100,
        learning_rate: float = 0.03,
        weight_decay: float = 0.05,
        betas: tuple[float, float] = (0.8, 0.95),
        batch_size: int = 32,
        scaling: str = "standard",
        early_stopping: bool = False,
        validation_fraction: float = 0.1,
        n_iter_no_change: int = 10,
        resample: str | None = None,
        per_joint: bool = False,
        device: str = "cpu",
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
        random_state: Any = None,
    ) -> None:
        self.window = window
        self.stride = stride
        self.hidden_size = hidden_size
        self.max_epochs = max_epochs
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.betas = betas
        self.batch_size = batch_size
        self.scaling = scaling
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.resample = resample
        self.per_joint = per_joint
        self.device = device
        self.trajectory = trajectory
        self.time = time
        self.random_state = random_state


class NDLRegressor(SequenceRegressor):
    """Nonparametric deep learning model: LSTM, fully connected layer, dropout, output.

    The network of [1]_, section 2.2.2: Glorot input weights, forget-gate bias 1; its scaling is
    ``scaling="minmax"``. It learns the torque from positions, velocities and
    accelerations without any physics. Windows, training and prediction are those of
    :class:`LSTMRegressor`.

    Parameters
    ----------
    window : int, default=4
        Rows of history.
    stride : int, default=4
        Rows predicted at once.
    hidden_size : int, default=32
        Cells of the LSTM.
    dense_size : int, default=32
        Width of the fully connected layer (rectifier; the paper does not name its activation).
    dropout : float, default=0.1
        Share of the fully connected layer's outputs dropped in training.
    max_epochs : int, default=100
        Passes over the log.
    learning_rate : float, default=0.03
        First step size of Adam; it falls to zero along a cosine unless `early_stopping` is on.
    weight_decay : float, default=0.05
        Every step shrinks the weights by this share of the step size (AdamW), which
        keeps a network from learning joints as functions of other joints. 0 is plain Adam.
    betas : tuple of two float, default=(0.8, 0.95)
        How much Adam keeps of its averages of the gradient and of its square from step to step.
        torch's own ``(0.9, 0.999)`` want more steps than a log of minutes gives.
    batch_size : int, default=32
        Pieces per step.
    scaling : {"standard", "minmax"}, default="standard"
        Inputs and outputs are scaled to zero mean and unit variance, or to the range 0 to 1 (eq. 8
        of the paper), which leaves an offset and little variance, and so learns far more slowly.
    early_stopping : bool, default=False
        Hold trajectories out, stop when they stop improving, keep the best weights.
    validation_fraction : float, default=0.1
        Share of the trajectories held out.
    n_iter_no_change : int, default=10
        Epochs without improvement before stopping.
    resample : {None, "trajectory"}, default=None
        Draw trajectories with replacement before training.
    per_joint : bool, default=False
        Train one network per output instead of one for all.
    device : str, default="cpu"
        Torch device.
    trajectory, time : int, str or None, default="auto"
        Key columns of X.
    random_state : int, RandomState or None, default=None
        Draws initial weights, order of windows, dropout and bootstrap.

    Attributes
    ----------
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

    def __init__(
        self,
        *,
        window: int = 4,
        stride: int = 4,
        hidden_size: int = 32,
        dense_size: int = 32,
        dropout: float = 0.1,
        max_epochs: int = 100,
        learning_rate: float = 0.03,
        weight_decay: float = 0.05,
        betas: tuple[float, float] = (0.8, 0.95),
        batch_size: int = 32,
        scaling: str = "standard",
        early_stopping: bool = False,
        validation_fraction: float = 0.1,
        n_iter_no_change: int = 10,
        resample: str | None = None,
        per_joint: bool = False,
        device: str = "cpu",
        trajectory: ColumnSpec = "auto",
        time: ColumnSpec = "auto",
        random_state: Any = None,
    ) -> None:
        self.window = window
        self.stride = stride
        self.hidden_size = hidden_size
        self.dense_size = dense_size
        self.dropout = dropout
        self.max_epochs = max_epochs
        self.learning_rate = learning_rate
        self.weight_decay = weight_decay
        self.betas = betas
        self.batch_size = batch_size
        self.scaling = scaling
        self.early_stopping = early_stopping
        self.validation_fraction = validation_fraction
        self.n_iter_no_change = n_iter_no_change
        self.resample = resample
        self.per_joint = per_joint
        self.device = device
        self.trajectory = trajectory
        self.time = time
        self.random_state = random_state
