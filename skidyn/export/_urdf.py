# SPDX-License-Identifier: BSD-3-Clause
"""A robot with identified parameters as a URDF."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np

from skidyn.export._bodies import central_inertia, described, numbers, urdf_inertial
from skidyn.export._files import PathLike, write_files
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot


def write_urdf(model: RBDRegressor | Robot, path: PathLike) -> tuple[str, ...]:
    """Write a URDF with the identified inertial parameters and friction.

    Links that are fixed to a moving body become frames without mass; their mass is in the body.
    Visual and collision shapes are not written. A URDF can represent viscous and Coulomb friction
    (``<dynamics damping friction>``); other effects are written to ``<path>.skidyn.json``.

    Parameters
    ----------
    model : RBDRegressor or Robot
        Fitted model, or a robot as described. For parameters identified by other means, use a copy
        of the robot, ``dataclasses.replace(robot, inertial_parameters=...)``.
    path : path
        File to write.

    Returns
    -------
    tuple of str
        Names of the effects that the URDF cannot represent; empty if there are none.

    Raises
    ------
    SkidynError
        A body has no positive mass or no positive definite inertia, or the model is not fitted.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import write_urdf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_urdf(load_planar_arm(), pathlib.Path(folder) / "arm.urdf")
    ()
    """
    own = described(model, ("viscous", "coulomb"))
    robot = own.robot
    root = ElementTree.Element("robot", name=robot.name)
    for name, placement in robot.links.items():
        link = ElementTree.SubElement(root, "link", name=name)
        if placement.body >= 0 and robot.body_names[placement.body] == name:
            central = central_inertia(own.parameters[placement.body], name)
            if central is not None:
                link.append(urdf_inertial(central))
    for body in range(robot.n_bodies):
        _add_joint(root, robot, body, own.joints["viscous"][:, 0], own.joints["coulomb"][:, 0])
    _add_fixed_links(root, robot)
    ElementTree.indent(root)
    text = '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"
    return write_files(path, text, model, own.left)


def _root_link(robot: Robot) -> str:
    return next(iter(robot.links))


def _add_joint(
    root: ElementTree.Element, robot: Robot, body: int, damping: np.ndarray, friction: np.ndarray
) -> None:
    tree = robot.tree
    j, name = int(tree.coordinates[body]), robot.body_joints[body]
    follows = name != robot.joint_names[j]
    kind = robot.joint_types[j]
    if follows:  # the limits of a mimic joint are those of its leader
        kind = "prismatic" if tree.prismatic[body] else "continuous"
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    parent = int(tree.parents[body])
    _add_ends(
        joint,
        robot.body_names[parent] if parent >= 0 else _root_link(robot),
        robot.body_names[body],
        tree.rotations[body],
        tree.translations[body],
    )
    ElementTree.SubElement(joint, "axis", xyz=numbers(tree.axes[body]))
    if follows:
        ElementTree.SubElement(
            joint,
            "mimic",
            joint=robot.joint_names[j],
            multiplier=numbers(tree.multipliers[body]),
            offset=numbers(tree.offsets[body]),
        )
    lower, upper = robot.position_limits[j]
    limits = {"velocity": robot.velocity_limits[j], "effort": robot.effort_limits[j]}
    if kind == "prismatic" or (kind == "revolute" and not follows):
        low, high = sorted(tree.multipliers[body] * x + tree.offsets[body] for x in (lower, upper))
        limits |= {"lower": low, "upper": high} if np.isfinite([low, high]).all() else {}
    if np.isfinite(list(limits.values())).all():
        ElementTree.SubElement(joint, "limit", {k: numbers(x) for k, x in limits.items()})
    if not follows:
        dynamics = {"damping": numbers(damping[j]), "friction": numbers(friction[j])}
        ElementTree.SubElement(joint, "dynamics", dynamics)


def _add_fixed_links(root: ElementTree.Element, robot: Robot) -> None:
    for name, placement in robot.links.items():
        carrier = _root_link(robot) if placement.body < 0 else robot.body_names[placement.body]
        if name != carrier:
            joint = ElementTree.SubElement(root, "joint", name=f"{name}_fixed", type="fixed")
            _add_ends(joint, carrier, name, placement.rotation, placement.translation)


def _add_ends(
    joint: ElementTree.Element,
    parent: str,
    child: str,
    rotation: np.ndarray,
    translation: np.ndarray,
) -> None:
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(
        joint, "origin", xyz=numbers(translation), rpy=numbers(_rpy_from_rotation(rotation))
    )


def _rpy_from_rotation(rotation: np.ndarray) -> tuple[float, float, float]:
    """Fixed-axis roll, pitch and yaw in rad."""
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    if np.hypot(rotation[0, 0], rotation[1, 0]) < 1e-12:
        # Pitch is +-90 degrees: only the difference or sum of the other two matters.
        return float(np.arctan2(-rotation[1, 2], rotation[1, 1])), float(pitch), 0.0
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    return float(roll), float(pitch), float(yaw)
