# SPDX-License-Identifier: BSD-3-Clause
"""Checks that fit the robot: sign, order, gravity, zero, scale and delay of the recording."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from skidyn._signals import Array
from skidyn._text import listed
from skidyn.measurement._changes import Change, is_oblique, tilted
from skidyn.measurement._check import Check
from skidyn.measurement._copies import copied_columns
from skidyn.measurement._fits import Fits, friction
from skidyn.measurement._gains import USUAL, known_gains
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._measures import reversals
from skidyn.measurement._near_bodies import NearBodies, left_by_near_bodies
from skidyn.measurement._reading import Reading
from skidyn.measurement._readings import DECISIVE, HALF, find_changes
from skidyn.measurement._robust import fit_admissible
from skidyn.measurement._suspicion import Certainty, Suspicion, remedy_of

#: Share of the largest torque below zero that a magnitude may reach, and reversals it must see.
BELOW, TURNS = 0.01, 4
#: Share of zeros from which a torque is not a magnitude but only its one direction.
CUT = 0.05
#: Share of the largest speed above which the direction of motion is known, fewest rows in which
#: bodies oppose it by this multiple of their spread, share of rows in which a torque that has the
#: sign of the velocity does not, and its least correlation with these bodies there.
SLOW, FEWEST_AGAINST, STRONGLY, ALWAYS, GROWS = 0.1, 50, 0.5, 0.98, 0.5
#: Least mean torque of these bodies there, as a share of the mean magnitude of the torque.
MATERIAL = 0.5
#: Log-likelihood that the magnitude must gain over the torque itself, and to be sure.
LEAST, SURE = 15.0, 40.0


class UnsignedTorque(Check):
    """Magnitudes in place of torques, as for currents reported by servos."""

    name = "unsigned_torque"
    of_sensor = True
    suspects = "torque or current without its sign"
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        cut = measurement.clipped
        if cut:
            names = measurement.joints(cut)
            shares = ", ".join(f"{np.mean(measurement.torque[:, k] == 0):.0%}" for k in cut)
            yield self.suspicion(
                f"the torque of {names} is clipped at zero",
                f"it has only one sign, and {shares} of it are zero although the joint moves: "
                "values of the opposite sign were lost",
                "certain",
                cut,
            )
        unsigned, gains = unsigned_columns(measurement)
        if not unsigned:
            along = signed_by_velocity(measurement)
            if along:
                yield self.suspicion(
                    f"the torque of {measurement.joints(along)} has the sign of the velocity",
                    "it never opposes the motion, and grows where the rigid-body torque does: a "
                    "magnitude, such as an effective current, was given the sign of the velocity",
                    "suspected",
                    along,
                )
            return
        moving = [k for k, moves in enumerate(measurement.excited) if moves]
        every = len(unsigned) >= 3 and set(moving) <= set(unsigned)
        names = measurement.joints(unsigned)
        evidence = (
            f"of {measurement.n_samples} rows none is negative although the joints reverse "
            f"{sum(_turns(measurement, k) for k in unsigned)} times"
        )
        if gains:
            evidence += (
                "; the magnitude of the rigid-body torque explains it better by "
                f"{max(gains.values()):.0f} (log-likelihood)"
            )
        yield self.suspicion(
            f"the torque of {names} has no sign",
            evidence,
            "certain" if every or max(gains.values(), default=0) > SURE else "suspected",
            unsigned,
            remedy_of("torque_sign", "command"),
        )


def _cut(torque: Array) -> float:
    """Share of zeros beyond that of a coarse magnitude, which equals that of its first step."""
    least = float(torque[torque > 0].min(initial=np.inf))
    first = float(np.mean((torque > 0) & (torque < 1.5 * least)))
    return max(0.0, float(np.mean(torque == 0)) - 3 * first)


def cut_columns(measurement: Measurement) -> list[int]:
    """Columns of the torque of which one sign was lost: zero in its place."""
    found, measured = [], ~measurement.idle
    for k in range(measurement.n_joints):
        torque = measurement.torque[measured, k]
        speed = np.abs(measurement.signals.dq[measured, k])
        rows = speed > 0.02 * speed.max(initial=0.0)
        one_sided = rows.any() and 0 in (torque.min(), torque.max()) and np.ptp(torque) > 0
        if one_sided and _turns(measurement, k) >= TURNS:
            values = np.abs(torque[rows])
            # a joint that is not driven has zeros alone
            if CUT < _cut(values) < 0.98 and len(np.unique(values)) > 50:
                found.append(k)
    moving = {k for k, moves in enumerate(measurement.excited) if moves}
    others = [k for k in sorted(moving - set(found)) if measurement.torque[:, k].min() >= 0]
    # among magnitudes, zeros belong to a joint at rest
    return [] if len(others) >= 2 and moving <= {*found, *others} else found


def _turns(measurement: Measurement, k: int) -> int:
    return reversals(measurement.signals.dq[:, k], measurement.signals.segments)


def unsigned_columns(measurement: Measurement) -> tuple[list[int], dict[int, float]]:
    """Columns of the torque that contain magnitudes, and their log-likelihood gains.

    A single column is found by a fit of the magnitude of the robot's torque; if no column of three
    or more is ever negative although all joints reverse, none has a sign.
    """
    return measurement.once("unsigned", lambda: _unsigned(measurement))


def _unsigned(measurement: Measurement) -> tuple[list[int], dict[int, float]]:
    torque = measurement.torque
    cut = measurement.clipped
    one_sided = [
        k
        for k in range(measurement.n_joints)
        if k not in cut
        and np.ptp(torque[:, k]) > 0
        and torque[:, k].min() >= -BELOW * torque[:, k].max()
        and _turns(measurement, k) >= TURNS
    ]
    moving = [k for k, moves in enumerate(measurement.excited) if moves]
    gains = {}
    if measurement.readable and measurement.fits is not None:
        for k in one_sided:
            gain = _magnitude_gain(measurement.fits, k)
            if gain > LEAST:
                gains[k] = gain
    enough = len(one_sided) >= 3 or max(gains.values(), default=0.0) > SURE
    if enough and set(moving) <= set(one_sided):
        return one_sided, gains  # a logger of magnitudes records no sign in any column
    return sorted(gains), gains  # gravity alone may give one a single sign


def signed_by_velocity(measurement: Measurement) -> list[int]:
    """Columns of the torque, from 0, that never oppose the motion, and grow where bodies do.

    The torque of a joint with much friction does not oppose it either, but becomes smaller there.
    """
    robot, signals = measurement.robot, measurement.signals
    if robot is None or not measurement.readable:
        return []
    fast = np.abs(signals.dq) > SLOW * np.abs(signals.dq).max(axis=0)
    along = [
        k
        for k in np.flatnonzero(measurement.excited).tolist()
        if np.mean((measurement.torque[:, k] * signals.dq[:, k])[fast[:, k]] > 0) > ALWAYS
    ]
    if not along:
        return []
    found = []
    bodies = robot.inverse_dynamics(signals.q, signals.dq, signals.ddq)
    for k in along:
        own = bodies[:, k] * np.sign(signals.dq[:, k])
        against = fast[:, k] & (own < -STRONGLY * np.std(bodies[:, k]))
        if against.sum() < FEWEST_AGAINST:
            continue
        size, opposing = np.abs(measurement.torque[against, k]), -own[against]
        if np.mean(opposing) < MATERIAL * np.mean(size):
            continue  # that of friction, whatever the bodies do
        if np.ptp(size) and np.ptp(opposing) and np.corrcoef(size, opposing)[0, 1] > GROWS:
            found.append(k)
    return found


def _magnitude_gain(fits: Fits, k: int) -> float:
    """Log-likelihood gain of the magnitude of the robot's torque over the torque itself."""
    if not fits.usable(k):
        return 0.0
    s = Reading().motion(fits.signals)
    own = fits.robot.inverse_dynamics(s.q, s.dq, s.ddq)[:, k]
    y, use = fits.mean_torque(k)
    y, columns = y[use], fits.average(np.column_stack([own, friction(s, k)]))[use]
    # a torque of the opposite sign is one-sided too where gravity is
    plain = max(fit_admissible(columns, sign * y).likelihood for sign in (1.0, -1.0))
    best = -np.inf
    size = float(np.abs(columns[:, 0]).mean()) + 1e-12
    for share in (0.0, 0.3, 3.0):  # amounts of friction before any fit
        guess = columns[:, 0] + share * size * columns[:, 2]
        for _ in range(8):
            sign = np.where(guess < 0, -1.0, 1.0)
            fit = fit_admissible(columns, sign * y)
            guess = sign * y - fit.residual
        best = max(best, fit.likelihood)
    return best - plain if np.isfinite(best) else 0.0


