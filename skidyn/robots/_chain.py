# SPDX-License-Identifier: BSD-3-Clause
"""The robot as a chain of pytorch-kinematics: batched, differentiable kinematics in torch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pytorch_kinematics.chain import Chain

    from skidyn.robots._robot import Robot


def build_chain(robot: Robot) -> Chain:
    """Chain of all bodies and of the links fixed to them, in float64 on the CPU.

    Built from what was read already and not by the parsers of pytorch-kinematics: these carry
    offsets through float32 (frames of the Panda are off by 2e-8 m), take z for an axis that is
    missing, and know no locked joints.

    Parameters
    ----------
    robot : Robot

    Returns
    -------
    Chain
        One joint per body, in the order of the bodies.
    """
    import torch
    from pytorch_kinematics.chain import Chain
    from pytorch_kinematics.frame import Frame, Joint, Link
    from pytorch_kinematics.transforms import Transform3d

    def offset(rotation: np.ndarray, translation: np.ndarray) -> Any:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, translation
        return Transform3d(matrix=torch.tensor(matrix), dtype=torch.float64)

    tree = robot.tree
    root = next(name for name, link in robot.links.items() if link.body < 0)
    base = Frame(root, Link(root), Joint(dtype=torch.float64))
    frames = []
    for body, name in enumerate(robot.body_names):
        lower, upper = robot.position_limits[tree.coordinates[body]]
        independent = tree.multipliers[body] == 1.0 and tree.offsets[body] == 0.0
        bounded = independent and np.isfinite(lower) and np.isfinite(upper)
        joint = Joint(
            robot.body_joints[body],
            offset=offset(tree.rotations[body], tree.translations[body]),
            joint_type="prismatic" if tree.prismatic[body] else "revolute",
            axis=torch.tensor(np.array(tree.axes[body])),
            dtype=torch.float64,
            limits=(float(lower), float(upper)) if bounded else None,
        )
        frames.append(Frame(name, Link(name), joint))
        parent = tree.parents[body]
        (frames[parent] if parent >= 0 else base).add_child(frames[-1])
    for name, link in robot.links.items():
        if name == root or name in robot.body_names:
            continue
        fixed = Joint(
            f"{name}_fixed", offset=offset(link.rotation, link.translation), dtype=torch.float64
        )
        carrier = frames[link.body] if link.body >= 0 else base
        carrier.add_child(Frame(name, Link(name), fixed))
    return Chain(base, dtype=torch.float64)
