# SPDX-License-Identifier: BSD-3-Clause
"""Links and joints of an SDF model.

Standard: http://sdformat.org/spec; semantics of poses: the SDFormat specification, "Pose Frame
Semantics".
"""

from __future__ import annotations

import re
import warnings
import xml.etree.ElementTree as ElementTree

import numpy as np

from skidyn._exceptions import RobotDescriptionError, RobotDescriptionWarning
from skidyn.robots._description import (
    Description,
    Joint,
    Link,
    Mimic,
    between,
    check_limits,
    fixed_joint,
    link_of,
    rotation_from_rpy,
    symmetric,
    unit_axis,
)
from skidyn.robots._urdf import refuse_repeated_names
from skidyn.robots._xml import numbers_of, only, parse_xml, required, word

Pose = tuple[np.ndarray, np.ndarray]

#: Limits of this size or larger mean no limit in the standard.
_UNLIMITED = 1e16
_IDENTITY: Pose = (np.eye(3), np.zeros(3))
_WORLD = "world"


def parse_sdf(data: bytes, model: str | None) -> Description:
    """Description of the only model in an SDF; a RobotDescriptionError states what is wrong."""
    root = parse_xml(data)
    if root.tag != "sdf":
        raise RobotDescriptionError(f"The root element is <{root.tag}>; expected <sdf>.")
    element = _find_model(root, model)
    for nested in ("model", "include"):
        if element.find(nested) is not None:
            raise RobotDescriptionError(
                f"The model {element.get('name')!r} holds another one (<{nested}>); expand it "
                "first, for example with: gz sdf -p model.sdf."
            )
    refuse_repeated_names(element.iter("link"))
    refuse_repeated_names(element.findall("joint"))
    stated = root.get("version", "1.9")
    if not re.fullmatch(r"\d{1,3}(\.\d{1,3})*", stated, flags=re.ASCII):
        raise RobotDescriptionError(
            f"The version of the SDF is {stated[:20]!r}; expected one as 1.9."
        )
    version = tuple(int(part) for part in stated.split(".")[:2])
    return _Reader(element, version).read()


def _find_model(root: ElementTree.Element, name: str | None) -> ElementTree.Element:
    models = [*root.findall("model"), *root.findall("world/model")]
    names = [element.get("name") for element in models]
    if name is not None:
        if name not in names:
            raise RobotDescriptionError(f"The SDF has no model {name!r}; it has {names}.")
        return models[names.index(name)]
    moving = [m for m in models if m.find("joint") is not None]
    if len(moving) != 1:
        raise RobotDescriptionError(
            f"The SDF has {len(moving)} models with joints, of {names}; choose one by model=."
        )
    return moving[0]


