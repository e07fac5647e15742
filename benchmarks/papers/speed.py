# SPDX-License-Identifier: BSD-3-Clause
"""Training and prediction speed against the naive way to write the same thing.

    python benchmarks/papers/speed.py
    python benchmarks/papers/speed.py --threads 1
    python benchmarks/papers/speed.py --tune

Prints seconds and accuracy on held-out trajectories of BLLRegressor and of
BaggingRegressor(NeuralNetRegressor) with skorch's own data handling, batches (128 rows) and
validation split: same members, epochs, and hidden size. The naive nets are timed on one and on
two torch threads (on a busy machine two wait for each other at length; then ``--threads 1``).
Seconds of the processor count all processes; those on the wall depend on what else runs. Then
predictions and the ELM committee.

Settings of both come from ``--tune``, which knows nothing of the held-out trajectories: three
members learn the first 32 of the 40 training trajectories, the last 8 judge, and the best learning
rate of the same three is taken for each of the same two optimisers. The naive bag is then shown
with both: Adam as it is, and the optimiser that ours uses. Window, stride and batch size of ours
were chosen by cross-validation over the training trajectories.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable
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
#: Rows that the naive nets read; ours read 3 to 5 rows of history.
WINDOW = 32
LEARNING_RATES = (0.01, 0.03, 0.05)
OPTIMISERS: dict[str, dict[str, Any]] = {
    "Adam": {"weight_decay": 0.0, "betas": (0.9, 0.999)},
    "AdamW": {"weight_decay": 0.15, "betas": (0.8, 0.95)},
}
#: What --tune finds best.
OURS, NAIVE = 0.03, {"Adam": 0.05, "AdamW": 0.01}


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


def ours(learning_rate: float, optimiser: str, members: int, epochs: int) -> BLLRegressor:
    """Our ensemble."""
    member = LSTMRegressor(
        window=3,
        stride=3,
        batch_size=32,
        hidden_size=HIDDEN,
        max_epochs=epochs,
        learning_rate=learning_rate,
        **OPTIMISERS[optimiser],
    )
    return BLLRegressor(member, n_estimators=members, trajectory=0, random_state=0)


class Naive:
    """Bag of skorch's nets on scaled rows laid out side by side."""

    def __init__(self, learning_rate: float, optimiser: str, members: int, epochs: int) -> None:
        net = NeuralNetRegressor(
            NaiveLSTM,
            optimizer=torch.optim.AdamW,
            lr=learning_rate,
            max_epochs=epochs,
            verbose=0,
            **{f"optimizer__{name}": value for name, value in OPTIMISERS[optimiser].items()},
        )
        self.bag = BaggingRegressor(net, members, random_state=0)

    def _inputs(self, X: NDArray) -> NDArray:
        return lag_matrix(((X[:, 1:] - self.mean) / self.scale).astype("float32"), X[:, 0])

    def fit(self, X: NDArray, y: NDArray) -> Naive:
        """Scale, lay out, train."""
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
    """Accuracy on the last fifth of the training trajectories."""
    learn, judge = slice(0, len(X) * 4 // 5), slice(len(X) * 4 // 5, None)
    print(
        "R2 on the last 8 training trajectories, 3 members: optimiser, learning rate, ours, naive"
    )
    for optimiser in OPTIMISERS:
        for rate in LEARNING_RATES:
            models = [make(rate, optimiser, 3, epochs) for make in (ours, Naive)]
            scores = [
                r2_score(y[judge], model.fit(X[learn], y[learn]).predict(X[judge]))
                for model in models
            ]
            print(f"{optimiser:6s} {rate:.2f} {scores[0]:.4f} {scores[1]:.4f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--tune", action="store_true", help="print the grid and stop")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2], help="naive nets")
    parser.add_argument("--epochs", type=int, default=10)
    parser.add_argument("--members", type=int, default=10)
    parser.add_argument("--rows", type=int, default=20_000)
    options = parser.parse_args()
    size = options.members, options.epochs
    X, y = make_data(options.rows)
    # many trajectories: of ten the best model is not the same from draw to draw
    held_out, held_out_y = make_data(50_000, seed=1)
    if options.tune:
        torch.set_num_threads(1)
        tune(X, y, options.epochs)
        return

    def measure(name: str, model: Any) -> float:
        cpu, wall = timed(lambda: model.fit(X, y))
        score = r2_score(held_out_y, model.predict(held_out))
        print(f"{name:32s} {cpu:6.1f} s CPU, {wall:6.1f} s wall, R2 {score:.4f}", flush=True)
        return cpu

    ours(OURS, "AdamW", 1, 1).fit(X[:1000], y[:1000])  # torch imports what its optimisers need
    bll = ours(OURS, "AdamW", *size)
    seconds = [measure("BLL, one process", bll)]
    naive = []
    for optimiser, rate in NAIVE.items():
        for n_threads in options.threads:
            torch.set_num_threads(n_threads)
            name = f"bag of nets, {optimiser}, {n_threads} thread(s)"
            naive.append(measure(name, Naive(rate, optimiser, *size)))
    seconds.append(measure("BLL, one process again", bll))
    print(f"ratio of CPU {min(naive) / np.mean(seconds):.1f}")

    big, big_y = make_data(100_000)
    cpu, wall = timed(lambda: bll.predict(big))
    print(f"BLL prediction of {len(big)} rows: {cpu:.2f} s CPU, {wall:.2f} s wall")
    elm = ELMCommittee(trajectory=0, random_state=0)
    cpu, wall = timed(lambda: elm.fit(big, big_y))
    print(f"ELM committee on {len(big)} rows: {cpu:.2f} s CPU, {wall:.2f} s wall")


if __name__ == "__main__":
    main()
