# SPDX-License-Identifier: BSD-3-Clause
"""Training and prediction speed against the naive way to write the same thing.

    python benchmarks/papers/speed.py

Prints seconds and held-out accuracy of BLLRegressor and of BaggingRegressor(NeuralNetRegressor)
with skorch's own data handling: same members, epochs, hidden size and target rows per step (128).
Both learn on one thread, and seconds of the processor are given beside those on the wall, which
depend on what else runs. Then the ELM committee, and predictions.
"""

from __future__ import annotations

import os

# one thread a process
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sklearn.ensemble import BaggingRegressor
from sklearn.metrics import r2_score
from skorch import NeuralNetRegressor
from torch import nn

from skidyn.committee import ELMCommittee
from skidyn.neural_network import BLLRegressor, LSTMRegressor

HIDDEN = 32
#: Rows that the naive nets read; ours read 4 to 7 rows of history.
WINDOW = 32


def make_data(n_rows: int, n_joints: int = 7) -> tuple[NDArray, NDArray, NDArray]:
    """Trajectories of 500 rows with torque that remembers the motion."""
    rng = np.random.default_rng(0)
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
    return X, y + 0.05 * rng.normal(size=y.shape), X[:, 0]


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


def timed(work: Callable[[], Any]) -> tuple[float, float]:
    """Seconds of the processor (this process) and on the wall."""
    cpu, wall = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - cpu, time.perf_counter() - wall


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--epochs", type=int, default=10)
    parser.add_argument("--members", type=int, default=10)
    parser.add_argument("--rows", type=int, default=20_000)
    parser.add_argument("--naive-members", type=int, default=None, help="train fewer, scale time")
    options = parser.parse_args()
    X, y, trajectory = make_data(options.rows + 5000)
    train, test = slice(0, options.rows), slice(options.rows, None)

    member = LSTMRegressor(
        window=4,
        stride=4,
        hidden_size=HIDDEN,
        max_epochs=options.epochs,
        batch_size=32,
        learning_rate=0.03,
    )
    bll = BLLRegressor(member, n_estimators=options.members, trajectory=0, random_state=0)
    ours, wall = timed(lambda: bll.fit(X[train], y[train]))
    score = r2_score(y[test], bll.predict(X[test]))
    print(f"BLLRegressor, one process  {ours:6.1f} s CPU, {wall:6.1f} s wall, R2 {score:.4f}")
    bll.set_params(n_jobs=2)
    _, wall = timed(lambda: bll.fit(X[train], y[train]))
    print(f"BLLRegressor, two processes                 {wall:6.1f} s wall", flush=True)

    scaled = ((X[:, 1:] - X[train, 1:].mean(0)) / X[train, 1:].std(0)).astype("float32")
    mean, std = y[train].mean(0), y[train].std(0)
    lags = lag_matrix(scaled, trajectory)
    net = NeuralNetRegressor(
        NaiveLSTM,
        module__n_inputs=scaled.shape[1],
        module__n_outputs=y.shape[1],
        optimizer=torch.optim.Adam,
        lr=0.01,
        max_epochs=options.epochs,
        verbose=0,
    )
    n_naive = options.naive_members or options.members
    torch.set_num_threads(1)
    naive = BaggingRegressor(net, n_naive, random_state=0)
    torque = ((y - mean) / std)[train].astype("float32")
    theirs, wall = (
        seconds * options.members / n_naive
        for seconds in timed(lambda: naive.fit(lags[train], torque))
    )
    score = r2_score(y[test], naive.predict(lags[test]) * std + mean)
    print(
        f"Bagging of skorch's nets   {theirs:6.1f} s CPU, {wall:6.1f} s wall, R2 {score:.4f} "
        f"({n_naive} trained); ratio {theirs / ours:.1f} of CPU",
        flush=True,
    )

    big, big_y, _ = make_data(100_000)
    bll.set_params(n_jobs=None)
    cpu, wall = timed(lambda: bll.predict(big))
    print(f"BLL prediction of {len(big)} rows: {cpu:.2f} s CPU, {wall:.2f} s wall")
    elm = ELMCommittee(trajectory=0, random_state=0)
    cpu, wall = timed(lambda: elm.fit(big, big_y))
    print(f"ELM committee on {len(big)} rows: {cpu:.2f} s CPU, {wall:.2f} s wall")


if __name__ == "__main__":
    main()
