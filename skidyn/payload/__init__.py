# SPDX-License-Identifier: BSD-3-Clause
"""Payloads and drive gains (torque per ampere) from runs with and without a load."""

from skidyn.payload._drive_gains import DriveGainEstimate, estimate_drive_gains
from skidyn.payload._payload import PayloadEstimate, identify_payload

__all__ = [
    "DriveGainEstimate",
    "PayloadEstimate",
    "estimate_drive_gains",
    "identify_payload",
]
