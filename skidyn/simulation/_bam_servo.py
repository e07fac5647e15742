# SPDX-License-Identifier: BSD-3-Clause
"""A position servo on a pendulum without logged torque, simulated and fitted as in BAM."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from skidyn._columns import column_names, with_columns
from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.export import BamModel, checked_actuator, friction_budget, friction_parameters
from skidyn.robots import Robot

#: Step of BAM's simulation, s.
STEP = 0.005
#: Velocity beyond which BAM aborts, rad/s.
_FASTEST = 100.0
#: Error (rad) beyond which the loss is linear and no longer quadratic.
_LARGE = 0.05
#: Initial values of the search, and its limits: those of BAM, widened.
_TYPICAL = {
    "kt": (0.5, 0.05, 10.0),
    "R": (3.5, 0.2, 40.0),
    "armature": (0.003, 1e-6, 2.0),
    "q_offset": (0.0, -0.2, 0.2),
    "friction_base": (0.02, 0.0, 2.0),
    "friction_viscous": (0.01, 0.0, 2.0),
    "friction_stribeck": (0.01, 0.0, 2.0),
    "dtheta_stribeck": (0.5, 0.02, 10.0),
    "alpha": (1.5, 0.4, 10.0),
}
_LOAD, _QUADRATIC = (0.05, 0.0, 1.0), (0.002, 0.0, 0.2)
#: Factors on torque constant and resistance from which the search starts.
_STARTS = (1.0, 2.0)


def simulate_bam_servo(
    servo: BamModel,
    robot: Robot,
    log: Any,
    *,
    gain: Any,
    volts: Any,
    step: float = STEP,
) -> Any:
    """Motion of a position servo with BAM's friction, from its commands alone.

    The servo sets the share ``clip(gain (q_ref - q), -1, 1)`` of its voltage on the motor, whose
    torque is ``kt / R`` times this voltage minus ``kt dq``. Steps are those of BAM's simulator
    [1]_: friction stops the joint where it can.

    Parameters
    ----------
    servo : BamModel
        With ``kt`` (N m/A), ``R`` (ohm), ``armature`` (kg m^2) and optionally ``q_offset`` (rad).
    robot : Robot
        A robot with one revolute joint and known inertial parameters.
    log : DataFrame
        ``time`` (s), ``q1`` (rad), which gives the initial position, the command ``q_ref1`` (rad);
        with several recordings ``trajectory``; ``enabled``, 0 where the motor is off.
    gain : float or array-like of shape (n_samples,)
        Share of the voltage for each rad of error: BAM's ``kp`` times its ``error_gain``.
    volts : float or array-like of shape (n_samples,)
        Voltage of the supply.
    step : float, default=0.005
        Step, s.

    Returns
    -------
    DataFrame
        The log with the simulated ``q1``, and ``dq1`` (rad/s) if it is there.

    Raises
    ------
    SkidynError
        A column or a constant of the servo is missing, or the robot has more than one joint.

    References
    ----------
    .. [1] M. Duclusaud, G. Passault, V. Padois, O. Ly (2024), Extended friction models for the
       physics simulation of servo actuators.

    Examples
    --------
    >>> from skidyn.export import read_bam
    >>> from skidyn.simulation import simulate_bam_servo
    >>> servo = read_bam("params/xl330/m6.json")  # doctest: +SKIP
    >>> motion = simulate_bam_servo(servo, pendulum, log, gain=1.1, volts=7.4)  # doctest: +SKIP
    """
    bench = _read(robot, log, gain, volts, step)
    lost = [key for key in ("kt", "R", "armature") if key not in servo.parameters]
    if lost:
        raise SkidynError(f"the servo lacks {', '.join(lost)}, on which its motion depends")
    values = {"q_offset": 0.0, **servo.parameters}
    q, dq = _run(bench, servo.name, {k: np.array([[v]]) for k, v in values.items()})
    columns = {"q1": bench.on_rows(q[0])}
    if "dq1" in (column_names(log) or []):
        columns["dq1"] = bench.on_rows(dq[0])
    return with_columns(log, columns)


def fit_bam_servo(
    robot: Robot,
    log: Any,
    *,
    gain: Any,
    volts: Any,
    name: str = "m6",
    actuator: str,
    step: float = STEP,
) -> BamModel:
    """Identify a position servo from commands and positions: motor, armature and friction.

    As on BAM's test bench, a known pendulum determines the scale of the torque. The parameters
    minimise the deviation of :func:`simulate_bam_servo`, run through every recording as a whole,
    from the logged positions: least squares with a linear loss for large errors, from two starts.

    Parameters
    ----------
    robot : Robot
        A robot with one revolute joint and known inertial parameters.
    log : DataFrame
        As for :func:`simulate_bam_servo`; several recordings with several gains and motions.
    gain, volts : float or array-like of shape (n_samples,)
        As for :func:`simulate_bam_servo`.
    name : {"m1", "m2", "m3", "m4", "m5", "m6"}, default="m6"
        Model of friction.
    actuator : str
        Name of the servo in BAM, such as ``"xl330"``.
    step : float, default=0.005
        Step of the simulation, s.

    Returns
    -------
    BamModel
        Model that :func:`skidyn.export.write_bam` can write.

    Raises
    ------
    SkidynError
        A column is missing, or the robot has more than one joint.

    Examples
    --------
    >>> from skidyn.export import write_bam
    >>> from skidyn.simulation import fit_bam_servo
    >>> servo = fit_bam_servo(
    ...     pendulum, log, gain=log["gain"], volts=7.4, actuator="xl330"
    ... )  # doctest: +SKIP
    >>> write_bam(servo, "m6.json")  # doctest: +SKIP
    """
    keys = ["kt", "R", "armature", "q_offset", *friction_parameters(name)]
    servo = checked_actuator(actuator)
    bench = _read(robot, log, gain, volts, step)
    rows = np.array(
        [_TYPICAL.get(k, _QUADRATIC if k.endswith("quad") else _LOAD) for k in keys], dtype=float
    )
    first, low, high = rows.T
    # Steps of the derivative, and units of the parameters, which differ by orders of magnitude.
    size = np.maximum(np.abs(first), 1e-3)
    delta = 1e-4 * size

    def errors(x: Array) -> Array:
        """Errors of several models, shape (n_models, n_errors)."""
        values = {k: x[:, [i]] for i, k in enumerate(keys)}
        q, _ = _run(bench, name, values)
        return np.asarray((q - bench.q)[:, bench.valid])

    def residual(x: Array) -> Array:
        return np.asarray(errors(x[None])[0])

    def derivative(x: Array) -> Array:
        sign = np.where(x + delta > high, -1.0, 1.0)
        both = errors(np.vstack([x, x + np.diag(sign * delta)]))
        return np.asarray(((both[1:] - both[0]) / (sign * delta)[:, None]).T)

    fits = []
    for factor in _STARTS:
        start = first.copy()
        start[:2] *= factor, factor**2
        fits.append(
            least_squares(
                residual,
                np.clip(start, low + 1e-9, high),
                jac=derivative,
                bounds=(low, high),
                x_scale=size,
                loss="soft_l1",
                f_scale=_LARGE,
                max_nfev=60,
            )
        )
    best = min(fits, key=lambda fit: float(fit.cost))
    return BamModel(name, servo, dict(zip(keys, map(float, best.x), strict=True)))


@dataclass(frozen=True)
class _Bench:
    """Recordings on a common clock, shape (n_samples, n_recordings), and the pendulum."""

    q: Array
    start: Array
    command: Array
    gain: Array
    volts: Array
    on: Array
    valid: NDArray[np.bool_]
    step: float
    inertia: float
    gravity: tuple[float, float]
    rows: list[tuple[NDArray[np.intp], Array]]

    def on_rows(self, values: Array) -> Array:
        """Values at the times of the log, (n_rows,)."""
        result = np.empty(sum(len(rows) for rows, _ in self.rows))
        clock = self.step * np.arange(len(values))
        for k, (rows, time) in enumerate(self.rows):
            result[rows] = np.interp(time, clock, values[:, k])
        return result


def _read(robot: Robot, log: Any, gain: Any, volts: Any, step: float) -> _Bench:
    if robot.n_joints != 1 or robot.joint_types[0] == "prismatic":
        raise SkidynError(
            "a servo is fitted on a robot with one revolute joint, as on BAM's test bench"
        )
    table = _columns(log, gain, volts)
    number = table.get("trajectory", np.zeros(len(table["time"])))
    rows, parts = [], []
    for own in (np.flatnonzero(number == k) for k in np.unique(number)):
        time = table["time"][own] - table["time"][own][0]
        if len(own) < 3 or not np.all(np.diff(time) > 0) or time[-1] < 2 * step:
            raise SkidynError(
                f"recording {number[own[0]]:g} is too short, or its time does not grow"
            )
        rows.append((own, time))
        parts.append(_on_clock({k: v[own] for k, v in table.items()}, time, step))
    longest = max(len(part["q1"]) for part in parts)

    def together(key: str) -> Array:
        edges = [np.pad(p[key].astype(float), (0, longest - len(p[key])), "edge") for p in parts]
        return np.column_stack(edges)

    q = together("q1")
    valid = np.column_stack([np.arange(longest) < len(p["q1"]) for p in parts])
    poses = np.array([[0.0], [np.pi / 2]])
    weight = robot.gravity_torque(poses)[:, 0]
    inertia = float(robot.mass_matrix(poses[:1])[0, 0, 0])
    return _Bench(
        q=q,
        start=np.array([q[0], together("speed")[0]]),
        command=together("q_ref1"),
        gain=together("gain"),
        volts=together("volts"),
        on=together("enabled"),
        valid=valid,
        step=step,
        inertia=inertia,
        gravity=(float(weight[1]), float(weight[0])),
        rows=rows,
    )


def _columns(log: Any, gain: Any, volts: Any) -> dict[str, Array]:
    """Columns of a log, with gain and voltage, all of them finite numbers."""
    names = column_names(log)
    lost = [name for name in ("time", "q1", "q_ref1") if name not in (names or [])]
    if lost:
        raise SkidynError(f"the log lacks the column(s) {', '.join(lost)}")
    assert names is not None
    table: dict[str, Array] = {
        name: np.asarray(log[name], dtype=float)
        for name in ("time", "q1", "dq1", "q_ref1", "enabled", "trajectory")
        if name in names
    }
    n = len(table["time"])
    for key, value in (("gain", gain), ("volts", volts)):
        column = np.asarray(value, dtype=float)
        if column.shape not in ((), (n,)) or not np.isfinite(column).all():
            raise SkidynError(f"{key} is to be a number, or one for each of the {n} samples")
        table[key] = np.broadcast_to(column, (n,))
    broken = [k for k, v in table.items() if not np.isfinite(v).all()]
    if broken:
        raise SkidynError(
            f"the column {broken[0]!r} has entries that are not numbers; leave them out"
        )
    return table


def _on_clock(table: Mapping[str, Array], time: Array, step: float) -> dict[str, Array]:
    """Columns of a recording at even steps, ``speed`` the one at its beginning."""
    clock = np.arange(0.0, time[-1], step)
    part: dict[str, Array] = {k: np.interp(clock, time, v) for k, v in table.items()}
    # On or off is that of the sample before.
    past = np.searchsorted(time, clock, side="right") - 1
    on = table.get("enabled", np.ones(len(time)))[past] > 0.5
    part["enabled"] = on.astype(float)
    speed = table["dq1"] if "dq1" in table else np.gradient(table["q1"], time)
    part["speed"] = np.full(len(clock), speed[0])
    return part


def _run(bench: _Bench, name: str, values: Mapping[str, Array]) -> tuple[Array, Array]:
    """Positions and velocities, shape (n_models, n_samples, n_recordings)."""
    h, models = bench.step, len(values["kt"])
    sine, cosine = bench.gravity
    inertia = bench.inertia + values["armature"]
    per_volt = values["kt"] / values["R"]
    shape = (models, *bench.q.shape)
    all_q, all_dq = np.empty(shape), np.empty(shape)
    q, dq = (np.tile(x, (models, 1)) for x in bench.start)
    with np.errstate(all="ignore"):
        for i in range(shape[1]):
            all_q[:, i], all_dq[:, i] = q, dq
            duty = np.clip(bench.gain[i] * (bench.command[i] - q), -1.0, 1.0)
            motor = bench.on[i] * per_volt * (bench.volts[i] * duty - values["kt"] * dq)
            angle = q + values["q_offset"]
            outside = -(sine * np.sin(angle) + cosine * np.cos(angle))
            most = friction_budget(name, values, motor, outside, dq)
            net = motor + outside
            stop = inertia / h * dq + net
            net = net - np.sign(stop) * np.minimum(np.abs(stop), most)
            rate = net / inertia
            dq = np.clip(dq + h * rate, -_FASTEST, _FASTEST)
            q = q + h * dq + 0.5 * h**2 * rate
    return all_q, all_dq
