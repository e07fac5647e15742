# SPDX-License-Identifier: BSD-3-Clause
"""Robots as MuJoCo models: MuJoCo reads the URDF itself, so nothing here is skidyn's dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn._optional import import_optional
from skidyn._signals import Array
from skidyn.datasets.suite._robots import urdf_of

if TYPE_CHECKING:
    from skidyn.datasets.suite._hidden import Hidden

#: Step of the integration, s.
STEP = 5e-4


def engine() -> Any:
    """The module ``mujoco``, which the extra ``mujoco`` installs."""
    return import_optional("mujoco", extra="mujoco")


def rigid_model(robot: str) -> Any:
    """The nominal robot without friction, limits or contacts; ``inverse`` ignores its rotors."""
    spec = engine().MjSpec.from_string(urdf_of(robot))
    for joint in spec.joints:
        joint.armature = 1.0  # the inertia of wrists of a few grams is too small for MuJoCo
    return _bare(spec.compile())


def _bare(model: Any) -> Any:
    mujoco = engine()
    model.dof_damping[:] = 0
    model.dof_frictionloss[:] = 0
    model.jnt_limited[:] = 0
    model.opt.timestep = STEP
    # simplifications of the compiler for the nominal bodies are not valid for others
    model.body_sameframe[:] = 0
    model.body_simple[:] = 0
    model.dof_simplenum[:] = 0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    return model


def true_bodies(model: Any, rng: np.random.Generator) -> dict[str, Array]:
    """Inertial parameters 10 to 20 % off those of the model; physical by construction."""
    n = model.nbody
    return {
        "mass": model.body_mass * rng.uniform(0.87, 1.17, n),
        "ipos": model.body_ipos * rng.uniform(0.88, 1.12, (n, 3)) + rng.normal(0, 0.003, (n, 3)),
        # one factor for all axes keeps the triangle inequality
        "inertia": model.body_inertia * rng.uniform(0.85, 1.2, (n, 1)),
    }


def plant(
    robot: str,
    bodies: dict[str, Array],
    drives: dict[str, Array],
    hidden: Sequence[Hidden],
    loaded: bool,
) -> tuple[Any, Array]:
    """The true robot, and the degrees of freedom of its motors.

    ``drives`` holds ``viscous``, ``coulomb`` and ``rotor``. With ``loaded`` there is a payload.
    """
    mujoco = engine()
    spec = mujoco.MjSpec.from_string(urdf_of(robot))
    names = [joint.name for joint in spec.joints]
    hosts = {joint.name: joint.parent for joint in spec.joints}
    for joint, rotor in zip(spec.joints, drives["rotor"], strict=True):
        joint.armature = rotor
    for item in hidden:
        for j in item.compliance:
            joint = next(x for x in spec.joints if x.name == names[j])
            hosts[names[j]].add_joint(
                name=f"{names[j]} deflection", type=joint.type, axis=joint.axis, pos=joint.pos
            )
        if item.tendon is not None:
            cable = spec.add_tendon(name=item.kind)
            for j, ratio in zip(item.joints, item.tendon["ratios"], strict=True):
                cable.wrap_joint(names[j], ratio)
    model = _bare(spec.compile())
    model.opt.tolerance, model.opt.iterations = 1e-12, 60
    model.body_mass[:], model.body_ipos[:] = bodies["mass"], bodies["ipos"]
    model.body_inertia[:] = bodies["inertia"]
    dofs = np.array([model.joint(name).dofadr[0] for name in names])
    model.dof_solref[:] = (2 * STEP, 1)
    model.dof_solimp[:] = (0.999, 0.999, 0.001, 0.5, 2)
    for item in hidden:
        if item.gravity is not None:
            model.opt.gravity[:] = item.gravity
        if item.tendon is not None:
            cable = model.tendon(item.kind).id
            model.tendon_stiffness[cable] = item.tendon.get("stiffness", 0.0)
            model.tendon_lengthspring[cable] = item.tendon.get("length", 0.0)
            model.tendon_damping[cable] = item.tendon.get("damping", 0.0)
            model.tendon_frictionloss[cable] = item.tendon.get("friction", 0.0)
            model.tendon_armature[cable] = item.tendon.get("inertia", 0.0)
            model.tendon_solref_fri[cable] = (2 * STEP, 1)
            model.tendon_solimp_fri[cable] = (0.999, 0.999, 0.001, 0.5, 2)
        for j, values in item.compliance.items():
            joint = model.joint(f"{names[j]} deflection")
            model.dof_damping[joint.dofadr[0]] = values["damping"]
            if "stiffness" in values:
                model.jnt_stiffness[joint.id] = values["stiffness"]
            else:
                model.jnt_limited[joint.id] = 1
                model.jnt_range[joint.id] = (-values["gap"] / 2, values["gap"] / 2)
                model.jnt_solref[joint.id] = (0.006, 1.0)
                model.jnt_solimp[joint.id] = (0.95, 0.99, 0.0005, 0.5, 2)
        if item.payload is not None and loaded:
            _attach(model, model.nbody - 1, **item.payload)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model, dofs


def _attach(model: Any, body: int, mass: float, com: Array, inertia: Array) -> None:
    """Weld a load with its axes along the body's to the body."""
    turn = np.empty(9)
    engine().mju_quat2Mat(turn, model.body_iquat[body])
    axes = turn.reshape(3, 3)
    masses = np.array([model.body_mass[body], mass])
    places = np.array([model.body_ipos[body], com])
    tensors = np.array([axes * model.body_inertia[body] @ axes.T, np.diag(inertia)])
    middle = masses @ places / masses.sum()
    arms = places - middle
    for m, arm in zip(masses, arms, strict=True):
        tensors[0] += m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    moments, directions = np.linalg.eigh(tensors.sum(axis=0))
    directions[:, 0] *= np.sign(np.linalg.det(directions))  # a rotation, not a reflection
    quaternion = np.empty(4)
    engine().mju_mat2Quat(quaternion, directions.ravel())
    model.body_mass[body], model.body_ipos[body] = masses.sum(), middle
    model.body_inertia[body], model.body_iquat[body] = moments, quaternion


