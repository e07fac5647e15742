# SPDX-License-Identifier: BSD-3-Clause
"""The checks of a measurement, in the order of their influence on the result."""

from __future__ import annotations

from skidyn._exceptions import MisreadLogError
from skidyn.measurement._acceleration import Acceleration
from skidyn.measurement._around_zero import CountedPosition, DeadBand, TaredTorque
from skidyn.measurement._arrival import FalseGaps
from skidyn.measurement._axes import Axes
from skidyn.measurement._bodies import (
    Bodies,
    ComputedTorque,
    NoFriction,
    UnexplainedTorque,
)
from skidyn.measurement._channels import (
    BrokenSamples,
    ClippedTorque,
    CoarsePosition,
    CoarseTorque,
    CoarseVelocity,
    ConstantTorque,
    SmoothTorque,
    StillJoint,
    UnrecordedTorque,
)
from skidyn.measurement._check import Check
from skidyn.measurement._clock import (
    ClockJitter,
    Gaps,
    InterpolatedRows,
    RepeatedRows,
    SlowSampling,
)
from skidyn.measurement._commanded import CommandedMotion
from skidyn.measurement._copies import CopiedTorque, RepeatedRecordings
from skidyn.measurement._crosstalk import Crosstalk
from skidyn.measurement._description import DescriptionLengths, DescriptionUnits
from skidyn.measurement._differential import MotorsOfDifferential
from skidyn.measurement._divided import DividedRecordings
from skidyn.measurement._elapsed import LostRows
from skidyn.measurement._external import ExternalTorque
from skidyn.measurement._failed_reads import FailedReads
from skidyn.measurement._gravity_of_recordings import GravityOfRecordings
from skidyn.measurement._held import (
    HeldPosition,
    HeldTorque,
    HeldVelocity,
    MissingTorque,
    StuckPosition,
    StuckTorque,
)
from skidyn.measurement._joined import JoinedRecordings
from skidyn.measurement._joint_gravity import JointGravity
from skidyn.measurement._lengths import Lengths
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._odd import OddRecording
from skidyn.measurement._odd_motion import OddMotion
from skidyn.measurement._other_robot import OtherRobot
from skidyn.measurement._overflow import OverflowedTorque
from skidyn.measurement._padding import PaddedRows
from skidyn.measurement._rate import GravityOnly
from skidyn.measurement._slow_torque import SlowTorque
from skidyn.measurement._smoothing import SmoothedTorque
from skidyn.measurement._suspicion import CERTAINTIES, Suspicion
from skidyn.measurement._torque import Columns, UnsignedTorque
from skidyn.measurement._torque_delay import TorqueDelay
from skidyn.measurement._torque_scale import TorqueScale
from skidyn.measurement._units import ClockUnit, PositionUnit
from skidyn.measurement._velocity import Velocity
from skidyn.measurement._velocity_delay import VelocityDelay
from skidyn.measurement._wrapped import WrappedPosition

UNSIGNED = UnsignedTorque()
#: The only list of checks in skidyn.
CHECKS: tuple[Check, ...] = (
    PaddedRows(),
    FailedReads(),
    UnrecordedTorque(),
    DescriptionLengths(),
    DescriptionUnits(),
    LostRows(),
    ClockUnit(),
    PositionUnit(),
    Velocity(),
    WrappedPosition(),
    OddMotion(),
    CountedPosition(),
    JoinedRecordings(),
    HeldPosition(),
    StuckPosition(),
    RepeatedRows(),
    RepeatedRecordings(),
    FalseGaps(),
    ClockJitter(),
    InterpolatedRows(),
    MissingTorque(),
    TaredTorque(),
    DeadBand(),
    UNSIGNED,
    OverflowedTorque(),
    Axes(),
    GravityOfRecordings(),
    DividedRecordings(),
    OddRecording(),
    MotorsOfDifferential(),
    Columns(),
    GravityOnly(),
    TorqueScale(),
    ExternalTorque(),
    NoFriction(),
    UnexplainedTorque(),
    Bodies(),
    HeldVelocity(),
    VelocityDelay(),
    Acceleration(),
    HeldTorque(),
    StuckTorque(),
    SlowTorque(),
    ComputedTorque(),
    SmoothedTorque(),
    TorqueDelay(),
    CommandedMotion(),
    JointGravity(),
    Crosstalk(),
    OtherRobot(),
    Lengths(),
    ConstantTorque(),
    CopiedTorque(),
    ClippedTorque(),
    SmoothTorque(),
    CoarsePosition(),
    CoarseVelocity(),
    CoarseTorque(),
    SlowSampling(),
    Gaps(),
    StillJoint(),
    BrokenSamples(),
)


