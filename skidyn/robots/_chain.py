# SPDX-License-Identifier: BSD-3-Clause
"""The robot as a chain of pytorch-kinematics, and a robot of such a chain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._exceptions import RobotDescriptionError
from skidyn._text import suggest
from skidyn.dynamics import central_parts
from skidyn.robots._description import (
    Description,
    Joint,
    Link,
    fixed_joint,
    link_of,
    unit_axis,
)

if TYPE_CHECKING:
    from pytorch_kinematics.chain import Chain

    from skidyn.robots._robot import Robot


def build_chain(robot: Robot) -> Chain:
    """Chain of all bodies in their order and of the links fixed to them, in float64 on the CPU.

    Built from the parsed description and not by the parsers of pytorch-kinematics: these convert
    offsets through float32, independent of torch's default (frames of the bundled robots have
    errors of 1e-8 to 3e-7 m), use z for a missing axis, and do not support locked joints.
    """
    import torch
    from pytorch_kinematics.chain import Chain
    from pytorch_kinematics.frame import Frame, Joint as ChainJoint, Link as ChainLink
    from pytorch_kinematics.transforms import Transform3d

    def offset(rotation: np.ndarray, translation: np.ndarray) -> Any:
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, translation
        return Transform3d(matrix=torch.tensor(matrix), dtype=torch.float64)

    tree = robot.tree
    root = next(name for name, link in robot.links.items() if link.body < 0)
    base = Frame(root, ChainLink(root), ChainJoint(dtype=torch.float64))
    frames = []
    for body, name in enumerate(robot.body_names):
        lower, upper = robot.position_limits[tree.coordinates[body]]
        independent = tree.multipliers[body] == 1.0 and tree.offsets[body] == 0.0
        bounded = independent and np.isfinite(lower) and np.isfinite(upper)
        joint = ChainJoint(
            robot.body_joints[body],
            offset=offset(tree.rotations[body], tree.translations[body]),
            joint_type="prismatic" if tree.prismatic[body] else "revolute",
            axis=torch.tensor(np.array(tree.axes[body])),
            dtype=torch.float64,
            limits=(float(lower), float(upper)) if bounded else None,
        )
        frames.append(Frame(name, ChainLink(name), joint))
        parent = tree.parents[body]
        (frames[parent] if parent >= 0 else base).add_child(frames[-1])
    for name, link in robot.links.items():
        if name == root or name in robot.body_names:
            continue
        fixed = ChainJoint(
            f"{name}_fixed", offset=offset(link.rotation, link.translation), dtype=torch.float64
        )
        carrier = frames[link.body] if link.body >= 0 else base
        carrier.add_child(Frame(name, ChainLink(name), fixed))
    return Chain(base, dtype=torch.float64)


def describe_chain(
    chain: Chain, links: Mapping[str, Link], joints: Mapping[str, Joint]
) -> Description:
    """Description of the frames and joints of a chain, with the inertia of its links.

    Links are in the frames of the chain; those without an entry have no mass. Joints of a file add
    limits, mimic and continuous joints; the others have the limits of the chain. A
    RobotDescriptionError is raised if a name occurs twice or a link with mass is not in the chain.
    """
    names = chain.get_frame_names(exclude_fixed=False)
    found = dict.fromkeys(names, Link("", np.zeros(10)))
    moved: dict[str, Joint] = {}
    root = "world"
    while root in found:
        root += "_"
    stack = [(root, chain.find_frame(names[0]))]
    seen: set[str] = set()
    while stack:
        parent, frame = stack.pop()
        if frame.name in seen:
            raise RobotDescriptionError(
                f"The chain has two frames {frame.name!r}; rename one of them in its description."
            )
        seen.add(frame.name)
        joint = _joint_of(frame, parent, joints)
        if joint.name in moved:
            raise RobotDescriptionError(
                f"The chain has two joints {joint.name!r}; rename one of them in its description."
            )
        moved[joint.name] = joint
        stack.extend((frame.name, child) for child in reversed(frame.children))
    first = moved[next(iter(moved))]
    still = np.all(first.rotation == np.eye(3)) and not np.any(first.translation)
    if first.kind == "fixed" and still:
        del moved[first.name]  # the first frame is the base
    else:
        found = {root: Link(root, np.zeros(10)), **found}
    for name in links:
        if name not in found and np.any(links[name].parameters):
            raise RobotDescriptionError(
                f"The link {name!r} has a mass, but the chain has no such "
                f"frame{suggest(name, names)}. Build the chain of the whole robot and lock joints "
                "by joints=, or give the inertia of its links as a mapping."
            )
    return Description("chain", {n: replace(links.get(n, found[n]), name=n) for n in found}, moved)


def _joint_of(frame: Any, parent: str, joints: Mapping[str, Joint]) -> Joint:
    """The joint that carries a frame of a chain."""
    pose = np.eye(4)
    for offset in (frame.link.offset, frame.joint.offset):
        if offset is not None:
            pose = pose @ offset.get_matrix()[0].detach().cpu().numpy().astype(np.float64)
    # The nearest rotation: a matrix that was stored in float32 is a rotation to seven digits only.
    left, _, right = np.linalg.svd(pose[:3, :3])
    placed = (left @ right, pose[:3, 3])
    own = frame.joint
    if own.joint_type == "fixed":
        return fixed_joint(f"{frame.name}_fixed", parent, frame.name, placed)
    name = str(own.name)
    slides, known = own.joint_type == "prismatic", joints.get(name)
    kinds = ("prismatic",) if slides else ("revolute", "continuous")
    if known is not None and known.kind not in kinds:
        raise RobotDescriptionError(
            f"The joint {name!r} is {kinds[0]} in the chain and {known.kind} in the description; "
            "was the chain built from it?"
        )
    lower, upper = own.limits if own.limits is not None else (-np.inf, np.inf)
    plain = replace(
        known or fixed_joint(name, parent, frame.name, placed),
        parent=parent,
        child=frame.name,
        rotation=placed[0],
        translation=placed[1],
        axis=unit_axis(own.axis.detach().cpu().numpy().astype(np.float64), f"joint {name!r}"),
    )
    return (
        plain
        if known is not None
        else replace(
            plain,
            kind="prismatic" if slides else "continuous" if own.limits is None else "revolute",
            position_limits=(float(lower), float(upper)),
            velocity_limit=_largest(own, "velocity_limits"),
            effort_limit=_largest(own, "effort_limits"),
        )
    )


def _largest(joint: Any, limit: str) -> float:
    """Larger of a joint's two limits of speed or effort; infinite if it has none."""
    pair = getattr(joint, limit, None)  # since pytorch-kinematics 0.7.5
    return np.inf if pair is None else float(np.max(np.abs(pair)))


def links_of(inertials: Mapping[str, Any]) -> dict[str, Link]:
    """Links of ten inertial parameters each about their frames' origins, which must be possible."""
    links = {}
    for name, values in inertials.items():
        parameters = np.asarray(values, dtype=np.float64).ravel()
        if parameters.shape != (10,) or not np.isfinite(parameters).all():
            raise RobotDescriptionError(
                f"The inertia of link {name!r} has to be ten finite numbers: m, mcx, mcy, mcz, "
                "Ixx, Ixy, Ixz, Iyy, Iyz, Izz."
            )
        mass, center, inertia = central_parts(parameters)
        links[name] = link_of(name, mass, inertia, np.eye(3), center)
    return links
