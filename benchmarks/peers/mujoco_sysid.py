# SPDX-License-Identifier: BSD-3-Clause
"""mujoco.sysid: parameters of bodies and drives by simulating short pieces of the log.

It fits inertias (pseudo-inertias, which keep bodies possible), damping, dry friction, armature and
an offset of the torque of every joint, so that rollouts of a quarter of a second from the log's
states follow the log under its torque. Those that the base model lacks are claimed if their
relative standard deviation is below 10 %, the usual limit in the field. Numbers of pieces and
iterations keep an answer within half a minute, after which the error hardly falls.
"""

import io

import mujoco
import numpy as np
from mujoco import sysid

PACKAGE = "mujoco"
#: Kinds of effects with what mujoco.sysid writes for each into a joint, and names of values.
WHAT = {
    "viscous": "damping",
    "coulomb": "frictionloss",
    "rotor_inertia": "armature",
    "offset": "offset",
}
VALUES = dict(zip(WHAT, ("Fv", "Fc", "Ia", "tau0"), strict=True))
LIMIT = 10.0
#: Length and time step of pieces in s, their number, and the number of iterations.
PIECE, STEP, PIECES, ITERATIONS = 0.25, 0.005, 16, 30
#: Start and bound of values of drives, in units of the torque, speed and acceleration of a joint.
START, MOST = 0.05, 3.0
#: A direction of the parameters is not determined below this share of the largest one.
OPEN = 1e-8


def read(description: str, n: int, step: float = STEP):
    """Description with a motor and two sensors for each joint, without contacts and limits."""
    spec = mujoco.MjSpec.from_string(description)
    spec.option.timestep = step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    joints = [joint.name for joint in spec.joints][:n]
    for name in joints:
        motor = spec.add_actuator(name=f"{name} motor", target=name)
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
        motor.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    for kind in (mujoco.mjtSensor.mjSENS_JOINTPOS, mujoco.mjtSensor.mjSENS_JOINTVEL):
        for name in joints:
            sensor = spec.add_sensor(name=f"{name} {kind.name}", type=kind, objname=name)
            sensor.objtype = mujoco.mjtObj.mjOBJ_JOINT
    return spec, joints


def pieces(model, motion: dict[str, np.ndarray], starts: np.ndarray) -> list:
    """Pieces of a log as mujoco.sysid takes them, from the times ``starts`` on."""
    step, out = model.opt.timestep, []
    for start in starts:
        times = start + step * np.arange(round(PIECE / step) + 1)
        q, dq, tau = (
            np.column_stack([np.interp(times, motion["time"], x) for x in motion[key].T])
            for key in ("q", "dq", "tau")
        )
        control = sysid.TimeSeries.from_control_names(times - start, tau, model)
        sensed = sysid.TimeSeries.from_names(times - start, np.hstack([q, dq]), model)
        begin = sysid.create_initial_state(model, q[0], dq[0])
        out.append(sysid.SystemTrajectory(model, control, sensed, begin, None))
    return out


def set_joint(name: str, what: str):
    """What writes a value of a drive into the description."""

    def modify(spec, parameter) -> None:
        value = float(parameter.value[0])
        if what == "offset":
            spec.actuator(f"{name} motor").biasprm[0] = -value
        else:
            setattr(spec.joint(name), what, [value, 0, 0] if what == "damping" else value)

    return modify


def set_body(name: str):
    """What writes a pseudo-inertia into the description.

    mujoco.sysid's own takes the inertia from the geometry first, which a bare URDF lacks.
    """

    def modify(spec, parameter) -> None:
        numbers = sysid.model_modifier.pi_from_theta(parameter.value)
        mass, moment, about_frame = numbers[0], numbers[1:4], numbers[4:].reshape(3, 3)
        middle = moment / mass
        inertia = about_frame - mass * (middle @ middle * np.eye(3) - np.outer(middle, middle))
        sizes, axes = np.linalg.eigh(inertia)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        body, turn = spec.body(name), np.empty(4)
        mujoco.mju_mat2Quat(turn, axes.ravel())
        body.mass, body.ipos, body.inertia, body.iquat = mass, middle, sizes, turn
        body.fullinertia = np.full(6, np.nan)

    return modify


def parameters(spec, joints: list[str], start: dict, most: dict):
    """What mujoco.sysid fits: bodies from the description, drives from ``start`` up to ``most``."""
    model, found = spec.compile(), sysid.ParameterDict()
    for j, name in enumerate(joints):
        for what, values in start.items():
            least = -most[what][j] if what == "offset" else 0.0
            words = (f"{name} {what}", values[j], least, most[what][j])
            found.add(sysid.Parameter(*words, modifier=set_joint(name, what)))
        body = spec.joint(name).parent.name
        words = {"inertia_type": sysid.InertiaType.Pseudo, "modifier": set_body(body)}
        found.add(sysid.body_inertia_param(spec, model, body, **words))
    return found


