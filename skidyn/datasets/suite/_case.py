# SPDX-License-Identifier: BSD-3-Clause
"""One log of the suite: robot, motion, effects, sensors, truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from skidyn.datasets.suite._friction import FRICTION
from skidyn.datasets.suite._hidden import Hidden, Setting
from skidyn.datasets.suite._measurement import MEASUREMENT
from skidyn.datasets.suite._motion import Motion, plan
from skidyn.datasets.suite._nameless import NAMELESS
from skidyn.datasets.suite._once import ONCE
from skidyn.datasets.suite._plant import engine, inertia_matrix, inverse, rigid_model, true_bodies
from skidyn.datasets.suite._record import LEVEL, Sensors, left_by_base, measure, sample, truth_of
from skidyn.datasets.suite._robots import DRIVES
from skidyn.datasets.suite._simulate import Robotics, record_all
from skidyn.datasets.suite._structure import STRUCTURE

if TYPE_CHECKING:
    from skidyn.datasets.suite._suite import SuiteCase

NAMED = FRICTION | STRUCTURE | MEASUREMENT
#: Range of the effect's strength and torque noise of each tier.
TIERS: dict[str, tuple[tuple[float, float], str]] = {
    "low": ((0.4, 1.0), "low"),
    "high": ((0.7, 1.2), "high"),
    "hard": ((0.28, 0.5), "high"),
    "short": ((0.6, 1.0), "low"),
    "rough": ((0.6, 1.2), "low"),
}
#: Usual effects of every robot, and effects of a user's model.
BASE = ("rigid_body", "viscous", "coulomb", "rotor_inertia")
RATES = (100, 125, 200)
#: Rates of logs that can show the kind; other kinds are visible at any of ``RATES``.
FAST = {
    "backlash": (250, 500),
    "joint_elasticity": (250, 500),
    "saturation": (100, 250),
    "time_delay": (200, 250, 500),
    "torque_ripple": (125, 250, 500),
}
SECONDS = {100: 10.0, 125: 8.0, 200: 5.0, 250: 4.5, 500: 3.0}
SHORT_SECONDS = {100: 6.0, 125: 6.0, 200: 4.0, 250: 3.5, 500: 2.0}
PACES = ("slow", "fast", "medium", "fast", "medium")
SHORT_PACES = ("points", "points", "medium", "points", "slow", "points")


def simulate(case: SuiteCase) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Columns of the log, information for the tool, and the truth."""
    motion_rng, robot_rng, effect_rng, sensor_rng = np.random.default_rng([*case.entropy, 1]).spawn(
        4
    )
    rate = _rate(case.kinds, sensor_rng)
    duration = (SHORT_SECONDS if case.tier == "short" else SECONDS)[rate]
    motions = _motions(case, duration, motion_rng)
    strengths, noise = TIERS[case.tier]
    setting = _setting(case.robot, motions, duration, effect_rng.uniform(*strengths), effect_rng)
    makers = NAMED
    if case.content in ("nameless", "once"):
        makers = NAMELESS if case.content == "nameless" else ONCE
    hidden = [makers[kind](setting) for kind in case.kinds]
    values = {
        "viscous": setting.viscous,
        "coulomb": setting.coulomb,
        "rotor": setting.rotor,
    }
    bodies = true_bodies(rigid_model(case.robot), robot_rng)
    recordings = record_all(
        Robotics(case.robot, values, bodies), setting, hidden, motions, robot_rng
    )
    sensors = _sensors(case.tier, rate, noise, hidden, sensor_rng)
    delay = {j: lag for item in hidden for j, lag in item.delay.items()}
    rows = sample(recordings, sensors, delay, sensor_rng)
    for item in hidden:
        if item.log:
            item.log(rows)
    noise_std = sensor_rng.uniform(*LEVEL[sensors.noise]) * np.abs(rows["tau"]).max(axis=0)
    columns = measure(rows, sensors, noise_std, setting.sliders, sensor_rng)
    lacks = {item.missing_from_base for item in hidden}
    base = [name for name in BASE if name not in lacks]
    left, resting = left_by_base(case.robot, rows, base, noise_std, setting.sliders)
    identity = asdict(case) | {"case": case.name, "kinds": list(case.kinds)}
    meta = {
        "case": case.name,
        "robot": case.robot,
        "dof": DRIVES[case.robot].n_joints,
        "joint_types": ["prismatic" if s else "revolute" for s in setting.sliders],
        "base_model": base,
        "nominal_rate_hz": rate,
        "position_bits": sensors.bits,
        "columns": list(columns),
        "note": "inertial parameters of the URDF are 10 to 20 % off; tau is the actuator's torque",
    }
    truth = identity | {"rate": rate, "base_model": base, "rest_share": resting.tolist()}
    truth |= {"sensors": asdict(sensors), "n_rows": len(rows["q"])}
    truth |= truth_of(hidden, left, noise_std, len(rows["q"]), sensors)
    return columns, meta, truth


