# SPDX-License-Identifier: BSD-3-Clause
"""Links and joints of a URDF.

It is read directly from the XML: the parser of pytorch-kinematics imports torch and matplotlib,
uses z for a missing axis (the standard has x), and its chains contain no inertials.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable

import numpy as np

from skidyn._exceptions import RobotDescriptionError
from skidyn.robots._description import (
    MOVING_TYPES,
    Description,
    Joint,
    Link,
    Mimic,
    check_limits,
    link_of,
    rotation_from_rpy,
    symmetric,
    unit_axis,
)
from skidyn.robots._xml import numbers, only, required, word


def parse_urdf(root: ElementTree.Element) -> Description:
    """Description of the robot in a ``<robot>`` element; RobotDescriptionError for a wrong one."""
    links, joints = root.findall("link"), root.findall("joint")  # not those of transmissions
    refuse_repeated_names(links)
    refuse_repeated_names(joints)
    return Description(
        root.get("name") or "robot",
        {link.name: link for link in map(_link, links)},
        {joint.name: joint for joint in map(_joint, joints)},
    )


def _pose(element: ElementTree.Element, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation matrix and translation of the <origin> of an element; identity by default."""
    origin = only(element, "origin", what)
    if origin is None:
        return np.eye(3), np.zeros(3)
    of = f"the origin of {what}"
    zero = (0.0, 0.0, 0.0)
    return rotation_from_rpy(numbers(origin, "rpy", 3, of, zero)), numbers(
        origin, "xyz", 3, of, zero
    )


def _link(element: ElementTree.Element) -> Link:
    name = element.get("name", "")
    what = f"link {name!r}"
    inertial = only(element, "inertial", what)
    if inertial is None:
        return Link(name, np.zeros(10))
    mass = float(numbers(required(inertial, "mass", what), "value", 1, f"the mass of {what}")[0])
    matrix = np.zeros((3, 3))
    inertia = only(inertial, "inertia", what)
    if inertia is not None:
        of = f"the inertia of {what}"
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        matrix = symmetric(*(float(numbers(inertia, key, 1, of)[0]) for key in keys))
    return link_of(name, mass, matrix, *_pose(inertial, what))


def _joint(element: ElementTree.Element) -> Joint:
    name = element.get("name", "")
    what = f"joint {name!r}"
    kind = word(element, "type", what)
    if kind not in (*MOVING_TYPES, "fixed"):
        raise RobotDescriptionError(
            f"The {what} is of type {kind!r}; supported are {', '.join(MOVING_TYPES)} and fixed. "
            'Set type="fixed" if its child does not move in the recordings; a base that floats or '
            "drives has no model here, so that recordings with its base at rest are needed."
        )
    rotation, translation = _pose(element, what)
    fixed = kind == "fixed"
    lower, upper, velocity, effort = (0.0,) * 4 if fixed else _limits(element, kind, what)
    dynamics = only(element, "dynamics", what)
    damping, friction = (
        0.0 if dynamics is None else _scalar(dynamics, key, f"the dynamics of {what}", 0.0)
        for key in ("damping", "friction")
    )
    return Joint(
        name=name,
        kind=kind,
        parent=word(required(element, "parent", what), "link", what),
        child=word(required(element, "child", what), "link", what),
        rotation=rotation,
        translation=translation,
        axis=np.array([1.0, 0.0, 0.0]) if fixed else _axis(element, what),
        position_limits=(lower, upper),
        velocity_limit=velocity,
        effort_limit=effort,
        damping=damping,
        friction=friction,
        mimic=None if fixed else _mimic(element, what),
    )


def _scalar(
    element: ElementTree.Element, key: str, what: str, default: float | None = None
) -> float:
    return float(numbers(element, key, 1, what, None if default is None else (default,))[0])


def _axis(element: ElementTree.Element, what: str) -> np.ndarray:
    """Unit axis; x by default, as in the URDF standard."""
    axis = only(element, "axis", what)
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    return unit_axis(numbers(axis, "xyz", 3, f"the axis of {what}", (1.0, 0.0, 0.0)), what)


def _limits(
    element: ElementTree.Element, kind: str, what: str
) -> tuple[float, float, float, float]:
    """Lower and upper position, velocity and effort limit; infinite by default."""
    limit = only(element, "limit", what)
    if limit is None:
        if kind != "continuous":
            raise RobotDescriptionError(
                f"The {what} has no <limit>, which {kind} joints must have. "
                'Add for example <limit lower="-3.14" upper="3.14" velocity="2" effort="100"/>.'
            )
        return -np.inf, np.inf, np.inf, np.inf
    of = f"the <limit> of {what}"
    velocity, effort = _scalar(limit, "velocity", of), _scalar(limit, "effort", of)
    if kind == "continuous":
        return -np.inf, np.inf, velocity, effort
    lower, upper = _scalar(limit, "lower", of, 0.0), _scalar(limit, "upper", of, 0.0)
    return *check_limits(lower, upper, what), velocity, effort


def _mimic(element: ElementTree.Element, what: str) -> Mimic | None:
    mimic = only(element, "mimic", what)
    if mimic is None:
        return None
    of = f"the <mimic> of {what}"
    return Mimic(
        word(mimic, "joint", of),
        _scalar(mimic, "multiplier", of, 1.0),
        _scalar(mimic, "offset", of, 0.0),
    )


def refuse_repeated_names(elements: Iterable[ElementTree.Element]) -> None:
    """Raise a RobotDescriptionError for an element without a name or a name that occurs twice."""
    seen: set[str] = set()
    for element in elements:
        name, tag = element.get("name"), element.tag
        if not name:
            raise RobotDescriptionError(f"A <{tag}> has no name; give every {tag} one.")
        if name in seen:
            raise RobotDescriptionError(f"The {tag} {name!r} is described twice; rename one.")
        seen.add(name)