def inverse(model: Any, data: Any, q: Array, dq: Array, ddq: Array) -> Array:
    """Torque of the rigid bodies at the state."""
    data.qpos[:], data.qvel[:], data.qacc[:] = q, dq, ddq
    engine().mj_inverse(model, data)
    return np.asarray(data.qfrc_inverse - model.dof_armature * ddq)


def inertia_matrix(model: Any, data: Any, q: Array) -> Array:
    """Joint-space inertia of the rigid model, from differences of its inverse dynamics."""
    rest = np.zeros(model.nv)
    bias = inverse(model, data, q, rest, rest)
    columns = [inverse(model, data, q, rest, unit) - bias for unit in np.eye(model.nv)]
    return np.array(columns).T


def rigid_columns(robot: str, q: Array, dq: Array, ddq: Array) -> Array:
    """Columns of shape (n_samples, n_joints, 10 n_links) that span all rigid bodies' torques.

    Inverse dynamics is linear in each link's ten inertial parameters, so its torques under ten
    bodies drawn at random span those of every body.
    """
    mujoco = engine()
    model = rigid_model(robot)
    rng = np.random.default_rng(0)
    data = mujoco.MjData(model)
    n_bodies = model.nbody - 1
    out = np.empty((len(q), model.nv, 10 * n_bodies))
    model.body_mass[:] = 0
    model.body_inertia[:] = 0
    for body in range(1, model.nbody):
        for k in range(10):
            model.body_mass[body] = rng.uniform(0.5, 2)
            model.body_ipos[body] = rng.uniform(-0.2, 0.2, 3)
            turn = rng.normal(size=4)
            model.body_iquat[body] = turn / np.linalg.norm(turn)
            model.body_inertia[body] = 0.05 + rng.uniform(0, 0.04, 3)
            for i in range(len(q)):
                out[i, :, 10 * (body - 1) + k] = inverse(model, data, q[i], dq[i], ddq[i])
        model.body_mass[body] = 0
        model.body_inertia[body] = 0
    return out