#: Least share of the residual torque that some corrections must remove to be certain: a missing
#: offset, spring or coupling looks like them.
MOSTLY, LIKE_EFFECTS = 0.8, ("zero", "no_gravity")


class Columns(Check):
    """Signs, order and zero of joints, and gravity, that differ from those of the robot."""

    name = "reading"
    suspects = (
        "the sign of single joints, their order, the zero of a position, angles relative to the "
        "base, the direction of gravity, or torque from which gravity was removed"
    )
    stage = 1

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        fits = measurement.fits
        if fits is None or measurement.odd or measurement.mixed:
            return  # contradictory recordings, and mixed torques, have no common reading
        changes = asked_changes(measurement, fits)
        orders = [change for change in changes if change.kind in ORDERS]
        for kind in dict.fromkeys(change.kind for change in changes):
            alike = [change for change in changes if change.kind == kind]
            if kind in ORDERS and len(alike) < len(orders):
                if kind != orders[0].kind:
                    continue  # one order after another is one order of each quantity
                alike = orders
            told = self._told(measurement, kind, alike, changes[-1].reading)
            if alike[0].kind in GRAVITIES and (
                len(alike) < len(changes) or is_oblique(alike[0].reading.gravity)
            ):
                # beside other changes, or for a frame that is turned in the description, gravity
                # may be what balances them
                told = replace(told, certainty="suspected")
            if kind == "zero" and not any(change.other for change in alike):
                told = _or_another_robot(measurement, fits, told, changes[-1].reading)
            yield _one_of_two(told, alike)

    def _told(
        self, measurement: Measurement, kind: str, changes: list[Change], final: Reading
    ) -> Suspicion:
        turned = [j for change in changes for j in change.joints]
        joints = sorted(set(turned))
        if kind.endswith("_sign"):  # a sign changed twice is unchanged
            joints = [j for j in joints if turned.count(j) % 2]
        names = measurement.joints(joints)
        best = max(changes, key=lambda change: change.gain)
        evidence = (
            "with this correction, the rigid-body torque explains the measured torque better by "
            f"{best.gain:.0f} (log-likelihood) and leaves {100 * best.drop:.0f} % less residual"
        )
        certainty: Certainty = "certain" if _sure(changes) else "suspected"
        if kind in LIKE_EFFECTS and min(change.drop for change in changes) < MOSTLY:
            certainty = "suspected"
        rivals = {_RIVALS[rival] for change in changes for rival in change.rivals}
        if rivals:
            certainty = "suspected"
            evidence += f"; {', or '.join(sorted(rivals))} would explain it equally well"
        if kind in GRAVITIES:
            what, remedy = _of_gravity(kind, final, changes[0].restorable)
        elif kind in ORDERS:
            what, remedy = _ordered(measurement, final)
        elif kind.endswith("_sign"):
            what, remedy = _opposite(kind, names, joints)
        else:
            what, remedy = _of_positions(kind, names, joints, final)
        return self.suspicion(what, evidence, certainty, joints, remedy)


