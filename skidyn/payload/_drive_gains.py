# SPDX-License-Identifier: BSD-3-Clause
"""Torque per ampere of every joint, from runs with and without a load of known mass."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.evidence import jackknife, linear_terms, without_each
from skidyn.payload._by_recording import Shares, compare_recordings, differing
from skidyn.payload._runs import (
    FRICTION,
    Runs,
    interval_factor,
    make_runs,
    open_columns,
    read_runs,
    triangle,
)
from skidyn.robots import Robot

#: Number of rounds of weights, evaluations in each, and the relative change that ends them.
PASSES, EVALUATIONS, SMALL = 4, 60, 1e-9


@dataclass(frozen=True)
class DriveGainEstimate:
    """Torque per unit of motor current of every joint.

    Parameters
    ----------
    joint_names : tuple of str
        Joints.
    units : tuple of str
        ``"N m/A"`` or ``"N/A"`` of each joint.
    gains : ndarray of shape (n_joints,)
        Torque per ampere, N m/A or N/A; NaN if the motion does not determine it.
    std : ndarray of shape (n_joints,)
        Standard errors by the jackknife over trajectories or blocks of time.
    interval : ndarray of shape (n_joints, 2)
        95 % intervals.
    factors : ndarray of shape (n_joints,)
        Ratio of the gains to those with which the runs were read.
    by_recording : Shares
        Gains estimated from every single recording, given the other parameters from all others:
        ``names`` of the recordings, ``values`` and ``std`` of shape (n_recordings, n_joints), N m/A
        or N/A. NaN for the only recording with the load, or without it.
    mass : float
        The known mass to which all gains are proportional, kg.
    com : ndarray of shape (3,)
        Centre of mass of the load in the frame of the link, as given or estimated, m.
    relative_error : ndarray of shape (n_joints,)
        Root mean square of the residual over that of the current, averaged rows.
    notes : tuple of str
        Notes on parameters that cannot be separated or determined.

    Examples
    --------
    >>> from skidyn.payload import DriveGainEstimate  # made by estimate_drive_gains
    """

    joint_names: tuple[str, ...]
    units: tuple[str, ...]
    gains: Array
    std: Array
    interval: Array
    factors: Array
    by_recording: Shares
    mass: float
    com: Array
    relative_error: Array
    notes: tuple[str, ...]

    @property
    def text(self) -> str:
        """Text of the result."""
        rows = zip(self.joint_names, self.gains, self.units, self.interval, strict=True)
        lines = [
            f"{name}: {gain:.4g} {unit} (95 %: {low:.4g} to {high:.4g})"
            for name, gain, unit, (low, high) in rows
        ]
        if not np.allclose(self.factors, self.gains, equal_nan=True):
            shown = ", ".join(f"{factor:.3f}" for factor in self.factors)
            lines.append(f"relative to the gains with which the runs were read: {shown}")
        for name, own in zip(self.by_recording.names, self.by_recording.values, strict=True):
            if np.isfinite(own).any():
                shown = ", ".join(f"{gain:.4g}" for gain in own)
                lines.append(f"from {name} alone: {shown}")
        return "\n".join([*lines, *self.notes])

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
            "schema": "skidyn.drive_gains/1",
            "joints": list(self.joint_names),
            "units": list(self.units),
            "gains": self.gains.tolist(),
            "std": self.std.tolist(),
            "interval": self.interval.tolist(),
            "factors": self.factors.tolist(),
            "by_recording": self.by_recording.to_dict(),
            "mass": self.mass,
            "com": self.com.tolist(),
            "relative_error": self.relative_error.tolist(),
            "notes": list(self.notes),
            "text": self.text,
        }


def estimate_drive_gains(
    robot: Robot,
    loaded: Any,
    unloaded: Any,
    mass: float,
    *,
    com: Sequence[float] | None = None,
    drive_gains: Sequence[float] | None = None,
    link: str | None = None,
    effects: Sequence[Any] = FRICTION,
    smooth: bool | None = None,
) -> DriveGainEstimate:
    """Estimate the drive gains from runs with and without a load of known mass.

    Rigid body, friction, the unknown parameters of the load and all gains are fitted together
    [1]_. The noise is in the currents, which are the dependent variable: a least-squares fit with
    the currents as regressors would bias every gain toward zero.

    Parameters
    ----------
    robot : Robot
        Robot; its inertial parameters are not used.
    loaded, unloaded : DataFrame or sequence of DataFrame
        Runs with and without the load: ``time`` (s), ``q1..``, ``dq1..`` (rad, m) and ``tau1..``,
        torque by the gains in ``drive_gains`` or, without them, the current in A.
    mass : float
        Known mass of the load, kg.
    com : sequence of 3 floats, optional
        Its centre of mass in the frame of the link, m, if known; otherwise it is estimated.
    drive_gains : sequence of float, N m/A or N/A, optional
        Gains with which the torque columns were computed from currents; 1 by default.
    link : str, optional
        Link of the URDF to which the load is fixed; the last moving link by default.
    effects : sequence of str, (str, joints) or Term
        Effects in addition to the rigid body; viscous and dry friction, offset and rotor inertia by
        default.
    smooth : bool or None, default=None
        Derive velocity and acceleration from the positions. None does so if the runs have no
        accelerations.

    Returns
    -------
    DriveGainEstimate
        Gains with intervals, and notes on undetermined parameters.

    Raises
    ------
    SkidynError
        Runs cannot be used, the link is unknown, or the mass is not positive.

    References
    ----------
    .. [1] M. Gautier, S. Briot, "Global identification of joint drive gains and dynamic parameters
       of robots", J. Dynamic Systems, Measurement, and Control 136(5), 2014.

    Examples
    --------
    >>> from skidyn.datasets import load_ur5, make_hidden_effect_log
    >>> from skidyn.payload import estimate_drive_gains
    >>> log = make_hidden_effect_log(
    ...     load_ur5(), "payload", base=("viscous", "coulomb"), random_state=0
    ... )
    >>> runs = log.frame.copy()
    >>> runs["tau2"] /= 12.0  # the current of a joint with 12 N m/A
    >>> carries = runs["trajectory"].isin(log.parameters["trajectories"])
    >>> found = estimate_drive_gains(
    ...     log.robot, runs[carries], runs[~carries], log.parameters["mass"],
    ...     effects=("viscous", "coulomb"),
    ... )
    >>> bool(abs(found.gains[1] / 12 - 1) < 0.02)
    True
    """
    if not (np.isfinite(mass) and mass > 0):
        raise SkidynError(f"mass is {mass}; expected the mass of the load in kg")
    n = robot.n_joints
    nominal = np.ones(n) if drive_gains is None else np.asarray(drive_gains, dtype=np.float64)
    if nominal.shape != (n,) or not np.all(np.isfinite(nominal)) or np.any(nominal == 0):
        raise SkidynError(f"drive_gains needs {n} numbers other than zero, one for each joint")
    signals, torque, carries, smooths = read_runs(robot, loaded, unloaded, smooth)
    if carries.all():
        raise SkidynError("no run without the load was given")
    runs = make_runs(
        signals,
        torque / nominal,
        carries,
        robot=robot,
        link=link,
        terms=linear_terms(effects, n),
        smooth=smooths,
    )
    known = np.full(10, np.nan)
    known[0] = mass
    if com is not None:
        known[1:4] = mass * np.asarray(com, dtype=np.float64)
    return _estimate(runs, robot, known, nominal)


def _estimate(runs: Runs, robot: Robot, known: Array, nominal: Array) -> DriveGainEstimate:
    system = _System.of(runs, known)
    currents = np.array([np.sqrt(np.mean(y**2)) + 1e-100 for y in runs.target])
    rows = system.rows(runs)
    factors = system.factors(runs, rows)
    whole = _merged(factors)
    noise = currents.copy()
    solution = system.start(whole, noise)
    for _ in range(PASSES):
        solution = system.refine(whole, noise, solution)
        noise = system.noise(whole, solution, runs)
    left = np.array(
        [1 / system.refine(rest, noise, solution)[-system.n :] for rest in _merged_without(factors)]
    )
    gains, std = 1 / solution[-system.n :], jackknife(left)
    place = range(len(solution) - system.n, len(solution))
    is_open = open_columns(system.linearised(whole, noise, solution)[1], place)
    gains, std = np.where(is_open, np.nan, gains), np.where(is_open, np.nan, std)
    half = interval_factor(len(factors)) * std[:, None] * [-1.0, 1.0]

    def expected(left_out: NDArray[np.int64]) -> list[Array]:
        kept = [parts for f, parts in enumerate(factors) if f not in left_out]
        found = system.refine(_merged(kept), noise, solution)
        x, k = found[: -system.n], found[-system.n :]
        return [own * (r[:, :-2] @ x + r[:, -2]) for own, r in zip(k, rows, strict=True)]

    currents_over = compare_recordings(runs, expected)
    notes = _notes(known[0], robot, is_open | (np.abs(half[:, 1]) >= np.abs(gains)))
    notes += differing(currents_over, robot.joint_names)
    body = known.copy()
    body[system.unknown] = solution[: len(system.unknown)]
    return DriveGainEstimate(
        joint_names=robot.joint_names,
        units=tuple("N/A" if kind == "prismatic" else "N m/A" for kind in robot.joint_types),
        gains=gains,
        std=std,
        interval=gains[:, None] + half,
        factors=gains / nominal,
        by_recording=Shares(
            currents_over.names,
            gains / currents_over.values,
            np.abs(gains) * currents_over.std / currents_over.values**2,
        ),
        mass=float(known[0]),
        com=body[1:4] / body[0],
        relative_error=noise / currents,
        notes=tuple(notes),
    )


def _notes(mass: float, robot: Robot, hardly: NDArray[np.bool_]) -> list[str]:
    """On what all gains depend, and joints whose current hardly depends on the load."""
    notes = [
        f"All gains are proportional to the mass of {mass:g} kg: if it is 1 % too large, so "
        "are they. Friction and all inertial parameters scale with them."
    ]
    if hardly.any():
        names = ", ".join(np.array(robot.joint_names)[hardly])
        notes.append(
            f"These runs contain little information about the gain of {names}, whose current "
            "hardly depends on the load. Record motion in which that joint turns the load out of "
            "balance."
        )
    return notes


@dataclass(frozen=True)
class _System:
    """Currents as functions of the unknown parameters and of the inverse gains.

    The current of joint j is ``k_j (A_j x + b_j)``: A_j the columns of the unknown parameters of
    load, robot and friction, b_j the torque of the known part of the load.
    """

    known: Array
    unknown: list[int]
    n: int

    @classmethod
    def of(cls, runs: Runs, known: Array) -> _System:
        unknown = [k for k in range(10) if np.isnan(known[k])]
        return cls(known, unknown, len(runs.target))

    def rows(self, runs: Runs) -> list[Array]:
        """Per joint, [A | b | current]."""
        given = [k for k in range(10) if k not in self.unknown]
        rows = []
        for body, rest, current in zip(runs.body, runs.rest, runs.target, strict=True):
            certain = body[:, given] @ self.known[given]
            rows.append(np.column_stack([body[:, self.unknown], rest, certain, current]))
        return rows

    def factors(self, runs: Runs, rows: list[Array]) -> list[list[Array]]:
        """Per fold and joint, the triangular factor of its rows."""
        return [
            [triangle(block[fold == f]) for block, fold in zip(rows, runs.fold, strict=True)]
            for f in range(runs.n_folds)
        ]

    def start(self, whole: list[Array], noise: Array) -> Array:
        """The combination of columns and currents that vanishes best (total least squares)."""
        width = whole[0].shape[1] - 1
        blocks = []
        for j, (factor, s) in enumerate(zip(whole, noise, strict=True)):
            currents = np.zeros((len(factor), self.n))
            currents[:, j] = -factor[:, -1]
            blocks.append(np.hstack([factor[:, :width], currents]) / s)
        stacked = np.vstack(blocks)
        size = np.linalg.norm(stacked, axis=0)
        size[size == 0] = 1.0
        # With the torque of the known load as the right-hand side, gains are linear unknowns.
        columns = np.delete(stacked / size, width - 1, axis=1)
        found = np.linalg.lstsq(columns, -stacked[:, width - 1], rcond=1e-9)[0]
        found /= np.delete(size, width - 1)
        gains = found[width - 1 :]
        if np.any(gains <= 0):
            # The noise exceeds the torque of the load on some joint: begin with gains of the right
            # size.
            gains = np.where(gains > 0, gains, np.median(np.abs(gains)) + 1e-300)
        start: Array = np.r_[found[: width - 1], 1 / gains]
        return start

    def linearised(self, whole: list[Array], noise: Array, solution: Array) -> tuple[Array, Array]:
        """Residual and its derivative by the unknowns."""
        x, k = solution[: -self.n], solution[-self.n :]
        residuals, slopes = [], []
        for j, (factor, s) in enumerate(zip(whole, noise, strict=True)):
            torque = factor[:, :-2] @ x + factor[:, -2]
            by_gain = np.zeros((len(factor), self.n))
            by_gain[:, j] = torque
            residuals.append((k[j] * torque - factor[:, -1]) / s)
            slopes.append(np.hstack([k[j] * factor[:, :-2], by_gain]) / s)
        return np.concatenate(residuals), np.vstack(slopes)

    def refine(self, whole: list[Array], noise: Array, solution: Array) -> Array:
        """Levenberg-Marquardt from a nearby solution."""
        found = least_squares(
            lambda z: self.linearised(whole, noise, z)[0],
            solution,
            jac=lambda z: self.linearised(whole, noise, z)[1],
            method="lm",
            x_scale="jac",
            ftol=SMALL,
            xtol=SMALL,
            max_nfev=EVALUATIONS,
        )
        return np.asarray(found.x)

    def noise(self, whole: list[Array], solution: Array, runs: Runs) -> Array:
        """Root mean square residual of the current of every joint."""
        residual, _ = self.linearised(whole, np.ones(self.n), solution)
        edges = np.cumsum([0, *(len(factor) for factor in whole)])
        sums = [np.sum(residual[a:b] ** 2) for a, b in zip(edges[:-1], edges[1:], strict=True)]
        rows = np.array([len(y) for y in runs.target])
        size: Array = np.sqrt(np.array(sums) / rows)
        return size + 1e-100


def _merged(factors: list[list[Array]]) -> list[Array]:
    return [triangle(np.vstack(parts)) for parts in zip(*factors, strict=True)]


def _merged_without(factors: list[list[Array]]) -> Iterator[list[Array]]:
    """Factors of all folds but one, each left out in turn."""
    for rows in zip(*map(without_each, zip(*factors, strict=True)), strict=True):
        yield [triangle(own) for own in rows]
