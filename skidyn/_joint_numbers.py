# SPDX-License-Identifier: BSD-3-Clause
"""Numbers of joints, as users write them."""

from __future__ import annotations

from collections.abc import Iterable
from operator import index
from typing import Any

from skidyn._exceptions import SkidynError


def joint_numbers(joints: Any) -> list[int]:
    """Joints, counted from 1, of one number or of several.

    A SkidynError is raised for anything else; whether the robot has these joints is not checked.

    >>> joint_numbers(2), joint_numbers([1, 4])
    ([2], [1, 4])
    """
    try:
        if not isinstance(joints, str | bytes | bool):
            several = joints if isinstance(joints, Iterable) else [joints]
            return [index(joint) for joint in several]
    except TypeError:
        pass
    raise SkidynError(
        f"joints={joints!r}; expected the number of a joint, counted from 1, or several: "
        "joints=2, joints=[1, 4]"
    )
