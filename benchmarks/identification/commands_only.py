# SPDX-License-Identifier: BSD-3-Clause
"""Effects named from logs of commands and positions, without any torque.

    python benchmarks/identification/commands_only.py --seed 1 --logs 40 --without 20

MuJoCo simulates robots whose joints are position servos (gain, damping, current limit), and the log
holds commands and encoder positions at 100 Hz. In ``--logs`` of them one joint hides elasticity of
its gear, backlash, stiction or friction that grows with its load, or all commands arrive late.
Elasticity and play lie behind the encoder, which sits on the motor; a motor on such a joint is a
coordinate of its own here. The user knows the servo's gains: the torque is its gain times its error
(``diagnose(..., controller=)``), and the log is read as any other; ``explain_servo_motion`` then
looks at the motion of joints that got no name, and what it names takes the place of what was said
there without a name or of hysteresis. Counted is a log whose effect is named on its joint, and one
without in which nothing is claimed.

In ``--servos`` more logs the servo of one joint is not as stated: its current or its voltage limits
the torque in some per cent of the motion, or its position gain is another one. Counted is a log in
which this setting, and no other one of a servo, is found on this joint, and how many of the 95 %
intervals contain the true value.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
import pandas as pd

from skidyn.datasets import load_panda, load_planar_arm, load_scara, load_ur5
from skidyn.diagnosis import diagnose
from skidyn.export import write_mjcf
from skidyn.identification import RBDRegressor
from skidyn.simulation import Controller

ROBOTS = (load_ur5, load_panda, load_planar_arm, load_scara)
#: What is hidden, and the findings that name it; a late command may be told of the measurement.
KINDS = {
    "elasticity": {"joint_elasticity"},
    "backlash": {"backlash"},
    "delay": {"time_delay"},
    "stiction": {"stribeck"},
    "load friction": {"load_dependent_friction"},
}
#: What the servo of one joint is other than stated, and the finding that says so.
SERVO_KINDS = {
    "current limit": "servo_current",
    "voltage limit": "servo_voltage",
    "position gain": "servo_gain",
}
STEP, RATE, SECONDS, RECORDINGS = 5e-4, 100, 6.0, 8
#: Encoder of 14 bits, rad (a slider's has the same number for a metre).
ENCODER = 2 * np.pi / 2**14


@dataclass
class Servo:
    """Sizes of a servo arm, arrays of one number a joint."""

    scale: np.ndarray  # typical torque
    friction: np.ndarray
    viscous: np.ndarray
    armature: np.ndarray
    gains: Controller
    #: Joint whose torque falls with the speed, torque at rest, speed at which nothing is left.
    voltage: tuple[int, float, float] | None = None


def servo_of(robot, rng):
    """Servos that fit a robot."""
    q = rng.uniform(-1, 1, (50, robot.n_joints))
    gravity = robot.inverse_dynamics(q, 0 * q, 0 * q)
    inertia = np.mean([np.diag(robot.mass_matrix(x[None])[0]) for x in q], axis=0)
    scale = np.hypot(gravity.std(axis=0), 4.0 * inertia)
    armature = 0.2 * inertia
    stiffness = scale / 0.03
    damping = 1.2 * np.sqrt(stiffness * (inertia + armature))
    gains = Controller(stiffness, damping, limit=6 * scale, follows_velocity=False)
    draw = rng.uniform(0.7, 1.4, (2, robot.n_joints))
    return Servo(scale, 0.1 * scale * draw[0], 0.05 * scale * draw[1], armature, gains)


def reference(rng, n, t):
    """A command of three sines for every joint, which starts at rest."""
    wave = np.zeros((len(t), n))
    for _ in range(3):
        pace, phase = rng.uniform(0.6, 4.5, n), rng.uniform(0, 2 * np.pi, n)
        size = rng.uniform(0.1, 0.9, n) / np.sqrt(pace)
        wave += size * (np.sin(np.outer(t, pace) + phase) - np.sin(phase))
    return wave * np.minimum(1.0, t / 0.5)[:, None]


def other_than_stated(world, servo, kind, j, rng):
    """The servo as it is, where it is not what the user states of joint j."""
    gains = servo.gains.checked(world.nv)
    if kind == "position gain":
        gains.stiffness[j] *= rng.uniform(1.3, 1.6) ** rng.choice([-1, 1])
        return replace(servo, gains=gains)
    _, _, positions, torques = recording(world, servo, {}, rng)  # what the motion takes
    speed = np.abs(np.gradient(positions[:, j], 1 / RATE))
    torque, share = np.abs(torques[:, j]), rng.uniform(0.03, 0.1)
    if kind == "current limit":
        # below what is stated, which some joints reach as they are
        gains.limit[j] = min(np.quantile(torque, 1 - share), 0.7 * gains.limit[j])
        return replace(servo, gains=gains)
    stall = rng.uniform(1.0, 1.3) * torque.max()
    drives = torques[:, j] * np.gradient(positions[:, j]) > 0
    fastest = np.quantile(np.where(drives, speed / (1 - 0.99 * torque / stall), 0), 1 - share)
    return replace(servo, voltage=(j, stall, fastest))


def recording(world, servo, hidden, rng):
    """One recording as arrays: command, encoder and torque at the rate of the log.

    ``hidden`` has for joints, counted from 0, what they hide; a delay is that of all commands.
    """
    data = mujoco.MjData(world)
    n, gains, size = world.nv, servo.gains, servo.scale
    t = np.arange(int(SECONDS / STEP)) * STEP
    wanted = reference(rng, n, t)
    late = round(0.03 / STEP) if "delay" in hidden.values() else 0
    commanded = np.vstack([np.repeat(wanted[:1], late, axis=0), wanted[: len(t) - late]])
    gears = [j for j, kind in hidden.items() if kind in ("elasticity", "backlash")]
    gap = {j: 0.012 if hidden[j] == "backlash" else 0.0 for j in gears}
    spring = {j: size[j] / (0.002 if gap[j] else 0.02) for j in gears}
    damper = {j: 0.1 * np.sqrt(spring[j] * servo.armature[j]) for j in gears}
    world.dof_frictionloss[:] = servo.friction
    world.dof_damping[:] = servo.viscous
    world.dof_armature[:] = servo.armature
    for j in gears:  # armature and friction are those of the motor
        world.dof_frictionloss[j] = world.dof_damping[j] = world.dof_armature[j] = 0.0
    motor, speed, carried = np.zeros(n), np.zeros(n), np.zeros(n)
    positions, driven = np.zeros((2, len(t), n))
    for k in range(len(t)):
        q, dq = data.qpos.copy(), data.qvel.copy()
        q[gears], dq[gears] = motor[gears], speed[gears]
        positions[k] = q
        torque = gains.torque(q[None], dq[None], commanded[k][None], 0 * q[None])[0]
        if servo.voltage is not None:
            j, stall, fastest = servo.voltage
            most = stall * (1 - np.array([-1, 1]) * dq[j] / fastest)
            torque[j] = np.clip(torque[j], -most[0], most[1])
        driven[k] = torque
        for j, kind in hidden.items():
            if kind == "stiction":
                slow = np.exp(-((dq[j] / 0.08) ** 2))
                world.dof_frictionloss[j] = servo.friction[j] + 0.15 * size[j] * slow
            elif kind == "load friction":
                world.dof_frictionloss[j] = servo.friction[j] + 0.2 * abs(carried[j])
        data.qfrc_applied[:] = torque
        for j in gears:
            turn, rate = motor[j] - data.qpos[j], speed[j] - data.qvel[j]
            wound = np.sign(turn) * max(abs(turn) - gap[j], 0.0)
            through = spring[j] * wound + damper[j] * rate * (wound != 0 or not gap[j])
            data.qfrc_applied[j] = through
            # implicit in dry and viscous friction of the motor
            mass = servo.armature[j] + STEP * servo.viscous[j]
            free = speed[j] * servo.armature[j] + STEP * (torque[j] - through)
            held = STEP * servo.friction[j]
            speed[j] = np.sign(free) * max(abs(free) - held, 0.0) / mass
            motor[j] += STEP * speed[j]
        mujoco.mj_step(world, data)
        # what moves and carries the links: all torques on the joint but what the rotor takes
        torques = data.qfrc_applied + data.qfrc_passive + data.qfrc_constraint
        carried = torques - world.dof_armature * data.qacc
    every = round(1 / RATE / STEP)
    return t[::every], wanted[::every], positions[::every], driven[::every]


def make_log(robot, kind, seed, second=None):
    """A log, the servo as stated and as it is, and the joints that hide an effect, maybe two."""
    rng = np.random.default_rng(seed)
    servo = servo_of(robot, rng)
    if kind == "load friction":  # where there is weight to carry
        q = rng.uniform(-1, 1, (50, robot.n_joints))
        j = int(np.argmax(robot.inverse_dynamics(q, 0 * q, 0 * q).std(axis=0) / servo.scale))
    else:
        j = int(rng.integers(robot.n_joints))
    hidden = {j: kind} if kind in KINDS else {}
    if second is not None:
        other = (j + 1 + int(rng.integers(robot.n_joints - 1))) % robot.n_joints
        hidden[other] = second
    with tempfile.TemporaryDirectory() as folder:
        write_mjcf(robot, Path(folder) / "arm.xml")
        world = mujoco.MjModel.from_xml_path(str(Path(folder) / "arm.xml"))
    world.opt.timestep = STEP
    world.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    world.jnt_limited[:] = 0
    true = other_than_stated(world, servo, kind, j, rng) if kind in SERVO_KINDS else servo
    frames = []
    for k in range(RECORDINGS):
        t, wanted, q, _ = recording(world, true, hidden, rng)
        q = np.round(q / ENCODER) * ENCODER
        names = range(1, robot.n_joints + 1)
        frames.append(
            pd.DataFrame(
                {"trajectory": k, "time": t}
                | {f"q{i}": q[:, i - 1] for i in names}
                | {f"dq{i}": np.gradient(q[:, i - 1], t) for i in names}
                | {f"q_ref{i}": wanted[:, i - 1] for i in names}
            )
        )
    joints = [j + 1, *(other + 1 for other in hidden if other != j)]
    return pd.concat(frames, ignore_index=True), servo, true, joints


def setting_of(true, kind, j):
    """True value of a setting of joint j, counted from 0."""
    gains = true.gains
    if kind == "voltage limit":
        return true.voltage[1]
    return (gains.stiffness if kind == "position gain" else gains.limit)[j]


def said(robot, log, servo):
    """Findings by kind and joints, their first parameters, and doubts about the measurement."""
    model = RBDRegressor(robot, ("viscous", "coulomb", "rotor_inertia"))
    diagnosis = diagnose(model, log, controller=servo.gains)
    diagnosis.explain_servo_motion()
    found, sizes = [], {}
    for effect in diagnosis.to_dict()["effects"]:
        found.append((effect["kind"], tuple(effect["joints"])))
        sizes[found[-1]] = next(iter(effect["parameters"].values()), None)
    return found, sizes, [(check.check, check.joints) for check in diagnosis.checks]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=int, default=40)
    parser.add_argument("--without", type=int, default=20)
    parser.add_argument("--servos", type=int, default=0, help="logs whose servo is not as stated")
    options = parser.parse_args()
    warnings.filterwarnings("ignore")  # remarks on the data
    hits = {kind: [] for kind in (*KINDS, *SERVO_KINDS, "nothing")}
    beside, other, covered = [], 0, []
    wanted = [list(KINDS)[k % len(KINDS)] for k in range(options.logs)]
    wanted += ["nothing"] * options.without
    wanted += [list(SERVO_KINDS)[k % len(SERVO_KINDS)] for k in range(options.servos)]
    for number, kind in enumerate(wanted):
        robot = ROBOTS[number // len(KINDS) % len(ROBOTS)]()
        log, servo, true, (joint,) = make_log(robot, kind, options.seed * 1000 + number)
        found, sizes, doubts = said(robot, log, servo)
        claimed = {(k, where) for k, where in found if k in SERVO_KINDS.values()}
        if kind == "nothing":
            hit = not found
        elif kind in SERVO_KINDS:
            wanted_setting = (SERVO_KINDS[kind], (joint,))
            hit = claimed == {wanted_setting}
            if hit:
                row = sizes[wanted_setting]
                covered.append(row["low"] <= setting_of(true, kind, joint - 1) <= row["high"])
        elif kind == "delay":
            hit = any(k in KINDS[kind] for k, _ in found) or any("delay" in k for k, _ in doubts)
        else:
            hit = any(k in KINDS[kind] and joint in joints for k, joints in found)
        hits[kind].append(hit)
        if kind in KINDS:
            other += bool(claimed)
            own = [k in KINDS[kind] and (kind == "delay" or joint in where) for k, where in found]
            named = [k != "unknown" for k, _ in found]
            beside.append(any(n and not o for n, o in zip(named, own, strict=True)))
        print(f"{robot.name:12s} {kind:14s} joint {joint}  {hit}  {found} {doubts}", flush=True)
    print("\n| hidden | named | logs |\n|---|---|---|")
    for kind, marks in hits.items():
        if marks:
            print(f"| {kind} | {sum(marks)} | {len(marks)} |")
    print(f"another name beside it: {sum(beside)} of {len(beside)}")
    print(f"a servo that is as stated is said to be otherwise in {other} of {len(beside)}")
    print(f"intervals of settings that contain the true value: {sum(covered)} of {len(covered)}")


if __name__ == "__main__":
    main()
