# SPDX-License-Identifier: BSD-3-Clause
"""MuJoCo as the engine, if its elements can represent the whole model."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional
from skidyn._signals import Array
from skidyn.export import write_mjcf
from skidyn.identification import RBDRegressor


def run_mujoco(model: RBDRegressor, task: Any, step: float) -> tuple[Array, Array]:
    """Positions and velocities of every piece, shape (n_pieces, n_samples, n_joints).

    Dry friction is MuJoCo's ``frictionloss``, which lets a joint that is held creep a little.
    """
    mujoco = import_optional("mujoco", extra="mujoco")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "model.xml")
        left = write_mjcf(model, path)
        # A passive joint would have to start in equilibrium, and its limits are softer than ours.
        left = (*left, *(str(t) for t in model.effect_terms_ if t.effect.moves_link))
        if left:
            raise SkidynError(
                f"MuJoCo has no elements for {', '.join(left)}; simulate with engine='own'"
            )
        world = mujoco.MjModel.from_xml_path(str(path))
    own = [int(world.joint(name).dofadr[0]) for name in model.robot_.joint_names]
    # Runge-Kutta if nothing is stiff; it can treat frictionloss, which is a constraint.
    world.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    world.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    world.jnt_limited[:] = 0
    windows, signals = task.windows, task.signals
    shape = (*windows.rows.shape, len(own))
    q, dq = np.full(shape, np.nan), np.full(shape, np.nan)
    data = mujoco.MjData(world)
    for k, rows in enumerate(windows.rows):
        mujoco.mj_resetData(world, data)
        data.qpos[own], data.qvel[own] = signals.q[rows[0]], signals.dq[rows[0]]
        q[k, 0], dq[k, 0] = data.qpos[own], data.qvel[own]
        last = int(windows.valid[k].sum())
        for i in range(last - 1):
            span = windows.time[k, i + 1] - windows.time[k, i]
            parts = max(1, int(np.ceil(span / step - 1e-9)))
            world.opt.timestep = span / parts
            for part in range(parts):
                share = (part + 0.5) / parts
                ends = rows[i], rows[i + 1]
                data.qfrc_applied[own] = _force(task, ends, share, data, own)
                mujoco.mj_step(world, data)
            q[k, i + 1], dq[k, i + 1] = data.qpos[own], data.qvel[own]
            if not np.isfinite(data.qpos).all():
                break
    return q, dq


def _force(task: Any, ends: Any, share: float, data: Any, own: list[int]) -> Array:
    """Torque of the drive in the middle of a step."""
    a, b = ends
    if task.controller is None:
        return np.asarray(task.torque[a] + share * (task.torque[b] - task.torque[a]))
    if task.controller.delay:
        raise SkidynError("engine='mujoco' has no delay of the reference; use engine='own'")
    wanted = task.reference[a] + share * (task.reference[b] - task.reference[a])
    rate = task.rate[a] + share * (task.rate[b] - task.rate[a])
    q, dq = data.qpos[own], data.qvel[own]
    return np.asarray(task.controller.torque(q, dq, wanted, rate))
