# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of the URDF and MJCF writers: supported effects, central inertias, numbers."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn.dynamics import central_parts, inertial_vector
from skidyn.effects import Term, get_effect
from skidyn.export._model import check_model, is_carried, is_lasting
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot


@dataclass(frozen=True)
class CentralInertia:
    """Mass (kg), center of mass (m) in the body frame, and inertia (kg m^2) about it."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray


def central_inertia(parameters: np.ndarray, body: str) -> CentralInertia | None:
    """Inertia about the center of mass; None for a body without mass.

    A SkidynError is raised if the parameters are impossible: neither format can represent them.
    """
    mass, center, central = central_parts(parameters)
    if not np.any(parameters):
        return None
    if mass <= 0.0:
        raise SkidynError(
            f"Body {body!r} has a mass of {mass:g} kg; the format needs a positive one. Identify "
            "physically consistent parameters: RBDRegressor(..., consistent=True), on the command "
            "line --consistent."
        )
    moments = np.linalg.eigvalsh(central)
    if moments[0] < -1e-9 * max(abs(moments[-1]), 1e-9):
        raise SkidynError(
            f"Body {body!r} has the principal moments {', '.join(f'{m:.3g}' for m in moments)} kg "
            "m^2 about its center of mass; physical bodies have none that is negative. Identify "
            "physically consistent parameters: RBDRegressor(..., consistent=True), on the "
            "command line --consistent."
        )
    return CentralInertia(mass, center, (central + central.T) / 2)


def urdf_inertial(central: CentralInertia) -> ElementTree.Element:
    """The ``<inertial>`` of a link, in its frame."""
    element = ElementTree.Element("inertial")
    ElementTree.SubElement(element, "origin", xyz=numbers(central.center), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=numbers(central.mass))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    entries = central.inertia[np.triu_indices(3)]
    moments = {key: numbers(x) for key, x in zip(names, entries, strict=True)}
    ElementTree.SubElement(element, "inertia", moments)
    return element


def mjcf_inertial(central: CentralInertia) -> ElementTree.Element:
    """The ``<inertial>`` of a body, in its frame."""
    I = central.inertia
    return ElementTree.Element(
        "inertial",
        pos=numbers(central.center),
        mass=numbers(central.mass),
        fullinertia=numbers([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]),
    )


def about_origin(mass: float, center: np.ndarray, central: np.ndarray) -> np.ndarray:
    """The ten parameters from mass, centre of mass and the inertia about it."""
    inertia = central + mass * (center @ center * np.eye(3) - np.outer(center, center))
    return inertial_vector(mass, mass * center, inertia)


@dataclass(frozen=True)
class Description:
    """Parts of a model that a description of bodies and joints can represent.

    Inertial ``parameters`` have a permanent payload as part of the last body. ``joints`` are
    coefficients, (n_joints, n_coefficients), of the kinds for which the format has fields; ``left``
    are effects for which it has none.
    """

    robot: Robot
    parameters: np.ndarray
    joints: dict[str, np.ndarray]
    left: list[Term]


def described(model: RBDRegressor | Robot, kinds: tuple[str, ...]) -> Description:
    """Split the effects of a model into those for which a format has a field and the others."""
    check_model(model)
    robot = model if isinstance(model, Robot) else model.robot_
    sizes = {kind: len(get_effect(kind).coefficients) for kind in kinds}
    joints = {kind: np.zeros((robot.n_joints, size)) for kind, size in sizes.items()}
    if isinstance(model, Robot):
        for kind, field in (("viscous", "damping"), ("coulomb", "friction")):
            joints[kind][:, 0] = robot.joint_dynamics[field]
        return Description(robot, robot.inertial_parameters, joints, [])
    parameters, left = model.inertial_parameters_.copy(), []
    for term in model.effect_terms_:
        values = model.effect_coefficients_[term]
        if is_carried(term):
            parameters[-1] += values
        # No format has negative friction or springs, a spring of one recording, or an inertia that
        # varies.
        elif sizes.get(term.kind) == len(values) and values[0] >= 0.0 and is_lasting(term):
            joints[term.kind][term.places[0]] += values
        else:
            left.append(term)
    return Description(robot, parameters, joints, left)


#: Effects that a joint of MuJoCo has.
MUJOCO = ("viscous", "coulomb", "rotor_inertia", "spring")


def mujoco_attributes(own: Description) -> dict[str, np.ndarray]:
    """Attributes of MuJoCo's joints, (n_joints,) each, from the effects in :data:`MUJOCO`."""
    stiffness, torque = own.joints["spring"].T
    return {
        "damping": own.joints["viscous"][:, 0],
        "frictionloss": own.joints["coulomb"][:, 0],
        "armature": own.joints["rotor_inertia"][:, 0],
        "stiffness": stiffness,
        "springref": -torque / np.where(stiffness > 0.0, stiffness, np.inf),
    }


def numbers(values: Any) -> str:
    """Numbers as text from which the same doubles are read."""
    return " ".join(repr(float(value) + 0.0) for value in np.ravel(values))
