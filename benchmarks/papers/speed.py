# SPDX-License-Identifier: BSD-3-Clause
"""Training and prediction speed against the naive way to write the same thing.

    python benchmarks/papers/speed.py
    python benchmarks/papers/speed.py --seed 10 --threads 1
    python benchmarks/papers/speed.py --tune

Prints seconds and accuracy on held-out trajectories of BLLRegressor and of
BaggingRegressor(NeuralNetRegressor) with skorch's own data handling, batches (128 rows) and
validation split: same members, epochs, and hidden size. The naive nets are timed on one and on
two torch threads. Seconds of the processor count all processes; those on the wall depend on what
else runs. Then predictions and the ELM committee.

The naive bag is shown with skorch's default optimiser (SGD, learning rate 0.01), which hardly
learns in ten epochs, with Adam, and with the weight decay that suits it; ours with its defaults but
for a row of history less.
``--tune`` shows learning rates and weight decays of both sides. It knows nothing of the held-out
trajectories: each fifth of the training trajectories judges networks that learned the others, in
three of five folds.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import torch
from joblib.externals.loky import get_reusable_executor
from numpy.typing import NDArray
from sklearn.ensemble import BaggingRegressor
from sklearn.metrics import r2_score
from skorch import NeuralNetRegressor
from torch import nn

from skidyn.committee import ELMCommittee
from skidyn.neural_network import BLLRegressor, LSTMRegressor

HIDDEN = 32
#: Rows that the naive nets read; ours read 3 to 6 rows of history.
WINDOW = 32
#: What --tune finds best for naive nets.
NAIVE: dict[str, dict[str, Any]] = {
    "SGD": {"optimizer": torch.optim.SGD, "lr": 0.01},
    "Adam": {"optimizer": torch.optim.Adam, "lr": 0.05},
    "AdamW": {
        "optimizer": torch.optim.AdamW,
        "lr": 0.01,
        "optimizer__weight_decay": 0.15,
        "optimizer__betas": (0.8, 0.95),
    },
}


def make_data(n_rows: int, seed: int = 0, n_joints: int = 7) -> tuple[NDArray, NDArray]:
    """Trajectories of 500 rows with torque that remembers the motion."""
    rng = np.random.default_rng(seed)
    t = np.arange(500) * 0.01
    tables, torques = [], []
    for k in range(n_rows // 500):
        w, phase = 2 * np.pi * rng.uniform(0.2, 1, n_joints), rng.uniform(0, 6, n_joints)
        angle = w * t[:, None] + phase
        q, dq, ddq = np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)
        state, memory = np.zeros(n_joints), []
        for velocity in dq:
            state = state + 0.01 * (velocity - 5 * np.abs(velocity) * state)
            memory.append(state)
        tables.append(np.c_[np.full(len(t), k), q, dq, ddq])
        torques.append(0.1 * ddq + 2 * np.cos(q) + 5 * np.array(memory))
    X, y = np.concatenate(tables), np.concatenate(torques)
    return X, y + 0.05 * rng.normal(size=y.shape)


class NaiveLSTM(nn.Module):
    """Reads a window that was laid out in the columns."""

    def __init__(self, n_inputs: int, n_outputs: int) -> None:
        super().__init__()
        self.n_inputs = n_inputs
        self.lstm = nn.LSTM(n_inputs, HIDDEN, batch_first=True)
        self.output = nn.Linear(HIDDEN, n_outputs)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Output of the last row."""
        return self.output(self.lstm(x.view(len(x), WINDOW, self.n_inputs))[0][:, -1])


def lag_matrix(features: NDArray, trajectory: NDArray) -> NDArray:
    """Every row with the rows before it, side by side."""
    first = np.searchsorted(trajectory, trajectory)
    rows = np.arange(len(features))[:, None] - np.arange(WINDOW - 1, -1, -1)
    return features[np.maximum(rows, first[:, None])].reshape(len(features), -1)


def ours(members: int, epochs: int, **changes: float) -> BLLRegressor:
    """Our ensemble, of the networks of the naive bag; what is not named is at its default."""
    settings = {"optimizer__weight_decay": 0.05, "linear": False, "direction": None, **changes}
    member = LSTMRegressor(window=3, hidden_size=HIDDEN, max_epochs=epochs, **settings)
    return BLLRegressor(member, n_estimators=members, trajectory=0, random_state=0)