#: Kinds of changes of gravity.
GRAVITIES = ("gravity", "no_gravity")
#: Kinds of changes that exchange columns.
ORDERS = ("order", "motion_order", "torque_order")


def _opposite(kind: str, names: str, joints: list[int]) -> tuple[str, tuple[str, str]]:
    """Text for columns with the opposite sign, and the remedy."""
    if kind == "torque_sign":
        what = f"the torque of {names} has the opposite sign"
        columns = [f"tau{j + 1}" for j in joints]
    elif kind == "motion_sign":
        what = f"position and velocity of {names} have the opposite sign"
        columns = [f"q{j + 1}" for j in joints]
    else:
        what = f"the direction of {names} is opposite to that of the robot's description"
        columns = [f"{q}{j + 1}" for j in joints for q in ("q", "tau")]
    return what, remedy_of("flip", columns)


def _of_positions(
    kind: str, names: str, joints: list[int], final: Reading
) -> tuple[str, tuple[str, str]]:
    """Text for positions relative to another link or from another zero, and the remedy."""
    if kind == "summed":
        what = (
            f"the position of {names} includes that of the previous joint: its angle is "
            "relative to a link other than its parent"
        )
        others = {f"q{j + 1}": f"{'-' * (x < 0)}q{j}" for j, x in final.summed if j in joints}
        return what, remedy_of("summed", others)
    values = ", ".join(f"{np.rad2deg(v):.0f} deg" for j, v in final.zero if j in joints)
    pairs = {f"q{j + 1}": round(v, 4) for j, v in final.zero if j in joints}
    return f"the zero of {names} is off by about {values}", remedy_of("zero", pairs)