class _Reader:
    """Poses of all frames of one model, for reading its links and joints."""

    def __init__(self, model: ElementTree.Element, version: tuple[int, ...]) -> None:
        self.model = model
        self.version = version
        self._elements = {
            element.get("name", ""): element
            for tag in ("link", "joint", "frame")
            for element in model.findall(tag)
        }
        self._poses: dict[str, Pose] = {"__model__": _IDENTITY, "": _IDENTITY, _WORLD: _IDENTITY}

    def read(self) -> Description:
        """The description, with an additional link for the frame of the model."""
        links = {_WORLD: Link(_WORLD, np.zeros(10))}
        links |= {e.get("name", ""): self._link(e) for e in self.model.findall("link")}
        joints: dict[str, Joint] = {}
        for element in self.model.findall("joint"):
            self._add_joint(element, links, joints)
        carried = {joint.child for joint in joints.values()}
        roots = [name for name in links if name not in carried and name != _WORLD]
        for name in roots[:1]:  # several roots are refused during assembly
            joints[f"{name}_base"] = fixed_joint(f"{name}_base", _WORLD, name, self.pose(name))
        return Description(self.model.get("name") or "robot", links, joints)

    def pose(self, name: str) -> Pose:
        """Pose of a link, joint or frame in the frame of the model."""
        way: dict[str, str] = {}  # frame, and the frame to which it is relative
        at = name
        while at not in self._poses:
            if at in way:
                raise RobotDescriptionError(f"The pose of {at!r} is relative to itself.")
            way[at] = self._base(at)
            at = way[at]
        for frame, base in reversed(way.items()):
            element = self._elements[frame]
            turn, shift = _own_pose(element, f"{element.tag} {frame!r}")
            rotation, translation = self._poses[base]
            self._poses[frame] = rotation @ turn, rotation @ shift + translation
        return self._poses[name]

    def _base(self, name: str) -> str:
        """Frame to which the pose of a frame is relative."""
        if name not in self._elements:
            raise RobotDescriptionError(
                f"A pose is relative to {name!r}, which the model does not describe."
            )
        element = self._elements[name]
        what = f"{element.tag} {name!r}"
        default = ""
        if element.tag == "joint":
            default = _text(element, "child", what)
        elif element.tag == "frame":
            default = element.get("attached_to") or ""
        relative = only(element, "pose", what)
        return (relative.get("relative_to") if relative is not None else None) or default

    def _link(self, element: ElementTree.Element) -> Link:
        name = element.get("name", "")
        what = f"link {name!r}"
        inertial = only(element, "inertial", what)
        if inertial is None:
            warnings.warn(
                f"The {what} has no <inertial>: it is assigned 1 kg and 1 kg m^2, as specified by "
                "the standard.",
                RobotDescriptionWarning,
                stacklevel=2,
            )
            inertial = ElementTree.Element("inertial")
        inertia = only(inertial, "inertia", what)
        keys = {"ixx": 1.0, "ixy": 0.0, "ixz": 0.0, "iyy": 1.0, "iyz": 0.0, "izz": 1.0}
        entries = [
            default if inertia is None else _number(inertia, key, f"the inertia of {what}", default)
            for key, default in keys.items()
        ]
        rotation, center = _own_pose(inertial, what)
        mass = _number(inertial, "mass", what, 1.0)
        return link_of(name, mass, symmetric(*entries), rotation, center)

    def _add_joint(
        self, element: ElementTree.Element, links: dict[str, Link], joints: dict[str, Joint]
    ) -> None:
        """A joint, and a link without mass if the joint is not at its child's frame."""
        name = element.get("name", "")
        what = f"joint {name!r}"
        parent, child = (self._link_of(_text(element, end, what)) for end in ("parent", "child"))
        before = _relative(self.pose(parent), self.pose(name))
        after = _relative(self.pose(name), self.pose(child))
        joint = self._joint(element, what)
        if np.array_equal(after[0], np.eye(3)) and not np.any(after[1]):
            joints[name] = between(joint, parent, child, before)
            return
        middle = f"{name}_frame"
        links[middle] = Link(middle, np.zeros(10))
        joints[name] = between(joint, parent, middle, before)
        joints[f"{middle}_fixed"] = fixed_joint(f"{middle}_fixed", middle, child, after)

    def _link_of(self, name: str) -> str:
        """The link of a name; for a frame, the link to which it is attached."""
        element = self._elements.get(name)
        if element is None or element.tag == "link":
            return name
        if element.tag == "joint":
            return _text(element, "child", f"joint {name!r}")
        raise RobotDescriptionError(
            f"A joint is attached to the frame {name!r}; name the link that carries it."
        )

    def _joint(self, element: ElementTree.Element, what: str) -> Joint:
        """The joint in its own frame."""
        kind = word(element, "type", what)
        name = element.get("name", "")
        if kind == "fixed":
            return Joint(name)
        if kind not in ("revolute", "continuous", "prismatic"):
            raise RobotDescriptionError(
                f"The {what} is of type {kind!r}; supported are revolute, continuous, prismatic "
                'and fixed. Set type="fixed" if its child does not move in the recordings.'
            )
        axis = required(element, "axis", what)
        limit, dynamics = only(axis, "limit", what), only(axis, "dynamics", what)
        limits = {"lower": -np.inf, "upper": np.inf, "effort": np.inf, "velocity": np.inf}
        if limit is not None:
            for key in limits:
                limits[key] = _limit(limit, key, what, limits[key])
        lower, upper = check_limits(limits["lower"], limits["upper"], what)
        if kind != "prismatic":
            kind = "revolute" if np.isfinite(lower) or np.isfinite(upper) else "continuous"
        if kind == "continuous":
            lower, upper = -np.inf, np.inf
        return Joint(
            name=name,
            kind=kind,
            axis=unit_axis(self._axis(element, axis, what), what),
            position_limits=(lower, upper),
            velocity_limit=limits["velocity"],
            effort_limit=limits["effort"],
            damping=0.0 if dynamics is None else _number(dynamics, "damping", what, 0.0),
            friction=0.0 if dynamics is None else _number(dynamics, "friction", what, 0.0),
            mimic=_mimic(axis, what),
        )

    def _axis(
        self, element: ElementTree.Element, axis: ElementTree.Element, what: str
    ) -> np.ndarray:
        """Direction of the axis in the frame of the joint."""
        direction = axis.find("xyz")
        values = np.array([0.0, 0.0, 1.0])
        if direction is not None:
            values = numbers_of(direction.text or "", 3, f"the axis of {what}")
        frame = direction.get("expressed_in") if direction is not None else None
        # Before 1.5 the axis was given in the frame of the model; from 1.5 to 1.7 optionally.
        flag = (axis.findtext("use_parent_model_frame") or "").strip()
        if frame is None and (self.version < (1, 5) or flag in ("1", "true")):
            frame = "__model__"
        if not frame:
            return values
        own, given = self.pose(element.get("name", ""))[0], self.pose(frame)[0]
        direction_here: np.ndarray = own.T @ given @ values
        return direction_here


