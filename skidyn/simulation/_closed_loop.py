# SPDX-License-Identifier: BSD-3-Clause
"""A model that follows the reference of a controller, with the friction of the regressor.

Instruments need the motion of the equations whose columns they make: dry friction there is a
continuous function of the velocity. The steps of ``skidyn.forward`` have set-valued friction, which
makes other velocities at reversals (by some 0.01 rad/s), and no accelerations that fulfil these
equations; on motion without friction both agree (``tests/simulation/test_closed_loop.py``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from skidyn._columns import Columns, resolve_columns, with_columns
from skidyn._exceptions import ColumnError, SkidynError
from skidyn._signals import Array, find_segments
from skidyn.dynamics import ScalarFunction
from skidyn.export import static_model
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: Local error of a step, relative and in rad or m. The total error is some 1e-4 rad; a tenth of it
#: takes ten times as long and does not improve instruments.
_RELATIVE, _ABSOLUTE = 1e-4, 1e-6

#: Number of poses at which the inertia is checked.
_POSES = 20

#: Distance from the reference, rad or m, at which a simulation is aborted.
_LOST = 10.0


def simulate_closed_loop(
    model: RBDRegressor | Robot,
    reference: Any,
    stiffness: Any,
    damping: Any,
    *,
    gravity_compensation: bool = True,
) -> Any:
    """Motion of a model whose joints follow a reference by proportional-derivative control.

    The torque is ``stiffness (q_ref - q) + damping (dq_ref - dq)``, with or without the torque that
    holds the model against gravity. Every trajectory starts on its reference.

    With the reference and the gains of the robot's own controller this is the auxiliary model of
    IDIM-IV [1]_: its motion resembles that of the robot but is independent of sensor noise, and
    therefore provides the instruments for ``RBDRegressor(estimator="instrumental")``. Two or three
    rounds of simulation and fit suffice, from a first fit by least squares.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot without friction.
    reference : DataFrame
        Positions (rad, m) and velocities (rad/s, m/s) that the controller is to follow, in columns
        named as in X (``q1..``, ``dq1..``), with ``time`` in s and, if there are several,
        ``trajectory``; pandas or polars.
    stiffness : float or array-like of shape (n_joints,)
        Proportional gain, N m/rad (N/m for sliding joints).
    damping : float or array-like of shape (n_joints,)
        Derivative gain, N m s/rad (N s/m).
    gravity_compensation : bool, default=True
        Whether the controller adds the model's torque at rest.

    Returns
    -------
    DataFrame
        The reference with the simulated q, dq and ddq instead of its own, row by row; positions to
        about 1e-4 rad.

    Raises
    ------
    SkidynError
        The model has effects with a memory or that depend on the recording; a gain is negative or
        does not have one number for each joint; the motion grows without bound.
    ColumnError
        A column of the reference is missing.

    See Also
    --------
    skidyn.identification.RBDRegressor : ``fit(X, y, instruments=...)``.
    skidyn.identification.repetition_instruments : Instruments from repeated runs.

    References
    ----------
    .. [1] A. Janot, P.-O. Vandanjon, M. Gautier (2014), A generic instrumental variable approach
       for industrial robot identification, IEEE Trans. Control Systems Technology 22(1), 132-145.

    Examples
    --------
    >>> import numpy as np
    >>> import pandas as pd
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.simulation import simulate_closed_loop
    >>> time = np.linspace(0, 1, 101)
    >>> reference = pd.DataFrame({"time": time, "q1": 1 - np.cos(time), "q2": 0 * time})
    >>> reference = reference.assign(dq1=np.sin(time), dq2=0.0)
    >>> motion = simulate_closed_loop(load_planar_arm(), reference, 400.0, 40.0)
    >>> float((motion["q1"] - reference["q1"]).abs().max().round(3))
    0.001
    """
    static = static_model(model)
    if static.left:
        raise SkidynError(
            f"{', '.join(static.left_names)}: depends on more than the current q, dq and ddq and "
            "cannot be simulated here; fit a model without it first"
        )
    n = static.robot.n_joints
    gains = [_gain(x, n, name) for x, name in ((stiffness, "stiffness"), (damping, "damping"))]
    names = [str(name) for name in reference.columns]
    columns = resolve_columns(
        names, len(names), static.robot.joint_names, require_acceleration=False
    )
    q, dq, time, trajectory = _read(reference, columns)
    torque = ScalarFunction(static.program)
    _check_inertia(torque, q)
    acceleration = _acceleration(torque, gains[0], gains[1], gravity_compensation)
    simulated = np.empty((3, len(time), n))
    for rows in find_segments(trajectory, time):
        wanted = CubicHermiteSpline(time[rows], q[rows], dq[rows])
        simulated[:, rows] = _follow(acceleration, wanted, time[rows], int(trajectory[rows.start]))
    return _replaced(reference, names, columns, simulated)


def _gain(value: Any, n_joints: int, name: str) -> Array:
    gain = np.asarray(value, dtype=float)
    if gain.shape not in ((), (n_joints,)) or not np.all(gain >= 0):
        raise SkidynError(
            f"{name} is {value!r}; expected a number of at least 0, or one for each of the "
            f"{n_joints} joints"
        )
    return np.broadcast_to(gain, (n_joints,))


def _read(reference: Any, columns: Columns) -> tuple[Array, Array, Array, Array]:
    """Positions, velocities, time and trajectory of the reference."""
    if columns.time is None:
        raise ColumnError("the reference has no column 'time' (s); a simulation needs it")
    table = np.asarray(reference, dtype=float)
    time = table[:, columns.time]
    number = np.zeros(len(table)) if columns.trajectory is None else table[:, columns.trajectory]
    q, dq = table[:, list(columns.q)], table[:, list(columns.dq)]
    for values, what in ((q, "positions"), (dq, "velocities"), (time[:, None], "time")):
        broken = np.flatnonzero(~np.isfinite(values).all(axis=1))
        if len(broken):
            raise SkidynError(
                f"{what} of the reference are not numbers in row {broken[0]} "
                f"({len(broken)} row(s)); leave these rows out of the reference and of the log"
            )
    return q, dq, time, number.astype(int)


def _unit_accelerations(q: Array) -> dict[str, Array]:
    """A pose at rest without acceleration, twice, then with one unit acceleration after another."""
    n = len(q)
    still = np.zeros((n + 2, n))
    return {"q": np.tile(q, (n + 2, 1)), "dq": still, "ddq": np.vstack([still[:2], np.eye(n)])}


def _check_inertia(torque: ScalarFunction, q: Array) -> None:
    """Refuse a model whose inertia is not positive definite: its motion would diverge at once."""
    for row in np.unique(np.linspace(0, len(q) - 1, _POSES).astype(int)):
        _, rest, *columns = torque(_unit_accelerations(q[row]))
        least = np.linalg.eigvalsh(np.column_stack(columns) - rest[:, np.newaxis])[0]
        if not least > 0.0:
            raise SkidynError(
                f"the inertia matrix of the model has the eigenvalue {least:.3g} in row {row} of "
                "the reference: such bodies cannot be simulated. Fit with consistent=True, or "
                "give the links an <inertial>."
            )


def _acceleration(
    torque: ScalarFunction, stiffness: Array, damping: Array, compensated: bool
) -> Callable[[Array, Array, Array, Array], Array]:
    """Acceleration of the controlled model at a state and reference."""

    def acceleration(q: Array, dq: Array, q_wanted: Array, dq_wanted: Array) -> Array:
        signals = _unit_accelerations(q)
        signals["dq"] = np.vstack([dq, signals["dq"][1:]])
        bias, rest, *columns = torque(signals)
        drive = stiffness * (q_wanted - q) + damping * (dq_wanted - dq)
        if compensated:
            drive = drive + rest
        inertia = np.column_stack(columns) - rest[:, np.newaxis]
        return np.linalg.solve(inertia, drive - bias)

    return acceleration


def _follow(
    acceleration: Callable[[Array, Array, Array, Array], Array],
    wanted: CubicHermiteSpline,
    time: Array,
    trajectory: int,
) -> Array:
    """Positions, velocities and accelerations at the times, shape (3, n_times, n_joints)."""
    velocity = wanted.derivative()
    start = np.concatenate([wanted(time[0]), velocity(time[0])])
    n = len(start) // 2

    def change(at: float, state: Array) -> Array:
        q, dq = state[:n], state[n:]
        return np.concatenate([dq, acceleration(q, dq, wanted(at), velocity(at))])

    def lost(at: float, state: Array) -> float:
        return _LOST - float(np.abs(state[:n] - wanted(at)).max())

    lost.terminal = True  # type: ignore[attr-defined]
    # Dry friction is stiff: its sign changes within a thousandth of a rad/s.
    solution = solve_ivp(
        change,
        (time[0], time[-1]),
        start,
        method="LSODA",
        t_eval=time,
        events=lost,
        rtol=_RELATIVE,
        atol=_ABSOLUTE,
    )
    if solution.status != 0:
        raise SkidynError(
            f"trajectory {trajectory}: the model left its reference by more than {_LOST:g} rad "
            f"(m), or the solver failed ({solution.message}). Check that stiffness and damping "
            "are those of the controller, and that no friction of the model is negative."
        )
    q, dq = solution.y[:n].T, solution.y[n:].T
    ddq = [acceleration(*row) for row in zip(q, dq, wanted(time), velocity(time), strict=True)]
    return np.array([q, dq, ddq])


def _replaced(reference: Any, names: list[str], columns: Columns, simulated: Array) -> Any:
    """The table with other positions, velocities and accelerations."""
    q, dq = ([names[k] for k in places] for places in (columns.q, columns.dq))
    ddq = ["d" + name for name in dq] if columns.ddq is None else [names[k] for k in columns.ddq]
    values = np.concatenate(simulated, axis=1).T
    return with_columns(reference, dict(zip([*q, *dq, *ddq], values, strict=True)))