def _of_gravity(kind: str, final: Reading, restorable: bool) -> tuple[str, tuple[str, str]]:
    """Text for gravity in another direction, or that was removed, and the remedy."""
    if kind == "gravity":
        gravity = [round(x, 2) + 0.0 for x in (final.gravity or ())]
        words = ",".join(f"{x:g}" for x in gravity)
        what = (
            f"gravity points along ({words}) in the base frame: the robot is mounted in "
            "this orientation"
        )
        return what, (f"--gravity={words}", f"gravity={gravity}")
    what = "the torque contains no gravity: it was removed"
    if restorable:
        return what + " with the bodies of the description", remedy_of("restore_gravity", True)
    return what, remedy_of("gravity", "none")


def _ordered(measurement: Measurement, final: Reading) -> tuple[str, tuple[str, str]]:
    """Text for columns in another order, and the remedy."""
    every = range(measurement.n_joints)
    motion = [k + 1 for k in (final.order or every)]
    torque = [final.torque_column(k)[0] + 1 for k in every]
    own = [k + 1 for k in every]
    orders = {"motion": motion, "tau": torque}
    moved = sorted(
        {k for order in orders.values() for k, c in zip(every, order, strict=True) if c != k + 1}
    )
    names = measurement.joints(moved)
    if motion == torque:
        what = f"the columns of {names} are not in the order of the robot's joints"
        return what, remedy_of("order", motion)
    orders = {q: order for q, order in orders.items() if order != own}
    called = {"motion": "positions and velocities", "tau": "torques"}
    said = listed([called[q] for q in orders])
    return f"the {said} of {names} are exchanged", remedy_of("order", orders)


#: Meaning of another reading of the same joints.
_RIVALS = {
    "torque_sign": "the torque with the opposite sign",
    "motion_sign": "the position with the opposite sign",
    "joint_sign": "position and torque with the opposite sign",
    "convention": "a position that counts in the opposite direction from another zero",
    "order": "a different order of all columns",
    "motion_order": "a different order of the positions and velocities",
    "torque_order": "a different order of the torques",
    "summed": "a position relative to another link",
    "zero": "a different zero of a position",
    "gravity": "a different direction of gravity",
    "no_gravity": "no gravity",
}


