# SPDX-License-Identifier: BSD-3-Clause
"""Assembly of links and joints to a tree of moving bodies."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from skidyn._exceptions import RobotDescriptionError, RobotDescriptionWarning
from skidyn._text import suggest
from skidyn.dynamics import KinematicTree, central_parts, transform_inertial
from skidyn.robots._description import Description, Joint, Mimic, is_positive


@dataclass(frozen=True)
class LinkPlacement:
    """Place of a link: the moving body that carries it (-1: the base) and its pose in this body."""

    body: int
    rotation: np.ndarray
    translation: np.ndarray


@dataclass
class Assembly:
    """Moving bodies of a robot, including everything fixed to them."""

    joints: list[Joint] = field(default_factory=list)  # the independent ones
    body_names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    rotations: list[np.ndarray] = field(default_factory=list)
    translations: list[np.ndarray] = field(default_factory=list)
    moved_by: list[Joint] = field(default_factory=list)
    following: list[Mimic] = field(default_factory=list)
    parameters: list[np.ndarray] = field(default_factory=list)
    links: dict[str, LinkPlacement] = field(default_factory=dict)

    def tree(self) -> KinematicTree:
        """Arrays for the recursions."""
        coordinate = {joint.name: i for i, joint in enumerate(self.joints)}
        return KinematicTree(
            parents=np.array(self.parents, dtype=np.intp),
            rotations=np.array(self.rotations),
            translations=np.array(self.translations),
            axes=np.array([joint.axis for joint in self.moved_by]),
            prismatic=np.array([joint.kind == "prismatic" for joint in self.moved_by]),
            coordinates=np.array([coordinate[m.leader] for m in self.following], dtype=np.intp),
            multipliers=np.array([m.multiplier for m in self.following]),
            offsets=np.array([m.offset for m in self.following]),
        )


def assemble(description: Description, selected: Sequence[str] | None) -> Assembly:
    """Tree of moving bodies, depth first in the order of the file; other joints stay at zero.

    A RobotDescriptionError is raised if links and joints form no tree or a name is unknown.
    """
    root = _root_of(description)
    following = _resolve_mimics(description)
    moving = _moving_joints(description, following, selected)
    children: dict[str, list[Joint]] = {}
    for joint in description.joints.values():
        children.setdefault(joint.parent, []).append(joint)
    assembly = Assembly()
    base = LinkPlacement(-1, np.eye(3), np.zeros(3))
    # An explicit stack: chains of ten thousand joints would exceed Python's limit of recursion.
    stack: list[tuple[Joint | None, LinkPlacement]] = [(None, base)]
    while stack:
        arrival, placement = stack.pop()
        name = root
        if arrival is not None:
            name = arrival.child
            placement = _attach(assembly, arrival, placement, following, moving)
        assembly.links[name] = placement
        if placement.body >= 0:
            assembly.parameters[placement.body] += transform_inertial(
                description.links[name].parameters, placement.rotation, placement.translation
            )
        stack.extend((child, placement) for child in reversed(children.get(name, [])))
    missing = [name for name in description.links if name not in assembly.links]
    if missing:
        raise RobotDescriptionError(
            f"The links {_listed(missing)} are not connected to the root {root!r}: their joints "
            "form a closed loop. A URDF must be a tree; cut the loop at one joint."
        )
    if not assembly.joints:
        raise RobotDescriptionError(
            f"The robot {description.name!r} has no moving joint; all its joints are fixed."
        )
    for name, placement in assembly.links.items():
        if description.links[name].fault:
            _check_body(assembly, placement.body, description.links[name].fault)
    return assembly


def _check_body(assembly: Assembly, body: int, fault: str) -> None:
    """Refuse a faulty link if the moving body that it is part of has no positive inertia."""
    if body >= 0:
        if not is_positive(central_parts(assembly.parameters[body])[2]):
            raise RobotDescriptionError(fault)
    where = "a body that does not move" if body < 0 else "a body whose inertia is positive"
    warnings.warn(
        f"{fault} It is part of {where}, so it is used as given.",
        RobotDescriptionWarning,
        stacklevel=2,
    )


def _attach(
    assembly: Assembly,
    joint: Joint,
    carrier: LinkPlacement,
    following: dict[str, Mimic],
    moving: set[str],
) -> LinkPlacement:
    """Placement of the child of a joint: on a new moving body, or fixed to the carrier."""
    follow = following.get(joint.name)
    moves = follow is not None and follow.leader in moving and follow.multiplier != 0.0
    # A joint that does not move stays at zero, one that follows a joint at zero at its offset.
    rotation, translation = joint.placement(0.0 if moves or follow is None else follow.offset)
    rotation, translation = (
        carrier.rotation @ rotation,
        carrier.rotation @ translation + carrier.translation,
    )
    if follow is None or not moves:
        return LinkPlacement(carrier.body, rotation, translation)
    if follow.leader == joint.name:
        assembly.joints.append(joint)
    assembly.body_names.append(joint.child)
    assembly.parents.append(carrier.body)
    assembly.rotations.append(rotation)
    assembly.translations.append(translation)
    assembly.moved_by.append(joint)
    assembly.following.append(follow)
    assembly.parameters.append(np.zeros(10))
    return LinkPlacement(len(assembly.parents) - 1, np.eye(3), np.zeros(3))


def _root_of(description: Description) -> str:
    """Name of the only link without a parent."""
    links = description.links
    if not links:
        raise RobotDescriptionError("The URDF has no links.")
    parent_joint: dict[str, str] = {}
    for joint in description.joints.values():
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                raise RobotDescriptionError(
                    f"The {role} link {link!r} of joint {joint.name!r} is not described"
                    f"{suggest(link, links)}."
                )
        if joint.child in parent_joint:
            raise RobotDescriptionError(
                f"Link {joint.child!r} is the child of two joints, {parent_joint[joint.child]!r} "
                f"and {joint.name!r}; a URDF must be a tree."
            )
        parent_joint[joint.child] = joint.name
    roots = [name for name in links if name not in parent_joint]
    if not roots:
        raise RobotDescriptionError(
            "No link is without a parent: the joints form a closed loop. Cut it at one joint."
        )
    if len(roots) > 1:
        raise RobotDescriptionError(
            f"The URDF has {len(roots)} roots, {_listed(roots)}; connect them by fixed joints or "
            "remove the links that do not belong to the robot."
        )
    return roots[0]


def _resolve_mimics(description: Description) -> dict[str, Mimic]:
    """Independent joint that each movable joint follows (most follow themselves)."""
    resolved: dict[str, Mimic] = {}
    for joint in description.joints.values():
        if joint.kind == "fixed":
            continue
        multiplier, offset, leader, seen = 1.0, 0.0, joint, {joint.name}
        while leader.mimic is not None:
            follow = leader.mimic
            if follow.leader not in description.joints:
                raise RobotDescriptionError(
                    f"Joint {leader.name!r} mimics {follow.leader!r}, which is not described"
                    f"{suggest(follow.leader, description.joints)}."
                )
            if follow.leader in seen:
                raise RobotDescriptionError(
                    f"Joint {joint.name!r} mimics itself through {_listed(sorted(seen))}."
                )
            offset += multiplier * follow.offset
            multiplier *= follow.multiplier
            leader = description.joints[follow.leader]
            seen.add(leader.name)
        resolved[joint.name] = Mimic(leader.name, multiplier, offset)
    return resolved


def _moving_joints(
    description: Description, following: dict[str, Mimic], selected: Sequence[str] | None
) -> set[str]:
    """Names of the independent joints that move."""
    independent = [name for name, follow in following.items() if follow.leader == name]
    if selected is None:
        return set(independent)
    if isinstance(selected, str):
        raise RobotDescriptionError(
            f"joints must be a list of joint names, not the text {selected!r}."
        )
    if len(selected) == 0:
        raise RobotDescriptionError("joints is empty; name at least one joint.")
    for name in selected:
        if name not in description.joints:
            raise RobotDescriptionError(
                f"joints names {name!r}, which the URDF does not describe"
                f"{suggest(name, description.joints)}. It has: {_listed(independent)}."
            )
        if name not in independent:
            reason = "is fixed" if name not in following else f"mimics {following[name].leader!r}"
            raise RobotDescriptionError(
                f"joints names {name!r}, which {reason} and has no torque of its own."
            )
    if len(set(selected)) < len(selected):
        raise RobotDescriptionError(f"joints names a joint twice: {_listed(list(selected))}.")
    return set(selected)


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(repr(name) for name in names[:8])
    return shown if len(names) <= 8 else f"{shown} and {len(names) - 8} more"
