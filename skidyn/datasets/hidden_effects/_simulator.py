# SPDX-License-Identifier: BSD-3-Clause
"""Logs of a simulated robot with a physical effect that its nominal model lacks."""

from __future__ import annotations

import difflib
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from skidyn._exceptions import SkidynError
from skidyn._joint_numbers import joint_numbers
from skidyn._plain import plain
from skidyn._signals import Array
from skidyn.datasets.hidden_effects._friction import FRICTION
from skidyn.datasets.hidden_effects._hysteresis import HYSTERESIS
from skidyn.datasets.hidden_effects._motion import Motion, plan_motion
from skidyn.datasets.hidden_effects._rigid import RIGID
from skidyn.datasets.hidden_effects._sensor import SENSOR
from skidyn.datasets.hidden_effects._sensors import filtered_derivative, quantise, sensor_noise
from skidyn.datasets.hidden_effects._torque import TORQUE
from skidyn.datasets.hidden_effects._transmission import TRANSMISSION
from skidyn.datasets.hidden_effects._world import (
    LOADED_SHARE,
    Outcome,
    Simulate,
    World,
    true_parameters,
)

if TYPE_CHECKING:
    from sklearn.utils import Bunch

    from skidyn.robots import Robot

EffectSpec = str | Sequence[str] | Mapping[str, Mapping[str, Any] | None] | None

#: All effects that can be hidden. Transmissions are first, since the others act on the motor's
#: motion.
SIMULATED: dict[str, Simulate] = TRANSMISSION | FRICTION | HYSTERESIS | TORQUE | RIGID | SENSOR
#: Size of an effect relative to the spread of the joint's rigid-body torque, at magnitude 1.
SIZE = 0.25
BASE_SIZES = {"viscous": 0.15, "coulomb": 0.15, "rotor_inertia": 0.1, "offset": 0.05}
NOISE = {"low": 0.012, "high": 0.05}
#: Fine rate of the integration in Hz, and motion planned beyond the end (for delays) in s.
FINE_RATE, MARGIN = 1000.0, 0.3
PAIRS: tuple[str, ...] = ("coupled_friction", "coupled_inertia", "coupling_spring")
PAIRS += ("unknown_cable", "unknown_cross_drag", "unknown_pose_friction")
LOADED = ("load_dependent_friction", "gravity_compensator", "joint_elasticity", "saturation")
WHOLE = ("time_delay", "base_tilt", "external_wrench", "environment_contact")


