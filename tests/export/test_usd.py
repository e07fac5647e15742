# SPDX-License-Identifier: BSD-3-Clause
"""A layer over a USD stage: opened with USD, it has the numbers of the model."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from skidyn.datasets import make_hidden_effect_log
from skidyn.exceptions import SkidynError
from skidyn.export import merge_usd
from skidyn.identification import RBDRegressor
from skidyn.robots import Robot

pytest.importorskip("pxr", reason="needs skidyn[usd]")

HAND = '<inertia ixx="0.001" iyy="0.002" izz="0.001" ixy="0" ixz="0" iyz="0"/>'
LINK = '<inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>'
URDF = f"""<robot name="arm"><link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>{LINK}</inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit effort="50" velocity="3" lower="-3" upper="3"/></joint>
  <link name="lower"><inertial><origin xyz="0.1 0 0.02"/><mass value="1"/>{LINK}</inertial></link>
  <joint name="elbow" type="prismatic"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0" rpy="0.2 0 0"/><axis xyz="1 0 0"/>
    <limit effort="50" velocity="3" lower="-3" upper="3"/></joint>
  <link name="hand"><inertial><origin xyz="0 0 0.05"/><mass value="0.3"/>{HAND}</inertial></link>
  <joint name="mount" type="fixed"><parent link="lower"/><child link="hand"/>
    <origin xyz="0.3 0 0" rpy="0 0.5 0"/></joint></robot>"""
#: The same arm in centimetres; its hand is a body of its own.
USD = """#usda 1.0
(
    defaultPrim = "arm"
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "arm" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{
    def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {}
    def Xform "upper" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 7
        def Sphere "picture" {}
    }
    def Xform "lower" (prepend apiSchemas = ["PhysicsRigidBodyAPI"]) {}
    def Xform "hand" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 0.3
        point3f physics:centerOfMass = (0, 0, 5)
        float3 physics:diagonalInertia = (10, 20, 10)
    }
    def PhysicsRevoluteJoint "shoulder"
    {
        rel physics:body0 = </arm/base>
        rel physics:body1 = </arm/upper>
        point3f physics:localPos0 = (0, 0, 50)
        uniform token physics:axis = "Y"
        float drive:angular:physics:stiffness = 12
    }
    def PhysicsPrismaticJoint "elbow"
    {
        rel physics:body0 = </arm/upper>
        rel physics:body1 = </arm/lower>
        point3f physics:localPos0 = (40, 0, 0)
        quatf physics:localRot0 = (0.99500417, 0.09983342, 0, 0)
        uniform token physics:axis = "X"
    }
}
"""


@pytest.fixture(scope="module")
def model():
    log = make_hidden_effect_log(Robot.from_urdf(URDF), None, n_trajectories=4, random_state=1)
    y = log.y + 0.03 * log.X[["ddq1", "ddq2"]].to_numpy() * [1, 10]
    effects = ("viscous", "coulomb", "rotor_inertia", ("offset", [1]))
    return RBDRegressor(log.robot, effects, consistent=True).fit(log.X, y)


@pytest.fixture
def own(tmp_path):
    (tmp_path / "own.usda").write_text(USD, encoding="utf-8")
    return tmp_path


def body(stage, path):
    """The ten parameters that a stage in centimetres states of a body."""
    from pxr import UsdPhysics

    api = UsdPhysics.MassAPI(stage.GetPrimAtPath(path))
    mass, center = api.GetMassAttr().Get(), 0.01 * np.array(api.GetCenterOfMassAttr().Get())
    turn = api.GetPrincipalAxesAttr().Get()
    axes = np.eye(3)
    if turn.GetLength():
        axes = Rotation.from_quat([*turn.GetImaginary(), turn.GetReal()]).as_matrix()
    moments = 1e-4 * np.array(api.GetDiagonalInertiaAttr().Get())
    about = axes @ np.diag(moments) @ axes.T
    about += mass * (center @ center * np.eye(3) - np.outer(center, center))
    return np.r_[mass, mass * center, about[np.triu_indices(3)]]


def test_the_stage_under_the_layer_gives_the_torque_of_the_model(model, own):
    from pxr import Usd

    from skidyn.dynamics import transform_inertial

    assert merge_usd(model, own / "own.usda", own / "new.usda") == ("offset of shoulder",)
    stage = Usd.Stage.Open(str(own / "new.usda"))
    robot = model.robot_
    hand = robot.links["hand"]
    carried = transform_inertial(body(stage, "/arm/hand"), hand.rotation, hand.translation)
    read = np.array([body(stage, "/arm/upper"), body(stage, "/arm/lower") + carried])
    motion = np.random.default_rng(0).normal(size=(3, 40, 2))
    expected = model.rigid_body_torque(*motion)
    torque = robot.inverse_dynamics(*motion, parameters=read)
    np.testing.assert_allclose(torque, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_friction_and_armature_have_the_units_of_the_stage(model, own):
    from pxr import Usd

    merge_usd(model, own / "own.usda", own / "new.usda")
    stage = Usd.Stage.Open(str(own / "new.usda"))
    sizes = {(t.kind, t.joints[0] - 1): c[0] for t, c in model.effect_coefficients_.items()}
    for j, (name, axis) in enumerate((("shoulder", "angular"), ("elbow", "linear"))):
        prim = stage.GetPrimAtPath(f"/arm/{name}")
        assert f"PhysxJointAxisAPI:{axis}" in prim.GetAppliedSchemas() or prim.GetMetadata(
            "apiSchemas"
        )

        def read(key, prim=prim):
            return prim.GetAttribute(key).Get()

        # kg cm^2, and per degree, where it turns; kg, kg cm/s^2 where it slides
        inertia, effort, turn = (1e-4, 1e-4, np.pi / 180) if j == 0 else (1.0, 1e-2, 1.0)
        place = f"physxJointAxis:{axis}:"
        dry, wet, rotor = (sizes[k, j] for k in ("coulomb", "viscous", "rotor_inertia"))
        assert read(place + "armature") == pytest.approx(rotor / inertia)
        assert read(place + "dynamicFrictionEffort") == pytest.approx(dry / effort)
        assert read(place + "staticFrictionEffort") == pytest.approx(dry / effort)
        assert read(place + "viscousFrictionCoefficient") == pytest.approx(wet / inertia * turn)
        assert read("mjc:armature") == pytest.approx(rotor / inertia)
        assert read("mjc:damping") == pytest.approx(wet / inertia)
        assert read("mjc:frictionloss") == pytest.approx(dry / effort)


def test_the_stage_itself_is_not_touched_and_the_rest_shows_through(model, own):
    from pxr import Usd, UsdGeom

    merge_usd(model, own / "own.usda", own / "new.usda")
    assert (own / "own.usda").read_text("utf-8") == USD
    assert (own / "new.usda").read_text("utf-8").startswith("#usda 1.0")
    stage = Usd.Stage.Open(str(own / "new.usda"))
    assert stage.GetDefaultPrim().GetName() == "arm"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert stage.GetPrimAtPath("/arm/upper/picture").GetTypeName() == "Sphere"
    stiffness = stage.GetPrimAtPath("/arm/shoulder").GetAttribute("drive:angular:physics:stiffness")
    assert stiffness.Get() == 12


def test_wrong_stages_are_refused(model, own):
    cases = {
        "joints with the name 'elbow'": ('"elbow"', '"knee"'),
        "turns about": ('physics:axis = "Y"', 'physics:axis = "Z"'),
        "differs from that of the robot": ("(40, 0, 0)", "(50, 0, 0)"),
        "no physics:body1": ("rel physics:body1 = </arm/lower>", ""),
    }
    for message, (old, new) in cases.items():
        (own / "bad.usda").write_text(USD.replace(old, new))
        with pytest.raises(SkidynError, match=message):
            merge_usd(model, own / "bad.usda", own / "new.usda")
    with pytest.raises(SkidynError, match="end in .usda"):
        merge_usd(model, own / "own.usda", own / "new.usd")
    with pytest.raises(SkidynError, match="no such file"):
        merge_usd(model, own / "none.usda", own / "new.usda")
    assert not (own / "new.usda").exists()
