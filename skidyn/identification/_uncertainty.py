# SPDX-License-Identifier: BSD-3-Clause
"""Uncertainty of a fitted model: bootstrapped coefficients, and bands around predictions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted

from skidyn._exceptions import SkidynError
from skidyn._signals import Array, Signals
from skidyn.effects import Term, TermSum
from skidyn.evidence import REST, RIDGE, window_rows
from skidyn.robots import Robot

if TYPE_CHECKING:
    from skidyn.identification._prediction import Prediction
    from skidyn.identification._rbd_regressor import RBDRegressor
    from skidyn.identification._regression import Regression, Solution

#: Fewest trajectories from which a bootstrap can draw.
FEWEST = 5
#: Most samples on which bands are calibrated; more would not change a quantile.
MOST_SAMPLES = 20_000
#: Fewest samples of a joint at rest, or moving, for quantiles of their own.
FEWEST_SAMPLES = 100
#: Probabilities at which the distribution of the left-out errors is kept.
LEVELS = np.linspace(0.0, 1.0, 401)
CHUNK = 4096


def bootstrap_coefficients(
    model: RBDRegressor, n_draws: int = 1000, *, random_state: Any = None
) -> Array:
    """Coefficients of a model fitted to trajectories drawn with replacement.

    Whole trajectories are drawn [1]_, which requires no assumption on the noise within a
    trajectory. The data is not needed again: every draw is a sum of the Gram matrices of
    trajectories.

    Parameters
    ----------
    model : RBDRegressor
        Fitted to at least five trajectories.
    n_draws : int, default=1000
        Number of draws.
    random_state : int, RandomState instance or None, default=None
        Seed of the draws.

    Returns
    -------
    ndarray of shape (n_draws, n_coefficients)
        Draws of ``model.coef_``, in its order. Their standard deviation is a standard error, their
        quantiles are an interval.

    Raises
    ------
    SkidynError
        Fewer than five trajectories.

    References
    ----------
    .. [1] A. C. Cameron, J. B. Gelbach, D. L. Miller, "Bootstrap-based improvements for inference
       with clustered errors", Review of Economics and Statistics 90(3), 2008.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor, bootstrap_coefficients
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=6, duration=4.0)
    >>> model = RBDRegressor(log.robot).fit(log.X, log.y)
    >>> draws = bootstrap_coefficients(model, random_state=0)
    >>> draws.shape == (1000, len(model.coef_))
    True
    """
    check_is_fitted(model)
    evidence = model.evidence_
    names = evidence.trajectories
    if len(names) < FEWEST:
        raise SkidynError(
            f"the model was fitted to {len(names)} trajectories; a bootstrap draws from at least "
            f"{FEWEST}. Number the blocks of a long recording as trajectories"
        )
    used = np.array(
        [np.any([f[:, k] for f in evidence.factors.values()]) for k in range(len(evidence.columns))]
    )
    keep = np.append(np.flatnonzero(used), len(used))
    p = len(keep) - 1
    grams = np.zeros((len(names), p + 1, p + 1))
    for (name, joint), factor in evidence.factors.items():
        part = factor[:, keep] / model.noise_std_[joint]
        grams[names.index(name)] += part.T @ part
    whole, draws = _solved(grams, n_draws, check_random_state(random_state))
    # Few clusters have a smaller spread than their population.
    spread = (draws - whole) * np.sqrt(len(names) / (len(names) - 1))
    return np.asarray(model.coef_ + spread[:, _positions(model, keep[:-1])])


def _solved(grams: Array, n_draws: int, rng: np.random.RandomState) -> tuple[Array, Array]:
    n, p = len(grams), grams.shape[1] - 1
    total = grams.sum(0)
    scale = np.sqrt(np.maximum(np.diag(total)[:p], 1e-300))
    flat = (grams[:, :p] / scale[:, None] / np.append(scale, 1.0)).reshape(n, -1)

    def solve(weights: Array) -> Array:
        normal = (weights @ flat).reshape(len(weights), p, p + 1)
        left = normal[..., :p] + RIDGE * n * np.eye(p)
        return np.asarray(np.linalg.solve(left, normal[..., p:])[..., 0] / scale)

    weights = rng.multinomial(n, np.full(n, 1 / n), size=n_draws).astype(float)
    parts = [solve(weights[k : k + 64]) for k in range(0, n_draws, 64)]
    return solve(np.ones((1, n)))[0], np.vstack(parts)


def _positions(model: RBDRegressor, kept: NDArray[np.int64]) -> list[int]:
    """Positions of the coefficients of a model among the kept columns of its evidence."""
    from skidyn.robots import find_base_parameters

    base = find_base_parameters(model.robot_)
    own = [model.robot_.parameter_names[i] for i in base.index]
    expression = dict(zip(own, base.expressions, strict=True))
    names = [expression.get(name, name) for name in model.evidence_.columns]
    place = {names[k]: i for i, k in enumerate(kept)}
    return [place[name] for name in model.coef_names_]


@dataclass(frozen=True)
class PredictionBands:
    """Prediction bands from the errors of left-out folds.

    An error is measured in units of its scale: the root of the sum of the squared left-out error of
    the joint, at rest or moving, and the variance of the prediction by the spread of the
    coefficients, which grows outside the motion of the log. The distribution of these ratios gives
    the bands (cross-conformal prediction).

    Parameters
    ----------
    rigid_index : ndarray of shape (n_rigid,)
        Columns of the torque regressor that are coefficients.
    terms : tuple of Term
        Effects, whose coefficients follow.
    spread : ndarray of shape (n_rows, n_coefficients)
        Its Gram matrix is the covariance of the coefficients: by the jackknife, and of undetermined
        directions.
    scale : ndarray of shape (2, n_joints)
        Root mean square left-out error at rest and moving, N m or N.
    ratios : ndarray of shape (2, n_joints, n_levels)
        Quantiles of error over scale at rest and moving.
    rmse : ndarray of shape (2, n_joints)
        Root mean square left-out error of samples, and of averages over short windows, N m or N.

    References
    ----------
    V. Vovk (2015), Cross-conformal predictors, Annals of Mathematics and Artificial Intelligence
    74, 9-28.
    """

    rigid_index: NDArray[np.int64]
    terms: tuple[Term, ...]
    spread: Array
    scale: Array
    ratios: Array
    rmse: Array

    @classmethod
    def calibrate(
        cls,
        model: RBDRegressor,
        signals: Signals,
        torque: Array,
        regression: Regression,
        solution: Solution,
        folds: Callable[[NDArray[np.int64]], NDArray[np.int64]],
        weight: Array | None = None,
    ) -> PredictionBands:
        """Bands from the errors of every fold under the coefficients fitted without it.

        The coefficients of the model are stored already; the motion is smoothed. ``folds`` gives
        the fold of samples by joint, from (k,) to (k, n_joints); ``weight`` is that of every sample
        in ``rmse``.
        """
        terms = regression.terms
        rows = np.arange(0, signals.n_samples, -(-signals.n_samples // MOST_SAMPLES))
        fold = folds(rows)
        weight = None if weight is None else weight[rows]
        if all(term.is_pointwise for term in terms):
            signals, torque, rows = signals.take(rows), torque[rows], np.arange(len(rows))
        signals = _with_load(model, terms, signals.with_(robot=model.robot_))
        left = solution.left_out
        spread = solution.spread
        error = (torque - model._torque(signals))[rows]
        width = np.empty_like(error)
        change = left - solution.coefficients
        for here, j, block in _columns(model.robot_, signals, regression.rigid_index, terms, rows):
            width[here, j] = np.linalg.norm(spread @ block, axis=0)
            # every sample with the change of its own fold
            error[here, j] -= np.einsum("ps,sp->s", block, change[fold[here, j]])
        scale, ratios = _distribution(error, width, _moving(signals)[rows])
        rmse = _root_mean_squares(error, signals.take(rows), weight)
        return cls(regression.rigid_index, tuple(terms), spread, scale, ratios, rmse)

    def std(self, model: Prediction, signals: Signals) -> Array:
        """Scale of the error of a prediction, shape (n_samples, n_joints), N m or N."""
        signals = _with_load(model, self.terms, signals)
        rows = np.arange(signals.n_samples)
        width = np.empty(signals.q.shape)
        for here, j, block in _columns(model.robot_, signals, self.rigid_index, self.terms, rows):
            width[here, j] = np.linalg.norm(self.spread @ block, axis=0)
        own: Array = np.where(_moving(signals), self.scale[1], self.scale[0])
        std: Array = np.hypot(width, own)
        return std

    def half_width(self, model: Prediction, signals: Signals, level: float) -> Array:
        """Half width of the band that holds a share of the measurements, N m or N."""
        if not 0 < level < 1:
            raise ValueError(f"level={level}; expected a share between 0 and 1, such as 0.95")
        ratio = np.array([[np.interp(level, LEVELS, own) for own in kind] for kind in self.ratios])
        wide: Array = np.where(_moving(signals), ratio[1], ratio[0])
        return self.std(model, signals) * wide


def find_bands(model: Prediction) -> PredictionBands:
    """Bands of a model.

    A SkidynError is raised if it was made from evidence, which contains no single samples.
    """
    if not hasattr(model, "bands_"):
        raise SkidynError(
            "this model has no errors of single samples because it was made from evidence or in "
            "parts. Use fit for bands around predictions"
        )
    return model.bands_


def _with_load(model: Prediction, terms: Iterable[Term], signals: Signals) -> Signals:
    """Signals with the torques of the model, if some of the effects need them."""
    if not any(term.effect.needs_fit for term in terms):
        return signals
    load = model.rigid_body_torque(signals.q, signals.dq, signals.ddq)
    total = load.copy()
    for term, blocks in model._effects(signals, total):
        if term.effect.on_bodies:
            for j, block in blocks.items():
                load[:, j] += block @ model.effect_coefficients_[term]
    return signals.with_(
        load=load,
        model_torque=total,
        smooth_torque=total,
        inertial_parameters=model.inertial_parameters_,
    )


def _moving(signals: Signals) -> NDArray[np.bool_]:
    return np.asarray(np.abs(signals.dq) > REST * signals.unit)


def _columns(
    robot: Robot,
    signals: Signals,
    rigid_index: NDArray[np.int64],
    terms: Sequence[Term],
    rows: NDArray[np.int64],
) -> Iterator[tuple[slice, int, Array]]:
    """Columns of some samples of a joint, (n_coefficients, n_chunk), chunk by chunk."""
    effects = [
        {j: block[rows] for j, block in term.torque_columns(signals).items()} for term in terms
    ]
    arrays = {name: getattr(signals, name)[rows] for name in ("q", "dq", "ddq")}
    n_rigid = len(rigid_index)
    spare = TermSum(terms).width
    chunks: Iterator[tuple[slice, Array]]
    if n_rigid:
        columns = tuple(int(i) for i in rigid_index)
        chunks = robot._engine.iter_regressor_columns(arrays, columns, spare, CHUNK)
    else:
        chunks = (
            (slice(a, a + CHUNK), np.empty((robot.n_joints, spare, CHUNK)))
            for a in range(0, len(rows), CHUNK)
        )
    for where, found in chunks:
        where = slice(where.start, min(where.stop, len(rows)))
        found = found[..., : where.stop - where.start]
        found[:, n_rigid:] = 0.0
        for blocks, (_, own) in zip(effects, TermSum(terms).slices(n_rigid), strict=True):
            for j, block in blocks.items():
                found[j, own] = block[where].T
        for j, block in enumerate(found):
            yield where, j, block


def _root_mean_squares(error: Array, signals: Signals, weight: Array | None) -> Array:
    """Root mean square error of samples, and of averages over short windows."""
    weight = np.ones(len(error)) if weight is None else weight
    windows = window_rows(signals, np.repeat(weight[:, None] > 0, signals.n_joints, axis=1))
    windows = windows.weighted(weight)
    averaged = [windows.average(e, j) for j, e in enumerate(error.T)]
    of_samples = np.average(error**2, axis=0, weights=weight)
    of_averages = np.array([np.mean(a**2) if len(a) else 0.0 for a in averaged])
    rmse: Array = np.sqrt(np.stack([of_samples, of_averages])) + 1e-100
    return rmse


def _distribution(error: Array, width: Array, moving: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Scale of the errors at rest and moving, and quantiles of the ratio of error to scale."""
    n_joints = error.shape[1]
    scale, ratios = np.empty((2, n_joints)), np.empty((2, n_joints, len(LEVELS)))
    for j in range(n_joints):
        for kind in (0, 1):
            here = moving[:, j] == bool(kind)
            if here.sum() < FEWEST_SAMPLES:
                here[:] = True  # too few of this kind: use both
            e, w = error[here, j], width[here, j]
            scale[kind, j] = np.sqrt(np.mean(e**2)) + 1e-100
            ratios[kind, j] = np.quantile(np.abs(e) / np.hypot(w, scale[kind, j]), LEVELS)
    return scale, ratios
