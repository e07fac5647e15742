# SPDX-License-Identifier: BSD-3-Clause
"""Settings of a position servo that differ from the stated ones.

They are no torques of the model, so they have no columns: they change the torque that is computed
from commands and positions. The name of each parameter is that of the argument of
:class:`skidyn.simulation.Controller` that states it.
"""

from __future__ import annotations

from typing import ClassVar

from skidyn.effects._base import Effect
from skidyn.effects._parameters import Coefficient

_BAM = (
    "Duclusaud, Passault, Padois, Ly (2024), Extended friction models for the physics simulation "
    "of servo actuators."
)


class ServoEffect(Effect):
    """A setting of the servo; found in logs of commands and positions without torque."""

    search = "servo"
    needs: ClassVar[tuple[str, ...]] = ("command",)
    drawn_against = "load"
    reference = _BAM


class ServoGain(ServoEffect):
    """The position gain of the servo is not the stated one.

    The torque of the joint is another multiple of that of the bodies of the description, while most
    other joints agree with them. Bodies and friction that are identified from the log scale with
    the gain, so that the described bodies are needed to find it.
    """

    kind = "servo_gain"
    title = "Different position gain of the servo"
    formula = r"k\,(q_\mathrm{ref} - q)"
    coefficients = (Coefficient("stiffness", "N m/rad", sign=1),)
    rivals = ("torque_gain",)
    separating_motion = "the joint holding a known load at rest"
    caveat = "wrong bodies of the description look like another gain"


class ServoCurrent(ServoEffect):
    """The current of the servo limits its torque, and the limit is not stated."""

    kind = "servo_current"
    title = "Current limit of the servo"
    formula = r"\mathrm{clip}(\tau,\ \pm L)"
    coefficients = (Coefficient("limit", "N m", sign=1),)
    rivals = ("servo_voltage", "saturation", "torque_gain")
    separating_motion = "large loads at low and at high speed"
    caveat = "a joint that is blocked, such as a gripper that holds something, looks alike"


class ServoVoltage(ServoEffect):
    """The torque of the servo is limited at speed, since the voltage of its supply is used up.

    The largest torque falls linearly with the speed, from that at rest to nothing at the no-load
    speed.
    """

    kind = "servo_voltage"
    title = "Voltage limit of the servo"
    formula = r"\mathrm{clip}(\tau,\ \pm L - L\,\dot q / \omega_0)"
    coefficients = (
        Coefficient("limit", "N m", sign=1),
        Coefficient("no_load_speed", "rad/s", sign=1),
    )
    rivals = ("servo_current", "saturation", "torque_gain")
    separating_motion = "large loads at low and at high speed"
    caveat = ServoCurrent.caveat


class ServoDeadband(ServoEffect):
    """The servo supplies no torque while its position error is small."""

    kind = "servo_deadband"
    title = "Deadband of the servo"
    formula = r"k\,\mathrm{sign}(e)\max(0,\,|e| - e_0),\quad e = q_\mathrm{ref} - q"
    coefficients = (Coefficient("deadband", "rad", sign=1),)
    rivals = ("coulomb", "stribeck", "backlash")
    separating_motion = "slow motion with reversals and stops, under load and without"


SERVO: tuple[type[ServoEffect], ...] = (ServoGain, ServoCurrent, ServoVoltage, ServoDeadband)
