# SPDX-License-Identifier: BSD-3-Clause
"""A robot that tracks motions under a controller, integrated forward in time by MuJoCo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.datasets.suite._hidden import Hidden, Moment, Setting
from skidyn.datasets.suite._motion import SETTLE, Motion
from skidyn.datasets.suite._plant import STEP, engine, inertia_matrix, inverse, plant, rigid_model

#: Bandwidth of the tracking controller in rad/s and its damping.
BANDWIDTH, DAMPING = 2 * np.pi * 9, 0.75
#: Steps between updates of feed-forward, of gains and of temperatures.
FORWARD, GAINS, THERMAL = 4, 40, 200


@dataclass
class Recording:
    """One trajectory on the integration's clock; ``before`` holds the torque while it settled."""

    clock: Array
    q: Array
    dq: Array
    ddq: Array
    tau: Array
    temperature: Array
    before: Array


@dataclass
class Robotics:
    """Data of the robot for the simulation: drives as arrays, and its true bodies."""

    name: str
    drives: dict[str, Array]
    bodies: dict[str, Array]


def record_all(
    robot: Robotics,
    setting: Setting,
    hidden: Sequence[Hidden],
    motions: Sequence[Motion],
    rng: np.random.Generator,
) -> list[Recording]:
    """Every motion once, with pauses of minutes between them in which the robot warms up."""
    n = setting.n_joints
    warm = {
        "from": rng.uniform(20, 24),
        "by": rng.uniform(16, 26, n),
        "in": rng.uniform(900, 1500, n),
    }
    pauses = rng.uniform(90, 420, len(motions))
    clock, out = float(rng.uniform(0, 60)), []
    loaded = {g for item in hidden if item.payload for g in item.trajectories or ()}
    plants = {
        state: plant(robot.name, robot.bodies, robot.drives, hidden, state)
        for state in (False, True)
    }
    for g, motion in enumerate(motions):
        model, dofs = plants[g in loaded]
        run = _Run(robot, setting, hidden, model, dofs, warm)
        out.append(run.record(g, motion, clock))
        clock += setting.duration + pauses[g]
    return out


