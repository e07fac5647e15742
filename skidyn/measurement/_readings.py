# SPDX-License-Identifier: BSD-3-Clause
"""Readings of a log that differ from the user's in one respect, and search for the best."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from typing import Any

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._duel import Duel, fight
from skidyn.measurement._fits import Fits, Outcome, Reading, friction
from skidyn.measurement._peak import peak
from skidyn.robots import Robot

#: Least log-likelihood gain of a change, corrected for the correlation of neighbouring rows.
LEAST = 15.0
#: What it must gain at least where identified bodies decide, by so much, and the share of a joint's
#: residual that it then takes off.
WEAKEST, DECISIVE, HALF = 3.0, 60.0, 0.5
#: What it gains with stated bodies where identified ones, that could be negative, need not agree.
OVERWHELMING = 100.0
#: Share of a joint's residual that a zero must take off to be noted beside other bodies, and its
#: least angle, rad: the direction of a weight in a description is not known better.
MOSTLY, NOTED = 0.8, np.deg2rad(10)
#: Changes of one joint whose gains differ by less than this, or this share, cannot be separated.
TIED, ALIKE = 3.0, 0.05
#: Share of the gain within which another kind of change of the same joints is equally possible.
RIVALS = 0.2
#: What a change must gain with identified bodies. Negative masses could replace torque with the
#: opposite sign or gravity that points up or is absent, so that these gain little.
NEEDED = {
    **dict.fromkeys(("motion_sign", "joint_sign", "summed", "zero", "convention"), 10.0),
    **dict.fromkeys(("order", "motion_order", "torque_order"), 10.0),
    **dict.fromkeys(("torque_sign", "gravity"), -3.0),
}
#: Least gain of a change relative to the largest one, as a share.
BESIDE = 0.3
#: Share of gravity that a compensated torque may still contain, the uncertainty of bodies.
LEFT_OVER = 0.4
#: Least share of a joint's spread that the new reading must remove.
LEAST_DROP = 0.15
#: Strength of gravity, and the largest tilt of a table, degrees.
GRAVITY, LEAST_ANGLE = 9.81, 20.0
#: Cosine of the angle to an axis from which gravity is along that axis.
UPRIGHT = 0.995
#: Cosine of the angle between the axes of two joints from which their angles add up.
PARALLEL = 0.999
#: Offsets of a position that are tried, rad.
OFFSETS = np.deg2rad([-135, -90, -45, -15, 15, 45, 90, 135, 180])
#: Those tried for a joint that also counts in the opposite direction, rad.
QUARTERS = np.deg2rad([-90, 90, 180])
#: Distance of the angles of a parabola through the likelihood of a zero, rad, and how often several
#: zeros are refined in turn.
NEAR, SWEEPS = np.deg2rad(1.0), 3
#: Alternative of a reading that gains little over bodies near those of the description.
OTHER_BODIES = "bodies that differ from the description"
#: Rounds of the fits for ranking, and number of changes that are examined in detail.
SCREENED, FINALISTS = 1, 12
#: Angles of every joint that are tried beside loads.
ANGLES = 3
#: Rows of these fits at least, and at most over the number of joints.
FEWEST_ROWS, MOST_ROWS = 150, 2800


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


def find_changes(fits: Fits) -> list[Change]:
    """Changes to the reading that explain the measurement better, the strongest first.

    One change is made at a time, the one that gains most; the residual determines the next. At the
    end every change must still gain over the reading without it, and identified bodies must not
    contradict it.

    Parameters
    ----------
    fits : Fits
        Rows.
    """
    found: list[Change] = []
    fitted: list[int] = []
    reading = Reading()
    rows = fits
    while len(found) < 2 * fits.n_joints:
        fits = rows.loaded(reading)
        best = _best(fits, reading)
        if best is None:
            break
        # a more extensive exchange replaces the previous one
        found = [c for c in found if not (best.kind == c.kind and "order" in c.kind)]
        both = ("joint_sign", "zero") if best.kind == "convention" else (best.kind,)
        if best.kind == "zero":
            fitted += best.joints
            best = replace(best, reading=_sharpened(fits, best.reading, fitted))
        found += [replace(best, kind=kind) for kind in both]
        if best.rival_gains:
            break  # nothing is read on top of what may be a load
        reading = best.reading
    return found


def _best(fits: Fits, reading: Reading) -> Change | None:
    """The alternative that gains most and that identified bodies confirm.

    Few rounds select the alternatives to be examined in detail.
    """
    here, few = fits.nominal(reading), fits.thinned(max(FEWEST_ROWS, MOST_ROWS // fits.n_joints))
    screened = _screened(few, reading, _alternatives(fits, reading, here))
    judged = []
    for rough_gain, change in _distinct(screened)[:FINALISTS]:
        if rough_gain > 0:
            if change.kind == "zero":
                change = _refined(fits, change)
            there = fits.nominal(change.reading)
            gain = float(there.margin(here).sum())
            drop = _drop(here, there)
            judged.append(replace(change, gain=gain, untuned=rough_gain, drop=drop))
    judged = [
        c
        for c in judged
        if c.gain >= WEAKEST and c.drop >= LEAST_DROP and _all_gain(fits, c, reading, here)
    ]
    judged.sort(key=lambda c: -round(c.gain, 1))
    most = max((c.gain for c in judged), default=0.0)
    absent = judged[0] if judged and judged[0].kind == "no_gravity" else None
    if absent is not None and absent.gain >= LEAST:
        if _without_gravity(fits, reading, here):
            # identified bodies compensate the rest of it
            restored, kept = _restored_gain(fits, absent.reading, reading)
            others = [c for c in judged if c.kind == "gravity" and c.gain > absent.gain - TIED]
            if others and restored < LEAST:  # no torque depends on gravity along it
                return _by_offsets(fits, absent, others)
            # if bodies of any mass explain the torque with gravity, the stated ones are wrong
            if kept > -TIED:
                return replace(absent, restorable=restored > LEAST)
            judged = [c for c in judged if c.kind != "gravity"]
    if (judged or fits.loads) and reading.gravity is None:
        restored_change = _restored(fits, reading, here)
        if restored_change is not None:
            return restored_change

    @cache
    def fought(other: Reading, joints: tuple[int, ...]) -> Duel:
        return fight(fits, reading, other, joints)

    accepted = []
    for change in judged:
        if change.kind == "no_gravity":
            continue
        before = fits.identified(reading)
        confirmed = float(fits.identified(change.reading).margin(before).sum())
        # stated bodies that are a little wrong make residuals alike over seconds, so that a short
        # log gains little by them whatever is read wrongly; identified ones then decide
        strong = change.gain >= LEAST or (confirmed >= DECISIVE and change.drop >= HALF)
        if change.gain < BESIDE * most and confirmed < DECISIVE:
            continue  # something else explains far more
        plain = change.gain >= OVERWHELMING and change.drop >= HALF
        # a zero of a last joint is equivalent to another body, which identified bodies may be
        zero = change.kind == "zero" and _is_all(fits, change, before)
        plain &= NEEDED[change.kind] < 0 or zero
        if strong and (plain or confirmed >= NEEDED[change.kind]):
            alike = [c for c in judged if c.kind != change.kind and _same_place(c, change)]
            within = max(TIED, RIVALS * change.gain)
            alike = [c for c in alike if change.gain - c.gain < within or _but_for_angle(c, change)]
            rivals = tuple(dict.fromkeys(c.kind for c in alike))
            accepted.append(replace(change, confirmed=confirmed, rivals=rivals))
    while accepted:
        best = _turned(fits, _first(accepted), accepted)
        most = int(np.argmax(fits.nominal(best.reading).margin(here)))
        held = _against_effects(fought(best.reading, best.joints or (most,)), best)
        if held is not None:
            return held
        accepted.remove(best)
    if reading != Reading():
        return None  # what is read anew already, and bodies, need no other zero
    turned = [c for c in judged if c.kind == "zero" and c.gain >= max(OVERWHELMING, most)]
    for change in turned:
        angle = abs(change.reading.zero[-1][1])
        if change.drop >= MOSTLY and angle >= NOTED:
            return _or_bodies(fought(change.reading, change.joints), change)
    return None


def _screened(few: Fits, reading: Reading, changes: Iterator[Change]) -> list[tuple[float, Change]]:
    """Changes with their gains in few rows.

    Loads need columns of every motion, so that beside them only the best angles are tried.
    """
    tried = list(changes)
    for rows in (few.with_loads(False), few)[not few.loads :]:
        rough = rows.nominal(reading, SCREENED)
        gains = [float(rows.nominal(c.reading, SCREENED).margin(rough).sum()) for c in tried]
        if rows is few:
            break
        angles: dict[tuple[str, tuple[int, ...]], int] = {}
        kept = []
        for _, change in sorted(zip(gains, tried, strict=True), key=lambda pair: -pair[0]):
            place = (change.kind, change.joints)
            angles[place] = angles.get(place, 0) + 1
            if change.kind not in ("zero", "convention") or angles[place] <= ANGLES:
                kept.append(change)
        tried = kept
    return list(zip(gains, tried, strict=True))


def _by_offsets(fits: Fits, absent: Change, others: Sequence[Change]) -> Change:
    """No gravity, or gravity along a direction in which it only changes offsets.

    The weight of a slider is a constant torque, which the offset of a fit replaces. The smaller
    offset is likelier, if it is less than half of the other one, and that one exceeds the residual.
    """
    best = min(others, key=lambda change: fits.offset(change.reading))
    without = fits.offset(absent.reading)
    if without > 1.0 and fits.offset(best.reading) < 0.5 * without:
        return replace(best, rivals=("no_gravity",))
    return replace(absent, rivals=("gravity",))


def _distinct(screened: list[tuple[float, Change]]) -> list[tuple[float, Change]]:
    """Changes with their gains, the largest first, with one angle for every joint.

    A joint sign with a zero is two changes, and must gain more than either of them.
    """
    best: dict[tuple[str, tuple[int, ...]], float] = {}
    kept = []
    for gain, change in sorted(screened, key=lambda pair: -pair[0]):
        place = (change.kind, change.joints)
        if change.kind not in ("zero", "convention") or place not in best:
            kept.append((gain, change))
        best.setdefault(place, gain)

    def alone(change: Change) -> float:
        return max(best.get((kind, change.joints), 0.0) for kind in ("joint_sign", "zero"))

    return [
        (gain, change)
        for gain, change in kept
        if change.kind != "convention" or gain > alone(change) + max(TIED, RIVALS * gain)
    ]


def _first(accepted: list[Change]) -> Change:
    """The change that gains most; a fixed one has priority over a free angle."""
    # both are likelihoods of the same torque; reversing all of it changes nothing identified
    first = max(accepted, key=lambda c: c.gain + c.confirmed)
    close = max(TIED, ALIKE * first.gain)
    tied = [
        c
        for c in accepted
        if c.gain + c.confirmed >= first.gain + first.confirmed - close or _but_for_angle(c, first)
    ]
    if first.kind == "motion_sign":
        # friction and inertia of a last joint reverse alike with either; the motion is felt by
        # other joints as well, which do not decide
        sign = (c for c in tied if c.kind == "torque_sign" and c.joints == first.joints)
        return next(sign, first)
    # an angle that is free fits at least as well as one that is not, and a direction is two angles
    angles = min(map(_free_angles, tied))
    return next(c for c in (first, *tied) if _free_angles(c) == angles)


def _turned(fits: Fits, first: Change, accepted: list[Change]) -> Change:
    """The change that comes first, or a zero in place of gravity along an axis.

    Both are alike to the stated bodies, but identified ones determine the angle of the joint.
    """
    for zero in accepted:
        if _but_for_angle(first, zero):
            sharp = _sharpened(fits, zero.reading, zero.joints)
            there, here = (fits.identified(reading) for reading in (sharp, first.reading))
            if float(there.margin(here).sum()) >= DECISIVE:
                return replace(zero, reading=sharp)
    return first


def _free_angles(change: Change) -> int:
    """Number of angles of a change that were fitted."""
    if change.kind == "gravity":
        return 0 if _upright(change.reading.gravity) else 2
    return int(change.kind == "zero")


def _but_for_angle(change: Change, zero: Change) -> bool:
    """Whether a change gains as much as a zero before its angle is fitted.

    A robot upside down is equivalent to half a turn of a first joint with a horizontal axis.
    """
    if zero.kind != "zero" or change.kind != "gravity":
        return False
    return _upright(change.reading.gravity) and change.untuned > zero.untuned - TIED


def is_oblique(gravity: Sequence[float] | None) -> bool:
    """Whether there is gravity, but not along an axis of the base."""
    return gravity is not None and bool(np.any(gravity)) and not _upright(gravity)


def _upright(gravity: Sequence[float] | None) -> bool:
    """Whether gravity is along an axis of the base."""
    return gravity is not None and float(np.max(np.abs(gravity))) > UPRIGHT * GRAVITY


def _against_effects(duel: Duel, change: Change) -> Change | None:
    """The change with its alternatives; None if an effect, or other bodies, explain it."""
    if min(duel.gain, duel.beside) >= LEAST and duel.beside >= BESIDE * duel.gain:
        return change
    if duel.gain < LEAST and duel.rival < LEAST and duel.gain > 0:
        return replace(change, other=OTHER_BODIES)
    if duel.gain < LEAST or max(duel.beside, duel.gain - duel.rival) <= 0:
        return None
    return replace(change, other=duel.effect)


def _or_bodies(duel: Duel, zero: Change) -> Change | None:
    """A zero that explains nearly all, beside other bodies or a load, which do so as well.

    They turn the direction of the weight on a last joint as another zero does.
    """
    other = duel.effect or OTHER_BODIES
    return replace(zero, other=other, rival_gains=True) if duel.gain > 0 else None


def _refined(fits: Fits, change: Change) -> Change:
    """The zero of a position at which the robot explains the torque best, near one that was tried.

    By halving steps, since the likelihood has one maximum within half a step.
    """

    def likelihood(reading: Reading) -> float:
        return float(fits.nominal(reading, SCREENED).likelihood.sum())

    return _climbed(change, likelihood, 22.5)


def _sharpened(fits: Fits, reading: Reading, joints: Sequence[int]) -> Reading:
    """Zeros of some joints at which identified bodies fit best: stated ones are not exact.

    Each was found while others were still wrong, so several are refined in turn. One that bodies
    could replace is left as it is.
    """
    here = fits.identified(reading)
    felt = []
    for joint in joints:
        without = replace(reading, zero=tuple(z for z in reading.zero if z[0] != joint))
        if float(here.margin(fits.identified(without)).sum()) >= NEEDED["zero"]:
            felt.append(joint)
    for joint in (SWEEPS if len(felt) > 1 else 1) * felt:
        now = reading

        def likelihood(angle: float, joint: int = joint, now: Reading = now) -> float:
            return float(fits.identified(_with_zero(now, joint, angle)).likelihood.sum())

        reading = _with_zero(now, joint, peak(likelihood, dict(now.zero)[joint], NEAR))
    return reading


def _with_zero(reading: Reading, joint: int, angle: float) -> Reading:
    """A reading with another zero of a joint, within half a turn."""
    turned = float(np.angle(np.exp(1j * angle)))
    zero = tuple((j, turned if j == joint else x) for j, x in reading.zero)
    return replace(reading, zero=zero)


def _climbed(change: Change, likelihood: Callable[[Reading], float], degrees: float) -> Change:
    """Angle of the last zero at the maximum of a likelihood, by halving steps."""
    *others, (joint, angle) = change.reading.zero

    def reading(angle: float) -> Reading:
        return replace(change.reading, zero=(*others, (joint, float(angle))))

    best, step = likelihood(reading(angle)), np.deg2rad(degrees)
    while step > np.deg2rad(0.25):
        for other in (angle - step, angle + step):
            if (value := likelihood(reading(other))) > best:
                angle, best = other, value
                break
        else:
            step /= 2
    return replace(change, reading=reading(angle))


#: Share of a zero's gain that identified bodies may still gain over it on its joint.
UNEXPLAINED = 0.1


def _is_all(fits: Fits, change: Change, identified: Outcome) -> bool:
    """Whether stated bodies with another zero are as good as identified bodies without it.

    Bodies that are not those stated look like another zero of their joint, but leave more.
    """
    (joint,) = change.joints
    column, _ = fits.torque_column(change.reading, joint)
    left = float(identified.margin(fits.nominal(change.reading))[column])
    return left <= UNEXPLAINED * change.gain


def _same_place(one: Change, other: Change) -> bool:
    """Whether two changes are rivals: of the same joints, or a zero and gravity."""
    kinds = {one.kind, other.kind}
    return one.joints == other.joints or kinds == {"zero", "gravity"}


def _all_gain(fits: Fits, change: Change, reading: Reading, here: Outcome) -> bool:
    """Whether the gain is due to the columns that the joints now get."""
    if "order" not in change.kind:
        return True
    there = fits.nominal(change.reading)
    moved = [
        column
        for j in range(fits.n_joints)
        if _columns(fits, change.reading, j) != _columns(fits, reading, j)
        and fits.usable(column := fits.torque_column(change.reading, j)[0])
    ]
    gains = there.margin(here)[moved]
    return bool(gains.sum() >= LEAST and np.all(gains > -LEAST))


def _columns(fits: Fits, reading: Reading, joint: int) -> tuple[int, int]:
    """Columns of the motion and of the torque of a joint."""
    motion = joint if reading.order is None else reading.order[joint]
    return motion, fits.torque_column(reading, joint)[0]


def _drop(before: Outcome, after: Outcome) -> float:
    shares = 1 - after.scale / before.scale
    return float(shares[int(np.argmax(after.margin(before)))])


def _alternatives(fits: Fits, reading: Reading, here: Outcome) -> Iterator[Change]:
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
    """Orders of the columns: two exchanged, by name, backwards, one further."""
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
        for order in tried:
            wanted = None if order == list(range(n)) else tuple(map(int, order))
            moved = tuple(j for j in range(n) if order[j] != j)
            if wanted is not None:
                changed: Any = {name: wanted}
                yield Change(name, moved, replace(reading, **changed))
            if name == "order" and wanted is not None:  # the same motion, with the torques as now
                own = tuple(order.index(fits.torque_column(reading, j)[0]) for j in range(n))
                yield Change(
                    "motion_order", moved, replace(reading, order=wanted, torque_order=own)
                )


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


def _without_gravity(fits: Fits, reading: Reading, here: Outcome) -> bool:
    """Whether the gravity that fits best is only a small part of the robot's own."""
    best, own = fitted_gravity(fits, reading, here), np.asarray(fits.robot.gravity, dtype=float)
    return best is not None and abs(float(best @ own / (own @ own))) < LEFT_OVER


