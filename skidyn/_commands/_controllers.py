# SPDX-License-Identifier: BSD-3-Clause
"""Controllers of the command line: as given, as fitted to a log, and with settings of a report."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from skidyn._exceptions import SkidynError

if TYPE_CHECKING:
    import pandas as pd

    from skidyn.robots import Robot
    from skidyn.simulation import Controller


def read_controller(text: str, robot: Robot, frame: pd.DataFrame, torque: Any) -> Controller:
    """The given controller, or one fitted to the log by its torque or the robot's weight.

    ``torque`` is the logged one, None where the log has none.
    """
    from skidyn.simulation import Controller, fit_controller, fit_servo

    word = text.strip()
    if word == "fit" and torque is not None:
        return fit_controller(frame, torque)
    if word in ("fit", "fit-shared"):
        return fit_servo(robot, frame, shared=word != "fit")
    try:
        gains = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise SkidynError(f"--controller is not JSON: {error}") from None
    names = {field.name for field in fields(Controller)}
    if not isinstance(gains, dict) or "stiffness" not in gains or not set(gains) <= names:
        raise SkidynError(
            f"--controller is {text}; expected fit, or stiffness (N m/rad) and optionally "
            f"{', '.join(sorted(names))} as JSON; fit-shared estimates one gain for all joints"
        )
    return Controller(**{k: _unlimited(v) for k, v in gains.items()}).checked(robot.n_joints)


def _unlimited(value: Any) -> Any:
    """A setting in which null stands for no limit, since JSON has no infinite numbers."""
    if isinstance(value, list):
        return [_unlimited(x) for x in value]
    return math.inf if value is None else value


def controller_told(controller: Controller, n_joints: int) -> str:
    """A controller as ``--controller`` reads it; settings with their usual value are left out."""
    from skidyn._plain import plain
    from skidyn.simulation import Controller

    usual = plain(asdict(Controller(0.0).checked(n_joints)))
    told = plain(asdict(controller.checked(n_joints)))
    kept = {k: v for k, v in told.items() if k == "stiffness" or v != usual[k]}
    return json.dumps(kept)


@dataclass(frozen=True)
class Setting:
    """A setting of the servo of one joint in a report."""

    kind: str
    joint: int
    values: Mapping[str, float]

    def is_of(self, kind: str, joints: Sequence[int] | None) -> bool:
        """Whether it is of a kind and one of the joints; None stands for all."""
        return self.kind == kind and (joints is None or self.joint in joints)


def driven_with(
    controller: Controller, tau: Any, settings: Sequence[Setting], frame: Any, n_joints: int
) -> tuple[Controller, Any]:
    """Controller with settings, and the torque of its servos; as given without any."""
    if not settings:
        return controller, tau
    from skidyn.simulation import servo_torque

    for setting in settings:
        controller = controller.with_joint(n_joints, setting.joint, **setting.values)
    return controller, servo_torque(controller, frame)
