# SPDX-License-Identifier: BSD-3-Clause
"""Links and joints of a URDF, checked and in exact float64.

The text is parsed by the URDF object model of pytorch-kinematics. Its kinematic chains are not
used: they hold offsets that went through float32 and drop the inertials.
"""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._exceptions import RobotDescriptionError, RobotDescriptionWarning
from skidyn.rigid_body._tree import inertial_vector, transform_inertial

MOVING_TYPES = ("revolute", "continuous", "prismatic")

#: Relative size below which a negative principal moment counts as rounding of a printed number.
_MOMENT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Link:
    """A link with its inertial parameters about its own frame, shape (10,)."""

    name: str
    parameters: np.ndarray


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another one: ``multiplier * q_leader + offset``."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """A joint between two links; lengths in m, angles in rad."""

    name: str
    kind: str
    parent: str
    child: str
    rotation: np.ndarray
    translation: np.ndarray
    axis: np.ndarray
    position_limits: tuple[float, float]
    velocity_limit: float
    effort_limit: float
    damping: float
    friction: float
    mimic: Mimic | None

    def placement(self, displacement: float) -> tuple[np.ndarray, np.ndarray]:
        """Orientation and origin of the child frame in the parent frame at a displacement."""
        if self.kind == "prismatic":
            return self.rotation, self.translation + displacement * self.rotation @ self.axis
        if self.kind == "fixed" or displacement == 0.0:
            return self.rotation, self.translation
        return self.rotation @ _rotation_about(self.axis, displacement), self.translation


@dataclass(frozen=True)
class Description:
    """A robot as its URDF describes it, in the order of the file."""

    name: str
    links: dict[str, Link]
    joints: dict[str, Joint]


def parse_urdf(root: ElementTree.Element) -> Description:
    """Description of the robot in a cleaned ``<robot>`` element.

    Raises
    ------
    RobotDescriptionError
        A link or joint is not described correctly; the message names it.
    """
    # pytorch_kinematics imports matplotlib and torch: only those who read a URDF pay for it.
    from pytorch_kinematics.urdf_parser_py.urdf import URDF

    _refuse_repeated_names(root)
    try:
        model = URDF.from_xml_string(ElementTree.tostring(root))
    except Exception as error:  # the parser raises bare Exception, AssertionError, ParseError
        raise RobotDescriptionError(
            f"The URDF cannot be read{_culprit(root, URDF)}: {_one_line(error)}."
        ) from error
    links = {link.name: _link(link) for link in model.links}
    joints = {joint.name: _joint(joint) for joint in model.joints}
    return Description(model.name or "robot", links, joints)


def _culprit(root: ElementTree.Element, parser: Any) -> str:
    """Name of the first element that the parser refuses; its messages do not always tell."""
    for element in root:
        alone = ElementTree.Element("robot")
        alone.append(element)
        try:
            parser.from_xml_string(ElementTree.tostring(alone))
        except Exception:
            return f" at {element.tag} {element.get('name')!r}"
    return ""


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()).rstrip(".") or type(error).__name__


def _refuse_repeated_names(root: ElementTree.Element) -> None:
    for tag in ("link", "joint"):
        seen: set[str] = set()
        for element in root.iter(tag):
            name = element.get("name")
            if not name:
                raise RobotDescriptionError(f"A <{tag}> has no name; give every {tag} one.")
            if name in seen:
                raise RobotDescriptionError(f"The {tag} {name!r} is described twice; rename one.")
            seen.add(name)


def _numbers(values: Any, what: str) -> np.ndarray:
    array = np.array(values, dtype=np.float64)
    if not np.all(np.isfinite(array)):
        raise RobotDescriptionError(f"{what} is {values}; expected finite numbers.")
    return array


def _pose(origin: Any, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Rotation matrix and translation of an <origin>, identity where there is none."""
    if origin is None:
        return np.eye(3), np.zeros(3)
    xyz = _numbers(origin.xyz if origin.xyz is not None else (0, 0, 0), f"The origin of {what}")
    rpy = _numbers(origin.rpy if origin.rpy is not None else (0, 0, 0), f"The origin of {what}")
    return rotation_from_rpy(rpy), xyz


def rotation_from_rpy(rpy: np.ndarray) -> np.ndarray:
    """Rotation matrix of fixed-axis roll, pitch, yaw (rad), ``Rz(yaw) Ry(pitch) Rx(roll)``.

    Entries below 1e-15 are rounding of the double nearest to pi/2 and become exact zeros; an angle
    written with fewer digits, such as 1.5708, is taken as written.
    """
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    matrix = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    return _without_dust(matrix)


def _without_dust(matrix: np.ndarray) -> np.ndarray:
    for exact in (0.0, 1.0, -1.0):
        matrix[np.abs(matrix - exact) < 1e-15] = exact
    return matrix