def _restored(fits: Fits, reading: Reading, here: Outcome) -> Change | None:
    """Gravity that was subtracted with the stated bodies, which are not those of the robot.

    A rest of gravity is left, in any direction, and looks like other changes. But only with the
    subtracted torque are there bodies that explain all of it.
    """
    own = np.asarray(fits.robot.gravity, dtype=float)
    best = fitted_gravity(fits, reading, here)
    if best is None or not own.any() or abs(float(best @ own / (own @ own))) > LEFT_OVER:
        return None
    without = replace(reading, gravity=(0.0, 0.0, 0.0))
    restored, kept = _restored_gain(fits, without, reading)
    if min(restored, kept) < DECISIVE:
        return None
    whole = fits.with_gravity(without).identified(replace(without, gravity=None))
    drop = _drop(fits.identified(reading), whole)
    return Change("no_gravity", (), without, kept, kept, drop=drop, restorable=True)


def _restored_gain(fits: Fits, without: Reading, reading: Reading) -> tuple[float, float]:
    """Log-likelihood gain if gravity was subtracted with stated bodies, not the robot's own.

    Also returns the gain of the likelier of both over the unchanged log, with bodies of any mass.
    """
    whole = fits.with_gravity(without).identified(replace(without, gravity=None))
    absent, present = fits.identified(without), fits.identified(reading)
    restored = float(whole.margin(absent).sum())
    held = (whole if restored > 0 else absent).margin(present)
    return restored, float(held.sum())


def fitted_gravity(fits: Fits, reading: Reading, here: Outcome) -> Array | None:
    """Gravity that explains the torque best with the bodies of the description, m/s^2."""
    s = fits.motion(reading)
    still, pulls = fits.gravity_parts(reading)
    blocks, targets = [], []
    for j in range(fits.n_joints):
        column, sign = fits.torque_column(reading, j)
        use = fits.moving[:, column]
        if not fits.usable(column):
            continue
        y = sign * fits.average(fits.torque[:, column])[use] - still[use, j]
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
        spread = 1.4826 * float(np.median(np.abs(r))) + 1e-12
        weight = 1 / np.maximum(1.0, np.abs(r) / (1.5 * spread))
    return np.asarray(gravity)
