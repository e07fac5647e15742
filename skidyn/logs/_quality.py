# SPDX-License-Identifier: BSD-3-Clause
"""Quality of a log before any fit: clock, resolution, consistency and excitation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._checks import as_numbers, check_time_order, count_joints, require_columns
from skidyn._exceptions import LogError
from skidyn._plain import plain
from skidyn._signals import Signals
from skidyn._text import counted
from skidyn.logs._influence import by_influence

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.measurement import Measurement, Suspicion
    from skidyn.robots import Robot


@dataclass(frozen=True)
class JointQuality:
    """Quality of the signals of one joint.

    Parameters
    ----------
    name : str
        Joint.
    resolution : float, rad or m
        Step of the position sensor; NaN where positions are not visibly quantised.
    position_range : tuple of float, rad or m
        Smallest and largest position.
    position_coverage : float
        Share of the range between the limits that was visited; NaN without limits.
    largest_velocity : float, rad/s or m/s
        Largest absolute velocity.
    reversals : int
        Number of changes of the direction of motion.
    rest_share : float
        Share of rows in which the joint does not move.
    torque_range : tuple of float, N m or N
        Smallest and largest torque.
    saturated_share : float
        Share of rows in which the torque stays at its extreme value.
    velocity_slope, velocity_correlation : float
        Velocity against differentiated position; both are 1 in a consistent log.
    torque_delay : float, s
        Time by which torque lags motion (positive: torque is late); NaN if it cannot be determined.
        Pre-sliding friction resembles a lag of its joint; a delay is equal on all joints.
    excited : bool
        Whether the joint moves enough for its own parameters to be identified.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.logs import check_log
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    >>> joint = check_log(log.frame).joints[0]
    >>> joint.name, joint.excited, round(joint.velocity_slope, 2)
    ('joint1', True, 1.0)
    """

    name: str
    resolution: float
    position_range: tuple[float, float]
    position_coverage: float
    largest_velocity: float
    reversals: int
    rest_share: float
    torque_range: tuple[float, float]
    saturated_share: float
    velocity_slope: float
    velocity_correlation: float
    torque_delay: float
    excited: bool


@dataclass(frozen=True)
class LogQuality:
    """Result of :func:`check_log`.

    Parameters
    ----------
    n_samples, n_trajectories : int
        Size of the log.
    duration : float, s
        Recorded time, gaps left out.
    rate : float, Hz
        Median sampling rate.
    jitter : float
        Spread of the time steps: half the width between their 5 % and 95 % quantiles, relative to
        the median step; median over trajectories.
    gaps : int
        Steps longer than 5 median steps inside a trajectory.
    largest_gap : float, s
        Longest step inside a trajectory.
    repeated_rows : int
        Rows in which no position changes although joints move: the logger polled faster than the
        robot reported.
    joints : tuple of JointQuality
        One per joint.
    checks : tuple of Suspicion
        Suspicions, certain ones first, in the order of how much their remedies change the error of
        the robot's model, if there is a robot; each with its evidence and the option that fixes it.
    faults : tuple of str
        Rows that are not part of this report.
    notes : tuple of str
        Limitations of the log that are not errors.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.logs import check_log
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=1, duration=2.0)
    >>> print(check_log(log.frame).notes[0].partition(":")[0])
    there is a single trajectory
    """

    n_samples: int
    n_trajectories: int
    duration: float
    rate: float
    jitter: float
    gaps: int
    largest_gap: float
    repeated_rows: int
    joints: tuple[JointQuality, ...]
    checks: tuple[Suspicion, ...] = field(default=())
    faults: tuple[str, ...] = field(default=())
    notes: tuple[str, ...] = field(default=())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Every fault and suspicion as a sentence."""
        return (*self.faults, *map(str, self.checks))

    def to_dict(self) -> dict[str, Any]:
        """Contents as plain numbers, lists and text for JSON; NaN becomes None.

        Returns
        -------
        dict
            The fields of this report, ``joints`` as a list of dicts.
        """
        told = {
            "checks": [check.to_dict() for check in self.checks],
            "warnings": list(self.warnings),
        }
        content: dict[str, Any] = plain(asdict(self) | told)
        return content

    def __str__(self) -> str:
        return "\n\n".join(filter(None, (self.motion_table, self.torque_table, self.problems)))

    @property
    def motion_table(self) -> str:
        """Numbers of the log, and of the motion of each joint."""
        lines = [
            f"{self.n_samples} samples in {self.n_trajectories} "
            f"{'trajectory' if self.n_trajectories == 1 else 'trajectories'}, "
            f"{self.duration:.1f} s at {self.rate:.4g} Hz (jitter {100 * self.jitter:.2g} %)",
            f"gaps: {self.gaps} (longest step {self.largest_gap:.3g} s), "
            f"repeated rows: {self.repeated_rows}",
            "",
            *self._table(_MOTION_HEAD, _motion_cells),
        ]
        return "\n".join(lines)

    @property
    def torque_table(self) -> str:
        """Numbers of the torque of each joint."""
        return "\n".join(self._table(_TORQUE_HEAD, _torque_cells))

    def _table(self, head: str, cells: Callable[[JointQuality], str]) -> list[str]:
        """Lines of one of two tables, each of which a terminal of 80 columns holds."""
        width = max([len(joint.name) for joint in self.joints] + [5])
        rows = [f"{joint.name:{width}s}{cells(joint)}" for joint in self.joints]
        return [f"{'joint':{width}s}{head}", *rows]

    @property
    def problems(self) -> str:
        """Faults, suspicions and limitations, one paragraph each; empty if there are none."""
        from skidyn.measurement import paragraphs

        faults = (f"! {fault}" for fault in self.faults)
        return "\n".join([*faults, *paragraphs(self.checks), *self.notes])