def _one_of_two(told: Suspicion, changes: Iterable[Change]) -> Suspicion:
    """Text of the suspicion: one of two causes if another one explains the torque equally well."""
    others = dict.fromkeys(change.other for change in changes if change.other)
    if not others:
        return told
    names = " or ".join(other[:1].lower() + other[1:] for other in others)
    return replace(
        told,
        suspicion=f"either {told.suspicion}, or there is another cause: {names}",
        evidence=f"{told.evidence}; the other cause, on the same joints, explains it equally well"
        + ("" if told.remedy is None else f", so {told.remedy} may be wrong"),
        certainty="noted",
        remedy=None,
    )


def _or_another_robot(
    measurement: Measurement, fits: Fits, told: Suspicion, final: Reading
) -> Suspicion:
    """Text of a zero; one of two causes if bodies near those of the description fit no better.

    An angle of about half a turn can take the place of the lengths of another robot.
    """
    rows = fits.without(_lost_columns(measurement))
    known = list(known_gains(rows, final).values())
    if known and not USUAL[0] <= np.median(known) <= USUAL[1]:
        return told  # torques in another unit
    gains = np.ones(rows.n_joints)
    near = NearBodies(rows, final, gains, rows.identified(final).inflation)
    left = left_by_near_bodies(near)
    if not left:
        return told
    times = ", ".join(f"{left[k]:.2g} times on {measurement.joint(k)}" for k in left)
    return replace(
        told,
        suspicion=f"either {told.suspicion}, or the description is not of this robot",
        evidence=f"{told.evidence}; but even so, bodies near those of the description leave more "
        f"than any others, {times}"
        + ("" if told.remedy is None else f", so {told.remedy} may be wrong"),
        remedy=None,
    )


def asked_changes(measurement: Measurement, fits: Fits) -> list[Change]:
    """Changes to the reading of all recordings that the measurement implies."""
    return measurement.once(
        "changes", lambda: find_changes(fits.without(_lost_columns(measurement)))
    )


def asked_gain(measurement: Measurement, fits: Fits) -> float:
    """Log-likelihood gain of these changes with stated or with identified bodies.

    Or of a small tilt of the base with identified ones, which is no change but an effect, and which
    a recording of few poses feels like another zero.
    """
    asked = [c for c in asked_changes(measurement, fits) if not c.other]
    tilt = tilted(fits, Reading(), fits.nominal(Reading()))
    of_tilt = 0.0
    if tilt is not None:
        of_tilt = fits.identified(tilt).gained_over(fits.identified(Reading()))
    return max(sum(c.gain for c in asked), sum(c.confirmed for c in asked), of_tilt)


def _sure(changes: Iterable[Change]) -> bool:
    """Whether every change gains much, and takes off most of what the log as it is leaves."""
    return all(
        (c.gain > SURE and c.drop > 0.3 and c.confirmed >= 0)
        or (c.confirmed > DECISIVE and c.drop > HALF)
        for c in changes
    )


def readable_fits(measurement: Measurement) -> Fits | None:
    """Rows of a measurement without torques that lost their sign; None where none can be fitted."""
    fits = measurement.fits if measurement.readable else None
    if fits is None:
        return None
    return fits.without(_lost_columns(measurement))


def _lost_columns(measurement: Measurement) -> list[int]:
    """Columns of the torque without a sign, or that are not the torque of their joint."""
    unsigned, _ = unsigned_columns(measurement)
    copies = copied_columns(measurement)
    copied = [k for k, _, _ in copies]
    originals = [j for _, what, j in copies if what == "torque"]  # either may be the copy
    lost = [*unsigned, *measurement.clipped, *measurement.overflowed]
    return [*lost, *copied, *originals]