def make_hidden_effect_log(
    robot: Robot,
    effect: EffectSpec = "dahl",
    *,
    joints: int | Sequence[int] | None = None,
    magnitude: float | None = None,
    noise: Literal["low", "high"] | float = "low",
    n_trajectories: int = 10,
    duration: float = 10.0,
    rate: float = 100.0,
    base: Sequence[str] = ("viscous", "coulomb"),
    random_state: int | np.random.Generator | np.random.RandomState | None = 0,
) -> Bunch:
    """Simulate a log of a robot that has a physical effect which its nominal model lacks.

    The robot moves along multi-sines at slow, medium and fast speed and from point to point with
    rests. Its true link parameters differ from the nominal ones by 10 to 20 %. Positions are
    quantised, velocities noisy, torque noise is partly coloured. States of hysteresis and play are
    integrated along the motion at about 1 kHz. The simulation shares no code with the catalogue
    of effects that is fitted to such logs.

    Parameters
    ----------
    robot : Robot
        Nominal robot.
    effect : str, sequence of str, mapping or None, default="dahl"
        Hidden effect: a kind of :func:`hidden_effect_kinds`, several of them, a mapping of kinds to
        ``{"joints": [...], "magnitude": ...}``, or None for a log without a hidden effect.
    joints : int or sequence of int, optional
        Joints that have the effect, counted from 1; a suitable choice if None. Pairs take two.
    magnitude : float, default=1.0
        Factor on the usual size, for which the effect is about a quarter of the spread of the
        rigid-body torque of the joint.
    noise : {"low", "high"} or float, default="low"
        Standard deviation of the torque noise relative to the spread of the torque; low is 1.2 %,
        high 5 %.
    n_trajectories : int, default=10
        Number of trajectories.
    duration : float, default=10.0, s
        Length of each trajectory.
    rate : float, default=100.0, Hz
        Sampling rate.
    base : sequence of str, default=("viscous", "coulomb")
        Effects of every joint that the model of the user already contains.
    random_state : int, Generator, RandomState or None, default=0
        Seed of random numbers. Motion and robot do not depend on the effect, so logs with the same
        seed can be compared.

    Returns
    -------
    Bunch
        ``frame``: the log as a DataFrame ``time, trajectory, q1 .., dq1 .., tau1 ..`` and
        ``temp1 ..`` for thermal effects; ``X``: DataFrame of ``time, trajectory, q1 .., dq1 ..,
        ddq1 ..`` with accelerations from the measured velocities by a zero-phase 10 Hz low-pass;
        ``y``: torques of shape (n_samples, n_joints); ``effect``, ``joints`` (from 1),
        ``parameters``: kind, place and true values of the first effect (None, (), {} without);
        ``truth``: tuple of dicts with ``kind, joints, parameters, variables, formula``, one per
        effect; ``base``; ``noise_std`` of shape (n_joints,), N m or N; ``robot``;
        ``true_parameters`` of shape (n_bodies, 10).

    Raises
    ------
    SkidynError
        The effect is unknown, does not fit the robot, or joints do not exist.

    Examples
    --------
    >>> from skidyn.datasets import load_planar_arm, make_hidden_effect_log
    >>> log = make_hidden_effect_log(
    ...     load_planar_arm(), "dahl", joints=[2], n_trajectories=2, duration=2.0
    ... )
    >>> log.frame.shape, log.effect, log.joints
    ((400, 8), 'dahl', (2,))
    >>> sorted(log.parameters)
    ['Fc', 'presliding', 'sigma0']
    """
    specs = _effect_specs(effect, joints, magnitude)
    motion_rng, robot_rng, sensor_rng, effect_rng, base_rng = _generators(random_state, 5)
    world = _make_world(robot, n_trajectories, duration, rate, motion_rng, robot_rng, effect_rng)
    outcomes: list[tuple[str, Outcome]] = []
    for kind in sorted(specs, key=lambda name: name not in TRANSMISSION):
        chosen = _choose_joints(kind, specs[kind]["joints"], world)
        outcome = SIMULATED[kind](world, chosen, SIZE * specs[kind]["magnitude"])
        if outcome.motor is not None:
            world = _with_motor(world, *outcome.motor)
        outcomes.append((kind, outcome))
    outcomes.sort(key=lambda item: list(specs).index(item[0]))
    torque = _total_torque(replace(world, rng=base_rng), base, [o for _, o in outcomes])
    return _record(world, torque, outcomes, noise, rate, tuple(base), sensor_rng)


def hidden_effect_kinds() -> tuple[str, ...]:
    """Kinds of effects that :func:`make_hidden_effect_log` can hide.

    Returns
    -------
    tuple of str
        Kinds of the catalogue, and ``unknown_...`` for effects that are not in the catalogue.

    Examples
    --------
    >>> "lugre" in hidden_effect_kinds()
    True
    """
    return tuple(sorted(SIMULATED))


def _effect_specs(
    effect: EffectSpec, joints: int | Sequence[int] | None, magnitude: float | None
) -> dict[str, dict[str, Any]]:
    """Joints and magnitude of each requested effect."""
    common = {"joints": joints, "magnitude": 1.0 if magnitude is None else float(magnitude)}
    if effect is None:
        return {}
    if isinstance(effect, Mapping):
        specs = {kind: common | dict(options or {}) for kind, options in effect.items()}
    else:
        kinds = [effect] if isinstance(effect, str) else list(effect)
        specs = {kind: dict(common) for kind in kinds}
    for kind, options in specs.items():
        if kind not in SIMULATED:
            close = difflib.get_close_matches(kind, SIMULATED, n=1)
            hint = f" Did you mean {close[0]!r}?" if close else ""
            raise SkidynError(
                f"effect {kind!r} cannot be simulated.{hint} Known: {', '.join(sorted(SIMULATED))}."
            )
        surplus = set(options) - {"joints", "magnitude"}
        if surplus:
            raise SkidynError(f"effect {kind!r}: unknown option(s) {', '.join(sorted(surplus))}.")
    return specs


def _generators(
    random_state: int | np.random.Generator | np.random.RandomState | None, n: int
) -> list[np.random.Generator]:
    if isinstance(random_state, np.random.RandomState):
        random_state = int(random_state.randint(2**31))
    if isinstance(random_state, numbers.Integral):
        random_state = int(random_state)
    return np.random.default_rng(random_state).spawn(n)