def check_log(
    frame: pd.DataFrame,
    robot: Robot | None = None,
    *,
    measured: Callable[[LogQuality], object] | None = None,
) -> LogQuality:
    """Check the quality of a log.

    Parameters
    ----------
    frame : DataFrame
        ``time`` (s), ``trajectory`` (optional), ``q1 ..`` (rad or m), ``dq1 ..``, ``tau1 ..`` (N m
        or N), as :func:`read_log` returns it.
    robot : Robot, optional
        For its limits (coverage, units) and its dynamics: signs, order, gravity, scale and delay of
        the recording are tested by fitting the robot to it.
    measured : callable, optional
        Called with the report without ``checks`` and delays of torques as soon as its other
        numbers are known: the checks take most of the time.

    Returns
    -------
    LogQuality
        Numbers per log and joint, and suspicions with evidence. ``frame`` is not changed.

    Raises
    ------
    LogError
        Columns are missing, contain no numbers, or do not match the robot; time goes backwards.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.logs import check_log
    >>> log = make_hidden_effect_log(load_planar_arm(), None, n_trajectories=2, duration=2.0)
    >>> quality = check_log(log.frame, log.robot)
    >>> quality.n_samples, round(quality.rate), quality.gaps
    (400, 100, 0)
    """
    from skidyn.measurement import check_measurement, measured_delay  # also imports the fits

    measurement, n_trajectories, messages = _measured(frame, robot)
    quality = LogQuality(
        n_samples=measurement.n_samples,
        n_trajectories=n_trajectories,
        duration=float(measurement.steps.sum() - measurement.gaps.sum()),
        rate=measurement.rate,
        jitter=measurement.jitter,
        gaps=len(measurement.gaps),
        largest_gap=float(measurement.steps.max()),
        repeated_rows=measurement.repeated,
        joints=tuple(_joints(measurement)),
        faults=tuple(messages),
        notes=(_SINGLE,) if n_trajectories == 1 else (),
    )
    if measured is not None:
        measured(quality)
    checks = check_measurement(measurement)
    if robot is not None:
        checks = by_influence(
            frame, robot, checks, lambda log, own: _measured(log, own)[0], measurement.robot
        )
    delay = measured_delay(measurement)  # of what the checks have corrected
    joints = tuple(
        joint if delay is None else replace(joint, torque_delay=float(delay.joints[k]))
        for k, joint in enumerate(quality.joints)
    )
    return replace(quality, joints=joints, checks=tuple(checks))


def _measured(frame: pd.DataFrame, robot: Robot | None) -> tuple[Measurement, int, list[str]]:
    """The measurement of a log, its number of trajectories, and sentences about omitted rows."""
    from skidyn.measurement import Measurement, count_same_stamps, regular_clock

    n = _checked_joints(frame, robot)
    blocks = {name: [f"{name}{k + 1}" for k in range(n)] for name in ("q", "dq", "ddq", "tau")}
    if not set(blocks["ddq"]) <= set(frame.columns):
        del blocks["ddq"]
    numbers = as_numbers(frame, ["time", *(name for block in blocks.values() for name in block)])
    time = numbers["time"].to_numpy()
    q, dq, tau = (numbers[blocks[name]].to_numpy() for name in ("q", "dq", "tau"))
    ddq = numbers[blocks["ddq"]].to_numpy() if "ddq" in blocks else np.zeros_like(q)
    trajectory = (
        frame["trajectory"].to_numpy() if "trajectory" in frame else np.zeros(len(frame), int)
    )
    finite = np.isfinite(np.column_stack([time, q, dq, ddq, tau])).all(axis=1)
    messages = []
    if not finite.all():
        messages.append(
            f"{int((~finite).sum())} of {len(frame)} rows hold NaN or infinite values and are left "
            "out of this report."
        )
        time, q, dq, ddq, tau, trajectory = (a[finite] for a in (time, q, dq, ddq, tau, trajectory))
    if len(time) < 2:
        raise LogError(f"the log has {len(time)} finite row(s); at least two are needed.")
    unique = check_time_order(time, trajectory)
    same_stamps = count_same_stamps(time, q, trajectory)
    if same_stamps:
        time = regular_clock(time, trajectory)  # other errors are visible only with the remedy
    elif not unique.all():
        messages.append(f"{int((~unique).sum())} row(s) repeat the time of the previous row.")
        time, q, dq, ddq, tau, trajectory = (a[unique] for a in (time, q, dq, ddq, tau, trajectory))
    names = list(frame.attrs.get("joint_names", ())) if robot is None else list(robot.joint_names)
    if len(names) != n:
        names = [f"joint {k + 1}" for k in range(n)]
    prismatic = np.zeros(n, dtype=bool)
    if robot is not None:
        prismatic = np.array([kind == "prismatic" for kind in robot.joint_types])
    motion = Signals(q, dq, ddq, trajectory, time, prismatic=prismatic)
    measurement = Measurement(motion, tau, robot, names, same_stamps=same_stamps)
    if len(measurement.steps) == 0:
        raise LogError("every trajectory of the log has a single row and therefore no motion.")
    return measurement, len(np.unique(trajectory)), messages


