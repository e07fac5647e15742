# SPDX-License-Identifier: BSD-3-Clause
"""Checks of single channels: joints at rest, torque that is constant, held or clipped."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from skidyn._signals import Array
from skidyn.evidence import broken_notes
from skidyn.measurement._around_zero import dead_bands
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import NOTED_STEP, Measurement
from skidyn.measurement._measures import COARSE, FEW_VALUES, is_short, step_share
from skidyn.measurement._suspicion import Suspicion, remedy_of

#: Share of rows at the extreme torque from which it is reported.
CLIPPED = 0.002
#: Fourth differences of a torque relative to its spread above which it has noise; joints of
#: recordings with noise are never below 4e-4.
NOISELESS = 1e-5
#: How many times as often as the value next to it an extreme value of a coarse torque occurs if it
#: is clipped.
OFTENER = 3.0
#: How many times as large a step of a velocity must be as that of differences of the positions.
COARSER = 2.0


class StillJoint(Check):
    """Joints that hardly move."""

    name = "still_joint"
    suspects = "joints that hardly move"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        q = measurement.signals.q
        if measurement.shuffled:
            return  # reversals cannot be told
        for k, moves in enumerate(measurement.excited):
            if not moves:
                yield self.suspicion(
                    f"{measurement.joint(k)} hardly moves",
                    f"it moves from {q[:, k].min():.4g} to {q[:, k].max():.4g} without reversals, "
                    "so its friction and inertia cannot be identified from this log",
                    "noted",
                    [k],
                )


class CoarsePosition(Check):
    """Positions in steps that are large enough to affect accelerations."""

    name = "coarse_position"
    suspects = "positions in coarse steps"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        q = measurement.signals.q
        steps = {
            k: measurement.position_steps[k]
            for k in range(measurement.n_joints)
            if not measurement.signals.prismatic[k]
        }
        coarse = {k: step for k, step in steps.items() if step > COARSE}
        for k in steps:
            if k not in coarse and is_short(q[:, k]):
                # the step of eleven bits at the largest position
                coarse[k] = 2.0 ** np.floor(np.log2(np.abs(q[:, k]).max()) - 10)
        if coarse:
            largest = max(coarse.values())
            yield self.suspicion(
                "positions come in coarse steps",
                f"the steps are up to {largest:.3g} rad, {2 * np.pi / largest:.0f} per turn; "
                "accelerations and small effects that depend on them are less certain",
                "noted",
                sorted(coarse),
            )


class CoarseVelocity(Check):
    """Velocities in steps that those of the positions do not explain."""

    name = "coarse_velocity"
    suspects = "velocities in coarse steps"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        s, told = measurement.signals, []
        for k in np.flatnonzero(measurement.excited).tolist():
            step = measurement.velocity_steps[k]
            share = step_share(s.dq[:, k], step)
            own = measurement.position_steps[k] * measurement.rate
            if share > NOTED_STEP and not step < COARSER * own:
                told.append((k, step, share))
        if told:
            joints = [k for k, _, _ in told]
            yield self.suspicion(
                f"the velocity of {measurement.joints(joints)} comes in coarse steps",
                f"the steps are up to {max(step for _, step, _ in told):.3g} rad/s (m/s for a "
                f"slider), {max(share for _, _, share in told):.0%} of the standard deviation; "
                "differences of the positions are finer",
                "noted",
                joints,
                remedy_of("derive", [f"dq{k + 1}" for k in joints]),
            )


class UnrecordedTorque(Check):
    """Torques of a moving robot none of which ever changes."""

    name = "unrecorded_torque"
    of_sensor = True
    suspects = "torque that was not recorded: it is constant on all joints while the robot moves"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        if not measurement.unrecorded:
            return
        values = ", ".join(f"{value:.4g}" for value in measurement.torque[0])
        of = "that of the joint is" if measurement.n_joints == 1 else "those of the joints are"
        yield self.suspicion(
            "the torque was not recorded",
            f"the robot moves, but no torque ever changes: {of} {values} in every row. Record the "
            "torque or the current of the motors, or name the columns that hold it with --columns "
            "(in Python: columns=); for position servos, their commands can take its place "
            "(--controller fit)",
            "certain",
        )


class ConstantTorque(Check):
    """A torque that never changes: in the log, in a trajectory, or at the ends of trajectories."""

    name = "constant_torque"
    of_sensor = True
    suspects = (
        "torque that is constant, in the whole log, in some trajectories, or before drives are "
        "enabled"
    )

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        idle = measurement.idle
        # recordings begin and end at rest, where a dead band has zeros
        banded = list(dead_bands(measurement)) if idle.any() else []
        if banded and not np.delete(measurement.torque, banded, axis=1)[idle].any():
            idle = idle & np.any(measurement.torque != 0, axis=1)
        if idle.any():
            yield self.suspicion(
                "torque was not measured at the ends of recordings",
                f"in {int(idle.sum())} rows, {idle.mean():.1%}, no torque changes: the drives "
                "were not enabled, their values arrived late, or the ends were filled with the "
                "last values",
                "certain",
                remedy=remedy_of("drop_repeated", True),
            )
        number = measurement.signals.trajectory
        runs = np.unique(number)
        lost = measurement.clipped
        for k in range(measurement.n_joints):
            torque = measurement.torque[:, k]
            if k in lost or measurement.unrecorded:
                continue  # reported already
            if np.ptp(torque) == 0:
                yield self.suspicion(
                    f"the torque of {measurement.joint(k)} is constant",
                    f"it is {torque[0]:.4g} in every row",
                    "suspected",
                    [k],
                )
                continue
            if len(measurement.leaps) or measurement.lost:
                continue  # a torque may well be constant in a short part between jumps
            still = [
                int(run) for run in runs if len(runs) > 1 and np.ptp(torque[number == run]) == 0
            ]
            if still and k not in dead_bands(measurement):
                yield self.suspicion(
                    f"the torque of {measurement.joint(k)} is constant in some trajectories",
                    f"in {', '.join(map(str, still[:8]))}; leave these trajectories out",
                    "suspected",
                    [k],
                )


class ClippedTorque(Check):
    """A torque that stays at its extreme value."""

    name = "clipped_torque"
    of_sensor = True
    suspects = "torque that is clipped: sensor or drive saturates"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        for k, share in enumerate(measurement.at_limit):
            torque = measurement.torque[:, k]
            if np.ptp(torque) > 0 and share > CLIPPED and not _is_coarse_extreme(torque):
                yield self.suspicion(
                    f"the torque of {measurement.joint(k)} stays at its extreme value",
                    f"in {100 * share:.1f} % of the rows (from {torque.min():.4g} to "
                    f"{torque.max():.4g}): it is saturated there",
                    "noted",
                    [k],
                )


def _is_coarse_extreme(torque: Array) -> bool:
    """Whether the extreme values of a coarse torque are no more frequent than their neighbours."""
    values, counts = np.unique(torque, return_counts=True)
    if not 2 < len(values) <= FEW_VALUES:
        return False
    return bool(max(counts[0] / counts[1], counts[-1] / counts[-2]) < OFTENER)


class CoarseTorque(Check):
    """Torque in steps that are not small relative to its spread."""

    name = "coarse_torque"
    of_sensor = True
    suspects = "torque in coarse steps"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        coarse = measurement.coarse_torques
        if not coarse:
            return
        told = ", ".join(
            f"{step:.3g} {'N' if measurement.signals.prismatic[k] else 'N m'} ({share:.0%})"
            for k, (step, share) in coarse.items()
        )
        one = len(coarse) == 1
        yield self.suspicion(
            f"the torque of {measurement.joints(coarse)} comes in coarse steps",
            f"the {'step' if one else 'steps'}, and the share of the standard deviation, "
            f"{'is' if one else 'are'} {told}; smaller effects cannot be found on "
            f"{'this joint' if one else 'these joints'}",
            "noted",  # nothing can be done about a recording of it
            coarse,
        )


class SmoothTorque(Check):
    """Torque without any noise: filtered before it was recorded, or computed."""

    name = "smooth_torque"
    of_sensor = True
    suspects = "torque that was filtered before it was recorded, so that its noise is unknown"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        scatter = measurement.torque_scatter
        if scatter < NOISELESS and not measurement.computed:
            yield self.suspicion(
                "the torque has no noise",
                f"from sample to sample it scatters by at most {scatter:.1g} of its spread: "
                "it was filtered before it was recorded, or computed, and the ratio of the error "
                "to this noise is not meaningful",
                "noted",
            )


class BrokenSamples(Check):
    """Few samples that jump away and back, or whose motion is torn."""

    name = "broken_samples"
    suspects = "few wrong samples: lost or held packets, bus errors, ends of a filtered recording"

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        names = tuple(map(str, measurement.joint_names))
        for what, where in broken_notes(measurement.signals, measurement.torque, names):
            yield self.suspicion(what, where, "noted")
