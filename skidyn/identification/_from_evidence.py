# SPDX-License-Identifier: BSD-3-Clause
"""A fitted regressor from evidence alone, for data that does not fit into memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.evidence import Evidence, column_names, linear_terms
from skidyn.identification._constraints import BodyConstraints
from skidyn.identification._rbd_regressor import RBDRegressor
from skidyn.identification._regression import Regression, Solution
from skidyn.identification._weak_directions import keep_weak_directions
from skidyn.robots import Robot, find_base_parameters

#: Number of times that the noise of the joints is estimated and the fit repeated.
PASSES = 3


def regressor_from_evidence(
    robot: Robot,
    evidence: Evidence,
    effects: Iterable[Any] = ("viscous", "coulomb"),
    *,
    consistent: bool | BodyConstraints = False,
    feature_names: Sequence[str] | None = None,
) -> RBDRegressor:
    """Fitted regressor from evidence.

    Parameters
    ----------
    robot : Robot
        The robot of the evidence.
    evidence : Evidence
        From :func:`skidyn.evidence.evidence_from_motion` or
        :func:`skidyn.evidence.evidence_from_parquet`, with the same effects.
    effects : iterable of str, (str, joints) or Term, default=("viscous", "coulomb")
        Effects of the evidence.
    consistent : bool or BodyConstraints, default=False
        Require physically consistent bodies (positive definite pseudo-inertia), coefficients with
        admissible signs, and further constraints on the bodies.
    feature_names : sequence of str, optional
        Columns of the tables for prediction; by default ``time, trajectory, q1..qn, dq1..dqn``.
        Accelerations that are not among them are derived from the positions.

    Returns
    -------
    RBDRegressor
        Fitted; joints are weighted by their noise, iterated, and the standard errors come from
        leaving out one trajectory, or group of trajectories, at a time.

    Raises
    ------
    SkidynError
        The evidence has other columns than those of the robot and the effects.

    References
    ----------
    B. Efron, C. Stein (1981), The jackknife estimate of variance, Annals of Statistics 9(3),
    586-596.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.evidence import evidence_from_parquet
    >>> from skidyn.identification import regressor_from_evidence
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=3, duration=4.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     log.frame.to_parquet(pathlib.Path(folder, "log.parquet"))
    ...     evidence = evidence_from_parquet(folder, log.robot)
    >>> model = regressor_from_evidence(log.robot, evidence)
    >>> model.predict(log.X[list(model.feature_names_in_)]).shape == log.y.shape
    True
    """
    terms = linear_terms(effects, robot.n_joints)
    base = find_base_parameters(robot)
    if evidence.columns != column_names(robot, base.index, terms):
        raise SkidynError("the evidence has different columns than the robot and its effects")
    coefficients, noise = weighted_solution(evidence)
    signal_names = [f"{s}{j + 1}" for s in ("q", "dq") for j in range(robot.n_joints)]
    names = ["time", "trajectory", *signal_names] if feature_names is None else list(feature_names)

    model = RBDRegressor(robot, tuple(terms), consistent=consistent)
    model.robot_ = robot
    model.feature_names_in_ = np.asarray(names, dtype=object)
    model.n_features_in_ = len(names)
    model._one_output = False
    model.columns_ = model._resolve(len(names))
    model.evidence_ = evidence
    model.n_parts_ = 0
    model.recordings_ = []  # evidence contains no motion by which recordings could be recognised
    spread = np.array([noise.get(j, np.nan) for j in range(robot.n_joints)])
    every = Regression.from_evidence(evidence, robot, terms, whole=True)
    solution = Solution(coefficients, _left_out(evidence, noise), spread)
    model._store(every, keep_weak_directions(solution, np.arange(every.n_rigid), every))
    return model


def weighted_solution(evidence: Evidence) -> tuple[Array, dict[int, float]]:
    """Coefficients with joints weighted by their noise, and that noise.

    The noise is the root mean square residual of a row of every joint, N m or N.
    """
    noise = None
    for _ in range(PASSES):
        coefficients = evidence.solve(noise=noise)
        noise = {j: s + 1e-100 for j, s in evidence.noise(coefficients).items()}
    assert noise is not None
    return coefficients, noise


def _left_out(evidence: Evidence, noise: dict[int, float]) -> Array:
    """Coefficients without one trajectory each; empty if there is only one."""
    groups = evidence.trajectories
    left = [evidence.without(k).solve(noise=noise) for k in groups if len(groups) > 1]
    return np.array(left).reshape(-1, len(evidence.columns))
