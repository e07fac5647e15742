# SPDX-License-Identifier: BSD-3-Clause
"""Rigid-body recursions on symbolic scalars.

Every function builds a tape for one kinematic tree and returns it with the named outputs. Vectors
are lists of three scalars in the frame of a body; two quantities carry the formulation:

``B = [dw]x + [w]x [w]x``
    With angular velocity ``w`` and acceleration ``dw`` of a body, a point fixed at ``r`` in it
    accelerates by ``a + B r``. The same nine numbers give the acceleration of child frames, the
    inertial force ``m a + B (m c)`` and, through :func:`_moment_map`, the inertial moment. They are
    computed once per body.
``(s, v)``
    Unit motion of a joint seen from a body further out: angular part ``s`` and velocity ``v`` of
    the body's origin. The power of the body's inertial wrench along it is the torque of the joint;
    the regressor carries these axes outward instead of a 6 x 10 matrix of wrenches inward.

Gravity enters as an acceleration ``-g`` of the base.

References
----------
.. [1] R. Featherstone, "Rigid Body Dynamics Algorithms", Springer, 2008, chapters 5 and 6.
.. [2] C. G. Atkeson, C. H. An, J. M. Hollerbach, "Estimation of inertial parameters of manipulator
       loads and links", International Journal of Robotics Research 5(3), 1986.
.. [3] W. Khalil, E. Dombre, "Modeling, Identification and Control of Robots", 2002, chapter 9.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn.dynamics._tape import Scalar, Tape
from skidyn.dynamics._tree import KinematicTree, skew, transform_inertial

#: Terms below this fraction of the largest term of a sum do not change the sum.
_BELOW_ROUNDING = 1e-18

Vector = list[Any]  # of three Scalars, or floats
Matrix = list[Any]  # of three Vectors, the rows


@dataclass(frozen=True)
class Program:
    """A tape with its outputs; the key of an output is the position of its value."""

    tape: Tape
    outputs: dict[tuple[int, ...], Scalar]
    shape: tuple[int, ...]


# Three-vectors of scalars.


def _add(a: Vector, b: Vector) -> Vector:
    return [x + y for x, y in zip(a, b, strict=True)]


def _scale(factor: Scalar | float, a: Vector) -> Vector:
    return [factor * x for x in a]


def _dot(a: Vector, b: Vector) -> Scalar:
    total: Scalar = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return total


def _cross(a: Vector, b: Vector) -> Vector:
    return [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]


def _times(matrix: Matrix, a: Vector) -> Vector:
    return [_dot(row, a) for row in matrix]


def _transposed_times(matrix: Matrix, a: Vector) -> Vector:
    return [_dot([row[k] for row in matrix], a) for k in range(3)]


def _column(matrix: Matrix, k: int) -> Vector:
    return [row[k] for row in matrix]


class _Rotation:
    """Rotation of a body frame in its parent: a constant matrix, then a turn about the axis."""

    def __init__(
        self, tape: Tape, constant: np.ndarray, axis: np.ndarray, angle: Scalar | None
    ) -> None:
        self._constant = [[tape.constant(x) for x in row] for row in constant]
        self._plane: tuple[int, int] | None = None
        self._turn: Matrix | None = None
        if angle is None:
            return
        self._cos, self._sin = angle.cos(), angle.sin()
        k = int(np.argmax(np.abs(axis)))
        if abs(axis[k]) == 1.0:
            self._plane = (k + 1) % 3, (k + 2) % 3
            if axis[k] < 0:
                self._sin = -self._sin
        else:
            self._turn = self._about(tape, axis)

    def _about(self, tape: Tape, axis: np.ndarray) -> Matrix:
        """Rodrigues' formula about a skew axis."""
        outer, cross = np.outer(axis, axis), skew(axis)
        return [
            [
                tape.constant(outer[i, j])
                + tape.constant(float(i == j) - outer[i, j]) * self._cos
                + tape.constant(cross[i, j]) * self._sin
                for j in range(3)
            ]
            for i in range(3)
        ]

    def to_body(self, a: Vector) -> Vector:
        """Components in the body frame of a vector of the parent frame."""
        a = _transposed_times(self._constant, a)
        if self._turn is not None:
            return _transposed_times(self._turn, a)
        if self._plane is None:
            return a
        i, j = self._plane
        turned = list(a)
        turned[i] = self._cos * a[i] + self._sin * a[j]
        turned[j] = self._cos * a[j] - self._sin * a[i]
        return turned

    def to_parent(self, a: Vector) -> Vector:
        """Components in the parent frame of a vector of the body frame."""
        if self._turn is not None:
            a = _times(self._turn, a)
        elif self._plane is not None:
            i, j = self._plane
            turned = list(a)
            turned[i] = self._cos * a[i] - self._sin * a[j]
            turned[j] = self._sin * a[i] + self._cos * a[j]
            a = turned
        return _times(self._constant, a)


