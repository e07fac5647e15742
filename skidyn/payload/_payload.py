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
from skidyn._text import digits
from skidyn.evidence import jackknife, linear_terms, without_each
from skidyn.identification import RBDRegressor, make_consistent
from skidyn.payload._by_recording import Shares, compare_recordings, differing
from skidyn.payload._payload_fit import PayloadFit, solve_rows
from skidyn.payload._runs import (
    FRICTION,
    SYMBOLS,
    Runs,
    interval_factor,
    make_runs,
    open_columns,
    read_runs,
    triangle,
)
from skidyn.robots import Robot

CONFOUNDED = (
    "Mass and drive gains scale alike: gains that are 1 % too large make every parameter 1 % too "
    "large. Only a known load separates them: skidyn payload --known-mass (in Python: "
    "estimate_drive_gains)."
)
#: Difference of a joint's own estimate from the common one, in standard errors, beyond which a
#: contradiction is reported, and standard error, as a share, beyond which a joint is too imprecise
#: for it.
DISAGREES, LARGEST_ERROR = 4.0, 0.3
#: Share of the mass below which a joint contradicts it by more than a wrong drive gain would.
LEAST_SHARE = 0.5
#: Radius in m of the sphere used for a payload whose inertia the data does not determine.
RADIUS = 0.05


