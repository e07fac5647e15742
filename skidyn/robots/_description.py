# SPDX-License-Identifier: BSD-3-Clause
"""Content of a robot description in any format: links and joints in exact float64."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace

import numpy as np

from skidyn._exceptions import RobotDescriptionError, RobotDescriptionWarning
from skidyn.dynamics import inertial_vector, skew, transform_inertial

MOVING_TYPES = ("revolute", "continuous", "prismatic")

#: Relative size below which a negative principal moment counts as rounding of a printed number.
_MOMENT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Link:
    """A link with its inertial parameters about its own frame, shape (10,).

    ``fault`` describes an error of its inertia; it matters only for the moving body of the link.
    """

    name: str
    parameters: np.ndarray
    fault: str = ""


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another one: ``multiplier * q_leader + offset``."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """A joint between two links, by default fixed; lengths in m, angles in rad."""

    name: str
    kind: str = "fixed"
    parent: str = ""
    child: str = ""
    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    translation: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axis: np.ndarray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    position_limits: tuple[float, float] = (0.0, 0.0)
    velocity_limit: float = 0.0
    effort_limit: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    mimic: Mimic | None = None

    def placement(self, displacement: float) -> tuple[np.ndarray, np.ndarray]:
        """Orientation and origin of the child frame in the parent frame at a displacement."""
        if self.kind == "prismatic":
            return self.rotation, self.translation + displacement * self.rotation @ self.axis
        if self.kind == "fixed" or displacement == 0.0:
            return self.rotation, self.translation
        return self.rotation @ rotation_about(self.axis, displacement), self.translation


@dataclass(frozen=True)
class Description:
    """A robot description in the order of its file."""

    name: str
    links: dict[str, Link]
    joints: dict[str, Joint]


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


def rotation_about(axis: np.ndarray, angle: float) -> np.ndarray:
    cross = skew(axis)
    matrix = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return _without_dust(matrix)


def between(joint: Joint, parent: str, child: str, pose: tuple[np.ndarray, np.ndarray]) -> Joint:
    """The joint between two links, in a frame that has the pose in that of the parent."""
    rotation, translation = pose
    return replace(
        joint,
        parent=parent,
        child=child,
        rotation=rotation @ joint.rotation,
        translation=rotation @ joint.translation + translation,
    )


def fixed_joint(name: str, parent: str, child: str, pose: tuple[np.ndarray, np.ndarray]) -> Joint:
    """A joint that holds a link at a pose in the frame of another one."""
    return Joint(name, "fixed", parent, child, *pose)


def link_of(
    name: str, mass: float, inertia: np.ndarray, rotation: np.ndarray, center: np.ndarray
) -> Link:
    """Link of a mass and of an inertia about the center of mass, in the frame of the rotation.

    A RobotDescriptionError is raised if the mass is negative, or mass or inertia is not a number.
    """
    what = f"link {name!r}"
    if mass < 0:
        raise RobotDescriptionError(f"The mass of {what} is {mass:g} kg; it must not be negative.")
    with np.errstate(over="ignore", invalid="ignore"):
        central = inertial_vector(mass, np.zeros(3), inertia)
        parameters = transform_inertial(central, rotation, center)
    if not np.isfinite(parameters).all():
        raise RobotDescriptionError(
            f"The mass or inertia of {what} is too large; check its size and units."
        )
    return Link(name, parameters, _fault(inertia, what))


def is_positive(inertia: np.ndarray) -> bool:
    """Whether no principal moment is negative beyond rounding."""
    moments = np.linalg.eigvalsh(inertia)
    return bool(moments[0] >= -_MOMENT_TOLERANCE * abs(moments[-1]))


def symmetric(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> np.ndarray:
    """Inertia matrix of its six entries, kg m^2."""
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def unit_axis(axis: np.ndarray, what: str) -> np.ndarray:
    """The axis with length one; a RobotDescriptionError if it is zero."""
    largest = float(np.abs(axis).max())
    # scaled to entries up to one: the squares of 1e200 and of 1e-200 overflow or vanish
    axis = axis / largest if largest > 0 else axis
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise RobotDescriptionError(f"The axis of {what} is zero; give it a direction.")
    return axis / length


def check_limits(lower: float, upper: float, what: str) -> tuple[float, float]:
    """Lower and upper position limit; a RobotDescriptionError if they are in the wrong order."""
    if lower > upper:
        raise RobotDescriptionError(
            f"The {what} has its lower limit {lower:g} above its upper limit {upper:g}."
        )
    return lower, upper


def _fault(matrix: np.ndarray, what: str) -> str:
    """Reason why an inertia is impossible, or ``""``; warns if no mass distribution has it."""
    moments = np.linalg.eigvalsh(matrix)
    listed = ", ".join(f"{m:g}" for m in moments)
    if not is_positive(matrix):
        return (
            f"The inertia of {what} is not positive definite: its principal moments are {listed} "
            "kg m^2. Check the signs and the units of ixx .. izz; they are taken about the center "
            "of mass."
        )
    if moments[0] + moments[1] < moments[2] - _MOMENT_TOLERANCE * abs(moments[-1]):
        warnings.warn(
            f"The principal moments {listed} kg m^2 of {what} violate the triangle inequality: no "
            "distribution of positive mass has them. They are used as given.",
            RobotDescriptionWarning,
            stacklevel=3,
        )
    return ""