class _Joint:
    """Position of one body relative to its parent."""

    def __init__(self, tape: Tape, tree: KinematicTree, body: int) -> None:
        self.parent = int(tree.parents[body])
        self.coordinate = int(tree.coordinates[body])
        self.multiplier = float(tree.multipliers[body])
        self.prismatic = bool(tree.prismatic[body])
        axis, constant = tree.axes[body], tree.rotations[body]
        self.axis = [tape.constant(x) for x in axis]
        self.zero = [tape.constant(0.0)] * 3
        displacement = self.multiplier * tape.input("q", self.coordinate) + float(
            tree.offsets[body]
        )
        self.rotation = _Rotation(tape, constant, axis, None if self.prismatic else displacement)
        self.position = [tape.constant(x) for x in tree.translations[body]]
        if self.prismatic:
            self.position = _add(self.position, _scale(displacement, list(constant @ axis)))

    @property
    def motion(self) -> tuple[Vector, Vector]:
        """Own unit motion (s, v) of the joint in the body frame."""
        return (self.zero, self.axis) if self.prismatic else (self.axis, self.zero)


@dataclass
class _Motion:
    """Motion of a body, in its own frame."""

    angular_velocity: Vector
    angular_acceleration: Vector
    acceleration: Vector  # of the frame origin, minus gravity

    def __post_init__(self) -> None:
        (x, y, z), (dx, dy, dz) = self.angular_velocity, self.angular_acceleration
        xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
        self.squares = xx, yy, zz
        self.products = xy, xz, yz
        self.B = [
            [-(yy + zz), xy - dz, xz + dy],
            [xy + dz, -(xx + zz), yz - dx],
            [xz - dy, yz + dx, -(xx + yy)],
        ]


def _joints(tape: Tape, tree: KinematicTree) -> list[_Joint]:
    return [_Joint(tape, tree, body) for body in range(tree.n_bodies)]


def _motions(
    joints: Sequence[_Joint],
    velocities: Sequence[Scalar],
    accelerations: Sequence[Scalar],
    gravity: Vector,
) -> Iterator[_Motion]:
    """Outward recursion: motion of every body, one after the other.

    Each motion is yielded at once, so that the caller's operations follow those on which they
    depend: the fewer values are alive at a time, the more of them stay in the cache.
    """
    motions: list[_Motion] = []
    for joint in joints:
        dq = joint.multiplier * velocities[joint.coordinate]
        ddq = joint.multiplier * accelerations[joint.coordinate]
        to_body = joint.rotation.to_body
        if joint.parent < 0:
            w, dw, a = joint.zero, joint.zero, to_body([-g for g in gravity])
        else:
            parent = motions[joint.parent]
            w, dw = to_body(parent.angular_velocity), to_body(parent.angular_acceleration)
            a = to_body(_add(parent.acceleration, _times(parent.B, joint.position)))
        turning = _scale(dq, joint.axis)
        if joint.prismatic:
            a = _add(_add(a, _scale(ddq, joint.axis)), _scale(2.0, _cross(w, turning)))
        else:
            dw = _add(_add(dw, _scale(ddq, joint.axis)), _cross(w, turning))
            w = _add(w, turning)
        motions.append(_Motion(w, dw, a))
        yield motions[-1]


