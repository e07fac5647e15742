# SPDX-License-Identifier: BSD-3-Clause
"""The catalogue, terms made from it, and a log for each kind in which it is found.

The logs come from other code paths: from the simulator, which integrates states and play at about
1 kHz and shares no code with the catalogue, and from MuJoCo.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from skidyn.datasets import load_planar_arm, load_srs_arm, load_ur5, make_hidden_effect_log
from skidyn.diagnosis import diagnose
from skidyn.effects import Term, get_effect, list_effects, make_terms
from skidyn.exceptions import EffectError
from skidyn.export import write_mjcf
from skidyn.identification import RBDRegressor

HYSTERESIS = {"dahl", "lugre", "maxwell_slip"}
#: Kind: robot, and the parameter of the truth that must be met, with its tolerance.
KINDS = {
    "friction_drift": (load_planar_arm, None, 0),
    "lugre": (load_planar_arm, None, 0),
    "maxwell_slip": (load_planar_arm, None, 0),
    "position_dependent_friction": (load_planar_arm, "A", 0.05),
    "nonlinear_spring": (load_planar_arm, "k3", 0.4),
    "gravity_compensator": (load_planar_arm, None, 0),
    "joint_elasticity": (load_planar_arm, "K", 0.5),
    "backlash": (load_planar_arm, "gap", 0.5),
    "torque_gain": (load_ur5, "epsilon", 0.05),
    "saturation": (load_planar_arm, "limit", 0.06),
    "temperature_offset": (load_planar_arm, "dtau_dT", 0.05),
    "environment_contact": (load_planar_arm, "z0", 0.05),
}
#: As much as these effects need.
SHORT = {"n_trajectories": 6, "duration": 6.0}
#: Springs whose form shows at the ends of the travel, which a longer log has more often.
LONG = ("nonlinear_spring", "gravity_compensator")
#: Those of tests/diagnosis/test_diagnosis.py, test_servo_settings.py and test_motor_load.py.
ELSEWHERE = {
    *("viscous", "coulomb", "offset", "asymmetric_friction", "stribeck", "nonlinear_viscous"),
    *("load_dependent_friction", "dahl", "rotor_inertia", "spring", "torque_ripple", "payload"),
    *("time_delay", "temperature_friction"),
    *("servo_gain", "servo_current", "servo_voltage", "servo_deadband"),
    *("motor_load_friction", "stribeck_load_friction"),
    *("directional_load_friction", "quadratic_load_friction"),
}


def test_catalogue_is_complete():
    assert len(list_effects()) == len(set(list_effects()))
    for kind in list_effects():
        effect = get_effect(kind)
        effect.check()
        assert effect.describe()["kind"] == kind and effect.reference
        assert set(effect.rivals) <= {*list_effects(), "unknown"}, kind
    with pytest.raises(EffectError, match="no effect 'dahll'"):
        get_effect("dahll")


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("dahll", "no effect"),
        (("dahl", [3]), "no joint 3"),
        (("dahl", [0]), "no joint 0"),
        (("coupled_friction", [1]), r"couples two joints; name both: skidyn add --joints 1,2"),
    ],
)
def test_terms_that_cannot_be(spec, words):
    with pytest.raises(EffectError, match=words):
        make_terms([spec], 2)


def test_a_shape_that_is_given_in_part_gets_its_usual_values():
    (term,) = make_terms([Term("stribeck", (2,), {"vs": 0.1})], 2)
    assert term.shape == {"vs": 0.1, "delta": 2.0}
    whole, open_ = Term("stribeck", (2,), {"vs": 0.1, "delta": 1.0}), Term("stribeck", (2,))
    assert make_terms([whole, open_], 2) == [whole, open_]


@dataclass
class Native:
    """An effect as MuJoCo has it, and what the diagnosis is to say of it."""

    joints: tuple[int, ...]
    parameter: str
    value: float | tuple[float, ...]
    #: Attributes of a tendon that turns with the sum of the two joints.
    tendon: str = ""
    #: Changes the model; changes it before the second half of the trajectories.
    edit: Callable = lambda model: None
    loaded: Callable = lambda model: None
    #: Force on the last body in the second half of the trajectories, N.
    force: tuple[float, ...] = ()
    load: Callable = load_planar_arm
    base: tuple[str, ...] = ("viscous", "coulomb")
    trajectories: int = 4


def more(name, index, value):
    def edit(model):
        getattr(model, name)[index] += value

    return edit


def tilt(model):
    angle = np.deg2rad(3.0)
    model.opt.gravity[:] = -9.81 * np.array([np.sin(angle), 0.0, np.cos(angle)])


def stiff_limits(model):
    """Joint 2 ends at 0.6 rad in a linear spring of 30 N m/rad for a unit of effective inertia."""
    model.jnt_limited[1], model.jnt_range[1] = True, (-50.0, 0.6)
    model.jnt_solref[1], model.jnt_solimp[1] = (-400.0, -1.0), (0.9, 0.9, 1e-3, 0.5, 1)


#: Effects that MuJoCo has natively.
NATIVE = {
    "viscous": Native(
        (1, 2), "Fv", (0.3, 1.1), edit=more("dof_damping", 1, 0.8), base=("coulomb",)
    ),
    "coulomb": Native((2,), "Fc", 0.7, edit=more("dof_frictionloss", 1, 0.7), base=("viscous",)),
    "rotor_inertia": Native((2,), "Ia", 0.3, edit=more("dof_armature", 1, 0.3)),
    "spring": Native((2,), "k", 2.5, edit=more("jnt_stiffness", 1, 2.5)),
    "coupling_spring": Native((1, 2), "k", 2.0, tendon='stiffness="2" springlength="0"'),
    "coupled_friction": Native((1, 2), "Fc", 0.6, tendon='frictionloss="0.6"', trajectories=8),
    "coupled_inertia": Native((5, 6), "Ia", 0.2, tendon='armature="0.2"', load=load_ur5),
    "payload": Native((2,), "mass", 0.8, loaded=more("body_mass", -1, 0.8)),
    "external_wrench": Native((1, 2), "force_x", 3.0, force=(3.0, 0.0, -4.0), trajectories=8),
    "base_tilt": Native((), "tilt_deg", 3.0, edit=tilt, load=load_srs_arm),
    "end_stop": Native((2,), "q_lim", 0.6, edit=stiff_limits),
}

#: Of these, some that need most of what all of them need of other packages.
QUICK = ("rotor_inertia", "external_wrench")


def motion(rng, n, seconds=6.0, step=0.01):
    t = np.arange(0, seconds, step)
    w = 2 * np.pi * np.array([0.2, 0.5, 0.9])
    a, b = rng.normal(size=(2, 3, n)) / 3
    phase = np.outer(t, w)
    q = np.sin(phase) @ a + np.cos(phase) @ b
    dq = np.cos(phase) @ (a * w[:, None]) - np.sin(phase) @ (b * w[:, None])
    ddq = -np.sin(phase) @ (a * w[:, None] ** 2) - np.cos(phase) @ (b * w[:, None] ** 2)
    return t, q, dq, ddq


def torque_of(force, model, data):
    """Joint torque of a force on the origin of the last body."""
    import mujoco

    torque = np.zeros(model.nv)
    nothing, last = np.zeros(3), model.nbody - 1
    mujoco.mj_applyFT(model, data, np.array(force), nothing, data.xpos[last], last, torque)
    return torque


def simulate(native, path):
    """Motion and torque of a log that MuJoCo made."""
    mujoco = pytest.importorskip("mujoco")
    robot = native.load()
    n = robot.n_joints
    write_mjcf(robot, path)
    text = path.read_text()
    if native.tendon:
        pair = [robot.joint_names[j - 1] for j in native.joints]
        joints = "".join(f'<joint joint="{name}" coef="1"/>' for name in pair)
        shaft = f"<tendon><fixed {native.tendon}>{joints}</fixed></tendon>"
        text = text.replace("</mujoco>", shaft + "</mujoco>")
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.dof_damping[:], model.dof_frictionloss[:] = 0.3, 0.0
    native.edit(model)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(4)
    tables, torques = [], []
    for trajectory in range(native.trajectories):
        if trajectory == native.trajectories // 2:
            native.loaded(model)
        t, q, dq, ddq = motion(rng, n)
        tau = np.zeros_like(q)
        for i in range(len(t)):
            data.qpos[:], data.qvel[:], data.qacc[:] = q[i], dq[i], ddq[i]
            mujoco.mj_inverse(model, data)
            tau[i] = data.qfrc_inverse
            if native.force and trajectory >= native.trajectories // 2:
                tau[i] -= torque_of(native.force, model, data)
        columns = {"time": t, "trajectory": trajectory}
        for j in range(n):
            columns |= {f"q{j + 1}": q[:, j], f"dq{j + 1}": dq[:, j]}
        tables.append(pd.DataFrame(columns))
        torques.append(tau + 0.02 * rng.normal(size=tau.shape))
    return robot, pd.concat(tables, ignore_index=True), np.vstack(torques)


@pytest.mark.parametrize(
    "kind",
    [kind if kind in QUICK else pytest.param(kind, marks=pytest.mark.slow) for kind in NATIVE],
)
def test_what_mujoco_has_natively_is_named_and_sized(kind, tmp_path):
    native = NATIVE[kind]
    robot, X, torque = simulate(native, tmp_path / "arm.xml")

    diagnosis = diagnose(RBDRegressor(robot, native.base), X, torque)

    findings = sorted(diagnosis.findings, key=lambda finding: finding.joints)
    assert {finding.kind for finding in findings} == {kind}
    joints = tuple(j for finding in findings for j in finding.joints)
    assert joints == native.joints or not native.joints
    values = [finding.parameters[native.parameter]["value"] for finding in findings]
    np.testing.assert_allclose(values, np.ravel(native.value), rtol=0.05, atol=0.1)
    # Not always to the noise of 0.02 N m: MuJoCo's dry friction yields a little before it slides,
    # and its end stop is as stiff as the inertia that meets it.
    left = diagnosis.rmse_after < np.maximum(0.025, 0.3 * diagnosis.rmse_before)
    assert left.all()


def test_every_kind_has_its_test():
    assert {*KINDS, *NATIVE, *ELSEWHERE} == set(list_effects())


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_simulated_effect_is_named_with_its_joints_and_size(kind):
    load, name, tolerance = KINDS[kind]
    length = {} if kind in LONG else SHORT
    log = make_hidden_effect_log(load(), kind, noise="low", random_state=11, **length)

    diagnosis = diagnose(RBDRegressor(log.robot), log.X, log.y)

    (finding,) = diagnosis.findings
    if kind in HYSTERESIS:  # told apart by special motion only
        assert finding.kind in HYSTERESIS
        assert kind in {finding.kind, *finding.rivals}
    else:
        assert finding.kind == kind
    if log.joints:
        assert finding.joints == tuple(log.joints)
    assert np.any(diagnosis.rmse_after < 0.97 * diagnosis.rmse_before)
    if name:
        value, truth = finding.parameters[name]["value"], np.ravel(log.parameters[name])[0]
        assert value == pytest.approx(truth, rel=tolerance)
