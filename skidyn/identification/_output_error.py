# SPDX-License-Identifier: BSD-3-Clause
"""The output-error estimator: coefficients that fit the simulated motion to the log.

Least squares of the torque treats the motion as exact and is biased by its errors. Here the model
is driven by the torque, or by commands through a controller, and the motions are compared [1]_.
Gauss-Newton steps, among the models that the constraints allow, start from the least-squares
solution; the sensitivities are differences of models that are simulated together, with the same
steps and the same exchanges of sticking and sliding.

References
----------
.. [1] A. Janot, P.-O. Vandanjon, M. Gautier (2014), A generic instrumental variable approach for
   industrial robot identification, IEEE Trans. Control Systems Technology 22(1), 132-145.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from skidyn._exceptions import SkidynError
from skidyn._progress import tell
from skidyn._signals import Array, Signals
from skidyn.effects import TermSum
from skidyn.forward import Controller, ForwardModel, Task, commanded, make_windows, run
from skidyn.identification._motion_steps import MotionSteps
from skidyn.identification._regression import Regression, Solution
from skidyn.robots import find_base_parameters

#: Step of the simulation, s; faster logs are thinned, with averaged torque.
STEP = 5e-3
#: Most Gauss-Newton steps, and the decrease of the logarithm of the errors that ends them.
ROUNDS, SMALL = 30, 5e-4


def refine_by_simulation(
    model: Any,
    regression: Regression,
    solution: Solution,
    signals: Signals,
    torque: Array,
    horizon: float | None,
    controller: Controller | None = None,
    reference: Array | None = None,
) -> Solution:
    """Coefficients with the least error of the simulated motion, from those of a fitted model.

    Pieces of ``horizon`` s are simulated, or whole trajectories. A controller drives the models
    toward the reference (rad or m) in place of the torque (N m or N). A SkidynError is raised if
    there is no time or the model cannot be simulated.
    """
    if signals.time is None:
        raise SkidynError("estimator='output_error' simulates and needs the column 'time' (s) in X")
    if model.consistent:
        solution = _as_stored(model, regression, solution)
    thin, driven, rows = _thinned(signals, torque)
    windows = make_windows(thin, horizon)
    if controller is None or reference is None:
        task = Task(thin, windows, driven)
    else:
        task = commanded(thin, windows, controller, reference[rows])
    error = _OutputError.of(model, regression, solution, task)
    length = 1.0 if horizon is None else min(horizon, 1.0)
    span = float(windows.steps[windows.valid[:, 1:]].sum())
    inside, count = error.forward.inside, max(span / length, 1.0)
    steps = MotionSteps.of(model, inside, regression, solution, error.free, torque, count)
    theta, bodies = solution.coefficients[error.free], model.inertial_parameters_
    residual = error.residuals(theta[None])[0]
    for round_ in range(ROUNDS):
        tell("Refining by simulation", round_ / ROUNDS)
        moved = error.residuals(theta + np.diag(error.steps))
        slopes = (moved - residual) / error.steps[:, None, None, None]
        tried, there = steps.tried(theta, slopes, residual)
        left = error.residuals(tried)
        costs = steps.cost(tried, left)
        best = int(np.argmin(costs))
        fall = float(steps.cost(theta, residual) - costs[best])
        if not fall > 0.0:
            break
        theta, residual, bodies = tried[best], left[best], there[best]
        if fall < SMALL * steps.count * residual.shape[-1]:
            break
    left_out = steps.left_out(theta, slopes, residual, error.fold, error.n_folds)
    coefficients = error.coefficients(theta)
    others = solution.left_out - solution.coefficients
    spread = coefficients + others  # others keep their spread
    spread[:, error.free] = left_out
    consistent = bool(model.consistent)
    return replace(
        solution,
        coefficients=coefficients,
        left_out=spread,
        parameters=bodies if consistent else None,
        consistent=consistent,
    )


def _as_stored(model: Any, regression: Regression, solution: Solution) -> Solution:
    """The solution moved to the bodies of the model, which are possible and can be simulated."""
    base = find_base_parameters(model.robot_)
    where = np.searchsorted(base.index, regression.rigid_index)
    coefficients = model.coef_.copy()
    coefficients[: regression.n_rigid] -= base.values(model.robot_.inertial_parameters)[where]
    moved = coefficients - solution.coefficients
    return replace(solution, coefficients=coefficients, left_out=solution.left_out + moved)


@dataclass
class _OutputError:
    """Simulated minus logged motion as a function of changes of the coefficients."""

    forward: ForwardModel
    task: Task
    start: Array
    free: Array
    steps: Array
    parameters: Array
    rigid_index: NDArray[np.int64]
    inside: Array
    fold: NDArray[np.int64]
    n_folds: int
    derived: bool

    @classmethod
    def of(
        cls,
        model: Any,
        regression: Regression,
        solution: Solution,
        task: Task,
    ) -> _OutputError:
        forward = ForwardModel(model, free=True)
        n_rigid = regression.n_rigid
        places = dict(TermSum(regression.terms).slices(n_rigid))
        inside = [np.arange(places[t].start, places[t].stop) for t in forward.inside]
        inside_index = np.concatenate([np.zeros(0, dtype=int), *inside])
        identified = model.parameters == "identified"
        free = np.concatenate([np.arange(n_rigid if identified else 0), inside_index]).astype(int)
        scale = np.abs(solution.coefficients[free])
        spread = np.nan_to_num(solution.std[free])
        steps = np.maximum(1e-2 * spread, 1e-4 * scale)
        steps = np.where(steps > 0, steps, 1e-6)
        return cls(
            forward,
            task,
            solution.coefficients.copy(),
            free,
            steps,
            model.robot_.inertial_parameters,
            regression.rigid_index,
            inside_index,
            _folds(task.signals, regression.n_folds)[task.windows.rows],
            regression.n_folds,
            model._smooths(),
        )

    def coefficients(self, theta: Array) -> Array:
        """All coefficients with these free ones."""
        whole = self.start.copy()
        whole[self.free] = theta
        return whole

    def residuals(self, thetas: Array) -> Array:
        """Errors of the motion, shape (n_models, n_pieces, n_samples, n_joints or twice that)."""
        wholes = np.array([self.coefficients(theta) for theta in thetas])
        change = np.zeros((len(wholes), self.parameters.size))
        change[:, self.rigid_index] = wholes[:, : len(self.rigid_index)]
        parameters = self.parameters + change.reshape(-1, *self.parameters.shape)
        rows = self.forward.parameter_rows(parameters, wholes[:, self.inside])
        q, dq = run(self.forward, self.task, 2 * STEP, rows)
        signals, windows = self.task.signals, self.task.windows
        logged = np.concatenate([signals.q[windows.rows], signals.dq[windows.rows]], axis=2)
        motion = np.concatenate([q, dq], axis=2).reshape(len(thetas), *logged.shape)
        if self.derived:  # velocities derived from the positions contain no further information
            n = self.forward.n
            motion, logged = motion[..., :n], logged[..., :n]
        error = motion - logged
        # A motion that diverges has a very large error, which has to stay finite.
        bound = 10.0 * (np.ptp(logged, axis=(0, 1)) + 1e-9)
        error = np.clip(np.where(np.isfinite(error), error, bound), -bound, bound)
        return np.asarray(error * windows.valid[..., None])


def _folds(signals: Signals, n_folds: int) -> NDArray[np.int64]:
    """Fold of every sample: whole trajectories, or intervals of few of them."""
    names, label = np.unique(signals.trajectory, return_inverse=True)
    if len(names) >= n_folds:
        return np.asarray(label * n_folds // len(names))
    blocks = n_folds // len(names)
    fold = np.empty(len(label), dtype=np.int64)
    for k in range(len(names)):
        own = np.flatnonzero(label == k)
        fold[own] = k * blocks + np.arange(len(own)) * blocks // len(own)
    return fold


def _thinned(signals: Signals, torque: Array) -> tuple[Signals, Array, NDArray[np.int64]]:
    """Samples about :data:`STEP` apart; the torque is averaged between them."""
    rows, smooth = [], torque.copy()
    for own in signals.segments:
        step = float(np.median(np.diff(signals.clock[own]))) if own.stop - own.start > 1 else STEP
        every = max(1, round(STEP / step))
        rows.append(np.arange(own.start, own.stop)[::every])
        if every > 1:
            smooth[own] = uniform_filter1d(torque[own], every, axis=0, mode="nearest")
    index = np.concatenate(rows)
    return signals.take(index), smooth[index], index
