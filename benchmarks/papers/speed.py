# SPDX-License-Identifier: BSD-3-Clause
"""Training and prediction speed against the naive way to write the same thing.

    python benchmarks/papers/speed.py

Prints seconds and held-out accuracy of BLLRegressor and of BaggingRegressor(NeuralNetRegressor)
with skorch's own data handling, same members, epochs and hidden size; then the ELM committee.
"""

from __future__ import annotations

import os

# one thread a process; the naive nets are also run with torch's default, all cores
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time

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
#: Rows of history of the naive nets; ours read 16 to 31, as their windows of 16 rows overlap.
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
        window=WINDOW // 2,
        hidden_size=HIDDEN,
        max_epochs=options.epochs,
        batch_size=8,
        learning_rate=0.02,
    )
    bll = BLLRegressor(member, n_estimators=options.members, trajectory=0, random_state=0, n_jobs=2)
    start = time.perf_counter()
    bll.fit(X[train], y[train])
    ours = time.perf_counter() - start
    print(
        f"BLLRegressor             {ours:7.1f} s  R2 {r2_score(y[test], bll.predict(X[test])):.4f}"
    )

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
    for threads in (os.cpu_count() or 1, 1):
        torch.set_num_threads(threads)
        naive = BaggingRegressor(net, n_naive, random_state=0)
        start = time.perf_counter()
        naive.fit(lags[train], ((y - mean) / std)[train].astype("float32"))
        theirs = (time.perf_counter() - start) * options.members / n_naive
        score = r2_score(y[test], naive.predict(lags[test]) * std + mean)
        print(
            f"Bagging of skorch's nets {theirs:7.1f} s  R2 {score:.4f}  {threads} threads, "
            f"{n_naive} trained; ratio {theirs / ours:.1f}"
        )

    big, big_y, _ = make_data(100_000)
    start = time.perf_counter()
    bll.predict(big)
    print(f"BLL prediction of {len(big)} rows: {time.perf_counter() - start:.2f} s")
    start = time.perf_counter()
    ELMCommittee(n_jobs=2, trajectory=0, random_state=0).fit(big, big_y)
    print(f"ELM committee on {len(big)} rows: {time.perf_counter() - start:.2f} s")


if __name__ == "__main__":
    main()
