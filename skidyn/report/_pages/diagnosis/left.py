# SPDX-License-Identifier: BSD-3-Clause
"""What the completed model leaves, what it is made of, and when it acts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from skidyn.report._picture import Picture

if TYPE_CHECKING:
    from skidyn.diagnosis import Diagnosis


class Left(Picture):
    """The remainder of every joint."""

    place, title = 50, "Remaining error"

    def read(self, subject: Diagnosis) -> list[dict[str, Any]]:
        """Parts of the error that is left: noise of the torque sensor and of the positions.

        ``predictable`` is what the signals still tell, ``remainder`` what is neither; N m or N.
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