def _make_world(
    robot: Robot,
    n_trajectories: int,
    duration: float,
    rate: float,
    motion_rng: np.random.Generator,
    robot_rng: np.random.Generator,
    effect_rng: np.random.Generator,
) -> World:
    """Motion, clock, temperatures and rigid-body torque."""
    n_samples = round(duration * rate)
    if n_trajectories < 1 or n_samples < 10:
        raise SkidynError("a log needs at least one trajectory and ten samples in each.")
    stride = int(np.ceil(FINE_RATE / rate))
    step = 1 / (rate * stride)
    n_fine = n_samples * stride + round(MARGIN / step)
    fine = plan_motion(robot, n_trajectories, step, n_fine, motion_rng)
    sampled = fine.every(stride)
    motion = Motion(*(a[:, :n_samples] for a in (sampled.q, sampled.dq, sampled.ddq)))
    pauses = motion_rng.uniform(60, 300, n_trajectories)
    starts = np.cumsum(pauses) + duration * np.arange(n_trajectories)
    time = np.round(starts, 3)[:, None] + np.arange(n_samples) / rate
    world = World(
        robot=robot,
        parameters=true_parameters(robot, robot_rng),
        motion=motion,
        fine=fine,
        step=step,
        stride=stride,
        time=time,
        temperature=_warm_up(time, robot.n_joints, robot_rng),
        rigid=np.empty_like(motion.q),
        scale=np.empty(robot.n_joints),
        rng=effect_rng,
    )
    rigid = world.torque()
    scale = np.asarray(rigid.reshape(-1, robot.n_joints).std(axis=0))
    # joints with very little load still have a relevant friction
    return replace(world, rigid=rigid, scale=np.maximum(scale, 0.02 * scale.max()))


def _warm_up(time: Array, n_joints: int, rng: np.random.Generator) -> Array:
    """Joints that warm up from 23 degrees Celsius with time constants of several minutes."""
    gain, constant = rng.uniform(10, 22, n_joints), rng.uniform(400, 800, n_joints)
    passed = (time - time[0, 0] + 30)[..., None]
    return np.asarray(23.0 + gain * (1 - np.exp(-passed / constant)))


def _choose_joints(kind: str, joints: int | Sequence[int] | None, world: World) -> list[int]:
    """Joints from 0: the requested ones, or ones on which the effect is visible."""
    n = world.n_joints
    if joints is not None:
        joints = joint_numbers(joints)
        wrong = [j for j in joints if not 1 <= j <= n]
        if wrong or len(set(joints)) != len(joints):
            raise SkidynError(f"joints are counted from 1 to {n}, each once; got {joints}.")
        if kind in PAIRS and len(joints) != 2:
            raise SkidynError(f"effect {kind!r} couples two joints; got {joints}.")
        return [j - 1 for j in joints]
    if kind in WHOLE:
        return list(range(n))
    if kind in PAIRS:
        if n < 2:
            raise SkidynError(f"effect {kind!r} couples two joints; the robot has one.")
        return [n - 2, n - 1] if kind.startswith("coupl") else [max(0, n - 4), max(0, n - 4) + 1]
    if kind in LOADED:
        return [int(np.argmax(world.scale))]
    usual = world.scale > LOADED_SHARE * world.scale.max()
    if kind == "backlash":  # visible where the load changes its sign
        mean = np.abs(world.rigid.reshape(-1, n).mean(axis=0))
        return [int(np.argmin(np.where(usual, mean / world.scale, np.inf)))]
    if kind == "rotor_inertia" and usual[1:].any():
        usual[0] = False  # an inertia about the first axis is also the arm's
    return [int(world.rng.choice(np.flatnonzero(usual)))]


def _with_motor(world: World, deflection: Array, rate: Array) -> World:
    """The world with the motion of the motors, which the encoders log."""
    fine = Motion(world.fine.q + deflection, world.fine.dq + rate, world.fine.ddq)
    sampled = fine.every(world.stride)
    n = world.n_samples
    motion = Motion(sampled.q[:, :n], sampled.dq[:, :n], world.motion.ddq)
    return replace(world, fine=fine, motion=motion)


def _total_torque(world: World, base: Sequence[str], outcomes: Sequence[Outcome]) -> Array:
    """True torque of the motors: rigid body, known effects and hidden effects."""
    torque, every = world.rigid.copy(), list(range(world.n_joints))
    replaced = sorted({j for o in outcomes if o.replaces_coulomb for j in o.joints})
    for kind in base:
        if kind == "rigid_body":
            continue
        if kind not in SIMULATED:
            raise SkidynError(f"base: {kind!r} cannot be simulated.")
        known = SIMULATED[kind](world, every, BASE_SIZES.get(kind, 0.1)).torque
        assert known is not None
        if kind == "coulomb":
            known[..., replaced] = 0.0
        torque += known
    for outcome in outcomes:
        if outcome.torque is not None:
            torque += outcome.torque
    return torque


