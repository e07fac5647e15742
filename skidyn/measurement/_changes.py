# SPDX-License-Identifier: BSD-3-Clause
"""Changes to the reading of a log: those that are tried, one difference each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from skidyn._signals import Array, scatter
from skidyn.measurement._fits import Fits, friction
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._reading import Reading
from skidyn.robots import Robot

#: Strength of gravity, and the largest tilt of a table, degrees. A smaller tilt is no other reading
#: but an effect, which a diagnosis finds.
GRAVITY, LEAST_ANGLE = 9.81, 20.0
#: Cosine of the angle to an axis from which gravity is along that axis.
UPRIGHT = 0.995
#: Cosine of the angle between the axes of two joints from which their angles add up.
PARALLEL = 0.999
#: Offsets of a position that are tried, rad: every small one a third of the next, because a zero
#: between them gains with the nearer one only if it is more than half as large.
OFFSETS = np.deg2rad([-135, -90, -45, -15, -5, 5, 15, 45, 90, 135, 180])
#: Those tried for a joint that also counts in the opposite direction, rad.
QUARTERS = np.deg2rad([-90, 90, 180])

#: Rows as they were recorded.
AS_IT_IS = Reading()


@dataclass(frozen=True)
class Change:
    """One difference of a reading from that of the user.

    Attributes
    ----------
    kind : str
        ``"torque_sign"``, ``"motion_sign"``, ``"joint_sign"`` (both), ``"order"``,
        ``"motion_order"``, ``"torque_order"``, ``"summed"``, ``"gravity"``, ``"no_gravity"`` or
        ``"zero"``; during the comparison also ``"convention"``, a joint sign with a zero.
    joints : tuple of int
        Joints concerned, from 0.
    reading : Reading
        With this change and those found before it.
    gain, confirmed : float
        Log-likelihood gain with the bodies of the description, and with identified ones.
    untuned : float
        Its gain in few rows; of a zero, at the best of the angles tried for all joints.
    drop : float
        Share of the residual's spread that it removes, on the joint that gains most.
    rivals : tuple of str
        Other kinds of change of the same joints that explain equally much.
    other : str
        An equally good explanation other than a reading, such as a physical effect; empty if none.
    rival_gains : bool
        Whether that other explanation is the likelier one.
    restorable : bool
        For torque without gravity: whether it was subtracted with the bodies of the description.
    """

    kind: str
    joints: tuple[int, ...]
    reading: Reading
    gain: float = 0.0
    confirmed: float = 0.0
    untuned: float = 0.0
    drop: float = 0.0
    rivals: tuple[str, ...] = ()
    other: str = ""
    rival_gains: bool = False
    restorable: bool = False


def alternatives(fits: Fits, reading: Reading, here: Outcome) -> Iterator[Change]:
    """Readings that differ from one in a single respect."""
    joints = range(fits.n_joints)
    for j in joints:
        own = frozenset([j])
        flip_torque, flip_motion = reading.flip_torque ^ own, reading.flip_motion ^ own
        yield Change("torque_sign", (j,), replace(reading, flip_torque=flip_torque))
        yield Change("motion_sign", (j,), replace(reading, flip_motion=flip_motion))
        both = replace(reading, flip_torque=flip_torque, flip_motion=flip_motion)
        yield Change("joint_sign", (j,), both)
    # single ones would contradict each other; all of them are another convention
    every = replace(reading, flip_torque=frozenset(joints) ^ reading.flip_torque)
    yield Change("torque_sign", tuple(joints), every)
    yield from _orders(fits, reading)
    told = {joint for joint, _ in reading.summed}
    for j, sign in _parallel(fits.robot):
        if j not in told:
            summed = replace(reading, summed=(*reading.summed, (j, sign)))
            yield Change("summed", (j,), summed)
    if reading.gravity is None:
        yield from _gravities(fits, reading, here)
    found = {joint for joint, _ in reading.zero}
    for j in np.flatnonzero(~fits.signals.prismatic).tolist():
        for offset in OFFSETS:
            if j not in found:
                shifted = replace(reading, zero=(*reading.zero, (j, float(offset))))
                yield Change("zero", (j,), shifted)
        for offset in QUARTERS:
            if j not in found:
                both = replace(
                    reading,
                    flip_torque=reading.flip_torque ^ {j},
                    flip_motion=reading.flip_motion ^ {j},
                    zero=(*reading.zero, (j, float(offset))),
                )
                yield Change("convention", (j,), both)


def _parallel(robot: Robot) -> Iterator[tuple[int, int]]:
    """Revolute joints with an axis parallel to the previous one, and its relative direction."""
    tree, turning = robot.tree, [kind == "revolute" for kind in robot.joint_types]
    if len(tree.parents) != robot.n_joints:
        return  # bodies that mimic others have no columns of their own
    for j in range(1, robot.n_joints):
        if turning[j] and turning[j - 1] and tree.parents[j] == j - 1:
            along = float(tree.axes[j - 1] @ tree.rotations[j] @ tree.axes[j])
            if abs(along) > PARALLEL:
                yield j, 1 if along > 0 else -1


def _orders(fits: Fits, reading: Reading) -> Iterator[Change]:
    """Orders of the columns: two exchanged, by name, backwards, one further, branches exchanged."""
    n = fits.n_joints
    for name in ("order", "torque_order"):
        now = list(getattr(reading, name) or range(n))
        tried = []
        for a, b in combinations(range(n), 2):
            swapped = list(now)
            swapped[a], swapped[b] = swapped[b], swapped[a]
            tried.append(swapped)
        if n > 2 and getattr(reading, name) is None:
            by_name = sorted(range(n), key=lambda j: fits.robot.joint_names[j])
            tried += [[by_name.index(j) for j in range(n)], list(range(n))[::-1]]
            tried += [list(np.roll(range(n), k)) for k in (1, -1)]  # a column was lost or added
            tried += _exchanged_branches(fits.robot)
        for order in tried:
            wanted = None if order == list(range(n)) else tuple(map(int, order))
            moved = tuple(j for j in range(n) if order[j] != j)
            if wanted is not None:
                changed: Any = {name: wanted}
                yield Change(name, moved, replace(reading, **changed))
            if name == "order" and wanted is not None:  # the same motion, with the torques as now
                own = tuple(order.index(reading.torque_column(j)[0]) for j in range(n))
                yield Change(
                    "motion_order", moved, replace(reading, order=wanted, torque_order=own)
                )


def _exchanged_branches(robot: Robot) -> list[list[int]]:
    """Orders in which two branches of several joints, such as both arms, are exchanged."""
    parents = robot.tree.parents
    if len(parents) != robot.n_joints:
        return []  # bodies that mimic others have no columns of their own
    below: dict[int, list[int]] = {j: [j] for j in range(robot.n_joints)}
    for j in reversed(range(robot.n_joints)):
        if parents[j] >= 0:
            below[parents[j]] += below[j]
    orders = []
    for a, b in combinations(range(robot.n_joints), 2):
        if parents[a] == parents[b] and len(below[a]) == len(below[b]) > 1:
            order = list(range(robot.n_joints))
            for one, other in zip(sorted(below[a]), sorted(below[b]), strict=True):
                order[one], order[other] = other, one
            orders.append(order)
    return orders


def _gravities(fits: Fits, reading: Reading, here: Outcome) -> Iterator[Change]:
    """Other directions of gravity, the one that fits best among them, and none."""
    own = np.asarray(fits.robot.gravity, dtype=float)
    known = bool(np.linalg.norm(own))
    if known:
        # first, so that it has priority over a direction of gravity without torque
        yield Change("no_gravity", (), replace(reading, gravity=(0.0, 0.0, 0.0)))
    directions = [sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0)]
    best = fitted_gravity(fits, reading, here)
    if best is not None and np.linalg.norm(best) > 0:
        best = best / np.linalg.norm(best)
        if float(np.max(np.abs(best))) < UPRIGHT:
            directions.append(best)
    for direction in directions:
        cosine = float(direction @ own / np.linalg.norm(own)) if known else 0.0
        if np.rad2deg(np.arccos(np.clip(cosine, -1, 1))) >= LEAST_ANGLE:
            x, y, z = (float(v) for v in GRAVITY * direction)
            yield Change("gravity", (), replace(reading, gravity=(x, y, z)))


def is_oblique(gravity: Sequence[float] | None) -> bool:
    """Whether there is gravity, but not along an axis of the base."""
    return gravity is not None and bool(np.any(gravity)) and not is_upright(gravity)


def is_upright(gravity: Sequence[float] | None) -> bool:
    """Whether gravity is along an axis of the base."""
    return gravity is not None and float(np.max(np.abs(gravity))) > UPRIGHT * GRAVITY


def tilted(fits: Fits, reading: Reading, here: Outcome) -> Reading | None:
    """A reading with the small tilt of the base that explains the torque best.

    Parameters
    ----------
    fits : Fits
        Rows.
    reading : Reading
        Reading of the rows.
    here : Outcome
        Its fit with the bodies of the description.

    Returns
    -------
    Reading or None
        None if the robot has no gravity, or that which fits best is no small tilt.
    """
    own = np.asarray(fits.robot.gravity, dtype=float)
    best = None if reading.gravity is not None else fitted_gravity(fits, reading, here)
    if best is None or not own.any() or not best.any():
        return None
    along = best / np.linalg.norm(best)
    cosine = float(along @ own / np.linalg.norm(own))
    if np.rad2deg(np.arccos(np.clip(cosine, -1, 1))) >= LEAST_ANGLE:
        return None
    x, y, z = (float(v) for v in np.linalg.norm(own) * along)
    return replace(reading, gravity=(x, y, z))


def tilt_gain(fits: Fits, reading: Reading = AS_IT_IS) -> float:
    """Log-likelihood that the stated bodies gain by a small tilt of the base; 0 without one.

    Parameters
    ----------
    fits : Fits
        Rows.
    reading : Reading, optional
        Reading of the rows; as they are by default.
    """
    here = fits.nominal(reading)
    tilt = tilted(fits, reading, here)
    return 0.0 if tilt is None else fits.nominal(tilt).gained_over(here)


def fitted_gravity(fits: Fits, reading: Reading, here: Outcome) -> Array | None:
    """Gravity that explains the torque best with the bodies of the description, m/s^2."""
    s = reading.motion(fits.signals)
    still, pulls = fits.gravity_parts(reading)
    blocks, targets = [], []
    for j in range(fits.n_joints):
        column, sign = reading.torque_column(j)
        if not fits.usable(column):
            continue
        torque, use = fits.mean_torque(column)
        y = sign * torque[use] - still[use, j]
        own = np.column_stack([fits.average(friction(s, j))[use], np.ones(int(use.sum()))])
        basis, _ = np.linalg.qr(own)
        pull = pulls[:, use, j].T
        blocks.append((pull - basis @ (basis.T @ pull)) / here.scale[column])
        targets.append((y - basis @ (basis.T @ y)) / here.scale[column])
    if not blocks:
        return None
    a, y = np.vstack(blocks), np.concatenate(targets)
    weight = np.ones(len(y))
    gravity = np.zeros(3)
    for _ in range(5):
        scaled = a * np.sqrt(weight)[:, None]
        gravity = np.linalg.lstsq(scaled, y * np.sqrt(weight), rcond=1e-6)[0]
        r = y - a @ gravity
        spread = float(scatter(r)) + 1e-12
        weight = 1 / np.maximum(1.0, np.abs(r) / (1.5 * spread))
    return np.asarray(gravity)