def _mimic(axis: ElementTree.Element, what: str) -> Mimic | None:
    mimic = only(axis, "mimic", what)
    if mimic is None:
        return None
    factor, offset = _number(mimic, "multiplier", what, 1.0), _number(mimic, "offset", what, 0.0)
    reference = _number(mimic, "reference", what, 0.0)
    return Mimic(word(mimic, "joint", what), factor, offset - factor * reference)


def _relative(base: Pose, pose: Pose) -> Pose:
    """A pose in the frame of another one; exact where both are the same."""
    if base is pose or (np.array_equal(base[0], pose[0]) and np.array_equal(base[1], pose[1])):
        return _IDENTITY
    return base[0].T @ pose[0], base[0].T @ (pose[1] - base[1])


def _own_pose(element: ElementTree.Element, what: str) -> Pose:
    """Rotation and translation of the <pose> of an element."""
    pose = only(element, "pose", what)
    if pose is None or not (pose.text or "").strip():
        return _IDENTITY
    if pose.get("rotation_format", "euler_rpy") != "euler_rpy":
        values = numbers_of(pose.text or "", 7, f"the pose of {what}")
        return _rotation_of_quaternion(values[3:], what), values[:3]
    values = numbers_of(pose.text or "", 6, f"the pose of {what}")
    angles = np.deg2rad(values[3:]) if pose.get("degrees") in ("1", "true") else values[3:]
    return rotation_from_rpy(angles), values[:3]


def _rotation_of_quaternion(quaternion: np.ndarray, what: str) -> np.ndarray:
    length = float(np.linalg.norm(quaternion))
    if length < 1e-9:
        raise RobotDescriptionError(f"The quaternion of {what} is zero.")
    x, y, z, w = quaternion / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _text(element: ElementTree.Element, tag: str, what: str) -> str:
    text = (required(element, tag, what).text or "").strip()
    if not text:
        raise RobotDescriptionError(f"The <{tag}> of {what} is empty.")
    return text


def _number(element: ElementTree.Element, tag: str, what: str, default: float) -> float:
    child = only(element, tag, what)
    return (
        default if child is None else float(numbers_of(child.text or "", 1, f"{what} ({tag})")[0])
    )


def _limit(element: ElementTree.Element, tag: str, what: str, default: float) -> float:
    """A limit; negative efforts and velocities, and huge numbers, mean none."""
    text = (element.findtext(tag) or "").strip()
    if not text or text.lstrip("+-").startswith("inf"):
        return default
    value = float(numbers_of(text, 1, f"the <limit> of {what} ({tag})")[0])
    none = abs(value) >= _UNLIMITED or (tag in ("effort", "velocity") and value < 0)
    return default if none else value
