# SPDX-License-Identifier: BSD-3-Clause
"""Columns of every effect of skidyn's catalogue, for methods that choose columns.

Such methods know no robots: they are given what skidyn itself would choose from, averaged rows of
every joint with the base model swept out, so that only the choice differs.
"""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from skidyn._signals import read_signals
from skidyn.diagnosis import catalogue_candidates
from skidyn.effects import list_effects, make_terms
from skidyn.evidence import make_problem
from skidyn.logs import read_log
from skidyn.robots import Robot


@dataclass
class Columns:
    """Rows of one joint: columns of unit size and the torque, the base model swept out of both."""

    names: list[tuple[str, tuple[int, ...]]]
    matrix: np.ndarray
    torque: np.ndarray
    groups: np.ndarray


def read_case(case: Path):
    """Robot, log, torque and base model of a case."""
    meta = json.loads((case / "meta.json").read_text())
    robot = Robot.from_urdf(case / "robot.urdf")
    frame = read_log([str(case / "log.parquet")], robot=robot)
    tau = frame[[f"tau{j + 1}" for j in range(robot.n_joints)]].to_numpy()
    return robot, frame, tau, tuple(k for k in meta["base_model"] if k != "rigid_body")


@lru_cache(maxsize=1)  # several methods choose from the same ones
def columns_of(case: Path) -> tuple[list[Columns], float]:
    """Columns of every joint, and the seconds that it took to make them."""
    start = time.perf_counter()
    robot, frame, tau, base = read_case(case)
    signals, torque = read_signals(frame, tau, robot)
    terms = make_terms(base, robot.n_joints)
    problem = make_problem(signals, torque, robot=robot, rigid_body=True, terms=terms)
    problem.set_fit(problem.fit(terms, passes=3))
    pool = [c for c in catalogue_candidates(problem, list_effects()) if c.kind not in base]
    design = problem.design([problem.term_rows(t) for t in terms])
    joints = []
    for j in range(robot.n_joints):
        own = [c for c in pool if j in c.joints]
        blocks = [c.rows[j] for c in own]
        names = [
            (c.kind, tuple(i + 1 for i in c.joints))
            for c, b in zip(own, blocks, strict=True)
            for _ in range(b.shape[1])
        ]
        whole = np.column_stack([*blocks, problem.target[j]])
        mimic = np.linalg.lstsq(design[j], whole, rcond=1e-9)[0]
        swept = whole - design[j] @ mimic
        size = np.linalg.norm(swept, axis=0) / np.sqrt(len(swept))
        seen = size[:-1] > 1e-5 * np.maximum(
            np.linalg.norm(whole[:, :-1], axis=0) / np.sqrt(len(swept)), 1e-12
        )
        joints.append(
            Columns(
                [n for n, s in zip(names, seen, strict=True) if s],
                swept[:, :-1][:, seen] / size[:-1][seen],
                swept[:, -1] / max(size[-1], 1e-12),
                problem.rows.trajectory[j],
            )
        )
    return joints, time.perf_counter() - start


def claims(columns: list[Columns], weights: list[dict[int, float]]) -> dict:
    """An answer: every kind with a chosen column, by the share of the torque that it takes.

    A weight is the column's coefficient; columns and torque have unit size, so its square is about
    the share that the column explains.
    """
    size: dict[tuple[str, tuple[int, ...]], float] = {}
    for c, chosen in zip(columns, weights, strict=True):
        for i, w in chosen.items():
            size[c.names[i]] = size.get(c.names[i], 0.0) + w * w
    effects = [
        {"kind": kind, "joints": list(joints), "parameters": {}, "variables": []}
        for kind, joints in sorted(size, key=lambda name: -size[name])
    ]
    return {"verdict": "missing" if effects else "complete", "effects": effects}
