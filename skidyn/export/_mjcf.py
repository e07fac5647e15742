# SPDX-License-Identifier: BSD-3-Clause
"""A robot with identified parameters as an MJCF model of MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from skidyn._exceptions import SkidynError
from skidyn.export._bodies import (
    MUJOCO,
    central_inertia,
    described,
    mjcf_inertial,
    mujoco_attributes,
    numbers,
)
from skidyn.export._files import PathLike, write_files
from skidyn.export._series import series_joints
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: MuJoCo refuses moving bodies with less mass (kg) or inertia (kg m^2).
_SMALLEST = 1e-15


def write_mjcf(model: RBDRegressor | Robot, path: PathLike) -> tuple[str, ...]:
    """Write an MJCF model with the identified inertial parameters, friction and springs.

    Viscous and Coulomb friction become ``damping`` and ``frictionloss``, rotor inertia
    ``armature``, a spring ``stiffness`` and ``springref``; links fixed to a body become sites,
    joints that mimic another are coupled to it by an equality constraint. Joint elasticity and
    backlash become passive joints in series, as in :func:`merge_mjcf`. Other effects are written to
    ``<path>.skidyn.json``.

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
        Names of the effects that the MJCF cannot represent; empty if there are none.

    Raises
    ------
    SkidynError
        A body has no positive mass, or a physically inconsistent inertia; or the model is not
        fitted.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm
    >>> from skidyn.export import write_mjcf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mjcf(load_planar_arm(), pathlib.Path(folder) / "arm.xml")
    ()
    """
    own = described(model, MUJOCO)
    robot, values = own.robot, own.parameters
    dynamics = mujoco_attributes(own)
    series, reasons = series_joints(model, own)
    passive = {joint.place: joint for joint in series.values()}
    root = ElementTree.Element("mujoco", model=robot.name)
    # Angles and inertias are used unchanged: nothing is derived from shapes or rounded.
    ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    ElementTree.SubElement(root, "option", gravity=numbers(robot.gravity))
    world = ElementTree.SubElement(root, "worldbody")
    elements: list[ElementTree.Element] = []
    for body in range(robot.n_bodies):
        parent = int(robot.tree.parents[body])
        carrier = elements[parent] if parent >= 0 else world
        element = _add_body(carrier, robot, body, values[body], dynamics)
        elements.append(element)
        place = int(robot.tree.coordinates[body])
        if place in passive:
            motor = element[-1].attrib
            placed = {key: motor[key] for key in ("type", "axis")}
            ElementTree.SubElement(element, "joint", placed | passive[place].attributes())
    _add_sites(world, elements, robot)
    _add_ties(root, robot)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, "unicode") + "\n"
    left = [term for term in own.left if term not in series]
    return write_files(path, text, model, left, reasons)


def _add_body(
    carrier: ElementTree.Element,
    robot: Robot,
    body: int,
    parameters: np.ndarray,
    dynamics: dict[str, np.ndarray],
) -> ElementTree.Element:
    tree, name = robot.tree, robot.body_names[body]
    pose = _pose(tree.rotations[body], tree.translations[body])
    element = ElementTree.SubElement(carrier, "body", {"name": name, **pose})
    central = central_inertia(parameters, name)
    if central is None:
        raise SkidynError(f"Body {name!r} has no mass; MuJoCo refuses moving bodies without mass.")
    moments = np.linalg.eigvalsh(central.inertia)
    if moments[0] < _SMALLEST or moments[0] + moments[1] < moments[2] * (1 - 1e-9):
        raise SkidynError(
            f"Body {name!r} has the principal moments {', '.join(f'{m:.3g}' for m in moments)} kg "
            "m^2, which violate the triangle inequality or vanish; MuJoCo refuses them. Identify "
            "physically consistent parameters, RBDRegressor(..., consistent=True), on the "
            "command line --consistent."
        )
    element.append(mjcf_inertial(central))
    j = int(tree.coordinates[body])
    own = robot.body_joints[body] == robot.joint_names[j]
    joint = ElementTree.SubElement(
        element,
        "joint",
        name=robot.body_joints[body],
        type="slide" if tree.prismatic[body] else "hinge",
        axis=numbers(tree.axes[body]),
    )
    limits = robot.position_limits[j]
    if own and np.isfinite(limits).all() and limits[0] < limits[1]:
        joint.set("limited", "true")
        joint.set("range", numbers(limits))
    for key, values in dynamics.items() if own else ():
        joint.set(key, numbers(values[j]))
    return element


def _add_sites(
    world: ElementTree.Element, elements: list[ElementTree.Element], robot: Robot
) -> None:
    """Frames of the fixed links."""
    for name, placement in robot.links.items():
        if name not in robot.body_names:
            carrier = elements[placement.body] if placement.body >= 0 else world
            pose = _pose(placement.rotation, placement.translation)
            ElementTree.SubElement(carrier, "site", {"name": name, **pose})


def _add_ties(root: ElementTree.Element, robot: Robot) -> None:
    """Equality constraints of the joints that mimic another."""
    tree = robot.tree
    followers = [
        body
        for body in range(robot.n_bodies)
        if robot.body_joints[body] != robot.joint_names[tree.coordinates[body]]
    ]
    if followers:
        ties = ElementTree.SubElement(root, "equality")
        for body in followers:
            ElementTree.SubElement(
                ties,
                "joint",
                joint1=robot.body_joints[body],
                joint2=robot.joint_names[tree.coordinates[body]],
                polycoef=numbers([tree.offsets[body], tree.multipliers[body], 0, 0, 0]),
            )


def _pose(rotation: np.ndarray, translation: np.ndarray) -> dict[str, str]:
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    return {"pos": numbers(translation), "quat": numbers([w, x, y, z])}
