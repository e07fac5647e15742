# SPDX-License-Identifier: BSD-3-Clause
"""Findings about the settings of servos, and the controller that contains them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from skidyn._exceptions import EffectError
from skidyn._signals import Array
from skidyn.diagnosis._findings import Finding, notes, told_briefly
from skidyn.effects import get_effect
from skidyn.measurement import Measurement, ServoSetting, servo_settings
from skidyn.simulation import Controller, Setting, servo_torque


@dataclass(frozen=True)
class Servos:
    """Position servos of a log without torque.

    Parameters
    ----------
    controller : Controller
        Gains, delay and limits.
    log : DataFrame
        Commands and positions.
    """

    controller: Controller
    log: Any

    @property
    def torque(self) -> Array:
        """Torque of the servos, N m or N."""
        return servo_torque(self.controller, self.log)

    def with_findings(self, findings: Iterable[Finding], n_joints: int) -> Servos:
        """Servos with the settings that were found."""
        return Servos(with_settings(self.controller, findings, n_joints), self.log)


def split_kinds(kinds: Iterable[str], of_servos: bool) -> tuple[list[str], list[str]]:
    """Kinds of torques, and kinds of settings of servos.

    Parameters
    ----------
    kinds : iterable of str
        Kinds of the catalogue that were asked for.
    of_servos : bool
        Whether the torque is computed from servos.
    """
    torques: list[str] = []
    settings: list[str] = []
    for kind in kinds:
        (settings if get_effect(kind).of_servo else torques).append(kind)
    if settings and not torques and not of_servos:
        raise EffectError(
            f"{settings[0]} is a setting of position servos and not seen in a measured torque; "
            "leave out tau and give controller=Controller(...)"
        )
    return torques, settings


def settings_found(measurement: Measurement, servos: Servos, kinds: Sequence[str]) -> list[Finding]:
    """Settings of the servos that differ from the stated ones.

    Parameters
    ----------
    measurement : Measurement
        Motion, and the torque computed from the servos as stated.
    servos : Servos
        The servos as stated.
    kinds : sequence of str
        Kinds of settings to try.
    """
    if not kinds:
        return []
    stiffness = servos.controller.checked(measurement.n_joints).stiffness
    found = [s for s in servo_settings(measurement, stiffness) if s.kind in kinds]
    return [_finding(s, measurement, len(kinds)) for s in found]


def setting_of(finding: Finding) -> Setting | None:
    """The setting of a servo that a finding is about; None for a torque of the model."""
    if finding.kind == "unknown" or not get_effect(finding.kind).of_servo:
        return None
    values = {name: row["value"] for name, row in finding.parameters.items()}
    return Setting(finding.joints[0], values)


def as_stated(
    controller: Controller, stated: Controller, findings: Iterable[Finding], n_joints: int
) -> Controller:
    """Controller with the stated values of the settings that were found to be different."""
    given = stated.checked(n_joints)
    for setting in filter(None, map(setting_of, findings)):
        values = {name: float(getattr(given, name)[setting.joint - 1]) for name in setting.values}
        controller = controller.with_joint(n_joints, setting.joint, **values)
    return controller


def with_settings(controller: Controller, findings: Iterable[Finding], n_joints: int) -> Controller:
    """Controller with the settings that were found; other findings are ignored."""
    for setting in filter(None, map(setting_of, findings)):
        controller = controller.with_joint(n_joints, setting.joint, **setting.values)
    return controller


def _finding(setting: ServoSetting, measurement: Measurement, n_tried: int) -> Finding:
    effect, joints = get_effect(setting.kind), (setting.joint + 1,)
    robot = measurement.robot
    slides = robot is not None and robot.joint_types[setting.joint] == "prismatic"
    units = effect.units(slides)
    parameters = {
        name: {"value": value, "low": low, "high": high, "unit": units[name]}
        for name, (value, low, high) in setting.parameters.items()
    }
    tried = measurement.n_joints * n_tried
    q_value = None if setting.chance is None else min(1.0, setting.chance * tried)
    told = told_briefly(effect.title, joints, None, parameters)
    sentence = f"{told}: {setting.evidence}."
    return Finding(
        setting.kind,
        effect.title,
        joints,
        parameters,
        (),
        setting.error_drop,
        q_value,
        (),
        effect.separating_motion,
        " ".join([sentence, *notes(setting.kind, parameters)]),
        f'model = diagnosis.add("{setting.kind}", joints={list(joints)})',
        (),
    )