def _moment_map(motion: _Motion) -> list[Vector]:
    """Inertial moment per unit of (Ixx, Ixy, Ixz, Iyy, Iyz, Izz): ``I dw + w x (I w)``."""
    B, dw = motion.B, motion.angular_acceleration
    xx, yy, zz = motion.squares
    xy, xz, yz = motion.products
    return [
        [dw[0], xz, -xy],
        [-B[2][0], B[2][1], xx - yy],
        [B[1][0], zz - xx, -B[1][2]],
        [-yz, dw[1], xy],
        [yy - zz, -B[0][1], B[0][2]],
        [yz, -xz, dw[2]],
    ]


def _parameters(tape: Tape, body: int, used: np.ndarray | None) -> list[Scalar]:
    """The ten inertial parameters of a body; unused ones are zero."""
    return [
        tape.input("parameter", 10 * body + k)
        if used is None or used[body, k]
        else tape.constant(0.0)
        for k in range(10)
    ]


def trace_inverse_dynamics(
    tree: KinematicTree,
    gravity: Sequence[float],
    *,
    with_velocity: bool = True,
    with_acceleration: bool = True,
    parameters_used: np.ndarray | None = None,
    parameters: np.ndarray | None = None,
) -> Program:
    """Joint torques by the recursive Newton-Euler algorithm [1]_, with gravity in m/s^2.

    Inputs are ``q``, ``dq``, ``ddq`` by joint coordinate and ``parameter`` by position in the
    flattened (n_bodies, 10) array; outputs are keyed ``(coordinate,)``. Without velocity or
    acceleration, these are zero and their terms vanish. Parameters that are not in
    ``parameters_used`` are zero; given ``parameters`` are folded into the program, otherwise they
    are inputs.
    """
    tape = Tape()
    if parameters is None:
        own = [_parameters(tape, body, parameters_used) for body in range(tree.n_bodies)]
    else:
        own = [[tape.constant(value) for value in row] for row in parameters]
    torques = inverse_dynamics(
        tape, tree, gravity, own, with_velocity=with_velocity, with_acceleration=with_acceleration
    )
    return Program(tape, {(i,): t for i, t in enumerate(torques)}, (tree.n_joints,))


def inverse_dynamics(
    tape: Any,
    tree: KinematicTree,
    gravity: Sequence[float],
    parameters: Sequence[Vector],
    *,
    with_velocity: bool = True,
    with_acceleration: bool = True,
) -> list[Any]:
    """Torques by the recursive Newton-Euler algorithm [1]_ on symbols or numbers.

    Gravity is in m/s^2, parameters are ten of every body; without velocity or acceleration these
    are zero, as in :func:`trace_inverse_dynamics`.
    """
    joints = _joints(tape, tree)
    zeros = [tape.constant(0.0)] * tree.n_joints
    dq = [tape.input("dq", i) for i in range(tree.n_joints)] if with_velocity else zeros
    ddq = [tape.input("ddq", i) for i in range(tree.n_joints)] if with_acceleration else zeros
    motions = _motions(joints, dq, ddq, [tape.constant(g) for g in gravity])
    forces: list[Vector] = []
    moments: list[Vector] = []
    torques = list(zeros)
    waiting = np.bincount(tree.parents[tree.parents >= 0], minlength=tree.n_bodies).tolist()
    for body, motion in enumerate(motions):
        own = parameters[body]
        mass, first_moment, inertia = own[0], own[1:4], own[4:]
        force = _add(_scale(mass, motion.acceleration), _times(motion.B, first_moment))
        moment = _cross(first_moment, motion.acceleration)
        for value, column in zip(inertia, _moment_map(motion), strict=True):
            moment = _add(moment, _scale(value, column))
        forces.append(force)
        moments.append(moment)
        # A body is finished as soon as all bodies behind it are: its values leave the cache early.
        done = body
        while done >= 0 and waiting[done] == 0:
            joint, force, moment = joints[done], forces[done], moments[done]
            along = _dot(joint.axis, force if joint.prismatic else moment)
            torques[joint.coordinate] = torques[joint.coordinate] + joint.multiplier * along
            done = joint.parent
            if done >= 0:
                force, moment = joint.rotation.to_parent(force), joint.rotation.to_parent(moment)
                moment = _add(moment, _cross(joint.position, force))
                forces[done] = _add(forces[done], force)
                moments[done] = _add(moments[done], moment)
                waiting[done] -= 1
    return torques


