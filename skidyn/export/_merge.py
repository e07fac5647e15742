# SPDX-License-Identifier: BSD-3-Clause
"""Identified numbers in a user's own URDF or MJCF, with all other bytes unchanged."""

from __future__ import annotations

import os
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional
from skidyn.dynamics import transform_inertial
from skidyn.export._bodies import (
    MUJOCO,
    Description,
    about_origin,
    central_inertia,
    described,
    mjcf_inertial,
    mujoco_attributes,
    numbers,
    urdf_inertial,
)
from skidyn.export._edits import Edits, Element
from skidyn.export._files import PathLike, write_files
from skidyn.export._series import insert_series, series_joints
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: Number of poses at which the kinematics are compared, and permitted differences (m, rad).
_POSES, _ALIKE = 7, 1e-5
#: Relative change of a number below which its text is not changed.
_SAME = 1e-12


def merge_urdf(
    model: RBDRegressor, source: str | os.PathLike[str], path: PathLike
) -> tuple[str, ...]:
    """Write the identified numbers into a copy of the robot's own URDF.

    Changed are the ``<inertial>`` of links that a joint moves, and ``<dynamics>`` of their joints;
    pictures, collision shapes, comments, transmissions and every other byte are unchanged. For
    links that are fixed to each other, the identified parameters are written to the link that the
    joint moves; the others keep theirs.

    Parameters
    ----------
    model : RBDRegressor
        Fitted model.
    source : path
        The URDF from which its robot was read.
    path : path
        File to write; may be the same.

    Returns
    -------
    tuple of str
        Names of the effects that a URDF cannot represent, which are written to
        ``<path>.skidyn.json``.

    Raises
    ------
    SkidynError
        The file is not that of the model's robot, or a link would get a physically inconsistent
        inertia.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from importlib.resources import files
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.export import merge_urdf
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> model = RBDRegressor(log.robot, consistent=True).fit(log.X, log.y)
    >>> own = files("skidyn.datasets").joinpath("robots", "planar_arm.urdf")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     merge_urdf(model, own, pathlib.Path(folder) / "arm.urdf")
    ()
    """
    own = described(model, ("viscous", "coulomb"))
    robot, edits = own.robot, Edits(source)
    given = Robot.from_urdf(edits.data, joints=robot.joint_names, gravity=tuple(robot.gravity))
    if given.joint_names != robot.joint_names or not np.allclose(
        given.inertial_parameters, robot.inertial_parameters, rtol=1e-9, atol=1e-12
    ):
        raise SkidynError(
            f"{edits.path} is not the URDF from which the robot of the model was read: joints or "
            "inertial parameters differ"
        )
    links = {e.attributes.get("name"): e for e in edits.root.children if e.tag == "link"}
    joints = {e.attributes.get("name"): e for e in edits.root.children if e.tag == "joint"}
    for body, name in enumerate(robot.body_names):
        change = own.parameters[body] - robot.inertial_parameters[body]
        if np.abs(change).max() <= _SAME * (np.abs(own.parameters[body]).max() + 1e-300):
            continue
        link = links[name]
        inertial = link.find("inertial")
        central = central_inertia(_urdf_inertial(inertial) + change, name)
        text = "" if central is None else _text(urdf_inertial(central))
        if inertial is not None:
            edits.replace(inertial, text)
        elif text:
            edits.insert_first(link, text)
    for j, name in enumerate(robot.joint_names):
        values = {
            "damping": float(own.joints["viscous"][j, 0]),
            "friction": float(own.joints["coulomb"][j, 0]),
        }
        given_values = {k: float(robot.joint_dynamics[k][j]) for k in values}
        new = {k: numbers(v) for k, v in values.items() if v != given_values[k]}
        dynamics = joints[name].find("dynamics")
        if new and dynamics is not None:
            edits.set_attributes(dynamics, new)
        elif new:
            written = " ".join(f'{k}="{v}"' for k, v in new.items())
            edits.insert_first(joints[name], f"<dynamics {written}/>")
    return write_files(path, edits.text(), model, own.left)


