# SPDX-License-Identifier: BSD-3-Clause
"""The kinematic tree that the rigid-body recursions run on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

#: Positions of (Ixx, Ixy, Ixz, Iyy, Iyz, Izz) in the inertia matrix, the order of skidyn.
INERTIA_INDICES = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True)
class KinematicTree:
    """Moving bodies, each attached to its parent by one joint; parents come first.

    Attributes
    ----------
    parents : ndarray of shape (n_bodies,), int
        Parent body; -1 is the fixed base.
    rotations : ndarray of shape (n_bodies, 3, 3)
        Orientation of the body frame in the parent frame at joint coordinate zero.
    translations : ndarray of shape (n_bodies, 3)
        Origin of the body frame in the parent frame at joint coordinate zero, m.
    axes : ndarray of shape (n_bodies, 3)
        Unit joint axis in the body frame, through its origin.
    prismatic : ndarray of shape (n_bodies,), bool
        Whether the joint slides along its axis rather than turning about it.
    coordinates : ndarray of shape (n_bodies,), int
        Joint coordinate that moves the body; several bodies share one where joints mimic.
    multipliers, offsets : ndarray of shape (n_bodies,)
        The body moves by ``multiplier * q[coordinate] + offset`` (rad or m).
    """

    parents: np.ndarray
    rotations: np.ndarray
    translations: np.ndarray
    axes: np.ndarray
    prismatic: np.ndarray
    coordinates: np.ndarray
    multipliers: np.ndarray
    offsets: np.ndarray

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.flags.writeable = False

    @property
    def n_bodies(self) -> int:
        """Number of moving bodies."""
        return len(self.parents)

    @property
    def n_joints(self) -> int:
        """Number of joint coordinates."""
        return int(self.coordinates.max(initial=-1)) + 1

    def path(self, body: int) -> list[int]:
        """Bodies from the base to a body, the body itself last."""
        path = []
        while body >= 0:
            path.append(body)
            body = int(self.parents[body])
        return path[::-1]


def skew(vector: np.ndarray) -> np.ndarray:
    """Matrix of the cross product with a vector, shape (3, 3)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def inertial_vector(mass: float, moment: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Parameter vector of (mass, first moment, inertia matrix about the origin), shape (10,)."""
    return np.array([mass, *moment, *(inertia[i, j] for i, j in INERTIA_INDICES)])


def inertial_parts(parameters: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, first moment (3,) and inertia matrix (3, 3) about the origin of a parameter vector."""
    inertia = np.empty((3, 3))
    for value, (i, j) in zip(parameters[4:], INERTIA_INDICES, strict=True):
        inertia[i, j] = inertia[j, i] = value
    return float(parameters[0]), np.asarray(parameters[1:4], dtype=float), inertia


def central_parts(parameters: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, center of mass (3,) and inertia matrix (3, 3) about it; at the origin without mass."""
    mass, moment, inertia = inertial_parts(parameters)
    center = moment / mass if mass > 0 else np.zeros(3)
    arm = skew(center)
    return mass, center, inertia + mass * arm @ arm


def transform_inertial(
    parameters: np.ndarray, rotation: np.ndarray, translation: np.ndarray
) -> np.ndarray:
    """The ten parameters of a body about the origin of another frame, linear in the given ones.

    ``rotation`` and ``translation`` (m) are the body frame's orientation and origin in the new
    frame.
    """
    mass, moment, inertia = inertial_parts(parameters)
    moment = rotation @ moment
    shift, arm = skew(translation), skew(moment)
    inertia = rotation @ inertia @ rotation.T - shift @ arm - arm @ shift
    return inertial_vector(mass, moment + mass * translation, inertia - mass * shift @ shift)
