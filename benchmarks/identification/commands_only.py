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
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from dataclasses import dataclass
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


def recording(world, servo, hidden, rng):
    """One recording as arrays: command and encoder at the rate of the log.

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
    positions = np.zeros((len(t), n))
    for k in range(len(t)):
        q, dq = data.qpos.copy(), data.qvel.copy()
        q[gears], dq[gears] = motor[gears], speed[gears]
        positions[k] = q
        torque = gains.torque(q[None], dq[None], commanded[k][None], 0 * q[None])[0]
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
    return t[::every], wanted[::every], positions[::every]


def make_log(robot, kind, seed, second=None):
    """A log, the servo, and the joints that hide the effect and maybe a second one."""
    rng = np.random.default_rng(seed)
    servo = servo_of(robot, rng)
    if kind == "load friction":  # where there is weight to carry
        q = rng.uniform(-1, 1, (50, robot.n_joints))
        j = int(np.argmax(robot.inverse_dynamics(q, 0 * q, 0 * q).std(axis=0) / servo.scale))
    else:
        j = int(rng.integers(robot.n_joints))
    hidden = {} if kind == "nothing" else {j: kind}
    if second is not None:
        other = (j + 1 + int(rng.integers(robot.n_joints - 1))) % robot.n_joints
        hidden[other] = second
    with tempfile.TemporaryDirectory() as folder:
        write_mjcf(robot, Path(folder) / "arm.xml")
        world = mujoco.MjModel.from_xml_path(str(Path(folder) / "arm.xml"))
    world.opt.timestep = STEP
    world.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    world.jnt_limited[:] = 0
    frames = []
    for k in range(RECORDINGS):
        t, wanted, q = recording(world, servo, hidden, rng)
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
    return pd.concat(frames, ignore_index=True), servo, joints


def said(robot, log, servo):
    """Findings by kind and joints, and what is doubted of the measurement."""
    model = RBDRegressor(robot, ("viscous", "coulomb", "rotor_inertia"))
    diagnosis = diagnose(model, log, controller=servo.gains)
    found = [(f.kind, tuple(f.joints)) for f in diagnosis.findings]
    named = [(f.kind, (f.joint,)) for f in diagnosis.explain_servo_motion()]
    return found + named, [check.check for check in diagnosis.checks]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--logs", type=int, default=40)
    parser.add_argument("--without", type=int, default=20)
    options = parser.parse_args()
    warnings.filterwarnings("ignore")  # remarks on the data
    hits = {kind: [] for kind in (*KINDS, "nothing")}
    beside = []
    wanted = [list(KINDS)[k % len(KINDS)] for k in range(options.logs)]
    for number, kind in enumerate([*wanted, *["nothing"] * options.without]):
        robot = ROBOTS[number // len(KINDS) % len(ROBOTS)]()
        log, servo, (joint,) = make_log(robot, kind, options.seed * 1000 + number)
        found, doubts = said(robot, log, servo)
        if kind == "nothing":
            hit = not found
        elif kind == "delay":
            hit = any(k in KINDS[kind] for k, _ in found) or any("delay" in d for d in doubts)
        else:
            hit = any(k in KINDS[kind] and joint in joints for k, joints in found)
        hits[kind].append(hit)
        if kind != "nothing":
            own = [k in KINDS[kind] and (kind == "delay" or joint in where) for k, where in found]
            named = [k != "unknown" for k, _ in found]
            beside.append(any(n and not o for n, o in zip(named, own, strict=True)))
        print(f"{robot.name:12s} {kind:14s} joint {joint}  {hit}  {found} {doubts}", flush=True)
    print("\n| hidden | named | logs |\n|---|---|---|")
    for kind, marks in hits.items():
        if marks:
            print(f"| {kind} | {sum(marks)} | {len(marks)} |")
    print(f"another name beside it: {sum(beside)} of {len(beside)}")


if __name__ == "__main__":
    main()
