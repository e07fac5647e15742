# SPDX-License-Identifier: BSD-3-Clause
"""Input of a peer: the log as recorded, and rows with columns for methods without a robot model.

Needs only numpy, scipy and pandas, so that a peer can run in an environment without skidyn.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix

#: Number of trajectories at the end that are held out to measure the errors of peers.
HELD_OUT = 2


@dataclass
class Rows:
    """Averaged rows of one joint, from which the fitted base model is projected out.

    ``torque`` is the residual of the base model, in units of ``scale`` (N m or N); ``columns`` are
    those of skidyn's whole catalogue, of unit size, named ``(kind, joints from 1)``; ``signals``
    are positions, velocities, accelerations, times and temperatures, named by ``signal_names``.
    """

    names: list[tuple[str, tuple[int, ...]]]
    columns: np.ndarray
    signal_names: list[str]
    signals: np.ndarray
    torque: np.ndarray
    base: np.ndarray
    scale: float
    trajectory: np.ndarray
    weights: csr_matrix

    @property
    def gain(self) -> np.ndarray:
        """Weight of every row by its precision, about 1 on average."""
        total = np.asarray(self.weights.sum(axis=1)).ravel()
        return total / total.mean()

    def only(self, use: np.ndarray) -> Rows:
        """The rows where ``use`` is true."""
        return replace(
            self,
            columns=self.columns[use],
            signals=self.signals[use],
            torque=self.torque[use],
            base=self.base[use],
            trajectory=self.trajectory[use],
            weights=self.weights[use],
        )

    def from_samples(self, torque: np.ndarray) -> np.ndarray:
        """Rows of a whole model's torque of this joint, N m at every sample of the whole log."""
        return (self.weights @ torque - self.base) / self.scale


@dataclass
class Log:
    """A log: ``frame`` as recorded, ``base_model`` what the model contains, ``joints`` its rows.

    ``motion`` holds smoothed ``q, dq, ddq`` (n_samples, n_joints), ``tau`` and ``trajectory`` of
    every sample of the whole log; ``use`` marks the samples that belong to this part of it.
    """

    folder: Path
    base_model: list[str]
    joints: list[Rows]
    motion: dict[str, np.ndarray]
    use: np.ndarray

    @property
    def frame(self) -> Any:
        """Table of the samples of this part, as recorded."""
        import pandas as pd

        whole = pd.read_parquet(self.folder / "log.parquet")
        return whole[np.isin(whole["trajectory"], self.motion["trajectory"][self.use])]

    @property
    def urdf(self) -> Path:
        return self.folder / "robot.urdf"


def read(folder: Path) -> tuple[Log, Log, Log]:
    """Read the whole log, and its parts for fitting and testing, without the base model."""
    meta = json.loads((folder / "meta.json").read_text())
    store = np.load(folder.parents[1] / "prepared" / f"{folder.name}.npz")
    motion = {k: store[k] for k in ("q", "dq", "ddq", "tau", "trajectory", "time")}
    late = np.unique(motion["trajectory"])[-HELD_OUT]
    whole, split = (
        [_rows(store, f"{view}{j}") for j in range(motion["q"].shape[1])]
        for view in ("whole", "split")
    )
    early = motion["trajectory"] < late

    def part(rows: list[Rows], use: np.ndarray) -> Log:
        return Log(folder, meta["base_model"], rows, motion, use)

    return (
        part(whole, np.ones(len(early), bool)),
        part([r.only(r.trajectory < late) for r in split], early),
        part([r.only(r.trajectory >= late) for r in split], ~early),
    )


def _rows(store: Any, name: str) -> Rows:
    part = {k: store[f"{name}_{k}"] for k in ("columns", "signals", "torque", "base", "scale")}
    names = json.loads(str(store[f"{name}_names"]))
    sparse = tuple(store[f"{name}_{k}"] for k in ("data", "indices", "indptr"))
    return Rows(
        names=[(kind, tuple(joints)) for kind, joints in names["columns"]],
        columns=part["columns"].astype(float),
        signal_names=names["signals"],
        signals=part["signals"],
        torque=part["torque"],
        base=part["base"],
        scale=float(part["scale"]),
        trajectory=store[f"{name}_trajectory"],
        weights=csr_matrix(sparse, shape=(len(part["torque"]), len(store["q"]))),
    )
