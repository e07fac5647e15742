# SPDX-License-Identifier: BSD-3-Clause
"""Frames and inertial parameters in which the inverse dynamics takes the fewest operations.

Torques do not depend on the choice of a body's frame. Here every revolute joint turns about the z
axis of its body, the next joint axis is reached by one turn about x (the convention of modified
Denavit-Hartenberg parameters, [1]_) and origins lie where the offset to the next body has the
fewest components. Nothing is rounded: a joint axis that is off by 1e-11 rad stays off by 1e-11 rad.

Some mass distributions may be on either side of a joint without a change of any torque: those that
are the same at every joint position and resist no motion of the joint. For a revolute joint these
are a mass on its axis and the inertia ``Ixx = Iyy`` of a thin rod on it; for a prismatic joint
every inertia matrix. They are moved to the parent [2]_, which leaves seven parameters per revolute
and four per prismatic joint.

References
----------
.. [1] W. Khalil, J. Kleinfinger, "A new geometric notation for open and closed-loop robots",
       IEEE International Conference on Robotics and Automation, 1986.
.. [2] M. Gautier, W. Khalil, "Direct calculation of minimum set of inertial parameters of serial
       robots", IEEE Transactions on Robotics and Automation 6(3), 1990.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn.dynamics._tree import KinematicTree, transform_inertial

#: Rounding of products of rotation matrices and of positions in m.
_DUST = 4e-16


@dataclass(frozen=True)
class CanonicalModel:
    """A tree in other frames, with the map of its inertial parameters.

    ``base`` is the orientation of the new base frame in the old one. ``kept`` and ``moved``, of
    shape (n_bodies, 10, 10), map a body's parameters to those that remain with it, in its new
    frame, and to those that are moved to its parent.
    """

    tree: KinematicTree
    base: np.ndarray
    kept: np.ndarray
    moved: np.ndarray
    reframed: np.ndarray

    def gravity(self, gravity: Any) -> tuple[float, ...]:
        """Gravity in the new base frame."""
        turned = self.base.T @ np.asarray(gravity, dtype=float)
        turned[np.abs(turned) < _DUST * np.linalg.norm(gravity)] = 0.0
        return tuple(turned.tolist())

    def parameters(self, parameters: Any) -> list[Any]:
        """Parameters of every body in the new frames; arrays or tensors of shape (n_bodies, 10)."""
        own = [self.reframed[body] @ row for body, row in enumerate(parameters)]
        for body in range(self.tree.n_bodies - 1, -1, -1):
            parent = int(self.tree.parents[body])
            if parent >= 0:
                own[parent] = own[parent] + self.moved[body] @ own[body]
            own[body] = self.kept[body] @ own[body]
        return own


def canonicalize(tree: KinematicTree) -> CanonicalModel:
    """Choose frames for a tree and derive the map of its parameters."""
    n = tree.n_bodies
    frames = _Frames(tree)
    rotations, translations = np.empty((n, 3, 3)), np.empty((n, 3))
    axes, offsets = np.empty((n, 3)), tree.offsets.copy()
    kept, moved, reframed = np.empty((n, 10, 10)), np.empty((n, 10, 10)), np.empty((n, 10, 10))
    base = frames.base()
    for body in range(n):
        rotation, translation = frames.relative(body, base)
        if tree.prismatic[body]:
            axes[body] = _clean(frames.turns[body].T @ tree.axes[body])
        else:
            axes[body] = 0.0, 0.0, 1.0
            rotation, angle = _split_turn(rotation)
            offsets[body] += angle
        rotations[body], translations[body] = rotation, translation
        reframed[body] = _transform_matrix(
            frames.turns[body].T, -frames.turns[body].T @ frames.shifts[body]
        )
        unnoticed = _unnoticed(bool(tree.prismatic[body]))
        kept[body] = np.eye(10) - unnoticed
        moved[body] = _transform_matrix(rotation, translation) @ unnoticed
    canonical = KinematicTree(
        parents=tree.parents,
        rotations=rotations,
        translations=translations,
        axes=axes,
        prismatic=tree.prismatic,
        coordinates=tree.coordinates,
        multipliers=tree.multipliers,
        offsets=offsets,
    )
    return CanonicalModel(canonical, base, kept, moved, reframed)


class _Frames:
    """New body frames, given in the old ones: ``turns`` (n, 3, 3) and origins ``shifts`` (n, 3)."""

    def __init__(self, tree: KinematicTree) -> None:
        self._tree = tree
        self._main_child = self._find_main_children()
        self.turns = np.array([_turn_z_onto(axis) for axis in tree.axes])
        self.shifts = np.zeros((tree.n_bodies, 3))
        for body in range(tree.n_bodies - 1, -1, -1):
            if not tree.prismatic[body] and self._main_child[body] >= 0:
                self._fit(body, self._main_child[body])
        for body in range(tree.n_bodies):
            parent = int(tree.parents[body])
            if tree.prismatic[body]:
                # A sliding body has the orientation of its parent: no rotation.
                self.turns[body] = (
                    np.eye(3) if parent < 0 else tree.rotations[body].T @ self.turns[parent]
                )

    def _find_main_children(self) -> list[int]:
        """Child with the most bodies behind it, to which the frame is fitted."""
        sizes = [1] * self._tree.n_bodies
        main = [-1] * self._tree.n_bodies
        for body in range(self._tree.n_bodies - 1, -1, -1):
            parent = int(self._tree.parents[body])
            if parent >= 0:
                sizes[parent] += sizes[body]
                if main[parent] < 0 or sizes[body] >= sizes[main[parent]]:
                    main[parent] = body
        return main

    def _fit(self, body: int, child: int) -> None:
        """Spin and slide the frame of a body about its axis so that it suits its main child."""
        tree, turn = self._tree, self.turns[body]
        orientation = turn.T @ tree.rotations[child]
        position = turn.T @ (tree.translations[child] + tree.rotations[child] @ self.shifts[child])
        axis = _clean(orientation @ self.turns[child][:, 2])
        if tree.prismatic[child]:
            axis = _clean(orientation @ tree.axes[child])
        spin = _angle_that_clears_x(axis) if np.any(axis[:2]) else _angle_that_clears_y(position)
        turn = turn @ _about_z(spin)
        position, axis = _about_z(spin).T @ position, _about_z(spin).T @ axis
        if self._main_child[child] < 0 and not tree.prismatic[child] and abs(axis[1]) > 1e-3:
            # The last frame may slide along its axis: to the foot of the common normal.
            along = -position[1] / axis[1]
            self.shifts[child] = self.shifts[child] + along * self.turns[child][:, 2]
            position = position + along * axis
        self.turns[body] = turn
        self.shifts[body] = position[2] * turn[:, 2]

    def base(self) -> np.ndarray:
        """Orientation of the base frame: aligned with the first body."""
        first = int(np.flatnonzero(self._tree.parents < 0)[0])
        orientation: np.ndarray = self._tree.rotations[first] @ self.turns[first]
        return orientation

    def relative(self, body: int, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pose of a new body frame in the new frame of its parent, at joint coordinate zero."""
        tree, parent = self._tree, int(self._tree.parents[body])
        turn, shift = (
            (base, np.zeros(3))
            if parent < 0
            else (
                self.turns[parent],
                self.shifts[parent],
            )
        )
        rotation = turn.T @ tree.rotations[body] @ self.turns[body]
        offset = tree.translations[body] + tree.rotations[body] @ self.shifts[body] - shift
        return _clean(rotation), _clean(turn.T @ offset)