def _record(
    world: World,
    torque: Array,
    outcomes: Sequence[tuple[str, Outcome]],
    noise: Literal["low", "high"] | float,
    rate: float,
    base: tuple[str, ...],
    rng: np.random.Generator,
) -> Bunch:
    """Motion and torque with the errors of the sensors."""
    level = NOISE[noise] if isinstance(noise, str) else float(noise)
    n = world.n_joints
    noise_std = level * torque.reshape(-1, n).std(axis=0)
    gain, delay = np.ones(n), np.zeros(n)
    for _, outcome in outcomes:
        gain[outcome.joints] *= outcome.gain
        delay[outcome.joints] += outcome.delay
    q, dq = (_sampled_late(a, delay, world) for a in (world.fine.q, world.fine.dq))
    q = quantise(q, np.where(world.prismatic, 4e-6, 2 * np.pi / 2**17))
    speed_noise = 0.2 * level * dq.reshape(-1, n).std(axis=0)
    dq = dq + speed_noise * rng.standard_normal(dq.shape)
    logged = gain * torque + sensor_noise(torque.shape, noise_std, 1 / rate, rng)
    for _, outcome in outcomes:
        if outcome.limit is not None:
            j = outcome.joints
            logged[..., j] = np.clip(logged[..., j], -outcome.limit, outcome.limit)
    temperature = None
    if any(outcome.uses_temperature for _, outcome in outcomes):
        noisy = world.temperature + 0.1 * rng.standard_normal(world.temperature.shape)
        temperature = quantise(noisy, 0.25)
    return _bunch(world, q, dq, logged, temperature, outcomes, noise_std, 1 / rate, base)


def _sampled_late(fine: Array, delay: Array, world: World) -> Array:
    """Signals of the fine clock at the samples, later by ``delay`` per joint."""
    n = world.n_samples
    samples = world.stride * np.arange(n)
    if not delay.any():
        return fine[:, samples]
    if delay.max() > MARGIN - world.step:
        raise SkidynError(f"a delay of {delay.max():.3g} s is too long; at most {MARGIN} s.")
    late = np.empty((fine.shape[0], n, fine.shape[2]))
    for j, seconds in enumerate(delay):
        whole, part = divmod(seconds / world.step, 1.0)
        rows = samples + int(whole)
        late[..., j] = (1 - part) * fine[:, rows, j] + part * fine[:, rows + 1, j]
    return late


def _bunch(
    world: World,
    q: Array,
    dq: Array,
    torque: Array,
    temperature: Array | None,
    outcomes: Sequence[tuple[str, Outcome]],
    noise_std: Array,
    sample_time: float,
    base: tuple[str, ...],
) -> Bunch:
    import pandas as pd
    from sklearn.utils import Bunch  # a second of imports: only where a log is made

    n = world.n_joints
    keys = {
        "time": world.time.ravel(),
        "trajectory": np.repeat(np.arange(1, world.n_trajectories + 1), world.n_samples),
    }
    blocks = {"q": q, "dq": dq, "ddq": filtered_derivative(dq, sample_time), "tau": torque}
    if temperature is not None:
        blocks["temp"] = temperature
    columns = {
        name: {f"{name}{j + 1}": block[..., j].ravel() for j in range(n)}
        for name, block in blocks.items()
    }
    thermal = columns.get("temp", {})
    frame = pd.DataFrame(keys | columns["q"] | columns["dq"] | columns["tau"] | thermal)
    frame.attrs = {"joint_names": list(world.robot.joint_names)}
    X = pd.DataFrame(keys | columns["q"] | columns["dq"] | columns["ddq"] | thermal)
    truth = tuple(_truth(kind, outcome) for kind, outcome in outcomes)
    first = truth[0] if truth else {"kind": None, "joints": (), "parameters": {}}
    return Bunch(
        frame=frame,
        X=X,
        y=np.ascontiguousarray(torque.reshape(-1, n)),
        effect=first["kind"],
        joints=first["joints"],
        parameters=first["parameters"],
        truth=truth,
        base=base,
        noise_std=noise_std,
        robot=world.robot,
        true_parameters=world.parameters,
    )


def _truth(kind: str, outcome: Outcome) -> dict[str, Any]:
    """The answer of one effect in plain types."""
    return {
        "kind": "unknown" if kind.startswith("unknown") else kind,
        "joints": tuple(j + 1 for j in outcome.joints),
        "parameters": plain(outcome.parameters),
        "variables": outcome.variables,
        "formula": outcome.formula,
    }