@dataclass(frozen=True)
class PayloadEstimate:
    """A payload: a body fixed to a link.

    Parameters
    ----------
    mass : float
        kg; NaN if the motion determines only its first moment.
    com : ndarray of shape (3,)
        Centre of mass in the frame of the link, m.
    inertia : ndarray of shape (3, 3)
        About the centre of mass, along the axes of the link, kg m^2.
    mass_interval : tuple of float
        95 % interval, kg.
    com_interval : ndarray of shape (3, 2)
        95 % intervals, m.
    inertial_parameters : ndarray of shape (10,)
        ``(m, m c, Ixx, Ixy, Ixz, Iyy, Iyz, Izz)`` about the origin of the link's frame; physically
        consistent.
    std : ndarray of shape (10,)
        Their standard errors by the jackknife over trajectories or blocks of time; NaN if the
        motion does not determine a parameter.
    link : str
        The link.
    rmse_before, rmse_after : ndarray of shape (n_joints,)
        Root mean square of the averaged loaded rows without and with the payload, N m or N.
    notes : tuple of str
        Notes on parameters that cannot be separated or determined.
    first_moment : ndarray of shape (3,)
        Mass times centre of mass, kg m; NaN if the motion does not determine it.
    first_moment_interval : ndarray of shape (3, 2)
        95 % intervals, kg m.
    by_joint, by_joint_std : ndarray of shape (n_joints,)
        The payload's size from every joint alone, as a share of the common one, and its standard
        error; NaN for joints on which it does not act. Shares that differ beyond their errors
        indicate wrong drive gains.
    by_recording : Shares
        Torque measured in every recording, as a share of that expected from all others: ``names``
        of the recordings, ``values`` and ``std`` of shape (n_recordings, n_joints). They differ if
        a drive gain was not the same in all recordings. NaN for the only recording with the
        payload, or without it.
    joint_names : tuple of str
        Names of the joints.
    units : tuple of str
        Units of their torques, ``"N m"`` or ``"N"``.

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
    first_moment: Array
    first_moment_interval: Array
    by_joint: Array
    by_joint_std: Array
    by_recording: Shares
    joint_names: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def text(self) -> str:
        """Text of the result."""
        return "\n".join([*self._body(), *self._errors(), *self._joints(), *self.notes])

    def _errors(self) -> list[str]:
        """Errors of the joints loaded by the payload, without it and with it."""
        rows = zip(self.joint_names, self.units, self.rmse_before, self.rmse_after, strict=True)
        return ["error of the loaded runs without the payload and with it:"] + [
            f"  {name} ({j}): {digits(before)} → {digits(after)} {unit}"
            for j, (name, unit, before, after) in enumerate(rows, 1)
        ]

    def _joints(self) -> list[str]:
        felt = np.flatnonzero(np.isfinite(self.by_joint))
        if len(felt) < 2:
            return []
        shares = ", ".join(
            f"joint {j + 1} {100 * self.by_joint[j]:.0f} ± {100 * self.by_joint_std[j]:.0f}"
            for j in felt
        )
        return [f"mass estimated from single joints, in % of this: {shares}"]

    def _body(self) -> list[str]:
        if not np.isfinite(self.mass):
            shown = ", ".join(
                f"{axis} {value:.4g} ({a:.4g} to {b:.4g})"
                for axis, value, (a, b) in zip(
                    "xyz", self.first_moment, self.first_moment_interval, strict=True
                )
                if np.isfinite(value)
            )
            return [
                f"payload at {self.link}: this motion determines its first moment but not its "
                f"mass; first moment in kg m (95 %):  {shown}",
                "if its centre of mass (com) is given, its mass follows from the first moment",
            ]
        low, high = self.mass_interval
        return [
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
        ]

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
            "first_moment": self.first_moment.tolist(),
            "first_moment_interval": self.first_moment_interval.tolist(),
            "by_joint": self.by_joint.tolist(),
            "by_joint_std": self.by_joint_std.tolist(),
            "by_recording": self.by_recording.to_dict(),
            "joints": list(self.joint_names),
            "units": list(self.units),
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
    com: Sequence[float] | None = None,
    effects: Sequence[Any] = FRICTION,
    smooth: bool | None = None,
) -> PayloadEstimate:
    """Identify a payload that a robot carries in some runs and not in others.

    With unloaded runs, rigid body, friction and payload are fitted together [1]_, so that the
    interval of the payload includes the uncertainty of the robot itself. Without them a fitted
    model is used for the robot, and its errors are not part of the intervals.

    Parameters
    ----------
    model : Robot or RBDRegressor
        The robot, or a fitted regressor if there are no unloaded runs.
    loaded : DataFrame or sequence of DataFrame
        Runs with the payload: ``time`` (s), ``q1..``, ``dq1..`` (rad, m), ``tau1..`` (N m, N) and,
        where known, ``trajectory`` and ``ddq1..``, such as :func:`skidyn.logs.read_log` gives.
    unloaded : DataFrame or sequence of DataFrame, optional
        Runs without it, if possible the same motion on the same day.
    link : str, optional
        Link of the URDF to which the payload is fixed and in whose frame it is stated; the last
        moving link by default.
    com : sequence of 3 floats, optional
        Centre of mass in the frame of the link, m, if it is known. If the motion determines the
        first moment only, such as that of one joint, the mass is computed from it.
    effects : sequence of str, (str, joints) or Term
        Effects in addition to the rigid body that are fitted with unloaded runs; viscous and dry
        friction, offset and rotor inertia by default.
    smooth : bool or None, default=None
        Derive velocity and acceleration from the positions. None does so where the runs have no
        accelerations.

    Returns
    -------
    PayloadEstimate
        Payload with intervals, and notes on undetermined parameters.

    Raises
    ------
    SkidynError
        Runs cannot be used, the link is unknown, there are neither unloaded runs nor a fitted
        model, or the loaded runs carry less than the unloaded ones.

    See Also
    --------
    estimate_drive_gains : The calibration on which the mass depends.
    skidyn.diagnosis.diagnose : Finds a payload that was not stated.

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
            "Without unloaded runs the model is assumed to be exact: its errors are included in "
            "the payload but not in the intervals."
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
    centre = None if com is None else np.asarray(com, dtype=np.float64)
    if centre is not None and (centre.shape != (3,) or not np.isfinite(centre).all()):
        raise SkidynError(f"com is {com!r}; expected three numbers in m, in the frame of the link")
    return _estimate(runs, link or robot.body_names[-1], notes, centre)


def _robot_of(model: RBDRegressor) -> Robot:
    if hasattr(model, "robot_"):
        return model.robot_
    return model.robot if isinstance(model.robot, Robot) else Robot.from_urdf(model.robot)


