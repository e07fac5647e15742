# SPDX-License-Identifier: BSD-3-Clause
"""Forward simulation of a fitted model along a log."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from skidyn._columns import column_names, resolve_columns, with_columns
from skidyn._exceptions import SkidynError
from skidyn._signals import Array
from skidyn.forward import STEP, Controller, ForwardModel, Task, read_task, run
from skidyn.identification import RBDRegressor


def simulate(
    model: RBDRegressor,
    X: Any,
    y: Any = None,
    *,
    controller: Controller | None = None,
    horizon: float | None = None,
    engine: Literal["own", "mujoco"] = "own",
    step: float = STEP,
) -> Any:
    """Simulate a fitted model from the initial state of the log.

    Open loop, the logged torque drives the model; with a ``controller``, the logged reference does.
    Dry friction is set-valued: a joint that it can hold remains at rest. Hysteresis starts in the
    state that results from the logged motion; elastic joints have an additional coordinate for
    their link. With a horizon the model restarts from the logged state every ``horizon`` seconds.

    Parameters
    ----------
    model : RBDRegressor
        Fitted model, with any effects.
    X : DataFrame
        Motion, following the X contract, with ``time`` (s); with a controller also the reference
        ``q_ref1..`` (rad, m).
    y : array-like of shape (n_samples, n_joints), optional
        Torque that drives the model, N m or N; not with a controller.
    controller : Controller, optional
        Drives the model toward ``q_ref1..`` instead of y.
    horizon : float, s, optional
        Length of the pieces; None simulates every trajectory as a whole.
    engine : {"own", "mujoco"}, default="own"
        ``"mujoco"`` steps MuJoCo with the model's MJCF (extra ``mujoco``), if this format can
        represent every effect.
    step : float, default=0.002
        Longest step of the integrator, s; never longer than that of the log.

    Returns
    -------
    DataFrame
        X with the simulated q and dq in place of the logged ones, row for row. Samples that no
        piece reaches, and those after a motion that grew without bound, are NaN.

    Raises
    ------
    SkidynError
        The model is not fitted or not a physical one, the log has no time, there is neither torque
        nor controller, y has other rows than X or its columns another order, the step is not
        positive, an effect cannot be simulated, or the inertia of the model is not positive
        definite.

    See Also
    --------
    skidyn.simulation.simulation_errors : Deviation from the log.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.identification import RBDRegressor
    >>> from skidyn.simulation import simulate
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> model = RBDRegressor(log.robot).fit(log.X, log.y)
    >>> run = log.frame["trajectory"] == 1
    >>> motion = simulate(model, log.X[run], log.y[run], horizon=0.5)
    >>> bool((motion["q1"] - log.X["q1"][run]).abs().max() < 0.1)
    True
    """
    if not step > 0:
        raise SkidynError(f"step={step!r}; a time above 0 s is expected")
    task = read_task(model, X, y, controller, horizon)
    if engine == "mujoco":
        from skidyn.simulation._mujoco import run_mujoco

        q, dq = run_mujoco(model, task, step)
    elif engine == "own":
        q, dq = run(ForwardModel(model), task, step)
    else:
        raise SkidynError(f"engine={engine!r}; expected 'own' or 'mujoco'")
    return _on_rows(X, model, task, q, dq)


def _on_rows(X: Any, model: RBDRegressor, task: Task, q: Array, dq: Array) -> Any:
    """The table with the simulated motion; where pieces meet, the earlier one is used."""
    windows, n = task.windows, model.robot_.n_joints
    names = column_names(X) or []
    columns = resolve_columns(
        names, len(names), model.robot_.joint_names, require_acceleration=False
    )
    values = np.full((2 * n, len(task.signals.q)), np.nan)
    for k in range(len(windows.rows)):
        own = windows.valid[k].copy()
        rows = windows.rows[k][own]
        fresh = np.isnan(values[0, rows])
        values[:n, rows[fresh]] = q[k][own][fresh].T
        values[n:, rows[fresh]] = dq[k][own][fresh].T
    places = [*columns.q, *columns.dq]
    return with_columns(X, {names[p]: values[i] for i, p in enumerate(places)})