def list_checks() -> tuple[Check, ...]:
    """All checks in the order of their influence on the result.

    Returns
    -------
    tuple of Check
        One of each kind.

    Examples
    --------
    >>> from skidyn.measurement import list_checks
    >>> [check.name for check in list_checks() if check.stage == 1][:3]
    ['axes', 'gravity_of_recordings', 'divided_recordings']
    """
    return CHECKS


def check_measurement(measurement: Measurement) -> list[Suspicion]:
    """Check a measurement; the most important suspicions come first.

    Checks that fit the robot are left out if columns are certainly in wrong units, and checks that
    require correct joints and signs if these are suspected to be wrong, because their fits would be
    meaningless. Checks of the torque sensor are left out for torque computed from servos.

    Parameters
    ----------
    measurement : Measurement
        Recording and robot.

    Returns
    -------
    list of Suspicion
        Certain ones first, then suspected and noted ones; each in the order of the checks.

    Examples
    --------
    >>> import numpy as np
    >>> from skidyn._signals import Signals
    >>> from skidyn.measurement import Measurement, check_measurement
    >>> t = np.arange(0, 20, 0.01)
    >>> q = np.sin(t)[:, None]
    >>> motion = Signals(q, 57.3 * np.cos(t)[:, None], 0 * q, np.zeros(2000, int), t)
    >>> found = check_measurement(Measurement(motion, q + 0.1, None, ["pivot"]))
    >>> found[0].check, found[0].remedy.option
    ('velocity', '--units dq=deg/s')
    """
    found: list[Suspicion] = []
    misread = 3  # the first stage that would fit wrongly interpreted columns
    for check in CHECKS:
        if check.stage >= misread or (check.of_sensor and measurement.of_servos):
            continue
        measurement.readable = misread > 1
        told = list(check.look(measurement))
        found += told
        doubted = any(s.certainty != "noted" for s in told)
        measurement.dead |= check.name == "dead_band" and doubted
        measurement.scaled |= check.name == "torque_scale" and doubted
        measurement.smoothed |= check.name == "smoothed_torque" and doubted
        if isinstance(check, _UNITS) and any(s.certainty == "certain" for s in told):
            misread = 1
        elif isinstance(check, _SCALES) and any(s.certainty == "suspected" for s in told):
            misread = 1
        elif (check.stage == 1 or check is UNSIGNED) and any(s.certainty != "noted" for s in told):
            misread = min(misread, 2)
    measurement.readable = misread > 1
    return sorted(found, key=lambda s: CERTAINTIES.index(s.certainty))


#: Checks whose certain suspicions make every fit of the robot meaningless, and checks of which any
#: suspicion does.
_UNITS = (UnrecordedTorque, LostRows, ClockUnit, PositionUnit, Velocity, WrappedPosition)
_SCALES = (ClockUnit, PositionUnit, TaredTorque)


def names_in_doubt(found: list[Suspicion]) -> list[str]:
    """Suspicions about a measurement that a diagnosis would report as a physical effect.

    Parameters
    ----------
    found : list of Suspicion
        From :func:`check_measurement`.

    Returns
    -------
    list of str
        Empty if there are none.
    """
    names = {check.name for check in CHECKS if check.misnames}
    return [
        s.suspicion for s in found if (s.check in names or _is_zero(s)) and s.certainty != "noted"
    ]


def _is_zero(suspicion: Suspicion) -> bool:
    """Whether the zero of a position is suspected, which then explains more than any effect did.

    What it leaves of the torque looks like springs and payloads on the joints before it.
    """
    remedy = suspicion.remedy
    return suspicion.check == "reading" and remedy is not None and "zero" in remedy.arguments


def refuse_certain(found: list[Suspicion]) -> None:
    """Raise if a measurement certainly does not agree with its names and units.

    Parameters
    ----------
    found : list of Suspicion
        From :func:`check_measurement`.

    Raises
    ------
    MisreadLogError
        With the certain suspicions and their remedies.

    Examples
    --------
    >>> from skidyn.measurement import Suspicion, refuse_certain
    >>> refuse_certain([Suspicion("gaps", "a gap", "of 1 s", "noted")])
    """
    certain = [s for s in found if s.certainty == "certain"]
    if certain:
        raise MisreadLogError(
            "the log does not agree with its names and units, so that any effect found in it "
            "would be wrong. "
            + " ".join(text[:1].upper() + text[1:] for text in map(str, certain))
            + " To continue anyway: --force (in Python: force=True).",
            certain,
        )