def _prediction(model: Robot | RBDRegressor, loaded: Any) -> Array:
    """Torque of a fitted model on the loaded runs, in their order."""
    if isinstance(model, Robot):
        raise SkidynError(
            "without unloaded runs a fitted RBDRegressor is needed, which predicts the torque of "
            "the robot itself"
        )
    check_is_fitted(model)
    frames = [loaded] if hasattr(loaded, "columns") else list(loaded)
    names = list(model.feature_names_in_)
    parts = [np.asarray(model.predict(frame[names])) for frame in frames]
    return np.concatenate([part.reshape(len(part), -1) for part in parts])


def _estimate(runs: Runs, link: str, notes: list[str], com: Array | None = None) -> PayloadEstimate:
    fit = PayloadFit.of(runs, com)
    if fit.is_open[:4].all():
        raise SkidynError(
            f"this motion shows neither mass nor first moment of a payload at {link}: no torque "
            "depends on them, or they cannot be separated from those of the robot. Turn the "
            "payload about a joint whose axis is not vertical, with and without the load."
        )
    std = jackknife(fit.left_out)
    std[fit.is_open] = np.nan
    wide = interval_factor(len(fit.factors))
    mass = float(fit.solution[0])
    if not fit.is_open[0] and mass + wide * std[0] < 0:
        raise SkidynError(
            f"the loaded runs carry {-mass:.4g} ± {wide * std[0]:.2g} kg less at {link} than the "
            "unloaded ones (or the model): exchange loaded and unloaded if they were confused, and "
            "check the signs of torque and gravity otherwise"
        )
    first_moment = np.where(fit.is_open[1:4], np.nan, fit.body[1:4])
    shares, share_std = _by_joint(runs, fit.body)
    robot = runs.problem.robot
    assert robot is not None
    recordings = compare_recordings(runs, fit.expected)
    notes = notes + _disagreement(shares, share_std) + differing(recordings, robot.joint_names)
    before, after = _loaded_errors(fit, runs)
    own = _first_moment_only(fit) if fit.is_open[0] else _whole_body(fit, com, std, wide, notes)
    return PayloadEstimate(
        **own,
        std=std,
        link=link,
        rmse_before=before,
        rmse_after=after,
        notes=tuple(notes),
        first_moment=first_moment,
        first_moment_interval=first_moment[:, None] + wide * std[1:4, None] * [-1.0, 1.0],
        by_joint=shares,
        by_joint_std=share_std,
        by_recording=recordings,
        joint_names=tuple(robot.joint_names),
        units=tuple("N" if slides else "N m" for slides in runs.problem.signals.prismatic),
    )


def _first_moment_only(fit: PayloadFit) -> dict[str, Any]:
    """Attributes of a payload whose mass the motion does not determine."""
    nothing = np.full((3, 3), np.nan)
    return {
        "mass": np.nan,
        "com": nothing[0],
        "inertia": nothing,
        "mass_interval": (np.nan, np.nan),
        "com_interval": nothing[:, :2],
        "inertial_parameters": np.where(fit.is_open, np.nan, fit.body),
    }


def _whole_body(
    fit: PayloadFit, com: Array | None, std: Array, wide: float, notes: list[str]
) -> dict[str, Any]:
    """Attributes of a payload with a mass; what is not measured about it is appended to notes."""
    is_open, body, left = fit.is_open, fit.body, fit.left_out
    if is_open.any():
        names = ", ".join(np.array(SYMBOLS)[is_open])
        notes.append(
            f"This motion does not determine {names}; the values are those of a small sphere."
        )
    if com is not None:
        notes.append("The centre of mass is the given one; the mass depends on it.")
        parameters = _sphere(body[0], com) if is_open[4:].any() else body
    else:
        parameters = _consistent(fit.whole, fit.solution[:10], is_open)
    about = _about_com(parameters)
    mass, first = parameters[0], parameters[1:4]
    least = wide * float(np.max(std[[4, 7, 9]]))  # of Ixx, Iyy, Izz; NaN if one is undetermined
    if np.trace(about) < least:
        notes.append(
            "The inertia about the centre of mass is smaller than this motion can resolve "
            f"({least:.2g} kg m^2 about each axis)."
        )
    com_std = jackknife(left[:, 1:4] / left[:, :1])
    com_std[is_open[1:4]] = np.inf
    half = wide * com_std[:, None] * [-1.0, 1.0]
    return {
        "mass": float(mass),
        "com": first / mass,
        "inertia": about,
        "mass_interval": (float(mass - wide * std[0]), float(mass + wide * std[0])),
        "com_interval": (first / mass)[:, None] + half,
        "inertial_parameters": parameters,
    }


