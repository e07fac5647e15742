# SPDX-License-Identifier: BSD-3-Clause
"""Search for the reading of a log that explains the torque best."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from skidyn.measurement._changes import (
    Change,
    alternatives,
    fitted_gravity,
    is_upright,
    tilt_gain,
)
from skidyn.measurement._duel import Duel, fight
from skidyn.measurement._fits import Fits
from skidyn.measurement._outcome import Outcome
from skidyn.measurement._peak import climb, peak
from skidyn.measurement._reading import Reading
from skidyn.measurement._robust import FREEDOM

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
#: Angle below which a zero of a last joint may as well be the direction of its centre of mass, rad.
TURNED = np.deg2rad(30)
#: Changes of one joint whose gains differ by less than this, or this share, cannot be separated.
TIED, ALIKE = 3.0, 0.05
#: Share of the gain within which another kind of change of the same joints is equally possible.
RIVALS = 0.2
#: Kinds of changes that turn gravity relative to links.
TURNS_GRAVITY = ("zero", "gravity")
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
#: Distance of the angles of a parabola through the likelihood of a zero, rad, and how often several
#: zeros are refined in turn.
NEAR, SWEEPS = np.deg2rad(1.0), 3
#: Alternative of a reading that gains little over bodies near those of the description.
OTHER_BODIES = "bodies that differ from the description"
#: Rounds of the fits for ranking, and number of changes that are examined in detail.
SCREENED, FINALISTS = 1, 12
#: Fewest recordings of which a share may contradict a zero, and this share.
FEW, MOST_AGAINST = 3, 0.3
#: Angles of every joint that are tried beside loads.
ANGLES = 3


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
    """The alternative that gains most and that identified bodies confirm."""
    here = fits.nominal(reading)
    judged = _judged(fits, reading, here)
    most = max((c.gain for c in judged), default=0.0)
    absent = judged[0] if judged and judged[0].kind == "no_gravity" else None
    if absent is not None and absent.gain >= LEAST and _without_gravity(fits, reading, here):
        found = _absent_gravity(fits, reading, absent, judged)
        if found is not None:
            return found
        judged = [c for c in judged if c.kind != "gravity"]
    if (judged or fits.loads) and reading.gravity is None:
        restored_change = _restored(fits, reading, here)
        if restored_change is not None and not _explains_more(
            fits, reading, judged, restored_change
        ):
            return restored_change

    @cache
    def fought(other: Reading, joints: tuple[int, ...]) -> Duel:
        return fight(fits, reading, other, joints)

    accepted = _accepted(fits, reading, judged, most)
    # what a zero beside other bodies must gain: most of all changes, if none of them is confirmed
    least = OVERWHELMING if accepted else max(OVERWHELMING, most)
    while accepted:
        best = _turned(fits, _first(accepted), accepted)
        worst = int(np.argmax(fits.nominal(best.reading).margin(here)))
        held = _against_effects(fought(best.reading, best.joints or (worst,)), best)
        held = held and _or_another_last_body(fits, held)
        if held is not None and not _is_body(held):
            return held
        accepted.remove(best)
    if reading != Reading():
        return None  # what is read anew already, and bodies, need no other zero
    for change in judged:
        if change.kind != "zero" or change.gain < least or change.drop < MOSTLY:
            continue
        if abs(change.reading.zero[-1][1]) >= NOTED:
            return _or_bodies(fought(change.reading, change.joints), change)
    return None


def _judged(fits: Fits, reading: Reading, here: Outcome) -> list[Change]:
    """Alternatives that gain with the stated bodies, the strongest first.

    Few rounds select those that are examined in detail.
    """
    screened = _screened(fits.few, reading, alternatives(fits, reading, here))
    judged = []
    for rough_gain, change in _distinct(screened)[:FINALISTS]:
        if rough_gain > 0:
            if change.kind == "zero":
                change = _refined(fits, change)
            there = fits.nominal(change.reading)
            gain = there.gained_over(here)
            drop = _drop(here, there)
            judged.append(replace(change, gain=gain, untuned=rough_gain, drop=drop))
    judged = [
        c
        for c in judged
        if c.gain >= WEAKEST and c.drop >= LEAST_DROP and _all_gain(fits, c, reading, here)
    ]
    judged = [c for c in judged if c.kind != "zero" or _in_most_recordings(fits, c, here)]
    judged = _but_for_tilt(fits, reading, judged)
    return sorted(judged, key=lambda c: -round(c.gain, 1))


def _in_most_recordings(fits: Fits, zero: Change, here: Outcome) -> bool:
    """Whether a zero explains most recordings better, as one of the encoder does.

    A base that is tilted in some recordings, or a load of these, is like a zero in them alone.
    """
    there = fits.nominal(zero.reading)
    names, place = np.unique(fits.recording, return_inverse=True)
    gains = np.zeros(len(names))
    for k in set(here.fits) & set(there.fits):
        use, scale = fits.moving[:, k], there.scale[k]
        size = [np.log1p((o.residual[k] / scale) ** 2 / FREEDOM) for o in (here, there)]
        gains += np.bincount(place[use], size[0] - size[1], len(names))
    return len(names) < FEW or bool(np.mean(gains < 0) < MOST_AGAINST)


def _but_for_tilt(fits: Fits, reading: Reading, judged: list[Change]) -> list[Change]:
    """Changes without zeros and other directions of gravity over which a small tilt gains.

    The zero of a first joint that is not quite upright turns gravity as a tilt of the base does. A
    tilt is no other reading but an effect, so that it is not among the changes.
    """
    if all(change.kind not in TURNS_GRAVITY for change in judged):
        return judged
    gain = tilt_gain(fits, reading)
    # a zero of a joint with a horizontal axis is the same as a tilt where nothing turns it
    return [
        c
        for c in judged
        if c.kind not in TURNS_GRAVITY or gain - c.gain <= max(TIED, ALIKE * c.gain)
    ]


def _absent_gravity(
    fits: Fits, reading: Reading, absent: Change, judged: Sequence[Change]
) -> Change | None:
    """No gravity, or the direction in which no torque depends on it; None if there is gravity."""
    # identified bodies compensate the rest of it
    restored, kept = _restored_gain(fits, absent.reading, reading)
    others = [c for c in judged if c.kind == "gravity" and c.gain > absent.gain - TIED]
    if others and restored < LEAST:  # no torque depends on gravity along it
        return _by_offsets(fits, absent, others)
    # if bodies of any mass explain the torque with gravity, the stated ones are wrong
    return replace(absent, restorable=restored > LEAST) if kept > -TIED else None


def _accepted(fits: Fits, reading: Reading, judged: Sequence[Change], most: float) -> list[Change]:
    """Changes of columns that identified bodies confirm, with what they gain by them and rivals."""
    accepted = []
    for change in judged:
        if change.kind == "no_gravity":
            continue
        before = fits.identified(reading)
        confirmed = fits.identified(change.reading).gained_over(before)
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
            if confirmed >= DECISIVE:  # bodies of any mass may tell them apart, too
                least = confirmed - max(DECISIVE, RIVALS * confirmed)
                alike = [
                    c for c in alike if fits.identified(c.reading).gained_over(before) >= least
                ]
            rivals = tuple(dict.fromkeys(c.kind for c in alike))
            accepted.append(replace(change, confirmed=confirmed, rivals=rivals))
    return accepted


def _screened(few: Fits, reading: Reading, changes: Iterator[Change]) -> list[tuple[float, Change]]:
    """Changes with their gains in few rows.

    Loads need columns of every motion, so that beside them only the best angles are tried.
    """
    tried = list(changes)
    for rows in (few.with_loads(False), few)[not few.loads :]:
        rough = rows.nominal(reading, SCREENED)
        gains = [rows.nominal(c.reading, SCREENED).gained_over(rough) for c in tried]
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
            if there.gained_over(here) >= DECISIVE:
                return replace(zero, reading=sharp)
    return first


def _free_angles(change: Change) -> int:
    """Number of angles of a change that were fitted."""
    if change.kind == "gravity":
        return 0 if is_upright(change.reading.gravity) else 2
    return int(change.kind == "zero")


def _but_for_angle(change: Change, zero: Change) -> bool:
    """Whether a change gains as much as a zero before its angle is fitted.

    A robot upside down is equivalent to half a turn of a first joint with a horizontal axis.
    """
    if zero.kind != "zero" or change.kind != "gravity":
        return False
    return is_upright(change.reading.gravity) and change.untuned > zero.untuned - TIED


def _against_effects(duel: Duel, change: Change) -> Change | None:
    """The change with its alternatives; None if an effect, or other bodies, explain it."""
    if min(duel.gain, duel.beside) >= LEAST and duel.beside >= BESIDE * duel.gain:
        return change
    if duel.gain < LEAST and duel.rival < LEAST and duel.gain > 0:
        return replace(change, other=OTHER_BODIES)
    if duel.gain < LEAST or max(duel.beside, duel.gain - duel.rival) <= 0:
        return None
    return replace(change, other=duel.effect)


def _or_another_last_body(fits: Fits, change: Change) -> Change:
    """The change, and the body of a last joint in place of a small angle of its zero.

    Both turn the weight that the joint carries, and nothing beyond the joint separates them, while
    the centre of mass of a body with its cables and tool is often off by a part of its distance.
    """
    parents = fits.robot.tree.parents
    if change.kind != "zero" or change.other or len(parents) != fits.n_joints:
        return change
    angles = dict(change.reading.zero)
    own = [abs(angles[j]) < TURNED and not np.any(np.equal(parents, j)) for j in change.joints]
    return replace(change, other=OTHER_BODIES) if all(own) else change


def _is_body(change: Change) -> bool:
    """Whether a zero is as small as the usual error of the direction of a weight."""
    if change.kind != "zero" or change.other != OTHER_BODIES:
        return False
    return bool(abs(change.reading.zero[-1][1]) < NOTED)


def _or_bodies(duel: Duel, zero: Change) -> Change | None:
    """A zero that explains nearly all, beside other bodies or a load, which do so as well.

    They turn the direction of the weight on a last joint as another zero does.
    """
    other = duel.effect or OTHER_BODIES
    return replace(zero, other=other, rival_gains=True) if duel.gain > 0 else None


def _refined(fits: Fits, change: Change) -> Change:
    """The zero of a position at which the robot explains the torque best, near one that was tried.

    The likelihood has one maximum within half the distance of those that are tried.
    """
    *others, (joint, angle) = change.reading.zero

    def read(angle: float) -> Reading:
        return replace(change.reading, zero=(*others, (joint, float(angle))))

    def likelihood(angle: float) -> float:
        return float(fits.nominal(read(angle), SCREENED).likelihood.sum())

    angle, _ = climb(likelihood, angle, np.deg2rad(22.5), np.deg2rad(0.25))
    return replace(change, reading=read(angle))


def _sharpened(fits: Fits, reading: Reading, joints: Sequence[int]) -> Reading:
    """Zeros of some joints at which identified bodies fit best: stated ones are not exact.

    Each was found while others were still wrong, so several are refined in turn. One that bodies
    could replace is left as it is.
    """
    here = fits.identified(reading)
    felt = []
    for joint in joints:
        without = replace(reading, zero=tuple(z for z in reading.zero if z[0] != joint))
        if here.gained_over(fits.identified(without)) >= NEEDED["zero"]:
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


#: Share of a zero's gain that identified bodies may still gain over it on its joint.
UNEXPLAINED = 0.1


def _is_all(fits: Fits, change: Change, identified: Outcome) -> bool:
    """Whether stated bodies with another zero are as good as identified bodies without it.

    Bodies that are not those stated look like another zero of their joint, but leave more.
    """
    (joint,) = change.joints
    column, _ = change.reading.torque_column(joint)
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
        if _columns(change.reading, j) != _columns(reading, j)
        and fits.usable(column := change.reading.torque_column(j)[0])
    ]
    gains = there.margin(here)[moved]
    return bool(gains.sum() >= LEAST and np.all(gains > -LEAST))


def _columns(reading: Reading, joint: int) -> tuple[int, int]:
    """Columns of the motion and of the torque of a joint."""
    motion = joint if reading.order is None else reading.order[joint]
    return motion, reading.torque_column(joint)[0]


def _drop(before: Outcome, after: Outcome) -> float:
    shares = 1 - after.scale / before.scale
    return float(shares[int(np.argmax(after.margin(before)))])


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


def _explains_more(
    fits: Fits, reading: Reading, judged: Sequence[Change], restored: Change
) -> bool:
    """Whether a change of columns explains more than gravity that was subtracted.

    It does so with stated bodies as well as with identified ones.
    """
    now = fits.identified(reading)
    return any(
        fits.identified(change.reading).gained_over(now) > restored.confirmed
        for change in judged
        if change.kind not in ("gravity", "no_gravity") and change.gain > restored.gain
    )


def _restored_gain(fits: Fits, without: Reading, reading: Reading) -> tuple[float, float]:
    """Log-likelihood gain if gravity was subtracted with stated bodies, not the robot's own.

    Also returns the gain of the likelier of both over the unchanged log, with bodies of any mass.
    """
    whole = fits.with_gravity(without).identified(replace(without, gravity=None))
    absent, present = fits.identified(without), fits.identified(reading)
    restored = whole.gained_over(absent)
    return restored, (whole if restored > 0 else absent).gained_over(present)