def trace_torque_regressor(tree: KinematicTree, gravity: Sequence[float]) -> Program:
    """Joint torque per unit of every inertial parameter [2]_.

    Outputs are keyed ``(coordinate, 10 * body + parameter)``; those that vanish for every motion
    are omitted.
    """
    tape = Tape()
    joints = _joints(tape, tree)
    dq = [tape.input("dq", i) for i in range(tree.n_joints)]
    ddq = [tape.input("ddq", i) for i in range(tree.n_joints)]
    motions = _motions(joints, dq, ddq, [tape.constant(g) for g in gravity])
    axes: list[dict[int, tuple[Vector, Vector]]] = []
    columns: list[dict[int, list[Scalar]]] = []
    outputs: dict[tuple[int, ...], Scalar] = {}
    for body, (joint, motion) in enumerate(zip(joints, motions, strict=True)):
        inherited = axes[joint.parent] if joint.parent >= 0 else {}
        seen: dict[int, tuple[Vector, Vector]] = {}
        moment_map = _moment_map(motion)
        shared = _shared_columns(tree, body)
        axes.append(seen)
        columns.append({})
        for mover in (*inherited, body):
            if mover == body:
                s, v = joint.motion
            else:
                s, v = inherited[mover]
                v = _add(v, _cross(s, joint.position))
                s, v = joint.rotation.to_body(s), joint.rotation.to_body(v)
            seen[mover] = s, v
            entries = _power(motion, moment_map, s, v)
            if mover != body:
                _take_from_parent(entries, columns[joint.parent][mover], shared)
            columns[body][mover] = entries
            coordinate, multiplier = joints[mover].coordinate, joints[mover].multiplier
            for k, entry in enumerate(entries):
                key = coordinate, 10 * body + k
                total = multiplier * entry
                outputs[key] = outputs[key] + total if key in outputs else total
    outputs = {key: entry for key, entry in outputs.items() if not entry.is_zero()}
    return Program(tape, outputs, (tree.n_joints, 10 * tree.n_bodies))


def _shared_columns(tree: KinematicTree, body: int) -> list[tuple[int, int, np.ndarray]]:
    """Columns of a body that follow from those of its parent.

    A mass on the axis of a revolute joint, its first moment along the axis and a thin rod on the
    axis give the same torques on either side of the joint (see :mod:`skidyn.dynamics._canonical`):
    for all joints before it, their column is a combination of columns of the parent.

    In (column, partner, coefficients), ``column + partner = coefficients @ columns of the parent``;
    partner -1 means none. Only combinations that are cheaper than the column itself are listed.
    """
    axis = np.abs(tree.axes[body])
    if tree.prismatic[body] or tree.parents[body] < 0 or axis.max() < 1.0:
        return []
    k = int(np.argmax(axis))
    inertia = {0: 4, 1: 7, 2: 9}  # positions of Ixx, Iyy, Izz among the parameters
    across = [inertia[i] for i in range(3) if i != k]
    shared = []
    # A separate column takes 5 operations for m, 9 for a first moment, 5 for an inertia.
    for columns, own_cost in (((0,), 5), ((1 + k,), 9), ((across[1], across[0]), 4)):
        unit = np.zeros(10)
        unit[list(columns)] = 1.0
        seen = transform_inertial(unit, tree.rotations[body], tree.translations[body])
        # A joint axis 1e-11 rad off a right angle leaves squares of that: below any rounding.
        seen[np.abs(seen) < _BELOW_ROUNDING * np.abs(seen).max()] = 0.0
        # One product for all columns with the same coefficient.
        n_products = len(set(np.abs(seen)) - {0.0, 1.0})
        if np.count_nonzero(seen) + n_products - 1 < own_cost:
            shared.append((columns[0], columns[1] if len(columns) > 1 else -1, seen))
    return shared


