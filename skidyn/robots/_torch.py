# SPDX-License-Identifier: BSD-3-Clause
"""Newton-Euler in torch on the transforms of the robot's chain of pytorch-kinematics.

Poses of all bodies come from one batched forward kinematics. Velocities, accelerations and wrenches
are in the base frame, in which the wrenches of bodies can be added. The gradient of the poses is
torch's and not the analytical one of pytorch-kinematics, which cannot be differentiated again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import torch
from torch.linalg import cross

if TYPE_CHECKING:
    from torch import Tensor

    from skidyn.robots._robot import Robot


class _Body(NamedTuple):
    """Motion of one body in the base frame; every tensor of shape (n_samples, 3) or (.., 3, 3)."""

    rotation: Tensor
    origin: Tensor
    axis: Tensor
    angular_velocity: Tensor
    angular_acceleration: Tensor
    acceleration: Tensor


class TorchDynamics:
    """Inverse dynamics and regressor of a robot in torch."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._chains: dict[Any, Any] = {}

    def inverse_dynamics(
        self, q: Tensor, dq: Tensor, ddq: Tensor, parameters: Any = None
    ) -> Tensor:
        """Joint torques of a motion, shape of ``q``."""
        robot, tree = self.robot, self.robot.tree
        if parameters is None:
            parameters = robot.inertial_parameters.copy()
        parameters = torch.as_tensor(parameters, dtype=q.dtype, device=q.device)
        shape, (q, dq, ddq) = q.shape, (x.reshape(-1, robot.n_joints) for x in (q, dq, ddq))
        bodies = self._bodies(q, dq, ddq)
        forces: list[Any] = [0.0] * len(bodies)
        moments: list[Any] = [0.0] * len(bodies)  # about the origin of the base frame
        torque = [torch.zeros_like(q[:, 0]) for _ in range(robot.n_joints)]
        for k in reversed(range(len(bodies))):
            body, parent, joint = bodies[k], int(tree.parents[k]), int(tree.coordinates[k])
            force, moment = (
                body.rotation @ (own @ parameters[k])[..., None] for own in _wrench(body)
            )
            forces[k] = forces[k] + force[..., 0]
            moments[k] = moments[k] + moment[..., 0] + cross(body.origin, force[..., 0])
            if tree.prismatic[k]:
                own = forces[k]
            else:
                own = moments[k] - cross(body.origin, forces[k])
            torque[joint] = torque[joint] + float(tree.multipliers[k]) * (body.axis * own).sum(-1)
            if parent >= 0:
                forces[parent] = forces[parent] + forces[k]
                moments[parent] = moments[parent] + moments[k]
        return torch.stack(torque, dim=-1).reshape(shape)

    def torque_regressor(self, q: Tensor, dq: Tensor, ddq: Tensor) -> Tensor:
        """Joint torque per unit of every inertial parameter, shape (..., n_joints, 10 n_bodies)."""
        robot, tree = self.robot, self.robot.tree
        shape, (q, dq, ddq) = q.shape, (x.reshape(-1, robot.n_joints) for x in (q, dq, ddq))
        bodies = self._bodies(q, dq, ddq)
        blocks = []
        for k, body in enumerate(bodies):
            force, moment = (body.rotation @ own for own in _wrench(body))
            rows = [q.new_zeros(len(q), 10) for _ in range(robot.n_joints)]
            for i in tree.path(k):
                axis, joint = bodies[i].axis, int(tree.coordinates[i])
                if tree.prismatic[i]:
                    own = (axis[:, None] @ force)[:, 0]
                else:
                    arm = cross(axis, body.origin - bodies[i].origin)
                    own = (axis[:, None] @ moment + arm[:, None] @ force)[:, 0]
                rows[joint] = rows[joint] + float(tree.multipliers[i]) * own
            blocks.append(torch.stack(rows, dim=1))
        return torch.cat(blocks, dim=-1).reshape(*shape, 10 * robot.n_bodies)

    def _bodies(self, q: Tensor, dq: Tensor, ddq: Tensor) -> list[_Body]:
        """Motion of every body; gravity is an acceleration of the base."""
        robot, tree = self.robot, self.robot.tree
        like: dict[str, Any] = {"dtype": q.dtype, "device": q.device}
        chain = self._chain(q)
        place = [int(c) for c in tree.coordinates]
        factor = torch.tensor(tree.multipliers, **like)
        position = q[:, place] * factor + torch.tensor(tree.offsets, **like)
        speed, rate = dq[:, place] * factor, ddq[:, place] * factor
        poses = _poses(chain, position)
        zero = q.new_zeros(len(q), 3)
        base = _Body(zero, zero, zero, zero, zero, zero - torch.tensor(robot.gravity, **like))
        bodies: list[_Body] = []
        for k, name in enumerate(robot.body_names):
            pose = poses[name]
            rotation, origin = pose[:, :3, :3], pose[:, :3, 3]
            axis = rotation @ torch.tensor(tree.axes[k], **like)
            above = bodies[tree.parents[k]] if tree.parents[k] >= 0 else base
            turn, slide = (0.0, 1.0) if tree.prismatic[k] else (1.0, 0.0)
            along, onward = axis * speed[:, k : k + 1], axis * rate[:, k : k + 1]
            arm, spin = origin - above.origin, above.angular_velocity
            bodies.append(
                _Body(
                    rotation,
                    origin,
                    axis,
                    spin + turn * along,
                    above.angular_acceleration + turn * (onward + cross(spin, along)),
                    above.acceleration
                    + cross(above.angular_acceleration, arm)
                    + cross(spin, cross(spin, arm))
                    + slide * (onward + 2 * cross(spin, along)),
                )
            )
        return bodies

    def _chain(self, like: Tensor) -> Any:
        """The robot's chain in the precision and on the device of a tensor."""
        key = like.dtype, like.device
        if key not in self._chains:
            self._chains[key] = self.robot.chain.to(dtype=like.dtype, device=like.device)
        return self._chains[key]


