# SPDX-License-Identifier: BSD-3-Clause
"""Coefficients and dates in words."""

from __future__ import annotations

import re
from typing import Any

from skidyn._text import inside, joints_told
from skidyn.effects import get_effect, list_effects


def coefficient_told(column: str) -> str:
    """A coefficient in words: ``viscous.Fv[1]`` is ``Fv of viscous friction on joint 1``."""
    match = re.fullmatch(r"(\w+)\.(\w+)\[([\d, ]+)\]", column)
    if match is None or match[1] not in list_effects():
        return column
    joints = match[3].replace(" ", "").split(",")
    return f"{match[2]} of {inside(get_effect(match[1]).title)} on {joints_told(joints)}"


def since_told(date: Any) -> str:
    """Since when a coefficient is outside its band; a plain number is that of a trajectory."""
    return f"at trajectory {date}" if isinstance(date, int) else f"on {date}"
