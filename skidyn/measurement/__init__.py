# SPDX-License-Identifier: BSD-3-Clause
"""Checks of a measurement: whether its signals agree with their names and units."""

from skidyn.measurement._check import Check
from skidyn.measurement._checks import check_measurement, list_checks, refuse_certain
from skidyn.measurement._clock import regular_clock
from skidyn.measurement._measurement import Measurement
from skidyn.measurement._suspicion import Remedy, Suspicion

__all__ = [
    "Check",
    "Measurement",
    "Remedy",
    "Suspicion",
    "check_measurement",
    "list_checks",
    "refuse_certain",
    "regular_clock",
]

# For other packages of skidyn; no part of the public interface.
from skidyn.measurement._checks import names_in_doubt as names_in_doubt
from skidyn.measurement._clock import count_same_stamps as count_same_stamps
from skidyn.measurement._copies import copied_rows as copied_rows
from skidyn.measurement._influence import errors_of_fits as errors_of_fits
from skidyn.measurement._interleaved import find_interleaved as find_interleaved
from skidyn.measurement._leaps import find_leaps as find_leaps
from skidyn.measurement._lowpass import without_lowpass as without_lowpass
from skidyn.measurement._measures import (
    channel_step as channel_step,
    idle_rows as idle_rows,
    is_held as is_held,
    lost_parts as lost_parts,
    rest_share as rest_share,
    reversals as reversals,
)
from skidyn.measurement._servo_settings import (
    ServoSetting as ServoSetting,
    servo_settings as servo_settings,
)
from skidyn.measurement._suspicion import CERTAINTIES as CERTAINTIES, paragraphs as paragraphs
from skidyn.measurement._torque_delay import measured_delay as measured_delay
from skidyn.measurement._wraps import wrap_period as wrap_period
