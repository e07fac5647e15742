# SPDX-License-Identifier: BSD-3-Clause
"""Optimal excitation: the motion within the robot's limits that tells most about its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from skidyn._exceptions import SkidynError
from skidyn._signals import Array, Signals
from skidyn.effects import get_effect, make_terms
from skidyn.excitation._fourier import fourier, product, rest_window
from skidyn.rigid_body._base_parameters import base_parameter_index
from skidyn.robots import Robot

if TYPE_CHECKING:
    import pandas as pd

#: Samples at which a candidate is judged, and rate in Hz at which the result is checked.
JUDGED_SAMPLES, CHECK_RATE = 250, 500.0
#: Random starts, and iterations of the descent from the best of them.
STARTS, ITERATIONS = 40, 25
#: Share of each limit that is used, so that a tracking error does not break it.
MARGIN = 0.95
#: Added to the normalised information matrix: what no motion shows must not dominate.
RIDGE = 1e-9

#: Says which positions, shape (n_samples, 3) in m, the last body may take.
Workspace = Callable[[Array], Any] | Sequence[Sequence[float]]


@dataclass(frozen=True)
class MotionLimits:
    """What a motion may reach.

    Parameters
    ----------
    position : array of shape (n_joints, 2), rad or m, optional
        Lowest and highest position; those of the URDF by default, and +-pi where it has none.
    velocity : array of shape (n_joints,), rad/s or m/s, optional
        Those of the URDF by default, and 2 where it has none.
    acceleration : array of shape (n_joints,), rad/s^2 or m/s^2, optional
        Four times the velocity per second by default.
    torque : array of shape (n_joints,), N m or N, optional
        On the torque of the rigid body with the nominal parameters; that of the URDF by default.
    workspace : box of shape (3, 2) in m, or callable, optional
        Where the origin of the last body may be, in the base frame: a box, or a function that
        returns True for every allowed position of shape (n_samples, 3).

    Examples
    --------
    >>> MotionLimits(velocity=[1.0, 1.0]).velocity
    [1.0, 1.0]
    """

    position: Any = None
    velocity: Any = None
    acceleration: Any = None
    torque: Any = None
    workspace: Workspace | None = None

    def resolved(self, robot: Robot) -> MotionLimits:
        """Every limit as an array, from the URDF where none is given.

        Parameters
        ----------
        robot : Robot
            Robot.

        Returns
        -------
        MotionLimits
            With arrays in place of None, except for the workspace.

        Raises
        ------
        SkidynError
            A limit has the wrong shape or leaves no room.
        """
        n = robot.n_joints
        free = np.isfinite(robot.position_limits)
        fallback = np.tile([-np.pi, np.pi], (n, 1))
        position = np.where(free, robot.position_limits, fallback)
        velocity = np.where(np.isfinite(robot.velocity_limits), robot.velocity_limits, 2.0)
        velocity = np.where(velocity > 0, velocity, 2.0)
        effort = np.where(robot.effort_limits > 0, robot.effort_limits, np.inf)
        given = {
            "position": (self.position, position, (n, 2)),
            "velocity": (self.velocity, velocity, (n,)),
            "torque": (self.torque, effort, (n,)),
        }
        values = {name: _array(name, *item) for name, item in given.items()}
        values["acceleration"] = _array(
            "acceleration", self.acceleration, 4.0 * values["velocity"], (n,)
        )
        if np.any(values["position"][:, 0] >= values["position"][:, 1]):
            joint = int(np.argmax(values["position"][:, 0] >= values["position"][:, 1]))
            raise SkidynError(
                f"position limits of joint {joint + 1} ({robot.joint_names[joint]}) leave no room: "
                f"{values['position'][joint].tolist()}"
            )
        return MotionLimits(workspace=self.workspace, **values)


def _array(name: str, given: Any, default: Array, shape: tuple[int, ...]) -> Array:
    value = default if given is None else np.asarray(given, dtype=float)
    if value.shape != shape:
        raise SkidynError(f"the {name} limits have shape {value.shape}; {shape} is expected")
    return value


@dataclass(frozen=True)
class Excitation:
    """A motion for identification.

    Parameters
    ----------
    robot : Robot
        Robot it is made for.
    duration : float, s
        Length.
    base_frequency : float, Hz
        Frequency of the first harmonic.
    middle : ndarray of shape (n_joints,), rad or m
        Pose at start and end.
    weights : ndarray of shape (n_joints, 2 n_harmonics)
        Weights of the Fourier series, rad or m.
    blend : float, s
        Time of blending from and to rest.
    condition_number : float
        Of the base regressor, columns scaled to equal length; recordings already made included.
    log_determinant : float
        Of its information matrix.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> excitation = design_excitation(load_planar_arm(), duration=5.0, iterations=2)
    >>> time, q, dq, ddq = excitation.sample(rate=100.0)
    >>> q.shape
    (501, 2)
    """

    robot: Robot = field(repr=False)
    duration: float
    base_frequency: float
    middle: Array = field(repr=False)
    weights: Array = field(repr=False)
    blend: float
    condition_number: float = np.nan
    log_determinant: float = np.nan

    def sample(self, rate: float) -> tuple[Array, Array, Array, Array]:
        """The motion at even times.

        Parameters
        ----------
        rate : float, Hz
            Samples per second.

        Returns
        -------
        time : ndarray of shape (n_samples,), s
        q, dq, ddq : ndarray of shape (n_samples, n_joints)
            Position, velocity and acceleration, SI units.
        """
        time = np.arange(0.0, self.duration - 1e-6 / rate, 1 / rate)
        time = np.append(time, self.duration)  # the motion ends at rest, whatever the rate
        return time, *self._at(time)

    def _at(self, time: Array) -> tuple[Array, Array, Array]:
        window = rest_window(time, self.duration, self.blend)
        omega = 2 * np.pi * self.base_frequency
        waves = [product(window, fourier(time, omega, w)) for w in self.weights]
        q, dq, ddq = np.stack(waves, axis=2)
        return q + self.middle, dq, ddq

    def to_frame(self, rate: float) -> pd.DataFrame:
        """Table of the motion.

        Parameters
        ----------
        rate : float, Hz
            Samples per second.

        Returns
        -------
        DataFrame
            Columns ``time, q1.., dq1.., ddq1..``.
        """
        from skidyn._optional import import_optional

        pandas = import_optional("pandas", extra="io")
        time, *states = self.sample(rate)
        n = self.robot.n_joints
        names = [f"{s}{j + 1}" for s in ("q", "dq", "ddq") for j in range(n)]
        table = pandas.DataFrame(np.hstack(states), columns=names)
        table.insert(0, "time", time)
        return table

    def to_csv(self, path: str | Path, rate: float = 100.0) -> None:
        """Write the motion as CSV, in one step.

        Parameters
        ----------
        path : path
            File to write.
        rate : float, Hz, default=100
            Samples per second.
        """
        from skidyn.report._write import write_text

        write_text(path, self.to_frame(rate).to_csv(index=False))


@dataclass(frozen=True)
class _Judge:
    """How much a motion tells: the information matrix of the base parameters and effects."""

    robot: Robot
    effects: tuple[str, ...]
    base: NDArray[np.int64]
    scale: Array
    recorded: Array

    def information(self, q: Array, dq: Array, ddq: Array, time: Array | None = None) -> Array:
        """Information matrix of a motion, torques in units of ``scale``."""
        robot = self.robot
        regressor = robot.torque_regressor(q, dq, ddq)[:, :, self.base]
        extra = [self._effect_columns(q, dq, ddq, time)] if self.effects else []
        columns = np.concatenate([regressor, *extra], axis=2) / self.scale[:, None]
        flat = columns.reshape(-1, columns.shape[2])
        return flat.T @ flat / len(q)

    def _effect_columns(self, q: Array, dq: Array, ddq: Array, time: Array | None) -> Array:
        n = self.robot.n_joints
        load = self.robot.inverse_dynamics(q, dq, ddq)
        signals = Signals(
            q, dq, ddq, np.zeros(len(q), dtype=np.int64), time, robot=self.robot, load=load
        )
        columns = []
        for term in make_terms(self.effects, n):
            effect = get_effect(term.kind)
            block = np.zeros((len(q), n, len(effect.coefficients)))
            for j, own in effect.torque_columns(signals, term.joints, **term.shape).items():
                block[:, j] = own
            columns.append(block)
        return np.concatenate(columns, axis=2)

    def score(self, information: Array, criterion: str) -> float:
        """What is minimised."""
        matrix = information + self.recorded
        if criterion == "condition":
            return float(np.log(_condition(matrix)))
        return -_log_determinant(matrix)


def _log_determinant(matrix: Array) -> float:
    mean = np.trace(matrix) / len(matrix)
    sign, value = np.linalg.slogdet(matrix + RIDGE * mean * np.eye(len(matrix)))
    return float(value) if sign > 0 else -1e9


def _condition(matrix: Array) -> float:
    """Condition number of the columns, scaled to equal length."""
    size = np.sqrt(np.diag(matrix))
    size = np.where(size > 0, size, 1.0)
    values = np.linalg.eigvalsh(matrix / size[:, None] / size)
    return float(np.sqrt(values[-1] / max(values[0], 1e-16)))


def design_excitation(
    robot: Robot,
    *,
    duration: float = 20.0,
    base_frequency: float = 0.1,
    harmonics: int = 5,
    criterion: Literal["determinant", "condition"] = "determinant",
    effects: Iterable[str] = ("viscous", "coulomb"),
    limits: MotionLimits | None = None,
    recorded: Iterable[tuple[Array, Array, Array]] = (),
    blend: float = 0.5,
    iterations: int = ITERATIONS,
    random_state: int = 0,
) -> Excitation:
    """Design a motion from which base parameters and effects can be told.

    A Fourier series on every joint, blended by quintics from and to rest. Positions, velocities and
    accelerations keep their limits by construction; where torque or workspace limits bind, strokes
    shrink until they hold. The result is checked at 500 Hz.

    Parameters
    ----------
    robot : Robot
        Robot with its limits.
    duration : float, s, default=20
        Length of the motion.
    base_frequency : float, Hz, default=0.1
        Frequency of the first harmonic.
    harmonics : int, default=5
        Number of harmonics of every joint.
    criterion : {"determinant", "condition"}, default="determinant"
        D-optimality (volume of the confidence ellipsoid), or the condition number of the base
        regressor with columns of equal length.
    effects : iterable of str, default=("viscous", "coulomb")
        Effects that are to be told too.
    limits : MotionLimits, optional
        Limits; those of the URDF by default.
    recorded : iterable of (q, dq, ddq), default=()
        Motions that were recorded already: the new one adds to what they tell.
    blend : float, s, default=0.5
        Time of blending from and to rest.
    iterations : int, default=25
        Iterations of the descent; each costs one evaluation per unknown.
    random_state : int, default=0
        Seed of the random starts.

    Returns
    -------
    Excitation
        Within every limit.

    Raises
    ------
    SkidynError
        Limits are inconsistent, or no motion however small keeps the torque and workspace limits.

    References
    ----------
    Swevers, Ganseman, Tukel, De Schutter, Van Brussel (1997), "Optimal robot excitation and
    identification", IEEE Transactions on Robotics and Automation 13(5), 730-740.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm
    >>> excitation = design_excitation(load_planar_arm(), duration=5.0, iterations=2)
    >>> excitation.condition_number < 1000
    True
    """
    if criterion not in ("determinant", "condition"):
        raise SkidynError(f"criterion={criterion!r}; expected 'determinant' or 'condition'")
    if duration <= 2 * blend:
        raise SkidynError(f"a motion of {duration} s leaves no time beside blending for {blend} s")
    bounds = (limits or MotionLimits()).resolved(robot)
    judge = _judge(robot, tuple(effects), recorded)
    rng = np.random.default_rng(random_state)
    size = 1 + 2 * harmonics
    time = np.linspace(0.0, duration, JUDGED_SAMPLES)
    fine = np.linspace(0.0, duration, 2 * JUDGED_SAMPLES)
    raw = Excitation(robot, duration, base_frequency, np.zeros(0), np.zeros((0, 0)), blend)

    def motion(x: Array) -> Excitation:
        middle, weights = _unpacked(x.reshape(robot.n_joints, size), bounds)
        return _within(replace(raw, middle=middle, weights=weights), bounds, fine)

    def loss(x: Array) -> float:
        excitation = motion(x)
        states = excitation._at(time)
        information = judge.information(*states, time)
        return judge.score(information, criterion) + _violation(robot, states, bounds)

    starts = rng.normal(size=(STARTS, robot.n_joints * size))
    best = min(starts, key=loss)
    if iterations:
        found = minimize(
            loss, best, method="L-BFGS-B", options={"maxiter": iterations, "ftol": 1e-6}
        )
        best = found.x if found.fun < loss(best) else best
    excitation = motion(best)
    dense = excitation.sample(CHECK_RATE)[0]
    # A long motion is judged too sparsely to see the accelerations of its blends.
    excitation = _shrunk(robot, _within(excitation, bounds, dense), bounds)
    q, dq, ddq = excitation._at(dense)
    matrix = judge.information(q, dq, ddq, dense) + judge.recorded
    return replace(
        excitation,
        condition_number=_condition(matrix),
        log_determinant=_log_determinant(matrix),
    )


def _judge(
    robot: Robot, effects: tuple[str, ...], recorded: Iterable[tuple[Array, Array, Array]]
) -> _Judge:
    base = base_parameter_index(robot)
    scale = np.where(np.isfinite(robot.effort_limits), robot.effort_limits, 1.0)
    scale = np.where(scale > 0, scale, 1.0)
    judge = _Judge(robot, effects, base, scale, np.zeros((0, 0)))
    matrices = []
    for states in recorded:
        q, dq, ddq = (np.asarray(x, dtype=float) for x in states)
        matrices.append(judge.information(q, dq, ddq, np.arange(len(q), dtype=float)))
    n = len(base) + sum(
        len(get_effect(t.kind).coefficients) for t in make_terms(effects, robot.n_joints)
    )
    return replace(judge, recorded=np.sum(matrices, axis=0) if matrices else np.zeros((n, n)))


def _unpacked(x: Array, limits: MotionLimits) -> tuple[Array, Array]:
    """Middle pose within the middle of the range, and weights, from unbounded numbers."""
    low, high = limits.position.T
    middle = (low + high) / 2 + 0.5 * np.tanh(x[:, 0]) * (high - low) / 2
    return middle, x[:, 1:].copy()


def _within(excitation: Excitation, limits: MotionLimits, time: Array) -> Excitation:
    """Strokes as large as position, velocity and acceleration allow."""
    q, dq, ddq = excitation._at(time)
    away = q - excitation.middle
    low, high = limits.position.T
    # NaN-free ratios: how much of its room every quantity takes.
    taken = np.max(
        [
            np.max(
                np.maximum(away / (high - excitation.middle), away / (low - excitation.middle)), 0
            ),
            np.max(np.abs(dq), axis=0) / limits.velocity,
            np.max(np.abs(ddq), axis=0) / limits.acceleration,
        ],
        axis=0,
    )
    return replace(
        excitation, weights=excitation.weights * (MARGIN / np.maximum(taken, 1e-9))[:, None]
    )


def _violation(robot: Robot, states: tuple[Array, Array, Array], limits: MotionLimits) -> float:
    """How far torque and workspace limits are broken, as a penalty."""
    penalty = 0.0
    if np.any(np.isfinite(limits.torque)):
        torque = robot.inverse_dynamics(*states)
        excess = np.maximum(np.abs(torque).max(0) / limits.torque - MARGIN, 0.0)
        penalty += float(np.sum(excess**2))
    outside = _outside(robot, states[0], limits)
    return 100.0 * penalty + 100.0 * outside


def _outside(robot: Robot, q: Array, limits: MotionLimits) -> float:
    """Share of the samples at which the last body is outside its workspace."""
    if limits.workspace is None:
        return 0.0
    position, _ = robot.forward_kinematics(q)
    if callable(limits.workspace):
        return 1.0 - float(np.mean(np.asarray(limits.workspace(position), dtype=bool)))
    low, high = np.asarray(limits.workspace, dtype=float).T
    return 1.0 - float(np.mean(np.all((position >= low) & (position <= high), axis=1)))


def _shrunk(robot: Robot, excitation: Excitation, limits: MotionLimits) -> Excitation:
    """Smaller strokes until every limit holds on a dense grid."""
    low, high = limits.position.T
    for share in np.linspace(1.0, 0.025, 40):
        trial = replace(excitation, weights=share * excitation.weights)
        _, q, dq, ddq = trial.sample(CHECK_RATE)
        torque = np.abs(robot.inverse_dynamics(q, dq, ddq)).max(0)
        kept = (
            np.all((q >= low) & (q <= high))
            and np.all(np.abs(dq).max(0) <= limits.velocity)
            and np.all(np.abs(ddq).max(0) <= limits.acceleration)
            and np.all(torque <= limits.torque)
        )
        if kept and _outside(robot, q, limits) == 0.0:
            return trial
    raise SkidynError(
        "no motion around the pose that was found keeps the torque and workspace limits; widen "
        "them, or narrow the position limits to poses that are allowed"
    )