def _take_from_parent(
    entries: list[Scalar],
    parent: list[Scalar],
    shared: list[tuple[int, int, np.ndarray]],
) -> None:
    """Replace the entries of shared columns by combinations of the parent's."""
    for column, partner, coefficients in shared:
        total = entries[column].tape.constant(0.0)
        for size in np.unique(np.abs(coefficients[coefficients != 0.0])):
            part = entries[column].tape.constant(0.0)
            for k in np.flatnonzero(np.abs(coefficients) == size):
                part = part + parent[k] if coefficients[k] > 0 else part - parent[k]
            total = total + float(size) * part
        entries[column] = total if partner < 0 else total - entries[partner]


def _power(motion: _Motion, moment_map: list[Vector], s: Vector, v: Vector) -> list[Scalar]:
    """Power of a body's inertial wrench along a unit motion (s, v), per unit of its parameters."""
    lever = _cross(motion.acceleration, s)
    first_moments = [lever[k] + _dot(_column(motion.B, k), v) for k in range(3)]
    return [_dot(v, motion.acceleration), *first_moments, *(_dot(s, c) for c in moment_map)]


def trace_mass_matrix(tree: KinematicTree, parameters_used: np.ndarray | None = None) -> Program:
    """Joint-space inertia matrix by composite rigid bodies [1]_; outputs keyed (row, column)."""
    tape = Tape()
    joints = _joints(tape, tree)
    composite = []
    for body in range(tree.n_bodies):
        p = _parameters(tape, body, parameters_used)
        inertia = [[p[4], p[5], p[6]], [p[5], p[7], p[8]], [p[6], p[8], p[9]]]
        composite.append((p[0], p[1:4], inertia))
    outputs: dict[tuple[int, ...], Scalar] = {}
    for body in range(tree.n_bodies - 1, -1, -1):
        joint = joints[body]
        mass, moment, inertia = composite[body]
        s, v = joint.motion
        force = _add(_scale(mass, v), _cross(s, moment))
        torque = _add(_times(inertia, s), _cross(moment, v))
        _accumulate_row(outputs, joints, body, force, torque)
        if joint.parent >= 0:
            seen = _seen_from_parent(joint, mass, moment, inertia)
            composite[joint.parent] = _add_inertias(composite[joint.parent], seen)
    return Program(tape, outputs, (tree.n_joints, tree.n_joints))


def _accumulate_row(
    outputs: dict[tuple[int, ...], Scalar],
    joints: Sequence[_Joint],
    body: int,
    force: Vector,
    torque: Vector,
) -> None:
    """Add the torques of all joints between a joint and the base due to its unit acceleration."""
    i, mover = joints[body].coordinate, body
    while True:
        joint = joints[mover]
        j = joint.coordinate
        along = _dot(joint.axis, force if joint.prismatic else torque)
        entry = joints[body].multiplier * joint.multiplier * along
        # A pair of bodies counts in both triangles; with a shared coordinate both are on the
        # diagonal.
        keys = [(i, j)] if mover == body else [(i, j), (j, i)]
        for key in keys:
            outputs[key] = outputs[key] + entry if key in outputs else entry
        if joint.parent < 0:
            return
        force, torque = joint.rotation.to_parent(force), joint.rotation.to_parent(torque)
        torque = _add(torque, _cross(joint.position, force))
        mover = joint.parent


