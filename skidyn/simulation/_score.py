# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a simulated model, and comparison of two models by these errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.stats import t as student_t

from skidyn._exceptions import SkidynError
from skidyn._plain import plain
from skidyn._signals import Array
from skidyn.forward import STEP, Controller, ForwardModel, Task, read_task, run
from skidyn.identification import RBDRegressor

#: Seconds over which a model is simulated before it is reset to the log.
HORIZON = 1.0
#: Error, relative to that of a model without forces, beyond which a piece is lost.
FAR = 10.0


@dataclass(frozen=True)
class SimulationErrors:
    """Errors of a simulated motion.

    Parameters
    ----------
    joint_names : tuple of str
        Joints.
    units : tuple of str
        ``"rad"`` or ``"m"`` of each joint; velocities are these per second.
    horizon : float or None
        Length of the pieces, s; None where trajectories were simulated as a whole.
    position : ndarray of shape (n_joints,)
        Root mean square of simulated minus logged position, rad or m.
    velocity : ndarray of shape (n_joints,)
        The same of the velocity against the smoothed logged one, rad/s or m/s.
    final : ndarray of shape (n_joints,)
        Root mean square of the position error at the end of the pieces.
    resting : ndarray of shape (n_joints,)
        Position error of a model that keeps the initial velocity, as a baseline.
    pieces : ndarray of shape (n_pieces, n_joints)
        Root mean square position error of every piece; infinite where the motion grew without
        bound.
    trajectory : ndarray of shape (n_pieces,)
        Trajectory of every piece.

    Examples
    --------
    >>> from skidyn.simulation import SimulationErrors  # made by simulation_errors
    """

    joint_names: tuple[str, ...]
    units: tuple[str, ...]
    horizon: float | None
    position: Array
    velocity: Array
    final: Array
    resting: Array
    pieces: Array
    trajectory: Array

    @property
    def n_lost(self) -> int:
        """Pieces whose motion grew without bound."""
        return int(np.sum(~np.isfinite(self.pieces).all(axis=1)))

    @property
    def score(self) -> float:
        """Mean over the joints of the position error relative to :attr:`resting`."""
        return float(np.mean(self.position / np.maximum(self.resting, 1e-12)))

    @property
    def text(self) -> str:
        """Text of the errors, one line for each joint."""
        length = "whole trajectories" if self.horizon is None else f"{self.horizon:g} s"
        lines = [
            f"simulation over {length}, {len(self.pieces)} pieces: position error (at the end), "
            "velocity error, and position error of a model without forces"
        ]
        width = max(len(name) for name in self.joint_names)
        for j, name in enumerate(self.joint_names):
            unit = self.units[j]
            lines.append(
                f"  {name:{width}s}  {self.position[j]:.4g} ({self.final[j]:.4g}) {unit}, "
                f"{self.velocity[j]:.4g} {unit}/s, {self.resting[j]:.4g} {unit}"
            )
        if self.n_lost:
            lines.append(f"  {self.n_lost} piece(s) grew without bound; their errors are infinite")
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.text

    def to_dict(self) -> dict[str, Any]:
        """As plain numbers, for JSON.

        Returns
        -------
        dict
            All attributes, :attr:`score` and :attr:`text`; infinite numbers are None.
        """
        names = ("units", "horizon", "position", "velocity", "final", "resting")
        content: dict[str, Any] = {"schema": "skidyn.simulation/1", "joints": self.joint_names}
        content |= {name: getattr(self, name) for name in names}
        content |= {"n_pieces": len(self.pieces), "n_lost": self.n_lost, "score": self.score}
        return {key: plain(value) for key, value in {**content, "text": self.text}.items()}


def simulation_errors(
    model: RBDRegressor,
    X: Any,
    y: Any = None,
    *,
    controller: Controller | None = None,
    horizon: float | None = HORIZON,
    engine: Literal["own", "mujoco"] = "own",
    step: float = STEP,
) -> SimulationErrors:
    """Simulate a fitted model along a log and compute the errors of its motion.

    Every ``horizon`` seconds the model restarts from the logged state, because later motion from a
    wrong state gives no information about the forces.

    Parameters
    ----------
    model : RBDRegressor
        Fitted model; the log should not be the one to which it was fitted.
    X : DataFrame
        Held-out motion, as in :func:`simulate`.
    y : array-like of shape (n_samples, n_joints), optional
        Torque that drives the model, N m or N; not with a controller.
    controller : Controller, optional
        Drives the model toward ``q_ref1..`` instead of y.
    horizon : float, s, or None, default=1.0
        Length of the pieces; None for whole trajectories.
    engine : {"own", "mujoco"}, default="own"
        As in :func:`simulate`.
    step : float, default=0.002
        Longest step of the integrator, s.

    Returns
    -------
    SimulationErrors
        Position and velocity errors of every joint.

    Raises
    ------
    SkidynError
        As in :func:`simulate`.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> from skidyn.simulation import simulation_errors
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> model = RBDRegressor(log.robot).fit(log.X, log.y)
    >>> errors = simulation_errors(model, log.X[:400], log.y[:400], horizon=0.5)
    >>> errors.position.shape, bool(errors.score < 0.2)
    ((2,), True)
    """
    task = read_task(model, X, y, controller, horizon)
    if engine == "mujoco":
        from skidyn.simulation._mujoco import run_mujoco

        q, dq = run_mujoco(model, task, step)
    else:
        q, dq = run(ForwardModel(model), task, step)
    return errors_of(model, task, q, dq, horizon)


