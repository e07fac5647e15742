# SPDX-License-Identifier: BSD-3-Clause
"""Mass, centre of mass and inertia of a payload."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.evidence._streaming import linear_terms
from skidyn.payload._runs import (
    FRICTION,
    SYMBOLS,
    Runs,
    interval_factor,
    jackknife,
    make_runs,
    open_columns,
    read_runs,
)
from skidyn.rigid_body._consistency import make_consistent
from skidyn.rigid_body._rbd_regressor import RBDRegressor
from skidyn.robots import Robot

CONFOUNDED = (
    "Mass and drive gains scale alike: gains that are 1 % too large make every parameter 1 % too "
    "large. Only a known load tells them apart (estimate_drive_gains)."
)
#: Times the noise of the joints is estimated anew and the fit repeated.
PASSES = 3
#: Radius in m of the sphere that stands for a payload where the data leaves its inertia open.
RADIUS = 0.05


@dataclass(frozen=True)
class PayloadEstimate:
    """A payload: a body fixed to a link.

    Parameters
    ----------
    mass : float
        kg.
    com : ndarray of shape (3,)
        Centre of mass in the frame of the link, m.
    inertia : ndarray of shape (3, 3)
        About the centre of mass, along the axes of the link, kg m^2.
    mass_interval : tuple of float
        95 % interval, kg.
    com_interval : ndarray of shape (3, 2)
        95 % intervals, m.
    inertial_parameters : ndarray of shape (10,)
        ``(m, m c, Ixx, Ixy, Ixz, Iyy, Iyz, Izz)`` about the origin of the link's frame; of a body
        that can exist.
    std : ndarray of shape (10,)
        Their standard errors by the jackknife over trajectories or blocks of time; NaN where the
        motion leaves a parameter open.
    link : str
        The link.
    rmse_before, rmse_after : ndarray of shape (n_joints,)
        Root mean square of the averaged loaded rows without and with the payload, N m or N.
    notes : tuple of str
        What cannot be told apart or was left open, in words.

    Examples
    --------
    >>> from skidyn.payload import PayloadEstimate  # made by identify_payload
    """

    mass: float
    com: Array
    inertia: Array
    mass_interval: tuple[float, float]
    com_interval: Array
    inertial_parameters: Array
    std: Array
    link: str
    rmse_before: Array
    rmse_after: Array
    notes: tuple[str, ...]

    @property
    def text(self) -> str:
        """The result in words."""
        low, high = self.mass_interval
        lines = [
            f"payload at {self.link}: {self.mass:.4g} kg (95 %: {low:.4g} to {high:.4g})",
            "centre of mass in m:  "
            + ", ".join(
                f"{axis} {value:.4g} ({a:.4g} to {b:.4g})"
                for axis, value, (a, b) in zip("xyz", self.com, self.com_interval, strict=True)
            ),
            "inertia about it in kg m^2:  "
            + ", ".join(
                f"I{a}{b} {self.inertia[i, j]:.3g}"
                for (i, a) in enumerate("xyz")
                for (j, b) in enumerate("xyz")
                if j >= i
            ),
            *self.notes,
        ]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.text

    def to_dict(self) -> dict[str, Any]:
        """As plain numbers, for JSON.

        Returns
        -------
        dict
            All attributes and ``text``.
        """
        return {
            "schema": "skidyn.payload/1",
            "link": self.link,
            "mass": self.mass,
            "mass_interval": list(self.mass_interval),
            "com": self.com.tolist(),
            "com_interval": self.com_interval.tolist(),
            "inertia": self.inertia.tolist(),
            "inertial_parameters": dict(
                zip(SYMBOLS, self.inertial_parameters.tolist(), strict=True)
            ),
            "std": dict(zip(SYMBOLS, self.std.tolist(), strict=True)),
            "rmse_before": self.rmse_before.tolist(),
            "rmse_after": self.rmse_after.tolist(),
            "notes": list(self.notes),
            "text": self.text,
        }


def identify_payload(
    model: Robot | RBDRegressor,
    loaded: Any,
    unloaded: Any = None,
    *,
    link: str | None = None,
    effects: Sequence[Any] = FRICTION,
    smooth: bool | None = None,
) -> PayloadEstimate:
    """Identify what a robot carries in some runs and not in others.

    With unloaded runs, rigid body, friction and payload are fitted together [1]_, so that the
    interval of the payload knows how well the robot itself is known. Without them a fitted model
    stands for the robot, and its errors are not part of the intervals.

    Parameters
    ----------
    model : Robot or RBDRegressor
        The robot; a fitted regressor where there are no unloaded runs.
    loaded : DataFrame or sequence of DataFrame
        Runs with the payload: ``time`` (s), ``q1..``, ``dq1..`` (rad, m), ``tau1..`` (N m, N) and,
        where known, ``trajectory`` and ``ddq1..``, such as :func:`skidyn.datasets.read_log` gives.
    unloaded : DataFrame or sequence of DataFrame, optional
        Runs without it, if possible the same motion on the same day.
    link : str, optional
        Link of the URDF to which the payload is fixed and in whose frame it is stated; the last
        moving link by default.
    effects : sequence of str, (str, joints) or Term
        Effects beside the rigid body that are fitted with unloaded runs; viscous and dry friction,
        offset and rotor inertia by default.
    smooth : bool or None, default=None
        Derive velocity and acceleration from the positions. None does so where the runs have no
        accelerations.

    Returns
    -------
    PayloadEstimate
        With intervals, and what cannot be told in words.

    Raises
    ------
    SkidynError
        Runs that cannot be used, a link that is not there, or neither unloaded runs nor a fitted
        model.

    See Also
    --------
    estimate_drive_gains : The calibration on which the mass depends.
    skidyn.diagnosis.diagnose : Finds a payload that nobody told it of.

    References
    ----------
    .. [1] W. Khalil, M. Gautier, P. Lemoine, "Identification of the payload inertial parameters of
       industrial manipulators", IEEE Int. Conf. Robotics and Automation, 2007, 4943-4948.

    Examples
    --------
    >>> from skidyn.datasets import load_ur5, make_hidden_effect_log
    >>> from skidyn.payload import identify_payload
    >>> log = make_hidden_effect_log(
    ...     load_ur5(), "payload", base=("viscous", "coulomb"), random_state=0
    ... )
    >>> carries = log.frame["trajectory"].isin(log.parameters["trajectories"])
    >>> found = identify_payload(log.robot, log.frame[carries], log.frame[~carries])
    >>> abs(found.mass - log.parameters["mass"]) < 0.1
    True
    """
    robot = model if isinstance(model, Robot) else _robot_of(model)
    signals, torque, carries, smooths = read_runs(robot, loaded, unloaded, smooth)
    notes = [CONFOUNDED]
    if unloaded is not None:
        terms = linear_terms(effects, robot.n_joints)
    else:
        torque = torque - _prediction(model, loaded)
        terms = []
        notes.append(
            "Without unloaded runs the model is taken as exact: its errors are part of the payload "
            "and not of the intervals."
        )
    runs = make_runs(
        signals,
        torque,
        carries,
        robot=robot,
        link=link,
        terms=terms,
        smooth=smooths,
        rigid_body=unloaded is not None,
    )
    return _estimate(runs, link or robot.body_names[-1], notes)


def _robot_of(model: RBDRegressor) -> Robot:
    if hasattr(model, "robot_"):
        return model.robot_
    return model.robot if isinstance(model.robot, Robot) else Robot.from_urdf(model.robot)


def _prediction(model: Robot | RBDRegressor, loaded: Any) -> Array:
    """Torque of a fitted model on the loaded runs, in their order."""
    if isinstance(model, Robot):
        raise SkidynError(
            "without unloaded runs a fitted RBDRegressor is needed: it says what the robot's own "
            "torque is"
        )
    check_is_fitted(model)
    frames = [loaded] if hasattr(loaded, "columns") else list(loaded)
    names = list(model.feature_names_in_)
    parts = [np.asarray(model.predict(frame[names])) for frame in frames]
    return np.concatenate([part.reshape(len(part), -1) for part in parts])


def _estimate(runs: Runs, link: str, notes: list[str]) -> PayloadEstimate:
    designs = [np.hstack(pair) for pair in zip(runs.body, runs.rest, strict=True)]
    noise = np.ones(len(designs))
    for _ in range(PASSES):
        factors = _fold_factors(designs, runs, noise)
        solution = _solve(np.vstack(factors))
        noise = _noise(designs, runs.target, solution)
    factors = _fold_factors(designs, runs, noise)
    whole = _triangle(np.vstack(factors))
    is_open = open_columns(whole[:, :-1], range(10))
    if is_open[0]:
        raise SkidynError(
            f"this motion does not show a mass at {link}: no joint feels it against gravity or "
            "inertia. Move joints whose axes are not vertical."
        )
    left = np.array(
        [_solve(np.vstack(factors[:f] + factors[f + 1 :])) for f in range(len(factors))]
    )[:, :10]
    std = jackknife(left)
    std[is_open] = np.nan
    if is_open.any():
        names = ", ".join(np.array(SYMBOLS)[is_open])
        notes.append(f"This motion leaves open: {names}. They are those of a small sphere.")
    parameters = _consistent(whole, solution[:10], is_open)
    about = _about_com(parameters)
    mass, first = parameters[0], parameters[1:4]
    wide = interval_factor(len(factors))
    least = wide * float(np.max(std[[4, 7, 9]]))  # of Ixx, Iyy, Izz; NaN where one is open
    if np.trace(about) < least:
        notes.append(
            "The inertia about the centre of mass is smaller than this motion can tell "
            f"({least:.2g} kg m^2 about each axis)."
        )
    com_std = jackknife(left[:, 1:4] / left[:, :1])
    com_std[is_open[1:4]] = np.inf
    half = wide * com_std[:, None] * [-1.0, 1.0]
    before, after = _loaded_errors(designs, runs, solution)
    return PayloadEstimate(
        mass=float(mass),
        com=first / mass,
        inertia=about,
        mass_interval=(float(mass - wide * std[0]), float(mass + wide * std[0])),
        com_interval=(first / mass)[:, None] + half,
        inertial_parameters=parameters,
        std=std,
        link=link,
        rmse_before=before,
        rmse_after=after,
        notes=tuple(notes),
    )


def _fold_factors(designs: list[Array], runs: Runs, noise: Array) -> list[Array]:
    """Triangular factor of [columns | torque] of every fold, joints weighted by their noise."""
    factors = []
    for f in range(runs.problem.n_folds):
        parts = [
            np.column_stack([design, target])[fold == f] / s
            for design, target, fold, s in zip(designs, runs.target, runs.fold, noise, strict=True)
        ]
        factors.append(_triangle(np.vstack(parts)))
    return factors


def _triangle(rows: Array) -> Array:
    return np.asarray(np.linalg.qr(rows, mode="r"))


def _solve(factor: Array) -> Array:
    """Least squares of the smallest size where columns depend on each other."""
    columns, target = factor[:, :-1], factor[:, -1]
    size = np.linalg.norm(columns, axis=0)
    size[size == 0] = 1.0
    return np.asarray(np.linalg.lstsq(columns / size, target, rcond=1e-9)[0] / size)


def _noise(designs: list[Array], targets: list[Array], solution: Array) -> Array:
    pairs = zip(designs, targets, strict=True)
    return np.array([np.sqrt(np.mean((y - a @ solution) ** 2)) + 1e-100 for a, y in pairs])


def _consistent(whole: Array, free: Array, is_open: NDArray[np.bool_]) -> Array:
    """The body that can exist and explains the torque best, everything else refitted."""
    if free[0] > 0:
        mass, com = free[0], np.where(is_open[1:4], 0.0, free[1:4]) / free[0]
    else:
        mass, com = 0.1, np.zeros(3)
    ball = 0.4 * mass * RADIUS**2 * np.ones(3)
    shift = mass * (com @ com * np.eye(3) - np.outer(com, com))
    inertia = np.diag(ball) + shift
    start = np.r_[mass, mass * com, inertia[np.triu_indices(3)]]
    n_rest = whole.shape[1] - 11
    # What is beside the body has no bounds: it is eliminated, which leaves the body's own rows.
    swapped = _triangle(np.hstack([whole[:, 10:-1], whole[:, :10], whole[:, -1:]]))
    own = swapped[n_rest:]
    found, _ = make_consistent(start[None], own[:, n_rest:-1], own[:, -1], np.zeros(0), np.zeros(0))
    return np.asarray(found[0])


def _about_com(parameters: Array) -> Array:
    """Inertia about the centre of mass."""
    mass, com = parameters[0], parameters[1:4] / parameters[0]
    xx, xy, xz, yy, yz, zz = parameters[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.asarray(about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com)))


def _loaded_errors(designs: list[Array], runs: Runs, solution: Array) -> tuple[Array, Array]:
    """Errors on the rows that feel the payload, without it and with it."""
    errors = []
    for design, target, body in zip(designs, runs.target, runs.body, strict=True):
        felt = np.any(body != 0, axis=1)
        residual = (target - design @ solution)[felt]
        payload = body[felt] @ solution[:10]
        errors.append(
            [np.sqrt(np.mean(x**2)) if felt.any() else 0.0 for x in (residual + payload, residual)]
        )
    before, after = np.array(errors).T
    return before, after