def _rate(kinds: Sequence[str], rng: np.random.Generator) -> int:
    """A rate in Hz at which the log can show all kinds of effects."""
    rates = [FAST[k] for k in kinds if k in FAST] or [RATES]
    both = sorted(set(rates[0]).intersection(*rates)) or [max(rates[0])]
    return int(rng.choice(both))


def _motions(case: SuiteCase, duration: float, rng: np.random.Generator) -> list[Motion]:
    """Motions of the usual paces, in a random order."""
    short = case.tier == "short"
    paces = list(SHORT_PACES if short else PACES * 2)
    if not short and rng.random() < 0.3:
        paces[2] = paces[-1] = "points"
    drives = DRIVES[case.robot]
    return [plan(paces[i], drives, duration, rng) for i in rng.permutation(len(paces))]


def _sensors(
    tier: str, rate: int, noise: str, hidden: Sequence[Hidden], rng: np.random.Generator
) -> Sensors:
    short, rough = tier == "short", tier == "rough"
    warm = any(item.needs_temperature for item in hidden)
    hides_warmth = any(item.kind == "friction_drift" for item in hidden)
    return Sensors(
        rate=rate,
        noise="high" if short and rng.random() < 0.5 else noise,
        irregular=bool(rng.random() < (0.6 if rough else 0.1)),
        jitter=float(rng.uniform(5e-5, 3e-4)) if rough else 0.0,
        bits=int(rng.choice([13, 14, 15] if rough else [17, 18, 19, 20])),
        velocity=str(rng.choice(["measured", "differences"])),
        acceleration=bool(rng.random() < 0.12),
        temperature=(warm or bool(rng.random() < 0.2)) and not hides_warmth,
    )


def _setting(
    robot: str,
    motions: Sequence[Motion],
    duration: float,
    strength: float,
    rng: np.random.Generator,
) -> Setting:
    """Usual sizes from the nominal robot along the planned motions."""
    drives, model = DRIVES[robot], rigid_model(robot)
    mujoco = engine()
    data = mujoco.MjData(model)
    viscous = np.array(drives.viscous, float) * rng.uniform(0.8, 1.25, drives.n_joints)
    coulomb = np.array(drives.coulomb, float) * rng.uniform(0.8, 1.25, drives.n_joints)
    clock = np.arange(0, duration, 0.05)
    q, dq, ddq = (np.vstack(parts) for parts in zip(*(m(clock) for m in motions), strict=True))
    tool, torque = np.empty((len(q), 3)), np.empty_like(q)
    for i in range(len(q)):
        torque[i] = inverse(model, data, q[i], dq[i], ddq[i])
        tool[i] = data.xpos[model.nbody - 1]
    torque += viscous * dq + coulomb * np.sign(dq)
    inertia = np.mean([np.diag(inertia_matrix(model, data, x)) for x in q[::40]], axis=0)
    sliders = np.zeros(drives.n_joints, bool)
    sliders[list(drives.sliders)] = True
    return Setting(
        rng=rng,
        strength=strength,
        centre=np.array(drives.centre, float),
        stroke=np.array(drives.stroke, float),
        speed=np.array(drives.speed, float),
        acceleration=np.array(drives.acceleration, float),
        sliders=sliders,
        viscous=viscous,
        coulomb=coulomb,
        rotor=np.array(drives.rotor) * rng.uniform(0.85, 1.15, drives.n_joints),
        torque=np.maximum(np.sqrt((torque**2).mean(axis=0)), 1.2 * coulomb),
        inertia=inertia,
        stiffness=np.array(drives.stiffness, float),
        payload=drives.payload,
        push=drives.push,
        positions=q,
        tool=tool,
        n_trajectories=len(motions),
        duration=duration,
    )