class Naive:
    """Bag of skorch's nets on scaled rows laid out side by side."""

    def __init__(self, optimiser: str, members: int, epochs: int, **changes: float) -> None:
        settings = NAIVE[optimiser] | changes
        net = NeuralNetRegressor(NaiveLSTM, max_epochs=epochs, verbose=0, **settings)
        self.bag = BaggingRegressor(net, members, random_state=0)

    def _inputs(self, X: NDArray) -> NDArray:
        return lag_matrix(((X[:, 1:] - self.mean) / self.scale).astype("float32"), X[:, 0])

    def fit(self, X: NDArray, y: NDArray) -> Naive:
        """Scale, lay out, train."""
        torch.manual_seed(0)  # skorch draws initial weights from torch's own state
        self.mean, self.scale = X[:, 1:].mean(axis=0), X[:, 1:].std(axis=0)
        self.offset, self.unit = y.mean(axis=0), y.std(axis=0)
        inputs, targets = self._inputs(X), ((y - self.offset) / self.unit).astype("float32")
        sizes = {"module__n_inputs": X.shape[1] - 1, "module__n_outputs": y.shape[1]}
        self.bag.estimator.set_params(**sizes)
        self.bag.fit(inputs, targets)
        return self

    def predict(self, X: NDArray) -> NDArray:
        """Torque of every row."""
        return self.bag.predict(self._inputs(X)) * self.unit + self.offset


def processor_time() -> float:
    """Seconds of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def timed(work: Callable[[], Any]) -> tuple[float, float]:
    """Seconds of the processor and on the wall."""
    cpu, wall = processor_time(), time.perf_counter()
    work()
    wall = time.perf_counter() - wall
    get_reusable_executor().shutdown(wait=True)  # workers count once they have ended
    return processor_time() - cpu, wall


def tune(X: NDArray, y: NDArray, epochs: int) -> None:
    """R2 on training trajectories that are left out, mean of three of five folds, 5 members."""
    number = X[:, 0].astype(int)

    def score(title: str, make: Callable[..., Any], *settings: Any, **changes: Any) -> None:
        scores = []
        for fold in range(3):
            judge = number % 5 == fold
            model = make(*settings, 5, epochs, **changes).fit(X[~judge], y[~judge])
            scores.append(r2_score(y[judge], model.predict(X[judge])))
        told = ", ".join(f"{name} {value}" for name, value in changes.items())
        print(f"{title:12s} {told:40s} {np.mean(scores):.4f}", flush=True)

    for rate, decay in product((0.015, 0.03, 0.06), (0.02, 0.05, 0.1)):
        score("BLL", ours, learning_rate=rate, optimizer__weight_decay=decay)
    for optimiser, rate in product(("Adam", "AdamW"), (0.01, 0.03, 0.05)):
        score(f"naive {optimiser}", Naive, optimiser, lr=rate)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--tune", action="store_true", help="print the grids and stop")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2], help="naive nets")
    parser.add_argument("--optimisers", nargs="+", choices=list(NAIVE), default=list(NAIVE))
    parser.add_argument("--epochs", type=int, default=10)
    parser.add_argument("--members", type=int, default=10)
    parser.add_argument("--rows", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0, help="another draw of training data")
    options = parser.parse_args()
    size = options.members, options.epochs
    X, y = make_data(options.rows, options.seed)
    # many trajectories: of ten the best model is not the same from draw to draw
    held_out, held_out_y = make_data(50_000, seed=1)
    torch.set_num_threads(1)
    if options.tune:
        tune(X, y, options.epochs)
        return

    def measure(name: str, model: Any) -> tuple[float, float]:
        used = timed(lambda: model.fit(X, y))
        score = r2_score(held_out_y, model.predict(held_out))
        print(f"{name:32s} {used[0]:6.1f} s CPU, {used[1]:6.1f} s wall, R2 {score:.4f}", flush=True)
        return used

    ours(1, 1).fit(X[:1000], y[:1000])  # torch imports what its optimisers need
    bll = ours(*size)
    seconds, naive = [measure("BLL, one process", bll)], []
    for optimiser in options.optimisers:
        for n_threads in options.threads:
            torch.set_num_threads(n_threads)
            name = f"bag of nets, {optimiser}, {n_threads} thread(s)"
            naive.append(measure(name, Naive(optimiser, *size)))
    torch.set_num_threads(1)
    seconds.append(measure("BLL, one process again", bll))
    ratio = np.min(naive, axis=0) / np.mean(seconds, axis=0)
    print(f"the fastest naive bag to BLL: {ratio[0]:.1f} CPU, {ratio[1]:.1f} wall")

    big, big_y = make_data(100_000)
    cpu, wall = timed(lambda: bll.predict(big))
    print(f"BLL prediction of {len(big)} rows: {cpu:.2f} s CPU, {wall:.2f} s wall")
    elm = ELMCommittee(trajectory=0, random_state=0)
    cpu, wall = timed(lambda: elm.fit(big, big_y))
    print(f"ELM committee on {len(big)} rows: {cpu:.2f} s CPU, {wall:.2f} s wall")


if __name__ == "__main__":
    main()
