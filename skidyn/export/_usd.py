# SPDX-License-Identifier: BSD-3-Clause
"""Identified numbers as a text layer over a user's own USD stage."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from skidyn._exceptions import SkidynError
from skidyn._optional import import_optional
from skidyn.dynamics import transform_inertial
from skidyn.export._bodies import CentralInertia, about_origin, central_inertia, described
from skidyn.export._files import PathLike, write_files
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

#: Permitted difference of the frames, m and rad: USD has single precision.
_ALIKE = 1e-4
_JOINTS = {"PhysicsRevoluteJoint": "revolute", "PhysicsPrismaticJoint": "prismatic"}


def merge_usd(
    model: RBDRegressor, source: str | os.PathLike[str], path: PathLike
) -> tuple[str, ...]:
    """Write the identified numbers as a text layer over the user's own USD stage.

    The stage itself is not modified: the layer has it as its sublayer and contains the differences.
    Bodies get ``physics:mass``, ``centerOfMass``, ``diagonalInertia`` and ``principalAxes`` of
    UsdPhysics. Friction and rotor inertia, for which UsdPhysics has no attributes, are written to
    those of PhysX (``physxJointAxis:angular:armature``, ``staticFrictionEffort``,
    ``dynamicFrictionEffort``, ``viscousFrictionCoefficient``) and of MuJoCo (``mjc:armature``,
    ``mjc:damping``, ``mjc:frictionloss``). Gains of drives are unchanged. Joints and bodies are
    found by name; their frames and axes are compared with those of the robot. Needs ``pip install
    skidyn[usd]``.

    Parameters
    ----------
    model : RBDRegressor
        Fitted model.
    source : path
        Stage with the joints of the model's robot, as UsdPhysics joints of the same names.
    path : path
        Layer to write, which ends in ``.usda``.

    Returns
    -------
    tuple of str
        Names of the effects that the layer cannot represent, which are written to
        ``<path>.skidyn.json``.

    Raises
    ------
    SkidynError
        A joint is not on the stage, a frame differs, or a body would get a physically inconsistent
        inertia.
    ImportError
        USD is not installed.

    Examples
    --------
    >>> from skidyn.export import merge_usd
    >>> merge_usd(model, "robot.usd", "identified.usda")  # doctest: +SKIP
    ()
    """
    pxr = _Pxr()
    own = described(model, ("viscous", "coulomb", "rotor_inertia"))
    robot, file = own.robot, Path(path)
    if file.suffix != ".usda":
        raise SkidynError(f"{path}: the name of a text layer has to end in .usda")
    if not Path(source).exists():
        raise SkidynError(f"{source}: no such file")
    stage = pxr.Usd.Stage.Open(os.fspath(source))
    unit = _Units(
        float(pxr.UsdGeom.GetStageMetersPerUnit(stage)),
        float(pxr.UsdPhysics.GetStageKilogramsPerUnit(stage)),
    )
    joints = _joints(robot, stage, source, pxr)
    carriers = [
        _checked_carrier(robot, body, joints[name], unit, stage)
        for body, name in enumerate(robot.body_joints)
    ]
    layer = pxr.Sdf.Layer.CreateAnonymous(".usda")
    layer.comment = f"Identified numbers of {robot.name}, written by skidyn."
    beside = os.path.relpath(Path(source).resolve(), file.resolve().parent)
    layer.subLayerPaths = [Path(beside).as_posix()]
    over = pxr.Usd.Stage.Open(layer)
    _copy_metadata(over, stage, pxr)
    for body, carrier in enumerate(carriers):
        parameters = own.parameters[body] - _fixed_to(robot, body, carrier, unit, pxr)
        central = central_inertia(parameters, carrier.GetName())
        if central is not None:
            _write_mass(over.OverridePrim(carrier.GetPath()), central, unit, pxr)
    for j, name in enumerate(robot.joint_names):
        values = {kind: float(sizes[j, 0]) for kind, sizes in own.joints.items()}
        prim = over.OverridePrim(joints[name].GetPath())
        _write_joint(prim, values, robot.joint_types[j] == "prismatic", unit, pxr)
    return write_files(path, layer.ExportToString(), model, own.left)


class _Pxr:
    """The modules of USD, or an error with the command to install them."""

    def __getattr__(self, name: str) -> Any:
        return import_optional(f"pxr.{name}", extra="usd")


@dataclass(frozen=True)
class _Units:
    """Units of a stage in m and kg."""

    metre: float
    kilogram: float

    @property
    def inertia(self) -> float:
        """Unit of inertia in kg m^2, and of torque in N m: time is in seconds."""
        return self.kilogram * self.metre**2


def _write_mass(prim: Any, central: CentralInertia, unit: _Units, pxr: _Pxr) -> None:
    moments, axes = np.linalg.eigh(central.inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    x, y, z, w = Rotation.from_matrix(axes).as_quat()
    mass = pxr.UsdPhysics.MassAPI.Apply(prim)
    mass.CreateMassAttr(central.mass / unit.kilogram)
    mass.CreateCenterOfMassAttr(tuple(central.center / unit.metre))
    mass.CreateDiagonalInertiaAttr(tuple(moments / unit.inertia))
    mass.CreatePrincipalAxesAttr(pxr.Gf.Quatf(w, x, y, z))


def _write_joint(
    prim: Any, values: dict[str, float], slides: bool, unit: _Units, pxr: _Pxr
) -> None:
    """Friction and armature, in the units of PhysX and of MuJoCo."""
    inertia = unit.kilogram if slides else unit.inertia
    dry = values["coulomb"] / (unit.kilogram * unit.metre if slides else inertia)
    viscous, armature = values["viscous"] / inertia, values["rotor_inertia"] / inertia
    axis = "linear" if slides else "angular"
    prim.AddAppliedSchema(f"PhysxJointAxisAPI:{axis}")
    prim.AddAppliedSchema("MjcJointAPI")
    for key, value in (
        ("armature", armature),
        ("staticFrictionEffort", dry),
        ("dynamicFrictionEffort", dry),
        # per degree, the unit of angles in USD
        ("viscousFrictionCoefficient", viscous if slides else np.deg2rad(viscous)),
    ):
        name = f"physxJointAxis:{axis}:{key}"
        prim.CreateAttribute(name, pxr.Sdf.ValueTypeNames.Float).Set(float(value))
    for key, value in (("armature", armature), ("damping", viscous), ("frictionloss", dry)):
        prim.CreateAttribute(
            f"mjc:{key}", pxr.Sdf.ValueTypeNames.Double, False, pxr.Sdf.VariabilityUniform
        ).Set(value)


def _joints(robot: Robot, stage: Any, source: Any, pxr: _Pxr) -> dict[str, Any]:
    """Prims of the robot's joints, those that mimic others included."""
    found: dict[str, list[Any]] = {}
    for prim in stage.Traverse():
        if prim.GetTypeName() in _JOINTS:
            found.setdefault(prim.GetName(), []).append(prim)
    joints = {}
    for name in robot.body_joints:
        prims = found.get(pxr.Tf.MakeValidIdentifier(name), [])
        if len(prims) != 1:
            raise SkidynError(
                f"{source} has {len(prims)} UsdPhysics joints with the name {name!r}; expected "
                f"one. It has {', '.join(sorted(found)) or 'none'}"
            )
        joints[name] = prims[0]
    return joints


