# SPDX-License-Identifier: BSD-3-Clause
"""Measured and predicted torque and their difference, as files that log viewers open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional
from skidyn._signals import Array, Signals, read_signals
from skidyn._writing import PathLike, replacing
from skidyn.robots import Robot

#: Seconds between trajectories whose clocks overlap.
PAUSE = 1.0
JOINT_STATE = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_traces(
    path: PathLike,
    X: Any,
    y: ArrayLike,
    y_pred: ArrayLike,
    robot: Robot,
    *,
    rate: float | None = None,
) -> Path:
    """Write measured torque, predicted torque and the residual for a log viewer.

    ``.mcap`` holds ``sensor_msgs/msg/JointState`` of ROS 2 on the topics ``/measured`` (with
    positions and velocities), ``/predicted`` and ``/residual``, for PlotJuggler, Foxglove and
    ROS 2; ``.rrd`` is a recording for Rerun with a scalar of every joint under ``torque``,
    ``position`` and ``velocity``. Trajectories whose clocks overlap follow one another.

    Parameters
    ----------
    path : str or Path
        File; ``.mcap`` needs the extra ``io``, ``.rrd`` the extra ``rerun``.
    X : DataFrame or array of shape (n_samples, n_features)
        Motion with its time, as estimators take it.
    y, y_pred : array-like of shape (n_samples, n_joints)
        Measured and predicted torque, N m (N if prismatic); the residual is ``y - y_pred``.
    robot : Robot
        Robot, whose joint names are used for the traces.
    rate : float, Hz, optional
        Sampling rate if X has no time.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        The file has another ending, X no time, or the torques differ in shape.
    ImportError
        The format's package is not installed; the message names the extra.

    See Also
    --------
    sklearn.model_selection.cross_val_predict : Predictions of recordings that the fit left out.

    Examples
    --------
    >>> from skidyn.export import write_traces
    >>> write_traces("errors.mcap", X, y, model.predict(X), robot)  # doctest: +SKIP
    PosixPath('errors.mcap')
    """
    path = Path(path)
    if path.suffix.lower() not in WRITERS:
        raise SkidynError(
            f"{path.name!r} must end in {' or '.join(WRITERS)}, which selects the viewer"
        )
    signals, torque = read_signals(X, y, robot, rate=rate)
    told = np.asarray(y_pred, dtype=float).reshape(len(torque), -1)
    if told.shape != torque.shape:
        raise SkidynError(
            f"the predicted torque has shape {told.shape}, the measured one {torque.shape}"
        )
    traces = {"measured": torque, "predicted": told, "residual": torque - told}
    with replacing(path) as part:
        WRITERS[path.suffix.lower()](part, robot.joint_names, signals, traces)
    return path


def _clock(signals: Signals) -> Array:
    """Time in s that never decreases: overlapping trajectories are shifted to follow each other."""
    clock, end = np.array(signals.time, dtype=float), -np.inf  # of a log with time
    for name in dict.fromkeys(signals.trajectory.tolist()):
        here = signals.trajectory == name
        if clock[here].min() <= end:
            clock[here] += end + PAUSE - clock[here].min()
        end = clock[here].max()
    return np.asarray(clock - min(0.0, clock.min()))


def _write_mcap(
    path: Path, names: tuple[str, ...], signals: Signals, traces: dict[str, Array]
) -> None:
    writer = import_optional("mcap_ros2.writer", extra="io")
    clock = np.round(_clock(signals) * 1e9).astype(np.int64)
    with path.open("wb") as file, writer.Writer(file) as out:
        schema = out.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
        for k in np.argsort(clock, kind="stable"):
            when = int(clock[k])
            stamp = SimpleNamespace(sec=when // 10**9, nanosec=when % 10**9)
            header = SimpleNamespace(stamp=stamp, frame_id=f"trajectory {signals.trajectory[k]}")
            for topic, torque in traces.items():
                moves = topic == "measured"
                message = SimpleNamespace(
                    header=header,
                    name=list(names),
                    position=signals.q[k].tolist() if moves else [],
                    velocity=signals.dq[k].tolist() if moves else [],
                    effort=torque[k].tolist(),
                )
                out.write_message(f"/{topic}", schema, message, log_time=when)


def _write_rerun(
    path: Path, names: tuple[str, ...], signals: Signals, traces: dict[str, Array]
) -> None:
    rerun = import_optional("rerun", extra="rerun")
    clock = _clock(signals)
    order = np.argsort(clock, kind="stable")
    groups = {f"torque/{{}}/{kind}": torque for kind, torque in traces.items()}
    groups |= {"position/{}": signals.q, "velocity/{}": signals.dq}
    recording = rerun.RecordingStream("skidyn")
    recording.save(path)
    times = [rerun.TimeColumn("time", duration=clock[order])]
    for pattern, values in groups.items():
        for j, name in enumerate(names):
            columns = rerun.Scalars.columns(scalars=values[order, j])
            recording.send_columns(pattern.format(name), indexes=times, columns=columns)
    recording.disconnect()  # waits until everything is written


Writer = Callable[[Path, tuple[str, ...], Signals, dict[str, NDArray[np.float64]]], None]
WRITERS: dict[str, Writer] = {".mcap": _write_mcap, ".rrd": _write_rerun}
