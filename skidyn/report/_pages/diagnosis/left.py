# SPDX-License-Identifier: BSD-3-Clause
"""Remaining error of the completed model, its causes, and when it occurs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.report._picture import Picture

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


class Left(Picture):
    """The remainder of every joint."""

    place, title = 50, "Remaining error"

    def read(self, subject: Diagnosis) -> list[dict[str, Any]]:
        """Parts of the remaining error: noise of the torque sensor and of the positions.

        ``predictable`` is the part that the signals still explain, ``remainder`` the rest; N m or
        N.
        """
        parts = subject.parts
        if parts is None:
            return []
        return [
            {
                "joint": j + 1,
                "unit": subject.comparison.units[j],
                "after": subject.rmse_after[j],
                "torque_noise": parts.sensor_noise[j],
                "position_noise": parts.position_noise[j],
                "predictable": parts.predictable[j],
                "remainder": parts.left[j],
            }
            for j in range(len(subject.joint_names))
        ]