def fit(spec, known: list, start, scale: np.ndarray, iterations: int):
    """Parameters that mujoco.sysid finds, with a standard deviation for each number of theirs.

    ``scale`` is a size of positions and velocities. mujoco.sysid's own residual divides every piece
    by its signals, which are about zero where a joint rests, and takes what sensors read before a
    step as the state after it; states are compared here. Its own intervals are infinite as soon as
    one direction of the parameters is not determined, as of bodies always; a deviation here is
    infinite, or large, only for parameters with a share in such a direction.
    """

    def build(found):
        return sysid.apply_param_modifiers(found, spec)

    def differences(_, predicted, measured, *__, state):
        return (state[:, 1:] - measured.data[1:]) / scale, measured, measured

    def residual(x, found):
        words = {"modify_residual": differences, "resample_true": False, "n_threads": 1}
        out, *more = sysid.model_residual(x, found, build, known, **words)
        if x.ndim > 1:  # columns are steps of the finite differences times pieces
            cube = out.reshape(len(out), x.shape[1], len(known))
            out = np.moveaxis(cube, 2, 0).reshape(-1, x.shape[1])
        return [out], *more

    words = {"max_iters": iterations, "x_scale": "jac", "output": io.StringIO()}
    best, result = sysid.optimize(start, residual, **words)
    left = residual(result.x.ravel(), best)[0][0]
    sizes = np.maximum(np.linalg.norm(result.jac, axis=0), 1e-12)
    inverse = np.linalg.pinv(result.jac / sizes, rcond=OPEN)
    noise = np.sqrt(left @ left / (left.size - len(sizes)))
    return best, noise * np.linalg.norm(inverse, axis=1) / sizes


def spread_over(log) -> np.ndarray:
    """Times at which pieces begin, spread over trajectories and each inside one, s."""
    clock, group = log.motion["time"], log.motion["trajectory"]
    last = np.minimum(np.searchsorted(clock, clock + PIECE), len(clock) - 1)
    inside = np.flatnonzero(log.use & (group[last] == group) & (clock[last] >= clock + PIECE))
    return clock[inside[np.linspace(0, len(inside) - 1, PIECES).astype(int)]]


def torque(model, q, dq, ddq) -> np.ndarray:
    """Torque of motors for a motion, (n_samples, n_joints)."""
    data, out = mujoco.MjData(model), []
    for row in zip(q, dq, ddq, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = row
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse - model.actuator_biasprm[:, 0])
    return np.array(out)


def as_numbers(spec, joints: list[str], found) -> dict[str, list]:
    """Convert the parameters to the form of the suite's simulation."""
    numbers = {
        kind: [float(found[f"{name} {what}"].value[0]) for name in joints]
        for kind, what in WHAT.items()
    }
    bodies = []
    for name in joints:
        theta = found[f"{spec.joint(name).parent.name}_inertia"].value
        mass, *moment, xx, xy, xz, _, yy, yz, _, _, zz = sysid.model_modifier.pi_from_theta(theta)
        bodies.append([mass, *moment, xx, xy, xz, yy, yz, zz])
    return {"bodies": bodies} | numbers


def answer(log, robot) -> dict:
    spec, joints = read(robot.read_text(), log.motion["q"].shape[1])
    q, dq, ddq, tau = (log.motion[key] for key in ("q", "dq", "ddq", "tau"))
    size, speed, change = (np.sqrt(np.mean(x[log.use] ** 2, axis=0)) for x in (tau, dq, ddq))
    units = dict(zip(WHAT.values(), (size / speed, size, size / change, size), strict=True))
    start = {what: START * unit * (what != "offset") for what, unit in units.items()}
    most = {what: MOST * unit for what, unit in units.items()}
    known = pieces(spec.compile(), log.motion, spread_over(log))
    scale = np.hstack([PIECE * speed, speed])
    found, deviations = fit(spec, known, parameters(spec, joints, start, most), scale, ITERATIONS)
    places = [key for key in found.keys() for _ in range(found[key].size)]
    numbers = as_numbers(spec, joints, found)
    effects = [
        {
            "kind": kind,
            "joints": [j + 1],
            "parameters": {VALUES[kind]: value},
            "size": float(abs(value) / units[what][j]),
        }
        for kind, what in WHAT.items()
        for j, value in enumerate(numbers[kind])
        if kind not in log.base_model
        and 100 * deviations[places.index(f"{joints[j]} {what}")] < LIMIT * abs(value)
    ]
    effects = sorted(effects, key=lambda e: -e["size"])

    def predict(other) -> list[np.ndarray]:
        told = torque(sysid.apply_param_modifiers(found, spec), q, dq, ddq)
        return [rows.from_samples(told[:, j]) for j, rows in enumerate(other.joints)]

    return {
        "verdict": "missing" if effects else "complete",
        "effects": effects,
        "predict": predict,
        "model": numbers,
    }
