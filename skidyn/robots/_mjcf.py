# SPDX-License-Identifier: BSD-3-Clause
"""Links and joints of an MJCF model compiled by MuJoCo."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from skidyn._exceptions import RobotDescriptionError, RobotDescriptionWarning
from skidyn._optional import import_optional
from skidyn.robots._description import (
    Description,
    Joint,
    Link,
    Mimic,
    between,
    fixed_joint,
    link_of,
)
from skidyn.robots._xml import is_text, parse_xml, read_description


def parse_mjcf(source: str | bytes | os.PathLike[str]) -> tuple[Description, np.ndarray]:
    """Description of an MJCF model, and its gravity in the frame of the world, m/s^2.

    A RobotDescriptionError is raised if MuJoCo cannot compile the model, or a joint is neither a
    hinge nor a slide.
    """
    mujoco = import_optional("mujoco", extra="mujoco")
    data = read_description(source)
    parse_xml(data)
    try:
        if is_text(source):
            model = mujoco.MjModel.from_xml_string(data.decode())
        else:  # by its path, so that included files and meshes are found
            model = mujoco.MjModel.from_xml_path(str(Path(source)))  # type: ignore[arg-type]
    except ValueError as error:
        raise RobotDescriptionError(
            f"MuJoCo cannot compile the model: {' '.join(str(error).split())}."
        ) from error
    return _read(mujoco, model), np.array(model.opt.gravity)


def _read(mujoco: Any, model: Any) -> Description:
    bodies = [model.body(b).name or f"body{b}" for b in range(model.nbody)]
    followers = _followers(mujoco, model)
    links: dict[str, Link] = {}
    joints: dict[str, Joint] = {}
    for b, name in enumerate(bodies):
        links[name] = link_of(
            name,
            float(model.body_mass[b]),
            np.diag(model.body_inertia[b]),
            _rotation(mujoco, model.body_iquat[b]),
            np.array(model.body_ipos[b]),
        )
        if b == 0:
            continue
        carrier = bodies[model.body_parentid[b]]
        pose = _rotation(mujoco, model.body_quat[b]), np.array(model.body_pos[b])
        first = int(model.body_jntadr[b])
        chosen = range(first, first + int(model.body_jntnum[b]))
        for j in chosen:
            joint, anchor = _joint(mujoco, model, j, followers)
            last = j == chosen[-1] and not np.any(anchor)
            child = name if last else f"{joint.name}_frame"
            if child != name:
                links[child] = Link(child, np.zeros(10))
            joints[joint.name] = between(joint, carrier, child, pose)
            carrier, pose = child, (np.eye(3), -anchor)
        if carrier != name:
            joints[f"{name}_fixed"] = fixed_joint(f"{name}_fixed", carrier, name, pose)
    for s in range(model.nsite):
        name = model.site(s).name or f"site{s}"
        name = f"{name}_site" if name in links else name
        links[name] = Link(name, np.zeros(10))
        pose = _rotation(mujoco, model.site_quat[s]), np.array(model.site_pos[s])
        carrier = bodies[model.site_bodyid[s]]
        joints[f"{name}_fixed"] = fixed_joint(f"{name}_fixed", carrier, name, pose)
    name = model.names[: model.names.index(b"\0")].decode() or "robot"
    return Description(name, links, joints)


def _rotation(mujoco: Any, quaternion: Any) -> np.ndarray:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.array(quaternion, dtype=np.float64))
    return matrix.reshape(3, 3)


def _name(model: Any, j: int) -> str:
    return str(model.joint(j).name or f"joint{j}")


def _joint(
    mujoco: Any, model: Any, j: int, followers: dict[int, Mimic]
) -> tuple[Joint, np.ndarray]:
    """A joint in the frame of its body, and the point of the body about which it turns."""
    name, kind, dof = _name(model, j), model.jnt_type[j], int(model.jnt_dofadr[j])
    slide = kind == mujoco.mjtJoint.mjJNT_SLIDE
    if not slide and kind != mujoco.mjtJoint.mjJNT_HINGE:
        raise RobotDescriptionError(
            f"The joint {name!r} is a ball or a free joint; supported are hinge and slide. Remove "
            "the free joint of the base: the base of the robot is fixed."
        )
    for what, value in (
        ("armature", model.dof_armature[dof]),
        ("spring", np.ravel(model.jnt_stiffness[j])[0]),
    ):
        if value:
            warnings.warn(
                f"The {what} of joint {name!r} is not part of the rigid body and is left out; use "
                f"the effect {'rotor_inertia' if what == 'armature' else 'spring'!r} instead.",
                RobotDescriptionWarning,
                stacklevel=2,
            )
    limits = tuple(map(float, model.jnt_range[j])) if model.jnt_limited[j] else (-np.inf, np.inf)
    forces = model.jnt_actfrcrange[j] if model.jnt_actfrclimited[j] else (-np.inf, np.inf)
    axis = np.array(model.jnt_axis[j])
    reference = float(model.qpos0[model.jnt_qposadr[j]])
    joint = Joint(
        name=name,
        kind="prismatic" if slide else "revolute" if model.jnt_limited[j] else "continuous",
        axis=axis / np.linalg.norm(axis),
        position_limits=limits,  # type: ignore[arg-type]
        velocity_limit=np.inf,
        effort_limit=float(np.max(np.abs(forces))),
        damping=float(np.ravel(model.dof_damping[dof])[0]),
        friction=float(np.ravel(model.dof_frictionloss[dof])[0]),
        mimic=followers.get(j),
    )
    # The body has its pose in the file when the joint is at its reference.
    rotation, translation = joint.placement(-reference)
    anchor = np.zeros(3) if slide else np.array(model.jnt_pos[j])
    return replace(joint, rotation=rotation, translation=translation + anchor), anchor


def _followers(mujoco: Any, model: Any) -> dict[int, Mimic]:
    """Joints that are coupled to another one by a linear equality."""
    found: dict[int, Mimic] = {}
    for e in range(model.neq):
        joint, leader = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        factors = np.array(model.eq_data[e][:5])
        linear = model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and not np.any(factors[2:])
        if not linear or leader < 0 or not model.eq_active0[e]:
            warnings.warn(
                f"The equality constraint {e} of the model is left out: only active ones that "
                "couple two joints by a constant ratio are supported.",
                RobotDescriptionWarning,
                stacklevel=2,
            )
            continue
        own, other = (float(model.qpos0[model.jnt_qposadr[j]]) for j in (joint, leader))
        offset = own + factors[0] - factors[1] * other
        found[joint] = Mimic(_name(model, leader), float(factors[1]), float(offset))
    return found