def _seen_from_parent(
    joint: _Joint, mass: Scalar, moment: Vector, inertia: Matrix
) -> tuple[Scalar, Vector, Matrix]:
    """Mass, first moment and inertia of a body about its parent's frame."""
    turned = joint.rotation.to_parent(moment)
    half = [joint.rotation.to_parent(row) for row in inertia]  # rows of I R^T
    rotated = [joint.rotation.to_parent(_column(half, k)) for k in range(3)]
    p = joint.position
    total = _add(turned, _scale(mass, p))
    # I' = R I R^T + (p.h' + p.h) 1 - p h'^T - h p^T, with h = R m c and h' = h + m p.
    trace = _dot(p, total) + _dot(p, turned)
    shifted = []
    for i in range(3):
        row = []
        for j in range(3):
            # Symmetric by construction: write the lower triangle from the upper one.
            a, b = (i, j) if i <= j else (j, i)
            entry = rotated[b][a] - (p[a] * total[b] + turned[a] * p[b])
            row.append(entry + trace if i == j else entry)
        shifted.append(row)
    return mass, total, shifted


def _add_inertias(
    a: tuple[Scalar, Vector, Matrix], b: tuple[Scalar, Vector, Matrix]
) -> tuple[Scalar, Vector, Matrix]:
    rows = [_add(x, y) for x, y in zip(a[2], b[2], strict=True)]
    return a[0] + b[0], _add(a[1], b[1]), rows


def _placed(tape: Tape, placement: tuple[float, ...] | None) -> tuple[Matrix, Vector]:
    """Constant pose of a frame in its body, from a flattened 3 x 4 matrix; None: the same."""
    pose = np.eye(3, 4) if placement is None else np.reshape(placement, (3, 4))
    rows = [[tape.constant(x) for x in row] for row in pose]
    return [row[:3] for row in rows], [row[3] for row in rows]


def trace_pose(
    tree: KinematicTree, body: int, placement: tuple[float, ...] | None = None
) -> Program:
    """Pose of a frame in the base frame; outputs keyed ``(row, column)`` of ``[R | p]``."""
    tape = Tape()
    rows, position = _placed(tape, placement)
    for mover in reversed(tree.path(body)):
        joint = _Joint(tape, tree, mover)
        position = _add(joint.position, joint.rotation.to_parent(position))
        columns = [joint.rotation.to_parent(_column(rows, k)) for k in range(3)]
        rows = [[columns[k][i] for k in range(3)] for i in range(3)]
    outputs: dict[tuple[int, ...], Scalar] = {}
    outputs |= {(i, k): rows[i][k] for i in range(3) for k in range(3)}
    outputs |= {(i, 3): position[i] for i in range(3)}
    return Program(tape, outputs, (3, 4))


def trace_jacobian(
    tree: KinematicTree, body: int, placement: tuple[float, ...] | None = None
) -> Program:
    """Velocity of a frame per unit joint velocity, base-aligned; linear rows first."""
    tape = Tape()
    outputs: dict[tuple[int, ...], Scalar] = {}
    _, origin = _placed(tape, placement)
    columns: list[tuple[_Joint, Vector, Vector]] = []  # (joint, s, v) in the current frame
    for mover in reversed(tree.path(body)):
        joint = _Joint(tape, tree, mover)
        s, axis = joint.motion
        columns.append((joint, s, axis if joint.prismatic else _cross(s, origin)))
        turn = joint.rotation.to_parent
        columns = [(moved, turn(s), turn(v)) for moved, s, v in columns]
        origin = _add(joint.position, turn(origin))
    for joint, s, v in columns:
        for i, entry in enumerate([*v, *s]):
            key = i, joint.coordinate
            entry = joint.multiplier * entry
            outputs[key] = outputs[key] + entry if key in outputs else entry
    return Program(tape, outputs, (6, tree.n_joints))