def _unnoticed(prismatic: bool) -> np.ndarray:
    """Projection of parameters on those without effect on a joint's torque, shape (10, 10)."""
    projection = np.zeros((10, 10))
    if prismatic:
        projection[range(4, 10), range(4, 10)] = 1.0
    else:
        projection[[0, 3], [0, 3]] = 1.0
        projection[[4, 7], [7, 7]] = 1.0  # the rod Ixx = Iyy that takes away all of Iyy
    return projection


def _transform_matrix(rotation: np.ndarray, translation: np.ndarray) -> np.ndarray:
    columns = [transform_inertial(unit, rotation, translation) for unit in np.eye(10)]
    return np.column_stack(columns)


def _clean(array: np.ndarray) -> np.ndarray:
    """Array without rounding errors near 0, 1 and -1."""
    for exact in (0.0, 1.0, -1.0):
        array = np.where(np.abs(array - exact) < _DUST, exact, array)
    return array


def _about_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return _clean(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]))


def _turn_z_onto(axis: np.ndarray) -> np.ndarray:
    """A rotation whose third column is the axis; an exact permutation for a unit axis."""
    k = int(np.argmax(np.abs(axis)))
    first = np.eye(3)[(k + 1) % 3]
    first = first - (first @ axis) * axis
    first = first / np.linalg.norm(first)
    return _clean(np.column_stack([first, np.cross(axis, first), axis]))


def _angle_that_clears_x(axis: np.ndarray) -> float:
    """Spin of a frame about its z axis after which a direction has no x component."""
    return float(np.arctan2(-axis[0], axis[1]))


def _angle_that_clears_y(position: np.ndarray) -> float:
    return float(np.arctan2(position[1], position[0])) if np.any(position[:2]) else 0.0


def _split_turn(rotation: np.ndarray) -> tuple[np.ndarray, float]:
    """Split ``rotation = rest @ Rz(angle)`` so that the rest has as few entries as possible."""
    # Where the z axis lies in the y-z plane, the rest is a turn about x: its first column is x.
    angle = float(np.arctan2(-rotation[0, 1], rotation[0, 0]))
    if angle == 0.0:
        return rotation, 0.0
    rest = _clean(rotation @ _about_z(-angle))
    return rest, angle