def errors_of(
    model: RBDRegressor, task: Task, q: Array, dq: Array, horizon: float | None
) -> SimulationErrors:
    """Errors of simulated pieces."""
    windows, signals = task.windows, task.signals
    valid = windows.valid.copy()
    valid[:, 0] = False  # the start is given
    logged_q, logged_dq = signals.q[windows.rows], signals.dq[windows.rows]
    lost = np.array(
        [not np.isfinite(x[v]).all() for x, v in zip(q, windows.valid, strict=True)], dtype=bool
    )
    weight = valid[..., None].astype(float)
    count = weight.sum(axis=1)

    def squares(error: Array) -> Array:
        return np.asarray((np.where(valid[..., None], error, 0.0) ** 2).sum(axis=1))

    since = (windows.time - windows.time[:, :1])[..., None]
    coasting = logged_q[:, :1] + since * logged_dq[:, :1]
    own, speed = squares(q - logged_q), squares(dq - logged_dq)
    rest = squares(coasting - logged_q)
    own[lost] = speed[lost] = np.inf
    last = windows.valid.sum(axis=1) - 1
    place = np.arange(len(last))
    end = q[place, last] - logged_q[place, last]
    end[lost] = np.inf
    total = count.sum(axis=0)
    robot = model.robot_
    return SimulationErrors(
        robot.joint_names,
        tuple("m" if kind == "prismatic" else "rad" for kind in robot.joint_types),
        horizon,
        np.sqrt(own.sum(axis=0) / total),
        np.sqrt(speed.sum(axis=0) / total),
        np.sqrt(np.mean(end**2, axis=0)),
        np.sqrt(rest.sum(axis=0) / total),
        np.sqrt(own / count),
        np.asarray(signals.trajectory[windows.rows[:, 0]], dtype=float),
    )


def pooled_errors(parts: list[SimulationErrors]) -> SimulationErrors:
    """Errors of several folds as those of one log."""
    share = np.array([len(part.pieces) for part in parts], dtype=float)
    share /= share.sum()

    def mean(name: str) -> Array:
        squares = [w * getattr(part, name) ** 2 for w, part in zip(share, parts, strict=True)]
        return np.asarray(np.sqrt(np.sum(squares, axis=0)))

    return SimulationErrors(
        parts[0].joint_names,
        parts[0].units,
        parts[0].horizon,
        mean("position"),
        mean("velocity"),
        mean("final"),
        mean("resting"),
        np.concatenate([part.pieces for part in parts]),
        np.concatenate([part.trajectory for part in parts]),
    )


def neg_simulation_error(estimator: RBDRegressor, X: Any, y: Any) -> float:
    """Scorer for scikit-learn: minus the simulation error over 1 s, relative to no forces.

    Parameters
    ----------
    estimator : RBDRegressor
        Fitted model.
    X : DataFrame
        Motion with ``time``.
    y : array-like of shape (n_samples, n_joints)
        Torque, N m or N.

    Returns
    -------
    float
        Minus the mean over the joints of the position error over that of a model that keeps its
        velocity. Greater is better; -1 is no better than no model, 0 is perfect.

    Examples
    --------
    >>> from sklearn.model_selection import cross_val_score
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> from skidyn.model_selection import TrajectoryKFold
    >>> from skidyn.simulation import neg_simulation_error
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=4.0)
    >>> scores = cross_val_score(
    ...     RBDRegressor(log.robot), log.X, log.y, scoring=neg_simulation_error,
    ...     cv=TrajectoryKFold(2),
    ... )
    >>> bool((scores > -0.3).all())
    True
    """
    return -simulation_errors(estimator, X, y).score