def _urdf_inertial(element: Element | None) -> np.ndarray:
    """Parameters of an ``<inertial>`` in the frame of its link."""
    if element is None:
        return np.zeros(10)

    def read(tag: str, name: str, default: str) -> np.ndarray:
        child = element.find(tag)
        text = default if child is None else child.attributes.get(name, default)
        return np.array([float(x) for x in text.split()])

    mass = read("mass", "value", "0")[0]
    center, angles = read("origin", "xyz", "0 0 0"), read("origin", "rpy", "0 0 0")
    xx, xy, xz, yy, yz, zz = (
        read("inertia", name, "0")[0] for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return about_origin(mass, center, inertia)


def _text(element: ElementTree.Element) -> str:
    return ElementTree.tostring(element, "unicode").replace(" />", "/>")


def merge_mjcf(
    model: RBDRegressor, source: str | os.PathLike[str], path: PathLike
) -> tuple[str, ...]:
    """Write the identified numbers into a copy of the user's own MJCF.

    Changed are, for the joints of the model's robot, found by name: ``damping``, ``frictionloss``,
    ``armature``, ``stiffness`` and ``springref``, if their values differ; and the ``<inertial>`` of
    the bodies that they move. Actuators, sensors, geoms, defaults, comments and every other byte
    are unchanged. Frames of bodies may differ from those of the URDF; the axes of the joints are
    compared at several poses. Needs MuJoCo (``pip install skidyn[mujoco]``).

    Joint elasticity and backlash become a passive joint in series, right after that of the motor in
    the same body, named ``<joint>_elasticity`` or ``<joint>_backlash``. As in the effects, the
    logged position is that of the motor: the joint of the file keeps its name, actuator, sensors,
    friction and armature as the motor's side, and the position of the link is the sum of both. An
    elastic gear has ``stiffness`` and ``damping``; its resonance follows from the stiffness and the
    inertia of the link, while the effect has a fitted one. A gap has a ``range`` of half the play
    to either side, whose ends are as soft as MuJoCo's limits. Passive joints of an earlier export
    are replaced, and stay if the model has none. Keyframes store a number for every joint and are
    not changed: in a file with keyframes the effect is left out and the keyframe is named.

    Parameters
    ----------
    model : RBDRegressor
        Fitted model.
    source : path
        An MJCF with the joints of the model's robot in this one file.
    path : path
        File to write. Files referenced by relative paths have to be reachable from there.

    Returns
    -------
    tuple of str
        Names of the effects that MJCF cannot represent, which are written to
        ``<path>.skidyn.json``, with a reason for elasticity and backlash.

    Raises
    ------
    SkidynError
        A joint is not in the file, the kinematics differ, the name of a passive joint is taken, or
        a body would get a physically inconsistent inertia.
    ImportError
        MuJoCo is not installed.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> from skidyn.export import merge_mjcf, write_mjcf
    >>> from skidyn.identification import RBDRegressor
    >>> log = make_hidden_effect_log(load_planar_arm(), None)
    >>> model = RBDRegressor(log.robot, consistent=True).fit(log.X, log.y)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     own = pathlib.Path(folder, "own.xml")
    ...     _ = write_mjcf(log.robot, own)
    ...     merge_mjcf(model, own, pathlib.Path(folder, "identified.xml"))
    ()
    """
    mujoco = import_optional("mujoco", extra="mujoco")
    own = described(model, MUJOCO)
    robot, edits = own.robot, Edits(source)
    compiler = edits.root.find("compiler")
    settings = {} if compiler is None else compiler.attributes
    if settings.get("inertiafromgeom") == "true":
        raise SkidynError(
            f'{edits.path} says <compiler inertiafromgeom="true"/>, by which MuJoCo ignores '
            'every <inertial>; change it to "auto"'
        )
    world = mujoco.MjModel.from_xml_path(str(edits.path))
    joints, bodies = _joints_in_bodies(edits.root)
    needed = dict.fromkeys([*robot.joint_names, *robot.body_joints])
    lost = [name for name in needed if name not in joints]
    if lost:
        raise SkidynError(
            f"{edits.path} has no joint {lost[0]!r} with this name in the file itself; the robot "
            f"has {', '.join(needed)}"
        )
    frames = _frames(mujoco, world, robot, edits.path)
    _set_joints(edits, mujoco, world, own, joints, settings.get("angle", "degree") == "degree")
    _set_bodies(edits, mujoco, world, own, bodies, frames)
    series, reasons = series_joints(model, own)
    names = {world.joint(k).name for k in range(world.njnt)}
    reasons |= insert_series(edits, joints, bodies, names, world.nkey, series, robot)
    data = edits.text()
    _check_loads(mujoco, data, edits.path)
    return write_files(path, data, model, [t for t in own.left if t not in series], reasons)


def _set_joints(
    edits: Edits,
    mujoco: Any,
    world: Any,
    own: Description,
    joints: dict[str, Element],
    degrees: bool,
) -> None:
    """Identified numbers of the joints, where they differ from those of the file."""
    robot, wanted = own.robot, mujoco_attributes(own)
    for j, name in enumerate(robot.joint_names):
        index = mujoco.mj_name2id(world, mujoco.mjtObj.mjOBJ_JOINT, name)
        dof, place = world.jnt_dofadr[index], world.jnt_qposadr[index]
        given = {
            "damping": np.ravel(world.dof_damping[dof])[0],
            "frictionloss": world.dof_frictionloss[dof],
            "armature": world.dof_armature[dof],
            "stiffness": np.ravel(world.jnt_stiffness[index])[0],
            "springref": world.qpos_spring[place] if wanted["stiffness"][j] > 0 else 0.0,
        }
        new = {}
        for key, values in wanted.items():
            if abs(values[j] - given[key]) > _SAME * (1.0 + abs(given[key])):
                turns = key == "springref" and degrees and robot.joint_types[j] != "prismatic"
                new[key] = numbers(np.rad2deg(values[j]) if turns else values[j])
        if new:
            edits.set_attributes(joints[name], new)


def _set_bodies(
    edits: Edits,
    mujoco: Any,
    world: Any,
    own: Description,
    bodies: dict[str, Element],
    frames: list[tuple[np.ndarray, np.ndarray]],
) -> None:
    """Identified inertia of the bodies, in their frames."""
    for body, name in enumerate(own.robot.body_joints):
        index = mujoco.mj_name2id(world, mujoco.mjtObj.mjOBJ_JOINT, name)
        carrier = int(world.jnt_bodyid[index])
        # The body's own share is the identified parameters minus those of the bodies that are
        # welded to it, which are not changed.
        rotation, translation = frames[body]
        moved = transform_inertial(own.parameters[body], rotation, translation)
        rest = _welded(mujoco, world, carrier)
        text = _mjcf_text(moved - rest, world.body(carrier).name or name)
        element = bodies[name]
        inertial = element.find("inertial")
        if inertial is not None:
            edits.replace(inertial, text)
        else:
            edits.insert_first(element, text)


def _joints_in_bodies(root: Element) -> tuple[dict[str, Element], dict[str, Element]]:
    """Elements of the named joints, and of the bodies with these joints, by name of the joint."""
    joints, bodies = {}, {}
    world = [element for element in root.children if element.tag == "worldbody"]
    for element in (e for w in world for e in w.walk()):
        if element.tag != "body":
            continue
        for child in element.children:
            if child.tag == "joint" and "name" in child.attributes:
                joints[child.attributes["name"]] = child
                bodies[child.attributes["name"]] = element
    return joints, bodies


def _frames(
    mujoco: Any, world: Any, robot: Robot, path: Path
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Pose of every body of the robot in the frame of the MJCF's body, the same at all poses."""
    index = [
        mujoco.mj_name2id(world, mujoco.mjtObj.mjOBJ_JOINT, name) for name in robot.body_joints
    ]
    carriers = [int(world.jnt_bodyid[i]) for i in index]
    own = [mujoco.mj_name2id(world, mujoco.mjtObj.mjOBJ_JOINT, name) for name in robot.joint_names]
    rng, data = np.random.default_rng(0), mujoco.MjData(world)
    poses = rng.uniform(-1.0, 1.0, (_POSES, robot.n_joints))
    base = int(world.body_parentid[carriers[0]])
    found = []
    for q in poses:
        mujoco.mj_resetData(world, data)
        data.qpos[world.jnt_qposadr[own]] = q
        for body, follower in enumerate(index):  # joints that mimic another
            j = int(robot.tree.coordinates[body])
            data.qpos[world.jnt_qposadr[follower]] = (
                robot.tree.multipliers[body] * q[j] + robot.tree.offsets[body]
            )
        mujoco.mj_kinematics(world, data)
        turn, shift = data.xmat[base].reshape(3, 3), data.xpos[base]
        relative = []
        for name, carrier in zip(robot.body_names, carriers, strict=True):
            position, rotation = (x[0] for x in robot.forward_kinematics(q[None], name))
            there = data.xmat[carrier].reshape(3, 3)
            # The base of the robot is the body that carries its first joint.
            relative.append(
                (
                    there.T @ turn @ rotation,
                    there.T @ (turn @ position + shift - data.xpos[carrier]),
                )
            )
        found.append(relative)
    for body, name in enumerate(robot.body_names):
        first = found[0][body]
        apart = max(
            max(np.abs(r - first[0]).max(), np.abs(t - first[1]).max())
            for r, t in (poses[body] for poses in found)
        )
        if apart > _ALIKE:
            raise SkidynError(
                f"{path}: joint {robot.body_joints[body]!r} does not move its body in the same "
                f"way as the robot moves {name!r} (apart by {apart:.2g} rad or m). Axis, zero "
                "position, and the frame of the body below the first joint have to agree with "
                "the base of the URDF"
            )
    return found[0]


def _welded(mujoco: Any, world: Any, carrier: int) -> np.ndarray:
    """Parameters of all bodies that are welded to a body, in its frame, without its own."""
    total = np.zeros(10)
    data = mujoco.MjData(world)
    mujoco.mj_kinematics(world, data)
    turn, origin = data.xmat[carrier].reshape(3, 3), data.xpos[carrier]
    for other in range(world.nbody):
        if other == carrier or int(world.body_weldid[other]) != carrier:
            continue
        own = np.zeros(9)
        mujoco.mju_quat2Mat(own, world.body_iquat[other])
        axes = turn.T @ data.xmat[other].reshape(3, 3) @ own.reshape(3, 3)
        here = data.xmat[other].reshape(3, 3) @ world.body_ipos[other] + data.xpos[other]
        center = turn.T @ (here - origin)
        inertia = axes @ np.diag(world.body_inertia[other]) @ axes.T
        total += about_origin(float(world.body_mass[other]), center, inertia)
    return total


def _mjcf_text(parameters: np.ndarray, name: str) -> str:
    central = central_inertia(parameters, name)
    if central is None:
        raise SkidynError(
            f"Body {name!r} would have no mass; MuJoCo refuses moving bodies without mass."
        )
    return _text(mjcf_inertial(central))


def _check_loads(mujoco: Any, data: bytes, source: Path) -> None:
    """Test the result with MuJoCo in the folder of the source, to which it may refer."""
    with tempfile.NamedTemporaryFile(suffix=".xml", dir=source.parent) as trial:
        trial.write(data)
        trial.flush()
        try:
            mujoco.MjModel.from_xml_path(trial.name)
        except ValueError as error:
            raise SkidynError(
                f"MuJoCo refuses {source} with the identified parameters: {error}. Identify "
                "physically consistent parameters: RBDRegressor(..., consistent=True)"
            ) from None
