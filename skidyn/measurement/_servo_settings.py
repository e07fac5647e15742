# SPDX-License-Identifier: BSD-3-Clause
"""Settings of position servos that differ from the stated ones: gain, current and voltage limits.

They are found before other effects, which they would be taken for: the torque that is computed from
the error of position has a residual of its own in all rows beyond a limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import erfc

import numpy as np

from skidyn._signals import Array
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._servo_limits import Servo, servos_seen

#: Factor by which a gain must differ, standard errors of it, and share up to which others do not;
#: share of the variance that the stated bodies may leave at that gain: what a gear that gives way
#: leaves is more.
OTHER, SURE, ALIKE, AT_GAIN = 1.2, 5.0, 0.1, 0.02
#: Half the width of a 95 % interval in standard errors.
WIDE = 1.96


@dataclass(frozen=True)
class ServoSetting:
    """A setting of the servo of one joint that differs from the stated one.

    Parameters
    ----------
    kind : str
        Kind of the catalogue.
    joint : int
        Joint, from 0.
    parameters : dict of str to (float, float, float)
        Value and 95 % interval of arguments of the controller, SI units.
    error_drop : float
        Share of the squared error of the torque that it removes.
    chance : float or None
        Probability of such a deviation by chance; None if it was not judged by a probability.
    evidence : str
        The evidence.
    """

    kind: str
    joint: int
    parameters: dict[str, tuple[float, float, float]]
    error_drop: float
    chance: float | None
    evidence: str


def servo_settings(measurement: Measurement, stiffness: Array) -> list[ServoSetting]:
    """Settings of servos that differ from the stated ones, at most one for each joint.

    Parameters
    ----------
    measurement : Measurement
        Motion, and the torque computed from the servos as stated.
    stiffness : ndarray of shape (n_joints,)
        Stated gains, N m/rad or N/m.
    """
    seen = servos_seen(measurement)
    other = _other_gains(seen)
    return [*_gains(other, stiffness), *_limits(seen, other)]


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


def _gains(other: dict[int, Servo], stiffness: Array) -> Iterator[ServoSetting]:
    """Gains that are not the stated ones."""
    for j, servo in other.items():
        wide = WIDE * servo.error
        # the torque is computed with the stated gain, so that bodies seem heavier if it is too high
        bounds = (
            float(stiffness[j] / x) for x in (servo.gain, servo.gain + wide, servo.gain - wide)
        )
        value, low, high = bounds
        yield ServoSetting(
            "servo_gain",
            j,
            {"stiffness": (value, low, high)},
            servo.gain_drop,
            erfc(abs(np.log(servo.gain)) * servo.gain / servo.error / np.sqrt(2)),
            f"the torque computed from the stated gain is {servo.gain:.3g} ± {wide:.2g} times that "
            f"of the bodies of the description (95 %), which is 1 within {100 * ALIKE:.0f} % on "
            "most other joints",
        )


def _limits(seen: dict[int, Servo], other: dict[int, Servo]) -> Iterator[ServoSetting]:
    """Limits that are not stated, of the current or, where it falls with the speed, of the voltage.

    A limit beside a wrong gain is that of a wrong torque.
    """
    for j, servo in seen.items():
        if not servo.is_limited or j in other:
            continue
        names = ("limit", "no_load_speed")[: len(servo.limit)]
        yield ServoSetting(
            "servo_voltage" if servo.falls else "servo_current",
            j,
            {
                name: (float(x), float(x - half), float(x + half))
                for name, x, half in zip(names, servo.limit, servo.half, strict=True)
            },
            servo.drop,
            None,
            f"its error of position asks for more in {servo.rows} rows, where the torque that "
            "bodies and friction fitted to the other rows require is just that: it removes "
            f"{100 * (1 - servo.left):.0f} % of the squared error there",
        )