@dataclass(frozen=True)
class SimulationVerdict:
    """Influence of a change of a model on its simulated motion on a log.

    Parameters
    ----------
    before, after : SimulationErrors
        Without and with the change.
    change : float
        Mean over the pieces of the logarithm of the error after over that before; negative is
        better. Errors count up to ten times that of a model without forces.
    low, high : float
        95 % interval of the change, over trajectories if there are enough of them.
    joints : ndarray of shape (n_joints,)
        The change for every joint.

    Examples
    --------
    >>> from skidyn.simulation import SimulationVerdict  # made by judge_by_simulation
    """

    before: SimulationErrors
    after: SimulationErrors
    change: float
    low: float
    high: float
    joints: Array

    @property
    def worsens(self) -> bool:
        """Whether the simulated motion gets significantly worse."""
        return self.low > 0.0

    @property
    def improves(self) -> bool:
        """Whether the simulated motion gets significantly better."""
        return self.high < 0.0

    @property
    def text(self) -> str:
        """The verdict in a sentence."""
        low, high = (f"{100 * np.expm1(x):+.0f} %" for x in (self.low, self.high))
        lost = self.after.n_lost - self.before.n_lost
        more = f" With the change {lost} piece(s) grow without bound." if lost > 0 else ""
        said = "does not change significantly"
        if self.worsens or self.improves:
            said = "grows" if self.worsens else "falls"
        return (
            f"The error of the simulated motion {said}: {100 * np.expm1(self.change):+.0f} % "
            f"(95 %: {low} to {high}; {len(self.before.pieces)} pieces).{more}"
        )

    def __str__(self) -> str:
        return self.text


def judge_by_simulation(
    before: RBDRegressor,
    after: RBDRegressor,
    X: Any,
    y: Any = None,
    *,
    controller: Controller | None = None,
    horizon: float | None = HORIZON,
    step: float = STEP,
) -> SimulationVerdict:
    """Compare the simulated motion of two models on a held-out log.

    An effect that reduces the error of the torque may worsen the motion; a finding for which
    ``worsens`` is true should not be added for simulation.

    Parameters
    ----------
    before, after : RBDRegressor
        Fitted models without and with the change, of the same robot.
    X : DataFrame
        Held-out motion, as in :func:`simulate`.
    y : array-like of shape (n_samples, n_joints), optional
        Torque that drives the model, N m or N; not with a controller.
    controller : Controller, optional
        Drives the model toward ``q_ref1..`` instead of y.
    horizon : float, s, or None, default=1.0
        Length of the pieces; None for whole trajectories.
    step : float, default=0.002
        Longest step of the integrator, s.

    Returns
    -------
    SimulationVerdict
        With ``worsens``, ``improves`` and a sentence in ``text``. The error of a piece is the mean
        over its joints, each relative to the size of its motion. The interval is that of Student's
        t over trajectories, or over pieces where there are fewer than six trajectories.

    Raises
    ------
    SkidynError
        As in :func:`simulate`, or fewer than two pieces.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> from skidyn.simulation import judge_by_simulation
    >>> log = make_hidden_effect_log(load_planar_arm(), "spring", joints=[1], random_state=0)
    >>> train = log.frame["trajectory"] <= 4
    >>> plain = RBDRegressor(log.robot).fit(log.X[train], log.y[train])
    >>> with_spring = plain.with_effects([("spring", [1])]).fit(log.X[train], log.y[train])
    >>> test = log.frame["trajectory"] == 6
    >>> judge_by_simulation(plain, with_spring, log.X[test], log.y[test]).improves
    True
    """
    errors = []
    for model in (before, after):
        task = read_task(model, X, y, controller, horizon)
        if len(task.windows.rows) < 2:
            raise SkidynError(
                "one piece is not enough to distinguish a change from chance; give a longer log "
                "or a shorter horizon"
            )
        errors.append(errors_of(model, task, *run(ForwardModel(model), task, step), horizon))
    return compare_errors(*errors)


def compare_errors(before: SimulationErrors, after: SimulationErrors) -> SimulationVerdict:
    """Verdict on the errors of the same pieces, without and with a change."""
    errors = before, after
    scale = np.maximum(errors[0].resting, 1e-12)
    # Beyond FAR a motion is lost; its error is limited, so that a single piece does not dominate.
    joint_sizes = [np.minimum(e.pieces / scale, FAR) for e in errors]
    sizes = [np.sqrt(np.mean(size**2, axis=1)) for size in joint_sizes]
    ratio = np.log(sizes[1] + 1e-12) - np.log(sizes[0] + 1e-12)
    joints = np.log(joint_sizes[1] + 1e-12) - np.log(joint_sizes[0] + 1e-12)
    names = np.unique(errors[0].trajectory)
    if len(names) >= 6:
        ratio = np.array([ratio[errors[0].trajectory == k].mean() for k in names])
    change = float(ratio.mean())
    spread = float(ratio.std(ddof=1) / np.sqrt(len(ratio)))
    half = float(student_t.ppf(0.975, len(ratio) - 1)) * spread
    return SimulationVerdict(
        errors[0], errors[1], change, change - half, change + half, joints.mean(axis=0)
    )
