# SPDX-License-Identifier: BSD-3-Clause
"""Unknown torques that are periodic in time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from skidyn._signals import Array, Signals
from skidyn.effects._nameless import NamelessEffect, unnamed_coefficients


class ClockPeriodic(NamelessEffect):
    """A torque periodic in time, of any wave form: a pump, a cam, a cyclic controller.

    With ``since_start`` in its shape, its phase begins anew with every recording.
    """

    kind = "clock_periodic"
    drawn_against = "time"
    title = "Periodic in time"
    formula = r"\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    coefficients = unnamed_coefficients(8)
    depends_on: ClassVar[tuple[str, ...]] = ("time",)
    needs = ("time",)
    search = "clock"
    #: Waves per period: a square wave has the odd ones.
    harmonics: ClassVar[tuple[int, ...]] = (1, 2, 3, 5)
    #: Highest frequency in Hz that averaged rows contain; higher waves are left out.
    highest: ClassVar[float] = 8.0

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        """What the waves are multiplied by, each of shape (n_samples,)."""
        return [np.ones(signals.n_samples)]

    def words(self, shape: Mapping[str, Any]) -> str:
        since = " since the start of each recording" if "since_start" in shape else ""
        return f"{self.title}{since}"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        time = signals.since_start if "since_start" in shape else signals.clock
        phase = 2 * np.pi * shape["frequency"] * time
        shown = [float(h * shape["frequency"] <= self.highest) for h in self.harmonics]
        waves = [
            s * wave(h * phase)
            for h, s in zip(self.harmonics, shown, strict=True)
            for wave in (np.sin, np.cos)
        ]
        carriers = self.carriers(signals, joint)
        return np.column_stack([carrier * wave for carrier in carriers for wave in waves])


class PulsatingFriction(ClockPeriodic):
    """Friction periodic in time: a brake that drags at times, a pulsing pressure on a seal."""

    kind = "pulsating_friction"
    drawn_against = "dq"
    title = "Friction periodic in time"
    formula = r"\mathrm{sign}\,\dot q_j\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    depends_on = ("dq_own", "time")
    is_of_one_number = True

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        return [signals.sign[:, joint]]


class PulsatingDrag(ClockPeriodic):
    """Friction proportional to the speed that is periodic in time, as of a stirred bath."""

    kind = "pulsating_drag"
    drawn_against = "dq"
    title = "Viscous friction periodic in time"
    formula = r"\dot q_j\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    coefficients = unnamed_coefficients(4)
    depends_on = ("dq_own", "time")
    is_of_one_number = True
    harmonics = (1, 2)

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        return [signals.dq[:, joint] / signals.unit[joint]]


class PulsatingSpring(ClockPeriodic):
    """A torque over the position that is periodic in time: an air spring that breathes."""

    kind = "pulsating_spring"
    drawn_against = "q"
    title = "Spring periodic in time"
    formula = r"(q_j - q_0)\sum_h a_h\sin(2\pi h f t) + b_h\cos(2\pi h f t)"
    depends_on = ("q_own", "time")
    is_of_one_number = True
    harmonics = (1, 2)

    def carriers(self, signals: Signals, joint: int) -> list[Array]:
        x = signals.q[:, joint] / signals.unit[joint]
        return [np.ones(signals.n_samples), x]


class Vibration(NamelessEffect):
    """A wave in time that is faster than the motion: a fan, mains hum, a loose part."""

    kind = "vibration"
    drawn_against = "time"
    title = "Vibration"
    formula = r"a\sin(2\pi f t) + b\cos(2\pi f t)"
    coefficients = unnamed_coefficients(2)
    depends_on = ("time",)
    needs = ("time",)
    # As with torque ripple: averaging over windows of time would remove it.
    search = "spectrum"

    def columns(self, signals: Signals, joint: int, **shape: Any) -> Array:
        phase = 2 * np.pi * shape["frequency"] * signals.clock
        return np.column_stack([np.sin(phase), np.cos(phase)])


PERIODIC: tuple[type[NamelessEffect], ...] = (
    ClockPeriodic,
    PulsatingFriction,
    PulsatingDrag,
    PulsatingSpring,
    Vibration,
)