def _rotation_about(axis: np.ndarray, angle: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return _without_dust(matrix)


def _link(link: Any) -> Link:
    inertial = link.inertial
    if inertial is None:
        return Link(link.name, np.zeros(10))
    what = f"link {link.name!r}"
    mass = float(_numbers(inertial.mass, f"The mass of {what}"))
    if mass < 0:
        raise RobotDescriptionError(f"The mass of {what} is {mass:g} kg; it must not be negative.")
    rotation, center = _pose(inertial.origin, what)
    matrix = np.zeros((3, 3))
    if inertial.inertia is not None:
        matrix = _numbers(inertial.inertia.to_matrix(), f"The inertia of {what}")
    _check_inertia(matrix, what)
    central = inertial_vector(mass, np.zeros(3), matrix)
    return Link(link.name, transform_inertial(central, rotation, center))


def _check_inertia(matrix: np.ndarray, what: str) -> None:
    moments = np.linalg.eigvalsh(matrix)
    tolerance = _MOMENT_TOLERANCE * abs(moments[-1])
    listed = ", ".join(f"{m:g}" for m in moments)
    if moments[0] < -tolerance:
        raise RobotDescriptionError(
            f"The inertia of {what} is not positive definite: its principal moments are {listed} "
            "kg m^2. Check the signs and the units of ixx .. izz; they are taken about the center "
            "of mass."
        )
    if moments[0] + moments[1] < moments[2] - tolerance:
        warnings.warn(
            f"The principal moments {listed} kg m^2 of {what} break the triangle inequality: no "
            "distribution of positive mass has them. They are used as given.",
            RobotDescriptionWarning,
            stacklevel=2,
        )


def _joint(joint: Any) -> Joint:
    what = f"joint {joint.name!r}"
    if joint.type not in (*MOVING_TYPES, "fixed"):
        raise RobotDescriptionError(
            f"The {what} is of type {joint.type!r}; supported are "
            f"{', '.join(MOVING_TYPES)} and fixed."
        )
    rotation, translation = _pose(joint.origin, what)
    fixed = joint.type == "fixed"
    lower, upper, velocity, effort = (0.0, 0.0, 0.0, 0.0) if fixed else _limits(joint, what)
    dynamics = joint.dynamics
    damping, friction = (
        _numbers(value if value is not None else 0.0, f"The dynamics of {what}")
        for value in ((dynamics.damping, dynamics.friction) if dynamics else (None, None))
    )
    return Joint(
        name=joint.name,
        kind=joint.type,
        parent=joint.parent,
        child=joint.child,
        rotation=rotation,
        translation=translation,
        axis=np.array([1.0, 0.0, 0.0]) if fixed else _axis(joint, what),
        position_limits=(lower, upper),
        velocity_limit=velocity,
        effort_limit=effort,
        damping=float(damping),
        friction=float(friction),
        mimic=None if fixed else _mimic(joint, what),
    )


def _axis(joint: Any, what: str) -> np.ndarray:
    """Unit axis; the URDF standard says x where none is given."""
    axis = _numbers(joint.axis if joint.axis is not None else (1, 0, 0), f"The axis of {what}")
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise RobotDescriptionError(f"The axis of {what} is zero; give it a direction.")
    return axis / length


def _limits(joint: Any, what: str) -> tuple[float, float, float, float]:
    """Lower and upper position, velocity and effort limit; infinite where there is none."""
    limit = joint.limit
    if limit is None:
        if joint.type != "continuous":
            raise RobotDescriptionError(
                f"The {what} has no <limit>, which {joint.type} joints must have. "
                'Add for example <limit lower="-3.14" upper="3.14" velocity="2" effort="100"/>.'
            )
        return -np.inf, np.inf, np.inf, np.inf
    velocity, effort = (
        float(_numbers(value, f"The <limit> of {what}")) for value in (limit.velocity, limit.effort)
    )
    if joint.type == "continuous":
        return -np.inf, np.inf, velocity, effort
    lower, upper = _numbers((limit.lower, limit.upper), f"The <limit> of {what}")
    if lower > upper:
        raise RobotDescriptionError(
            f"The {what} has its lower limit {lower:g} above its upper limit {upper:g}."
        )
    return float(lower), float(upper), velocity, effort


def _mimic(joint: Any, what: str) -> Mimic | None:
    mimic = joint.mimic
    if mimic is None:
        return None
    multiplier, offset = (
        float(_numbers(default if value is None else value, f"The <mimic> of {what}"))
        for value, default in ((mimic.multiplier, 1.0), (mimic.offset, 0.0))
    )
    return Mimic(mimic.joint, multiplier, offset)