def _wrench(body: _Body) -> tuple[Tensor, Tensor]:
    """Force on a body and moment about its origin, in its frame, per unit of its parameters."""
    back = body.rotation.transpose(-1, -2)
    motion = body.acceleration, body.angular_velocity, body.angular_acceleration
    a, w, alpha = ((back @ vector[..., None])[..., 0] for vector in motion)
    spin = _skew(w)
    force = torch.cat([a[..., None], _skew(alpha) + spin @ spin, a.new_zeros(len(a), 3, 6)], dim=-1)
    inertia = _inertia_columns(alpha) + spin @ _inertia_columns(w)
    moment = torch.cat([a.new_zeros(len(a), 3, 1), -_skew(a), inertia], dim=-1)
    return force, moment


def _skew(vector: Tensor) -> Tensor:
    """Matrices of the cross product with vectors, shape (n_samples, 3, 3)."""
    x, y, z = vector.unbind(-1)
    zero = torch.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)


def _inertia_columns(vector: Tensor) -> Tensor:
    """Factors of (Ixx, Ixy, Ixz, Iyy, Iyz, Izz) in the product of inertia and vector."""
    x, y, z = vector.unbind(-1)
    zero = torch.zeros_like(x)
    rows = [[x, y, z, zero, zero, zero], [zero, x, zero, y, z, zero], [zero, zero, x, zero, y, z]]
    return torch.stack([torch.stack(row, dim=-1) for row in rows], dim=-2)


def _poses(chain: Any, position: Tensor) -> dict[str, Tensor]:
    """Pose of every frame of a chain, (n, 4, 4), with derivatives of any order."""
    if hasattr(chain, "forward_kinematics_tensor"):
        # since pytorch-kinematics 0.8; its analytical gradient cannot be differentiated again
        table = chain.forward_kinematics_tensor(position, analytical_grad=False)
        return {name: table[index] for name, index in chain.frame_to_idx.items()}
    frames = chain.forward_kinematics(position)
    return {name: pose.get_matrix() for name, pose in frames.items()}