def _checked_carrier(robot: Robot, body: int, joint: Any, unit: _Units, stage: Any) -> Any:
    """Prim of the body that a joint moves, whose frame is that of the robot's."""
    name = robot.body_joints[body]
    ends = [joint.GetRelationship(f"physics:body{k}").GetForwardedTargets() for k in (0, 1)]
    if len(ends[1]) != 1:
        raise SkidynError(f"joint {name!r} has no physics:body1, the body that it moves")
    carrier = stage.GetPrimAtPath(ends[1][0])
    if not carrier or carrier.IsInstanceProxy():
        raise SkidynError(f"the body of joint {name!r} does not exist, or is part of an instance")
    base, moved = (_frame(joint, k, unit.metre) for k in (0, 1))
    token = str(joint.GetAttribute("physics:axis").Get() or "X")
    axis = moved[0][:, "XYZ".index(token)]
    tree = robot.tree
    if 1.0 - abs(float(axis @ tree.axes[body])) > _ALIKE:
        raise SkidynError(
            f"joint {name!r} turns about {axis.round(4).tolist()} in the frame of its body, and "
            f"about {tree.axes[body].round(4).tolist()} in the robot's description"
        )
    turn = base[0] @ moved[0].T
    shift = base[1] - turn @ moved[1]
    # The parent of the joint may be a link that is fixed to the previous body.
    parent = ends[0][0].name if ends[0] else ""
    placement = robot.links.get(parent)
    if placement is not None and placement.body == tree.parents[body]:
        turn = placement.rotation @ turn
        shift = placement.rotation @ shift + placement.translation
        off = (
            np.abs(turn - tree.rotations[body]).max()
            + np.abs(shift - tree.translations[body]).max()
        )
        if off > _ALIKE:
            raise SkidynError(
                f"the frame of {carrier.GetName()!r} behind joint {name!r} differs from that of "
                f"the robot's description by {off:.3g} m or rad"
            )
    return carrier


