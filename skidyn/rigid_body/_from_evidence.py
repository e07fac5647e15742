# SPDX-License-Identifier: BSD-3-Clause
"""A fitted regressor from evidence alone, for data that never was in memory at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.effects import Term, get_effect
from skidyn.evidence._evidence import Evidence
from skidyn.evidence._streaming import linear_terms
from skidyn.rigid_body._base_parameters import find_base_parameters
from skidyn.rigid_body._consistency import make_consistent
from skidyn.rigid_body._rbd_regressor import RBDRegressor
from skidyn.robots import Robot

#: Times the noise of the joints is estimated anew and the fit repeated.
PASSES = 3


def regressor_from_evidence(
    robot: Robot,
    evidence: Evidence,
    effects: Iterable[Any] = ("viscous", "coulomb"),
    *,
    consistent: bool = False,
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
    consistent : bool, default=False
        Demand bodies that can exist (positive definite pseudo-inertia) and coefficients without
        forbidden signs.
    feature_names : sequence of str, optional
        Columns of the tables that will be predicted; by default
        ``time, trajectory, q1..qn, dq1..dqn``. Accelerations that are not among them are derived
        from the positions.

    Returns
    -------
    RBDRegressor
        Fitted; joints are weighted by their noise, iterated, and the standard errors come from
        leaving out one trajectory, or group of trajectories, at a time.

    Raises
    ------
    SkidynError
        Evidence of other columns than those of the robot and the effects.

    References
    ----------
    B. Efron, C. Stein (1981), The jackknife estimate of variance, Annals of Statistics 9(3),
    586-596.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.evidence import evidence_from_parquet
    >>> from skidyn.rigid_body import regressor_from_evidence
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
    n_rigid = len(base.index)
    widths = [len(get_effect(term.kind).coefficients) for term in terms]
    expected = tuple(robot.parameter_names[i] for i in base.index)
    if evidence.columns[:n_rigid] != expected or len(evidence.columns) != n_rigid + sum(widths):
        raise SkidynError("the evidence has other columns than the robot and its effects")
    coefficients, noise = weighted_solution(evidence)
    signal_names = [f"{s}{j + 1}" for s in ("q", "dq") for j in range(robot.n_joints)]
    names = ["time", "trajectory", *signal_names] if feature_names is None else list(feature_names)

    model = RBDRegressor(robot, tuple(terms), consistent=consistent)
    model.robot_ = robot
    model.feature_names_in_ = np.asarray(names, dtype=object)
    model.n_features_in_ = len(names)
    model._one_output = False
    model.columns_ = model._resolve(len(names))
    change = np.zeros(10 * robot.n_bodies)
    change[base.index] = coefficients[:n_rigid]
    model.inertial_parameters_ = robot.inertial_parameters + change.reshape(-1, 10)
    if consistent:
        model.inertial_parameters_, effect_coefficients = _consistent(
            robot, evidence, terms, noise, coefficients[n_rigid:]
        )
        coefficients = np.r_[coefficients[:n_rigid], effect_coefficients]
    model.effect_terms_ = terms
    at = n_rigid + np.cumsum([0, *widths])
    model.effect_coefficients_ = {
        term: coefficients[a:b] for term, a, b in zip(terms, at[:-1], at[1:], strict=True)
    }
    values = base.values(model.inertial_parameters_)
    model.base_parameters_ = dict(zip(base.expressions, map(float, values), strict=True))
    model.coef_names_ = [*base.expressions, *evidence.columns[n_rigid:]]
    model.coef_ = np.r_[values, coefficients[n_rigid:]]
    model.coef_std_ = _jackknife(evidence, noise)
    model.noise_std_ = np.array([noise.get(j, np.nan) for j in range(robot.n_joints)])
    model.evidence_ = evidence
    return model


def weighted_solution(evidence: Evidence) -> tuple[Array, dict[int, float]]:
    """Coefficients with joints weighted by their noise, and that noise.

    Parameters
    ----------
    evidence : Evidence
        Evidence.

    Returns
    -------
    coefficients : ndarray of shape (n_columns,)
        Of all columns.
    noise : dict of int to float
        Root mean square residual of a row of every joint, N m or N.
    """
    noise = None
    for _ in range(PASSES):
        coefficients = evidence.solve(noise=noise)
        noise = {j: s + 1e-100 for j, s in evidence.noise(coefficients).items()}
    assert noise is not None
    return coefficients, noise


def _consistent(
    robot: Robot, evidence: Evidence, terms: Sequence[Term], noise: dict[int, float], start: Array
) -> tuple[Array, Array]:
    """Bodies that can exist and coefficients of the right sign, closest to the evidence."""
    base = find_base_parameters(robot)
    weighted = [factor / noise[key[1]] for key, factor in evidence.factors.items()]
    triangle: Array = np.asarray(np.linalg.qr(np.vstack(weighted), mode="r"))
    rigid = triangle[:, : len(base.index)]
    # Columns of dependent parameters are combinations of those of the base parameters.
    factor = np.hstack([rigid @ base.regrouping, triangle[:, len(base.index) : -1]])
    target = triangle[:, -1] + rigid @ base.values(robot.inertial_parameters)
    signs = [c.sign for term in terms for c in get_effect(term.kind).coefficients]
    return make_consistent(robot.inertial_parameters, factor, target, np.array(signs), start)


def _jackknife(evidence: Evidence, noise: dict[int, float]) -> Array:
    groups = evidence.trajectories
    if len(groups) < 2:
        return np.full(len(evidence.columns), np.nan)
    left = np.array([evidence.without(k).solve(noise=noise) for k in groups])
    spread = np.sum((left - left.mean(0)) ** 2, axis=0)
    return np.asarray(np.sqrt((len(groups) - 1) / len(groups) * spread))
