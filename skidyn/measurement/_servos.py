# SPDX-License-Identifier: BSD-3-Clause
"""Checks of position servos that are not as stated: their gain, limits of current and voltage.

A limit or another gain is no effect of the model, and would be taken for one: the torque that is
computed from the error of position has a residual of its own in all rows beyond the limit.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from skidyn._text import listed
from skidyn.measurement._check import Check
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._servo_limits import Servo, servos_seen
from skidyn.measurement._suspicion import Suspicion

#: Factor by which a gain must differ, standard errors of it, and share up to which others do not;
#: share of the variance that the stated bodies may leave at that gain: what a gear that gives way
#: leaves is more.
OTHER, SURE, ALIKE, AT_GAIN = 1.2, 5.0, 0.1, 0.02


def _other_gains(seen: dict[int, Servo]) -> dict[int, Servo]:
    """Servos whose gain is another one, while the weight of most other joints fits the stated one.

    Where others do not fit either, the bodies of the description may be wrong just as well.
    """
    fit = {j for j, s in seen.items() if abs(s.gain - 1) < ALIKE and s.error < ALIKE}
    other = {
        j: s
        for j, s in seen.items()
        if s.gain > 0
        and s.unexplained < AT_GAIN
        and abs(np.log(s.gain)) > max(np.log(OTHER), SURE * s.error / s.gain)
    }
    return other if len(fit) >= max(1, len(seen) / 2) else {}


class ServoGain(Check):
    """A position gain that is not the stated one."""

    name = "servo_gain"
    suspects = "position gain of a servo that differs from the stated one (logs without torque)"
    stage = 1
    misnames = True

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = servos_seen(measurement)
        other = _other_gains(seen)
        if not other:
            return
        told = listed([f"{1 / s.gain:.3g} of {measurement.joint(j)}" for j, s in other.items()])
        multiples = ", ".join(f"{s.gain:.3g} ± {1.96 * s.error:.2g}" for s in other.values())
        yield self.suspicion(
            f"the position gain of a servo is not the stated one, but times {told}",
            f"the torque computed from the stated gain is {multiples} times that of the bodies of "
            f"the description (95 %), which is 1 within {100 * ALIKE:.0f} % on most other joints",
            "suspected",
            other,
            ("--controller with this stiffness", "Controller(stiffness=...)"),
        )


class _Limit(Check):
    """A limit that is not stated; subclasses say of what."""

    stage = 1
    misnames = True
    falls: ClassVar[bool]

    def look(self, measurement: Measurement) -> Iterator[Suspicion]:
        seen = servos_seen(measurement)
        other = _other_gains(seen)  # a limit beside a wrong gain is that of the stated torque
        for j, servo in seen.items():
            if not servo.is_limited or j in other or np.isfinite(servo.speed) != self.falls:
                continue
            option = f"limit={servo.limit:.4g}"
            if self.falls:
                option += f", no_load_speed={servo.speed:.4g}"
            yield self.suspicion(
                self.said(measurement, j, servo),
                f"its error of position asks for more in {servo.rows} rows, where the torque that "
                "bodies and friction fitted to the other rows take is just that: it removes "
                f"{100 * (1 - servo.left):.0f} % of the squared error there. A joint that is "
                "blocked, as a gripper is by what it holds, looks alike",
                "suspected",
                [j],
                (f"--controller with {option} for this joint", f"Controller({option})"),
            )

    @abstractmethod
    def said(self, measurement: Measurement, j: int, servo: Servo) -> str:
        """The suspicion."""


class ServoCurrent(_Limit):
    """A limit of the current that is not stated."""

    name = "servo_current"
    suspects = "limit of the current of a servo that is not stated (logs without torque)"
    falls = False

    def said(self, measurement: Measurement, j: int, servo: Servo) -> str:
        force, _ = _units(measurement, j)
        return (
            f"the servo of {measurement.joint(j)} supplies {servo.limit:.3g} {force} at most, a "
            "limit of its current that is not stated"
        )


class ServoVoltage(_Limit):
    """A voltage that is used up by the speed."""

    name = "servo_voltage"
    suspects = "voltage of a servo that limits its torque at speed (logs without torque)"
    falls = True

    def said(self, measurement: Measurement, j: int, servo: Servo) -> str:
        force, pace = _units(measurement, j)
        return (
            f"the voltage of the servo of {measurement.joint(j)} limits its torque, to "
            f"{servo.limit:.3g} {force} at rest and nothing at {servo.speed:.3g} {pace}"
        )


#: Names of the checks of settings of a servo, without which its joint cannot be simulated.
SERVO_CHECKS = frozenset(check.name for check in (ServoGain, ServoCurrent, ServoVoltage))


def _units(measurement: Measurement, j: int) -> tuple[str, str]:
    """Units of force and speed of a joint."""
    robot = measurement.robot
    slides = robot is not None and robot.joint_types[j] == "prismatic"
    return ("N", "m/s") if slides else ("N m", "rad/s")