def _frame(joint: Any, end: int, metre: float) -> tuple[np.ndarray, np.ndarray]:
    """Frame of a joint in one of its bodies: rotation and position in m."""
    place = joint.GetAttribute(f"physics:localPos{end}").Get() or (0.0, 0.0, 0.0)
    turn = joint.GetAttribute(f"physics:localRot{end}").Get()
    rotation = np.eye(3)
    if turn is not None:
        rotation = Rotation.from_quat([*turn.GetImaginary(), turn.GetReal()]).as_matrix()
    return rotation, metre * np.array(place, dtype=float)


def _fixed_to(robot: Robot, body: int, carrier: Any, unit: _Units, pxr: _Pxr) -> np.ndarray:
    """Parameters of bodies of the stage that are fixed to a body; they are not changed."""
    total = np.zeros(10)
    for name, placement in robot.links.items():
        if placement.body != body or name == robot.body_names[body]:
            continue
        for prim in carrier.GetParent().GetChildren():
            if prim.GetName() == name and prim.HasAPI(pxr.UsdPhysics.RigidBodyAPI):
                own = _stated_mass(prim, unit, pxr)
                total += transform_inertial(own, placement.rotation, placement.translation)
    return total


def _stated_mass(prim: Any, unit: _Units, pxr: _Pxr) -> np.ndarray:
    """The ten parameters of a prim in its frame; zeros if it has none."""
    api = pxr.UsdPhysics.MassAPI(prim)
    mass = api.GetMassAttr().Get() if prim.HasAPI(pxr.UsdPhysics.MassAPI) else 0.0
    if not mass:
        return np.zeros(10)
    center = unit.metre * np.array(api.GetCenterOfMassAttr().Get(), dtype=float)
    if not np.isfinite(center).all():
        raise SkidynError(f"{prim.GetPath()} has a mass, but no physics:centerOfMass")
    moments = unit.inertia * np.array(api.GetDiagonalInertiaAttr().Get(), dtype=float)
    turn = api.GetPrincipalAxesAttr().Get()
    axes = np.eye(3)
    if turn.GetLength() > 0.0:
        axes = Rotation.from_quat([*turn.GetImaginary(), turn.GetReal()]).as_matrix()
    return about_origin(unit.kilogram * float(mass), center, axes @ np.diag(moments) @ axes.T)


def _copy_metadata(over: Any, stage: Any, pxr: _Pxr) -> None:
    """Units and other metadata that a stage reads only from its first layer."""
    pxr.UsdGeom.SetStageMetersPerUnit(over, pxr.UsdGeom.GetStageMetersPerUnit(stage))
    kilograms = pxr.UsdPhysics.GetStageKilogramsPerUnit(stage)
    pxr.UsdPhysics.SetStageKilogramsPerUnit(over, kilograms)
    pxr.UsdGeom.SetStageUpAxis(over, pxr.UsdGeom.GetStageUpAxis(stage))
    if stage.HasDefaultPrim():
        over.GetRootLayer().defaultPrim = stage.GetDefaultPrim().GetName()