def _checked_joints(frame: pd.DataFrame, robot: Robot | None) -> int:
    """Number of joints of a log that has all columns and matches the robot."""
    if not hasattr(frame, "attrs"):  # of a DataFrame of pandas
        given = repr(frame) if isinstance(frame, str) else type(frame).__name__
        raise LogError(
            f"check_log was given {given}; expected a DataFrame, as of read_log: "
            "check_log(read_log('log.csv'))."
        )
    n = count_joints(frame)
    if robot is not None and robot.n_joints != n:
        raise LogError(
            f"the log has {counted(n, 'joint')}, the robot has {robot.n_joints} "
            f"({', '.join(robot.joint_names)}). If the log covers part of the robot, load it with "
            "Robot.from_urdf(..., joints=[...])."
        )
    require_columns(frame, n, ("q", "dq", "tau"))
    if "time" not in frame.columns:
        raise LogError("the log has no time column.")
    return n


def _joints(measurement: Measurement) -> list[JointQuality]:
    """Numbers of each joint, without the delay of its torque."""
    from skidyn.measurement import rest_share, reversals

    signals, robot = measurement.signals, measurement.robot
    joints = []
    for k, name in enumerate(measurement.joint_names):
        q, dq, tau = signals.q[:, k], signals.dq[:, k], measurement.torque[:, k]
        span = float(np.ptp(q))
        coverage = np.nan
        if robot is not None:
            low, high = robot.position_limits[k]
            coverage = span / (high - low) if np.isfinite(high - low) and high > low else np.nan
        slope, correlation = measurement.velocities[k]
        joints.append(
            JointQuality(
                name=name,
                resolution=measurement.position_steps[k],
                position_range=(float(q.min()), float(q.max())),
                position_coverage=float(coverage),
                largest_velocity=float(np.abs(dq).max()),
                reversals=reversals(dq, signals.segments),
                rest_share=rest_share(dq),
                torque_range=(float(tau.min()), float(tau.max())),
                saturated_share=measurement.at_limit[k],
                velocity_slope=slope,
                velocity_correlation=correlation,
                torque_delay=np.nan,
                excited=measurement.excited[k],
            )
        )
    return joints


_SINGLE = (
    "there is a single trajectory: errors can only be evaluated on held-out parts of it (several "
    "files give more, or a column 'trajectory'; in Python also read_log(..., split_dwells=1.0), "
    "which cuts at rests longer than 1 s)."
)
_MOTION_HEAD = "  position range  coverage     step   speed reversals"
_TORQUE_HEAD = "         torque range  at limit  at rest     dq/q'  delay ms"


def _motion_cells(joint: JointQuality) -> str:
    """Motion of one joint, as a row of the printed report."""
    low, high = joint.position_range
    step = f"{joint.resolution:8.2g}" if np.isfinite(joint.resolution) else "       -"
    return (
        f" {low:6.3f} ..{high:7.3f} {_percent(joint.position_coverage)} {step} "
        f"{joint.largest_velocity:7.3f} {joint.reversals:9d}"
    )


def _torque_cells(joint: JointQuality) -> str:
    """Torque of one joint, as a row of the printed report."""
    weak, strong = joint.torque_range
    slope, delay = _number(joint.velocity_slope, 9), _number(1e3 * joint.torque_delay, 9, 1)
    return (
        f" {_torque(weak):>9} .. {_torque(strong):>8} {_percent(joint.saturated_share)}"
        f"{_percent(joint.rest_share)} {slope} {delay}"
    )


def _torque(value: float) -> str:
    """Two decimals, or two digits of small ones."""
    return f"{value:.2f}" if abs(value) >= 0.1 else f"{value:.2g}"


def _percent(share: float) -> str:
    return f"{100 * share:6.0f} %" if np.isfinite(share) else "       -"


def _number(value: float, width: int, digits: int = 3) -> str:
    return f"{value:{width}.{digits}f}" if np.isfinite(value) else "-".rjust(width)
