# SPDX-License-Identifier: BSD-3-Clause
"""Faults of the data that would look like physics: units, repeats, saturation, stuck joints.

Every suspicion is a sentence with its evidence. Nothing is repaired here.
"""

from __future__ import annotations

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.evidence import broken_notes
from skidyn.robots import Robot

#: Positions of more than this many turns on every joint, or velocities of this many units per s.
MANY_TURNS = 2.0
#: Slope of logged velocity on differentiated position that is still 1.
SLOPE = (0.8, 1.25)
#: Share of samples that repeat the one before, or lie at the extreme torque.
REPEATED, SATURATED = 0.05, 0.01
#: Correlation with the nominal torque, and the ratio to it, that point at currents.
CURRENT_CORRELATION, CURRENT_RATIO = 0.9, (0.4, 2.5)


def suspicions(signals: Signals, torque: Array, robot: Robot) -> list[str]:
    """What about a log looks wrong.

    Parameters
    ----------
    signals : Signals
        Logged motion.
    torque : ndarray of shape (n_samples, n_joints)
        Logged torque.
    robot : Robot
        Robot as described by its URDF.

    Returns
    -------
    list of str
    """
    return [
        *_units_of_position(signals),
        *_velocity_against_position(signals),
        *_repeats(signals),
        *_still_joints(signals, robot),
        *_saturation(torque, robot),
        *broken_notes(signals, torque, robot.joint_names),
        *_currents(signals, torque, robot),
    ]


def _units_of_position(signals: Signals) -> list[str]:
    turning = ~signals.prismatic
    if not turning.any():
        return []
    largest = np.abs(signals.q[:, turning]).max(0)
    if np.median(largest) > MANY_TURNS * 2 * np.pi:
        return [
            f"Positions reach {largest.max():.0f} on turning joints (median over joints "
            f"{np.median(largest):.0f}): this looks like degrees; rad is expected."
        ]
    return []


def _velocity_against_position(signals: Signals) -> list[str]:
    notes, slopes = [], []
    for joint in range(signals.n_joints):
        pairs = [
            (np.gradient(signals.q[rows, joint], signals.clock[rows]), signals.dq[rows, joint])
            for rows in signals.segments
            if rows.stop - rows.start > 4 and np.all(np.diff(signals.clock[rows]) > 0)
        ]
        if not pairs:
            continue
        rate = np.concatenate([a for a, _ in pairs])
        logged = np.concatenate([b for _, b in pairs])
        # A multiple of the logged velocity explains the rate of change, not the other way round:
        # differentiated positions carry the noise.
        power = float(logged @ logged)
        if power > 0 and float(rate @ logged) ** 2 > 0.25 * power * float(rate @ rate):
            slopes.append((joint, float(rate @ logged) / power))
    wrong = [(j, s) for j, s in slopes if not SLOPE[0] < s < SLOPE[1]]
    if wrong and len(wrong) >= 0.5 * len(slopes):
        typical = float(np.median([s for _, s in wrong]))
        guess = ""
        if 0.5e-3 < abs(typical) < 2e-3:
            guess = " (time in ms instead of s?)"
        elif 40 < abs(typical) < 75 or 1 / 75 < abs(typical) < 1 / 40:
            guess = " (degrees and rad mixed?)"
        notes.append(
            f"The positions change {typical:.3g} times as fast as the logged velocities on "
            f"{len(wrong)} of {signals.n_joints} joints: the units of time, position and velocity "
            f"do not fit together{guess}."
        )
    elif wrong:
        notes += [
            f"The position of joint {j + 1} changes {s:.3g} times as fast as its logged velocity."
            for j, s in wrong
        ]
    return notes


def _repeats(signals: Signals) -> list[str]:
    same = np.all(np.diff(signals.q, axis=0) == 0, axis=1)
    same &= np.all(np.diff(signals.dq, axis=0) == 0, axis=1)
    moving = np.any(np.abs(signals.dq[1:]) > 0.05 * signals.unit, axis=1)
    share = float((same & moving).mean()) if len(same) else 0.0
    if share > REPEATED:
        return [
            f"{share:.0%} of the samples repeat the one before while the robot moves: the log was "
            "polled faster than the robot reported."
        ]
    return []


def _still_joints(signals: Signals, robot: Robot) -> list[str]:
    travel = np.ptp(signals.q, axis=0)
    return [
        f"Joint {j + 1} ({robot.joint_names[j]}) does not move: nothing can be said about it."
        for j in np.flatnonzero(travel < 1e-3 * signals.unit)
    ]


def _saturation(torque: Array, robot: Robot) -> list[str]:
    notes = []
    for j, name in enumerate(robot.joint_names):
        size = np.abs(torque[:, j])
        top = float(size.max(initial=0.0))
        share = float((size >= top * (1 - 1e-9)).mean()) if top > 0 else 0.0
        if share > SATURATED:
            notes.append(
                f"The torque of joint {j + 1} ({name}) stays at ±{top:.4g} for {share:.0%} of the "
                "samples: it is saturated there."
            )
    return notes


def _currents(signals: Signals, torque: Array, robot: Robot) -> list[str]:
    """Torque in proportion to the nominal one, but by a strange factor."""
    gravity = robot.gravity_torque(signals.q)
    strong = [
        j for j in range(signals.n_joints) if gravity[:, j].std() > 0.3 * np.abs(gravity).max() / 2
    ]
    ratios = []
    for j in strong:
        g, t = gravity[:, j] - gravity[:, j].mean(), torque[:, j] - torque[:, j].mean()
        if t.std() > 0 and np.corrcoef(g, t)[0, 1] > CURRENT_CORRELATION:
            ratios.append((j, float(t @ g / (g @ g))))
    odd = [(j, r) for j, r in ratios if not CURRENT_RATIO[0] < r < CURRENT_RATIO[1]]
    return [
        f"The torque of joint {j + 1} follows the nominal gravity torque, but {r:.2g} times it: "
        "currents instead of torques, or a wrong gear ratio?"
        for j, r in odd
    ]