class _Run:
    """The closed loop of one trajectory."""

    def __init__(
        self,
        robot: Robotics,
        setting: Setting,
        hidden: Sequence[Hidden],
        model: Any,
        dofs: Array,
        warm: dict[str, Any],
    ) -> None:
        self.mujoco = engine()
        self.robot, self.setting, self.hidden = robot, setting, hidden
        self.model, self.dofs, self.warm = model, dofs, warm
        self.data = self.mujoco.MjData(model)
        self.nominal = rigid_model(robot.name)
        self.scratch = self.mujoco.MjData(self.nominal)
        self.tool = model.body(self.nominal.body(self.nominal.nbody - 1).name).id
        self.soft = sorted({j for item in hidden for j in item.compliance})

    def record(self, g: int, motion: Motion, clock: float) -> Recording:
        n, data, model, dofs = self.setting.n_joints, self.data, self.model, self.dofs
        steps = round((SETTLE + self.setting.duration) / STEP) + 1
        since = np.asarray(np.arange(steps) * STEP - SETTLE, np.float64)
        goal, pace, push = motion(since)
        forward = self._forward(goal, pace, push)
        data.qpos[dofs], data.qvel[dofs] = goal[0], pace[0]
        for item in self.hidden:
            if item.start:
                item.start()
        rows: dict[str, Array] = {
            name: np.empty((steps, n)) for name in ("q", "dq", "ddq", "tau", "temperature")
        }
        still = np.zeros(n)
        moment = Moment(g, STEP, clock, 0.0, goal[0], pace[0], still, still, still)
        dry = self.robot.drives["coulomb"].copy()
        dry[[j for item in self.hidden if item.replaces_coulomb for j in item.joints]] = 0
        damping = self.robot.drives["viscous"]
        model.dof_frictionloss[dofs] = dry
        model.dof_damping[dofs] = damping / 2
        for k in range(steps):
            q, dq = data.qpos[dofs], data.qvel[dofs]
            moment.q, moment.dq, moment.since, moment.clock = q, dq, since[k], clock + since[k]
            if k % THERMAL == 0:
                rise = 1 - np.exp(-max(moment.clock, 0.0) / self.warm["in"])
                moment.temperature = self.warm["from"] + self.warm["by"] * rise
                damping = self._damping(moment)
                # half of it implicit, half explicit: the trapezoidal rule
                model.dof_damping[dofs] = damping / 2
            if k % GAINS == 0:
                gain = self._gain(goal[k])
            pull = BANDWIDTH**2 * (goal[k] - q) + 2 * DAMPING * BANDWIDTH * (pace[k] - dq)
            command = forward[k] + gain @ pull
            self._apply(moment, command, damping, dry)
            self.mujoco.mj_step(model, data)
            after = data.qvel[dofs]
            # velocities of the symplectic scheme belong between the steps
            rows["q"][k], rows["dq"][k], rows["ddq"][k] = q, (dq + after) / 2, (after - dq) / STEP
            rows["tau"][k], rows["temperature"][k] = command, moment.temperature
            moment.ddq = rows["ddq"][k]
            carried = data.qfrc_applied + data.qfrc_passive + data.qfrc_constraint
            moment.load = carried[dofs]
            if not np.isfinite(after).all() or np.abs(after).max() > 60:
                raise FloatingPointError(f"the simulation diverged in trajectory {g}")
        first = round(SETTLE / STEP)
        kept = {name: values[first:] for name, values in rows.items()}
        return Recording(clock + since[first:], **kept, before=rows["tau"][:first])

    def _forward(self, q: Array, dq: Array, ddq: Array) -> Array:
        """Feed-forward torque of the nominal robot with its known friction."""
        drives = self.robot.drives
        some = np.unique(np.append(np.arange(0, len(q), FORWARD), len(q) - 1))
        torque = np.array([inverse(self.nominal, self.scratch, q[k], dq[k], ddq[k]) for k in some])
        every = np.arange(len(q))
        rigid = np.column_stack([np.interp(every, some, t) for t in torque.T])
        dry = drives["coulomb"] * np.tanh(dq / (0.03 * self.setting.low_speed))
        return np.asarray(rigid + drives["viscous"] * dq + dry + drives["rotor"] * ddq)

    def _gain(self, q: Array) -> Array:
        """Inertia in the controller; for a soft joint only that of the motor."""
        rotor = self.robot.drives["rotor"]
        matrix = inertia_matrix(self.nominal, self.scratch, q) + np.diag(rotor)
        for j in self.soft:
            matrix[j], matrix[:, j] = 0, 0
            matrix[j, j] = 1.5 * max(rotor[j], 0.1)
        return matrix

    def _damping(self, moment: Moment) -> Array:
        out = self.robot.drives["viscous"].copy()
        for item in self.hidden:
            if item.damping:
                item.damping(moment, out)
        return np.maximum(out, 0)

    def _apply(self, moment: Moment, command: Array, damping: Array, dry: Array) -> None:
        """Torques, friction levels and tool forces of this step."""
        resisting = damping * moment.dq / 2
        friction = dry
        force = None
        for item in self.hidden:
            if item.torque:
                item.torque(moment, resisting)
            if item.friction:
                friction = friction.copy()
                item.friction(moment, friction)
            if item.tool_force:
                force = item.tool_force(moment, self.data.xpos[self.tool].copy())
                lever = self.data.xpos[self.tool] - self.data.xipos[self.tool]
                force = np.zeros(3) if force is None else force
                self.data.xfrc_applied[self.tool] = np.append(force, np.cross(lever, force))
        self.data.qfrc_applied[self.dofs] = command - resisting
        if friction is not dry:
            self.model.dof_frictionloss[self.dofs] = np.maximum(friction, 0)