def _sphere(mass: float, com: Array) -> Array:
    """Parameters of a small sphere."""
    inertia = 0.4 * mass * RADIUS**2 * np.eye(3)
    inertia += mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.asarray(np.r_[mass, mass * com, inertia[np.triu_indices(3)]])


def _by_joint(runs: Runs, body: Array) -> tuple[Array, Array]:
    """Size of the payload from every joint alone, over the common one, with standard error."""
    shares, errors = [], []
    for own, rest, target, fold in zip(runs.body, runs.rest, runs.target, runs.fold, strict=True):
        torque = own @ body
        design = np.column_stack([torque, rest, target])
        parts = [triangle(design[fold == f]) for f in range(runs.n_folds)]
        whole = triangle(np.vstack(parts))
        if not np.any(torque) or open_columns(whole[:, :-1], [0])[0]:
            shares.append(np.nan)
            errors.append(np.nan)
            continue
        shares.append(solve_rows(whole)[0])
        errors.append(float(jackknife(np.array([solve_rows(r)[0] for r in without_each(parts)]))))
    return np.array(shares), np.array(errors)


def _disagreement(shares: Array, errors: Array) -> list[str]:
    """A note if the estimate of a joint differs from the common one by more than its error.

    The common one is 1. A mean of the precise joints is not: joints without a payload agree with
    each other, and contradict the mass that the others have determined.
    """
    felt = np.flatnonzero(np.isfinite(shares))
    precise = felt[errors[felt] < LARGEST_ERROR]
    if len(felt) < 2 or len(precise) == 0:
        return []
    distance = np.abs(shares[precise] - 1.0) / (errors[precise] + 1e-12)
    worst = int(np.argmax(distance))
    if distance[worst] < DISAGREES:
        return []
    j = precise[worst]
    also = "" if shares[j] > LEAST_SHARE else ", and whether there is a payload at all,"
    return [
        f"Joint {j + 1} alone gives {100 * shares[j]:.0f} % of this mass, {distance[worst]:.1f} "
        f"standard errors from the estimate of all joints: check its drive gain{also} before using "
        "the mass."
    ]


def _consistent(whole: Array, free: Array, is_open: NDArray[np.bool_]) -> Array:
    """The possible body that explains the torque best, with all other parameters fitted again."""
    if free[0] > 0:
        mass, com = free[0], np.where(is_open[1:4], 0.0, free[1:4]) / free[0]
    else:
        mass, com = 0.1, np.zeros(3)
    start = _sphere(mass, com)
    n_rest = whole.shape[1] - 11
    # The other parameters have no bounds: they are eliminated, which leaves the body's own rows.
    swapped = triangle(np.hstack([whole[:, 10:-1], whole[:, :10], whole[:, -1:]]))
    own = swapped[n_rest:]
    found, _ = make_consistent(start[None], own[:, n_rest:-1], own[:, -1], np.zeros(0), np.zeros(0))
    return np.asarray(found[0])


def _about_com(parameters: Array) -> Array:
    """Inertia about the centre of mass."""
    mass, com = parameters[0], parameters[1:4] / parameters[0]
    xx, xy, xz, yy, yz, zz = parameters[4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return np.asarray(about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com)))


def _loaded_errors(fit: PayloadFit, runs: Runs) -> tuple[Array, Array]:
    """Errors on the rows with the payload, without it and with it in the model."""
    errors, width = [], fit.width
    for design, target, body in zip(fit.designs, runs.target, runs.body, strict=True):
        felt = np.any(body != 0, axis=1)
        residual = (target - design @ fit.solution)[felt]
        payload = design[felt, :width] @ fit.solution[:width]
        errors.append(
            [np.sqrt(np.mean(x**2)) if felt.any() else 0.0 for x in (residual + payload, residual)]
        )
    before, after = np.array(errors).T
    return before, after
