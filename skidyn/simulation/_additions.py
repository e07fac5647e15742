# SPDX-License-Identifier: BSD-3-Clause
"""Judgement of additions to a model by its simulated motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import clone

from skidyn._columns import names_of_table
from skidyn._exceptions import SkidynError
from skidyn._keys import keys_of
from skidyn._order import taken
from skidyn.forward import Controller
from skidyn.identification import RBDRegressor
from skidyn.simulation._score import (
    HORIZON,
    SimulationErrors,
    SimulationVerdict,
    compare_errors,
    pooled_errors,
    simulation_errors,
)
from skidyn.simulation._servo import servo_torque

Rows = NDArray[np.intp]

#: Most folds; a single recording is cut into this many pieces of time.
_FOLDS = 5


def judge_additions(
    model: RBDRegressor,
    additions: Sequence[Iterable[Any]],
    X: Any,
    y: Any,
    *,
    controller: Controller | None = None,
    horizon: float | None = HORIZON,
) -> list[SimulationVerdict | None]:
    """Judge additions to a model by simulation of recordings that were left out of its fit.

    Recordings are left out fold by fold (a single recording in pieces of time); the model is fitted
    to the others without and with an addition, and simulated along those left out. Each addition is
    judged in addition to the previous ones that did not worsen the motion. All are fitted with
    ``consistent=True``: otherwise the inertia may be unsuitable for simulation.

    Parameters
    ----------
    model : RBDRegressor
        Model without the additions; need not be fitted.
    additions : sequence of iterables of str, (str, joints) or Term
        Effects that are added together, as for :meth:`RBDRegressor.with_effects`.
    X : DataFrame
        Motion with ``time`` (s), as in :func:`simulate`; with a controller also its reference.
    y : array-like of shape (n_samples, n_joints), N m or N
        Torque to which models are fitted, and which drives them unless a controller is given.
    controller : Controller, optional
        Drives the models toward ``q_ref1..`` instead of y.
    horizon : float, s, or None, default=1.0
        Length of the pieces that are simulated; None for whole trajectories.

    Returns
    -------
    list of SimulationVerdict or None
        For every addition; None if simulation gives no evidence: it cannot be simulated, or the
        simulated motion deviates more from the logged one than that of a model without forces, both
        with and without the addition.

    Raises
    ------
    SkidynError
        The log has no time, or is too short to leave a part of it out.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> from skidyn.simulation import judge_additions
    >>> log = make_hidden_effect_log(
    ...     load_planar_arm(), "spring", joints=[1], n_trajectories=3, duration=3.0
    ... )
    >>> model = RBDRegressor(log.robot, ("viscous", "coulomb"))
    >>> verdicts = judge_additions(model, [[("spring", [1])]], log.X, log.y)
    >>> verdicts[0].improves
    True
    """
    judged = judge_in_turn(model, additions, X, y, controller=controller, horizon=horizon)
    return judged.verdicts


@dataclass(frozen=True)
class Setting:
    """A setting of the servo of one joint that differs from the stated one.

    It changes both the torque of the servos, to which a model is fitted, and the controller that
    drives the simulated motion. Joints are counted from 1; values are by the names of the arguments
    of :class:`Controller`.
    """

    joint: int
    values: Mapping[str, float]


@dataclass(frozen=True)
class InTurn:
    """Results of additions one by one, and together.

    ``verdicts`` are in addition to previous ones that did not worsen the motion, None if simulation
    gives no evidence; ``compared`` has a verdict also then, and None only if the addition cannot be
    simulated. ``added`` are those of the last model, which neither worsen the motion nor cannot be
    simulated; ``together`` compares it with the model without any.
    """

    verdicts: list[SimulationVerdict | None]
    added: list[bool]
    together: SimulationVerdict
    compared: list[SimulationVerdict | None] = field(default_factory=list)

    @property
    def silent(self) -> bool:
        """Whether both motions deviate more from the log than that of a model without forces."""
        return min(_typical(self.together.before), _typical(self.together.after)) >= 1.0


def judge_in_turn(
    model: RBDRegressor,
    additions: Sequence[Iterable[Any] | Setting],
    X: Any,
    y: Any,
    *,
    controller: Controller | None = None,
    horizon: float | None = HORIZON,
    servos: Controller | None = None,
) -> InTurn:
    """Judge additions like :func:`judge_additions`, and also their common result.

    An addition may also be a setting of a servo. ``servos`` is then the controller as stated, whose
    torque replaces y until a setting is added.
    """
    folds = _folds(model, X)
    torque = np.asarray(y, dtype=float) if servos is None else servo_torque(servos, X)
    controller = controller if controller is None or servos is None else servos
    if model.consistent is False:
        model = clone(model).set_params(consistent=True)
    used: list[Any] = []
    first = errors = _held_out(model, used, X, torque, folds, controller, horizon)
    verdicts: list[SimulationVerdict | None] = []
    compared: list[SimulationVerdict | None] = []
    added = []
    for addition in additions:
        terms, given, drive, stated = used, torque, controller, servos
        if isinstance(addition, Setting):
            assert servos is not None
            n = torque.shape[1]
            stated = servos.with_joint(n, addition.joint, **addition.values)
            given = servo_torque(stated, X)
            drive = None if controller is None else stated
        else:
            terms = [*used, *addition]
        try:
            after = _held_out(model, terms, X, given, folds, drive, horizon)
        except SkidynError:
            verdicts.append(None)
            compared.append(None)
            added.append(False)
            continue
        verdict = compare_errors(errors, after)
        compared.append(verdict)
        verdicts.append(verdict if min(_typical(errors), _typical(after)) < 1.0 else None)
        added.append(verdicts[-1] is None or not verdict.worsens)
        if added[-1]:
            used, errors, torque, controller, servos = terms, after, given, drive, stated
    return InTurn(verdicts, added, compare_errors(first, errors), compared)


def _folds(model: RBDRegressor, X: Any) -> list[tuple[Rows, Rows]]:
    """Rows to fit and rows to simulate: recording by recording, or pieces of a single one."""
    from skidyn.model_selection import held_out_folds  # its import takes 0.2 s

    names = names_of_table(X)
    column = keys_of(X, trajectory=model.trajectory, time=model.time).trajectory
    number = np.zeros(len(X)) if column is None else np.asarray(X[names[column]])
    return held_out_folds(number, _FOLDS)


def _held_out(
    model: RBDRegressor,
    terms: Sequence[Any],
    X: Any,
    y: Any,
    folds: Sequence[tuple[Rows, Rows]],
    controller: Controller | None,
    horizon: float | None,
) -> SimulationErrors:
    """Errors of the simulated motion of every fold, by a model that has not seen it."""
    found = []
    for others, rows in folds:
        fitted = model.with_effects(terms).fit(taken(X, others), y[others])
        drive = None if controller is not None else y[rows]
        found.append(
            simulation_errors(fitted, taken(X, rows), drive, controller=controller, horizon=horizon)
        )
    return pooled_errors(found)


def _typical(errors: SimulationErrors) -> float:
    """Error of the median piece, relative to that of a model without forces."""
    sizes = errors.pieces / np.maximum(errors.resting, 1e-12)
    return float(np.median(np.sqrt(np.mean(sizes**2, axis=1))))
